// SPDX-License-Identifier: Apache-2.0
// Internal: colours that the lamps of a scene state, and their comparison with a blob's.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::scene {

/// True if the channels of any lamp differ. Then all lamps state their colour, white ones included.
bool states_colours(const std::vector<Lamp>& lamps);

/// Distinct colours of the lamps in the order of the lamps; empty if they state none.
LIBOCC_API std::vector<Eigen::Vector3d> stated_colours(const std::vector<Lamp>& lamps);

/// True if a ratio of two channels differs by more than 4 sigma of blob and lamp, in ln. The ratio
/// of a clipped channel is a lower bound. False for a blob without a colour. The lamp must state
/// its colour.
LIBOCC_API bool contradicts_colour(const Lamp& lamp, const Blob& blob);

/// ln of the density ratio of a blob's colour: for the lamp normal about its stated colour; for a
/// false light mostly that of white light or any colour, and of one in ten, such as reflections,
/// that of the lamp. 0 for a blob without a colour or with clipped channels.
LIBOCC_API double log_colour_ratio(const Lamp& lamp, const Blob& blob);

/// Message if the lamps state colours and no blob has one, as in a grey image; empty otherwise.
LIBOCC_API std::string colours_not_compared(const std::vector<Lamp>& lamps,
                                            const std::vector<Blob>& blobs);

/// Compares blobs with the colours that lamps state.
class ColourTest {
 public:
  LIBOCC_API explicit ColourTest(const std::vector<Lamp>& lamps);

  /// True if the lamps state colours; otherwise nothing is contradicted.
  bool is_active() const { return !kinds_.empty(); }
  /// Index of the lamp.
  LIBOCC_API bool contradicts(int lamp, const Blob& blob) const;
  /// See log_colour_ratio(); 0 if the test is not active.
  LIBOCC_API double log_ratio(int lamp, const Blob& blob) const;
  /// True if the blob has a colour that no lamp permits.
  LIBOCC_API bool contradicts_all(const Blob& blob) const;

 private:
  std::vector<Lamp> kinds_;   ///< one lamp of each pair of colour and sigma
  std::vector<int> kind_of_;  ///< index in kinds_ for each lamp
};

}  // namespace occ::internal::scene
