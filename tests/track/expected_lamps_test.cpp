// SPDX-License-Identifier: Apache-2.0
// Assignment of blobs to the lamps that a tracker expects, their references of brightness and size,
// and the motion of their blobs to the time of the prediction.
#include "libocc/track/internal/expected_lamps.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <utility>
#include <vector>

#include "libocc/geometry/motion.hpp"
#include "tests/support/support.hpp"

namespace occ::internal::track {
namespace {

constexpr double gate_sigma = 4, contrast_dn = 100, area_px = 50;

struct View {
  Scene scene;
  std::vector<ExpectedLamp> expected;
  std::vector<Blob> blobs;
};

/// One blob at the expected place of each lamp, of the given ratio of contrast to its reference.
View view_of(const std::vector<double>& ratios) {
  View view;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    view.scene.lamps.push_back(
        test::disc_lamp(static_cast<int>(i), {static_cast<double>(i), 1, 3}));
    ExpectedLamp lamp;
    lamp.lamp = static_cast<int>(i);
    lamp.px = {100.0 * static_cast<double>(i + 1), 200};
    lamp.covariance_px2 = Eigen::Matrix2d::Identity();
    lamp.radius_px = 4;
    lamp.sure = true;
    lamp.before = LampLook{0, contrast_dn, area_px};
    view.expected.push_back(lamp);
    Blob blob;
    blob.centroid_px = lamp.px;
    blob.covariance_px2 = 1e-4 * Eigen::Matrix2d::Identity();
    blob.background_dn = 2;
    blob.peak_dn = 2 + ratios[i] * contrast_dn;
    blob.area_px = 50;
    view.blobs.push_back(blob);
  }
  return view;
}

TEST(AdaptLooks, ScalesByTheMedianRatio) {
  View view = view_of({0.5, 2, 2.1, 1.9, 0.4});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  for (const ExpectedLamp& lamp : view.expected) {
    EXPECT_DOUBLE_EQ(lamp.before->contrast_dn, 1.9 * contrast_dn);
    EXPECT_DOUBLE_EQ(lamp.before->area_px, 1.9 * area_px);
  }
}

TEST(AdaptLooks, AreasDoNotShrinkInADarkerImage) {
  View view = view_of({0.5, 0.5, 0.5});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, 0.5 * contrast_dn);
  EXPECT_DOUBLE_EQ(view.expected[0].before->area_px, area_px);
}

TEST(AdaptLooks, TwoLampsAreTooFew) {
  View view = view_of({0.5, 0.5});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, contrast_dn);
}

TEST(AdaptLooks, BlinkingLampsHaveNoReference) {
  View view = view_of({0.5, 0.5, 0.5, 0.1});
  view.scene.lamps[3].frequency_hz = 1000;
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_FALSE(view.expected[3].before.has_value());
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, 0.5 * contrast_dn);
}

std::vector<Match> matched(const View& view) {
  return match_expected(view.expected, view.blobs, view.scene, gate_sigma);
}

/// Lamps of the matches, by their indices.
std::vector<int> matched_lamps(const View& view) {
  std::vector<int> lamps;
  for (const Match& match : matched(view)) lamps.push_back(match.lamp);
  return lamps;
}

TEST(MatchExpected, TakesTheBlobInsideTheGate) {
  View view = view_of({1, 1, 1});
  std::swap(view.blobs[0], view.blobs[2]);
  view.blobs[1].centroid_px += Eigen::Vector2d(2.9, 2.8);  // 4.03 sigmas
  const std::vector<Match> matches = matched(view);
  ASSERT_EQ(matches.size(), 2u);
  EXPECT_EQ(matches[0].lamp, 0);
  EXPECT_EQ(matches[0].blob, 2);
  EXPECT_EQ(matches[1].lamp, 2);
  EXPECT_EQ(matches[1].blob, 0);
  view.blobs[1].centroid_px -= Eigen::Vector2d(0.1, 0.1);  // 3.9 sigmas
  EXPECT_EQ(matched(view).size(), 3u);
  view.blobs[1].centroid_px += Eigen::Vector2d(0.5, 0.5);  // 4.6 sigmas of the lamp alone
  EXPECT_EQ(matched(view).size(), 2u);
  view.blobs[1].covariance_px2 = Eigen::Matrix2d::Identity();
  EXPECT_EQ(matched(view).size(), 3u);
}

