// SPDX-License-Identifier: Apache-2.0
// Result of localisation: the camera's pose with covariance, and all other plausible poses.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/identify/pose_circle.hpp"
#include "libocc/refine/rung_choice.hpp"
#include "libocc/refine/separation.hpp"

namespace occ {

/// One plausible pose.
struct Candidate {
  Rigid3 cam_from_world;  ///< refined pose
  /// Covariance of cam_from_world, see geometry/rigid.hpp.
  Matrix6 covariance = unknown_covariance<6>();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< camera position in the world
  double rms_px = 0;                                     ///< as Refined::rms_px
  double chi2 = 0;             ///< weighted sum of squared residuals at this pose
  int dof = 0;                 ///< residuals minus unknowns
  double variance_factor = 1;  ///< contained in the covariance
  /// See Refined.
  std::optional<double> estimated_map_sigma_m, estimated_size_sigma, estimated_growth_px;
  std::optional<Camera> estimated_camera;  ///< see Refined
  /// Probability that this pose is right, among all candidates and, in locate(), "none of them".
  std::optional<double> probability;
  std::map<int, Blob> lamps;  ///< lamp id -> blob
};

/// Wall-clock times of the steps of locate() [s]; 0 for steps that did not run.
struct Timing {
  /// `total_s` includes steps without a time of their own.
  double detect_s = 0, identify_s = 0, refine_s = 0, total_s = 0;
};

/// Without candidates, pose and position are undefined and their covariances infinite.
struct Fix {
  Rigid3 cam_from_world;  ///< pose of the best candidate
  Matrix6 covariance =
      unknown_covariance<6>();  ///< covariance of cam_from_world, see geometry/rigid.hpp
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< camera position in the world
  /// Covariance of position_m, world axes.
  Eigen::Matrix3d position_covariance_m2 = unknown_covariance<3>();
  double rms_px = 0;  ///< r.m.s. residual of the best candidate
  /// Probability that the pose is wrong, because another one is right or, in locate() and
  /// robust_pose(), because it is accidental; 1 without candidates. Empty if no other pose was
  /// searched.
  std::optional<double> risk;
  /// locate(): the search for poses stopped early, at the budget or at identify.max_hypotheses.
  bool cut_short = false;
  /// locate(): colour of the lamps that was found in the image, where the scene states none and the
  /// blobs of all colours gave no pose. Shares of red, green and blue over the largest.
  std::optional<Eigen::Vector3d> found_colour;
  /// locate(): "camera" and "map" if the scene states no error of them. Where such a part is not
  /// exact, the pose can be off by many of its sigmas.
  std::vector<std::string> taken_as_exact;
  std::map<int, Blob> lamps;          ///< lamp id -> blob, of the best candidate
  std::vector<Blob> blobs;            ///< all detected blobs
  std::vector<Candidate> candidates;  ///< all plausible poses, best first; the first is the fix
  std::optional<RungChoice> choice;   ///< locate(): rung of the refinement, with the reason
  Timing timing_s;                    ///< time of each step
  /// locate(): ids of lamps that contradict the others. `lamps` contains them, the pose does not
  /// depend on them.
  std::vector<int> excluded_lamps;
  /// locate(): without candidates, in an image of one or two blobs: circles of poses that one disc
  /// allows. A prior that knows the turn selects a pose, which is then a candidate.
  std::vector<PoseCircle> circles;
  SeparationModel separation;  ///< locate(): for protection_level_m()

  /// Bound of the position's error that is exceeded, without detection, with at most this
  /// probability, although lamps may be faulty; see protection_level() in refine/separation.hpp.
  LIBOCC_API Result<ProtectionLevel> protection_level_m(double risk = 1e-7,
                                                        double continuity_risk = 1e-3) const;
};

}  // namespace occ
