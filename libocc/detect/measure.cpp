// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/measure.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "libocc/core/internal/blob_spread.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/quadrilateral.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr double min_rim_px = 3;           // min semi-minor axis for a rim measurement
constexpr double min_tube_elongation = 3;  // min axis ratio of a blob that may be a tube
constexpr double max_spot_px = 5;          // max semi-minor axis for a spot measurement
constexpr double scattered_px = 0.1;       // scatter of a rim's points of which some may be hidden
constexpr double saturated_share = 0.05;  // with more saturated pixels the rim is that of a clipped
                                          // disc
constexpr double default_psf_px = 0.8;    // PSF sigma without a sensor, as Sensor::psf_sigma_px
constexpr double sharpest_psf_px = 0.16;  // lower bound of the PSF sigma without a sensor
constexpr double sharpest_share = 0.8;    // lower bound as a part of a known PSF's sigma
constexpr double pixel_px2 = 1.0 / 12;    // variance of a uniform distribution over one pixel
constexpr double pulled_chi2 = 4;         // max chi-square of the difference of two centres
constexpr double min_elongation = 1.2;    // min axis ratio of two lamps in one blob
constexpr double min_dip = 0.1, dip_sigmas = 5;  // min dip between two lamps: of the peak, of noise
constexpr double min_dip_of_quadrilateral = 0.5;  // uneven or clipped light of one lamp dips less
constexpr int skirt_px = 2;                       // light just outside the box, below the threshold

}  // namespace

Ellipse ellipse_of(const Eigen::Vector2d& centre, const Eigen::Matrix2d& moments) {
  const double middle = 0.5 * moments.trace();
  const double half = std::hypot(0.5 * (moments(0, 0) - moments(1, 1)), moments(0, 1));
  Ellipse ellipse;
  ellipse.centre_px = centre;
  ellipse.semi_major_px = 2 * std::sqrt(std::max(0.0, middle + half));
  ellipse.semi_minor_px = 2 * std::sqrt(std::max(0.0, middle - half));
  if (half > 0)
    ellipse.angle_rad = 0.5 * std::atan2(2 * moments(0, 1), moments(0, 0) - moments(1, 1));
  return ellipse;
}

void inflate_covariance(Blob& blob) {
  const double spread = core::spread_px(blob);
  blob.covariance_px2 += spread * spread * Eigen::Matrix2d::Identity();
}

double threshold_dn(const Component& component, const DetectOptions& options) {
  return options.threshold_dn.value_or(component.background_dn +
                                       options.threshold_sigma * component.noise_dn);
}

bool is_measurable(const Component& component) {
  constexpr std::int64_t max_pixels = 1 << 22;  // in a patch; anything larger is no lamp
  const std::int64_t width = component.x1 - component.x0 + 1;
  return width * (component.y1 - component.y0 + 1) <= max_pixels;
}

