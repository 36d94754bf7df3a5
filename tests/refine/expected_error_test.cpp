// SPDX-License-Identifier: Apache-2.0
// Expected errors of a rung, and the bias of the points' rung.
#include "libocc/refine/internal/expected_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

TEST(ExpectedError, AddsTheSquaredBiasToTheVariances) {
  const Rigid3 pose{so3_exp({0.4, -1.1, 0.3}), {0.5, 2, -1}};
  Vector6 variances, bias;
  variances << 1, 4, 9, 16, 36, 47;
  bias << 0.5, 1, -1.5, 3, -4, 5;
  const Matrix6 covariance = variances.asDiagonal();
  EXPECT_NEAR(expected_error(pose, covariance).rotation_rad, std::sqrt(14), 1e-12);
  EXPECT_NEAR(expected_error(pose, covariance).position_m, std::sqrt(99), 1e-12);
  EXPECT_NEAR(expected_error(pose, covariance, bias).rotation_rad, std::sqrt(14 + 3.5), 1e-12);
  EXPECT_NEAR(expected_error(pose, covariance, bias).position_m, std::sqrt(99 + 50), 1e-12);
}

/// Large lamps, close to a tilted camera: the centres of their images are off their centres.
struct NearRoom {
  Scene scene = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 1.2}, {2.5, 2.1, 3}, {0.2, 1, 0});
  std::vector<Blob> blobs;
  double model_sigma_px = 0.4;

  NearRoom() {
    for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.25;
    blobs = test::exact_blobs(scene, pose, {});
    for (std::size_t i = 0; i < blobs.size(); ++i)
      blobs[i].covariance_px2 << 0.3 + 0.1 * static_cast<double>(i), 0.05, 0.05, 0.2;
  }

  struct Step {
    Vector6 bias = Vector6::Zero();
    Matrix6 covariance = Matrix6::Zero();
  };

  /// Gauss-Newton step of the pose that fits the lamps' centres to the centres of their images,
  /// by numerical derivatives.
  Step fitted(const std::vector<int>& used) const {
    const int count = static_cast<int>(used.size());
    const auto predicted = [&](const Eigen::VectorXd& step) {
      Eigen::VectorXd px(2 * count);
      for (int k = 0; k < count; ++k)
        px.segment<2>(2 * k) =
            *scene.camera.project(perturb(pose, step) * scene.lamps[used[k]].centre_m);
      return px;
    };
    const Eigen::MatrixXd jacobian = test::numerical_jacobian(predicted, Vector6::Zero());
    const Eigen::VectorXd centres = predicted(Vector6::Zero());
    Matrix6 information = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    for (int k = 0; k < count; ++k) {
      Eigen::Matrix2d covariance = blobs[used[k]].covariance_px2;
      covariance.diagonal().array() += model_sigma_px * model_sigma_px;
      const Eigen::MatrixXd weighted =
          jacobian.middleRows<2>(2 * k).transpose() * covariance.inverse();
      information += weighted * jacobian.middleRows<2>(2 * k);
      gradient += weighted * (blobs[used[k]].centroid_px - centres.segment<2>(2 * k));
    }
    return {information.inverse() * gradient, information.inverse()};
  }

  Vector6 bias(const std::vector<Match>& matches, const Matrix6& covariance) const {
    return bias_of_points(matches, blobs, scene, pose, covariance, model_sigma_px);
  }
};

TEST(BiasOfPoints, IsTheStepThatFitsCentresToCentresOfImages) {
  const NearRoom room;
  const NearRoom::Step step = room.fitted({0, 1, 2, 3, 4, 5});
  EXPECT_GT(step.bias.norm(), 1e-3);
  const Vector6 bias = room.bias(test::in_order(room.scene), step.covariance);
  EXPECT_LT((bias - step.bias).norm(), 1e-5 * step.bias.norm());
}

TEST(BiasOfPoints, IgnoresLampsWithoutACentreOfTheirImage) {
  NearRoom room;
  room.blobs[1].cut_by_border = true;
  room.scene.lamps[3].normal = Eigen::Vector3d::UnitZ();  // turns its dark side to the camera
  room.scene.lamps[4].centre_m.z() = -2;                  // behind the camera
  const NearRoom::Step step = room.fitted({0, 2, 5});
  const Vector6 bias = room.bias(test::in_order(room.scene), step.covariance);
  EXPECT_LT((bias - step.bias).norm(), 1e-5 * step.bias.norm());
}

}  // namespace
}  // namespace occ
