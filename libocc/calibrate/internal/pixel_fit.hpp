// SPDX-License-Identifier: Apache-2.0
// Least squares fit of a pose (and a scale) to image points in pixels, for any camera model, from
// one image or several.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::calibrate {

/// Ratio of the standard deviation per axis to the median of distances in the plane.
constexpr double sigma_of_median_distance = 0.8493;  // 1 / sqrt(2 ln 2)

/// Observed minus projected image points (2 x n); infinite for points not in view.
Eigen::Matrix2Xd pose_residuals(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& px,
                                const Camera& camera, const Rigid3& cam_from_world);

struct PixelFit {
  Rigid3 pose;
  double cost = std::numeric_limits<double>::infinity();  ///< half the weighted sum of squares
  bool converged = false;
};

/// Pose that fits image points. `gate_px`: residuals above have no weight (Tukey); infinite: least
/// squares.
PixelFit fit_pose(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& px, const Camera& camera,
                  const Rigid3& start, double gate_px, int max_iterations = 30);

/// One image of a body.
struct BodyView {
  const Camera* camera = nullptr;
  Rigid3 cam_from_world;
  Eigen::Matrix2Xd px;  ///< all corners, 2 x n
  double sigma_px = 1;
};

struct BodyFit {
  Rigid3 world_from_body;
  double scale = 1;
  double scale_sigma =
      std::numeric_limits<double>::infinity();  ///< standard deviation of the scale, from the
                                                ///< sigma_px of the views
  double chi2 = std::numeric_limits<double>::infinity();
};

/// Pose, and scale if `scale_free`, of a body from posed images.
BodyFit fit_body(const Eigen::Matrix3Xd& corners, const std::vector<BodyView>& views,
                 const Rigid3& start, bool scale_free, int max_iterations = 30);

}  // namespace occ::internal::calibrate