namespace {

/// Blob with the values that follow from the component's moments.
Blob coarse_blob(const Component& component) {
  const Moments& light = component.grey.sum > 0 ? component.grey : component.shape;
  Blob blob;
  blob.centroid_px = light.mean();
  blob.ellipse = ellipse_of(blob.centroid_px, light.variance());
  blob.flux_dn = component.grey.sum;
  blob.flux_sigma_dn = component.noise_dn * std::sqrt(component.area_px);
  blob.peak_dn = component.peak_dn;
  blob.background_dn = component.background_dn;
  blob.noise_dn = component.noise_dn;
  blob.area_px = component.area_px;
  blob.x0 = component.x0;
  blob.y0 = component.y0;
  blob.x1 = component.x1;
  blob.y1 = component.y1;
  blob.saturated = component.saturated_px > 0;
  blob.cut_by_border = component.touches_border;
  // White noise over the component's area shifts the centroid in proportion to its second moments.
  const double relative = blob.flux_sigma_dn / light.sum;
  blob.covariance_px2 =
      relative * relative * (component.shape.variance() + pixel_px2 * Eigen::Matrix2d::Identity());
  return blob;
}

/// Share of a lamp's light, capped at half of its level, that the same light turned by 180 degrees
/// about the centre does not cover, beyond noise; 0 if noise may be the reason.
double asymmetry(const Patch& patch, const Component& component, const Eigen::Vector2d& centre_px) {
  constexpr double sigmas = 3, mean_part = 0.4, part_variance = 0.34;  // of max(0, normal variable)
  const Noise& noise = patch.noise();
  const double limit = dip_sigmas * std::sqrt(noise.floor);
  const double cap = std::max(limit, 0.5 * weighted_mean_signal(patch, component));
  const auto capped = [&](double signal) { return signal > limit ? std::min(signal, cap) : 0.0; };
  double all = 0, uncovered = 0, mean = 0, variance = 0;
  for (int y = component.y0 - skirt_px; y <= component.y1 + skirt_px; ++y)
    for (int x = component.x0 - skirt_px; x <= component.x1 + skirt_px; ++x) {
      if (!patch.contains(x, y)) continue;
      const double here = capped(*patch.at(x, y));
      if (here == 0) continue;
      const Eigen::Vector2d opposite = 2 * centre_px - Eigen::Vector2d(x, y);
      const double there = capped(patch.interpolated(opposite).value_or(0));
      all += here;
      uncovered += std::max(0.0, here - there);
      if (here == cap && there == cap) continue;
      const double pixel_variance = noise.variance(here) + noise.variance(there);
      mean += mean_part * std::sqrt(pixel_variance);
      variance += part_variance * pixel_variance;
    }
  const double excess = uncovered - mean;
  return excess > sigmas * std::sqrt(variance) ? excess / all : 0;
}

/// Inflates the covariance of what may be the visible part of a disc: it does not look the same
/// when turned by 180 degrees. Its centre is 0.95 to 1.3 times as far from that of a disc behind a
/// straight edge as stated here, whatever the hidden part.
void inflate_by_hidden_part(const Patch& patch, const Component& component, double blur2,
                            Blob& blob) {
  constexpr double edge_px = 0.1;   // error of an edge by its pixels
  constexpr double min_minor2 = 1;  // square of the semi-minor axis without blur
  // A part that is much longer than a disc uncovers a fifth; a tube in perspective, less.
  constexpr double long_ratio = 2.5, min_share_if_long = 0.1;
  const auto sharp = [&](double axis_px) {
    return std::sqrt(std::max(min_minor2, square(axis_px) - 4 * blur2));
  };
  const double major_px = sharp(blob.ellipse.semi_major_px);
  const double minor_px = sharp(blob.ellipse.semi_minor_px);
  const double share = asymmetry(patch, component, blob.centroid_px);
  const double by_edges = edge_px * (major_px + minor_px) / (2 * major_px * minor_px);
  if (share < (major_px > long_ratio * minor_px ? min_share_if_long : by_edges)) return;
  const double spread_px = share * square(major_px) / minor_px;
  blob.covariance_px2 += square(spread_px) * Eigen::Matrix2d::Identity();
}

/// Inflates the covariance if the centroid is more than half a pixel from the middle of the box, as
/// for a partly occluded lamp. For a whole lamp both agree.
void inflate_if_asymmetric(Blob& blob) {
  const Eigen::Vector2d middle(0.5 * (blob.x0 + blob.x1), 0.5 * (blob.y0 + blob.y1));
  const Eigen::Array2d apart = (blob.centroid_px - middle).cwiseAbs().array() - 0.5;
  const double spread = std::max(0.0, apart.maxCoeff());
  blob.covariance_px2 += spread * spread * Eigen::Matrix2d::Identity();
}

/// Inflates the covariance if the centre differs from the centroid of the component's pixels by
/// more than the pixels near the threshold can explain. Light of a neighbour within the window, or
/// a second lamp of other brightness in the same blob, causes such a difference. `threshold_dn`:
/// above the background.
void inflate_if_inconsistent(const Component& component, double threshold_dn, Blob& blob) {
  const Moments& light = component.grey;
  if (!(light.sum > 0)) return;
  const Eigen::Vector2d apart = light.mean() - blob.centroid_px;
  const double at_threshold = threshold_dn / light.sum;
  const Eigen::Matrix2d by_chance =
      blob.covariance_px2 + at_threshold * at_threshold * component.shape.sum *
                                (component.shape.variance() + Eigen::Matrix2d::Identity());
  if (apart.dot(by_chance.inverse() * apart) > pulled_chi2)
    blob.covariance_px2 += apart * apart.transpose();
}

/// True if the light along the blob's major axis falls by a share of its peak and rises again: two
/// lamps side by side.
bool has_valley(const Patch& patch, const Ellipse& ellipse, double min_dip) {
  if (ellipse.semi_major_px < min_elongation * ellipse.semi_minor_px) return false;
  const Eigen::Vector2d along(std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad));
  double peak = 0, valley = 0, dip = 0;
  for (double t = -ellipse.semi_major_px; t <= ellipse.semi_major_px; t += 0.5) {
    const std::optional<double> sampled = patch.interpolated(ellipse.centre_px + t * along);
    if (!sampled) continue;
    const double signal = *sampled;
    dip = std::max(dip, std::min(peak, signal) - valley);
    valley = std::min(valley, signal);
    if (signal > peak) peak = valley = signal;
  }
  return dip > std::max(min_dip * peak, dip_sigmas * std::sqrt(patch.noise().variance(peak)));
}

