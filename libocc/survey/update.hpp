// SPDX-License-Identifier: Apache-2.0
// Update of a map of lamps by new pictures of the room: lamps that moved, died or are new.
//
// 1. survey() makes constellations of the new pictures, without the map. Lamps that these lack,
//    such as of another size, are intersected from blobs that three pictures or more show. Pictures
//    that do not match each other join by the lamps of the map, if all of these have sizes.
// 2. A similarity maps each constellation onto the map, if it has more lamps in common with it than
//    chance gives, and if no other similarity explains the pictures as well
//    (internal/map_link.hpp). Up to 40 % of the lamps may have changed. The frame and the scale of
//    the map are kept.
// 3. The place of each lamp is tested against the map and the other lamps (chi-square with 3
//    degrees of freedom; internal/place_statistics.hpp). The map's errors are those that it states.
// 4. A lamp without a measured place is gone if pictures should show it and do not.
//
// A lamp keeps its id at another place only if its code shows it, or if it moved by less than
// `max_move_m`, and no other lamp is a candidate. It is otherwise reported as gone, and as new.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/lamp.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/survey/survey.hpp"

namespace occ {

/// Options of update_map().
struct LIBOCC_API UpdateOptions {
  /// Options of the constellations. The scale is that of the map: distances, radius_m and
  /// tag_size_m must not be set, and neither must calibrate_camera.
  SurveyOptions survey;
  /// Standard deviation, per axis, of the places of lamps whose errors the scene does not state.
  /// Lamps that were measured with a laser distance meter are accurate to some millimetres.
  double map_sigma_m = 0.005;
  /// Probability that a lamp that did not change is reported as moved or changed, for each test.
  double false_alarm = 1e-3;
  /// Maximum displacement of a lamp that keeps its id without a code.
  double max_move_m = 0.3;
  /// Minimum number of pictures that should show a lamp and do not, for a lamp that is gone.
  int min_gone_pictures = 3;
  /// Base-10 logarithm of the number of accidental similarities, as good, that is accepted.
  double max_log10_false_alarms = -4;
  /// Knowledge of the pose of the first picture's camera, in the frame of the map. It decides
  /// between several ways to link the pictures.
  std::optional<Prior> prior;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Result for one lamp.
enum class LampFate {
  unchanged,  ///< at its place
  changed,    ///< at its place, with another shape, size, normal, power or colour
  moved,      ///< at another place
  gone,       ///< removed or dark: pictures should show it and do not
  not_seen,   ///< too few pictures show its place; kept as it was
  added,      ///< not in the map
};

/// The enumerator's name, e.g. "not_seen".
LIBOCC_API const char* to_string(LampFate fate);

/// A quantity of a lamp that differs from the map.
struct LampChange {
  std::string quantity;       ///< "shape", "size", "normal", "power" or "colour"
  std::string before, after;  ///< values as text, with unit
  double statistic = 0;       ///< difference over its standard deviation; shape: 0
};

/// Verdict about one lamp, with its evidence.
struct LampUpdate {
  LampFate fate = LampFate::not_seen;  ///< verdict
  Lamp lamp;                           ///< after the update; gone: as in the map
  std::string reason;                  ///< a sentence: the evidence for the verdict
  /// Covariance of lamp.centre_m with all errors; gone, not_seen: of the map.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  Eigen::Vector3d old_centre_m = Eigen::Vector3d::Zero();  ///< in the map; added: undefined
  bool has_test = false;  ///< true: the place was measured, and the next four values are set
  Eigen::Vector3d displacement_m = Eigen::Vector3d::Zero();  ///< measured place minus map
  /// Covariance of displacement_m: errors of the map, of the pictures and of their link.
  Eigen::Matrix3d displacement_covariance_m2 = Eigen::Matrix3d::Zero();
  double displacement_sigma_m = 0;  ///< standard deviation of the displacement's length
  double statistic = 0;             ///< chi-square of the displacement, 3 degrees of freedom
  std::vector<int> seen, missed;    ///< pictures that show it, and that should and do not
  std::vector<LampChange> changes;  ///< differences from the map, beside the place
};

/// A way to link the pictures to the map.
struct MapWay {
  std::string picture;               ///< first picture of the constellation
  Rigid3 cam_from_world;             ///< its pose
  int matches = 0;                   ///< lamps at places of the map
  int lamps = 0;                     ///< lamps of the constellation
  int missing = 0;                   ///< lamps of the map that pictures should show and do not
  double log10_false_alarms = 0;     ///< log10 of the expected number of accidental ones as good
  std::optional<double> prior_chi2;  ///< prior of the first picture, if it has this pose
  std::vector<int> lamp_ids;         ///< lamps of the map that match
};

/// Result of update_map().
struct MapUpdate {
  /// Lamps of the map in its order, then new ones. New ids follow the largest id of the map.
  std::vector<LampUpdate> lamps;
  /// Joint covariance [m^2] of the places of all lamps that are not gone, in their order.
  Eigen::MatrixXd covariance_m2;
  /// Pose of each picture in the frame of the map; nothing: not used.
  std::vector<std::optional<Rigid3>> cam_from_world;
  std::vector<MapWay> ways;               ///< plausible ways of the first linked constellation, or
                                          ///< of the first ambiguous one; best first
  std::vector<SurveyOmission> omissions;  ///< pictures and blobs that are not used, with the reason
  std::vector<std::string> warnings;      ///< contradictions and assumptions to check
  double max_statistic = 0;               ///< limit of LampUpdate::statistic
  double changed_share = 0;  ///< moved and gone lamps over those of the map that pictures show
};

/// Compares a map with new pictures. The scene's camera took the pictures; `survey.ordered` is for
/// frames of one motion. Status: ok; too_few_lamps: the map has fewer than four lamps, or fewer
/// than two pictures show four lamps with rims; ambiguous: the pictures match each other or the map
/// in several ways (MapUpdate::ways); no_pose: the pictures do not match each other or the map, or
/// the match contradicts the prior; otherwise as survey(). Throws std::invalid_argument for options
/// and scenes that are not valid.
LIBOCC_API Result<MapUpdate> update_map(const std::vector<SurveyPicture>& pictures,
                                        const Scene& map, const UpdateOptions& options = {},
                                        const SurveyCallback& progress = {});

}  // namespace occ
