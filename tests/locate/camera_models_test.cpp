// SPDX-License-Identifier: Apache-2.0
// The whole path with cameras that are no pinholes: lamps are rendered, found, named and give the
// pose, within what the fix itself expects.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// Lamps on the walls of 6 x 5 x 3 m, irregularly, that shine into the room.
Scene walls_scene(const Camera& camera) {
  Scene scene = test::irregular_room();
  scene.camera = camera;
  scene.room = Room{};
  scene.room->size_m = {6, 5, 3};
  scene.lamps.clear();
  struct Place {
    Eigen::Vector3d at, normal;
  };
  const std::vector<Place> places{
      {{0, 1.1, 2.0}, {1, 0, 0}},  {{0, 3.7, 1.2}, {1, 0, 0}},  {{6, 0.8, 1.5}, {-1, 0, 0}},
      {{6, 2.6, 2.3}, {-1, 0, 0}}, {{6, 4.4, 1.0}, {-1, 0, 0}}, {{1.4, 0, 1.9}, {0, 1, 0}},
      {{4.5, 0, 1.3}, {0, 1, 0}},  {{2.2, 5, 2.2}, {0, -1, 0}}, {{3.9, 5, 1.1}, {0, -1, 0}}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    Lamp lamp = test::disc_lamp(static_cast<int>(i), places[i].at, 0.06);
    lamp.normal = places[i].normal;
    lamp.x_axis = {0, 0, 1};
    scene.lamps.push_back(lamp);
  }
  return scene;
}

RotatingLine line() {
  RotatingLine l;
  l.width = 2400;
  l.height = 700;
  l.angle_per_px_rad = 2 * pi / 2398.4;
  l.c_px = 380;
  l.cy_px = 350.3;
  l.tilt_x_rad = 0.003;
  l.tilt_y_rad = -0.002;
  l.eccentricity_m = {0.012, -0.008, 0};
  l.k1 = 0.01;
  return l;
}

/// The panorama camera upright: its Z axis, towards growing rows, points down.
Rigid3 upright(const Eigen::Vector3d& position, double heading_rad, double tilt_rad) {
  const Eigen::Matrix3d down = (Eigen::Matrix3d() << 1, 0, 0, 0, -1, 0, 0, 0, -1).finished();
  const Eigen::Matrix3d rotation =
      so3_exp({tilt_rad, -tilt_rad, 0}) * so3_exp({0, 0, heading_rad}) * down;
  return {rotation, -(rotation * position)};
}

void expect_fix(const Scene& scene, const Rigid3& truth, double max_error_m, std::uint64_t seed) {
  SimulateOptions options;
  options.seed = seed;
  const Rendered rendered = simulate(scene, truth, options);
  const Result<Fix> fix = locate(rendered.image.view(), scene);
  ASSERT_EQ(fix.status, Status::ok) << seed << ": " << fix.message;
  const Eigen::Vector3d error = fix->position_m - truth.origin_in_source();
  EXPECT_LT(error.norm(), max_error_m) << seed;
  EXPECT_LT(error.dot(fix->position_covariance_m2.inverse() * error), 25) << seed;
}

TEST(LocateByPanorama, FindsTheCameraWithoutCodeOrPrior) {
  Scene scene = walls_scene(Camera::rotating_line(line()));
  Random random(4);
  for (std::uint64_t trial = 0; trial < 8; ++trial) {
    const Eigen::Vector3d at(random.uniform(1.5, 4.5), random.uniform(1.5, 3.5),
                             random.uniform(1.2, 1.8));
    expect_fix(scene, upright(at, random.uniform(-pi, pi), 0.02), 2e-3, trial);
  }
}

TEST(LocateByPanorama, ALampOnTheSeamIsOneLamp) {
  Scene scene = walls_scene(Camera::rotating_line(line()));
  const Eigen::Vector3d at(3, 2.4, 1.5);
  // Turned so that lamp 3 is seen at theta = 0.
  const Eigen::Vector3d to_lamp = scene.lamps[3].centre_m - at;
  const Rigid3 pose = upright(at, std::atan2(to_lamp.y(), to_lamp.x()), 0);
  SimulateOptions options;
  options.noise = false;
  const Rendered rendered = simulate(scene, pose, options);
  const Image& image = rendered.image;
  const LampTruth& truth = rendered.lamps[3];
  ASSERT_TRUE(truth.in_view);
  const auto row = static_cast<std::size_t>(std::lround(truth.image_centre_px.y()));
  const auto level = [&](std::size_t x) {
    return int{image.u8[row * static_cast<std::size_t>(image.width) + x]};
  };
  EXPECT_GT(level(0), 100);  // the lamp goes on at both ends
  EXPECT_GT(level(2396), 100);
  expect_fix(scene, pose, 2e-3, 1);
}

