// SPDX-License-Identifier: Apache-2.0
// Maximum-likelihood pose for a given assignment of blobs to lamps, with its covariance. Minimises
//
//     chi2 = sum over residuals (r / sigma)^2      by Ceres' TinySolver with analytic Jacobians.
//
// The residuals of a lamp are, depending on the rung,
//   - rims: distances between the measured rim points and the rim predicted by the pose;
//   - points, centres, or a lamp without a rim: its centroid minus the predicted centre of its
//     *image*, which is not the image of its centre;
//   - direct: all its pixels minus its rendered image (projected rim, PSF, gradients by emission
//     and cos^4, response, clipping), weighted by the sensor's noise. The lamp's brightness, the
//     background and the width of the PSF are estimated as well, and the orders of emission if the
//     pixels contradict half_power_rad significantly; Lamp::photometry is exact. Pixels whose
//     residuals exceed the noise significantly have a lower weight. A lamp whose pixels do not fit
//     (misfit above 4), or that is cut, merged, striped or a saturated disc, contributes its rim;
//   - optionally its flux minus the flux of its emission, with powers known to a sigma or up to a
//     common factor.
//
// The rims of saturated lamps have grown. The growth has a common part (prior sigma 2 px), which is
// estimated, a part of each lamp (its light is known to half an e-fold only), and an uneven part
// (0.05 px).
//
// A disc that dims towards its rim seems to be smaller, by about the growth of the blur of its
// edge: an error of its size. Without a rim, the second moments of its light tell its size.
//
// Gross errors: a lamp that contradicts all others is left out (Baarda's data snooping at a
// probability of 0.1 %); this takes five lamps or a prior. Huber's loss reduces the weight of stray
// rim points, fluxes and pixels.
//
// Errors of the scene that it states (Lamp::position_sigma_m, size_sigma, tilt_sigma_rad,
// Scene::map_sigma_m, Camera::parameter_covariance) are unknowns with priors: those of each lamp
// are eliminated with its observations, those of the camera with all of them. The lamps concerned
// are taken by their rims on the rung direct.
//
// The covariance is (J^T J)^-1 of the whitened residuals; it is valid if the stated sigmas are. If
// chi2 exceeds its 99.9 % quantile, the covariance is multiplied by the variance factor chi2 / dof
// (the a posteriori variance of unit weight). Errors of map and camera that are not stated are one
// for each lamp, however many points its rim has. So a second factor compares the lamps as wholes:
// the reductions of chi2 if each lamp alone is moved, over their number of coordinates less the six
// of the pose; the larger factor counts. If all lamps have rims and it exceeds 25, the fit is
// repeated with errors of the map whose standard deviations are estimated
// (Refined::estimated_map_sigma_m, estimated_size_sigma); from 4 on, the covariance of such a fit
// is added to that of the pose. Errors that are common to all lamps come first: if a growth of the
// outlines (estimated_growth_px), or another focal length, or another k1 as well, of a camera that
// is stated as exact (estimated_camera), explains the contradictions better than errors of the map
// would in one of 10000 fits (F test), that fit counts. If it explains them no better, the
// difference of its pose is added to the covariance. Both factors are
// enlarged for few lamps, so that three sigma are those of Student's distribution. The covariance
// includes the second-order effect of a rotation about distant lamps on the translation
// (arc_moment).
#pragma once

#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/refine/separation.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Measurements that the pose is fitted to. Each rung is more accurate and slower than the
/// previous.
enum class Rung {
  points,   ///< centroids and projections of the lamps' centres: biased for large lamps
  centres,  ///< centroids and centres of the lamps' images
  rims,     ///< measured and projected rims
  direct,   ///< all pixels around a lamp and the lamp's rendered image
};

/// Use of the lamps' measured fluxes.
enum class FluxModel {
  ignore,         ///< geometry only
  known_power,    ///< each lamp's power_w is known to its power_sigma
  common_factor,  ///< powers are known up to one factor (exposure, aperture, ageing)
};

