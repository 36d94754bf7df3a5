// SPDX-License-Identifier: Apache-2.0
// Pose from the distances of three points. The distances are found in pose/internal/p3p_roots.hpp,
// from the intersections of two conics in pose/internal/conic_pencil.hpp.
#include "libocc/pose/solvers/p3p.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/p3p_roots.hpp"
#include "libocc/pose/internal/pose_newton.hpp"

namespace occ {

using namespace internal::pose;
namespace {

// The points' triangle, its longest side first, with its frame: x along that side, z normal.
struct TriangleFrame {
  Triangle triangle;
  int order[3];     // cyclic order of the corners
  double unit = 0;  // root of the summed squared sides, the triangle's unit of length
  double inverse_side = 0, inverse_height = 0;
  Eigen::Matrix3d axes;
};

// Returns false for points that are on a line (to rounding) or coincide.
bool make_frame(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points, TriangleFrame& c) {
  double chord2[3], side2[3];
  for (int k = 0; k < 3; ++k) {
    chord2[k] = (bearings.col(k) - bearings.col(next(k))).squaredNorm();
    side2[k] = (points.col(k) - points.col(next(k))).squaredNorm();
  }
  const double sum = side2[0] + side2[1] + side2[2], inverse = 1 / sum;
  c.unit = std::sqrt(sum);
  Triangle& t = c.triangle;
  for (int k = 0, i = argmax(side2[0], side2[1], side2[2]); k < 3; ++k, i = next(i)) {
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
  constexpr double min_area = 1e-11;  // over the squared size; rounding below
  return area > min_area * sum && std::min({chord2[0], chord2[1], chord2[2]}) > 0;
}

// Needed far away and for points nearly on a line, where rounding of the distances changes the
// lengths by which the frame is scaled.
void orthonormalise(Eigen::Vector3d& x, Eigen::Vector3d& z) {
  x.normalize();
  z = (z - x * x.dot(z)).normalized();
}

// `exact`: the distances reproduce the triangle's sides to rounding.
void pose_from_depths(const TriangleFrame& c, const Eigen::Matrix3d& bearings,
                      const Eigen::Matrix3d& points, const double depth[3], bool exact,
                      Rigid3& pose) {
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
  // The translation follows from the nearest corner if one is much nearer, because there a shift
  // causes the largest angle.
  int anchor = 0;
  if (!(std::min(depth[1], depth[2]) > 0.1 * depth[0])) anchor = depth[1] < depth[2] ? 1 : 2;
  pose.translation = corner(anchor) - pose.rotation * points.col(c.order[anchor]);
}

// Distance of the farthest corner, in heights of the triangle over its longest side.
double distance_in_heights(const TriangleFrame& c, const double depth[3]) {
  return std::max(std::max(depth[0], depth[1]), depth[2]) * c.unit * c.inverse_height;
}

// Beyond this distance in heights rounding makes the frame measurably non-orthonormal.
constexpr double max_exact_heights = 50;

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

void polish_about_centroid(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points,
                           Rigid3& pose) {
  constexpr int max_steps = 4;
  const UnitFrame about{points.rowwise().mean(), 1};
  Rigid3 centred = about.normalised(pose);
  polish_pose(bearings, points.colwise() - about.centroid, {}, max_steps, centred);
  pose = about.restored(centred);
}

// True if one of the poses after the first `skip` has the same rotation.
bool is_among(const Rigid3& pose, const std::vector<Rigid3>& poses, std::size_t skip) {
  constexpr double same_rotation = 1e-7;  // a few square roots of rounding, as of a double root
  const auto first = poses.begin() + static_cast<std::ptrdiff_t>(skip);
  return std::any_of(first, poses.end(), [&](const Rigid3& p) {
    return (p.rotation - pose.rotation).norm() < same_rotation;
  });
}

void append_poses(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                  std::vector<Rigid3>& poses) {
  const std::size_t before = poses.size();
  TriangleFrame frame;
  if (!make_frame(bearings, points_in_world, frame)) return;
  // Size of the triangle, in its heights, beyond which the distance equations hardly depend on the
  // height; and distance beyond which their rounding turns the pose by more than 2e-14 rad. One
  // random pose in five hundred is farther.
  constexpr double flat = 300, far = 80;
  Root roots[max_roots];
  const bool is_flat = frame.unit * frame.inverse_height > flat;
  const int count = find_roots(frame.triangle, is_flat, roots);
  Rigid3 pose;
  for (int i = 0; i < count; ++i) {
    const double* d = roots[i].depth;
    const double heights = distance_in_heights(frame, d);
    pose_from_depths(frame, bearings, points_in_world, d, heights < max_exact_heights, pose);
    if (is_flat || heights > far) polish_about_centroid(bearings, points_in_world, pose);
    if (is_flat && is_among(pose, poses, before)) continue;
    poses.push_back(pose);
    if (poses.size() == before + 4) break;  // the others are copies of a double root
  }
}

void solve_p3p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  append_poses(problem.bearings, problem.points, candidates);
}

}  // namespace

int p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
        std::vector<Rigid3>& poses) {
  poses.clear();
  append_poses(bearings, points_in_world, poses);
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
  TriangleFrame frame;
  if (!make_frame(bearings, points_in_world, frame)) return 0;
  Root roots[4];
  const int count = find_real_parts(frame.triangle, roots);
  std::size_t kept = 0;
  for (int i = 0; i < count; ++i) {
    const Root& root = roots[i];
    const bool exact = root.real && distance_in_heights(frame, root.depth) < max_exact_heights;
    pose_from_depths(frame, bearings, points_in_world, root.depth, exact, poses[kept]);
    kept += reproduces(poses[kept], bearings, points_in_world, tolerance_rad);
  }
  return static_cast<int>(kept);
}

constexpr Solver p3p_solver = {
    /*name=*/"p3p",
    /*min_points=*/3,
    /*max_points=*/3,
    /*max_candidates=*/4, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "none known; points nearer to a line than 1e-5 of their size lose digits, as with any solver",
    /*source=*/"libocc; conics after Ding, Yang, Larsson, Olsson, Astrom, CVPR 2023", solve_p3p};

}  // namespace occ
