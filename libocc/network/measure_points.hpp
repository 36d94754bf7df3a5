// SPDX-License-Identifier: Apache-2.0
// Intersection: points observed in two or more calibrated images, with covariance, and distances
// between them. Cameras and poses come from an adjusted network. If its precision is given, each
// ray is weighted by the uncertainty of its camera and station as well, and this is propagated,
// including the correlation between points: with residuals r = (projected - observed) / sigma and
// their derivatives B by the point and A by cameras and stations, whose covariance is Q,
//
//     min over X of r^T W r,   W = (I + A Q A^T)^-1,   covariance (B^T W B)^-1
//
// (Koch, "Parameter estimation and hypothesis testing in linear models", 1999, section 3.2.3).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/network.hpp"
#include "libocc/network/precision.hpp"

namespace occ {

/// Image point of a point to be measured.
struct PointObservation {
  int image = 0;                                    ///< index into Network::images
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< position in the image [px]
  Eigen::Vector2d sigma_px{0.5, 0.5};               ///< standard deviations in x and y, positive
};

/// A point measured by intersection.
struct MeasuredPoint {
  Status status = Status::ok;  ///< too_few_lamps: fewer than two images; degenerate: parallel rays,
                               ///< or an intersection that is not in view; not_converged
  /// In the network's datum; undefined when not ok.
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< infinite when not ok
  double sigma0 = 1;                           ///< a posteriori, from 2n - 3 redundant observations
  double worst_residual_px = 0;                ///< largest absolute residual
  double angle_rad = 0;                        ///< largest angle between two of its rays
  std::vector<PointObservation> observations;  ///< as given
};

/// Points measured together, with their correlations.
struct Measurement {
  std::vector<MeasuredPoint> points;  ///< one for each list of observations
  Eigen::MatrixXd
      covariance_m2;  ///< joint covariance of all points, 3n x 3n; infinite where not ok
};

/// Measures one point for each list of observations. `precision`: of the same network, or null to
/// treat cameras and stations as error-free. Throws std::invalid_argument for an image index out of
/// range, a sigma that is not positive, a pixel that is not finite, or the precision of another
/// network.
LIBOCC_API Measurement measure_points(const Network& network,
                                      const std::vector<std::vector<PointObservation>>& points,
                                      const Precision* precision = nullptr);

/// Distance of two measured points.
struct MeasuredDistance {
  double length_m = 0;  ///< undefined when a point is not ok
  double sigma_m = 0;   ///< infinite when a point is not ok or the length is zero
};

/// Distance of two points (indices). Throws std::invalid_argument for an index out of range.
LIBOCC_API MeasuredDistance distance_between(const Measurement& measurement, int from, int to);

}  // namespace occ
