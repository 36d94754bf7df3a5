// SPDX-License-Identifier: Apache-2.0
// Symmetric rooms: all poses that fit are returned, and a prior selects one of them.
#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::expect_unique_and_right;
using test::upright;
using test::View;

Scene equilateral_room() {
  Scene scene = test::irregular_room();
  scene.lamps = {test::disc_lamp(0, {2.8, 2, 3}),
                 test::disc_lamp(1, {1.6, 2 + 0.8 * std::sqrt(0.75), 3}),
                 test::disc_lamp(2, {1.6, 2 - 0.8 * std::sqrt(0.75), 3})};
  return scene;
}

Scene grid_room() {
  Scene scene = test::irregular_room();
  scene.lamps.clear();
  for (int i = 0; i < 9; ++i)
    scene.lamps.push_back(test::disc_lamp(i, {1.4 + 0.6 * (i % 3), 1.4 + 0.6 * (i / 3), 3}));
  return scene;
}

TEST(IdentifySymmetry, SquareHasFourPoses) {
  const Scene scene = test::square_room();
  Random random(20);
  for (int i = 0; i < 50; ++i) {
    const View view = test::random_view(scene, random, 4);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_EQ(found.status, Status::ambiguous);
    EXPECT_FALSE(found.message.empty());
    ASSERT_EQ(found->hypotheses.size(), 4u);
    // The true pose, rotated by multiples of 90 degrees about the square's axis.
    for (int quarter = 0; quarter < 4; ++quarter) {
      const Matrix3d turn = so3_exp(Vector3d(0, 0, quarter * 1.5707963267948966));
      const Vector3d axis(2, 2, 0);
      View turned = view;
      turned.cam_from_world = view.cam_from_world * Rigid3{turn, axis - turn * axis};
      EXPECT_TRUE(test::holds_truth(*found, turned)) << quarter;
    }
  }
}

TEST(IdentifySymmetry, ExactlySymmetricViewsLoseNothing) {
  const Scene scene = test::square_room();
  for (const double x : {2.0, 1.0, 1.5})
    for (const double y : {2.0, 1.0})
      for (const double yaw : {0.0, 0.7853981633974483, 1.5707963267948966, 0.3})
        for (const double tilt : {0.0, 0.1}) {
          Random random(21);
          const View view = test::see(scene, upright({x, y, 0}, yaw, tilt), random, 0);
          if (view.blobs.size() < 4) continue;
          const Result<Identification> found = identify(view.blobs, scene);
          EXPECT_EQ(found->hypotheses.size(), 4u) << x << ' ' << y << ' ' << yaw << ' ' << tilt;
          EXPECT_TRUE(test::holds_truth(*found, view));
        }
}

/// A ring of sixteen lamps that face outwards.
Scene ring_room() {
  Scene scene;
  scene.camera = Camera::pinhole(1280, 720, 1118, 1118, 639.5, 359.5);
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * pi * i / 16;
    Lamp lamp;
    lamp.id = i;
    lamp.shape = LampShape::rectangle;
    lamp.normal = {std::cos(angle), std::sin(angle), 0};
    lamp.x_axis = {-std::sin(angle), std::cos(angle), 0};
    lamp.centre_m = 0.678 * lamp.normal + Vector3d(0, 0, 2.607);
    lamp.size_m = {0.127, 0.0508};
    scene.lamps.push_back(lamp);
  }
  scene.validate();
  return scene;
}

// In the best of these poses the fifth lamp is at the limit of its gate. Rounding alone decides if
// that of an equal pose is inside.
TEST(IdentifySymmetry, RoundingLosesNoneOfEqualPoses) {
  const Scene scene = ring_room();
  const double measured[][4] = {{546.354659, 34.233681, 0.085240, 0.110310},
                                {429.750438, 44.109968, 0.523972, 0.411155},
                                {662.929113, 62.663633, 1.042931, 0.902536},
                                {337.289679, 78.606820, 24.904981, 10.063277},
                                {737.844984, 109.572841, 2.770284, 3.687863}};
  IdentifyOptions options;
  options.prior.emplace();
  options.prior->height_m = 0.7937;
  options.prior->height_sigma_m = 0.05;
  Random random(21);
  for (int i = 0; i < 20; ++i) {
    View view;
    const double shift_px = i == 0 ? 0 : 0.003;  // most of them are at the limit, too
    for (const auto& m : measured) {
      view.blobs.push_back(
          test::spot({m[0] + shift_px * random.normal(), m[1] + shift_px * random.normal()}, 1, 1));
      view.blobs.back().covariance_px2 << m[2], 0, 0, m[3];
    }
    const Result<Identification> found = identify(view.blobs, scene, options);
    EXPECT_EQ(found.status, Status::ambiguous) << found.message;
    EXPECT_GE(found->hypotheses.size(), 16u);
    EXPECT_GT(found->risk, 0.9);
  }
}