TEST(MatchExpected, LeavesALampWithTwoLikelyBlobs) {
  View view = view_of({1, 1});
  view.blobs.push_back(view.blobs[0]);
  view.blobs[2].centroid_px.x() += 1.9;  // a chi-square of 3.6
  EXPECT_EQ(matched_lamps(view), std::vector<int>{1});
  view.blobs[2].centroid_px.x() += 0.2;  // 4.4
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 1}));
  EXPECT_EQ(matched(view)[0].blob, 0);
  // A second blob that is surely another lamp's leaves no doubt.
  view.blobs[2].centroid_px.x() -= 0.2;
  view.blobs[0].centroid_px.x() -= 0.5;
  view.expected.push_back(view.expected[0]);
  view.expected[2].lamp = 1;
  view.expected[2].px.x() += 1.9;
  view.expected[2].covariance_px2 *= 0.01;
  view.expected.erase(view.expected.begin() + 1);
  view.blobs.erase(view.blobs.begin() + 1);
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 1}));
}

TEST(MatchExpected, GivesABlobToOneLampOnly) {
  View view = view_of({1, 1});
  view.expected[1].px = view.expected[0].px + Eigen::Vector2d(1, 0);
  view.blobs.pop_back();
  EXPECT_EQ(matched_lamps(view), std::vector<int>{0});
  view.blobs[0].centroid_px.x() += 0.8;
  EXPECT_EQ(matched_lamps(view), std::vector<int>{1});
}

TEST(MatchExpected, LeavesMergedBlobs) {
  View view = view_of({1, 1, 1});
  view.blobs[1].merged = true;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2}));
}

TEST(MatchExpected, ComparesCodesFrequenciesAndColours) {
  View view = view_of({1, 1, 1, 1});
  view.scene.lamps[0].id = 70;
  view.blobs[0].lamp_id = 70;
  view.blobs[1].lamp_id = 70;
  view.scene.lamps[2].frequency_hz = view.scene.lamps[3].frequency_hz = 1000;
  view.blobs[2].frequency_hz = 1019;
  view.blobs[3].frequency_hz = 1021;
  view.blobs[2].frequency_sigma_hz = view.blobs[3].frequency_sigma_hz = 0;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2}));
  view.blobs[3].frequency_sigma_hz = 1;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2, 3}));
  view.blobs[3].frequency_hz = 970;  // ten hertz beyond the tolerance
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2}));
  view.blobs[3].frequency_hz.reset();
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2, 3}));
  view.blobs[1].lamp_id.reset();
  for (Lamp& lamp : view.scene.lamps) lamp.colour = {1, 1, 0.05};
  view.scene.lamps[1].colour = {0.05, 1, 1};
  for (Blob& blob : view.blobs) {
    blob.colour.emplace();
    blob.colour->share = Eigen::Vector3d(1, 1, 0.05) / 2.05;
    blob.colour->sigma.setConstant(0.01);
  }
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2, 3}));
}

TEST(MatchExpected, FindsALampThatTheBorderCutsWithinItsRadius) {
  View view = view_of({1, 1});
  view.blobs[0].centroid_px.x() += 7.5;  // four sigmas and less than the radius of four pixels
  EXPECT_EQ(matched_lamps(view), std::vector<int>{1});
  view.blobs[0].cut_by_border = true;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 1}));
  view.blobs[0].centroid_px.x() += 1;
  EXPECT_EQ(matched_lamps(view), std::vector<int>{1});
}

