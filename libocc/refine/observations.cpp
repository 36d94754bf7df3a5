// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/observations.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/internal/blob_spread.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/internal/lens_blur.hpp"

namespace occ::internal::refine {

using namespace internal::formation;
namespace {

/// An ellipse has five unknowns; with fewer points the centroid is used if there is one.
constexpr std::size_t min_rim_points = 5;

/// Standard deviation of the centroid of a saturated blob beyond its covariance. Found on rendered
/// rooms with eight times the correct exposure.
constexpr double saturated_sigma_px = 0.05;

/// Uncertainty of ln of a lamp's light. The growth of its rim depends on it: with more light the
/// blur of the rim saturates farther out.
constexpr double brightness_sigma = 0.5;
constexpr double own_growth_sigma_px = 0.3;  // if the blob has no light response

constexpr double min_soft_growth_px = 0.3;  // smaller growths of soft edges are noise

void check_match(const Match& match, std::size_t lamp_count, std::size_t blob_count) {
  const auto inside = [](int i, std::size_t n) {
    return i >= 0 && static_cast<std::size_t>(i) < n;
  };
  require(inside(match.lamp, lamp_count), "match.lamp", match.lamp,
          "an index into the scene's " + std::to_string(lamp_count) + " lamps");
  require(inside(match.blob, blob_count), "match.blob", match.blob,
          "an index into the " + std::to_string(blob_count) + " blobs");
}

void check_axes(const Lamp& lamp) {
  const auto is_unit = [](const Eigen::Vector3d& v) {
    return std::abs(v.squaredNorm() - 1) < 1e-6;
  };
  const std::string name = "lamp " + std::to_string(lamp.id);
  const char* rule = "unit (call Scene::validate)";
  require(is_unit(lamp.normal), name + ": normal", lamp.normal.transpose(), rule);
  if (lamp.shape != LampShape::rectangle && lamp.shape != LampShape::polygon) return;
  require(is_unit(lamp.x_axis), name + ": x_axis", lamp.x_axis.transpose(), rule);
}

/// Variance of the growth of one saturated rim.
double own_growth_variance_px2(const Blob& blob) {
  if (!blob.saturated) return 0;
  const double size_px = 0.5 * (blob.ellipse.semi_major_px + blob.ellipse.semi_minor_px);
  const double response_px = 0.5 * blob.light_response_px2.trace() / size_px;  // to ln of light
  return std::pow(response_px > 0 ? brightness_sigma * response_px : own_growth_sigma_px, 2);
}

/// A disc that dims towards its rim seems to be a smaller one, whose centre is also seen elsewhere:
/// the growth of its rim is an error of the lamp's size.
void observe_softness(LampObservation& observation) {
  const Blob& blob = *observation.blob;
  double& variance_px2 = observation.common_covariance_px2(0, 0);
  if (observation.lamp->shape != LampShape::disc || blob.rim.empty() || blob.saturated ||
      blob.striped || !(variance_px2 > square(min_soft_growth_px)))
    return;
  const double relative_variance =
      variance_px2 / (blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px);
  if (!observation.errors) observation.errors = LampErrors();
  observation.errors->size = std::sqrt(square(observation.errors->size) + relative_variance);
  variance_px2 = 0;
}

/// True if the rim was measured as one of the lamp's shape. A small rectangle or polygon can have
/// the rim of an ellipse, by the blur of its corners. Lame curves resemble ellipses or rectangles.
bool has_its_shape(const Lamp& lamp, const Blob& blob) {
  if (lamp.shape == LampShape::lame) return true;
  if (lamp.shape == LampShape::polygon) return blob.free_form || !blob.corners_px.empty();
  if (blob.free_form) return false;
  const bool ellipse = blob.corners_px.empty() && blob.ellipse.semi_minor_px > 0;
  return lamp.shape == LampShape::rectangle ? !ellipse : lamp.may_show(blob);
}

/// The image of a disc or an ellipse is an ellipse, which has five parameters.
bool has_elliptical_image(const Lamp& lamp) {
  return lamp.shape == LampShape::disc || (lamp.shape == LampShape::lame && lamp.exponent == 2);
}

/// True if the rim determines the lamp's position across all directions at least as well as the
/// centroid does. The sides of a thin tube do not where its ends have no points.
bool determines_position(const Blob& blob) {
  if (blob.cut_by_border) return true;  // its centroid is not used
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  for (const RimPoint& point : blob.rim)
    information += point.normal * point.normal.transpose() / square(point.sigma_px);
  // Largest variance of the rim over that of the centroid in that direction, at most one: the
  // matrix information - covariance^-1 / 4 is positive semi-definite.
  const Eigen::Matrix2d more = information - blob.covariance_px2.inverse() / 4;
  return more.trace() >= 0 && more.determinant() >= 0;
}

/// `lamps`: number of lamps. Fewer than three have a pose by their rims alone.
bool uses_rim(const Lamp& lamp, const Blob& blob, std::size_t lamps, const RefineOptions& options) {
  const std::size_t needed = blob.cut_by_border || blob.has_hidden_sides() ? 1 : min_rim_points;
  return uses_rims(options.rung) && has_rim_distance(lamp.shape) && blob.rim.size() >= needed &&
         has_its_shape(lamp, blob) &&
         (blob.has_elliptical_rim() || lamps < 3 || blob.has_hidden_sides() ||
          determines_position(blob));
}

void observe_rim(const Match& match, const Blob& blob, const Camera& camera,
                 LampObservation& observation, std::vector<RimObservation>& rim) {
  observation.rim_begin = rim.size();
  for (const RimPoint& point : blob.rim) {
    if (!(point.sigma_px > 0)) {
      const std::string name = "blobs[" + std::to_string(match.blob) + "].rim.sigma_px";
      require(false, name, point.sigma_px, "positive");
    }
    const std::optional<RimRay> ray = rim_ray(point, camera);
    if (ray) rim.push_back({*ray, point.px, point.normal, 1 / point.sigma_px});
  }
  observation.rim_end = rim.size();
}

void observe_centroid(const Match& match, const Blob& blob, double model_sigma_px,
                      LampObservation& observation) {
  const double growth_px = blob.saturated ? saturated_sigma_px : 0;
  const double common_variance = model_sigma_px * model_sigma_px + growth_px * growth_px;
  Eigen::Matrix2d covariance = blob.covariance_px2 + common_variance * Eigen::Matrix2d::Identity();
  if (blob.free_form && !has_its_shape(*observation.lamp, blob)) {
    covariance +=
        square(core::spread_px(blob)) * Eigen::Matrix2d::Identity();  // part of it is hidden
  }
  const bool positive = covariance(0, 0) > 0 && covariance.determinant() > 0;
  if (!positive || !covariance.allFinite()) {
    const std::string name = "blobs[" + std::to_string(match.blob) + "].covariance_px2";
    require(false, name, blob.covariance_px2, "positive definite");
  }
  observation.has_centroid = true;
  observation.centroid_information = covariance.inverse();
}

/// The flux of a blinking lamp depends on its phase; that of a saturated, cut or partly hidden lamp
/// is incomplete.
void observe_flux(const Lamp& lamp, const Blob& blob, const Sensor& sensor,
                  LampObservation& observation) {
  if (blob.saturated || blob.cut_by_border || blob.hidden_in_part || lamp.frequency_hz ||
      !(blob.flux_dn > 0))
    return;
  const double variance =
      std::pow(blob.flux_sigma_dn / blob.flux_dn, 2) + lamp.power_sigma * lamp.power_sigma;
  if (!(variance > 0) || !std::isfinite(variance)) return;
  observation.has_flux = true;
  observation.log_electrons = std::log(blob.flux_dn / sensor.gain_dn_per_e);
  observation.flux_inverse_sigma = 1 / std::sqrt(variance);
}

/// True if the pixels of a lamp can be rendered. Excluded are lamps that blink under a rolling
/// shutter (stripes), cut and partly hidden blobs, and merged blobs, except rectangles and Lame
/// curves, which are often marked as merged because no ellipse fits them. Saturated discs are
/// excluded because the position where they clip depends on the far tail of the PSF, which the
/// scene does not contain; their rims allow for it. So are lamps with errors in the scene, or all
/// if the camera has errors: the rendered image is linearised at the stated position.
bool offers_pixels(const LampObservation& observation, const Sensor& sensor, bool all_grow) {
  if (observation.errors) return false;
  const Lamp& lamp = *observation.lamp;
  const Blob& blob = *observation.blob;
  if ((blob.saturated || all_grow) && observation.has_rim()) return false;

  const Eigen::Vector2d& c = blob.centroid_px;
  const bool boxed = c.x() >= blob.x0 && c.x() <= blob.x1 && c.y() >= blob.y0 && c.y() <= blob.y1;
  const bool by_rows = blob.striped || (lamp.frequency_hz && sensor.row_time_s > 0);
  const bool whole =
      !blob.merged || (lamp.shape != LampShape::disc && lamp.shape != LampShape::point);
  const bool has_psf = sensor.psf_sigma_px >= 0.01 && sensor.psf_sigma_px <= 100;
  return boxed && has_psf && !by_rows && !blob.cut_by_border && !blob.hidden_in_part && whole;
}

void observe_pixels(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                    const Scene& scene, const RefineOptions& options, const ImageView& image,
                    Observations& all) {
  image.validate();
  const bool fits = image.width == scene.camera.width() && image.height == scene.camera.height();
  require(fits, "image", std::to_string(image.width) + " x " + std::to_string(image.height),
          "of the camera's size");
  all.psf_sigma_px = gaussian_blur_px(scene);
  const WindowReader reader(image, scene.sensor);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    LampObservation& lamp = all.lamps[i];
    if (!offers_pixels(lamp, scene.sensor, all.all_grow)) continue;
    lamp.window = reader.read(blobs, static_cast<std::size_t>(matches[i].blob));
    if (options.flux == FluxModel::ignore || lamp.lamp->frequency_hz) continue;
    lamp.light_sigma = lamp.lamp->power_sigma;
    all.has_flux = true;
  }
}

int prior_equations(const RefineOptions& options) {
  return options.prior ? options.prior->dof() : 0;
}

}  // namespace

