// SPDX-License-Identifier: Apache-2.0
// Blobs of different pictures that show one lamp by evidence other than their places: the tracks of
// a recording, and the ids that lamps transmit. Equal tracks or ids are one lamp. Different ids are
// different lamps; different tracks may be one, because a track ends where its lamp is not seen.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// Links between the blobs of pictures.
class LampLinks {
 public:
  /// Left out, with a note for each: tracks with two ids, and ids that two blobs of one picture
  /// have. If two blobs of a picture have one link by their tracks, neither has one there. Blobs
  /// that the border cuts or that show several lamps have none, because their centroids are others.
  LampLinks(const std::vector<SurveyPicture>& pictures, std::vector<std::string>& notes);

  /// Number of the link of a blob; -1: none.
  int link(int picture, int blob) const { return links_[picture][blob]; }
  /// Id that the lamp of a link transmits; link: -1 for none.
  std::optional<int> code(int link) const;
  /// Number of links.
  int count() const { return static_cast<int>(code_of_link_.size()); }

 private:
  std::vector<std::vector<int>> links_;
  std::vector<std::optional<int>> code_of_link_;
};

}  // namespace occ::internal::survey
