// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {
namespace {

/// Lamps matched to the same blobs by both hypotheses, as columns.
struct Counterparts {
  Eigen::Matrix3Xd from, to, from_normals, to_normals;
  bool same_lamps = true;
  double spread_m = 0;  ///< root mean square distance from the centroid
};

Counterparts counterparts(const AssignmentProblem& problem, const PoseHypothesis& best,
                          const PoseHypothesis& rival) {
  std::vector<std::pair<int, int>> lamps;
  for (const Pair& a : best.pairs)
    for (const Pair& b : rival.pairs)
      if (a.observation == b.observation) lamps.push_back({a.map_point, b.map_point});
  const auto count = static_cast<Eigen::Index>(lamps.size());
  Counterparts c;
  for (Eigen::Matrix3Xd* m : {&c.from, &c.to, &c.from_normals, &c.to_normals}) m->resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto [a, b] = lamps[i];
    c.from.col(i) = problem.map_point(a).centre;
    c.to.col(i) = problem.map_point(b).centre;
    c.from_normals.col(i) = problem.map_point(a).normal;
    c.to_normals.col(i) = problem.map_point(b).normal;
    c.same_lamps = c.same_lamps && a == b;
  }
  if (count > 0)
    c.spread_m = std::sqrt((c.from.colwise() - c.from.rowwise().mean()).squaredNorm() /
                           static_cast<double>(count));
  return c;
}

// Least-squares alignment (Kabsch). The normals resolve the reflection of coplanar lamps.
Rigid3 align(const Counterparts& c) {
  const Eigen::Vector3d from = c.from.rowwise().mean(), to = c.to.rowwise().mean();
  const Eigen::Matrix3d moment =
      (c.to.colwise() - to) * (c.from.colwise() - from).transpose() +
      c.spread_m * c.spread_m * c.to_normals * c.from_normals.transpose();
  const Eigen::Matrix3d rotation = nearest_rotation(moment);
  return {rotation, to - rotation * from};
}

std::string rounded_to_mm(const Eigen::Ref<const Eigen::VectorXd>& v) {
  std::ostringstream text;
  for (Eigen::Index i = 0; i < v.size(); ++i)
    text << (i > 0 ? ", " : "(") << std::round(1000 * v[i]) / 1000 + 0.0;
  text << ')';
  return text.str();
}

struct Screw {
  Eigen::Vector3d axis;      ///< unit vector
  Eigen::Vector3d position;  ///< point on the axis, nearest to the lamps' centroid
  double angle_rad = 0, along_m = 0;
};

// Decomposes a motion with the rotation vector `rotation`, which must not be small. The axis points
// up if it is not horizontal.
Screw screw_of(const Rigid3& moved, const Eigen::Vector3d& rotation,
               const Eigen::Vector3d& centroid) {
  Screw s;
  s.angle_rad = rotation.norm();
  s.axis = rotation / s.angle_rad;
  const bool down = s.axis.z() < -1e-6;
  if (down) s.axis = -s.axis, s.angle_rad = -s.angle_rad;
  const Eigen::Vector3d step = moved * centroid - centroid;
  s.along_m = s.axis.dot(step);
  const Eigen::Vector3d across = step - s.along_m * s.axis;
  s.position = centroid + 0.5 * across + 0.5 / std::tan(0.5 * s.angle_rad) * s.axis.cross(across);
  return s;
}

std::string text_of(const Screw& s, bool moves_along) {
  constexpr double vertical = 0.9999, deg = 180 / pi;
  std::ostringstream text;
  const double angle_deg = std::round(10 * deg * s.angle_rad) / 10;
  text << "rotation by " << (angle_deg == -180 ? 180 : angle_deg) << " deg about the ";
  if (s.axis.z() > vertical)
    text << "vertical axis through " << rounded_to_mm(s.position.head<2>());
  else
    text << "axis along " << rounded_to_mm(s.axis) << " through " << rounded_to_mm(s.position);
  if (moves_along)
    text << " and translation by " << std::round(1000 * s.along_m) / 1000 << " m along it";
  return text.str();
}

void classify(const Counterparts& c, Symmetry& s) {
  constexpr double min_rotation_rad = 0.01;
  constexpr double min_translation = 0.02;  // relative to the lamps' spread
  const Eigen::Vector3d rotation = so3_log(s.world_from_world.rotation);
  if (rotation.norm() < min_rotation_rad) {
    s.kind = SymmetryKind::translation;
    s.text = "translation by " + rounded_to_mm(s.world_from_world.translation) + " m";
    return;
  }
  const Screw screw = screw_of(s.world_from_world, rotation, c.from.rowwise().mean());
  const bool moves_along = std::abs(screw.along_m) > min_translation * c.spread_m;
  s.kind = moves_along ? SymmetryKind::screw : SymmetryKind::rotation;
  s.text = text_of(screw, moves_along);
}

}  // namespace

Symmetry find_symmetry(const AssignmentProblem& problem, const PoseHypothesis& best,
                       const PoseHypothesis& rival) {
  constexpr double max_misfit = 0.05, exact = 1e-3;  // relative to the lamps' spread
  Counterparts c = counterparts(problem, best, rival);
  const auto count = c.from.cols();
  const Rigid3 by_pose =
      problem.from_world(rival.estimate.pose).inverse() * problem.from_world(best.estimate.pose);
  Symmetry s;
  s.world_from_world = by_pose;
  if (count >= 3 && c.same_lamps) {
    s.kind = SymmetryKind::planar_flip;
    s.text = "flip: the same assignment from a different camera pose";
    return s;
  }
  s.text = count < 3 ? "no symmetry: matches other blobs"
                     : "no symmetry: other lamps look similar from a different camera pose";
  if (count < 3) return s;
  c.from.colwise() += problem.origin;
  c.to.colwise() += problem.origin;
  const Rigid3 moved = align(c);
  s.misfit_m =
      std::sqrt(((moved.rotation * c.from).colwise() + moved.translation - c.to).squaredNorm() /
                static_cast<double>(count));
  if (s.misfit_m > max_misfit * c.spread_m) return s;
  s.world_from_world = moved;
  classify(c, s);
  if (s.misfit_m > exact * c.spread_m)
    s.text += ", to within " + std::to_string(std::lround(1000 * s.misfit_m)) + " mm";
  return s;
}

}  // namespace occ::internal::identify
