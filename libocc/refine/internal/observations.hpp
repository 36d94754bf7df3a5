// SPDX-License-Identifier: Apache-2.0
// Observations of the refinement, prepared once: rim points as rays, centroids and fluxes with
// their information matrices.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/refine/internal/pixel_window.hpp"
#include "libocc/refine/internal/scene_errors.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

inline bool uses_rims(Rung rung) { return rung == Rung::rims || rung == Rung::direct; }

struct RimObservation {
  RimRay ray;
  Eigen::Vector2d px, normal;
  double inverse_sigma;
};

struct LampObservation {
  const Lamp* lamp;
  const Blob* blob;
  std::size_t rim_begin = 0, rim_end = 0;  ///< in Observations::rim; equal without a usable rim
  double moved_px = 0;                     ///< the rays of its rim are of points that far inwards
  /// Covariance of the errors common to its rim: growth, x, y.
  RimErrorCovariance common_covariance_px2 = RimErrorCovariance::Zero();
  bool has_centroid = false;  ///< its centroid is that of the whole lamp
  bool contradicts = false;   ///< left out as a gross error
  Eigen::Matrix2d centroid_information = Eigen::Matrix2d::Zero();  ///< includes the model error
  std::optional<LampErrors> errors = std::nullopt;  ///< errors in the scene; empty if it is exact
  /// Their estimate in units of their standard deviations: the rim is linearised there.
  LampError unit_error = LampError::Zero();
  LampError error() const { return errors ? errors->scaled(unit_error) : LampError::Zero().eval(); }
  BlobWindow window = {};  ///< for the direct rung; empty if the lamp has no usable pixels
  /// Standard deviation of ln of its light in the flux model; infinite if the model excludes the
  /// lamp.
  double light_sigma = std::numeric_limits<double>::infinity();
  double misfit = 1;  ///< see LampPixels::misfit
  bool has_flux = false;
  double log_electrons = 0;  ///< measured
  double flux_inverse_sigma = 0;

  /// Reduction of chi-square if the lamp alone is moved from its position in the scene, beyond its
  /// stated errors, and the number of coordinates that its observations determine.
  double own_chi2 = 0;
  int own_coordinates = 0;

  bool has_rim() const { return rim_begin < rim_end; }
  bool has_pixels() const { return !window.empty(); }
};

struct Observations {
  std::vector<LampObservation> lamps;
  std::vector<RimObservation> rim;
  bool all_grow = false;   ///< RefineOptions::outlines_grow
  bool rims_grow = false;  ///< true if `rim` contains a lamp that grows
  bool has_flux = false;
  double psf_sigma_px = 0;  ///< the scene's, then the estimate from the pixels
  SharedErrors shared_errors;
  /// Shared errors that the scene in use contains: it is linearised there. Empty without them.
  Eigen::VectorXd shared_shift;

  bool has_pixels() const;  ///< true if a lamp without contradiction has pixels

  bool grows(const LampObservation& lamp) const { return all_grow || lamp.blob->saturated; }
  /// Moves the points of the rims that grow inwards by the approximate growth, at most by half the
  /// semi-minor axis. rim_distance_px is exact to first order only: perspective bends the image of
  /// a tilted plane, so that a growth of 4 px would seem to shift a rim by 0.015 px. False if no
  /// rim has to be moved.
  LIBOCC_API bool move_rims(double growth_px, const Camera& camera);
  bool growth_was_used() const;  ///< a lamp that grows is taken by its rim

  /// Number of independent equations for the pose: at most 5 from a disc's rim, 6 from a
  /// rectangle's, 2 from a centroid, 1 from a flux (in total one less if their factor is unknown),
  /// and those of the prior. Rungs below rims use centroids only.
  int equations(const RefineOptions& options, Rung rung) const;

  /// Observations minus unknowns, without the pixels of Rung::direct (PoseNormalEquations::pixels).
  int degrees_of_freedom(const RefineOptions& options, Rung rung) const;
};

/// True if the errors of model_sigma_px are those of with_model_errors(). Below the rung rims,
/// observe() adds them to the covariance of each centroid, above it to each lamp's pixels.
bool has_model_errors(const RefineOptions& options);

/// The scene whose lamps have, beside their own, errors of their positions that shift their images
/// by model_sigma_px; sets that to zero. A shift of a rim alone would leave its size exact, which
/// then outweighs all directions.
Scene with_model_errors(const Scene& stated, const std::vector<Match>& matches,
                        const Rigid3& cam_from_world, RefineOptions& options);

/// Prepares the observations; reads pixels only for Rung::direct with an image. Throws
/// std::invalid_argument for a match outside its list, a lamp axis that is not a unit vector, a
/// sigma that is not positive, and an image that does not have the camera's size.
LIBOCC_API Observations observe(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                                const Scene& scene, const RefineOptions& options,
                                const ImageView* image = nullptr);

/// Distances of the lamp's rim points from its rim [px], including the growth, of those whose rays
/// hit its plane.
std::vector<double> rim_distances_px(const LampInCam& in_cam, const LampObservation& lamp,
                                     const Observations& observations);

}  // namespace occ::internal::refine
