// SPDX-License-Identifier: Apache-2.0
// Internal: lamps with straight sides of which something in front hides a part. The outline of the
// visible part has sides of the lamp and others, which lie inside the lamp's outline.
//
// Each measured side is compared with that side of the lamp that has its direction. The pose is
// fitted to the sides by iteratively reweighted least squares with the weights of Geman and McClure
// (1987), 1 / (1 + (d / s)^2)^2 for the distance d, while the scale s decreases, so that sides that
// do not agree with the majority lose their weight.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/locate/fix.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::locate {

/// A fix, and the hypotheses of its identification.
struct Attempt {
  Result<Fix> fix;
  std::vector<Hypothesis> hypotheses;
};

/// Fix of blobs in which hidden sides are marked, if `first` is none or explains fewer lamps: a
/// hypothesis with more lamps does not fit while their hidden sides are taken for theirs, which
/// leaves a wrong one without a rival. If no hypothesis of `first` leads to a fix and there are not
/// more outlines than lamps, those are tried that result without the smallest outline.
/// `locate` returns the attempt for given blobs; empty if there is no time left. Empty if no
/// hypothesis explains the blobs by hidden sides, and if two of `first` lead to different places.
std::optional<Result<Fix>> locate_by_visible_sides(
    const Attempt& first, const std::vector<Blob>& blobs, const Scene& scene,
    const std::optional<Prior>& prior,
    const std::function<std::optional<Attempt>(const std::vector<Blob>&)>& locate);

/// Returns the blobs with `hidden_in_part` set, the points of hidden sides removed and the
/// covariance of the centroid widened where the lamps of a hypothesis are hidden in part. Empty if
/// all matched sides are visible, if the sides do not determine the pose, or if one of them lies
/// outside its lamp.
LIBOCC_API std::optional<std::vector<Blob>> mark_hidden_sides(const Hypothesis& hypothesis,
                                                              const std::vector<Blob>& blobs,
                                                              const Scene& scene,
                                                              const std::optional<Prior>& prior);

}  // namespace occ::internal::locate
