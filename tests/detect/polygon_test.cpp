// SPDX-License-Identifier: Apache-2.0
// Lamps with straight sides: rims without bias and with consistent covariances, corners, and shapes
// that are no polygons.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <map>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;

Scene one_rectangle(const Eigen::Vector2d& size_m, double k1 = 0) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5, {k1, 0, 0, 0});
  Lamp lamp;
  lamp.shape = LampShape::rectangle;
  lamp.size_m = size_m;
  lamp.power_w = 60 * size_m.prod();
  lamp.half_power_rad = pi / 3;
  scene.lamps = {lamp};
  return scene;
}

/// A camera that looks up at the lamp, tilted by up to 20 degrees.
Rigid3 random_view(Random& random, double distance_m) {
  const Eigen::Vector3d tilt(random.uniform(-0.35, 0.35), random.uniform(-0.35, 0.35),
                             random.uniform(-pi, pi));
  Rigid3 pose;
  pose.rotation =
      so3_exp(Eigen::Vector3d(0, 0, tilt.z())) * so3_exp(Eigen::Vector3d(tilt.x(), tilt.y(), 0));
  pose.translation =
      Eigen::Vector3d(random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), distance_m);
  return pose;
}

struct Errors {
  double chi2 = 0, sum_px = 0, centre_nees = 0, corner_px = 0, scatter_px = 0;
  int points = 0, lamps = 0, with_corners = 0, fewest_on_side = 1000000;

  void add(const Blob& blob, const Scene& scene, const Rendered& rendered) {
    const Lamp& lamp = scene.lamps[0];
    const Rigid3& pose = rendered.cam_from_world;
    double sum = 0, squares = 0;
    Eigen::Vector4i on_side = Eigen::Vector4i::Zero();
    for (const RimPoint& point : blob.rim) {
      const auto off_px = rim_distance_px(lamp, pose, rim_ray(point, scene.camera).value());
      ASSERT_TRUE(off_px.has_value());
      chi2 += square(*off_px / point.sigma_px);
      sum += *off_px;
      squares += square(*off_px);
      const auto towards = [&](const Eigen::Vector3d& axis) {
        const Eigen::Vector3d centre = pose * lamp.centre_m;
        const auto at = scene.camera.project(centre),
                   there = scene.camera.project(centre + 0.01 * (pose.rotation * axis));
        return point.normal.dot((*there - *at).normalized());
      };
      const double along = towards(lamp.x_axis), across = towards(lamp.normal.cross(lamp.x_axis));
      ++on_side[std::abs(along) > std::abs(across) ? (along > 0) : 2 + (across > 0)];
    }
    const auto n = static_cast<double>(blob.rim.size());
    points += static_cast<int>(blob.rim.size());
    sum_px += sum;
    scatter_px += std::sqrt(std::max(0.0, squares / n - square(sum / n)));
    fewest_on_side = std::min(fewest_on_side, on_side.minCoeff());
    const Eigen::Vector2d error = blob.centroid_px - rendered.lamps[0].image_centre_px;
    centre_nees += error.dot(blob.covariance_px2.inverse() * error) / 2;
    ++lamps;
    if (blob.corners_px.size() != 4) return;
    ++with_corners;
    for (const double i : {-0.5, 0.5})
      for (const double j : {-0.5, 0.5}) {
        const Eigen::Vector3d corner = lamp.centre_m + i * lamp.size_m.x() * lamp.x_axis +
                                       j * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
        double nearest = infinity;
        for (const Eigen::Vector2d& seen : blob.corners_px)
          nearest = std::min(nearest, (*scene.camera.project(pose * corner) - seen).norm());
        corner_px = std::max(corner_px, nearest);
      }
  }
};

Errors errors_of(Scene scene, double distance_m, int trials, double light = 1) {
  scene.validate();
  scene.lamps[0].power_w *= light;
  Random random(5);
  Errors errors;
  DetectOptions options;
  options.sensor = scene.sensor;
  for (int trial = 0; trial < trials; ++trial) {
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(trial);
    const Rendered rendered = simulate(scene, random_view(random, distance_m), simulation);
    if (!rendered.lamps[0].whole) continue;
    const auto blobs = detect(rendered.image.view(), options);
    EXPECT_EQ(blobs.size(), 1u) << trial;
    if (blobs.empty()) continue;
    EXPECT_FALSE(blobs[0].merged) << trial;
    EXPECT_EQ(blobs[0].saturated, light > 1) << trial;
    EXPECT_FALSE(blobs[0].rim.empty()) << trial;
    if (!blobs[0].rim.empty()) errors.add(blobs[0], scene, rendered);
  }
  EXPECT_GT(errors.lamps, trials / 2);
  return errors;
}

