// SPDX-License-Identifier: Apache-2.0
// Every pose from which known points are seen along given bearings, by any solver, guarded:
// points are moved to their centroid and scaled to unit size first; candidates that are not finite,
// not rotations or have a point behind its bearing are dropped; the rest are polished where
// rounding leaves room for it (Newton's method for three points, least squares of
// angles for more), kept when they reproduce the bearings
// within the tolerance, merged where they coincide, and ranked.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/pose/problem.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

struct PoseCandidate {
  Rigid3 cam_from_world;
  double misfit_rad = 0;  ///< largest angle between a bearing and the direction to its point
};

struct LIBOCC_API CandidateOptions {
  double tolerance_rad = 1e-6;  ///< of the misfit; noisy bearings need about 5 of their sigmas
  bool polish = true;           ///< false: as the solver returns them

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Candidates, smallest misfit first. `solver`: a name in solvers(), or "auto": p3p for three
/// points of one camera, p3p_triples for more, gp3p or upnp for a rig, upright_p2p for two points.
/// Status: ok (at least one); too_few_lamps (fewer points than the solver takes); degenerate
/// (points that coincide, lie on a line, or not in the layout that the solver takes); no_pose (none
/// within the tolerance; the best that was found is in the value, its misfit says by how much).
/// Throws std::invalid_argument for an unknown solver, counts that differ, values that are not
/// finite, bearings or up_in_cam that are not unit to 1e-6, and for a solver that needs up_in_cam
/// or takes no origins.
LIBOCC_API Result<std::vector<PoseCandidate>> pose_candidates(const PoseProblem& problem,
                                                              const std::string& solver = "auto",
                                                              const CandidateOptions& options = {});

/// How errors of the bearings [rad] grow into the pose's: the largest singular value of
/// d(rotation [rad], position / distance) / d bearings at a pose that fits; infinite at a double
/// root, to rounding more than 1e6, and for fewer than three points. Noise of sigma rad gives
/// errors of about condition * sigma. Throws as pose_candidates does.
LIBOCC_API double pose_condition(const PoseProblem& problem, const Rigid3& cam_from_world);

}  // namespace occ
