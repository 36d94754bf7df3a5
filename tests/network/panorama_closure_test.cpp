// SPDX-License-Identifier: Apache-2.0
// Panoramas with overlapping ends: points observed in the second revolution contribute to the angle
// per column with the correct derivative.
#include <gtest/gtest.h>

#include <cmath>

#include "libocc/network/adjust.hpp"
#include "libocc/network/test_field.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

double angle_of(const Network& network) { return network.cameras[0].camera.parameters()[0].value; }

/// Exact network with a relative error of the camera's angle per column.
Network with_angle_off(Network network, double part) {
  Camera& camera = network.cameras[0].camera;
  const std::vector<CameraParameter> parameters = camera.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i)
    values[static_cast<Eigen::Index>(i)] = parameters[i].value;
  values[0] *= 1 + part;
  camera = camera.with_parameters(values);
  return network;
}

TEST(PanoramaClosure, UsesPointsOfTheSecondRevolution) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.targets = 60;
  const Network truth = simulate_test_field(design).truth;
  const double period = truth.cameras[0].camera.period_px();
  Network seen = truth;
  int moved = 0;
  for (ImageObservation& observation : seen.observations)
    if (observation.pixel.x() < 0.1 * period) {
      observation.pixel.x() += period;
      ++moved;
    }
  ASSERT_GT(moved, 10);
  int calls = 0;
  AdjustOptions options;
  options.robust = options.snooping = false;
  const Result<Adjustment> adjusted = adjust(with_angle_off(seen, 1e-5), options,
                                             [&](const AdjustProgress&) { return ++calls > 0; });
  ASSERT_EQ(adjusted.status, Status::ok) << adjusted.message;
  EXPECT_LT(adjusted->iterations, 8);  // with a wrong derivative it does not converge in 100
  EXPECT_NEAR(angle_of(adjusted->network) / angle_of(truth), 1, 1e-12);
}

}  // namespace
}  // namespace occ
