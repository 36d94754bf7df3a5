// SPDX-License-Identifier: Apache-2.0
// Pose from 3D-2D point correspondences (PnP): a minimal or linear solver for the start, then the
// maximum-likelihood pose, which minimises the reprojection error
//     chi2 = sum |projected - measured|^2 / sigma^2,
// and its covariance. All other poses that fit nearly as well are returned too; a plane seen from
// far away has two.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/locate/fix.hpp"

namespace occ {

/// Options of solve_pose().
struct LIBOCC_API SolvePoseOptions {
  std::string solver = "auto";  ///< a name in solvers(); "auto": p3p_triples
  /// Start value instead of a solver, e.g. the pose of the last frame. Other poses that fit are
  /// then not searched.
  std::optional<Rigid3> start;
  double sigma_px = 1;     ///< standard deviation of each pixel coordinate
  double max_misfit = 10;  ///< limit of chi2 / dof; 10 is an r.m.s. residual of 3 sigmas
  /// A few iterations are usual; a flat, curved valley around the minimum takes hundreds.
  int max_iterations = 1000;
  std::vector<double> sigmas_px;  ///< one for each point, instead of sigma_px
  /// A second pose is plausible, and the result ambiguous, down to this likelihood ratio to the
  /// best one.
  double max_risk = 1e-4;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// points_in_world: columns [m], n >= 3; points_px: columns, same count. The minimum is found to
/// 0.005 of its sigmas. The fix has no lamps or blobs; its candidates, best first, hold chi2 and
/// dof. If chi2 exceeds its 99.9 % quantile, the covariance is multiplied by chi2 / dof. It
/// includes the second-order effect of a rotation about distant points (arc_moment), and of a
/// projection that is not linear within the errors (few points in a plane or near a line).
///
/// The risk is the probability that another of the poses that fit is right. It takes the
/// correspondences as right (robust_pose() does not), and is empty with `start`.
///
/// Status: ok; ambiguous (a likelihood ratio above max_risk of the next candidate, after scaling by
/// the variance factor of the best one if it is above 1); too_few_lamps (fewer than three points);
/// degenerate (points that coincide or, given sigma_px and the residuals, lie on a line, or do not
/// determine the pose, or leave a rotation uncertain by 0.25 rad); no_pose (no pose fits);
/// not_converged (any candidate).
/// The fix holds the best candidate, if there is one, for every status. Throws
/// std::invalid_argument for counts that differ, values that are not finite, pixels outside the
/// camera's domain, an unknown solver, and a solver that needs the vertical direction.
LIBOCC_API Result<Fix> solve_pose(const Eigen::Matrix3Xd& points_in_world,
                                  const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                  const SolvePoseOptions& options = {});

}  // namespace occ