/// A blob at each lamp's image centre, moved by `off_px` along the row and wrapped at the seam.
std::vector<Blob> wrapped_blobs(const Scene& scene, const Rigid3& pose, double off_px) {
  std::vector<Blob> blobs;
  for (const Lamp& lamp : scene.lamps) {
    Eigen::Vector2d px = project_lamp_centre(lamp, pose, scene.camera).value();
    px.x() += off_px;
    const double period = scene.camera.period_px();
    px.x() -= period * std::floor((px.x() + 0.5) / period);
    Blob blob;
    blob.centroid_px = px;
    blob.covariance_px2 = 0.04 * Eigen::Matrix2d::Identity();
    blob.flux_dn = 1000;
    blob.x0 = static_cast<int>(px.x()) - 3;
    blob.y0 = static_cast<int>(px.y()) - 3;
    blob.x1 = blob.x0 + 6;
    blob.y1 = blob.y0 + 6;
    blobs.push_back(blob);
  }
  return blobs;
}

TEST(LocateByPanorama, ResidualsAcrossTheSeamAreSmall) {
  const Scene scene = walls_scene(Camera::rotating_line(line()));
  const Eigen::Vector3d at(3, 2.4, 1.5), to_lamp = scene.lamps[3].centre_m - at;
  const Rigid3 pose = upright(at, std::atan2(to_lamp.y(), to_lamp.x()), 0);
  for (const double off_px : {-0.3, -0.1, 0.1, 0.3}) {
    // The rotation about the vertical absorbs the common offset, but the lamp is across the seam.
    std::vector<Blob> blobs = wrapped_blobs(scene, pose, off_px);
    blobs[3].centroid_px.x() = off_px < 0 ? 2397.8 : -0.4;
    const Result<Fix> fix = locate(blobs, scene);
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_EQ(fix->lamps.size(), scene.lamps.size());
    EXPECT_LT(fix->rms_px, 1) << off_px;
  }
}

TEST(LocateByPanorama, AMergedBlobAcrossTheSeamBelongsToItsLamp) {
  const Scene scene = walls_scene(Camera::rotating_line(line()));
  const Eigen::Vector3d at(3, 2.4, 1.5), to_lamp = scene.lamps[3].centre_m - at;
  const Rigid3 pose = upright(at, std::atan2(to_lamp.y(), to_lamp.x()), 0);
  for (const int x0 : {0, 2391}) {  // one of the two boxes is across the seam
    std::vector<Blob> blobs = wrapped_blobs(scene, pose, 0);
    blobs[3].merged = true;
    blobs[3].x0 = x0;
    blobs[3].x1 = x0 + 6;
    blobs[3].centroid_px.x() = x0 + 3;
    const Result<Fix> fix = locate(blobs, scene);
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_EQ(fix->lamps.count(3), 1u) << x0;
  }
}

TEST(LocateByFisheye, SeesTheWholeRoom) {
  const Camera camera = Camera::fisheye(1200, 1200, 360, 360, 599.5, 599.5, {0.02, -0.003});
  Scene scene = walls_scene(camera);
  Random random(5);
  for (std::uint64_t trial = 0; trial < 8; ++trial) {
    const Eigen::Vector3d at(random.uniform(1.5, 4.5), random.uniform(1.5, 3.5),
                             random.uniform(0.2, 0.6));
    const Rigid3 pose = look_at(at, at + Eigen::Vector3d(0.1, -0.2, 1), {0, 1, 0});
    expect_fix(scene, pose, 3e-3, trial);
  }
}

TEST(LocateByDoubleSphere, SeesTheWholeRoom) {
  const Camera camera = Camera::double_sphere(1200, 1200, 330, 330, 599.5, 599.5, -0.1, 0.58);
  Scene scene = walls_scene(camera);
  Random random(6);
  for (std::uint64_t trial = 0; trial < 4; ++trial) {
    const Eigen::Vector3d at(random.uniform(1.5, 4.5), random.uniform(1.5, 3.5),
                             random.uniform(0.2, 0.6));
    expect_fix(scene, look_at(at, at + Eigen::Vector3d(0.1, -0.2, 1), {0, 1, 0}), 3e-3, trial);
  }
}

TEST(SolvePoseOfAPanorama, IsExactWithoutNoiseHoweverFarItsRaysMissEachOther) {
  Random random(8);
  for (const double eccentricity : {0.0, 0.01, 0.3}) {
    RotatingLine l = line();
    l.eccentricity_m = {eccentricity, -0.7 * eccentricity, 0};
    const Scene scene = walls_scene(Camera::rotating_line(l));
    for (int trial = 0; trial < 20; ++trial) {
      const Rigid3 truth =
          upright({random.uniform(2, 4), random.uniform(2, 3), 1.5}, random.uniform(-pi, pi), 0.05);
      const auto n = static_cast<Eigen::Index>(scene.lamps.size());
      Eigen::Matrix3Xd points(3, n);
      Eigen::Matrix2Xd pixels(2, n);
      for (Eigen::Index i = 0; i < n; ++i) {
        points.col(i) = scene.lamps[i].centre_m;
        pixels.col(i) = scene.camera.project(truth * points.col(i)).value();
      }
      SolvePoseOptions options;
      options.sigma_px = 1e-4;  // so that the fit is driven to the end
      const Result<Fix> fix = solve_pose(points, pixels, scene.camera, options);
      ASSERT_EQ(fix.status, Status::ok) << fix.message;
      EXPECT_LT((fix->position_m - truth.origin_in_source()).norm(), 1e-9) << eccentricity;
    }
  }
}

}  // namespace
}  // namespace occ
