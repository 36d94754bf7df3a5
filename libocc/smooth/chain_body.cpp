// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_body.hpp"

#include <Eigen/LU>
#include <cmath>

#include "libocc/geometry/motion.hpp"
#include "libocc/geometry/perturbation.hpp"

namespace occ::internal::smooth {
namespace {

/// Pose [x, y, heading] after one unit of time at a constant velocity in the body's frame, sideways
/// motion included: a circular arc. `matrix` maps the velocity to the position.
Eigen::Matrix2d arc_matrix(double turn) {
  const double half = turn / 2;
  const double sinc = std::abs(half) < 1e-8 ? 1 : std::sin(half) / half;
  Eigen::Matrix2d matrix;
  matrix << std::cos(half), -std::sin(half), std::sin(half), std::cos(half);
  return sinc * matrix;
}

Eigen::Matrix2d turned(double heading) {
  Eigen::Matrix2d matrix;
  matrix << std::cos(heading), -std::sin(heading), std::sin(heading), std::cos(heading);
  return matrix;
}

}  // namespace

Rigid3 SpatialBody::moved(const Pose& pose, const Part& delta) { return perturb(pose, delta); }

Vector6 SpatialBody::difference(const Pose& to, const Pose& from, Block* d_to) {
  const Vector6 delta = occ::difference(to, from);
  if (d_to != nullptr) *d_to = d_difference(delta);
  return delta;
}

SpatialBody::Step SpatialBody::step_of(const Piece& piece) {
  return {piece.to_from_from, piece.covariance};
}

SpatialBody::Step SpatialBody::cut(const Step& step, double from, double to) {
  if (from <= 0 && to >= 1) return step;
  const Vector6 velocity = velocity_between({}, step.motion, 1);
  return {moved_pose({}, velocity, to - from), (to - from) * step.covariance};
}

SpatialBody::Step SpatialBody::chained(const Step& first, const Step& then) {
  const Matrix6 carried = adjoint(then.motion);
  return {then.motion * first.motion,
          carried * first.covariance * carried.transpose() + then.covariance};
}

Vector6 SpatialBody::residual(const Pose& from, const Pose& to, const Step& step, Block* d_from,
                              Block* d_to) {
  const Rigid3 motion = to * from.inverse();
  const Vector6 delta = occ::difference(motion, step.motion);
  if (d_to != nullptr) {
    *d_to = d_difference(delta);
    *d_from = -*d_to * adjoint(motion);
  }
  return delta;
}

Vector6 SpatialBody::sigmas(double metres, double radians) {
  Vector6 out;
  out << radians, radians, radians, metres, metres, metres;
  return out;
}

PlanarBody::Lift PlanarBody::lift(const Pose& pose) const {
  return planar_perturbation(pose).leftCols<3>();
}

PlanarPose PlanarBody::moved(const Pose& pose, const Part& delta) {
  return {pose.x_m + delta[0], pose.y_m + delta[1], wrapped_rad(pose.heading_rad + delta[2])};
}

Eigen::Vector3d PlanarBody::difference(const Pose& to, const Pose& from, Block* d_to) {
  if (d_to != nullptr) d_to->setIdentity();
  return occ::difference(to, from);
}

PlanarBody::Step PlanarBody::step_of(const Piece& piece) {
  return {piece.increment, piece.covariance};
}

PlanarBody::Step PlanarBody::cut(const Step& step, double from, double to) {
  if (from <= 0 && to >= 1) return step;
  const double share = to - from, turn = step.motion.heading_rad;
  const Eigen::Vector2d velocity = arc_matrix(turn).inverse() * step.motion.position();
  const Eigen::Vector2d place = share * (arc_matrix(share * turn) * velocity);
  return {{place.x(), place.y(), share * turn}, share * step.covariance};
}

PlanarBody::Step PlanarBody::chained(const Step& first, const Step& then) {
  Eigen::Matrix3d d_first = Eigen::Matrix3d::Identity(), d_then = Eigen::Matrix3d::Identity();
  d_then.topLeftCorner<2, 2>() = turned(first.motion.heading_rad);
  const Eigen::Vector2d arm = d_then.topLeftCorner<2, 2>() * then.motion.position();
  d_first.block<2, 1>(0, 2) << -arm.y(), arm.x();
  return {first.motion * then.motion, d_first * first.covariance * d_first.transpose() +
                                          d_then * then.covariance * d_then.transpose()};
}

Eigen::Vector3d PlanarBody::residual(const Pose& from, const Pose& to, const Step& step,
                                     Block* d_from, Block* d_to) {
  const Eigen::Matrix2d from_world = turned(-from.heading_rad);
  const Eigen::Vector2d place = from_world * (to.position() - from.position());
  if (d_to != nullptr) {
    d_to->setIdentity();
    d_to->topLeftCorner<2, 2>() = from_world;
    *d_from = -*d_to;
    d_from->block<2, 1>(0, 2) << place.y(), -place.x();
  }
  const PlanarPose found{place.x(), place.y(), to.heading_rad - from.heading_rad};
  return occ::difference(found, step.motion);
}

}  // namespace occ::internal::smooth