TEST(MatchExpected, ComparesContrastAndAreaWithTheImagesBefore) {
  // Contrast: an eighth is the limit.
  EXPECT_EQ(matched_lamps(view_of({0.15, 0.1, 100})), (std::vector<int>{0, 2}));
  View view = view_of({0.1, 0.1, 1, 1, 1, 1});
  view.blobs[0].cut_by_border = true;
  view.expected[1].smear_px = 10;  // over seven pixels: a contrast of 0.052
  view.blobs[2].area_px = 810;
  view.blobs[3].area_px = 790;
  view.blobs[4].area_px = 810;
  view.blobs[4].saturated = true;
  view.blobs[5].area_px = 810;
  view.expected[5].smear_px = 1;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 1, 3, 4, 5}));
  view.expected[1].smear_px = 1;  // 0.11
  view.blobs[5].area_px = 1000;
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 3, 4}));
  view.expected[1].before.reset();
  EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 1, 3, 4}));
}

TEST(MatchExpected, LeavesBlinkingLampsThatLackLines) {
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    View view = view_of({1, 1, 1});
    view.scene.sensor.readout = readout;
    for (std::size_t i = 0; i < 3; ++i) {
      view.expected[i].lines_px = 40;
      view.expected[i].cut = i > 0;
      view.blobs[i].x0 = view.blobs[i].y0 = 100;
      view.blobs[i].x1 = view.blobs[i].y1 = 139;
      (readout == Readout::rows ? view.blobs[i].y1 : view.blobs[i].x1) = i < 2 ? 130 : 134;
    }
    EXPECT_EQ(matched_lamps(view), (std::vector<int>{0, 2}));
  }
}

TEST(LookOf, IsTheContrastAndTheArea) {
  const View view = view_of({0.7});
  const LampLook look = look_of(view.blobs[0], 3.5);
  EXPECT_EQ(look.time_s, 3.5);
  EXPECT_NEAR(look.contrast_dn, 70, 1e-12);
  EXPECT_EQ(look.area_px, 50);
}

/// A moving camera that reads row by row, and the blob of a lamp at the time of its row.
struct MovingBlob {
  Scene scene = test::irregular_room();
  PredictedCamera predicted;
  std::vector<Blob> blobs{Blob{}};
  std::vector<Match> matches{{4, 0}};

  MovingBlob() {
    scene.sensor.exposure_s = 1e-3;
    scene.sensor.row_time_s = 5e-5;
    predicted.after_s = 4e-3;
    predicted.cam_from_world = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
    predicted.velocity << 0.2, -0.3, 0.5, 0.4, 0.1, -0.3;
    for (int i = 0; i < 5; ++i) blobs[0].centroid_px = place_in(blobs[0].centroid_px);
    blobs[0].ellipse.centre_px = blobs[0].centroid_px;
    blobs[0].y0 = 200;
    blobs[0].y1 = 239;
    for (const double side : {-1, 1}) {
      RimPoint point;
      point.px = blobs[0].centroid_px + Eigen::Vector2d(3, 20 * side);
      point.normal = {0, side};
      point.sigma_px = 0.1;
      blobs[0].rim.push_back(point);
    }
  }
  Eigen::Vector2d place_at(const Rigid3& pose) const {
    return *scene.camera.project(pose * scene.lamps[4].centre_m);
  }
  /// Place of the lamp while the row of `px` is exposed.
  Eigen::Vector2d place_in(const Eigen::Vector2d& px) const {
    const double after_s = 0.5e-3 + 5e-5 * px.y() - predicted.after_s;
    return place_at(moved_pose(predicted.cam_from_world, predicted.velocity, after_s));
  }
  Eigen::MatrixXd derivative() const {
    return test::numerical_jacobian(
        [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
          return place_at(perturb(predicted.cam_from_world, step));
        },
        Vector6::Zero());
  }
};

TEST(ToTimeOf, MovesBlobAndRimToThePrediction) {
  MovingBlob moving;
  const Blob before = moving.blobs[0];
  to_time_of(moving.predicted, moving.scene, moving.matches, moving.blobs);
  const Blob& after = moving.blobs[0];
  const Eigen::Vector2d expected = moving.place_at(moving.predicted.cam_from_world);
  EXPECT_GT((before.centroid_px - expected).norm(), 1);
  EXPECT_LT((after.centroid_px - expected).norm(), 1e-3);
  EXPECT_LT((after.ellipse.centre_px - expected).norm(), 1e-3);
  const Eigen::Vector2d speed_px_s = moving.derivative() * moving.predicted.velocity;
  ASSERT_EQ(after.rim.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    // The upper point was exposed 20 rows earlier.
    const double later_s = (i == 0 ? -20 : 20) * 5e-5;
    const Eigen::Vector2d offset = before.rim[i].px - before.centroid_px - later_s * speed_px_s;
    EXPECT_LT((after.rim[i].px - expected - offset).norm(), 2e-3);
  }
  EXPECT_EQ(after.covariance_px2, before.covariance_px2);
}

