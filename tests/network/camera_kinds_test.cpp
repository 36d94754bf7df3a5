// SPDX-License-Identifier: Apache-2.0
// Networks of cameras with Brown's distortion and of equirectangular panoramas.
#include <cmath>

#include "libocc/network/adjust.hpp"
#include "libocc/network/precision.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

// Coefficients in millimetres: a camera of 5 mm with 200 pixels per millimetre.
const std::vector<double> coefficients{2e-3, -4e-5, 3e-7, 1e-4, -8e-5, 3e-4, -2e-4};
const std::vector<std::string> lens{"f_px", "cx_px", "cy_px", "a1", "a2", "b1", "b2", "c1", "c2"};

std::vector<Network> networks() {
  Network panorama =
      test::cloud_network(Camera::equirectangular(4000, 2000, 2 * pi / 3990, 640, 1998, 1003),
                          {"angle_per_px_rad", "fy_px", "cy_px"}, 8, 60);
  return {test::cloud_network(
              Camera::brown_forward(1280, 960, 1000, 1010, 645, 470, coefficients, 200, 2.5), lens,
              8, 60),
          test::cloud_network(
              Camera::brown_backward(1280, 960, 1000, 1010, 645, 470, coefficients, 200, 2.5), lens,
              8, 60),
          panorama};
}

TEST(CameraKinds, NoiseFreeNetworksAreRecovered) {
  for (const Network& truth : networks()) {
    SCOPED_TRACE(name_of(truth.cameras[0].camera.kind()));
    Network start = noisy_network(truth, 3, 0.02);
    for (std::size_t i = 0; i < start.observations.size(); ++i)
      start.observations[i].pixel = truth.observations[i].pixel;
    for (const std::string& name : truth.cameras[0].free_parameters) {
      const double value = free_parameter(truth.cameras[0].camera, name).value;
      start.cameras[0].camera =
          with_free_parameter(start.cameras[0].camera, name, value + 0.003 * std::abs(value));
    }
    const auto found = adjust(start, test::plain());
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_LT(found->cost, 1e-12);
    for (const std::string& name : truth.cameras[0].free_parameters) {
      const double value = free_parameter(truth.cameras[0].camera, name).value;
      EXPECT_NEAR(free_parameter(found->network.cameras[0].camera, name).value, value,
                  1e-5 * std::abs(value))
          << name;
    }
  }
}

// Noise of the stated size gives a sigma0 near 1, and errors of the parameters within 4 sigmas.
TEST(CameraKinds, StandardDeviationsDescribeTheErrors) {
  for (const Network& truth : networks()) {
    SCOPED_TRACE(name_of(truth.cameras[0].camera.kind()));
    const auto found = adjust(noisy_network(truth, 8, 0.01), test::plain());
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_NEAR(found->sigma0, 1, 0.15);
    const auto known = precision(found->network);
    ASSERT_TRUE(known.ok()) << known.message;
    const Eigen::MatrixXd covariance = known->parameters(0);
    const auto& names = truth.cameras[0].free_parameters;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double off = free_parameter(found->network.cameras[0].camera, names[k]).value -
                         free_parameter(truth.cameras[0].camera, names[k]).value;
      EXPECT_LT(std::abs(off), 4 * std::sqrt(covariance(at, at))) << names[k];
    }
  }
}

// A point across the seam: the column that is observed differs by a period from the projected one.
TEST(CameraKinds, ColumnsBeyondTheSeamAreThoseOfTheNextRotation) {
  Network truth = networks().back();
  const double period = truth.cameras[0].camera.period_px();
  for (std::size_t i = 0; i < truth.observations.size(); i += 7)
    truth.observations[i].pixel.x() += period;
  truth.cameras[0].camera =
      with_free_parameter(truth.cameras[0].camera, "angle_per_px_rad", 1.001 * 2 * pi / period);
  const auto found = adjust(truth, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(found->cost, 1e-12);
  EXPECT_NEAR(found->network.cameras[0].camera.period_px(), period, 1e-6);
}

}  // namespace
}  // namespace occ
