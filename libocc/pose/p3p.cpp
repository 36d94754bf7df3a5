// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/p3p.hpp"
//
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

// Kneip's own accuracy near a double root is about 1e-4: what is further off is no root.
constexpr double kneip_tolerance_rad = 0.01;
constexpr double largest_misfit = 1e-9;  // of a polished root, relative to the squared sides
constexpr double same_root = 1e-7;       // relative to the depths; a double root is known to 1e-8

struct Triangle {
  Eigen::Matrix3d bearings;
  Eigen::Matrix3d points;  // about their centroid, unit size
  Eigen::Vector3d centroid;
  double scale = 0;
  Eigen::Vector3d chord2, side2;  // squared, of the pairs (0, 1), (1, 2), (2, 0)
};

struct Root {
  Eigen::Vector3d depth;  // distances from the camera's centre
  double misfit = 0;      // of the distance equations, relative
};

// Three cyclic orders of four candidates each.
struct Roots {
  std::array<Root, 12> list;
  int count = 0;
  bool weak = false;  // a double root was among them
};

struct DistanceEquations {
  Eigen::Vector3d residual;
  Eigen::Vector3d p, q;  // derivative of pair (k, k+1) with respect to depth k and depth k+1
  double misfit = 0;
};

int next(int k) { return k == 2 ? 0 : k + 1; }

// False for points on a line (to rounding) or in one place.
bool make_triangle(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points, Triangle& t) {
  t.bearings = bearings;
  t.centroid = points.rowwise().mean();
  t.points = points.colwise() - t.centroid;
  t.scale = t.points.colwise().norm().maxCoeff();
  if (!(t.scale > 0)) return false;
  t.points /= t.scale;
  for (int k = 0; k < 3; ++k) {
    t.chord2[k] = (bearings.col(k) - bearings.col(next(k))).squaredNorm();
    t.side2[k] = (t.points.col(k) - t.points.col(next(k))).squaredNorm();
  }
  const Eigen::Vector3d a = t.points.col(1) - t.points.col(0);
  const Eigen::Vector3d b = t.points.col(2) - t.points.col(0);
  return a.cross(b).norm() > 1e-10 && t.side2.minCoeff() > 1e-20 && t.chord2.minCoeff() > 0;
}

DistanceEquations distance_equations(const Triangle& t, const Eigen::Vector3d& depth) {
  DistanceEquations e;
  for (int k = 0; k < 3; ++k) {
    const double from = depth[k], to = depth[next(k)], step = from - to;
    e.residual[k] = step * step + from * to * t.chord2[k] - t.side2[k];
    e.p[k] = 2 * step + to * t.chord2[k];
    e.q[k] = -2 * step + from * t.chord2[k];
  }
  e.misfit = (e.residual.array().abs() / t.side2.array()).maxCoeff();
  return e;
}

// Newton step by Cramer's rule on the cyclic matrix with p on its diagonal and q after it.
Eigen::Vector3d newton_step(const DistanceEquations& e, double determinant) {
  Eigen::Vector3d step;
  for (int k = 0; k < 3; ++k) {
    const int l = next(k), m = next(l);
    step[k] = e.p[l] * e.p[m] * e.residual[k] - e.q[k] * e.p[m] * e.residual[l] +
              e.q[k] * e.q[l] * e.residual[m];
  }
  return step / determinant;
}

// At a double root Newton only halves the error at each step, hence the many steps allowed.
// Returns whether the root is well separated from its neighbours.
bool polish(const Triangle& t, Root& root) {
  constexpr int max_steps = 20;
  DistanceEquations e = distance_equations(t, root.depth);
  root.misfit = e.misfit;
  for (int i = 0;; ++i) {
    const double determinant = e.p.prod() + e.q.prod();
    const bool separated =
        std::abs(determinant) > 1e-6 * (std::abs(e.p.prod()) + std::abs(e.q.prod()));
    if (root.misfit < 1e-15 || i == max_steps) return separated;
    const Eigen::Vector3d depth = root.depth - newton_step(e, determinant);
    e = distance_equations(t, depth);
    if (!(e.misfit < root.misfit)) return separated;  // rounding is all that is left
    root = {depth, e.misfit};
  }
}

void add_root(const Root& root, Roots& roots) {
  for (int i = 0; i < roots.count; ++i) {
    Root& known = roots.list[static_cast<std::size_t>(i)];
    if ((known.depth - root.depth).cwiseAbs().maxCoeff() > same_root * root.depth.maxCoeff())
      continue;
    if (root.misfit < known.misfit) known = root;
    return;
  }
  roots.list[static_cast<std::size_t>(roots.count++)] = root;
}