TEST(DetectPolygons, RimsOfPanelsAreUnbiasedWithConsistentCovariances) {
  for (const Eigen::Vector2d& size_m : {Eigen::Vector2d(0.6, 0.6), Eigen::Vector2d(0.3, 0.15)}) {
    SCOPED_TRACE(size_m.transpose());
    const Errors errors = errors_of(one_rectangle(size_m), 2.5, 100);
    EXPECT_NEAR(errors.chi2 / errors.points, 1.05, 0.2);
    EXPECT_NEAR(errors.sum_px / errors.points, 0, 0.004);
    EXPECT_NEAR(errors.centre_nees / errors.lamps, 0.9, 0.45);
    EXPECT_EQ(errors.with_corners, errors.lamps);
    EXPECT_LT(errors.corner_px, 0.3);
  }
}

TEST(DetectPolygons, DefocusedPanelsHaveRims) {
  Scene scene = one_rectangle({0.6, 0.6});
  scene.sensor.psf_sigma_px = 2.5;
  scene.validate();
  Random random(5);
  int whole = 0, with_corners = 0;
  for (int trial = 0; trial < 20; ++trial) {
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(trial);
    const Rendered rendered = simulate(scene, random_view(random, 2.5), simulation);
    if (!rendered.lamps[0].whole) continue;
    const auto blobs = detect(rendered.image.view());  // without the sensor: an unknown PSF
    ASSERT_EQ(blobs.size(), 1u) << trial;
    ++whole;
    const Eigen::Vector2d error = blobs[0].centroid_px - rendered.lamps[0].image_centre_px;
    EXPECT_LT(error.dot(blobs[0].covariance_px2.inverse() * error), 18) << trial;  // 1e-4
    if (blobs[0].corners_px.size() != 4) continue;
    ++with_corners;
    EXPECT_LT(error.norm(), 0.05) << trial;
  }
  EXPECT_GT(with_corners, 0.8 * whole);
  EXPECT_GT(whole, 10);
}

TEST(DetectPolygons, TubesHavePointsAtTheirEnds) {
  const Errors errors = errors_of(one_rectangle({1.2, 0.06}), 2.5, 100);
  EXPECT_NEAR(errors.chi2 / errors.points, 1.1, 0.25);
  EXPECT_NEAR(errors.sum_px / errors.points, 0, 0.01);
  EXPECT_GT(errors.fewest_on_side, 0);
  EXPECT_NEAR(errors.centre_nees / errors.lamps, 0.7, 0.5);
}

// In a wide view, the light of a long lamp changes along it more than a parabola tells. Rows and
// columns that cross an end obliquely pass the long sides too.
TEST(DetectPolygons, SidesAreUnbiasedAtTheEdgeOfAWideView) {
  Scene scene = one_rectangle({1.2, 0.06});
  scene.camera = Camera::pinhole(640, 480, 330, 330, 319.5, 239.5);
  scene.validate();
  DetectOptions options;
  options.sensor = scene.sensor;
  SimulateOptions exact;
  exact.noise = false;
  const Lamp& lamp = scene.lamps[0];
  for (const double turn_deg : {1.0, 14.0, 32.0, 45.0, 71.0}) {
    SCOPED_TRACE(turn_deg);
    const Rigid3 pose{so3_exp({0.1, 0.1, 0}) * so3_exp({0, 0, turn_deg / 180 * pi}),
                      {-0.8, 0.5, 2.5}};
    const Rendered rendered = simulate(scene, pose, exact);
    ASSERT_TRUE(rendered.lamps[0].whole);
    const auto blobs = detect(rendered.image.view(), options);
    ASSERT_EQ(blobs.size(), 1u);
    std::map<int, std::pair<double, int>> sides;  // sum of distances, number of points
    for (const RimPoint& point : blobs[0].rim) {
      const Eigen::Vector3d normal =
          pose.rotation.transpose() * Eigen::Vector3d(point.normal.x(), point.normal.y(), 0);
      const double along = normal.dot(lamp.x_axis),
                   across = normal.dot(lamp.normal.cross(lamp.x_axis));
      auto& side = sides[std::abs(along) > std::abs(across) ? (along > 0) : 2 + (across > 0)];
      side.first += *rim_distance_px(lamp, pose, rim_ray(point, scene.camera).value());
      ++side.second;
    }
    ASSERT_EQ(sides.size(), 4u);
    for (const auto& [side, sum] : sides) EXPECT_NEAR(sum.first / sum.second, 0, 0.01) << side;
  }
}

