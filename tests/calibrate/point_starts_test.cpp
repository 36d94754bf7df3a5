// SPDX-License-Identifier: Apache-2.0
// Start values of poses and points, from known points and from images alone.
#include "libocc/calibrate/point_starts.hpp"

#include <gtest/gtest.h>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;

/// Images of points on a ceiling, from a circle of places below it.
struct Ceiling {
  Camera camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  std::vector<Camera> cameras;
  std::vector<Vector3d> points;
  std::vector<Rigid3> poses;
  std::vector<PixelsOfPoints> images;

  Ceiling(int images_count, int points_count, double depth, double noise_px) {
    Random random(7);
    for (int p = 0; p < points_count; ++p)
      points.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1),
                          3 + random.uniform(-depth, depth));
    for (int i = 0; i < images_count; ++i) {
      const double turn = 2 * pi * i / images_count;
      Rigid3 pose;
      pose.rotation = so3_exp({0.1 * std::sin(turn), 0.1 * std::cos(turn), turn});
      pose.translation = -(pose.rotation * Vector3d(0.6 * std::cos(turn), 0.6 * std::sin(turn), 0));
      PixelsOfPoints seen;
      for (int p = 0; p < points_count; ++p)
        if (const auto px = camera.project(pose * points[static_cast<std::size_t>(p)]))
          if (camera.contains(*px))
            seen[p] = *px + noise_px * Eigen::Vector2d(random.normal(), random.normal());
      poses.push_back(pose);
      images.push_back(seen);
      cameras.push_back(camera);
    }
  }

  /// Largest error of the distances between points, relative to their scale.
  double worst_distance(const PointStarts& starts) const {
    const auto distance = [&](int a, int b) {
      return (starts.points_m.at(a) - starts.points_m.at(b)).norm() /
             (points[static_cast<std::size_t>(a)] - points[static_cast<std::size_t>(b)]).norm();
    };
    const double scale = distance(0, 1);
    double worst = 0;
    for (const auto& [a, at] : starts.points_m)
      for (const auto& [b, other] : starts.points_m)
        if (a < b) worst = std::max(worst, std::abs(distance(a, b) / scale - 1));
    return worst;
  }
};

TEST(PointStarts, FreeStartsOfPointsInSpaceAndInAPlane) {
  for (const double depth : {0.5, 0.0}) {
    const Ceiling exact(8, 12, depth, 0);
    const auto found = free_starts(exact.cameras, exact.images);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].cam_from_world.size(), 8u);
    EXPECT_EQ(found[0].points_m.size(), 12u);
    EXPECT_LT(exact.worst_distance(found[0]), 1e-4) << depth;
    const Ceiling noisy(8, 12, depth, 0.1);
    const auto near = free_starts(noisy.cameras, noisy.images);
    ASSERT_FALSE(near.empty());
    EXPECT_EQ(near[0].cam_from_world.size(), 8u);
    EXPECT_LT(noisy.worst_distance(near[0]), 0.1) << depth;
  }
}

TEST(PointStarts, ExtendKnownPoints) {
  const Ceiling ceiling(5, 14, 0.3, 0);
  PointStarts known;
  for (int p = 0; p < 5; ++p) known.points_m[p] = ceiling.points[static_cast<std::size_t>(p)];
  const PointStarts found = start_values(ceiling.cameras, ceiling.images, known);
  EXPECT_EQ(found.points_m.size(), 14u);
  ASSERT_EQ(found.cam_from_world.size(), 5u);
  for (const auto& [image, pose] : found.cam_from_world)
    EXPECT_LT(difference(pose, ceiling.poses[static_cast<std::size_t>(image)]).norm(), 1e-6);
  for (const auto& [point, at] : found.points_m)
    EXPECT_LT((at - ceiling.points[static_cast<std::size_t>(point)]).norm(), 1e-6);
}

TEST(PointStarts, LeaveOutWhatDoesNotFollow) {
  Ceiling ceiling(4, 10, 0.3, 0);
  ceiling.images[3] = {{0, {100, 100}}, {1, {200, 100}}, {77, {300, 100}}};
  const auto found = free_starts(ceiling.cameras, ceiling.images);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].cam_from_world.count(3), 0u);
  EXPECT_EQ(found[0].points_m.count(77), 0u);
  // Turned only: no distances. Too few common points: no pair.
  Ceiling turned(3, 10, 0.3, 0);
  for (PixelsOfPoints& image : turned.images) image = turned.images[0];
  EXPECT_TRUE(free_starts(turned.cameras, turned.images).empty());
  for (PixelsOfPoints& image : ceiling.images)
    while (image.size() > 3) image.erase(image.begin());
  EXPECT_TRUE(free_starts(ceiling.cameras, ceiling.images).empty());
  EXPECT_TRUE(free_starts({}, {}).empty());
  EXPECT_THROW(free_starts({ceiling.camera}, {}), std::invalid_argument);
  EXPECT_THROW(start_values({ceiling.camera}, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace occ
