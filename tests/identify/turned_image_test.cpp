// SPDX-License-Identifier: Apache-2.0
// An image that is turned or reflected has the same answer: no part of the search, of the verdict
// or of the false alarms prefers a direction.
#include <cmath>

#include "libocc/identify/recognise.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/identify/random_maps.hpp"
#include "tests/support/random_objects.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Turns the image by 180 degrees, or reverses x of image and world. The principal point is in the
/// middle of the image.
struct Turn {
  bool mirrored;

  Matrix3d of_camera() const { return Vector3d(-1, mirrored ? 1 : -1, 1).asDiagonal(); }
  Matrix3d of_world() const { return Vector3d(mirrored ? -1 : 1, 1, 1).asDiagonal(); }

  Rigid3 operator()(const Rigid3& pose) const {
    return {of_camera() * pose.rotation * of_world(), of_camera() * pose.translation};
  }
  std::vector<Blob> operator()(const std::vector<Blob>& blobs, const Camera& camera) const {
    const Eigen::Matrix2d m = of_camera().topLeftCorner<2, 2>();
    const Vector2d last(camera.width() - 1, camera.height() - 1);
    std::vector<Blob> turned = blobs;
    for (Blob& blob : turned) {
      const Vector2d shift(last.x(), mirrored ? 0 : last.y());
      blob.centroid_px = m * blob.centroid_px + shift;
      blob.covariance_px2 = m * blob.covariance_px2 * m.transpose();
      const Vector2d a = m * Vector2d(blob.x0, blob.y0) + shift;
      const Vector2d b = m * Vector2d(blob.x1, blob.y1) + shift;
      const Eigen::Vector2i low = a.cwiseMin(b).cast<int>(), high = a.cwiseMax(b).cast<int>();
      blob.x0 = low.x(), blob.y0 = low.y(), blob.x1 = high.x(), blob.y1 = high.y();
    }
    return turned;
  }
};

/// Compares the number of the hypotheses and the first one; equal ones may change their order.
void expect_same(const std::vector<Hypothesis>& found, const std::vector<Hypothesis>& again,
                 const Turn& turn) {
  ASSERT_EQ(found.size(), again.size());
  if (found.empty()) return;
  const Hypothesis &a = found.front(), &b = again.front();
  EXPECT_TRUE(test::pose_is_near(turn(a.cam_from_world), b.cam_from_world, 1e-4, 1e-4));
  EXPECT_NEAR(a.chi2, b.chi2, 1e-3 * (1 + a.chi2));
  EXPECT_NEAR(a.probability, b.probability, 1e-4);
  EXPECT_EQ(a.missed, b.missed);
  EXPECT_TRUE(std::equal(
      a.matches.begin(), a.matches.end(), b.matches.begin(), b.matches.end(),
      [](const Match& m, const Match& n) { return m.lamp == n.lamp && m.blob == n.blob; }));
}

TEST(TurnedImage, OfAMapHasTheSameAnswer) {
  Random random(1);
  maps::Options options;
  options.false_lights = 3;
  for (int i = 0; i < 8; ++i) {
    options.lamps = i % 2 ? 6 : 14;  // alignment and voting
    options.visible = 5;
    options.hidden = i % 2 ? 1 : 2;
    const maps::View view = maps::random_view(random, options);
    IdentifyOptions by;
    by.model_sigma_px = 0.1;
    if (i > 3) by.prior = maps::gravity(view, 0.01, random);
    const Result<Identification> found = identify(view.blobs, view.scene, by);
    for (const bool mirrored : {false, true}) {
      SCOPED_TRACE(mirrored);
      const Turn turn{mirrored};
      Scene scene = view.scene;
      for (Lamp& lamp : scene.lamps) lamp.centre_m = turn.of_world() * lamp.centre_m;
      IdentifyOptions turned = by;
      if (by.prior) turned.prior->gravity_in_cam = turn.of_camera() * *by.prior->gravity_in_cam;
      const Result<Identification> again = identify(turn(view.blobs, scene.camera), scene, turned);
      EXPECT_EQ(found.status, again.status);
      EXPECT_EQ(found->tried, again->tried);
      EXPECT_NEAR(found->risk, again->risk, 1e-4 + 0.01 * found->risk);
      EXPECT_NEAR(found->chance, again->chance, 0.01 * found->chance);
      expect_same(found->hypotheses, again->hypotheses, turn);
    }
  }
}

TEST(TurnedImage, OfAnObjectHasTheSameFalseAlarms) {
  Random random(2);
  for (int i = 0; i < 4; ++i) {
    const std::vector<Object> objects{bodies::random_object(random, 10)};
    bodies::View view;
    bodies::add_object(view, 0, objects[0], bodies::random_pose(random, 2.4, {120, 60}), random,
                       0.2);
    bodies::add_false_lights(view, 5, random, 0.2);
    RecogniseOptions options;
    options.identify.model_sigma_px = 0.1;
    const Camera camera = bodies::camera();
    const auto found = recognise(view.blobs, objects, camera, options);
    const Turn turn{false};
    const auto again = recognise(turn(view.blobs, camera), objects, camera, options);
    EXPECT_EQ(found.status, again.status);
    ASSERT_EQ(found->found.size(), again->found.size());
    const double a = found->log10_false_alarms[0], b = again->log10_false_alarms[0];
    EXPECT_TRUE(a == b || std::abs(a - b) < 1e-3) << a << ' ' << b;
    for (std::size_t k = 0; k < found->found.size(); ++k) {
      EXPECT_NEAR(found->found[k].risk, again->found[k].risk, 1e-4);
      expect_same(found->found[k].match.poses, again->found[k].match.poses, turn);
    }
  }
}

}  // namespace
}  // namespace occ
