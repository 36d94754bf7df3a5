// SPDX-License-Identifier: Apache-2.0
// The camera as a light meter: from irradiance on a pixel to its grey level.
//
//   electrons  mu = QE E s^2 t / (h nu) + I_dark t
//   grey level DN = black + R response(K mu / R), mu clipped at full well and DN at full scale,
//   then
//              rounded; R = full scale - black
//   noise      sigma_DN^2 = K^2 (sigma_read^2 + mu) + 1/12      (EMVA 1288, release 4.0, eq (11))
//
// `K` is the gain in grey levels per electron of the linear signal.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ {

/// Mapping from the linear to the stored signal, both 0..1 from black level to full scale.
enum class Response {
  automatic,  ///< srgb for 8-bit images with three colours, else linear
  linear,     ///< grey level proportional to the signal
  gamma,      ///< power law with the exponent 1 / gamma
  srgb,       ///< curve of IEC 61966-2-1
  table,      ///< values of response_table, interpolated
};

/// Colour filter array: colours of the first two pixels of the first row, then of the second row.
enum class Mosaic {
  none,  ///< no filters, or an image already converted to colours
  rggb,  ///< red, green / green, blue
  grbg,  ///< green, red / blue, green
  gbrg,  ///< green, blue / red, green
  bggr,  ///< blue, green / green, red
};

/// Pixels of one colour: values that differ from those of the sensor.
struct Channel {
  double efficiency = 1;                 ///< factor on quantum_efficiency
  Response response = Response::linear;  ///< replaces Sensor::response
  double gamma = 2.2;                    ///< replaces Sensor::gamma
  std::vector<double> response_table;    ///< replaces Sensor::response_table
};

/// Pixels that a rolling shutter exposes together.
enum class Readout {
  rows,     ///< image rows, top to bottom: stripes are horizontal
  columns,  ///< image columns (a rotated image), left to right: stripes are vertical
  unknown,  ///< estimated from the stripes
};

/// An image sensor with its lens opening and exposure.
struct LIBOCC_API Sensor {
  double pixel_pitch_m = 7.1e-6;  ///< distance of neighbouring pixels
  double f_number = 2.0;          ///< focal length over the diameter of the lens opening
  double exposure_s = 2e-5;  ///< a 1.5 W, 170 mm lamp then fills about half the default full well
  double quantum_efficiency = 0.5;  ///< electrons per photon, 0 to 1
  double wavelength_m = 550e-9;     ///< at which QE holds; photon energy is h c / wavelength
  double full_well_e = 10000;       ///< charge at which a pixel saturates [electrons]
  double gain_dn_per_e = 0.025;     ///< K
  double read_noise_e = 10;         ///< standard deviation [electrons]
  double dark_current_e_per_s = 0;  ///< per pixel [electrons/s]
  double black_level_dn = 2;        ///< grey level without light
  int bit_depth = 8;                ///< 8 to 16; more than 8 makes 16-bit images
  Response response = Response::automatic;  ///< mapping from the linear to the stored signal
  double gamma = 2.2;                       ///< for Response::gamma: stored = linear^(1/gamma)
  std::vector<double>
      response_table;     ///< for Response::table: stored values at evenly spaced linear ones
  double row_time_s = 0;  ///< time from one row to the next; 0 for a global shutter
  Readout readout = Readout::rows;  ///< direction of a rolling shutter
  double psf_sigma_px =
      0.8;                ///< Gaussian blur of lens and pixel diffusion, without the pixel's box
  double gain_sigma = 0;  ///< relative standard deviation of the pixels' gains (PRNU)
  int gain_seed = 0;      ///< seed of the pixels' gains
  double blooming = 0;    ///< part of the charge beyond the full well that spills up and down the
                          ///< column; the rest is drained
  Mosaic mosaic = Mosaic::none;   ///< colour filters of a raw image
  std::vector<Channel> channels;  ///< red, green, blue of a mosaic; empty: all equal

  /// True unless a curve is stated.
  bool is_linear() const { return response == Response::linear || response == Response::automatic; }
  /// The sensor with the response that `automatic` stands for in an image.
  Sensor of_image(const ImageView& image) const;

  /// Largest grey level, 2^bit_depth - 1.
  double full_scale_dn() const { return static_cast<double>((1 << bit_depth) - 1); }

  /// Mean number of electrons of a pixel, before clipping; includes dark current.
  double electrons(double irradiance_w_m2) const;

  /// Grey level for a mean number of electrons, clipped, not rounded.
  double grey_level(double electrons) const;

  /// Linear signal [DN, black level removed] of a stored grey level: inverse of the response. Grey
  /// levels below black give negative signals.
  double linear_dn(double grey_level) const;

  /// Standard deviation of the grey level for a mean number of electrons (linear response).
  double noise_dn(double electrons) const;

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

}  // namespace occ
