// SPDX-License-Identifier: Apache-2.0
// Common interface of the two kinds of poses: in space (body_from_world, left perturbation) and on
// a floor (PlanarPose, [x, y, heading]).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ::internal::smooth {

struct SpatialBody {
  static constexpr int size = 6;
  using Pose = Rigid3;
  using Piece = Odometry;
  using Part = Vector6;
  using Block = Matrix6;
  using Lift = Matrix6;
  using Smoothed = SmoothedPose;
  struct Step {
    Rigid3 motion;
    Matrix6 covariance = Matrix6::Zero();
  };

  Rigid3 body_from_world(const Pose& pose) const { return pose; }
  Pose pose_of(const Rigid3& body_from_world) const { return body_from_world; }
  /// d (left perturbation of body_from_world) / d delta.
  Lift lift(const Pose&) const { return Lift::Identity(); }
  static Pose moved(const Pose& pose, const Part& delta);
  static Part difference(const Pose& to, const Pose& from, Block* d_to = nullptr);

  static Step step_of(const Piece& piece);
  static Piece piece_of(const Step& step, double from_s, double to_s) {
    return {from_s, to_s, step.motion, step.covariance};
  }
  /// Part of a step between two fractions of its time, at constant velocity.
  static Step cut(const Step& step, double from, double to);
  static Step chained(const Step& first, const Step& then);
  static Pose after(const Pose& pose, const Step& step) { return step.motion * pose; }
  static Pose before(const Pose& pose, const Step& step) { return step.motion.inverse() * pose; }
  /// Difference between the step from one pose to the next and the measured step.
  static Part residual(const Pose& from, const Pose& to, const Step& step, Block* d_from,
                       Block* d_to);
  static Part sigmas(double metres, double radians);
  static void put(const Pose& pose, Smoothed& out) { out.body_from_world = pose; }
  static bool finite(const Pose& pose) {
    return pose.rotation.allFinite() && pose.translation.allFinite();
  }
};

struct PlanarBody {
  static constexpr int size = 3;
  using Pose = PlanarPose;
  using Piece = PlanarOdometry;
  using Part = Eigen::Vector3d;
  using Block = Eigen::Matrix3d;
  using Lift = Eigen::Matrix<double, 6, 3>;
  using Smoothed = SmoothedPlanarPose;
  struct Step {
    PlanarPose motion;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  double height_m = 0;

  Rigid3 body_from_world(const Pose& pose) const { return occ::body_from_world(pose, height_m); }
  Pose pose_of(const Rigid3& body_from_world) const { return planar_pose(body_from_world); }
  Lift lift(const Pose& pose) const;
  static Pose moved(const Pose& pose, const Part& delta);
  static Part difference(const Pose& to, const Pose& from, Block* d_to = nullptr);

  static Step step_of(const Piece& piece);
  static Piece piece_of(const Step& step, double from_s, double to_s) {
    return {from_s, to_s, step.motion, step.covariance};
  }
  static Step cut(const Step& step, double from, double to);
  static Step chained(const Step& first, const Step& then);
  static Pose after(const Pose& pose, const Step& step) { return pose * step.motion; }
  static Pose before(const Pose& pose, const Step& step) { return pose * step.motion.inverse(); }
  static Part residual(const Pose& from, const Pose& to, const Step& step, Block* d_from,
                       Block* d_to);
  static Part sigmas(double metres, double radians) { return {metres, metres, radians}; }
  static void put(const Pose& pose, Smoothed& out) { out.pose = pose; }
  static bool finite(const Pose& pose) { return pose.finite(); }
};

}  // namespace occ::internal::smooth
