// SPDX-License-Identifier: Apache-2.0
// Errors of a pose by light that is distributed otherwise than the scene says.
//
// - The gradient of light that the scene predicts (cos^4 of the lens, the lamp's emission) may be
//   absent: most phones correct it in software. It shifts over-exposed rims, and the centroids of
//   large lamps whose rims could not be measured. One sigma is the whole shift.
// - Without a rim, the distribution of the light over a large lamp is unknown. Light in its middle
//   is seen at its projected centre, light at its rim at up to twice the distance between that and
//   the centre of the image of a uniform lamp. One sigma is half of that distance.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Blobs with these errors in the covariances of centroids without a rim; empty if there are none.
/// The errors are common to all lamps. The fit treats them as independent, so their variance is
/// multiplied by the number of these lamps.
LIBOCC_API std::optional<std::vector<Blob>> with_errors_of_light(const Rigid3& cam_from_world,
                                                                 const std::vector<Match>& matches,
                                                                 const std::vector<Blob>& blobs,
                                                                 const Scene& scene);

/// True if the lamp's rim was measured and has grown because it is over-exposed.
inline bool has_over_exposed_rim(const Blob& blob) { return blob.saturated && !blob.rim.empty(); }

/// Blobs whose over-exposed rims are where they were without the predicted gradient; empty if there
/// are none.
LIBOCC_API std::optional<std::vector<Blob>> without_light_gradient(
    const Rigid3& cam_from_world, const std::vector<Match>& matches, const std::vector<Blob>& blobs,
    const Scene& scene);

/// Adds an error of the pose, one sigma, to the covariance and to the lamps' information.
LIBOCC_API void add_pose_error(const Vector6& error, Refined& refined);

}  // namespace occ::internal::refine
