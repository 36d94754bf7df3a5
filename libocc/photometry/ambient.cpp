// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/ambient.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/photometry/internal/light_fit.hpp"

namespace occ {

using namespace internal::detect;
using namespace internal::photometry;
namespace {

constexpr double max_cut_off = 1e-3;  // moves the mean by less than 3e-4 of a pixel's noise
constexpr int min_pixels = 100;       // so that the mean is nearly Gaussian

/// Image of flags: 1 for pixels that may receive light of a lamp.
class Mask {
 public:
  explicit Mask(const Camera& camera)
      : width_(camera.width()),
        height_(camera.height()),
        pixels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

  void cover(double x0, double y0, double x1, double y1) {
    const int left = bounded(std::floor(x0), width_), right = bounded(std::ceil(x1) + 1, width_);
    const int top = bounded(std::floor(y0), height_), bottom = bounded(std::ceil(y1) + 1, height_);
    for (int y = top; y < bottom && left < right; ++y)
      std::fill(row(y) + left, row(y) + right, char{1});
  }
  char* row(int y) { return &pixels_[y * width_]; }

 private:
  static int bounded(double at, int size) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size)));
  }

  int width_, height_;
  std::vector<char> pixels_;
};

/// Mask of the projected lamps and of all detected blobs, with a margin.
Mask lamp_mask(const Scene& scene, const ImageView& image, const Rigid3& pose) {
  constexpr int rim_points = 32;
  const double margin_px = 3 + 6 * scene.sensor.psf_sigma_px;
  Mask mask(scene.camera);
  for (const Lamp& lamp : scene.lamps) {
    const auto rim = project_rim(lamp, pose, scene.camera, rim_points);
    if (!rim) continue;
    Eigen::Vector2d low = rim->front(), high = low;
    for (const Eigen::Vector2d& px : *rim) {
      low = low.cwiseMin(px);
      high = high.cwiseMax(px);
    }
    mask.cover(low.x() - margin_px, low.y() - margin_px, high.x() + margin_px,
               high.y() + margin_px);
  }
  DetectOptions options;
  options.sensor = scene.sensor;
  options.rims = false;
  for (const Blob& blob : detect(image, options))
    mask.cover(blob.x0 - margin_px, blob.y0 - margin_px, blob.x1 + margin_px, blob.y1 + margin_px);
  return mask;
}

/// Statistics of the linear signal of an image's background.
struct Background {
  int pixels = 0, black = 0, white = 0;
  double mean_dn = 0, variance_dn2 = 0;
};

Background background_of(const LinearImage& linear, Mask& mask) {
  const auto black = static_cast<float>(linear.linear_dn(0));
  const auto white = static_cast<float>(linear.linear_dn(linear.full_scale_dn()));
  std::vector<float> row(static_cast<std::size_t>(linear.width()));
  Background found;
  double squares = 0;
  for (int y = 0; y < linear.height(); ++y) {
    linear.read(0, y, linear.width(), 1, row.data());
    const char* masked = mask.row(y);
    for (int x = 0; x < linear.width(); ++x) {
      if (masked[x]) continue;
      const float value = row[x];
      found.black += value <= black;
      found.white += value >= white;
      const double off = value - found.mean_dn;  // Welford's recurrence
      found.mean_dn += off / ++found.pixels;
      squares += off * (value - found.mean_dn);
    }
  }
  found.variance_dn2 = found.pixels > 1 ? squares / (found.pixels - 1) : 0;
  return found;
}

std::string percent(int part, int whole) {
  const double share = std::round(1000.0 * part / whole) / 10;
  std::string text = std::to_string(share);
  return text.substr(0, text.find('.') + 2) + " %";
}

std::string exclusion_reason(const Background& background) {
  const auto too_many = [&](int pixels) { return pixels > max_cut_off * background.pixels; };
  if (background.pixels < min_pixels) return "too few pixels without light of lamps";
  if (too_many(background.black))
    return percent(background.black, background.pixels) + " of the background is at level 0";
  if (too_many(background.white))
    return percent(background.white, background.pixels) + " of the background is saturated";
  return {};
}

/// Variance [linear grey levels^2] of the mean of many pixels caused by rounding.
double rounding_variance(const Background& background, const Sensor& sensor, double slope) {
  const double electrons = std::max(0.0, background.mean_dn / sensor.gain_dn_per_e);
  const double noise_dn =
      sensor.gain_dn_per_e * std::hypot(sensor.read_noise_e, std::sqrt(electrons));
  const double modelled = noise_dn * noise_dn / (slope * slope);
  const double seen = background.variance_dn2 / (slope * slope) - 1.0 / 12;
  const double blur = std::max(0.0, std::min(modelled, seen));
  return slope * slope * std::exp(-4 * pi * pi * blur) / 12;
}

/// Name of an effect that adds light of the lamps to the background; empty without one.
std::string other_light_source(const Scene& scene) {
  if (scene.room && scene.room->wall_reflectance > 0) return "the walls' light";
  if (scene.lens.veiling_glare > 0) return "glare";
  if (!scene.lens.ghosts.empty()) return "light of ghosts";
  return {};
}

