// SPDX-License-Identifier: Apache-2.0
// The list of pose solvers: closed forms and iterations that turn a PoseProblem into candidates for
// cam_from_world without a start. `Solver::solve` is the bare method: it may return nothing, poses
// that do not fit or numbers that are not finite, and may miss one. `pose_candidates`
// (pose/candidates.hpp) runs it behind a guard; use that.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ {

/// Where the points a solver takes may lie.
enum class Layout { any, coplanar, not_coplanar };

struct Solver {
  const char* name;      ///< e.g. "p3p_kneip"
  int min_points;        ///< fewer are refused
  int max_points;        ///< uses exactly so many at most; 0: all
  int max_candidates;    ///< returns so many poses at most
  Layout layout;         ///< of the points
  bool needs_up;         ///< PoseProblem::up_in_cam must be set
  bool takes_origins;    ///< PoseProblem::origins may be set
  const char* failures;  ///< where it is known to fail or to be slow, a sentence
  const char* source;    ///< paper, and package it comes from if not ours

  /// Appends candidates. Expects points about their centroid with an r.m.s. distance of 1 from it,
  /// between min_points and max_points of them, all finite, bearings unit; never throws or prints.
  void (*solve)(const PoseProblem& problem, std::vector<Rigid3>& candidates);
};

/// All solvers, minimal ones first.
LIBOCC_API const std::vector<Solver>& solvers();

/// Throws std::invalid_argument naming those that exist.
LIBOCC_API const Solver& solver_named(const std::string& name);

}  // namespace occ
