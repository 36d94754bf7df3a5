// SPDX-License-Identifier: Apache-2.0
// Verdicts about the lamps of a map after the constellations of new pictures were linked to it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/survey/internal/lamp_block.hpp"
#include "libocc/survey/internal/place_statistics.hpp"
#include "libocc/survey/update.hpp"

namespace occ::internal::survey {

/// A constellation in the frame of the map.
struct LinkedBlock {
  LampBlock block;
  std::vector<int> lamp_of;  ///< lamp of the map for each lamp of the block; -1: none
};

/// Joint covariance of the places of the map's lamps, with the errors that they share. Lamps
/// without stated errors have map_sigma_m; `assumed` is set to their number.
Eigen::MatrixXd map_covariance(const Scene& map, double map_sigma_m, int& assumed);

/// Radius of a disc, or of the disc with the area of another face; 0 for a point.
double lamp_size(const Lamp& lamp);

/// Pictures that show, or should show, a place.
struct PlaceEvidence {
  std::vector<int> seen, missed;
  double spread_rad = 0;  ///< largest angle between the directions of two pictures of `missed`
};

/// Evidence for a lamp of the map in a block whose poses are in the frame of the map. `own` is the
/// lamp of the block that it is; -1: none. A picture counts if the lamp is whole in it with its lit
/// side, not farther than lamps were seen, and not hidden by a box, another lamp or a blob that the
/// border cuts.
PlaceEvidence place_evidence(const Lamp& lamp, double sigma_m, int own, const LampBlock& block,
                             const std::vector<SurveyPicture>& pictures, const Scene& map);

/// Evaluates linked blocks; writes the lamps, their covariance and the warnings of `result`.
class LampChanges {
 public:
  LampChanges(const Scene& map, const std::vector<LinkedBlock>& blocks,
              const std::vector<SurveyPicture>& pictures, const UpdateOptions& options);

  /// False if the covariances of map and pictures do not permit a test.
  bool ok() const { return is_tested_; }
  void write(MapUpdate& result);
  /// Name of a lamp of a block, after write(): "lamp 7" with the id after the update.
  std::string name_of(int block, int lamp) const;

 private:
  struct Place {
    int block, lamp;
  };
  static constexpr int no_lamp = -2;  // a duplicate, or a lamp that is lit in few pictures

  const BlockLamp& measured(int place) const;
  void pair_by_code();
  void pair_by_place();
  void pair_overlapping();
  void skip_duplicates();
  void compare_places();
  void compare_looks(LampUpdate& update, const Lamp& old, int place) const;
  RelativeLight light_of(const Lamp& old, int place) const;
  void find_common_factors();
  void add_evidence(LampUpdate& update, int lamp) const;
  bool is_gone(const PlaceEvidence& evidence) const;
  std::optional<int> far_move(int lamp, const std::vector<int>& gone, std::string& reason) const;
  bool is_unchanged(int lamp) const;  // in all constellations that show it
  LampUpdate measured_verdict(int lamp, int place);
  LampUpdate unmeasured_verdict(int lamp) const;
  LampUpdate moved_lamp(int lamp, int place, const std::string& reason) const;
  LampUpdate new_lamp(int place, int id) const;
  Lamp lamp_at(const Lamp& old, int place, const std::vector<LampChange>& changes,
               bool is_moved) const;
  std::string names(const std::vector<int>& pictures) const;

  const Scene& map_;
  const std::vector<LinkedBlock>& blocks_;
  const std::vector<SurveyPicture>& pictures_;
  const UpdateOptions& options_;
  double max_statistic_, max_normal_;
  int assumed_sigmas_ = 0;      // lamps of the map without stated errors
  Eigen::MatrixXd covariance_;  // of the map
  std::vector<Place> places_;   // all lamps of the blocks
  std::vector<PlacePair> pairs_, linked_;
  std::vector<bool> is_coded_;  // of places
  std::vector<int> place_of_;   // of the lamps of the map; -1: not measured
  std::vector<int> lamp_of_;    // of the places; -1: not in the map; or no_lamp
  std::vector<int> new_ids_;    // of the places; -1: not a new lamp
  std::vector<PlaceEvidence> evidence_;
  std::optional<PlaceStatistics> statistics_;
  double size_factor_ = 1, power_factor_ = 0;
  Eigen::Vector3d colour_factor_ = Eigen::Vector3d::Ones();
  bool has_colours_ = false, has_size_factor_ = false, is_tested_ = false;
};

}  // namespace occ::internal::survey
