// SPDX-License-Identifier: Apache-2.0
// Lamps blink: a line of pixels gets the mean of the waveform over its exposure. Left out, a lamp
// shines with its waveform's mean; the largest difference over a line is at most
// max(w) - min(w) while the exposure is shorter than a period, else what of the last, begun period
// is left: at most (max(w) - min(w)) / 4 over the exposure in periods (the square wave of duty 1/2
// is the worst).
#include "libocc/simulate/internal/modulation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

// Light until a time, in periods from the beginning of a period.
double light_until(const Lamp& lamp, double periods) {
  const double whole = std::floor(periods), part = periods - whole;
  if (lamp.waveform.empty()) return whole * lamp.duty + std::min(part, lamp.duty);
  const auto steps = static_cast<double>(lamp.waveform.size());
  const auto full = static_cast<std::ptrdiff_t>(part * steps);
  const auto begin = lamp.waveform.begin();
  const double sum = std::accumulate(begin, begin + full, 0.0);
  const double begun = full < static_cast<std::ptrdiff_t>(lamp.waveform.size())
                           ? (part * steps - static_cast<double>(full)) * begin[full]
                           : 0;
  return whole * mean_light(lamp) + (sum + begun) / steps;
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  return std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); });
}

Bound bound(const View& view) {
  Bound bound;
  for (const LampView& seen : view.lamps) {
    const Lamp& lamp = *seen.lamp;
    if (!lamp.frequency_hz) continue;
    double low = 0, high = 1;
    if (!lamp.waveform.empty()) {
      low = *std::min_element(lamp.waveform.begin(), lamp.waveform.end());
      high = *std::max_element(lamp.waveform.begin(), lamp.waveform.end());
    } else if (lamp.duty == 1) {
      low = 1;
    }
    const double periods = *lamp.frequency_hz * view.scene.sensor.exposure_s;
    const double ripple = (high - low) * std::min(1.0, 0.25 / periods);
    // Stripes weigh one side of the lamp more than the other.
    const double mean = mean_light(lamp);
    const double shift =
        view.scene.sensor.row_time_s > 0 ? seen.radius_px * std::min(1.0, ripple / mean) : 0;
    bound.include({view.grey_levels(ripple * seen.peak_e), shift});
  }
  return bound;
}

}  // namespace

double mean_light(const Lamp& lamp) {
  if (!lamp.frequency_hz) return 1;
  if (lamp.waveform.empty()) return lamp.duty;
  return std::accumulate(lamp.waveform.begin(), lamp.waveform.end(), 0.0) /
         static_cast<double>(lamp.waveform.size());
}

double lit_fraction(const Lamp& lamp, double start_s, double exposure_s) {
  if (!lamp.frequency_hz) return 1;
  const double first = start_s * *lamp.frequency_hz + lamp.phase;
  const double begin = first - std::floor(first);
  const double length = exposure_s * *lamp.frequency_hz;
  return std::clamp((light_until(lamp, begin + length) - light_until(lamp, begin)) / length, 0.0,
                    1.0);
}

std::vector<double> lit_fractions(const Lamp& lamp, const Frame& frame) {
  const Sensor& sensor = frame.scene.sensor;
  const Camera& camera = frame.scene.camera;
  const int lines = sensor.readout == Readout::columns ? camera.width() : camera.height();
  std::vector<double> fractions(static_cast<std::size_t>(lines), mean_light(lamp));
  if (!frame.plan.applies(Effect::modulation)) return fractions;
  for (int i = 0; i < lines; ++i)
    fractions[static_cast<std::size_t>(i)] =
        lit_fraction(lamp, frame.options.start_s + i * sensor.row_time_s, sensor.exposure_s);
  return fractions;
}

const EffectModel modulation_model{"a lamp's frequency_hz", called_for, bound};

}  // namespace occ
