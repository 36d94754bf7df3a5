// SPDX-License-Identifier: Apache-2.0
// Rims as observations of the network.
#include "libocc/survey/internal/observed_rim.hpp"

#include "tests/survey/survey_support.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using internal::survey::observed_rim;

Lamp lamp_of(LampShape shape) {
  Lamp lamp;
  lamp.shape = shape;
  lamp.centre_m = {1.7, 1.6, 2.7};
  lamp.radius_m = shape == LampShape::disc ? 0.2 : 0;
  if (shape == LampShape::rectangle) lamp.size_m = {0.6, 0.3};
  lamp.validate();
  return lamp;
}

Camera wide_camera() {
  return Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5, {-0.1, 0.02, 0, 0});
}
const Rigid3 oblique = look_at({1.0, 0.9, 0.2}, {1.6, 1.7, 2.7}, {0.3, 1, 0});

class RimOfShape : public testing::TestWithParam<LampShape> {};

/// Without errors of the reference, the rows are standard normal and independent of the centre.
TEST_P(RimOfShape, RowsHaveUnitCovariance) {
  const Lamp lamp = lamp_of(GetParam());
  const Camera camera = wide_camera();
  Random random(4);
  constexpr int trials = 2000;
  constexpr double sigma_px = 0.1, common_px = 0.02;
  Blob exact;
  exact.rim = test::exact_rim(lamp, oblique, camera, 80, sigma_px);
  exact.rim_covariance_px2.diagonal().setConstant(square(common_px));
  const auto reference = observed_rim(lamp, exact, oblique, camera, 0.01);
  ASSERT_TRUE(reference);
  const Vector2d centre = camera.project(oblique * lamp.centre_m).value();
  EXPECT_LT((reference->centre_px - centre).norm(), 1e-4);
  EXPECT_LT(reference->outline.constant.norm(), 1e-2);
  const Index count = reference->outline.constant.size();
  MatrixXd sum = MatrixXd::Zero(count + 2, count + 2);
  for (int trial = 0; trial < trials; ++trial) {
    Blob blob = exact;
    Eigen::Matrix<double, 5, 1> common;
    for (double& error : common) error = std::hypot(common_px, 0.01) * random.normal();
    for (RimPoint& point : blob.rim) {
      const Vector2d& n = point.normal;
      Eigen::Matrix<double, 5, 1> by_common;
      by_common << 1, n.x(), n.y(), square(n.x()) - square(n.y()), 2 * n.x() * n.y();
      point.px += (by_common.dot(common) + sigma_px * random.normal()) * n;
    }
    const auto rim = observed_rim(lamp, blob, oblique, camera, 0.01);
    ASSERT_TRUE(rim);
    ASSERT_EQ(rim->outline.constant.size(), count);
    VectorXd all(count + 2);
    all << (rim->centre_px - centre).cwiseQuotient(rim->sigma_px), rim->outline.constant;
    sum += all * all.transpose() / trials;
  }
  EXPECT_LT((sum - MatrixXd::Identity(count + 2, count + 2)).cwiseAbs().maxCoeff(), 0.15);
}

INSTANTIATE_TEST_SUITE_P(Shapes, RimOfShape, testing::Values(LampShape::disc, LampShape::rectangle),
                         [](const auto& one) {
                           return one.param == LampShape::disc ? "Disc" : "Rectangle";
                         });

}  // namespace
}  // namespace occ