// Kneip's candidates with the points taken in cyclic order from `first`.
void add_kneip_roots(const Triangle& t, int first, double tolerance_rad, bool exact, Roots& roots) {
  opengv::bearingVectors_t bearings(3);
  opengv::points_t points(3);
  for (int k = 0, i = first; k < 3; ++k, i = next(i)) {
    bearings[static_cast<std::size_t>(k)] = t.bearings.col(i);
    points[static_cast<std::size_t>(k)] = t.points.col(i);
  }
  opengv::transformations_t world_from_cam;
  world_from_cam.reserve(4);
  opengv::absolute_pose::modules::p3p_kneip_main(bearings, points, world_from_cam);
  for (const auto& pose : world_from_cam) {
    const Eigen::Matrix3d in_cam =
        pose.leftCols<3>().transpose() * (t.points.colwise() - pose.col(3));
    Root root;
    root.depth = in_cam.colwise().norm();
    const Eigen::Matrix3d error = in_cam - t.bearings * root.depth.asDiagonal();
    const double worst2 =
        (error.colwise().squaredNorm().transpose().array() / root.depth.array().square())
            .maxCoeff();
    if (!error.allFinite() || !(worst2 <= tolerance_rad * tolerance_rad)) continue;
    root.misfit = worst2;
    if (exact) {
      roots.weak |= !polish(t, root);
      if (!(root.misfit <= largest_misfit) || !(root.depth.minCoeff() > 0)) continue;
    }
    add_root(root, roots);
  }
}

// Mirror symmetry of points and bearings alike: Kneip's quartic then loses roots.
bool is_symmetric(const Triangle& t) {
  for (int k = 0; k < 3; ++k) {
    const int l = next(k);
    if (std::abs(t.side2[k] - t.side2[l]) < 1e-6 * t.side2[k] &&
        std::abs(t.chord2[k] - t.chord2[l]) < 1e-6 * t.chord2[k])
      return true;
  }
  return false;
}

Roots find_roots(const Triangle& t, double tolerance_rad, bool exact) {
  Roots roots;
  add_kneip_roots(t, 0, tolerance_rad, exact, roots);
  if ((exact && roots.count == 0) || roots.weak || is_symmetric(t))
    for (int first = 1; first < 3; ++first) add_kneip_roots(t, first, tolerance_rad, exact, roots);
  std::sort(roots.list.begin(), roots.list.begin() + roots.count,
            [](const Root& a, const Root& b) { return a.misfit < b.misfit; });
  roots.count = std::min(roots.count, 4);
  return roots;
}

// Right-handed orthonormal frame on a triangle's corners.
Eigen::Matrix3d frame(const Eigen::Matrix3d& corners) {
  Eigen::Matrix3d axes;
  axes.col(0) = (corners.col(1) - corners.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(corners.col(2) - corners.col(0)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Rigid3 pose_of(const Triangle& t, const Root& root) {
  const Eigen::Matrix3d in_cam = t.bearings * root.depth.asDiagonal();
  Rigid3 pose;
  pose.rotation = frame(in_cam) * frame(t.points).transpose();
  pose.translation = t.scale * in_cam.rowwise().mean() - pose.rotation * t.centroid;
  return pose;
}

}  // namespace

std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world) {
  require(points_in_world.allFinite(), "points_in_world", points_in_world, "finite");
  for (int i = 0; i < 3; ++i)
    require(std::abs(bearings.col(i).norm() - 1) <= 1e-6, "bearings", bearings.col(i).transpose(),
            "unit columns");
  std::vector<Rigid3> poses;
  Triangle triangle;
  if (!make_triangle(bearings.colwise().normalized(), points_in_world, triangle)) return poses;
  const Roots roots = find_roots(triangle, kneip_tolerance_rad, true);
  for (int i = 0; i < roots.count; ++i)
    poses.push_back(pose_of(triangle, roots.list[static_cast<std::size_t>(i)]));
  return poses;
}

int p3p_within(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
               double tolerance_rad, std::array<Rigid3, 4>& poses) {
  Triangle triangle;
  if (!make_triangle(bearings, points_in_world, triangle)) return 0;
  const Roots roots = find_roots(triangle, tolerance_rad, false);
  for (std::size_t i = 0; i < static_cast<std::size_t>(roots.count); ++i)
    poses[i] = pose_of(triangle, roots.list[i]);
  return roots.count;
}

}  // namespace occ
