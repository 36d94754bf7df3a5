// SPDX-License-Identifier: Apache-2.0
// Blooming: charge beyond the full well overflows into the neighbours in the column. Of the mean
// charge beyond the full well, the fraction `blooming` leaves the pixel, half up and half down. It
// fills each pixel that it reaches up to the full well and moves on; charge that reaches the border
// is lost. Where both directions fill the same pixel, the downward charge is placed first.
//
// Without the effect, nothing changes unless a pixel exceeds the full well. Otherwise a pixel
// changes by at most half of all overflow, and at most by a full well. The bound of a centroid is
// twice the distance that the charge travels. Symmetric images keep their centroids, far below this
// bound.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace blooming_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.sensor.blooming > 0; }

Bound bound(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  const double base_e = sensor.electrons(0) + background_electrons(view);
  const double max_e = base_e + max_lamp_electrons(view);
  double spilled = 0, radius = 0;
  for (const LampView& seen : view.lamps) radius = std::max(radius, seen.radius_px);
  if (!(max_e > sensor.full_well_e)) return {};
  const double beyond = 1 - sensor.full_well_e / max_e;  // largest fraction of a lamp's light
  for (const LampView& seen : view.lamps)
    spilled += 0.5 * sensor.blooming * beyond * seen.electrons;
  const double room = sensor.full_well_e - base_e;
  const double blur = 3 * sensor.psf_sigma_px + 1;
  // Overflow of one column of pixels, over the full height of the largest lamp.
  const double column_e =
      0.5 * sensor.blooming * (max_e - sensor.full_well_e) * 2 * (radius + blur);
  const double distance = radius + blur + column_e / std::max(room, 1e-9 * sensor.full_well_e);
  const double height = 0.5 * view.scene.camera.height();
  return {view.grey_levels(std::min(spilled, sensor.full_well_e)), 2 * std::min(distance, height)};
}

// Charge of one column, carried along y, y + step, ...
class Column {
 public:
  Column(const Frame& frame, Signal& signal, int x) : signal_(signal), x_(x) {
    const Sensor& sensor = frame.scene.sensor;
    full_well_e_ = sensor.full_well_e;
    spilled_ = 0.5 * sensor.blooming;
    for (int odd = 0; odd < 2; ++odd)
      base_e_[odd] = sensor.electrons(0) + signal.everywhere()[place_of(x, odd)];
  }

  bool overflows(int y) const { return excess(y) > 0; }

  // Carries the overflow from `first` to `last` at least, and on while charge is left. Returns the
  // last pixel reached.
  int run(int first, int last, int step) {
    double carried = 0;
    int y = first;
    for (bool passed = false; y >= 0 && y < signal_.height(); y += step) {
      const double beyond = excess(y);
      if (beyond > 0) {
        carried += spilled_ * beyond;
      } else {
        const double taken = std::min(carried, -beyond);
        signal_.row(y)[x_] += taken;
        carried -= taken;
      }
      passed = passed || y == last;
      if (passed && !(carried > 0)) return y;
    }
    return y - step;
  }

 private:
  double excess(int y) const { return base_e_[y & 1] + signal_.row(y)[x_] - full_well_e_; }

  Signal& signal_;
  int x_;
  double full_well_e_, spilled_, base_e_[2];
};

void render(const Frame& frame, const ByPlace&, Signal& signal) {
  struct Overflow {
    int first = -1, last = -1;
  };
  std::vector<Overflow> columns(static_cast<std::size_t>(signal.width()));
  signal.for_touched([&](int x0, int y, int count) {
    for (int x = x0; x < x0 + count; ++x) {
      if (!Column(frame, signal, x).overflows(y)) continue;
      Overflow& column = columns[x];
      if (column.first < 0) column.first = y;
      column.last = y;
    }
  });
  for (int x = 0; x < signal.width(); ++x) {
    const Overflow& overflow = columns[x];
    if (overflow.first < 0) continue;
    Column column(frame, signal, x);
    const int bottom = column.run(overflow.first, overflow.last, 1);
    const int top = column.run(overflow.last, overflow.first, -1);
    signal.touch({x, top, 1, bottom - top + 1});
  }
}

}  // namespace
}  // namespace blooming_effect

Bound max_spill(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  if (!(sensor.blooming > 0) || view.scene.effects.of(Effect::blooming) == Use::off) return {};
  // Without blur, all light of a point lamp may be in one pixel.
  double max_e = sensor.electrons(0) + background_electrons(view), electrons = 0;
  for (const LampView& seen : view.lamps) {
    max_e += seen.rim_px.empty() ? seen.electrons : std::max(seen.full_e, seen.peak_e);
    electrons += seen.electrons;
  }
  if (!(max_e > sensor.full_well_e)) return {};
  const double spilled = 0.5 * sensor.blooming * electrons;
  return {view.grey_levels(std::min(spilled, sensor.full_well_e)),
          view.scene.camera.height() * 1.0};
}

const EffectModel blooming_model = [] {
  EffectModel model{Effect::blooming, Stage::output, blooming_effect::called_for,
                    "sensor.blooming is 0", blooming_effect::bound};
  model.required = Effect::saturation;
  model.render = blooming_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
