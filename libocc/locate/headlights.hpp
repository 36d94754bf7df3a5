// SPDX-License-Identifier: Apache-2.0
// Distance of a car from the images of its two headlights.
//
// The lamps are w apart and their bearings differ by theta. Let psi be the yaw: the angle between
// the line through the lamps and the perpendicular of the bisector of both bearings. The law of
// sines gives the distances of the lamps,
//     d_1 = w cos(theta/2 - psi) / sin(theta),   d_2 = w cos(theta/2 + psi) / sin(theta),
// and the median of the triangle gives the distance of the point midway between them,
//     D^2 = (2 d_1^2 + 2 d_2^2 - w^2) / 4 = w^2/4 (2 (1 + cos(theta) cos(2 psi)) / sin(theta)^2 -
//     1),
// which is w/2 cot(theta/2) at psi = 0 and about w cos(psi) / theta. Without the yaw there is only
// a curve D(psi). Given a prior of psi, 1/D is a mixture over psi of normal distributions with the
// relative variance (sigma_w / w)^2 + (sigma_theta / theta)^2. The midway point is off the bisector
// by atan(tan(theta/2)^2 tan(psi)).
//
// If the heights over the road and the vertical are known, the sine of the lamps' elevation,
// s = f . up, gives
//     s = (h_lamps - h_camera) / D + noise,
// which is linear in 1/D: a Kalman update of each component of the mixture, weighted by the
// likelihood of s. Lamps at the camera's height give no information.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/locate/fix.hpp"

namespace occ {

/// Heights above a flat road and the direction of its normal.
struct RoadHeights {
  double lamps_m = 0.65, lamps_sigma_m = 0.1;    ///< height of the lamps' centres above the road
  double camera_m = 1.2, camera_sigma_m = 0.02;  ///< height of the camera's centre above the road
  Eigen::Vector3d up_in_cam = -Eigen::Vector3d::UnitY();  ///< normal of the road, unit vector
  double up_sigma_rad = 0.005;                            ///< pitch of camera and road
};

/// Options of headlight_distance().
struct LIBOCC_API HeadlightOptions {
  double separation_m = 1.4, separation_sigma_m = 0.1;  ///< between the lamps' centres
  double sigma_px = 0.5;               ///< standard deviation of a lamp's pixel coordinates
  double yaw_max_rad = 0.5;            ///< limit of |yaw|; below pi/2
  double yaw_concentration = 0;        ///< kappa of the von Mises prior; 0: uniform
  std::optional<RoadHeights> heights;  ///< knowledge of the road; empty: it is not used

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Distance of a car, with the posterior of its yaw.
struct HeadlightDistance {
  double distance_m = 0, sigma_m = 0;  ///< mean and standard deviation
  double low_m = 0, high_m = 0;        ///< 95 % interval, 2.5 % on each side
  double bearing_rad = 0;              ///< direction of the bisector, from the camera's z towards x
  Eigen::Vector3d direction_in_cam = Eigen::Vector3d::UnitZ();  ///< the bisector
  double separation_rad = 0, separation_sigma_rad = 0;          ///< theta
  std::vector<double> yaw_rad;                                  ///< nodes
  std::vector<double> distance_of_yaw_m;  ///< D(psi), from the images of the lamps alone
  std::vector<double> yaw_density;        ///< posterior density of the yaw [1/rad]
};

/// lamps_px: columns, two lamps of equal height. Status: ok; degenerate (the lamps are less than
/// five sigmas apart; only the bearing is valid); no_pose (no yaw agrees with the heights within
/// five sigmas). Throws std::invalid_argument for values that are not finite, pixels outside the
/// camera's domain, or options out of range.
LIBOCC_API Result<HeadlightDistance> headlight_distance(const Eigen::Matrix2d& lamps_px,
                                                        const Camera& camera,
                                                        const HeadlightOptions& options = {});

/// One plausible pose of a vehicle.
struct VehiclePose {
  Candidate pose;                         ///< "world" is the vehicle's frame
  double distance_m = 0, sigma_m = 0;     ///< distance of the vehicle's origin
  double yaw_rad = 0, yaw_sigma_rad = 0;  ///< about up, of its x axis from the line to the camera
};

/// Poses of a vehicle from three or more lamps of known position on it: all plausible poses in
/// which it stands upright, best first. lamps_m: columns, in the vehicle's frame (x forward, y
/// left, z up), n >= 3 and not on a line. `max_tilt_rad`: limit of the angle between the vehicle's
/// z and up_in_cam. Status as for solve_pose, and no_pose if no pose is upright.
LIBOCC_API Result<std::vector<VehiclePose>> vehicle_poses(
    const Eigen::Matrix3Xd& lamps_m, const Eigen::Matrix2Xd& lamps_px, const Camera& camera,
    double sigma_px, const Eigen::Vector3d& up_in_cam = -Eigen::Vector3d::UnitY(),
    double max_tilt_rad = 0.3);

}  // namespace occ
