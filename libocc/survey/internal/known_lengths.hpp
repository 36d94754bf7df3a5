// SPDX-License-Identifier: Apache-2.0
// Observations that give a network its scale: distances of lamps, and AprilTags of known size.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/network/network.hpp"
#include "libocc/survey/internal/lamp_map.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// Additions to the network of a growing map.
struct KnownLengths {
  std::vector<DistanceObservation> distances;      ///< targets are points of the network
  std::vector<NetworkBody> bodies;                 ///< tags
  std::vector<ImageObservation> tag_observations;  ///< corners of `bodies`; images: placed pictures
};

/// Tags of known size in the placed pictures, intersected with the pictures' poses.
class PlacedTags {
 public:
  /// Tags that two placed pictures show; a note for each of the others.
  PlacedTags(const std::vector<SurveyPicture>& pictures, const LampMap& map, const Camera& camera,
             std::vector<std::string>& notes);

  bool empty() const { return tags_.empty(); }
  /// Size over that in the map, the median over the tags; nothing if no tag could be intersected.
  std::optional<double> scale(double size_m) const;
  /// Relative standard deviation of the scale by errors of edges that all pictures share.
  double scale_sigma() const;
  /// Adds the tags as bodies of this size, in a map that has its scale, or of unknown sizes.
  void add_to(KnownLengths& lengths, std::optional<double> size_m) const;

 private:
  struct Tag4 {
    int id = 0;
    Eigen::Matrix<double, 3, 4> corners;  // in the map
    std::vector<ImageObservation> observations;
  };
  std::vector<Tag4> tags_;
};

/// Name of the body of a tag.
std::string tag_name(int id);

/// Radii of discs in the unit of the map.
struct Radii {
  double median = 0, smallest = 0, largest = 0;
  /// Relative standard deviation of the median: errors of the rims are common to the lamps of one
  /// kind, and do not average out.
  double sigma = 0;
};

/// Radii of the discs among some lamps; nothing without discs.
std::optional<Radii> radii_of(const std::vector<std::optional<Lamp>>& shapes,
                              const std::vector<int>& lamps);

/// Scale of the map and its relative standard deviation, by least squares over the distances
/// between consecutive pictures with odometry; nothing without two of them. path_sigma: relative
/// error of the length of a path.
std::optional<std::pair<double, double>> scale_by_odometry(
    const std::vector<SurveyPicture>& pictures, const LampMap& map, double path_sigma);

}  // namespace occ::internal::survey
