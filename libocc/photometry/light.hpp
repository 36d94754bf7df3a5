// SPDX-License-Identifier: Apache-2.0
// Power and Lambertian order of lamps from images at known poses. The flux F of a lamp in image i
// is
//
//     ln F_i = ln P + ln(m + 1) + m ln cos(phi_i) + ln G_i          [grey levels]
//
// with G_i from the camera, the pose and the distance d (lamp_electrons() of formation/light.hpp,
// which is proportional to (m + 1) / (2 pi) cos^m(phi) / d^2). The unknowns are (ln P, m) of each
// lamp separately, or a common factor of all powers of the scene and the orders. The fluxes
// determine only the product of power and factor, so one of them is held. Gauss-Newton steps with
// Huber's weights. The emission of a lamp with photometry is held, so only its power is unknown.
// The variance of a flux is that of the blob plus `model_sigma` squared, the error of the flux
// model. Effects that the scene switches off are not modelled (Scene::as_rendered).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Unknown powers.
enum class PowerFit {
  each,           ///< the power of each lamp
  common_factor,  ///< one factor of all powers, for example an unknown exposure or gain; the ratios
                  ///< of the scene's powers are held
};

/// Options of calibrate_light().
struct LIBOCC_API LightOptions {
  PowerFit powers = PowerFit::each;  ///< unknown powers; orders are always unknown
  double gate_px = 3;  ///< radius around a lamp's predicted image; it must contain one blob and no
                       ///< other lamp
  double model_sigma = 0.002;    ///< relative error of the flux model: lamp size, image tails
  double huber_sigma = 3;        ///< residuals above are down-weighted (Huber)
  double max_order_sigma = 0.3;  ///< an order with a larger sigma counts as undetermined

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Use of a lamp's flux in one image, or the reason for its exclusion.
enum class FluxUse {
  used,         ///< contributes to the fit
  out_of_view,  ///< outside the image, or it faces away from the camera
  hidden,       ///< partly hidden, by a box of the scene or as the blob shows
  no_blob,      ///< no blob inside the gate
  not_alone,    ///< two lamps or two blobs inside the gate
  saturated,    ///< pixels at full scale: the flux is a lower bound
  cut,          ///< cut by the image border
  merged,       ///< merged with the blob of another lamp
  blinks,       ///< modulated: its duty cycle during the exposure is unknown
};

/// The enumerator's name.
LIBOCC_API const char* to_string(FluxUse use);

/// Flux of a lamp in one image.
struct LampFlux {
  int image = 0;                ///< index of the image
  FluxUse use = FluxUse::used;  ///< `used`, or the reason for the exclusion
  double cos_emission = 0;      ///< this and the following: only if used
  double flux_dn = 0;           ///< measured flux
  double residual = 0;          ///< ln(observed / predicted flux)
  double sigma = 0;             ///< standard deviation of the residual
};

/// Calibrated light of one lamp.
struct LampLight {
  int id = 0;  ///< id in the scene
  /// ok; no_lamps: used in no image; power (times the common factor) and order are the scene's.
  /// degenerate: the order is undetermined (fewer than three fluxes, too small a range of angles);
  /// it is the scene's, and the power is valid for this order.
  Status status = Status::ok;
  std::string message;  ///< reason if not ok
  double power_w = 0;   ///< radiant power while lit
  double order = 1;     ///< Lambertian order m; with photometry Lamp::order(), which is held
  /// Covariance of (ln power, order); includes variance_factor.
  Eigen::Matrix2d covariance = unknown_covariance<2>();
  double chi2 = 0;  ///< robust; chi2 to variance_factor: of this lamp's fit, or of the common fit
  int dof = 0;      ///< observations less unknowns of the same fit
  double variance_factor = 1;    ///< 1 unless chi2 exceeds its 99.9 % quantile
  std::vector<LampFlux> fluxes;  ///< one for each image
};

/// Common factor of all powers of the scene. Lamps, exposure and gain cannot be separated.
struct CommonFactor {
  double value = 1;            ///< true over the scene's powers; includes exposure and gain
  Eigen::MatrixXd covariance;  ///< (ln value, orders of the lamps), infinite for an undetermined
                               ///< order; includes the variance factor
};

/// Result of calibrate_light().
struct CalibratedLight {
  std::vector<LampLight> lamps;        ///< in the scene's order
  std::optional<CommonFactor> factor;  ///< with PowerFit::common_factor and at least one used flux
  /// The scene with half_power_rad, power_w and power_sigma of the lamps that are ok; with a common
  /// factor, power_w and power_sigma of all lamps. Valid for the scene's exposure and gain.
  Scene scene;
};

/// blobs: of each image; cam_from_world: pose of each image. Status: ok: at least one lamp is ok,
/// or the common factor is determined; degenerate otherwise. Throws std::invalid_argument for
/// another number of poses than of images, a pose that is not rigid, or an invalid scene or
/// options.
LIBOCC_API Result<CalibratedLight> calibrate_light(const Scene& scene,
                                                   const std::vector<std::vector<Blob>>& blobs,
                                                   const std::vector<Rigid3>& cam_from_world,
                                                   const LightOptions& options = {});

/// Overload with known assignments of blobs to lamps for each image, instead of the gate. Also
/// throws std::invalid_argument for another number of lists than of images and for an index out of
/// range.
LIBOCC_API Result<CalibratedLight> calibrate_light(const Scene& scene,
                                                   const std::vector<std::vector<Blob>>& blobs,
                                                   const std::vector<Rigid3>& cam_from_world,
                                                   const std::vector<std::vector<Match>>& matches,
                                                   const LightOptions& options = {});

}  // namespace occ
