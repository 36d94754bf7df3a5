// SPDX-License-Identifier: Apache-2.0
// The most likely poses of a body over time, all at once: from lamps whose names are known and
// where cameras on the body saw them, from what images said of poses, and from odometry between.
//
//   chi2 = sum rho(|L (px - project(cam_from_body body_from_world point))|^2)          sightings
//        + sum |S (delta - delta*)|^2                                          pose observations
//        + sum rho(|difference(to_from_world from_from_world^-1, measured)|^2_C)         odometry
//
// rho is Huber's. Minimised by Levenberg and Marquardt's method; consecutive poses alone share a
// term, so the normal equations are block tridiagonal: block Cholesky takes time proportional to
// the number of poses, and so do the covariances, from what all before and all behind say of each
// pose (Fraser, Potter, "The optimum linear smoother as a combination of two optimum linear
// filters", IEEE Trans. Automatic Control 14(4), 1969). They are those of the sigmas that were
// given.
//
// An odometry step that the rest contradicts (chi2 of its deleted residual beyond `link_gate`;
// Baarda, "A testing procedure for use in geodetic networks", 1968) is reported, and its covariance
// multiplied until it no longer does. Where neither odometry nor `walk` links two consecutive poses
// nothing is assumed of the motion between: each part stands for itself.
//
// Domain: lamps must be in the domain of the camera; a sighting that is not, at the poses found, is
// left out and counted.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"

namespace occ {

/// A point whose name is known, and where it was seen.
struct PointSighting {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = 0.09 * Eigen::Matrix2d::Identity();  ///< 0.3 px, each axis
};

/// What one camera saw at one time; of the same time may be several, from several cameras. Without
/// sightings it asks for the pose at that time.
struct LIBOCC_API SmootherFrame {
  double time_s = 0;
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Rigid3 cam_from_body;  ///< how the camera is mounted
  std::vector<PointSighting> sightings;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct LIBOCC_API SmootherOptions {
  double huber_sigmas = 3;  ///< a sighting further off counts less; 0: least squares. 1 % of right
                            ///< ones are, and 0.3 % of the information is lost
  double link_gate = 1e-5;  ///< probability that a right odometry step is called a lie; 0: never
  /// Added to each odometry step's sigmas: wheels that report no slip sideways weld nothing.
  double min_odometry_sigma_m = 1e-5, min_odometry_sigma_rad = 1e-6;
  /// How far the body may have gone, and turned, in a second without odometry; grows as the square
  /// root of time. Infinite: anywhere.
  double walk_m = std::numeric_limits<double>::infinity();
  double walk_rad = std::numeric_limits<double>::infinity();
  int max_iterations = 60;  ///< in each of the few rounds of gating; some ten are usual

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct SmoothedPose {
  double time_s = 0;
  Rigid3 body_from_world;
  Matrix6 covariance = unknown_covariance<6>();  ///< of body_from_world, see geometry/rigid.hpp
  bool determined = false;                       ///< false: pose and covariance have no meaning
};

struct SmoothedPlanarPose {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Matrix3d covariance = unknown_covariance<3>();  ///< see geometry/planar_pose.hpp
  bool determined = false;
};

/// Between one pose and the next.
struct OdometryLink {
  double from_s = 0, to_s = 0;
  bool odometry = false;  ///< or the walk
  double chi2 = 0;        ///< of the step against all the rest; 0 when the rest cannot tell
  int dof = 0;            ///< of it: components that the rest can tell
  double factor = 1;      ///< its covariance was multiplied by this
  bool contradicted = false;
};

struct SightingStatistics {
  int count = 0;
  int beyond = 0;     ///< weighed down by Huber's rho, or outside the camera's domain
  int outside = 0;    ///< of those, the latter
  double rms_px = 0;  ///< of a coordinate, of all but the latter
};

template <class Pose>
struct Smoothing {
  std::vector<Pose> poses;  ///< one for each time at which there is a frame, observation or prior
  std::vector<OdometryLink> links;
  double chi2 = 0;  ///< the minimum
  int dof = 0;
  SightingStatistics sightings;
  /// Of each sighting of each frame: its residual in its sigmas; infinite outside the domain.
  std::vector<std::vector<double>> residual_sigmas;
  int iterations = 0;
};

/// Times must not decrease within each list. Odometry need not end where frames are: pieces are
/// chained, and cut in proportion to time; they may not overlap.
struct SmootherInput {
  std::vector<SmootherFrame> frames;
  std::vector<PoseObservation> observations;  ///< a prior: PoseObservation::of_pose of the body
  std::vector<Odometry> odometry;
  std::vector<Rigid3> start;  ///< body_from_world of each pose; empty: from solve_pose, odometry
};

/// What is known of a pose on the floor.
struct LIBOCC_API PlanarPrior {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct PlanarSmootherInput {
  std::vector<SmootherFrame> frames;
  std::vector<PoseObservation> observations;
  std::vector<PlanarPrior> priors;
  std::vector<PlanarOdometry> odometry;
  std::vector<PlanarPose> start;
  double height_m = 0;  ///< of the body's origin; it stands upright
};

/// Status: ok (odometry may have been contradicted: the message says where); too_few_lamps (nothing
/// tells any pose); degenerate (some poses are not determined: the message says which, the rest
/// hold); not_converged. Throws std::invalid_argument for times that decrease, odometry that
/// overlaps, covariances that are not positive definite (odometry: semi-definite), a start of
/// another length than the poses, values that are not finite.
LIBOCC_API Result<Smoothing<SmoothedPose>> smooth(const SmootherInput& input,
                                                  const SmootherOptions& options = {});

/// The same on a floor.
LIBOCC_API Result<Smoothing<SmoothedPlanarPose>> smooth_planar(const PlanarSmootherInput& input,
                                                               const SmootherOptions& options = {});

}  // namespace occ
