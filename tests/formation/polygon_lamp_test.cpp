// SPDX-License-Identifier: Apache-2.0
// Lamps with the shape of a polygon, compared with the rectangles that they consist of.
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/lamp_image.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/received_power.hpp"
#include "tests/formation/outline_support.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

using Corners = std::vector<Eigen::Vector2d>;

const Camera bent = Camera::pinhole(160, 120, 200, 198, 50.2, 80.4, {-0.2, 0.05, 0.002, -0.003});
Rigid3 some_pose() { return {so3_exp({0.1, -0.15, 0.7}), {0.1, 0.05, 0.2}}; }

Lamp tilted_lamp(LampShape shape) {
  Lamp lamp = disc_lamp(0, {0.4, -0.3, 2.5});
  lamp.shape = shape;
  lamp.normal = Eigen::Vector3d(0.3, 0.45, -0.8);
  lamp.x_axis = {1, 0.3, 0};
  return lamp;
}

Lamp polygon_lamp(const Corners& corners) {
  Lamp lamp = tilted_lamp(LampShape::polygon);
  lamp.corners_m = corners;
  lamp.validate();
  return lamp;
}

/// A part of the plane of polygon_lamp() from `low` to `high`, with its part of the light.
Lamp rectangle_lamp(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double part = 1) {
  Lamp lamp = tilted_lamp(LampShape::rectangle);
  lamp.size_m = high - low;
  lamp.validate();
  const Eigen::Vector2d middle = 0.5 * (low + high);
  lamp.centre_m += middle.x() * lamp.x_axis + middle.y() * lamp.normal.cross(lamp.x_axis);
  lamp.power_w *= part;
  return lamp;
}

const Corners l_shape = {{0, 0}, {0.3, 0}, {0.3, 0.1}, {0.1, 0.1}, {0.1, 0.25}, {0, 0.25}};
std::vector<Lamp> parts_of_l_shape() {
  return {rectangle_lamp({0, 0}, {0.3, 0.1}, 0.03 / 0.045),
          rectangle_lamp({0, 0.1}, {0.1, 0.25}, 0.015 / 0.045)};
}

TEST(PolygonLamp, OfARectangleIsTheRectangle) {
  const Lamp rectangle = rectangle_lamp({-0.15, -0.1}, {0.15, 0.1});
  const Lamp polygon = polygon_lamp({{-0.15, -0.1}, {0.15, -0.1}, {0.15, 0.1}, {-0.15, 0.1}});
  EXPECT_NEAR(polygon.area_m2(), rectangle.area_m2(), 1e-15);
  EXPECT_NEAR(polygon.reach_m(), rectangle.reach_m(), 1e-15);
  Eigen::Matrix<double, 2, 6> a, b;
  EXPECT_LT((*project_lamp_centre(polygon, some_pose(), bent, &a) -
             *project_lamp_centre(rectangle, some_pose(), bent, &b))
                .norm(),
            1e-12);
  EXPECT_LT((a - b).norm(), 1e-9 * b.norm());
  int compared = 0;
  for (const RimPoint& point : exact_rim(rectangle, some_pose(), bent, 16, 0.05, 3)) {
    const RimRay ray = *rim_ray(point, bent);
    Eigen::Matrix<double, 1, 6> of_polygon, of_rectangle;
    const double distance = *rim_distance_px(polygon, some_pose(), ray, &of_polygon);
    EXPECT_NEAR(distance, 3, 0.1);
    const double by_sides = *rim_distance_px(rectangle, some_pose(), ray, &of_rectangle);
    if (by_sides < 0) continue;  // near a corner, it may be that from the other side
    ++compared;
    EXPECT_NEAR(distance, by_sides, 1e-10);
    EXPECT_LT((of_polygon - of_rectangle).norm(), 1e-9 * of_rectangle.norm());
  }
  EXPECT_GE(compared, 12);
}

