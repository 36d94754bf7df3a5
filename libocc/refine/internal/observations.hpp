// SPDX-License-Identifier: Apache-2.0
// What the pose has to explain, prepared once: rim points as rays, centroids and fluxes with their
// information.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/refine/internal/pixel_window.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

inline bool takes_rims(Rung rung) { return rung == Rung::rims || rung == Rung::direct; }

struct RimObservation {
  RimRay ray;
  Eigen::Vector2d normal;
  double inverse_sigma;
};

struct LampObservation {
  const Lamp* lamp;
  const Blob* blob;
  std::size_t rim_begin = 0, rim_end = 0;  ///< in Observations::rim; empty without a usable rim
  Eigen::Matrix3d common_covariance_px2 = Eigen::Matrix3d::Zero();  ///< of its rim: growth, x, y
  bool has_place = false;    ///< its centroid is that of the whole lamp
  bool contradicts = false;  ///< left out: the other lamps agree without it
  Eigen::Matrix2d place_information = Eigen::Matrix2d::Zero();  ///< model error included
  BlobWindow window = {};  ///< for the direct rung; empty when the lamp does not offer it
  /// Of ln of its light about the flux model's; infinite when it says nothing of this lamp.
  double light_sigma = std::numeric_limits<double>::infinity();
  double misfit = 1;  ///< of its pixels, see LampPixels
  bool has_flux = false;
  double log_electrons = 0;  ///< measured
  double flux_inverse_sigma = 0;

  bool has_rim() const { return rim_begin < rim_end; }
  bool has_pixels() const { return !window.empty(); }
};

struct Observations {
  std::vector<LampObservation> lamps;
  std::vector<RimObservation> rim;
  bool rims_grow = false;  ///< the rim of a saturated lamp is among them
  bool has_flux = false;
  double psf_sigma_px = 0;  ///< of the image; the scene's until the pixels say otherwise

  bool has_pixels() const;  ///< of some lamp that does not contradict the others

  bool growth_was_used() const;  ///< a saturated lamp is taken by its rim

  /// Independent equations for the pose: at most 5 from a disc's rim, 6 from a rectangle's, 2 from
  /// a centroid, 1 from a flux (one less in all when their factor is unknown), and the prior's.
  /// Below the rims' rung, lamps count by their centroids.
  int equations(const RefineOptions& options, Rung rung) const;

  /// Observed numbers minus unknowns; without the pixels of Rung::direct (Normal::pixels).
  int degrees_of_freedom(const RefineOptions& options, Rung rung) const;
};

/// Throws std::invalid_argument for a match outside its list, a lamp axis that is not unit, or a
/// sigma that is not positive, an image that is not of the camera's size.
/// Pixels are observed for Rung::direct when there is an image.
LIBOCC_API Observations observe(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                                const Scene& scene, const RefineOptions& options,
                                const ImageView* image = nullptr);

}  // namespace occ::internal::refine
