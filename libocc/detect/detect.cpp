// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/detect.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/detect_fields.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/measure.hpp"

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

}  // namespace

void DetectOptions::validate() const {
  internal::core::check_fields(*this, detect_fields, "");
  if (sensor) sensor->validate();
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
  const Sensor* sensor = options.sensor ? &*options.sensor : nullptr;
  const LinearImage linear(image, sensor);
  const Background background(image, sensor);
  ThresholdRule rule;
  rule.sigma = options.threshold_sigma;
  rule.level_dn = options.threshold_dn;
  rule.full_scale_dn = linear.full_scale_dn();
  rule.min_area_px = options.min_area_px;
  std::vector<Component> components = find_components(image, background, rule);

  std::vector<Blob> blobs;
  if (stripes_enabled(options)) blobs = take_striped_lamps(linear, options, components);
  keep_brightest(components, options.max_blobs);
  blobs.reserve(blobs.size() + components.size());
  Patch scratch;
  for (const Component& component : components)
    blobs.push_back(measure(linear, component, options, scratch));
  std::sort(blobs.begin(), blobs.end(), comes_before);
  return blobs;
}

}  // namespace occ
