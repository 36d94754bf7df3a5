// SPDX-License-Identifier: Apache-2.0
// 3D-2D point correspondences in the form that pose solvers and fits use.
#pragma once

#include <Eigen/Core>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::locate {

/// Points in their unit frame, and their bearings.
struct PointProblem {
  Eigen::Matrix3Xd points, bearings;
  Eigen::Matrix3Xd origins;  ///< start points of the bearings; empty for a central camera
  pose::UnitFrame frame;
  pose::SeenPoints seen;
};

/// `sigmas_px`: one for all points, or one for each. Throws std::invalid_argument for a pixel
/// outside the camera's domain.
LIBOCC_API PointProblem make_point_problem(const Eigen::Matrix3Xd& points_in_world,
                                           const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                           const Eigen::VectorXd& sigmas_px);

/// True if the points coincide or lie on a line; `spread` is a triple of large area.
bool on_a_line(const PointProblem& problem, const pose::Triple& spread);

}  // namespace occ::internal::locate
