// SPDX-License-Identifier: Apache-2.0
// Every pose from which known points are observed along given bearings, by any solver, with checks.
//
// Points are moved to their centroid and scaled to unit size before solving. Candidates that are
// not finite, not rotations or have a point behind its bearing are dropped. The others are polished
// (Newton's method for three points, least squares of angles for more), accepted if they reproduce
// the bearings within the tolerance, merged if they coincide, and ranked by their misfit.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// A pose that reproduces the bearings.
struct PoseCandidate {
  Rigid3 cam_from_world;  ///< polished, unless the options exclude it
  double misfit_rad = 0;  ///< largest angle between a bearing and the direction to its point
};

/// Options of pose_candidates().
struct LIBOCC_API CandidateOptions {
  double tolerance_rad = 1e-6;  ///< limit of the misfit; noisy bearings need about 5 sigmas
  bool polish = true;           ///< false: poses as the solver returns them

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Returns the candidates, smallest misfit first. `solver`: a name in solvers(), or "auto": p3p for
/// three points of one camera, p3p_triples for more, gp3p or upnp for a rig, upright_p2p for two
/// points. Status: ok (at least one candidate); too_few_lamps (fewer points than the solver needs);
/// degenerate (points coincide, lie on a line, or have a layout that the solver does not accept);
/// no_pose (none within the tolerance; the value holds the best pose found, with its misfit).
/// Throws std::invalid_argument for an unknown solver, counts that differ, values that are not
/// finite, bearings or up_in_cam that are not unit to 1e-6, a missing up_in_cam that the solver
/// needs, and origins that it does not accept.
LIBOCC_API Result<std::vector<PoseCandidate>> pose_candidates(const PoseProblem& problem,
                                                              const std::string& solver = "auto",
                                                              const CandidateOptions& options = {});

/// Condition number of a pose that fits: the largest singular value of
/// d(rotation [rad], position / distance) / d bearings [rad]. Bearing noise of sigma rad causes
/// pose errors of about condition * sigma. Infinite for fewer than three points and at a double
/// root, where rounding leaves a value above 1e6. Throws as pose_candidates does.
LIBOCC_API double pose_condition(const PoseProblem& problem, const Rigid3& cam_from_world);

}  // namespace occ
