// SPDX-License-Identifier: Apache-2.0
// Internal: background level and noise of an image on a coarse mesh, from few pixels and their
// order statistics: lamps up to about two meshes wide leave no trace in it, larger ones are looked
// for.
#pragma once

#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/detect/internal/bright_bodies.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

class Background {
 public:
  /// Samples the image (valid view). The noise is at least that of `sensor` at the local level when
  /// there is one, and at least floor_dn grey steps, which stands for what quantisation hides.
  Background(const ImageView& image, const Sensor* sensor);

  struct Local {
    double level_dn;
    double noise_dn;
  };

  /// Level and noise of pixels x, x + step, ... of row y, as many as `out` holds: bilinear between
  /// the meshes' centres.
  void row(double y, double x, double step, std::vector<Local>& out) const;

  static constexpr double floor_dn = 0.5;

 private:
  Meshes meshes_;
};

}  // namespace occ::internal::detect