TEST(PolygonLamp, CoverageIsThatOfItsParts) {
  const double sigma = 0.8;
  const auto image = [&](const Lamp& lamp) {
    return coverage(*project_contour(lamp, some_pose(), bent, sigma), PixelPsf(sigma), 160, 120);
  };
  const Patch whole = image(polygon_lamp(l_shape));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(160, 120);
  for (const Lamp& part : parts_of_l_shape()) {
    const Patch patch = image(part);
    for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
      for (int x = patch.x0; x < patch.x0 + patch.width; ++x) sum(x, y) += patch.at(x, y);
  }
  double brightest = 0;
  for (int y = whole.y0 + 1; y + 1 < whole.y0 + whole.height; ++y)
    for (int x = whole.x0 + 1; x + 1 < whole.x0 + whole.width; ++x) {
      EXPECT_NEAR(whole.at(x, y), sum(x, y), 1e-5);
      brightest = std::max<double>(brightest, whole.at(x, y));
    }
  EXPECT_GT(brightest, 0.95);
}

TEST(PolygonLamp, CentreIsTheCentroidOfItsImageWithTheRightJacobian) {
  const Lamp lamp = polygon_lamp(l_shape);
  // The centroid of an L is not the middle of its corners.
  EXPECT_LT((lamp.centre_m - tilted_lamp(LampShape::disc).centre_m).norm() - 0.15, 0);
  expect_true_centre(lamp, some_pose(), bent);
}

Scene scene_of(const std::vector<Lamp>& lamps) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  scene.lamps = lamps;
  for (std::size_t i = 0; i < lamps.size(); ++i) scene.lamps[i].id = static_cast<int>(i);
  scene.validate();
  return scene;
}

/// Power of all lamps of a scene at the camera.
double received_w(const Scene& scene) { return received_power(scene, some_pose()).total_w(); }

TEST(PolygonLamp, PowerIsThatOfItsParts) {
  Scene whole = scene_of({polygon_lamp(l_shape)}), parts = scene_of(parts_of_l_shape());
  const double clear_w = received_w(whole);
  EXPECT_NEAR(clear_w / received_w(parts), 1, 1e-6);
  // A box that hides a part of one arm.
  const Eigen::Vector3d hidden = parts.lamps[1].centre_m;
  const Eigen::Vector3d at = 0.5 * (hidden + some_pose().origin_in_source());
  const Box box{at - Eigen::Vector3d::Constant(0.03), at + Eigen::Vector3d::Constant(0.03)};
  whole.boxes = parts.boxes = {box};
  const double left_w = received_w(whole);
  EXPECT_NEAR(left_w / received_w(parts), 1, 5e-3);
  EXPECT_LT(left_w, 0.9 * clear_w);
  EXPECT_GT(left_w, 0.1 * clear_w);
  double area_m2 = 0;
  for (const Lamp& part : parts.lamps)
    area_m2 += part.area_m2() *
               internal::formation::visible_part(part, {box}, some_pose().origin_in_source()).share;
  const double share =
      internal::formation::visible_part(whole.lamps[0], {box}, some_pose().origin_in_source())
          .share;
  EXPECT_NEAR(share, area_m2 / whole.lamps[0].area_m2(), 1e-9);
}

TEST(PolygonLamp, LampsAreLocatedByTheirRims) {
  const Corners triangle = {{0, 0}, {0.42, 0.06}, {0.12, 0.4}};
  const Corners hexagon = {{0.2, 0},  {0.1, 0.17},   {-0.1, 0.17},
                           {-0.2, 0}, {-0.1, -0.17}, {0.1, -0.17}};
  const Corners l_panel = {{0, 0}, {0.45, 0}, {0.45, 0.2}, {0.2, 0.2}, {0.2, 0.4}, {0, 0.4}};
  const Corners arrow = {{0.3, 0}, {-0.15, 0.26}, {-0.05, 0}, {-0.15, -0.26}};
  for (const Corners& corners : {triangle, hexagon, l_panel, arrow}) {
    SCOPED_TRACE(testing::Message() << corners.size() << " corners");
    Scene scene = irregular_room();
    for (Lamp& lamp : scene.lamps) {
      lamp.shape = LampShape::polygon;
      lamp.corners_m = corners;
    }
    scene.validate();
    expect_located_by_rims(scene);
  }
}

}  // namespace
