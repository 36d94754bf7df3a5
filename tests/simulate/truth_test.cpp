// SPDX-License-Identifier: Apache-2.0
// Truth of lamps: in view, whole, hidden; and positions of the camera that are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/formation/rim.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ {
namespace {

/// A lamp of the shape in the plane z = 2 that shines down, with the half sizes 0.3 and 0.2 m.
Scene lamp_above(LampShape shape) {
  Scene scene;
  scene.camera = test::vga_camera();
  Lamp lamp = test::disc_lamp(3, {0, 0, 2}, 0.3);
  lamp.shape = shape;
  lamp.size_m = {0.6, 0.4};
  lamp.normal = {0, 0, -1};
  lamp.x_axis = {1, 0, 0};
  lamp.exponent = 4;
  scene.lamps = {lamp};
  return scene;
}

/// Message of a rendering from a position that looks down, past the lamp.
std::string refusal(const Scene& scene, const Eigen::Vector3d& position) {
  const Rigid3 down{Eigen::Vector3d(1, -1, -1).asDiagonal(), Eigen::Vector3d::Zero()};
  return test::complaint([&] {
    simulate(scene, {down.rotation, -(down.rotation * position)}, test::noiseless());
  });
}

TEST(CameraPosition, IsRefusedOnTheFaceOfALamp) {
  struct Case {
    LampShape shape;
    Eigen::Vector2d on, off;
  };
  // The Lame curve |u / 0.3|^4 + |v / 0.2|^4 = 1 has a corner at 0.84 of both half sizes.
  const Case cases[] = {{LampShape::point, {0, 0}, {0.01, 0}},
                        {LampShape::disc, {0.2, 0.21}, {0.22, 0.22}},
                        {LampShape::disc, {0, -0.29}, {0, -0.31}},
                        {LampShape::rectangle, {0.29, -0.19}, {0.29, -0.21}},
                        {LampShape::rectangle, {-0.29, 0.19}, {-0.31, 0.19}},
                        {LampShape::lame, {0.25, 0.166}, {0.255, 0.17}},
                        {LampShape::lame, {-0.29, 0.01}, {-0.31, 0.01}},
                        {LampShape::lame, {0.01, -0.19}, {0.01, -0.21}}};
  for (const Case& c : cases) {
    const Scene scene = lamp_above(c.shape);
    const Eigen::Vector3d on(c.on.x(), c.on.y(), 2), off(c.off.x(), c.off.y(), 2);
    EXPECT_NE(refusal(scene, on).find("outside lamp 3"), std::string::npos) << on.transpose();
    EXPECT_EQ(refusal(scene, off), "") << off.transpose();
    EXPECT_EQ(refusal(scene, on - Eigen::Vector3d(0, 0, 0.01)), "");
  }
}

/// Truth of a disc of 0.3 m at 2 m, seen by a camera of 640 x 480 pixels and f = 500 px. The
/// camera is moved sideways: 75 px of radius.
LampTruth truth_at(const Eigen::Vector3d& camera, Scene scene = lamp_above(LampShape::disc)) {
  const Rigid3 pose{Eigen::Matrix3d::Identity(), -camera};
  return simulate(scene, pose, test::noiseless()).lamps[0];
}

TEST(LampTruth, IsInViewIfAPartOfItsImageIs) {
  const LampTruth middle = truth_at({0, 0, 0});
  EXPECT_TRUE(middle.in_view);
  EXPECT_TRUE(middle.whole);
  EXPECT_EQ(middle.hidden, 0);
  EXPECT_LT((middle.centre_px - Eigen::Vector2d(319.5, 239.5)).norm(), 1e-9);
  ASSERT_GE(middle.rim_px.size(), 16u);
  for (const Eigen::Vector2d& px : middle.rim_px)
    EXPECT_NEAR((px - middle.centre_px).norm(), 75, 1e-9);
  // Centres at 20 px inside and outside of each border.
  const double to_side = 319.5 / 250, to_top = 239.5 / 250, step = 20.0 / 250;
  for (const double side : {-1, 1}) {
    for (const double out : {-step, step}) {
      for (const LampTruth& cut :
           {truth_at({side * (to_side + out), 0, 0}), truth_at({0, side * (to_top + out), 0})}) {
        EXPECT_TRUE(cut.in_view);
        EXPECT_FALSE(cut.whole);
        EXPECT_FALSE(cut.rim_px.empty());
      }
    }
    for (const LampTruth& gone : {truth_at({side * (to_side + 4 * step), 0, 0}),
                                  truth_at({0, side * (to_top + 4 * step), 0})}) {
      EXPECT_FALSE(gone.in_view);
      EXPECT_FALSE(gone.whole);
      EXPECT_TRUE(gone.rim_px.empty());
    }
  }
}

TEST(LampTruth, OfALampAroundTheWholeImageIsInView) {
  // At 0.1 m the disc has a radius of 1500 px.
  const LampTruth around = truth_at({0, 0, 1.9});
  EXPECT_TRUE(around.in_view);
  EXPECT_FALSE(around.whole);
  // Beside it, the image is outside of the rim, which is as large.
  EXPECT_FALSE(truth_at({0.45, 0, 1.9}).in_view);
  EXPECT_FALSE(truth_at({0, -0.45, 1.9}).in_view);
}

// The rim is sampled at 64 points, 147 px apart, which is more than this image. The lamp covers a
// part of the image on each side in turn, without its middle.
TEST(LampTruth, OfARimThatCrossesTheImageBetweenItsSamplesIsInView) {
  Scene scene = lamp_above(LampShape::disc);
  scene.camera = Camera::pinhole(60, 60, 500, 500, 29.5, 29.5);
  const double between_samples_m = 0.3 * std::sin(3.14159265 / 64);
  for (const double side : {-1, 1})
    for (const bool upright : {false, true}) {
      const auto in_view = [&](double covered_px) {
        // The rim passes at 30 px from the middle, less the covered part.
        const double to_centre_m = side * (0.3 + (30 - covered_px) / 5000);
        const Eigen::Vector3d eye = upright ? Eigen::Vector3d(between_samples_m, to_centre_m, 1.9)
                                            : Eigen::Vector3d(to_centre_m, between_samples_m, 1.9);
        const LampTruth truth = truth_at(eye, scene);
        EXPECT_EQ(truth.rim_px.empty(), !truth.in_view);
        EXPECT_FALSE(truth.whole);
        return truth.in_view;
      };
      EXPECT_TRUE(in_view(15)) << side << upright;
      EXPECT_FALSE(in_view(-5)) << side << upright;
    }
}

TEST(LampTruth, APointIsInViewWithinTheBordersOfThePixels) {
  const Scene scene = lamp_above(LampShape::point);
  for (const double off_px : {-0.2, 0.2})  // to the outside
    for (const double side : {-1, 1}) {
      const double to_side_m = side * (320 + off_px) / 250, to_top_m = side * (240 + off_px) / 250;
      EXPECT_EQ(truth_at({to_side_m, 0, 0}, scene).in_view, off_px < 0) << side;
      EXPECT_EQ(truth_at({0, to_top_m, 0}, scene).in_view, off_px < 0) << side;
    }
}

// A disc beyond a corner of the image, on its diagonal.
TEST(LampTruth, ADiscBeyondACornerIsInViewIfItReachesTheCorner) {
  for (const double gap_px : {-0.4, 0.4})
    for (const double x : {-1, 1})
      for (const double y : {-1, 1}) {
        const double along_px = (75 + gap_px) * std::sqrt(0.5);
        const Eigen::Vector3d eye(x * (320 + along_px) / 250, y * (240 + along_px) / 250, 0);
        EXPECT_EQ(truth_at(eye).in_view, gap_px < 0) << x << y;
      }
}

TEST(LampTruth, OfADarkSideHasACentreOnly) {
  Scene scene = lamp_above(LampShape::disc);
  scene.lamps[0].normal = {0, 0, 1};
  const LampTruth dark = truth_at({0.1, 0, 0}, scene);
  EXPECT_FALSE(dark.in_view);
  EXPECT_FALSE(dark.whole);
  EXPECT_TRUE(dark.rim_px.empty());
  EXPECT_LT((dark.centre_px - Eigen::Vector2d(294.5, 239.5)).norm(), 1e-9);
}

TEST(LampTruth, StatesTheHiddenShareOfALamp) {
  Scene scene = lamp_above(LampShape::disc);
  // A box half way covers the half plane x > 0 of the lamp.
  scene.boxes = {{Eigen::Vector3d(0, -1, 0.9), Eigen::Vector3d(1, 1, 1)}};
  const LampTruth half = truth_at({0, 0, 0}, scene);
  EXPECT_TRUE(half.in_view);
  EXPECT_TRUE(half.whole);
  EXPECT_NEAR(half.hidden, 0.5, 0.01);
  scene.boxes[0].min_m.x() = -1;
  const LampTruth all = truth_at({0, 0, 0}, scene);
  EXPECT_EQ(all.hidden, 1);
  EXPECT_FALSE(all.in_view);
}

}  // namespace
}  // namespace occ
