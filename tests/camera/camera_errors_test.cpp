// SPDX-License-Identifier: Apache-2.0
// Covariance of a camera's parameters: roots, names, and what is no covariance.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "libocc/camera/camera.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Camera lens() { return Camera::pinhole(640, 480, 500, 510, 320, 240, {0.1, 0.01, 0, 0}); }

std::string complaint(const std::map<std::string, double>& sigmas) {
  return test::complaint<std::invalid_argument>([&] { lens().with_parameter_sigmas(sigmas); });
}

std::string complaint(const Eigen::MatrixXd& covariance) {
  return test::complaint<std::invalid_argument>(
      [&] { lens().with_parameter_covariance(covariance); });
}

Eigen::MatrixXd some_covariance() {
  Eigen::MatrixXd half(9, 4);
  for (Eigen::Index i = 0; i < half.size(); ++i)
    half(i) = std::sin(1.7 * static_cast<double>(i * i)) * (i % 9 < 5 ? 3 : 0.01);
  return half * half.transpose();
}

TEST(CameraErrors, TheRootsProductIsTheCovariance) {
  const Eigen::MatrixXd covariance = some_covariance();
  const Camera camera = lens().with_parameter_covariance(covariance);
  const Eigen::MatrixXd root = camera.root_of_covariance();
  EXPECT_EQ(root.cols(), 4);
  EXPECT_LT((root * root.transpose() - covariance).norm(), 1e-9 * covariance.norm());
  EXPECT_EQ(camera.parameter_covariance(), covariance);
  EXPECT_FALSE(camera.is_exact());
  EXPECT_FALSE(camera.independent_sigmas());
}

TEST(CameraErrors, SigmasOfNames) {
  const std::map<std::string, double> sigmas{{"fx_px", 3}, {"cy_px", 0.5}, {"k2", 0.02}};
  const Camera camera = lens().with_parameter_sigmas(sigmas);
  EXPECT_EQ(camera.independent_sigmas(), sigmas);
  EXPECT_EQ(camera.root_of_covariance().cols(), 3);
}

TEST(CameraErrors, ACoefficientThatTheCameraDoesNotHaveIsAdded) {
  const Camera plain = Camera::pinhole(640, 480, 500, 500, 320, 240);
  EXPECT_EQ(plain.with_parameter_sigmas({{"k1", 0.1}}).distortion().size(), 4U);
  EXPECT_EQ(plain.with_parameter_sigmas({{"k1", 0.1}, {"k3", 0.1}}).distortion().size(), 5U);
  const Camera wide = Camera::fisheye(640, 480, 300, 300, 320, 240);
  EXPECT_EQ(wide.with_parameter_sigmas({{"k1", 0.1}}).distortion().size(), 4U);
  const Eigen::Vector3d point(0.3, -0.2, 1);
  EXPECT_EQ(*plain.project(point), *plain.with_parameter_sigmas({{"k1", 0.1}}).project(point));
}

TEST(CameraErrors, ACommonErrorOfBothFocalLengthsKeepsTheirRatio) {
  const Camera camera = lens().with_parameter_sigmas({{"f_px", 10}, {"fy_px", 1}, {"k1", 0.1}});
  const Eigen::MatrixXd covariance = camera.parameter_covariance();
  EXPECT_DOUBLE_EQ(covariance(0, 0), 100);
  EXPECT_DOUBLE_EQ(covariance(0, 1), 102);  // 10 * 10 * 510 / 500
  EXPECT_DOUBLE_EQ(covariance(1, 1), 10.2 * 10.2 + 1);
  EXPECT_EQ(camera.root_of_covariance().cols(), 3);
  const Camera sphere = Camera::equirectangular(3600, 1800, 1e-3, 1000, 1800, 900);
  EXPECT_NE(test::complaint<std::invalid_argument>([&] {
              sphere.with_parameter_sigmas({{"f_px", 1}});
            }).find("`f_px`"),
            std::string::npos);
}

TEST(CameraErrors, OtherCamerasKeepThem) {
  const Camera camera = lens().with_parameter_sigmas({{"fx_px", 3}, {"k1", 0.02}});
  const Eigen::VectorXd values = Eigen::VectorXd::Constant(9, 0.01).array() + 1;
  EXPECT_EQ(camera.with_parameters(values).independent_sigmas(), camera.independent_sigmas());
  const std::map<std::string, double> focal{{"fx_px", 3}};
  EXPECT_EQ(camera.without_distortion().independent_sigmas(), focal);
  EXPECT_TRUE(lens().with_parameter_sigmas({{"k1", 0.1}}).without_distortion().is_exact());
}

TEST(CameraErrors, WhatIsNoSigma) {
  EXPECT_NE(
      complaint({{"k1", -0.1}}).find("parameter_sigmas.k1 must be zero or positive, got -0.1"),
      std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint({{"fx_px", nan}}).find("parameter_sigmas.fx_px"), std::string::npos);
  const std::string unknown = complaint({{"xi", 0.1}});
  EXPECT_NE(unknown.find("`xi`"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("fx_px, fy_px"), std::string::npos) << unknown;
  EXPECT_NE(complaint({{"fx_px", 0}}).find("positive for one parameter or more"),
            std::string::npos);
}

TEST(CameraErrors, WhatIsNoCovariance) {
  Eigen::MatrixXd covariance = some_covariance();
  EXPECT_EQ(complaint(covariance), "");
  EXPECT_NE(complaint(covariance.topLeftCorner(8, 8)).find("9 x 9"), std::string::npos);
  covariance(0, 1) *= 2;
  EXPECT_NE(complaint(covariance).find("symmetric"), std::string::npos);
  covariance = some_covariance();
  covariance(0, 0) = -1;
  EXPECT_NE(complaint(covariance).find("semidefinite"), std::string::npos);
  covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint(covariance).find("finite"), std::string::npos);
}

}  // namespace
}  // namespace occ
