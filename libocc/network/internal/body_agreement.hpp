// SPDX-License-Identifier: Apache-2.0
// Which of a body's sightings agree about where it is, cameras and stations as they are: consensus
// over pairs of images, in each of which the corners that both show are intersected and the body
// fitted to them.
#pragma once

#include <vector>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

/// Indices of the used observations of each unknown body.
std::vector<std::vector<int>> sightings_of_bodies(const Network& network,
                                                  const NetworkLayout& layout);

struct BodyAgreement {
  Rigid3 world_from_body;
  double scale = 1;
  std::vector<int> disagree;  ///< observations beyond the limit there
  bool sound = false;         ///< more than half of the corners seen agree
};

/// `state` is left as it is given, but used as scratch. Not moved when most agree where the body
/// is.
BodyAgreement agreement_about_body(const Network& network, const NetworkLayout& layout,
                                   NetworkState& state, int body,
                                   const std::vector<int>& observations, double limit);

}  // namespace occ::internal::network