TEST(DetectPolygons, SidesMayBeBentByTheLens) {
  const Errors errors = errors_of(one_rectangle({0.6, 0.6}, -0.15), 2.5, 60);
  EXPECT_NEAR(errors.chi2 / errors.points, 1.1, 0.25);
  EXPECT_NEAR(errors.sum_px / errors.points, 0, 0.006);
  EXPECT_LT(errors.corner_px, 0.5);
}

TEST(DetectPolygons, SaturatedRimsGrowByTheSameDistanceAllAround) {
  const Errors errors = errors_of(one_rectangle({0.6, 0.6}), 2.5, 60, 8);
  EXPECT_GT(errors.sum_px / errors.points, 0.3);
  EXPECT_LT(errors.scatter_px / errors.lamps, 0.08);
  EXPECT_LT(errors.corner_px, 3);
}

TEST(DetectPolygons, OtherShapesHaveNoCorners) {
  const Canvas::Noise noise;
  Random random(3);
  for (const double apart_px : {0.0, 8.0, 14.0, 19.0}) {
    SCOPED_TRACE(apart_px);
    Canvas canvas(100, 80, 40);
    canvas.add_disc({40, 40}, 10, 10, 0, 0.8, 1500);
    if (apart_px > 0) canvas.add_disc({40 + apart_px, 41}, 10, 10, 0, 0.8, 1500);
    DetectOptions options;
    options.sensor = Canvas::sensor(noise, 0.8);
    const auto blobs = detect(canvas.image(noise, &random).view(), options);
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_TRUE(blobs[0].corners_px.empty());
    EXPECT_EQ(blobs[0].merged, apart_px > 0);
  }
}

// Single LEDs behind a weak diffuser: the light varies by a factor of three along the sides. A
// level common to all rows and columns moves the sides inwards by a pixel.
TEST(DetectPolygons, PanelsWithVisibleLedsHaveTheirSides) {
  const Canvas::Noise noise;
  constexpr double half_px = 45, leds = 4;
  Random random(8);
  for (const double turn : {0.1, 0.6, 0.75}) {
    SCOPED_TRACE(turn);
    const Eigen::Vector2d centre(80.3, 79.6);
    const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(turn).toRotationMatrix();
    std::vector<Eigen::Vector2d> corners;
    std::vector<Eigen::Vector2d> rim;
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector2d corner(i == 0 || i == 3 ? half_px : -half_px,
                                   i < 2 ? half_px : -half_px);
      corners.push_back(centre + rotation * corner);
    }
    for (std::size_t i = 0; i < 4; ++i)
      for (int k = 0; k < 200; ++k)
        rim.push_back(corners[i] + k / 200.0 * (corners[(i + 1) % 4] - corners[i]));
    Canvas canvas(160, 160);
    const auto covered = coverage(rim, 0.8, 160, 160);
    for (int y = covered.y0; y < covered.y0 + covered.height; ++y)
      for (int x = covered.x0; x < covered.x0 + covered.width; ++x) {
        const Eigen::Vector2d at = rotation.transpose() * (Eigen::Vector2d(x, y) - centre);
        const double wave = (1 - std::cos(pi * leds * (at.x() / half_px + 1))) *
                            (1 - std::cos(pi * leds * (at.y() / half_px + 1)));
        canvas.at(x, y) = covered.at(x, y) * 1000 * (1 + 0.6 * wave);
      }
    DetectOptions options;
    options.sensor = Canvas::sensor(noise, 0.8);
    const auto blobs = detect(canvas.image(noise, &random).view(), options);
    ASSERT_EQ(blobs.size(), 1u);
    const Blob& blob = blobs[0];
    ASSERT_EQ(blob.corners_px.size(), 4u);
    for (const Eigen::Vector2d& seen : blob.corners_px) {
      double nearest = infinity;
      for (const Eigen::Vector2d& corner : corners)
        nearest = std::min(nearest, (corner - seen).norm());
      EXPECT_LT(nearest, 0.5);
      EXPECT_LT(nearest, 6 * std::sqrt(blob.rim_covariance_px2.trace()));
    }
    const Eigen::Vector2d error = blob.centroid_px - centre;
    EXPECT_LT(error.dot(blob.covariance_px2.inverse() * error), 18);
  }
}