/// Options of refine().
struct LIBOCC_API RefineOptions {
  Rung rung = Rung::rims;  ///< a lamp without these measurements uses the next lower rung
  FluxModel flux = FluxModel::ignore;  ///< default: brightness is not used
  std::optional<Prior> prior;          ///< added as observations
  /// Standard deviation of the errors of camera and map at each lamp, e.g. of an uncalibrated lens:
  /// a shift of its image, for the rung rims by an error of its position (Lamp::position_sigma_m).
  double model_sigma_px = 0;
  /// Corner of Huber's loss for rim points, fluxes and the direct rung's pixels, in sigmas, or in
  /// the observed scatter (MAD) of rim points and pixels if it is larger. At 3 sigmas, 0.3 % of
  /// normal residuals are beyond the corner. Infinity: least squares, no lamp is left out.
  double huber_sigma = 3;
  /// The outlines of all lamps may be larger by one unknown number of pixels, as those of saturated
  /// lamps always are: blur, or a camera response that the scene does not state.
  bool outlines_grow = false;
  int max_iterations = 20;  ///< limit of the number of steps
  /// Converged when a step moves the image of no lamp farther than this. That step is still taken,
  /// so the remaining error is far smaller. Rung::direct converges faster and uses 100 times the
  /// value. If no lamp's position is exact: at least 0.5 % of the errors that this causes.
  double tolerance_px = 1e-5;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Fit of one lamp at the refined pose.
struct LampResidual {
  Match match;               ///< lamp and blob
  Rung rung = Rung::rims;    ///< rung of the lamp's residuals
  bool contradicts = false;  ///< left out as a gross error
  double misfit = 1;         ///< direct: residuals of its pixels relative to the sensor's noise
  double rms_px = 0;  ///< r.m.s. residual of its rim points, or length of its centroid residual
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< predicted centre of the lamp's image
  /// Estimated error of the lamp's position in the scene, in the frame of the world; zero if it is
  /// exact or used by its centroid.
  Eigen::Vector3d position_error_m = Eigen::Vector3d::Zero();
  double size_error = 0;  ///< estimated relative error of its size in the scene
};

/// Refined pose with its statistics.
struct Refined {
  Rigid3 cam_from_world;  ///< most likely pose
  Matrix6 covariance =
      unknown_covariance<6>();  ///< see geometry/rigid.hpp for order and perturbation
  /// Information of the lamps alone, without the prior: under a left perturbation d of
  /// cam_from_world their chi2 changes by 2 g . d + d . L d. L is singular for one or two lamps.
  Matrix6 lamp_information = Matrix6::Zero();
  Vector6 lamp_gradient = Vector6::Zero();  ///< g of the expression above
  double chi2 = 0;  ///< robust; includes the prior and the lamps that were left out
  int dof = 0;      ///< observations minus parameters
  /// Contained in the covariance; 1 unless chi2 of all residuals or of the lamps as wholes exceeds
  /// its 99.9 % quantile.
  double variance_factor = 1;
  /// Standard deviation of errors of the lamps' positions along each axis, estimated because lamps
  /// contradict each other by more than the scene states. Pose, covariance and the lamps' residuals
  /// then allow for them; chi2, dof and variance_factor are those of the scene as it is stated.
  std::optional<double> estimated_map_sigma_m;
  /// Standard deviation of relative errors of the lamps' sizes, estimated if their directions agree
  /// with each other and the sizes of their images do not. The positions are then used as exact.
  std::optional<double> estimated_size_sigma;
  /// Camera with the estimated errors, if those of the scene's camera are stated, or if lamps
  /// contradict each other by more than the scene states and an error of its focal length, or of k1
  /// as well, explains that. chi2, dof and variance_factor then are those of the scene as stated.
  std::optional<Camera> estimated_camera;
  /// Common growth of the outlines of lamps that are not saturated, if that explains their
  /// contradictions: rim_growth_px then, else empty.
  std::optional<double> estimated_growth_px;
  double rms_px = 0;                ///< r.m.s. centre residual over the lamps whose blobs are not
                                    ///< merged, or over all if all are
  std::vector<LampResidual> lamps;  ///< in the order of the matches
  SeparationModel separation;       ///< for protection_level()
  std::optional<double> rim_growth_px;  ///< common growth of saturated lamps
  std::optional<double> psf_sigma_px;   ///< direct: estimated from the lamps' pixels
  std::optional<double> flux_factor;    ///< FluxModel::common_factor: measured over predicted flux
  int iterations = 0;                   ///< number of steps taken
};

/// Refines a pose from `start`. Status: ok; too_few_lamps (fewer equations than the 6 unknowns of
/// the pose, prior included; the value is the start); degenerate (the information matrix is
/// singular to 1e-12 of its scale; the covariance is infinite); not_converged (also if a lamp is
/// not visible from the start). Throws std::invalid_argument for a match outside its list, a start
/// that is not finite, a lamp whose axes are not unit vectors, or a covariance that is not positive
/// definite.
LIBOCC_API Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  const RefineOptions& options = {});

/// Refines with the image of the blobs, which Rung::direct needs; without an image it falls back
/// to the rims. Also throws std::invalid_argument if the image does not have the camera's size.
LIBOCC_API Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  const RefineOptions& options, const ImageView& image);

}  // namespace occ
