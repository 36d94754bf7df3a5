// SPDX-License-Identifier: Apache-2.0
// Pose solvers: the problem that they take, and the list of them. A solver is a closed form or an
// iteration that finds cam_from_world without an initial value.
//
// Each solver has its own header and source in pose/solvers/. `Solver::solve` is the bare method:
// it may miss a pose, and may return poses that do not fit or are not finite. `pose_candidates`
// (pose/candidates.hpp) runs it, checks the results and polishes them; use that.
//
// A new solver needs its header and source there and an entry in solvers() (solver.cpp); the
// solvers' tests and the Python function `solvers` then include it, and the documentation lists it.
// The ladder has lists of its own: ladder_steps.cpp (libocc, OpenGV) and ladder_opencv.cpp.
// Algorithms in pose/solvers/ for another problem, such as planar.hpp, are not in solvers().
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Known points and the directions in which they are observed. Column i of each matrix belongs to
/// point i. For a camera rig, "camera" means the rig's frame.
struct PoseProblem {
  Eigen::Matrix3Xd bearings;  ///< unit vectors, camera frame
  Eigen::Matrix3Xd points;    ///< world frame [m]
  Eigen::Matrix3Xd origins;   ///< start of each bearing, camera frame [m], for several cameras on a
                              ///< rig; empty when all bearings start at the camera's centre
  std::optional<Eigen::Vector3d> up_in_cam;  ///< world's Z axis in the camera frame, unit, if known

  /// Number of points.
  int size() const { return static_cast<int>(points.cols()); }
};

/// Layouts of points that a solver accepts.
enum class Layout {
  any,           ///< no condition
  coplanar,      ///< in a plane only
  not_coplanar,  ///< in space only
};

/// A pose solver with its requirements.
struct Solver {
  const char* name;      ///< e.g. "p3p_kneip"
  int min_points;        ///< fewer are rejected
  int max_points;        ///< uses at most this many points; 0: all
  int max_candidates;    ///< returns at most this many poses
  Layout layout;         ///< accepted layouts of the points
  bool needs_up;         ///< PoseProblem::up_in_cam must be set
  bool takes_origins;    ///< PoseProblem::origins may be set
  const char* failures;  ///< known failures and slow cases
  const char* source;    ///< paper, and the package if the implementation is not libocc's

  /// Appends candidates for cam_from_world. Requires min_points to max_points finite points with
  /// their centroid at the origin and an r.m.s. distance of 1 from it, and unit bearings. Never
  /// throws or prints.
  void (*solve)(const PoseProblem& problem, std::vector<Rigid3>& candidates);
};

/// A method that this build of the library does not contain.
struct MissingMethod {
  const char* name;    ///< e.g. "epnp"
  const char* option;  ///< CMake option that includes it: "LIBOCC_OPENCV" or "LIBOCC_OPENGV"
};

/// All solvers of this build, minimal ones first.
LIBOCC_API const std::vector<Solver>& solvers();

/// Solvers that were left out of this build; empty with the default options.
LIBOCC_API const std::vector<MissingMethod>& missing_solvers();

/// Throws std::invalid_argument for an unknown name (listing the existing ones) and for a missing
/// solver (naming the CMake option).
LIBOCC_API const Solver& solver_named(const std::string& name);

}  // namespace occ