TEST(DetectPolygons, CanBeSwitchedOff) {
  Scene scene = one_rectangle({0.6, 0.6});
  scene.validate();
  Random random(5);
  const Rendered rendered = simulate(scene, random_view(random, 2.5));
  DetectOptions options;
  options.sensor = scene.sensor;
  options.polygons = false;
  const auto blobs = detect(rendered.image.view(), options);
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_TRUE(blobs[0].merged);
  EXPECT_TRUE(blobs[0].rim.empty());
}

// The image border cuts the panel: no point lies on that side.
TEST(DetectPolygons, TheBorderIsNoSide) {
  Scene scene = one_rectangle({0.6, 0.6});
  scene.validate();
  Rigid3 pose;
  pose.rotation = so3_exp(Eigen::Vector3d(0.1, 0.05, 0.2));
  pose.translation = {1.85, 0.2, 2.5};
  const Rendered rendered = simulate(scene, pose);
  ASSERT_FALSE(rendered.lamps[0].whole);
  DetectOptions options;
  options.sensor = scene.sensor;
  const auto blobs = detect(rendered.image.view(), options);
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_TRUE(blobs[0].cut_by_border);
  EXPECT_GT(blobs[0].rim.size(), 50u);
  for (const RimPoint& point : blobs[0].rim) {
    const auto off_px = rim_distance_px(scene.lamps[0], pose, rim_ray(point, scene.camera).value());
    ASSERT_TRUE(off_px.has_value());
    EXPECT_LT(std::abs(*off_px), 6 * point.sigma_px + 0.05);
  }
}

// The sides in the image are measured as well as those of a whole panel if it is no narrow strip.
TEST(DetectPolygons, TheVisiblePartOfACutPanelHasARim) {
  Scene scene = one_rectangle({0.4, 0.3});
  scene.validate();
  DetectOptions options;
  options.sensor = scene.sensor;
  Random random(6);
  double chi2 = 0, sum_px = 0;
  int panels = 0, measured = 0, points = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Rigid3 pose = random_view(random, 2.4);
    const bool on_left = random.uniform() < 0.5;
    // The image ends at 1.83 m from the axis, or at 1.37 m.
    const double inside_m = random.uniform(-0.05, 0.12);
    if (on_left)
      pose.translation.x() = -1.83 + inside_m;
    else
      pose.translation.y() = 1.37 - inside_m;
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(trial);
    const Rendered rendered = simulate(scene, pose, simulation);
    if (rendered.lamps[0].whole) continue;
    ++panels;
    const auto blobs = detect(rendered.image.view(), options);
    ASSERT_EQ(blobs.size(), 1u) << trial;
    EXPECT_TRUE(blobs[0].cut_by_border) << trial;
    measured += blobs[0].rim.size() > 20;
    for (const RimPoint& point : blobs[0].rim) {
      const auto off_px = rim_distance_px(scene.lamps[0], pose, *rim_ray(point, scene.camera));
      ASSERT_TRUE(off_px.has_value()) << trial;
      chi2 += square(*off_px / point.sigma_px);
      sum_px += *off_px;
      ++points;
    }
  }
  EXPECT_GE(panels, 90);
  EXPECT_GE(measured, panels * 9 / 10);
  EXPECT_NEAR(chi2 / points, 1.1, 0.25);
  EXPECT_NEAR(sum_px / points, 0, 0.01);
}

}  // namespace
}  // namespace occ
