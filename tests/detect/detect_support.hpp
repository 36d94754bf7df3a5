// SPDX-License-Identifier: Apache-2.0
// Images of spots and discs for the tests of detection, rendered independently of the library.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::test {

/// Mean signal [e] of every pixel. Light is added to it, then noise converts it to an image.
class Canvas {
 public:
  Canvas(int width, int height, double background_e = 0)
      : width_(width),
        electrons_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                   background_e) {}

  int height() const { return static_cast<int>(electrons_.size()) / width_; }
  double& at(int x, int y) {
    return electrons_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(x)];
  }

  void add_spot(const Eigen::Vector2d& px, double sigma_px, double flux_e) {
    add(point_coverage(px, sigma_px, width_, height()), flux_e);
  }

  /// Adds the inside of a closed outline.
  void add(const std::vector<Eigen::Vector2d>& outline_px, double psf_px, double level_e) {
    add(coverage(outline_px, psf_px, width_, height()), level_e);
  }

  /// Adds an ellipse whose major axis is rotated by angle_rad.
  void add_disc(const Eigen::Vector2d& px, double semi_major_px, double semi_minor_px,
                double angle_rad, double psf_px, double level_e) {
    std::vector<Eigen::Vector2d> rim;
    const int count = 64 + static_cast<int>(20 * semi_major_px / psf_px);
    for (int i = 0; i < count; ++i) {
      const double t = 2 * pi * i / count;
      const double u = semi_major_px * std::cos(t), v = semi_minor_px * std::sin(t);
      rim.push_back(px + Eigen::Vector2d(u * std::cos(angle_rad) - v * std::sin(angle_rad),
                                         u * std::sin(angle_rad) + v * std::cos(angle_rad)));
    }
    add(rim, psf_px, level_e);
  }

  struct Noise {
    double gain_dn_per_e = 0.05;
    double read_e = 5;
    double black_dn = 5;
    int full_scale_dn = 255;
  };

  /// Image with 8 bits, or 16 bits if the full scale requires it. `random` null: without noise.
  Image image(const Noise& noise, Random* random) const {
    Image out;
    out.width = width_;
    out.height = height();
    const bool wide = noise.full_scale_dn > 255;
    out.type = wide ? PixelType::u16 : PixelType::u8;
    for (const double mean_e : electrons_) {
      const double e =
          random ? random->poisson(std::max(0.0, mean_e)) + noise.read_e * random->normal()
                 : mean_e;
      const double dn = std::round(noise.black_dn + noise.gain_dn_per_e * e);
      const double clipped = std::min<double>(noise.full_scale_dn, std::max(0.0, dn));
      if (wide)
        out.u16.push_back(static_cast<std::uint16_t>(clipped));
      else
        out.u8.push_back(static_cast<std::uint8_t>(clipped));
    }
    return out;
  }

  /// Sensor with this noise.
  static Sensor sensor(const Noise& noise, double psf_px) {
    Sensor sensor;
    sensor.gain_dn_per_e = noise.gain_dn_per_e;
    sensor.read_noise_e = noise.read_e;
    sensor.black_level_dn = noise.black_dn;
    sensor.bit_depth = noise.full_scale_dn > 255 ? 16 : 8;
    sensor.full_well_e = 2 * sensor.full_scale_dn() / noise.gain_dn_per_e;
    sensor.psf_sigma_px = psf_px;
    sensor.response = Response::linear;
    return sensor;
  }

 private:
  void add(const Patch& patch, double scale) {
    for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
      for (int x = patch.x0; x < patch.x0 + patch.width; ++x) at(x, y) += scale * patch.at(x, y);
  }

  int width_;
  std::vector<double> electrons_;
};

}  // namespace occ::test
