// SPDX-License-Identifier: Apache-2.0
// Noise-free problems with known answers, for the tests of pose solvers.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::test {

/// Returns false for a solver that this build lacks (LIBOCC_OPENCV or LIBOCC_OPENGV is off).
inline bool in_build(const std::string& name) {
  return std::none_of(missing_solvers().begin(), missing_solvers().end(),
                      [&](const MissingMethod& missing) { return missing.name == name; });
}

struct KnownProblem {
  PoseProblem problem;
  Rigid3 truth;
};

struct ProblemKind {
  bool flat = false;       ///< all points in one plane
  bool rig = false;        ///< each bearing from a centre of its own
  bool half_turn = false;  ///< rotation by 180 degrees, half of them about a coordinate axis
  double nearest = 2;      ///< distance of the centroid, in r.m.s. distances of the points from it
  double farthest = 6;
  double widest = 0.15;  ///< least cosine between a bearing and the direction to the centroid
};

/// Random rotation, uniform over SO(3).
inline Eigen::Matrix3d random_rotation(Random& random) {
  const Eigen::Vector4d q(random.normal(), random.normal(), random.normal(), random.normal());
  return Eigen::Quaterniond(q).normalized().toRotationMatrix();
}

inline Eigen::Matrix3d half_turn(Random& random) {
  const int axis = random.below(6);
  const Eigen::Vector3d about =
      axis < 3 ? Eigen::Vector3d::Unit(axis) : Eigen::Vector3d(random_rotation(random).col(0));
  return so3_exp(pi * about);
}

/// Random points about their centroid with r.m.s. distance 1; their smallest extent (in the plane,
/// if they are flat) is at least a fifth of the largest.
inline Eigen::Matrix3Xd random_points(Random& random, int count, bool flat) {
  const int thin = count < 3 ? 0 : (flat || count == 3 ? 1 : 2);
  for (;;) {
    Eigen::Matrix3Xd points(3, count);
    for (int i = 0; i < count; ++i)
      points.col(i) << random.normal(), random.normal(), flat ? 0 : random.normal();
    points = (random_rotation(random) * points).eval();
    points.colwise() -= points.rowwise().mean().eval();
    points *= std::sqrt(count / points.squaredNorm());
    const Eigen::VectorXd extent = points.jacobiSvd().singularValues();
    if (extent[thin] > 0.2 * extent[0]) return points;
  }
}

/// Random view; by default all points are within 81 degrees of the direction to their centroid.
inline KnownProblem random_problem(Random& random, int count, const ProblemKind& kind) {
  KnownProblem known;
  PoseProblem& problem = known.problem;
  for (;;) {
    problem.points = random_points(random, count, kind.flat);
    known.truth.rotation = kind.half_turn ? half_turn(random) : random_rotation(random);
    const Eigen::Vector3d direction = random_rotation(random).col(0);
    known.truth.translation = random.uniform(kind.nearest, kind.farthest) * direction;
    problem.origins.resize(3, kind.rig ? count : 0);
    for (Eigen::Index i = 0; i < problem.origins.cols(); ++i)
      problem.origins.col(i) << random.normal(), random.normal(), random.normal();
    problem.origins *= 0.4;
    problem.bearings = (known.truth.rotation * problem.points).colwise() + known.truth.translation;
    if (kind.rig) problem.bearings -= problem.origins;
    problem.bearings.colwise().normalize();
    problem.up_in_cam = known.truth.rotation.col(2);
    if ((direction.transpose() * problem.bearings).minCoeff() > kind.widest) return known;
  }
}

/// Angle of rotation [rad] plus distance over range; infinite when not finite.
inline double pose_error(const Rigid3& pose, const Rigid3& truth) {
  const double error = (pose.rotation - truth.rotation).norm() / std::sqrt(2.0) +
                       (pose.translation - truth.translation).norm() / truth.translation.norm();
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

inline double best_error(const std::vector<Rigid3>& candidates, const Rigid3& truth) {
  double best = std::numeric_limits<double>::infinity();
  for (const Rigid3& pose : candidates) best = std::min(best, pose_error(pose, truth));
  return best;
}

inline std::vector<Rigid3> candidates_of(const Solver& solver, const PoseProblem& problem) {
  std::vector<Rigid3> candidates;
  solver.solve(problem, candidates);
  return candidates;
}

}  // namespace occ::test
