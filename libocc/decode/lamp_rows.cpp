// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/lamp_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include "libocc/core/statistics.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/stripe_window.hpp"
#include "libocc/radiometry/internal/mosaic.hpp"

namespace occ {

using namespace internal::detect;
using namespace internal::radiometry;
namespace {

/// Channel of the pixel at (x, y): 0 red, 1 green, 2 blue; 0 without a mosaic.
std::size_t channel_of(Mosaic mosaic, int x, int y) {
  return mosaic == Mosaic::none ? 0
                                : colour_at(mosaic, static_cast<std::size_t>(x % 2 + 2 * (y % 2)));
}

/// Median of the pixels around a window: the background level without the lamp.
double level_around(const LinearImage& image, const LineBox& box, bool columns) {
  const LineBox ring = box.grown(2, 2).cut_to(line_box(image, columns));
  std::vector<double> values;
  float value = 0;
  const auto take = [&](int line, int pos) {
    image.read(columns ? line : pos, columns ? pos : line, 1, 1, &value);
    values.push_back(value);
  };
  for (int pos = ring.pos0; pos <= ring.pos1; ++pos)
    for (const int line : {ring.line0, ring.line1}) take(line, pos);
  for (int line = ring.line0; line <= ring.line1; ++line)
    for (const int pos : {ring.pos0, ring.pos1}) take(line, pos);
  return median(std::move(values));
}

/// Background level at each line of a window. Ambient light that flickers at mains frequency
/// changes it from line to line: the medians of the pixels beside neighbouring lines are used if
/// they differ from the level around the window by more than the tail of a lamp's light does.
std::vector<double> backgrounds(const LinearImage& image, const LineBox& box, bool columns) {
  constexpr int side = 4, reach = 8;  // [px], [lines]: flicker is slower by far
  constexpr double max_difference_dn = 3;
  const double level = level_around(image, box, columns);
  const std::vector<double> even(static_cast<std::size_t>(box.lines()), level);
  const LineBox wide = box.grown(reach, side).cut_to(line_box(image, columns));
  std::vector<std::vector<double>> beside(static_cast<std::size_t>(wide.lines()));
  for (int line = wide.line0; line <= wide.line1; ++line)
    for (int pos = wide.pos0; pos <= wide.pos1; ++pos) {
      if (pos >= box.pos0 && pos <= box.pos1) continue;
      float value = 0;
      image.read(columns ? line : pos, columns ? pos : line, 1, 1, &value);
      beside[static_cast<std::size_t>(line - wide.line0)].push_back(value);
    }
  if (wide.length() < box.length() + side) return even;  // at the image's border
  std::vector<double> by_line;
  bool is_even = true;
  for (int line = box.line0; line <= box.line1; ++line) {
    std::vector<double> values;
    const int last = std::min(wide.line1, line + reach);
    for (int near = std::max(wide.line0, line - reach); near <= last; ++near) {
      const auto& at = beside[static_cast<std::size_t>(near - wide.line0)];
      values.insert(values.end(), at.begin(), at.end());
    }
    by_line.push_back(median(std::move(values)));
    is_even = is_even && std::abs(by_line.back() - level) <= max_difference_dn;
  }
  return is_even ? even : by_line;
}

/// Variance of a pixel's linear grey level, for a signal above black.
double variance_dn2(const Sensor& sensor, double signal_dn) {
  const double noise_dn = sensor.noise_dn(signal_dn / sensor.gain_dn_per_e);
  return noise_dn * noise_dn;
}

struct Key {
  int line, channel;
  bool operator<(const Key& other) const {
    return std::tie(line, channel) < std::tie(other.line, other.channel);
  }
};

/// Light of a line when the lamp is lit: mean of the brightest quarter of its values.
double lit_level(std::vector<double> values) {
  std::sort(values.begin(), values.end(), std::greater<>());
  const std::size_t count = std::max<std::size_t>(1, values.size() / 4);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += values[i];
  return sum / static_cast<double>(count);
}

}  // namespace

std::vector<LineLight> lamp_lines(const ImageView& image, const Sensor& sensor, double start_s,
                                  const LampWindow& window) {
  image.validate();
  const LinearImage linear(image, &sensor);
  const bool columns = sensor.readout == Readout::columns;
  const Eigen::Vector2d half(window.half_width_px, window.half_height_px);
  const Eigen::Index across = columns ? 0 : 1, along = 1 - across;
  const auto first = [&](Eigen::Index axis) {
    return static_cast<int>(std::floor(window.centre_px[axis] - half[axis]));
  };
  const auto last = [&](Eigen::Index axis) {
    return static_cast<int>(std::ceil(window.centre_px[axis] + half[axis]));
  };
  const LineBox box = LineBox{first(across), last(across), first(along), last(along)}.cut_to(
      line_box(linear, columns));
  if (box.lines() < 1 || box.length() < 1) return {};
  const std::vector<double> background = backgrounds(linear, box, columns);
  const int centre = static_cast<int>(std::lround(window.centre_px[across]));
  const bool coloured = sensor.mosaic != Mosaic::none;
  std::vector<float> row(static_cast<std::size_t>(box.length()));
  std::vector<LineLight> lines;
  for (int line = box.line0; line <= box.line1; ++line) {
    if (columns)
      linear.read(line, box.pos0, 1, box.length(), row.data());
    else
      linear.read(box.pos0, line, box.length(), 1, row.data());
    std::array<double, 3> sum{}, variance{};
    std::array<int, 3> count{};
    for (int i = 0; i < box.length(); ++i) {
      const int pos = box.pos0 + i;
      const std::size_t c =
          columns ? channel_of(sensor.mosaic, line, pos) : channel_of(sensor.mosaic, pos, line);
      const double value = row[i];
      sum[c] += value - background[static_cast<std::size_t>(line - box.line0)];
      variance[c] += variance_dn2(sensor, value);
      ++count[c];
    }
    for (int c = 0; c < (coloured ? 3 : 1); ++c) {
      const auto at = static_cast<std::size_t>(c);
      if (count[at] == 0) continue;
      lines.push_back(
          {line - centre, start_s + line * sensor.row_time_s, sum[at], std::sqrt(variance[at]), c});
    }
  }
  return lines;
}

std::vector<LightSample> light_samples(const std::vector<std::vector<LineLight>>& lines_by_frame,
                                       const Sensor& sensor) {
  constexpr double min_part = 0.15,
                   min_sigma = 3;       // min light of a line: of the brightest, of noise
  constexpr double model_sigma = 0.05;  // motion between lines, reflections
  std::map<Key, std::vector<double>> values;
  for (const auto& lines : lines_by_frame)
    for (const LineLight& light : lines) {
      values[{light.line, light.channel}].push_back(light.value_dn);
    }
  std::map<Key, double> lit;
  double brightest = 0;
  for (const auto& [key, seen] : values)
    brightest = std::max(brightest, lit[key] = lit_level(seen));
  std::vector<LightSample> samples;
  for (std::size_t f = 0; f < lines_by_frame.size(); ++f)
    for (const LineLight& light : lines_by_frame[f]) {
      const double level = lit[{light.line, light.channel}];
      if (!(level > min_part * brightest && level > min_sigma * light.sigma_dn)) continue;
      samples.push_back({light.start_s, sensor.exposure_s, light.value_dn / level,
                         std::hypot(light.sigma_dn / level, model_sigma), light.channel,
                         static_cast<int>(f)});
    }
  return samples;
}

}  // namespace occ
