// SPDX-License-Identifier: Apache-2.0
// Images painted from closed forms, and blobs as lists of numbers, for the reference tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/detect/detect.hpp"
#include "tests/support/references.hpp"

namespace occ::test {

enum class PaintedShape { ellipse, gaussian, rectangle, ring, triangle, hexagon };

struct PaintedLamp {
  PaintedShape shape = PaintedShape::ellipse;
  Eigen::Vector2d centre{100, 100};
  Eigen::Vector2d semi{10, 10};  ///< semi-axes, deviations of a Gaussian, half sides
  double angle_rad = 0;
  double level_dn = 100;
  Eigen::Vector2d gradient{0, 0};  ///< gradient of the light over the level [1/px]
  Eigen::Vector3d colour{1, 1, 1};
  double frequency_hz = 0, phase = 0, duty = 0.5, depth = 1;
};

struct PaintedImage {
  int width = 240, height = 180, channels = 1;
  std::vector<PaintedLamp> lamps;
  double blur_px = 0.85;
  double background_dn = 3;
  Eigen::Vector2d background_slope{0, 0};  ///< [DN / px]
  double haze_dn = 0;                      ///< glow in the middle of the image
  Sensor sensor;
};

/// Even number between limits, whose logarithm is even.
inline double log_even(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}
inline bool chance(Random& random, double probability) { return random.uniform() < probability; }

inline double blurred_edge(double outside_px, double blur_px) {
  return 0.5 * std::erfc(outside_px / (std::sqrt(2.0) * blur_px));
}

/// Light of a lamp at a pixel over its level.
inline double painted_light(const PaintedLamp& lamp, double blur_px, const Eigen::Vector2d& at) {
  const double c = std::cos(lamp.angle_rad), s = std::sin(lamp.angle_rad);
  const Eigen::Vector2d off = at - lamp.centre;
  const Eigen::Vector2d d(c * off.x() + s * off.y(), -s * off.x() + c * off.y());
  const Eigen::Vector2d q = d.cwiseQuotient(lamp.semi);
  const double even = std::max(0.0, 1 + lamp.gradient.dot(off));
  const auto of_ellipse = [&](double scale) {
    const double r = q.norm();
    const double slope = q.cwiseQuotient(lamp.semi).norm() / std::max(r, 1e-9);
    return blurred_edge((r - scale) / std::max(slope, 1e-9), blur_px);
  };
  const auto of_sides = [&](int sides) {
    double product = 1;
    for (int k = 0; k < sides; ++k) {
      const double a = 2 * pi * k / sides;
      product *=
          blurred_edge(d.dot(Eigen::Vector2d(std::cos(a), std::sin(a))) - lamp.semi.x(), blur_px);
    }
    return product;
  };
  switch (lamp.shape) {
    case PaintedShape::gaussian:
      return even * std::exp(-0.5 * q.squaredNorm());
    case PaintedShape::rectangle:
      return even * blurred_edge(std::abs(d.x()) - lamp.semi.x(), blur_px) *
             blurred_edge(std::abs(d.y()) - lamp.semi.y(), blur_px);
    case PaintedShape::ring:
      return even * (of_ellipse(1) - of_ellipse(0.6));
    case PaintedShape::triangle:
      return even * of_sides(3);
    case PaintedShape::hexagon:
      return even * of_sides(6);
    case PaintedShape::ellipse:
      break;
  }
  return even * of_ellipse(1);
}

/// Mean light of a blinking lamp over the exposure of a line.
inline double painted_lit(const PaintedLamp& lamp, const Sensor& sensor, int line) {
  if (!(lamp.frequency_hz > 0)) return 1;
  const auto until = [&](double time_s) {
    const double cycles = time_s * lamp.frequency_hz + lamp.phase, whole = std::floor(cycles);
    return (whole * lamp.duty + std::min(cycles - whole, lamp.duty)) / lamp.frequency_hz;
  };
  const double begin_s = line * sensor.row_time_s;
  const double lit = (until(begin_s + sensor.exposure_s) - until(begin_s)) / sensor.exposure_s;
  return 1 - lamp.depth + lamp.depth * lit;
}

inline double stored_level(const Sensor& sensor, double signal_dn) {
  const double full = sensor.full_scale_dn();
  const double part = std::clamp((signal_dn) / (full - sensor.black_level_dn), 0.0, 1.0);
  double stored = part;
  if (sensor.response == Response::srgb)
    stored = part <= 0.0031308 ? 12.92 * part : 1.055 * std::pow(part, 1 / 2.4) - 0.055;
  if (sensor.response == Response::gamma) stored = std::pow(part, 1 / sensor.gamma);
  if (sensor.response == Response::linear) stored = signal_dn / (full - sensor.black_level_dn);
  return std::clamp(std::round(sensor.black_level_dn + stored * (full - sensor.black_level_dn)),
                    0.0, full);
}

/// The image, with shot and read noise of the sensor.
inline Image painted(const PaintedImage& painting, Random& random) {
  const auto size = static_cast<std::size_t>(painting.width * painting.height);
  const auto channels = static_cast<std::size_t>(painting.channels);
  std::vector<double> signal(size * channels, 0.0);
  for (int y = 0; y < painting.height; ++y)
    for (int x = 0; x < painting.width; ++x)
      for (std::size_t k = 0; k < channels; ++k) {
        const Eigen::Vector2d off(x - 0.5 * painting.width, y - 0.5 * painting.height);
        signal[static_cast<std::size_t>(y * painting.width + x) * channels + k] =
            painting.background_dn + painting.background_slope.dot(off) +
            painting.haze_dn * std::exp(-0.5 * off.squaredNorm() / square(0.3 * painting.height));
      }
  for (const PaintedLamp& lamp : painting.lamps) {
    const bool is_gaussian = lamp.shape == PaintedShape::gaussian;
    const double reach = (is_gaussian ? 6 : 2.1) * lamp.semi.maxCoeff() + 6 * painting.blur_px;
    const auto first = [&](double centre) {
      return std::max(0, static_cast<int>(std::floor(centre - reach)));
    };
    const auto end = [&](double centre, int count) {
      return std::min(count, static_cast<int>(std::ceil(centre + reach)));
    };
    const bool columns = painting.sensor.readout == Readout::columns;
    for (int y = first(lamp.centre.y()); y < end(lamp.centre.y(), painting.height); ++y)
      for (int x = first(lamp.centre.x()); x < end(lamp.centre.x(), painting.width); ++x) {
        const double light = lamp.level_dn * painted_lit(lamp, painting.sensor, columns ? x : y) *
                             painted_light(lamp, painting.blur_px, Eigen::Vector2d(x, y));
        for (std::size_t k = 0; k < channels; ++k)
          signal[static_cast<std::size_t>(y * painting.width + x) * channels + k] +=
              light * (channels >= 3 && k < 3 ? lamp.colour[static_cast<Eigen::Index>(k)] : 1);
      }
  }
  const Sensor& sensor = painting.sensor;
  Image image;
  image.width = painting.width;
  image.height = painting.height;
  image.channels = painting.channels;
  image.type = sensor.bit_depth > 8 ? PixelType::u16 : PixelType::u8;
  const double full_well_dn = sensor.full_well_e * sensor.gain_dn_per_e;
  for (const double mean : signal) {
    const double read = sensor.read_noise_e * sensor.gain_dn_per_e;
    const double clipped = std::clamp(mean, 0.0, full_well_dn);
    const double noise = std::sqrt(read * read + sensor.gain_dn_per_e * clipped) * random.normal();
    const double level = stored_level(sensor, clipped + noise);
    if (image.type == PixelType::u8)
      image.u8.push_back(static_cast<std::uint8_t>(level));
    else
      image.u16.push_back(static_cast<std::uint16_t>(level));
  }
  return image;
}

/// Sensor with 8, 12 or 16 bits.
inline Sensor random_painted_sensor(Random& random) {
  Sensor sensor;
  const int bits[] = {8, 8, 12, 16};
  sensor.bit_depth = bits[random.below(4)];
  const double unit = sensor.full_scale_dn() / 255;
  sensor.gain_dn_per_e = unit * log_even(random, 0.005, 0.1);
  sensor.read_noise_e = unit * random.uniform(0.3, 2) / sensor.gain_dn_per_e;
  sensor.black_level_dn = unit * random.below(8);
  sensor.full_well_e = sensor.full_scale_dn() / sensor.gain_dn_per_e * random.uniform(0.9, 3);
  sensor.psf_sigma_px = 0.8;
  if (chance(random, 0.15)) sensor.response = Response::srgb;
  if (chance(random, 0.15)) sensor.response = Response::gamma;
  return sensor;
}

/// Adds all numbers of the blobs. Each attribute is summarised over the blobs, so that a change of
/// a small number is visible beside large ones.
inline void add_blobs(CaseResults& results, const std::vector<Blob>& blobs) {
  std::vector<double> centre, sigma, response, flux, levels, pixels, ellipse, rim, rim_sigma,
      common, corners, frequency, colour;
  for (const Blob& b : blobs) {
    centre.insert(centre.end(), {b.centroid_px.x(), b.centroid_px.y()});
    const double across = b.covariance_px2(0, 1);
    sigma.insert(sigma.end(), {std::sqrt(b.covariance_px2(0, 0)), std::sqrt(b.covariance_px2(1, 1)),
                               std::copysign(std::sqrt(std::abs(across)), across)});
    for (const double value : b.light_response_px2.reshaped()) response.push_back(value);
    flux.insert(flux.end(), {std::log1p(std::abs(b.flux_dn)), std::log1p(b.flux_sigma_dn)});
    levels.insert(levels.end(), {b.peak_dn, b.background_dn, b.noise_dn});
    for (const int value : {b.area_px, b.x0, b.y0, b.x1, b.y1}) pixels.push_back(value);
    for (const bool flag : {b.saturated, b.merged, b.cut_by_border, b.patterned, b.striped})
      pixels.push_back(flag ? 100 : 0);
    const double a = b.ellipse.semi_major_px, c = b.ellipse.semi_minor_px;
    ellipse.insert(ellipse.end(), {b.ellipse.centre_px.x(), b.ellipse.centre_px.y(), a, c,
                                   (a - c) * std::cos(2 * b.ellipse.angle_rad),
                                   (a - c) * std::sin(2 * b.ellipse.angle_rad)});
    for (const RimPoint& p : b.rim) {
      const Eigen::Vector2d off = p.px - b.centroid_px;
      rim.insert(rim.end(), {off.x(), off.y(), 10 * p.normal.x(), 10 * p.normal.y()});
      rim_sigma.push_back(p.sigma_px);
    }
    for (const double value : b.rim_covariance_px2.reshaped()) common.push_back(value);
    for (const Eigen::Vector2d& corner : b.corners_px)
      for (const double value : corner - b.centroid_px) corners.push_back(value);
    if (b.frequency_hz)
      frequency.insert(frequency.end(), {1e-2 * *b.frequency_hz, b.frequency_sigma_hz});
    if (!b.colour) continue;
    for (const double value : b.colour->share) colour.push_back(value);
    for (const double value : b.colour->sigma) colour.push_back(value);
    for (const bool clipped : b.colour->clipped) colour.push_back(clipped ? 1 : 0);
  }
  results.summarise("centre", centre);
  results.summarise("sigma", sigma);
  results.summarise("response", response);
  results.summarise("flux", flux);
  results.summarise("levels", levels);
  results.summarise("pixels", pixels);
  results.summarise("ellipse", ellipse);
  if (!rim.empty()) {
    results.summarise("rim", rim);
    results.summarise("rim_sigma", rim_sigma);
    results.summarise("common", common);
  }
  if (!corners.empty()) results.summarise("corners", corners);
  if (!frequency.empty()) results.summarise("frequency", frequency);
  if (!colour.empty()) results.summarise("colour", colour);
}

inline CaseResults results_of(const std::vector<Blob>& blobs) {
  CaseResults results;
  add_blobs(results, blobs);
  return results;
}

}  // namespace occ::test