std::vector<double> rim_distances_px(const LampInCam& in_cam, const LampObservation& lamp,
                                     const Observations& observations) {
  std::vector<double> distances;
  distances.reserve(lamp.rim_end - lamp.rim_begin);
  for (std::size_t i = lamp.rim_begin; i < lamp.rim_end; ++i)
    if (const auto distance = rim_distance_px(in_cam, observations.rim[i].ray))
      distances.push_back(*distance + lamp.moved_px);
  return distances;
}

bool Observations::move_rims(double growth_px, const Camera& camera) {
  constexpr double min_step_px = 1;  // a growth of 1 px seems to shift a rim by 0.001 px
  std::vector<RimRay> rays;
  bool moved = false;
  for (LampObservation& lamp : lamps) {
    if (!grows(lamp)) continue;
    const double max_px = 0.5 * lamp.blob->ellipse.semi_minor_px;
    const double moved_px = std::clamp(growth_px, -max_px, max_px);
    if (!(std::abs(moved_px - lamp.moved_px) > min_step_px)) continue;
    rays.clear();
    for (std::size_t i = lamp.rim_begin; i < lamp.rim_end; ++i) {
      const Eigen::Vector2d& normal = rim[i].normal;
      if (const auto ray = rim_ray({rim[i].px - moved_px * normal, normal}, camera))
        rays.push_back(*ray);
    }
    if (rays.size() < lamp.rim_end - lamp.rim_begin) continue;  // at the edge of the lens
    for (std::size_t i = 0; i < rays.size(); ++i) rim[lamp.rim_begin + i].ray = rays[i];
    lamp.moved_px = moved_px;
    moved = true;
  }
  return moved;
}

