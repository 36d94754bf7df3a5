// SPDX-License-Identifier: Apache-2.0
// Power and Lambertian order of lamps from images at known poses. Of a lamp's flux F in image i
//
//     ln F_i = ln P + ln(m + 1) + m ln cos(phi_i) + ln G_i          [grey levels]
//
// with G_i from the camera, the pose and the distance: formation/light.hpp's lamp_electrons, which
// goes as (m + 1) / (2 pi) cos^m(phi) / d^2. Gauss and Newton's steps over (ln P, m) per lamp, each
// lamp for itself, or over one factor of all the scene's powers and the orders: fluxes tell the
// product of power and factor alone, so that one of them is held. Fluxes that miss by more count by
// Huber's weights. Sigmas are the blobs' own beside `model_sigma`, what the model misses of a flux.
// What the scene's effects switch off is not counted (Scene::as_rendered).
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

/// Which powers are unknown.
enum class PowerFit {
  each,           ///< every lamp's
  common_factor,  ///< one factor of all of them, such as of an exposure or gain that is not known;
                  ///< the scene's powers are taken to be right but for it
};

struct LIBOCC_API LightOptions {
  PowerFit powers = PowerFit::each;
  double gate_px = 3;  ///< a blob is the lamp's when no farther from its image's centre, and no
                       ///< other blob or lamp is as near
  double model_sigma = 0.002;  ///< relative, of every flux: size of the lamp, tails of its image
  double huber_sigma = 3;
  double max_order_sigma = 0.3;  ///< an order less certain is not determined

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// What became of a lamp's flux in one image.
enum class FluxUse {
  used,
  out_of_view,  ///< not in the image, or its dark side is
  hidden,       ///< a part of it, by a box
  no_blob,      ///< none within the gate
  not_alone,    ///< two lamps or blobs within the gate
  saturated,
  cut,     ///< by the image's border
  merged,  ///< with another lamp
  blinks,  ///< the share of time it is lit is not known
};

/// The enumerator's name.
LIBOCC_API const char* to_string(FluxUse use);

struct LampFlux {
  int image = 0;
  FluxUse use = FluxUse::used;
  double cos_emission = 0;  ///< used ones only, as what follows
  double flux_dn = 0;
  double residual = 0;  ///< ln of seen over predicted
  double sigma = 0;     ///< of the residual
};

/// The light of one lamp.
struct LampLight {
  int id = 0;
  /// ok; no_lamps: used in no image, power (times the common factor) and order are the scene's;
  /// degenerate: the order is not determined (fewer than three fluxes, too little range of angles)
  /// and is the scene's, for which the power holds.
  Status status = Status::ok;
  std::string message;
  double power_w = 0;
  double order = 1;
  /// Of (ln power, order); contains variance_factor.
  Eigen::Matrix2d covariance = unknown_covariance<2>();
  double chi2 = 0;  ///< robust; this and what follows of the lamp's fit, or of the common one
  int dof = 0;
  double variance_factor = 1;    ///< 1 unless chi2 is too large to be chance
  std::vector<LampFlux> fluxes;  ///< one for each image
};

/// Of all the scene's powers. Fluxes do not tell whether lamps, exposure or gain are so much more.
struct CommonFactor {
  double value = 1;
  Eigen::MatrixXd covariance;  ///< of (ln value, orders in the scene's order), infinite where an
                               ///< order is not determined; contains the variance factor
};

struct CalibratedLight {
  std::vector<LampLight> lamps;        ///< in the scene's order
  std::optional<CommonFactor> factor;  ///< PowerFit::common_factor, when a lamp was seen
  /// With half_power_rad of the lamps that are ok; power_w and power_sigma of these, or of all when
  /// there is a common factor. It holds for the exposure and gain that it says.
  Scene scene;
};

/// Status: ok when some lamp's light is, or the common factor; degenerate when none is. Poses are
/// those of the images. Throws std::invalid_argument for another number of poses than of images, a
/// pose that is not finite, or when scene or options do not validate.
LIBOCC_API Result<CalibratedLight> calibrate_light(const Scene& scene,
                                                   const std::vector<std::vector<Blob>>& blobs,
                                                   const std::vector<Rigid3>& cam_from_world,
                                                   const LightOptions& options = {});

/// The same with the blobs' names known: for each image the matches of lamps and blobs, whatever
/// the gate. Throws also for another number of lists than of images and a match outside its list.
LIBOCC_API Result<CalibratedLight> calibrate_light(const Scene& scene,
                                                   const std::vector<std::vector<Blob>>& blobs,
                                                   const std::vector<Rigid3>& cam_from_world,
                                                   const std::vector<std::vector<Match>>& matches,
                                                   const LightOptions& options = {});

}  // namespace occ
