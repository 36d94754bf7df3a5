// SPDX-License-Identifier: Apache-2.0
// The most likely pose for a given naming of the blobs, with its covariance. Least squares by Ceres
// (TinySolver, one residual block, analytic Jacobians) over, for each lamp,
//   - its rim points: distance between the measured rim and the rim predicted by the pose;
//   - or, without a rim, its centroid against the centre of the lamp's *image* (not the image of
//   its centre);
//   - or all its pixels against its rendered image (projected rim, PSF, Lambertian and cos^4
//   gradients, response, clipping), weighted by the sensor's noise; its brightness, the background
//   and the PSF's width are estimated along. A lamp whose pixels miss their model by more than
//   chance counts for as much less; one that misses it altogether, or is cut, merged, striped or a
//   saturated disc, is taken by its rim;
//   - optionally its flux against Lambertian intensity, powers known with a sigma or up to a common
//   factor.
// Rims of saturated lamps have grown by an unknown common amount (prior sigma 2 px), which is
// estimated along; each besides by its own (as its light is known to half an e-fold only) and
// unevenly (0.05 px).
// Residuals are whitened. A lamp that contradicts all the others (Baarda's data snooping, chance of
// one in a thousand) is left out, which takes five lamps or a prior; stray rim points and fluxes
// are weighted down (Huber). The covariance is (J^T J)^-1 of the whitened problem: it is right when
// the stated sigmas are. Where the residuals are larger than these allow (a chance of one in a
// thousand), it is multiplied by the variance factor chi2 / dof (Gauss's a posteriori variance).
// What the arc of a turn about the lamps adds to the translation (arc_moment) is contained.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// What of the image the pose has to explain; each rung is more accurate and dearer than the one
/// before.
enum class Rung {
  points,   ///< centroids against the projections of the lamps' centres: biased for large lamps
  centres,  ///< centroids against the centres of the lamps' images
  rims,     ///< measured rims against the projected ones
  direct,   ///< every pixel around a lamp against the lamp's rendered image
};

enum class FluxModel {
  ignore,         ///< geometry only
  known_power,    ///< each lamp's power_w holds within its power_sigma
  common_factor,  ///< powers hold up to one unknown factor (exposure, aperture, ageing)
};

struct LIBOCC_API RefineOptions {
  Rung rung = Rung::rims;  ///< a lamp that does not offer it is taken by the next cheaper one
  FluxModel flux = FluxModel::ignore;
  std::optional<Prior> prior;  ///< added as observations
  double model_sigma_px =
      0;  ///< error of camera and map per lamp (e.g. of an uncalibrated lens), common
          ///< to all points of a lamp; added to the measurement's own covariance
  double huber_sigma = 3;  ///< rim points and fluxes further off than this weigh linearly; infinity
                           ///< for plain least squares with every lamp
  int max_iterations = 20;
  double tolerance_px = 1e-5;  ///< converged when a step moves no lamp further than this; that
                               ///< step is taken, so the error left is far smaller; direct,
                               ///< which converges faster, stops at a hundred times this

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct LampResidual {
  Match match;
  Rung rung = Rung::rims;    ///< by which the lamp entered
  bool contradicts = false;  ///< left out: the other lamps agree without it
  double misfit = 1;  ///< direct: residuals of its pixels over what the sensor's noise explains
  double rms_px = 0;  ///< over the lamp's rim points, or the length of its centroid residual
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< predicted centre of the lamp's image
};

struct Refined {
  Rigid3 cam_from_world;
  Matrix6 covariance =
      unknown_covariance<6>();  ///< see geometry/rigid.hpp for order and perturbation
  /// What the lamps alone say, without the prior, about cam_from_world: their chi2 there moves by
  /// 2 g . d + d . L d under a left perturbation d. L has no inverse when they are one or two.
  Matrix6 lamp_information = Matrix6::Zero();
  Vector6 lamp_gradient = Vector6::Zero();
  double chi2 = 0;  ///< whitened, robust; prior and lamps that were left out included
  int dof = 0;      ///< observations minus parameters
  double variance_factor =
      1;              ///< the covariance contains it; 1 unless chi2 is too large to be chance
  double rms_px = 0;  ///< of centre residuals over lamps
  std::vector<LampResidual> lamps;
  std::optional<double> rim_growth_px;  ///< of saturated lamps
  std::optional<double> psf_sigma_px;   ///< direct: as the lamps' pixels show it
  std::optional<double> flux_factor;    ///< of FluxModel::common_factor: seen over predicted
  int iterations = 0;
};

/// Status: ok; too_few_lamps (fewer equations than the pose's 6 unknowns, prior included; the value
/// is the start); degenerate (the information matrix is singular to 1e-12 of its scale; no
/// covariance); not_converged (also when a lamp cannot be seen from the start). Throws
/// std::invalid_argument for a match outside its list, a start that is not finite, a lamp whose
/// axes are not unit, or a covariance that is not positive definite.
LIBOCC_API Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  const RefineOptions& options = {});

/// The same with the image that the blobs were found in, which Rung::direct needs: without one, all
/// lamps are taken by their rims. Throws std::invalid_argument when the image is not of the
/// camera's size.
LIBOCC_API Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  const RefineOptions& options, const ImageView& image);

}  // namespace occ