TEST(ToTimeOf, AddsTheErrorOfTheVelocity) {
  MovingBlob moving;
  Vector6 sigmas;
  sigmas << 2e-3, 1e-3, 3e-3, 5e-3, 4e-3, 2e-3;
  moving.predicted.velocity_covariance = sigmas.cwiseAbs2().asDiagonal();
  const Blob before = moving.blobs[0];
  const double late_s = 0.5e-3 + 5e-5 * before.centroid_px.y() - moving.predicted.after_s;
  const Eigen::MatrixXd by_pose = moving.derivative();
  const Eigen::Matrix2d added =
      late_s * late_s * by_pose * moving.predicted.velocity_covariance * by_pose.transpose();
  to_time_of(moving.predicted, moving.scene, moving.matches, moving.blobs);
  const Blob& after = moving.blobs[0];
  EXPECT_GT(added.norm(), 1e-5);
  EXPECT_LT((after.covariance_px2 - before.covariance_px2 - added).norm(), 1e-4 * added.norm());
  RimErrorCovariance of_rim = before.rim_covariance_px2;
  of_rim.block<2, 2>(1, 1) += added;
  EXPECT_LT((after.rim_covariance_px2 - of_rim).norm(), 1e-4 * added.norm());
  EXPECT_EQ(after.rim.size(), 2u);
}

TEST(ToTimeOf, DeletesARimWhoseShearIsUncertain) {
  // A rim of two points of 0.1 px has a shape of 0.1 px. The upper and the lower end of its 40 rows
  // are exposed 1 ms before and after the middle.
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    MovingBlob moving;
    moving.scene.sensor.readout = readout;
    moving.blobs[0].x0 = 300;
    moving.blobs[0].x1 = readout == Readout::rows ? 301 : 339;
    moving.blobs[0].y1 = readout == Readout::rows ? 239 : 201;
    const Eigen::MatrixXd by_turn = moving.derivative().leftCols<3>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(by_turn * by_turn.transpose());
    const double per_rad = std::sqrt(eigen.eigenvalues()[1]);
    for (const bool large : {false, true}) {
      const double sigma_rad_s = (large ? 1.2 : 0.8) * 0.1 / (1e-3 * per_rad);
      moving.predicted.velocity_covariance.diagonal().head<3>().setConstant(sigma_rad_s *
                                                                            sigma_rad_s);
      std::vector<Blob> blobs = moving.blobs;
      to_time_of(moving.predicted, moving.scene, moving.matches, blobs);
      EXPECT_EQ(blobs[0].rim.empty(), large);
    }
  }
}

TEST(ToTimeOf, ChangesNothingWithAGlobalShutterOrBehindTheCamera) {
  MovingBlob moving;
  const Eigen::Vector2d before = moving.blobs[0].centroid_px;
  moving.scene.sensor.row_time_s = 0;
  to_time_of(moving.predicted, moving.scene, moving.matches, moving.blobs);
  EXPECT_EQ(moving.blobs[0].centroid_px, before);
  moving.scene.sensor.row_time_s = 5e-5;
  moving.predicted.velocity.head<3>() = Eigen::Vector3d(300, 0, 0);  // half a turn in 10 ms
  to_time_of(moving.predicted, moving.scene, moving.matches, moving.blobs);
  EXPECT_EQ(moving.blobs[0].centroid_px, before);
  moving.predicted.velocity.setZero();
  moving.scene.lamps[4].centre_m.z() = -2;
  to_time_of(moving.predicted, moving.scene, moving.matches, moving.blobs);
  EXPECT_EQ(moving.blobs[0].centroid_px, before);
}

}  // namespace
}  // namespace occ::internal::track
