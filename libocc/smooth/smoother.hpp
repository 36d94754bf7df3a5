// SPDX-License-Identifier: Apache-2.0
// Batch smoothing: maximum-likelihood poses of a body over a whole recording, from identified lamps
// in the images of cameras on the body, pose observations, and odometry. Minimises
//
//   chi2 = sum rho(|L (px - project(cam_from_body body_from_world point))|^2)          sightings
//        + sum |S (delta - delta*)|^2                                          pose observations
//        + sum rho(|difference(to_from_world from_from_world^-1, measured)|^2_C)         odometry
//
// with Huber's loss rho, by the Levenberg-Marquardt method. Only consecutive poses share a term, so
// the normal equations are block tridiagonal, and block Cholesky factorisation takes time
// proportional to the number of poses. The covariances combine, for each pose, the information of
// all earlier and of all later poses (Fraser, Potter, "The optimum linear smoother as a combination
// of two optimum linear filters", IEEE Trans. Automatic Control 14(4), 1969), also in linear time.
// They follow from the given sigmas and are not scaled by chi2.
//
// Several minima: a frame of three lamps has up to four poses, one of lamps in a plane has two. A
// bank of filters follows all of them along odometry, and each trajectory that stays plausible is
// minimised. The lowest chi2 is the result; a rejected step counts -2 ln(link_gate), plus n ln f
// for its n components and its inflation f. If the likelihood ratios exp(-difference / 2) of the
// other minima sum up to a risk above 1e-4 (18.4 for one), the status is ambiguous. Frames of fewer
// lamps that determine the poses only together have the start values of three of their lamps
// (generalised P3P).
//
// Gross errors of odometry: a step whose deleted residual has a chi2 beyond `link_gate` (Baarda, "A
// testing procedure for use in geodetic networks", 1968) is reported, and its covariance is
// inflated until it is consistent. Before that, the start values without the poses that oppose the
// step are tried. If neither odometry nor `walk` links two consecutive poses, the
// motion between is unconstrained and the parts before and after are independent.
//
// Systematic errors: positions of points (`point_covariance_m2`), parameters of cameras
// (Camera::with_parameter_sigmas), mountings and clock (SmootherOptions), and those of a
// PoseObservation. Sightings of one point_in_world have one error, as have images of equal cameras
// and equal mountings. Each frame takes the most likely values of its errors, as if they were
// independent of those of other frames; the covariances contain that they are the same, so that
// they do not average away (consider parameters; Schmidt, Advances in Control Systems 3, 1966).
//
// Domain: a sighting whose point is outside the camera's domain at the estimated pose is ignored
// and counted.
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

/// Image of an identified point.
struct PointSighting {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  ///< known position [m]
  Eigen::Vector2d px = Eigen::Vector2d::Zero();              ///< measured position in the image
  Eigen::Matrix2d covariance_px2 = 0.09 * Eigen::Matrix2d::Identity();  ///< 0.3 px, each axis
  /// Covariance of point_in_world [m^2], an error of the map; zero: exact.
  Eigen::Matrix3d point_covariance_m2 = Eigen::Matrix3d::Zero();
};