/// Sums the signal in the box and its skirt. The sigma includes the noise of the pixels and of the
/// background level.
void measure_flux(const Patch& patch, const Component& component, Blob& blob) {
  const int x0 = std::max(patch.x0(), component.x0 - skirt_px);
  const int y0 = std::max(patch.y0(), component.y0 - skirt_px);
  const int x1 = std::min(patch.x0() + patch.width() - 1, component.x1 + skirt_px);
  const int y1 = std::min(patch.y0() + patch.height() - 1, component.y1 + skirt_px);
  double sum = 0;
  for (int y = y0; y <= y1; ++y) {
    const float* row = patch.at(x0, y);
    for (int x = x0; x <= x1; ++x) sum += *row++;
  }
  const double pixels = static_cast<double>(x1 - x0 + 1) * (y1 - y0 + 1);
  const double common = pixels * patch.background_sigma_dn();
  const Noise& noise = patch.noise();
  blob.flux_dn = sum;
  blob.flux_sigma_dn =
      std::sqrt(pixels * noise.floor + std::max(0.0, sum) * noise.per_dn + common * common);
}

/// Centroid and second moments of the component's linear signal. A gradient of the light moves the
/// centroid by the second moments of the pixels that are not clipped, which alone respond to it.
void measure_moments(const Patch& patch, const Component& component, double blur2, Blob& blob) {
  const double limit = 5 * std::sqrt(patch.noise().floor);
  const double full = patch.full_scale_signal();
  const double clipped = full > 0 ? clipped_share * full : infinity;
  Moments light, noise, responding;
  for (int y = component.y0; y <= component.y1; ++y) {
    const float* row = patch.at(component.x0, y);
    for (int x = component.x0; x <= component.x1; ++x) {
      const double v = *row++;
      if (v <= limit) continue;
      const double dx = x - blob.centroid_px.x(), dy = y - blob.centroid_px.y();
      const double variance = patch.noise().variance(v);
      const Moments here{v, v * dx, v * dy, v * dx * dx, v * dx * dy, v * dy * dy};
      light += here;
      if (!(v >= clipped)) responding += here;
      noise += {variance,           variance * dx,      variance * dy,
                variance * dx * dx, variance * dx * dy, variance * dy * dy};
    }
  }
  if (!(light.sum > 0)) return;
  blob.covariance_px2 << noise.xx, noise.xy, noise.xy, noise.yy;
  blob.covariance_px2 += noise.sum * pixel_px2 * Eigen::Matrix2d::Identity();
  blob.covariance_px2 /= light.sum * light.sum;
  blob.centroid_px += light.mean();
  blob.ellipse = ellipse_of(blob.centroid_px, light.variance());
  const Eigen::Vector2d mean = light.mean();
  Eigen::Matrix2d about_mean;
  about_mean << responding.xx, responding.xy, responding.xy, responding.yy;
  const Eigen::Vector2d first(responding.x, responding.y);
  about_mean -= first * mean.transpose();
  blob.light_response_px2 =
      (about_mean - responding.sum * blur2 * Eigen::Matrix2d::Identity()) / light.sum;
}

/// `Shape`: Rim, PolygonRim or FreeRim.
template <typename Shape>
void use_points(Shape& rim, Blob& blob) {
  blob.rim = std::move(rim.points);
  blob.rim_covariance_px2 = rim.common_covariance_px2;
  blob.rim_light_response_px = rim.point_response.response_px;
  blob.rim_light_depth_px = rim.point_response.depth_px;
}