bool Observations::has_pixels() const {
  return std::any_of(lamps.begin(), lamps.end(), [](const LampObservation& lamp) {
    return lamp.has_pixels() && !lamp.contradicts;
  });
}

bool Observations::growth_was_used() const {
  return std::any_of(lamps.begin(), lamps.end(), [&](const LampObservation& lamp) {
    return grows(lamp) && lamp.has_rim() && !lamp.has_pixels();
  });
}

int Observations::equations(const RefineOptions& options, Rung rung) const {
  int count = prior_equations(options), fluxes = 0;
  for (const LampObservation& o : lamps) {
    if (o.contradicts) continue;
    const int most = has_elliptical_image(*o.lamp) ? 5 : 6;
    if (uses_rims(rung) && o.has_rim()) {
      count += std::min(most, static_cast<int>(o.rim_end - o.rim_begin));
    } else if (o.has_centroid) {
      count += 2;
    }
    fluxes += o.has_flux ? 1 : 0;
  }
  if (options.flux == FluxModel::common_factor) fluxes = std::max(0, fluxes - 1);
  return count + fluxes;
}

int Observations::degrees_of_freedom(const RefineOptions& options, Rung rung) const {
  int count = prior_equations(options) - 6;
  for (const LampObservation& o : lamps) {
    if (o.contradicts || (rung == Rung::direct && o.has_pixels())) continue;
    const bool by_rim = uses_rims(rung) && o.has_rim();
    count += by_rim ? static_cast<int>(o.rim_end - o.rim_begin) : (o.has_centroid ? 2 : 0);
    count += o.has_flux ? 1 : 0;
  }
  if (has_flux && options.flux == FluxModel::common_factor) --count;
  return count;  // the growth of rims comes with its own prior
}

