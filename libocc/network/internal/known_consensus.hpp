// SPDX-License-Identifier: Apache-2.0
// Distances and control points against the shape that the images alone give.
//
// A distance is often more accurate than the rays of its ends, so that a wrong one bends the
// network under any loss of one observation; the rays are then rejected in its place. Gross errors
// are therefore found in lengths (distances, and those between control points): the scale is the
// one that most of them agree with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/network/datum.hpp"
#include "libocc/network/internal/outlier_tests.hpp"

namespace occ::internal::network {

/// True if wrong distances or control points could be found: there are several lengths, or one in a
/// network that has a scale.
bool has_redundant_lengths(const Network& network);

/// Network with no distance and no control point used.
Network without_known(Network network);

struct KnownConsensus {
  /// False: the lengths disagree, but none is precise to 2 %, in itself and by the images.
  bool reliable = true;
  /// Those that differ from the others by more than 2 % and 5 sigmas, with residuals in their own
  /// sigmas.
  std::vector<OutlierCandidate> distances, control;
  /// Moves the network to the distances and control points; the identity if its datum is fixed.
  Similarity to_known;
  /// A sentence about distances or control points of which no majority agrees; empty without any.
  std::string contradiction;
};

/// `adjusted`: without_known() after an adjustment; `known`: the network with its distances and
/// control points, of which those with used == true count.
KnownConsensus known_consensus(const Network& adjusted, const Network& known, int threads);

}  // namespace occ::internal::network
