// SPDX-License-Identifier: Apache-2.0
// All poses from which matched lamps have their centroids where they are.
//
// Three centres are seen alike from up to four poses (P3P). Two of them approach each other near
// the danger cylinder, the cylinder through the circle of the lamps along its axis, e.g. under a
// ceiling. Four lamps and more usually leave one pose, lamps in a plane up to two that fit nearly
// as well. The poses are starts: refine() decides whether they are minima of all observations.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Poses besides `refined` that fit the centroids of its lamps nearly as well as the best pose, in
/// order of their fit: starts from P3P of several triples and from the reflected plane, each fitted
/// to all centroids. The offset of a centroid from the image of the lamp's centre is taken at
/// `refined`. Lamps that are cut, merged or left out are not used; fewer than three give no pose.
LIBOCC_API std::vector<Rigid3> other_roots(const Refined& refined, const std::vector<Blob>& blobs,
                                           const Scene& scene);

}  // namespace occ::internal::refine