void validate_input(const Scene& scene, const Scene& rendered, const std::vector<ImageView>& images,
                    const std::vector<Rigid3>& cam_from_world) {
  require(scene.effects.of(Effect::ambient) != Use::off, "effects.ambient", "off",
          "on or auto to calibrate ambient light");
  require(rendered.sensor.mosaic == Mosaic::none, "sensor.mosaic", "colour",
          "none: ambient light is calibrated from pixels of equal sensitivity");
  validate_poses(images.size(), cam_from_world);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ImageView& image = images[i];
    const std::string name = "images[" + std::to_string(i) + "]";
    image.validate(name);
    const std::string size = std::to_string(image.width) + "x" + std::to_string(image.height);
    require(image.width == scene.camera.width() && image.height == scene.camera.height(), name,
            size, "of the camera's size");
  }
}

/// Linear relation of signals and irradiances.
struct Scale {
  double dark_dn, dn_per_w_m2;
};

struct Measured {
  AmbientImage image;
  double common_w2_m4 = 0;  ///< variance part that is common to all images
};

Measured measure(const Scene& scene, const ImageView& view, const Rigid3& pose,
                 const Scale& scale) {
  const Sensor& sensor = scene.sensor;
  const LinearImage linear(view, &sensor);
  Mask mask = lamp_mask(scene, view, pose);
  const Background background = background_of(linear, mask);
  Measured found{{exclusion_reason(background), background.pixels, 0, 0}, 0};
  if (!found.image.left_out.empty()) return found;
  const double unit = scale.dn_per_w_m2, electrons = background.mean_dn / sensor.gain_dn_per_e;
  const double slope = linear.slope(sensor.grey_level(std::max(0.0, electrons)));
  const double gains_dn = sensor.gain_sigma * background.mean_dn;
  const double variance = std::max(background.variance_dn2, slope * slope / 12);
  found.image.irradiance_w_m2 = (background.mean_dn - scale.dark_dn) / unit;
  found.image.sigma_w_m2 = std::sqrt(variance / background.pixels) / unit;
  found.common_w2_m4 =
      (rounding_variance(background, sensor, slope) + gains_dn * gains_dn / background.pixels) /
      (unit * unit);
  return found;
}

/// Weighted mean of the images' irradiances, with the common variance part.
void combine(double common_w2_m4, AmbientLight& found) {
  double weights = 0, sum = 0;
  for (const AmbientImage& image : found.images) {
    if (!image.left_out.empty()) continue;
    const double weight = 1 / (image.sigma_w_m2 * image.sigma_w_m2);
    weights += weight;
    sum += weight * image.irradiance_w_m2;
    ++found.dof;
  }
  found.irradiance_w_m2 = sum / weights;
  for (const AmbientImage& image : found.images) {
    if (!image.left_out.empty()) continue;
    const double off = (image.irradiance_w_m2 - found.irradiance_w_m2) / image.sigma_w_m2;
    found.chi2 += off * off;
  }
  --found.dof;
  found.variance_factor = variance_factor(found.chi2, found.dof);
  found.variance_w2_m4 = found.variance_factor / weights + common_w2_m4;
}

/// Reason for the status degenerate; empty if ok.
std::string failure_message(const Scene& scene, bool any, const AmbientLight& found) {
  constexpr double darker_sigmas = 5;
  const std::string other = other_light_source(scene);
  if (!other.empty()) return other + " cannot be separated from ambient light";
  if (found.images.empty()) return "there is no image";
  if (!any) return "no image is usable; in the first, " + found.images[0].left_out;
  if (found.irradiance_w_m2 < -darker_sigmas * std::sqrt(found.variance_w2_m4))
    return "the background is darker than the scene's black level and dark current";
  return {};
}

}  // namespace

Result<AmbientLight> calibrate_ambient(const Scene& scene, const std::vector<ImageView>& images,
                                       const std::vector<Rigid3>& cam_from_world) {
  Scene valid = scene;
  valid.validate();
  const Scene rendered = valid.as_rendered();
  validate_input(valid, rendered, images, cam_from_world);
  const Sensor& sensor = rendered.sensor;
  const double dark_e = sensor.electrons(0), gain = sensor.gain_dn_per_e;
  const Scale scale{gain * dark_e, gain * (sensor.electrons(1) - dark_e)};
  Result<AmbientLight> result;
  AmbientLight& found = result.value;
  double common_w2_m4 = 0;
  bool any = false;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Measured measured = measure(rendered, images[i], cam_from_world[i], scale);
    common_w2_m4 = std::max(common_w2_m4, measured.common_w2_m4);
    any = any || measured.image.left_out.empty();
    found.images.push_back(measured.image);
  }
  if (any) combine(common_w2_m4, found);
  result.message = failure_message(rendered, any, found);
  if (!result.message.empty()) {
    result.status = Status::degenerate;
    found.variance_w2_m4 = std::numeric_limits<double>::infinity();
  } else if (found.variance_factor > 1) {
    result.message =
        "images differ by more than their noise allows: ambient light changes, or there is a light "
        "source that is not in the scene";
  }
  return result;
}

}  // namespace occ
