// SPDX-License-Identifier: Apache-2.0
// Measuring with calibrated images: points from where they were seen in two or more of them, with
// covariance, and distances between them. Cameras and poses are those of an adjusted network; their
// own uncertainty counts when its precision is given (what two points have in common as well).
//
//     min over X of sum |(project(X) - seen) / sigma|^2,    Q = (sum B^T B)^-1 + F Q_c F^T,
//     F = dX / d(cameras, stations)
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/network.hpp"
#include "libocc/network/precision.hpp"

namespace occ {

struct Sighting {
  int image = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector2d sigma_px{0.5, 0.5};
};

struct MeasuredPoint {
  Status status = Status::ok;  ///< too_few_lamps: fewer than two images; degenerate: rays parallel
                               ///< or meeting where an image cannot show them; not_converged
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< infinite when not ok
  double sigma0 = 1;  ///< of its 2n - 3 redundant observations
  double worst_residual_px = 0;
  double angle_rad = 0;  ///< the largest between two of its rays
  std::vector<Sighting> sightings;
};

struct Measurement {
  std::vector<MeasuredPoint> points;
  Eigen::MatrixXd covariance_m2;  ///< of all points together, 3n x 3n; infinite where not ok
};

/// One point for each list of sightings. `precision`: of the same network, or null when cameras and
/// stations are taken as known. Throws std::invalid_argument for an image that is none, a sigma
/// that is not positive, a pixel that is not finite.
LIBOCC_API Measurement measure_points(const Network& network,
                                      const std::vector<std::vector<Sighting>>& points,
                                      const Precision* precision = nullptr);

struct MeasuredDistance {
  double length_m = 0, sigma_m = 0;  ///< sigma infinite when a point is not ok
};

LIBOCC_API MeasuredDistance distance_between(const Measurement& measurement, int from, int to);

/// Text with a line for each point: name, x, y, z, the sigmas, images, worst residual. Points that
/// are not ok are left out.
LIBOCC_API std::string points_as_csv(const Measurement& measurement,
                                     const std::vector<std::string>& names = {});
/// The same as a PLY file (ASCII) with properties x y z sigma_x sigma_y sigma_z.
LIBOCC_API std::string points_as_ply(const Measurement& measurement);

}  // namespace occ
