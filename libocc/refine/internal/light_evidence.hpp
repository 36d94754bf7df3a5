// SPDX-License-Identifier: Apache-2.0
// Evidence of the light of a pose's lamps: their sizes, their fluxes, and brighter blobs that are
// no lamps of the pose.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Flux of a blob, compared with the light of its lamp at a pose.
struct FluxRatio {
  double log_ratio = 0;   ///< ln of measured over predicted flux
  double log_light = 0;   ///< ln of the predicted flux, up to a constant of all lamps
  double sigma = 0;       ///< standard deviation of log_ratio
  bool at_least = false;  ///< the measured flux is a lower bound: saturated, cut or blinking
};

/// A seen lamp of a pose.
struct SeenLight {
  double log_size = 0;  ///< ln of the density ratio of its size to that of a false light
  std::optional<FluxRatio> flux;
  double open = 0.02;  ///< probability that size and flux are open: partly hidden, dirty
};

/// ln of a blob's flux before vignetting; empty if the flux was not measured.
LIBOCC_API std::optional<double> log_flux(const Blob& blob, const Scene& scene);

LIBOCC_API std::optional<FluxRatio> flux_ratio(const Lamp& lamp, const Blob& blob,
                                               const Rigid3& cam_from_world, const Scene& scene);

/// ln of the probability ratio of sizes and fluxes, lamps against false lights. Equal fluxes are no
/// evidence, because false lights of one kind have equal fluxes as well; different ones are
/// evidence against the pose. The factor between measured and predicted fluxes is the most
/// favourable one. A lamp may be hidden in part, dirty or of another kind: then size and flux are
/// open.
///
/// `other_log_fluxes`: of the blobs that are no lamps of the pose, in ascending order. The share of
/// those that are brighter than every lamp has a Beta prior that prefers few.
LIBOCC_API double log_light_ratio(const std::vector<SeenLight>& lamps,
                                  const std::vector<double>& other_log_fluxes);

}  // namespace occ::internal::refine