TEST(IdentifySymmetry, AHeadingPriorBreaksIt) {
  const Scene scene = test::square_room();
  Random random(22);
  for (int i = 0; i < 50; ++i) {
    const View view = test::random_view(scene, random, 4);
    IdentifyOptions options;
    options.prior = Prior{};
    options.prior->heading_rad = heading_rad(view.cam_from_world) + 0.1 * random.normal();
    options.prior->heading_sigma_rad = 20 * 3.14159265 / 180;
    expect_unique_and_right(identify(view.blobs, scene, options), view);
  }
}

TEST(IdentifySymmetry, APositionPriorBreaksItAwayFromTheAxis) {
  const Scene scene = test::square_room();
  Random random(23);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->position_sigma_m = 0.1;
  const View off_axis = test::see(scene, upright({2.35, 1.7, 0.1}, 0.4), random, 0.05);
  options.prior->position_m = Vector3d(2.4, 1.7, 0.1);
  expect_unique_and_right(identify(off_axis.blobs, scene, options), off_axis);
  const View on_axis = test::see(scene, upright({2, 2, 0.1}, 0.4), random, 0.05);
  options.prior->position_m = Vector3d(2, 2, 0.1);
  EXPECT_EQ(identify(on_axis.blobs, scene, options)->hypotheses.size(), 4u);
}

TEST(IdentifySymmetry, GravityDoesNotBreakATurnAboutIt) {
  const Scene scene = test::square_room();
  Random random(24);
  const View view = test::random_view(scene, random, 4);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->gravity_in_cam = view.cam_from_world.rotation * Vector3d(0, 0, -1);
  EXPECT_EQ(identify(view.blobs, scene, options)->hypotheses.size(), 4u);
}

TEST(IdentifySymmetry, APriorThatContradictsTheImageLeavesNoPose) {
  const Scene scene = test::square_room();
  Random random(25);
  const View view = test::random_view(scene, random, 4);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->position_m = Vector3d(40, 2, 0.5);
  options.prior->position_sigma_m = 0.1;
  const Result<Identification> found = identify(view.blobs, scene, options);
  EXPECT_EQ(found.status, Status::no_pose);
  EXPECT_FALSE(found.message.empty());
}

TEST(IdentifySymmetry, ThreeEqualLampsCannotBeDistinguished) {
  const Scene scene = equilateral_room();
  Random random(26);
  for (int i = 0; i < 20; ++i) {
    const View view = test::random_view(scene, random, 3);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_EQ(found.status, Status::ambiguous);
    EXPECT_GE(found->hypotheses.size(), 3u);
    EXPECT_TRUE(test::holds_truth(*found, view));
  }
}

TEST(IdentifySymmetry, ARegularGridHasFourPosesWhenAllIsSeen) {
  const Scene scene = grid_room();
  Random random(27);
  const View view = test::see(scene, upright({2.1, 1.9, 0.2}, 0.3, 0.05), random, 0.05);
  ASSERT_EQ(view.blobs.size(), 9u);
  const Result<Identification> found = identify(view.blobs, scene);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_EQ(found->hypotheses.size(), 4u);
  EXPECT_TRUE(test::holds_truth(*found, view));
}

TEST(IdentifySymmetry, PartOfAGridFitsInMorePositions) {
  const Scene scene = grid_room();
  Random random(28);
  View view = test::see(scene, upright({2.1, 1.9, 0.2}, 0.3, 0.05), random, 0.05);
  for (int lamp = 8; lamp >= 6; --lamp) test::hide(view, lamp);  // two rows remain
  IdentifyOptions options;
  options.miss_penalty = 0;
  const Result<Identification> found = identify(view.blobs, scene, options);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_GE(found->hypotheses.size(), 8u);
  EXPECT_TRUE(test::holds_truth(*found, view));
}

}  // namespace
}  // namespace occ