/// Sightings of one camera at one time. Several frames may have the same time, e.g. of several
/// cameras. A frame without sightings requests the pose at its time.
struct LIBOCC_API SmootherFrame {
  double time_s = 0;  ///< time at which the pose holds
  /// Calibrated camera of the image.
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Rigid3 cam_from_body;                  ///< mounting of the camera
  std::vector<PointSighting> sightings;  ///< identified points; may be empty

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Options of smooth() and smooth_planar().
struct LIBOCC_API SmootherOptions {
  /// Corner of Huber's loss for sightings; 0: least squares. At 3 sigmas, 1 % of correct sightings
  /// are beyond, and 0.3 % of the information is lost.
  double huber_sigmas = 3;
  /// Probability that a correct odometry step is rejected as a gross error; 0: no test.
  double link_gate = 1e-5;
  /// Added to the sigmas of each odometry step, so that a step without sideways slip has a regular
  /// covariance.
  double min_odometry_sigma_m = 1e-5, min_odometry_sigma_rad = 1e-6;
  /// Random walk between poses without odometry: standard deviations after one second, growing with
  /// the square root of time. Infinite: no constraint.
  double walk_m = std::numeric_limits<double>::infinity();
  double walk_rad = std::numeric_limits<double>::infinity();  ///< see walk_m
  /// Standard deviations of the errors of each camera's mounting, about and along each axis of the
  /// camera.
  double mount_sigma_rad = 0, mount_sigma_m = 0;
  /// Standard deviation of the images' times against those of odometry, without which it has no
  /// effect.
  double clock_sigma_s = 0;
  int max_iterations = 60;  ///< maximum for each round of gating; about ten are usual

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Pose of a body in space at one time.
struct SmoothedPose {
  double time_s = 0;       ///< time at which the pose holds
  Rigid3 body_from_world;  ///< most likely pose, given the whole recording
  Matrix6 covariance =
      unknown_covariance<6>();  ///< covariance of body_from_world, see geometry/rigid.hpp
  bool determined = false;      ///< false: pose and covariance are undefined
};

/// Pose of a body on a floor at one time.
struct SmoothedPlanarPose {
  double time_s = 0;  ///< time at which the pose holds
  PlanarPose pose;    ///< most likely pose, given the whole recording
  Eigen::Matrix3d covariance = unknown_covariance<3>();  ///< see geometry/planar_pose.hpp
  bool determined = false;  ///< false: pose and covariance are undefined
};

/// Constraint between consecutive poses.
struct OdometryLink {
  double from_s = 0, to_s = 0;  ///< times of both poses
  bool odometry = false;        ///< false: random walk
  double chi2 = 0;              ///< deleted residual: the step against all other information
  int dof = 0;                  ///< number of components that the other information determines
  double factor = 1;            ///< inflation of its covariance
  bool contradicted = false;    ///< true: rejected by `link_gate`
};

/// Fit of all sightings.
struct SightingStatistics {
  int count = 0;      ///< number of sightings
  int beyond = 0;     ///< beyond the corner of Huber's loss, or outside the camera's domain
  int outside = 0;    ///< outside the camera's domain
  double rms_px = 0;  ///< r.m.s. residual of the coordinates inside the domain
};

/// Another minimum that the data do not exclude.
template <class Pose>
struct AlternativeTrajectory {
  std::vector<Pose> poses;      ///< one for each pose of the recording
  double chi2 = 0;              ///< its minimum
  double likelihood_ratio = 0;  ///< to the best minimum, gross errors included
};

/// Smoothed recording with its statistics.
template <class Pose>
struct Smoothing {
  std::vector<Pose> poses;  ///< one for each time at which there is a frame, observation or prior
  std::vector<OdometryLink> links;  ///< one between each two consecutive poses
  double chi2 = 0;                  ///< the minimum
  int dof = 0;                      ///< residuals less unknowns
  SightingStatistics sightings;     ///< statistics of all frames
  /// Residual of each sighting of each frame, in sigmas; infinite outside the domain.
  std::vector<std::vector<double>> residual_sigmas;
  int iterations = 0;  ///< total of all rounds
  double risk = 0;     ///< probability that another minimum that was found is the right one
  /// Other minima, most likely first, if the risk is above 1e-4; at most eight.
  std::vector<AlternativeTrajectory<Pose>> alternatives;
};

/// Times must not decrease within each list. Odometry steps may begin and end between frames: they
/// are concatenated, and cut in proportion to time. They must not overlap.
struct SmootherInput {
  std::vector<SmootherFrame> frames;          ///< images with identified points
  std::vector<PoseObservation> observations;  ///< for a prior: PoseObservation::of_pose
  std::vector<Odometry> odometry;             ///< motion between images; may be empty
  std::vector<Rigid3> start;  ///< body_from_world of each pose: one more start value; may be empty
};

/// Prior of a pose on the floor.
struct LIBOCC_API PlanarPrior {
  double time_s = 0;                                         ///< time at which the pose holds
  PlanarPose pose;                                           ///< known pose
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< [x, y, heading], positive definite

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Input of smooth_planar(); the rules of SmootherInput apply.
struct PlanarSmootherInput {
  std::vector<SmootherFrame> frames;          ///< images with identified points
  std::vector<PoseObservation> observations;  ///< poses of cameras, in space
  std::vector<PlanarPrior> priors;            ///< poses known from elsewhere
  std::vector<PlanarOdometry> odometry;       ///< motion between images; may be empty
  std::vector<PlanarPose> start;              ///< one more start value of each pose; may be empty
  double height_m = 0;  ///< height of the body's origin above the world's; the body is upright
};

/// Status: ok (the message lists contradicted odometry); ambiguous (another minimum is plausible:
/// `alternatives`); too_few_lamps (no pose is determined); degenerate (some poses are not
/// determined: the message lists them, the others are valid); not_converged. Throws
/// std::invalid_argument for times that decrease, odometry that overlaps, covariances that are not
/// positive definite (odometry: semi-definite), a start whose length differs from the number of
/// poses, and values that are not finite.
LIBOCC_API Result<Smoothing<SmoothedPose>> smooth(const SmootherInput& input,
                                                  const SmootherOptions& options = {});

/// Smooths poses on a floor.
LIBOCC_API Result<Smoothing<SmoothedPlanarPose>> smooth_planar(const PlanarSmootherInput& input,
                                                               const SmootherOptions& options = {});

}  // namespace occ
