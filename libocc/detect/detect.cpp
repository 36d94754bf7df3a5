// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/detect.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/blob_colour.hpp"
#include "libocc/detect/internal/colour_difference.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/detect_fields.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/measure.hpp"
#include "libocc/detect/internal/patterned_lamps.hpp"

namespace occ {

using namespace internal::detect;
namespace {

void keep_brightest(std::vector<Component>& components, int count) {
  const auto keep = static_cast<std::size_t>(count);
  if (components.size() <= keep) return;
  const auto brighter = [](const Component& a, const Component& b) {
    return std::tuple(-a.grey.sum, a.y0, a.x0) < std::tuple(-b.grey.sum, b.y0, b.x0);
  };
  std::nth_element(components.begin(), components.begin() + count, components.end(), brighter);
  components.resize(keep);
}

bool comes_before(const Blob& a, const Blob& b) {
  const auto key = [](const Blob& blob) {
    return std::tuple(-blob.flux_dn, blob.y0, blob.x0, blob.y1, blob.x1);
  };
  return key(a) < key(b);
}

Image negative(const ImageView& image) {
  Image grey = to_grey(image);
  for (std::uint8_t& value : grey.u8) value = static_cast<std::uint8_t>(255 - value);
  for (std::uint16_t& value : grey.u16) value = static_cast<std::uint16_t>(65535 - value);
  return grey;
}

ThresholdRule rule_of(const DetectOptions& options, const LinearImage& linear) {
  ThresholdRule rule;
  rule.sigma = options.threshold_sigma;
  rule.level_dn = options.threshold_dn;
  rule.full_scale_dn = linear.full_scale_dn();
  rule.min_area_px = options.min_area_px;
  return rule;
}

/// Measures the components of one pass. `image` and `channels`: the image whose channels give the
/// colours.
std::vector<Blob> measure_all(const LinearImage& linear, const DetectOptions& options,
                              std::vector<Component>& components, const ImageView& image,
                              const LinearImage& channels) {
  std::vector<Blob> striped, blobs;
  if (stripes_enabled(options)) striped = take_striped_lamps(linear, options, components);
  keep_brightest(components, options.max_blobs);
  blobs.reserve(striped.size() + components.size());
  Patch scratch;
  for (const Component& component : components) {
    blobs.push_back(measure(linear, component, options, scratch));
    if (image.channels >= 3)
      blobs.back().colour = measure_colour(image, channels, component, scratch);
  }
  if (options.patterned) join_parts(linear, options, components, blobs);
  blobs.insert(blobs.begin(), std::make_move_iterator(striped.begin()),
               std::make_move_iterator(striped.end()));
  return blobs;
}

const Sensor* sensor_of(const DetectOptions& options) {
  return options.sensor ? &*options.sensor : nullptr;
}

std::vector<Blob> detect_grey(const ImageView& image, const DetectOptions& options) {
  const LinearImage linear(image, sensor_of(options));
  const Background background(image, sensor_of(options));
  std::vector<Component> components = find_components(image, background, rule_of(options, linear));
  std::vector<Blob> blobs = measure_all(linear, options, components, image, linear);
  std::sort(blobs.begin(), blobs.end(), comes_before);
  return blobs;
}

/// Converts the levels of a colour difference to linear grey levels of the image.
void scale_levels(double factor, std::vector<Blob>& blobs) {
  for (Blob& blob : blobs)
    for (double* level :
         {&blob.flux_dn, &blob.flux_sigma_dn, &blob.peak_dn, &blob.background_dn, &blob.noise_dn})
      *level *= factor;
}

/// Errors of a rim by what a camera does to the colours of its image [px].
struct ColourErrors {
  double centre, growth, stretch;
  double part;  ///< common error of the points of a side, or of a quarter of the rim
};

/// Sharpening, coarse colours and JPEG blur the differences of channels. Around clipped pixels
/// these are no longer proportional to the light. Found on rendered pictures, those of polygons
/// also on photographs.
ColourErrors colour_errors(const Blob& blob, bool is_raw) {
  if (blob.saturated && !blob.corners_px.empty()) return {0.2, 1, 0.5, 0.4};
  if (blob.saturated) return {0.1, 0.3, 0.15, 0.1};
  if (is_raw) return {};
  return {0.04, 0.15, 0.1, 0.08};
}

void widen_rim(const ColourErrors& errors, Blob& blob) {
  if (blob.rim.empty()) return;
  blob.covariance_px2.diagonal().array() += square(errors.centre);
  RimErrorCovariance& common = blob.rim_covariance_px2;
  common(0, 0) += square(errors.growth);
  common.diagonal().segment<2>(1).array() += square(errors.centre);
  common.diagonal().tail<2>().array() += square(errors.stretch);
  const auto parts = static_cast<double>(blob.corners_px.empty() ? 4 : blob.corners_px.size());
  const double part_px = errors.part * std::sqrt(static_cast<double>(blob.rim.size()) / parts);
  for (RimPoint& point : blob.rim) point.sigma_px = std::hypot(point.sigma_px, part_px);
}

std::vector<Blob> detect_colour(const ImageView& image, const LinearImage& channels,
                                const Eigen::Vector3d& share, const DetectOptions& given) {
  const ColourDifference difference(image, channels, share, sensor_of(given));
  DetectOptions options = given;
  options.sensor = difference.sensor();
  if (given.threshold_dn)
    options.threshold_dn = difference.levels_per_dn() * channels.linear_dn(*given.threshold_dn);
  const LinearImage linear(difference.view(), sensor_of(options));
  const ImageView search = difference.search_view();
  // As in grey, the noise model is that of a linear image. Other images went through a camera's
  // processing, which changes their noise.
  const bool is_raw = given.sensor && given.sensor->is_linear();
  const Background background(search, is_raw ? sensor_of(options) : nullptr,
                              difference.min_noise());
  const ThresholdRule rule = rule_of(options, linear);
  std::vector<Component> components = find_components(search, background, rule);
  difference.describe(rule, components);
  std::vector<Blob> blobs = measure_all(linear, options, components, image, channels);
  blobs.erase(std::remove_if(
                  blobs.begin(), blobs.end(),
                  [&](const Blob& blob) { return !blob.striped && !difference.has_colour(blob); }),
              blobs.end());
  for (Blob& blob : blobs) widen_rim(colour_errors(blob, is_raw), blob);
  scale_levels(1 / difference.levels_per_dn(), blobs);
  return blobs;
}

/// One pass for each group of colours. Of blobs that two passes find, the one remains whose colour
/// is closer to that of its pass.
std::vector<Blob> detect_by_colour(const ImageView& image, const DetectOptions& options) {
  const LinearImage channels(image, sensor_of(options));
  std::vector<ColourGroup> groups = group_colours(options.colours);
  std::vector<PassBlobs> passes;
  for (const ColourGroup& group : groups)
    passes.push_back({group.share, group.saturated
                                       ? detect_colour(image, channels, group.share, options)
                                       : detect_grey(image, options)});
  std::vector<Blob> blobs = without_duplicates(std::move(passes));
  std::sort(blobs.begin(), blobs.end(), comes_before);
  if (blobs.size() > static_cast<std::size_t>(options.max_blobs))
    blobs.resize(static_cast<std::size_t>(options.max_blobs));
  return blobs;
}

}  // namespace

void DetectOptions::validate() const {
  internal::core::check_fields(*this, detect_fields, "");
  if (sensor) sensor->validate();
  for (std::size_t i = 0; i < colours.size(); ++i)
    require(colours[i].allFinite() && colours[i].minCoeff() >= 0 && colours[i].maxCoeff() > 0,
            "colours[" + std::to_string(i) + "]", internal::core::vector_text(colours[i]),
            "three numbers, zero or positive, not all zero");
  if (dark) require(!sensor, "sensor", "one", "none when dark blobs are looked for");
  if (stripes.value_or(false)) {
    require(sensor.has_value(), "sensor", "none", "given when stripes are to be read");
    require(sensor->row_time_s > 0, "sensor.row_time_s", sensor->row_time_s,
            "positive when stripes are to be read");
  }
}

std::vector<Blob> detect(const ImageView& image, const DetectOptions& options) {
  image.validate();
  options.validate();
  if (options.dark) {
    DetectOptions bright = options;
    bright.dark = false;
    return detect(negative(image).view(), bright);
  }
  if (options.sensor && options.sensor->response == Response::automatic) {
    DetectOptions with_response = options;
    with_response.sensor = options.sensor->of_image(image);
    return detect(image, with_response);
  }
  if (image.channels >= 3 && !options.colours.empty()) return detect_by_colour(image, options);
  return detect_grey(image, options);
}

}  // namespace occ
