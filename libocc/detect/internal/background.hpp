// SPDX-License-Identifier: Apache-2.0
// Internal: background level and noise of an image on a coarse mesh.
//
// Level and noise of a mesh are order statistics of 16 of its pixels, so that lamps up to about two
// meshes wide do not affect them after median filtering. Larger lamps are detected separately
// (bright_regions.cpp): a lamp so close to the camera that most meshes around it see only its
// light. Large areas with a smooth transition (a lit wall, the halo around a lamp) are background.
// A bright region has a sharp outline, and nothing inside is brighter than the region itself.
#pragma once

#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

/// Background of an image on a coarse mesh, row by row.
struct Meshes {
  int size_px = 0;
  int columns = 0, rows = 0;
  std::vector<float> level, noise;  ///< [grey levels]; noise: standard deviation of a pixel

  std::size_t count() const { return level.size(); }
};

class Background {
 public:
  /// Samples the image (valid view). The noise is at least that of `sensor` at the local level (if
  /// given), and at least floor_dn grey steps, because quantisation hides smaller noise, and
  /// min_noise_dn.
  Background(const ImageView& image, const Sensor* sensor, double min_noise_dn = 0);

  struct Local {
    double level_dn;
    double noise_dn;
  };

  /// Writes level and noise of the pixels x, x + step, ... of row y to all elements of `out`;
  /// bilinear interpolation between the centres of the meshes.
  void row(double y, double x, double step, std::vector<Local>& out) const;

  static constexpr double floor_dn = 0.5;

 private:
  Meshes meshes_;
};

/// Replaces level and noise of the meshes in and around bright regions by those of their
/// neighbours. A region must exceed the dark meshes by several times `min_noise_dn`.
void fill_bright_regions(const ImageView& image, double min_noise_dn, Meshes& meshes);

}  // namespace occ::internal::detect