/// Points that scatter for another reason than noise, such as a beam in front of the lamp, err
/// alike along parts of the rim: its centre is off by up to about half of their scatter.
void add_shift_of_scatter(Rim& rim) {
  const double variance_px2 = square(0.5 * rim.fit.rms_px);
  rim.fit.centre_covariance_px2.diagonal().array() += variance_px2;
  rim.common_covariance_px2.diagonal().segment<2>(1).array() += variance_px2;
}

bool use_rim(std::optional<Rim>&& rim, Blob& blob) {
  if (!rim) return false;
  blob.merged = rim->merged;
  if (rim->merged) return false;
  blob.centroid_px = rim->fit.conic.centre;
  blob.covariance_px2 = rim->fit.centre_covariance_px2;
  blob.ellipse = rim->fit.conic.ellipse();
  use_points(*rim, blob);
  blob.light_response_px2 = rim->light_response_px2;
  return true;
}

bool use_polygon(std::optional<PolygonRim>&& rim, Blob& blob) {
  if (!rim) return false;
  blob.merged = false;
  blob.centroid_px = rim->polygon.centroid_px;
  blob.covariance_px2 = rim->centre_covariance_px2;
  blob.ellipse = ellipse_of(blob.centroid_px, rim->polygon.second_moments_px2);
  blob.light_response_px2 = rim->light_response_px2;
  if (!rim->is_whole) return true;  // only its centre is known
  blob.corners_px = rim->polygon.corners_px;
  use_points(*rim, blob);
  return true;
}

bool use_free_rim(std::optional<FreeRim>&& rim, bool hollows, Blob& blob) {
  if (!rim) return false;
  blob.merged = !rim->is_convex && !hollows;
  blob.centroid_px = rim->centre_px;
  blob.covariance_px2 = rim->centre_covariance_px2;
  blob.ellipse = ellipse_of(blob.centroid_px, rim->second_moments_px2);
  blob.free_form = true;
  use_points(*rim, blob);
  blob.light_response_px2 = rim->light_response_px2;
  return true;
}

bool use_spot(const std::optional<Spot>& spot, double blur2, Blob& blob) {
  if (!spot) return false;
  blob.centroid_px = spot->centre_px;
  blob.covariance_px2 = spot->covariance_px2;
  blob.ellipse = ellipse_of(spot->centre_px, spot->second_moments_px2);
  blob.light_response_px2 = spot->gradient_response_px2 - blur2 * Eigen::Matrix2d::Identity();
  return true;
}

/// The light of an unevenly lit lamp has another centre than its outline, which lacks the dimmest
/// part: half of the difference remains as an error. Of an evenly lit lamp the light is more
/// accurate.
void use_outline_centre(const Eigen::Vector2d& centre_px, Blob& blob) {
  constexpr double uneven_px = 1;  // more than the error of an outline of whole pixels
  const Eigen::Vector2d apart = centre_px - blob.centroid_px;
  blob.covariance_px2 += 0.25 * apart * apart.transpose();
  if (apart.norm() > uneven_px) blob.centroid_px = centre_px;
}

/// Measures the visible part of the rim of a disc that is hidden in part.
bool use_rim_in_part(const Patch& patch, const Component& component, double blur_px, bool clipped,
                     Blob& blob) {
  blob.hidden_in_part = use_rim(measure_rim_in_part(patch, component, blur_px, clipped), blob);
  return blob.hidden_in_part;
}

/// Measures the rim of a disc; of one whose points scatter, the visible part if there is one.
bool use_disc(const Patch& patch, const Component& component, const DetectOptions& options,
              double blur_px, bool clipped, Blob& blob) {
  std::optional<Rim> rim =
      clipped ? measure_saturated_rim(patch, component) : measure_rim(patch, component, blur_px);
  if (options.discs && rim && rim->fit.rms_px > scattered_px) {
    if (use_rim_in_part(patch, component, blur_px, clipped, blob)) return true;
    add_shift_of_scatter(*rim);
  }
  return use_rim(std::move(rim), blob);
}

