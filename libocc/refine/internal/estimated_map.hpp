// SPDX-License-Identifier: Apache-2.0
// Errors of map, lens and outlines that the scene does not state, estimated from the lamps'
// contradictions.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// refine() with the errors that the scene states, and no others. `image`: null without one.
LIBOCC_API Result<Refined> refine_as_stated(const Rigid3& start, const std::vector<Match>& matches,
                                            const std::vector<Blob>& blobs, const Scene& scene,
                                            const RefineOptions& options, const ImageView* image);

/// The result of refine_as_stated(), or the fit with estimated errors of the map
/// (Refined::estimated_map_sigma_m) if lamps with rims contradict each other by more than five of
/// their stated sigmas on average. If they do so by two to five sigmas, the pose is that of
/// refine_as_stated(), and its covariance is increased by that of the fit. Before that, errors that
/// are common to all lamps are tried, also if lamps were left out: a growth of the outlines, an
/// unknown focal length, an unknown k1. One that explains the contradictions much better than by
/// chance determines the pose; others increase the covariance.
LIBOCC_API Result<Refined> with_estimated_map(const Result<Refined>& exact,
                                              const std::vector<Match>& matches,
                                              const std::vector<Blob>& blobs, const Scene& scene,
                                              const RefineOptions& options);

/// Fit with estimated errors of all sizes (Refined::estimated_size_sigma), started at the pose of
/// the directions. Empty unless these agree with each other, and the errors are at most 20 %.
LIBOCC_API std::optional<Refined> with_estimated_sizes(const Refined& exact,
                                                       const std::vector<Match>& matches,
                                                       const std::vector<Blob>& blobs,
                                                       const Scene& scene,
                                                       const RefineOptions& options);

/// Mean distance of the lamps of a fit from the camera [m].
LIBOCC_API double mean_distance_m(const Refined& refined, const Scene& scene);

/// Scene in which the position of each lamp has at least this standard deviation.
LIBOCC_API Scene with_map_errors(Scene scene, double sigma_m);

}  // namespace occ::internal::refine
