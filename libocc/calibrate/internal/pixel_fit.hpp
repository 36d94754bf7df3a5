// SPDX-License-Identifier: Apache-2.0
// Internal: a pose (and a scale) by Gauss and Newton's steps, damped, on the distances in pixels
// between projected and seen points, any camera, one image or several.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::calibrate {

/// From a median of distances in the plane to a standard deviation per axis.
constexpr double sigma_of_median_distance = 0.8493;  // 1 / sqrt(2 ln 2)

/// Seen minus projected of each point; infinite where the camera does not see it.
Eigen::Matrix2Xd pose_residuals(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& px,
                                const Camera& camera, const Rigid3& cam_from_world);

struct PixelFit {
  Rigid3 pose;
  double cost = std::numeric_limits<double>::infinity();  ///< half the weighted sum of squares
  bool converged = false;
};

/// Improves cam_from_world; `gate_px`: distances beyond do not count (Tukey's weights), infinite:
/// plain least squares.
PixelFit fit_pose(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& px, const Camera& camera,
                  const Rigid3& start, double gate_px, int max_iterations = 30);

/// One image of a body.
struct BodyView {
  const Camera* camera = nullptr;
  Rigid3 cam_from_world;
  Eigen::Matrix2Xd px;  ///< of all its corners
  double sigma_px = 1;
};

struct BodyFit {
  Rigid3 world_from_body;
  double scale = 1;
  double scale_sigma = std::numeric_limits<double>::infinity();  ///< for residuals of sigma_px
  double chi2 = std::numeric_limits<double>::infinity();
};

/// Pose, and scale when `scale_free`, of a body from images of known pose.
BodyFit fit_body(const Eigen::Matrix3Xd& corners, const std::vector<BodyView>& views,
                 const Rigid3& start, bool scale_free, int max_iterations = 30);

}  // namespace occ::internal::calibrate