/// Measures the outline of a large blob that is no whole disc.
bool use_outline(const Patch& patch, const Component& component, const DetectOptions& options,
                 double blur_px, bool clipped, Blob& blob) {
  if (options.polygons && use_polygon(clipped ? measure_saturated_polygon(patch, component)
                                              : measure_polygon(patch, component, blur_px),
                                      blob))
    return true;
  if (options.discs && use_rim_in_part(patch, component, blur_px, clipped, blob)) return true;
  return options.polygons && options.free_forms &&
         use_free_rim(clipped ? measure_saturated_free_rim(patch, component)
                              : measure_free_rim(patch, component, blur_px),
                      options.hollows, blob);
}

/// Measures the centre: by the rim if there is one, else as a spot, else by moments.
void measure_centre(const Patch& patch, const Component& component, const DetectOptions& options,
                    Blob& blob, bool& is_quadrilateral) {
  const double psf_px = options.sensor ? options.sensor->psf_sigma_px : default_psf_px;
  const double blur2 = psf_px * psf_px + pixel_px2, blur_px = std::sqrt(blur2);
  const double minor2 = blob.ellipse.semi_minor_px * blob.ellipse.semi_minor_px - 4 * blur2;
  const bool clipped = component.saturated_px > saturated_share * component.area_px;
  std::optional<Eigen::Vector2d> outline_centre;
  const bool has_rim = options.rims && minor2 > min_rim_px * min_rim_px;
  if (has_rim && use_disc(patch, component, options, blur_px, clipped, blob)) return;
  // The rim of a disc was not found, and the blob is no small spot.
  const bool long_blob =
      blob.ellipse.semi_major_px > min_tube_elongation * blob.ellipse.semi_minor_px;
  const bool large = minor2 > max_spot_px * max_spot_px;
  if (has_rim && (blob.merged || long_blob || large)) {
    if (use_outline(patch, component, options, blur_px, clipped, blob)) return;
    // Too small or too uneven for that, or its outline is another one.
    if (options.polygons && blob.merged) outline_centre = quadrilateral_centre(patch, component);
    is_quadrilateral = outline_centre.has_value();
    if (is_quadrilateral) blob.merged = false;
  }
  bool is_spot = false;
  if (minor2 < max_spot_px * max_spot_px && !blob.merged) {
    Eigen::Matrix2d start = component.grey.variance();
    start.diagonal() = start.diagonal().cwiseMax(blur2);
    const double sharpest_px = options.sensor ? sharpest_share * psf_px : sharpest_psf_px;
    const double min_variance = sharpest_px * sharpest_px + pixel_px2;
    is_spot = use_spot(measure_spot(patch, blob.centroid_px, start, min_variance), blur2, blob);
  }
  if (!is_spot) {
    measure_moments(patch, component, blur2, blob);
    if (outline_centre) use_outline_centre(*outline_centre, blob);
  }
  if (options.discs && (has_rim || long_blob)) {
    inflate_by_hidden_part(patch, component, blur2, blob);
  } else if (has_rim && !is_spot) {
    inflate_if_asymmetric(blob);
  }
}

}  // namespace

Blob measure(const LinearImage& image, const Component& component, const DetectOptions& options,
             Patch& scratch) {
  Blob blob = coarse_blob(component);
  if (!is_measurable(component)) {
    inflate_covariance(blob);
    return blob;
  }
  const double limit_stored = threshold_dn(component, options);
  const Sensor* sensor = options.sensor ? &*options.sensor : nullptr;
  scratch.load(image, component, image.linear_dn(limit_stored), sensor);
  blob.noise_dn = std::sqrt(scratch.noise().floor);
  measure_flux(scratch, component, blob);

  bool is_quadrilateral = false;
  measure_centre(scratch, component, options, blob, is_quadrilateral);
  const bool whole = !blob.merged && !blob.cut_by_border;
  if (blob.has_elliptical_rim() || (!blob.rim.empty() && whole)) return blob;
  const double dip = is_quadrilateral ? min_dip_of_quadrilateral : min_dip;
  blob.merged = blob.merged || has_valley(scratch, blob.ellipse, dip);
  if (blob.merged || blob.cut_by_border) {
    inflate_covariance(blob);
  } else {
    inflate_if_inconsistent(component, std::max(0.0, limit_stored - component.background_dn), blob);
    if (options.rims && options.polygons && blob.rim.empty())
      use_polygon(measure_quadrilateral(scratch, component), blob);
  }
  return blob;
}

}  // namespace occ::internal::detect
