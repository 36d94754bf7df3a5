// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/p3p.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/pose/internal/p3p_roots.hpp"
#include "libocc/pose/internal/pose_newton.hpp"
#include "libocc/pose/internal/unit_frame.hpp"

namespace occ {

using namespace internal::pose;
namespace {

// The points' triangle, its longest side first, with its frame: x along that side, z normal.
struct Corners {
  Triangle triangle;
  int order[3];     // of the corners, cyclic
  double unit = 0;  // the root of the summed squared sides, which the triangle takes for 1
  double inverse_side = 0, inverse_height = 0;
  Eigen::Matrix3d axes;
};

// False for points on a line (to rounding) or in one place.
bool make_corners(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points, Corners& c) {
  double chord2[3], side2[3];
  for (int k = 0; k < 3; ++k) {
    chord2[k] = (bearings.col(k) - bearings.col(next(k))).squaredNorm();
    side2[k] = (points.col(k) - points.col(next(k))).squaredNorm();
  }
  const double sum = side2[0] + side2[1] + side2[2], inverse = 1 / sum;
  c.unit = std::sqrt(sum);
  Triangle& t = c.triangle;
  for (int k = 0, i = largest_of(side2[0], side2[1], side2[2]); k < 3; ++k, i = next(i)) {
    c.order[k] = i;
    t.chord2[k] = chord2[i];
    t.side2[k] = side2[i] * inverse;
    t.inverse_side[k] = 1 / std::sqrt(t.side2[k]);
  }
  const Eigen::Vector3d origin = points.col(c.order[0]);
  const Eigen::Vector3d side = points.col(c.order[1]) - origin;
  const Eigen::Vector3d normal = side.cross(points.col(c.order[2]) - origin);
  const double area = normal.norm(), inverse_area = 1 / area;
  c.inverse_side = t.inverse_side[0] * c.unit * inverse;
  c.inverse_height = side2[c.order[0]] * c.inverse_side * inverse_area;
  c.axes.col(0) = side * c.inverse_side;
  c.axes.col(2) = normal * inverse_area;
  c.axes.col(1) = c.axes.col(2).cross(c.axes.col(0));
  constexpr double on_a_line = 1e-11;  // area over squared size
  return area > on_a_line * sum && std::min({chord2[0], chord2[1], chord2[2]}) > 0;
}

// Far away, or for points nearly on a line, rounding of the distances shows in the lengths that the
// frame is scaled by.
void orthonormalise(Eigen::Vector3d& x, Eigen::Vector3d& z) {
  x.normalize();
  z = (z - x * x.dot(z)).normalized();
}

// `exact`: the distances have the triangle's sides, to rounding.
void pose_of(const Corners& c, const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points,
             const double depth[3], bool exact, Rigid3& pose) {
  const auto corner = [&](int i) -> Eigen::Vector3d {
    return bearings.col(c.order[i]) * (c.unit * depth[i]);
  };
  const Eigen::Vector3d first = corner(0), other = corner(2) - first;
  Eigen::Vector3d x = (corner(1) - first) * c.inverse_side;
  Eigen::Vector3d z = x.cross(other) * c.inverse_height;
  if (!exact) orthonormalise(x, z);
  const Eigen::Vector3d y = z.cross(x);
  for (int k = 0; k < 3; ++k)
    pose.rotation.col(k) = c.axes(k, 0) * x + c.axes(k, 1) * y + c.axes(k, 2) * z;
  // From the nearest corner, where a shift is the largest angle, if that matters.
  int anchor = 0;
  if (!(std::min(depth[1], depth[2]) > 0.1 * depth[0])) anchor = depth[1] < depth[2] ? 1 : 2;
  pose.translation = corner(anchor) - pose.rotation * points.col(c.order[anchor]);
}

// The farthest corner's distance in heights of the triangle over its longest side.
double heights_away(const Corners& c, const double depth[3]) {
  return std::max(std::max(depth[0], depth[1]), depth[2]) * c.unit * c.inverse_height;
}

constexpr double inexact = 50;  // heights from where on rounding shows in the frame

bool reproduces(const Rigid3& pose, const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points,
                double tolerance_rad) {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d seen = pose * Eigen::Vector3d(points.col(i));
    const double along = bearings.col(i).dot(seen);
    const double across2 = seen.squaredNorm() - along * along;
    if (!(along > 0) || !(across2 <= tolerance_rad * tolerance_rad * along * along)) return false;
  }
  return true;
}

void sharpen_about_centroid(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points,
                            Rigid3& pose) {
  constexpr int max_steps = 4;
  const UnitFrame about{points.rowwise().mean(), 1};
  Rigid3 centred = about.normalised(pose);
  sharpen(bearings, points.colwise() - about.centroid, {}, max_steps, centred);
  pose = about.restored(centred);
}

bool is_among(const Rigid3& pose, const std::vector<Rigid3>& poses) {
  constexpr double same_rotation = 1e-7;
  return std::any_of(poses.begin(), poses.end(), [&](const Rigid3& p) {
    return (p.rotation - pose.rotation).norm() < same_rotation;
  });
}

}  // namespace

int p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
        std::vector<Rigid3>& poses) {
  poses.clear();
  Corners corners;
  if (!make_corners(bearings, points_in_world, corners)) return 0;
  // In heights of the triangle: its size, and its distance, from where on the distances' equations
  // hardly see the height.
  constexpr double flat = 300, far = 1000;
  Root roots[max_roots];
  const bool is_flat = corners.unit * corners.inverse_height > flat;
  const int count = find_roots(corners.triangle, is_flat, roots);
  Rigid3 pose;
  for (int i = 0; i < count; ++i) {
    const double* d = roots[i].depth;
    const double heights = heights_away(corners, d);
    pose_of(corners, bearings, points_in_world, d, heights < inexact, pose);
    if (is_flat || heights > far) sharpen_about_centroid(bearings, points_in_world, pose);
    if (is_flat && is_among(pose, poses)) continue;
    poses.push_back(pose);
    if (poses.size() == 4) break;  // more are copies of a double root
  }
  return static_cast<int>(poses.size());
}

std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world) {
  require_finite(points_in_world, "points_in_world");
  for (int i = 0; i < 3; ++i)
    require(std::abs(bearings.col(i).norm() - 1) <= 1e-6, "bearings", bearings.col(i).transpose(),
            "unit columns");
  std::vector<Rigid3> poses;
  p3p(bearings.colwise().normalized(), points_in_world, poses);
  return poses;
}

int p3p_within(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
               double tolerance_rad, std::array<Rigid3, 4>& poses) {
  Corners corners;
  if (!make_corners(bearings, points_in_world, corners)) return 0;
  Root roots[4];
  const int count = find_real_parts(corners.triangle, roots);
  std::size_t kept = 0;
  for (int i = 0; i < count; ++i) {
    const Root& root = roots[i];
    const bool exact = root.real && heights_away(corners, root.depth) < inexact;
    pose_of(corners, bearings, points_in_world, root.depth, exact, poses[kept]);
    kept += reproduces(poses[kept], bearings, points_in_world, tolerance_rad);
  }
  return static_cast<int>(kept);
}

}  // namespace occ