bool has_model_errors(const RefineOptions& options) {
  return options.model_sigma_px > 0 && options.rung == Rung::rims;
}

Scene with_model_errors(const Scene& stated, const std::vector<Match>& matches,
                        const Rigid3& cam_from_world, RefineOptions& options) {
  Scene scene = stated;
  for (const Match& match : matches) {
    if (match.lamp < 0 || match.lamp >= static_cast<int>(scene.lamps.size())) continue;
    Lamp& lamp = scene.lamps[static_cast<std::size_t>(match.lamp)];
    Eigen::Matrix<double, 2, 3> by_position;
    if (!scene.camera.project(cam_from_world * lamp.centre_m, &by_position)) continue;
    const double px_per_m = by_position.norm() / std::sqrt(2.0);
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
    if (const auto sigma_m = stated.position_sigma_m(lamp)) own = *sigma_m;
    lamp.position_sigma_m =
        PerAxis((own.array().square() + square(options.model_sigma_px / px_per_m)).sqrt().matrix());
  }
  options.model_sigma_px = 0;
  return scene;
}

Observations observe(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                     const Scene& scene, const RefineOptions& options, const ImageView* image) {
  Observations all;
  all.all_grow = options.outlines_grow;
  if (has_shared_errors(scene)) {
    all.shared_errors = SharedErrors(scene);
    all.shared_shift.setZero(all.shared_errors.count());
  }
  all.lamps.reserve(matches.size());
  std::size_t rim_count = 0;
  for (const Match& match : matches) {
    check_match(match, scene.lamps.size(), blobs.size());
    rim_count += blobs[match.blob].rim.size();
  }
  all.rim.reserve(uses_rims(options.rung) ? rim_count : 0);
  for (const Match& match : matches) {
    const Lamp& lamp = scene.lamps[match.lamp];
    const Blob& blob = blobs[match.blob];
    check_axes(lamp);
    LampObservation observation{&lamp, &blob};
    observation.errors = errors_of(lamp, scene);
    const double model_variance = options.model_sigma_px * options.model_sigma_px;
    observation.common_covariance_px2 = blob.rim_covariance_px2;
    observe_softness(observation);
    observation.common_covariance_px2.diagonal().head<3>() +=
        Eigen::Vector3d(own_growth_variance_px2(blob), model_variance, model_variance);
    if (uses_rim(lamp, blob, matches.size(), options)) {
      observe_rim(match, blob, scene.camera, observation, all.rim);
      all.rims_grow = all.rims_grow || all.grows(observation);
    }
    if (!blob.cut_by_border) observe_centroid(match, blob, options.model_sigma_px, observation);
    if (options.flux != FluxModel::ignore) observe_flux(lamp, blob, scene.sensor, observation);
    all.has_flux = all.has_flux || observation.has_flux;
    all.lamps.push_back(observation);
  }
  if (image && options.rung == Rung::direct && !has_shared_errors(scene)) {
    observe_pixels(matches, blobs, scene, options, *image, all);
  }
  return all;
}

}  // namespace occ::internal::refine
