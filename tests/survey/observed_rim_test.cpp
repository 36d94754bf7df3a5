// SPDX-License-Identifier: Apache-2.0
// Rims as observations of the network.
#include "libocc/survey/internal/observed_rim.hpp"

#include "libocc/network/precision.hpp"
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

namespace occ::test {
namespace {

/// Sums over surveys of a room: squared errors of distances with rims and with centres alone, and
/// those that are expected; squared errors of tilts and sizes over their variances.
struct RimGain {
  double errors = 0, centre_errors = 0, variances = 0, centre_variances = 0;
  double tilts = 0, sizes = 0;
  int lamps = 0;
};

RimGain rim_gain(const Scene& scene, int pictures) {
  RimGain sums;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto made = walk(scene, pictures, seed);
    Random random(seed, 3);
    const double growth_px = 0.05 * random.normal();
    for (MadePicture& one : made)
      for (Blob& blob : one.picture.blobs)
        for (RimPoint& point : blob.rim) point.px += growth_px * point.normal;
    if (!survey(pictures_of(made), scene.camera).ok()) continue;  // too few of them overlap
    SurveyOptions options = with_distance(scene, made);
    options.model_sigma_px = 1e-3;
    options.distances[0].sigma_m = 1e-6;
    const auto found = survey(pictures_of(made), scene.camera, options);
    if (!found.ok()) {
      ADD_FAILURE() << found.message;
      continue;
    }
    Network centres = found->adjustment.network;
    EXPECT_GT(centres.outlines.size(), 0.9 * static_cast<double>(centres.observations.size()));
    centres.outlines.clear();
    const auto adjusted = adjust(centres);
    const auto a = precision(found->adjustment.network), b = precision(adjusted->network);
    if (!adjusted.ok() || !a.ok() || !b.ok()) continue;
    const std::vector<int> truth = truth_of(*found, made);
    for (int i = 0; i < static_cast<int>(truth.size()); ++i) {
      const Lamp &lamp = found->lamps[i].lamp, &real = scene.lamps[truth[i]];
      // The frame of the survey is tilted against that of the room: angles between normals.
      const Lamp& first = found->lamps[0].lamp;
      const double tilt = lamp.normal.cross(first.normal).norm();
      if (i > 0)
        sums.tilts +=
            square(tilt) / (square(*lamp.tilt_sigma_rad) + square(*first.tilt_sigma_rad)) / 2;
      const double size = lamp.shape == LampShape::disc
                              ? lamp.radius_m / real.radius_m
                              : lamp.size_m.minCoeff() / real.size_m.minCoeff();
      sums.sizes += square(std::log(size) / lamp.size_sigma);
      ++sums.lamps;
      for (int j = 0; j < i; ++j) {
        const Target first = Target::of_point(i), second = Target::of_point(j);
        const double length = (real.centre_m - scene.lamps[truth[j]].centre_m).norm();
        const auto error = [&](const Network& network) {
          return (network.position_m(first) - network.position_m(second)).norm() - length;
        };
        sums.errors += square(error(found->adjustment.network));
        sums.centre_errors += square(error(adjusted->network));
        sums.variances += square(a->distance_sigma_m(first, second));
        sums.centre_variances += square(b->distance_sigma_m(first, second));
      }
    }
  }
  return sums;
}

TEST(RimsOfSurvey, ReduceTheErrors) {
  // Small discs add little to the directions of their centres, large panels much.
  Scene room = uneven_room();
  const RimGain discs = rim_gain(room, 10);
  for (Lamp& lamp : room.lamps) {
    lamp.shape = LampShape::rectangle;
    lamp.radius_m = 0;
    lamp.size_m = {0.6, 0.3};
    lamp.validate();
  }
  const RimGain panels = rim_gain(room, 12);
  EXPECT_GT(discs.lamps, 100);
  EXPECT_GT(panels.lamps, 80);
  EXPECT_LT(discs.errors, discs.centre_errors);
  EXPECT_LT(discs.variances, discs.centre_variances);
  EXPECT_LT(panels.errors, 0.7 * panels.centre_errors);
  EXPECT_LT(panels.variances, 0.7 * panels.centre_variances);
  for (const RimGain& sums : {discs, panels}) {
    EXPECT_GT(1.2 * sums.tilts / sums.lamps, 0.4);  // the sigma is that of the worst direction
    EXPECT_LT(1.2 * sums.tilts / sums.lamps, 1.3);
    EXPECT_GT(sums.sizes / sums.lamps, 0.4);  // as that of the worst side
    EXPECT_LT(sums.sizes / sums.lamps, 1.4);
  }
}

}  // namespace
}  // namespace occ::test
