// SPDX-License-Identifier: Apache-2.0
// From points whose names are known, and where they were seen in the image, to a fix: a pose solver
// for the start, least squares over the pixels for the most likely pose,
//     chi2 = sum |projected - seen|^2 / sigma^2,
// and its covariance. Every other pose that fits nearly as well (a plane seen from far away has
// two) is returned beside it.
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

struct LIBOCC_API SolvePoseOptions {
  std::string solver = "auto";  ///< a name in solvers(); "auto": p3p_triples
  std::optional<Rigid3> start;  ///< a pose close by, e.g. the last frame's, instead of a solver;
                                ///< other poses that fit are then not looked for
  double sigma_px = 1;          ///< of a pixel coordinate, along each axis
  double largest_misfit = 10;   ///< chi2 / dof beyond which nothing is said to fit: 3 sigmas r.m.s.
  int max_iterations =
      1000;  ///< a handful, but hundreds where the minimum is a flat, curved valley
  std::vector<double> sigmas_px;  ///< of each point, instead of sigma_px

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// points_in_world: columns [m], n >= 3; points_px: columns, same count. The minimum is met to
/// 0.005 of its sigmas. The fix has no lamps or blobs; chi2 and dof are in its candidates, best
/// first. The covariance is multiplied by chi2 / dof when that is larger than chance allows (0.1
/// %), and the arc of a turn about the points (arc_moment) is added. Status: ok; ambiguous (a
/// likelihood ratio of less than 100 to the next candidate); too_few_lamps (fewer than three
/// points); degenerate (points that coincide, or lie on a line as far as sigma_px and the residuals
/// let that be seen, or a pose that they do not determine); no_pose (nothing fits); not_converged
/// (any candidate). Once there is a best one it is in the fix, whatever the status. Throws
/// std::invalid_argument for counts that differ, values that are not finite, pixels outside the
/// camera's domain, an unknown solver, or one that needs to know the vertical.
LIBOCC_API Result<Fix> solve_pose(const Eigen::Matrix3Xd& points_in_world,
                                  const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                  const SolvePoseOptions& options = {});

}  // namespace occ
