// SPDX-License-Identifier: Apache-2.0
// Modulation: lamps blink, and a line of pixels receives the mean of the waveform over its
// exposure. Without the effect, a lamp shines with the mean of its waveform. The difference is
// computed exactly from the waveform. For a square wave of frequency f and duty D and an exposure T
// it is at most min({fT}, 1 - {fT}, D, 1 - D) / (fT), with {} the fractional part.
//
// If lines differ, the lines on one side of a lamp may receive r more than the mean m, and those
// on the other side r less. The centroid then moves by up to 0.7 R r / (m - r), with 0.7 R the mean
// distance from the middle.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace modulation_effect {
namespace {

// Integral of the light from the beginning of a period to a time in periods.
double light_until(const Lamp& lamp, double periods) {
  const double whole = std::floor(periods), part = periods - whole;
  if (lamp.waveform.empty()) return whole * lamp.duty + std::min(part, lamp.duty);
  const auto steps = static_cast<double>(lamp.waveform.size());
  const auto full = static_cast<std::ptrdiff_t>(part * steps);
  const auto begin = lamp.waveform.begin();
  const double sum = std::accumulate(begin, begin + full, 0.0);
  const double partial = full < static_cast<std::ptrdiff_t>(lamp.waveform.size())
                             ? (part * steps - static_cast<double>(full)) * begin[full]
                             : 0;
  return whole * lamp.mean_light() + (sum + partial) / steps;
}

// Integrals of the light and of its products with the time and the squared time, counted from the
// middle of the interval.
struct PieceSums {
  double light = 0, first = 0, second = 0;
};
PieceSums sum_pieces(const Lamp& lamp, double begin_s, double length_s) {
  const double period_s = 1 / *lamp.frequency_hz;
  const double start = begin_s * *lamp.frequency_hz + lamp.phase;
  const double offset_s = (start - std::floor(start)) * period_s;
  const auto steps = lamp.waveform.size();
  PieceSums sums;
  const auto add = [&](double from_s, double to_s,
                       double level) {  // from the beginning of a period
    const double a = std::clamp(from_s - offset_s, 0.0, length_s) - 0.5 * length_s;
    const double b = std::clamp(to_s - offset_s, 0.0, length_s) - 0.5 * length_s;
    sums.light += level * (b - a);
    sums.first += level * (b * b - a * a) / 2;
    sums.second += level * (b * b * b - a * a * a) / 3;
  };
  for (double period = 0; period * period_s < offset_s + length_s; ++period) {
    const double at = period * period_s;
    if (steps == 0) add(at, at + lamp.duty * period_s, 1);
    for (std::size_t i = 0; i < steps; ++i)
      add(at + period_s * static_cast<double>(i) / static_cast<double>(steps),
          at + period_s * static_cast<double>(i + 1) / static_cast<double>(steps),
          lamp.waveform[i]);
  }
  return sums;
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  return std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); });
}

// Largest difference between the mean light over an interval of `periods` periods and the mean over
// whole periods. As a function of the interval's start the difference is piecewise linear, with its
// extremes where the interval begins or ends at a step of the waveform.
double max_ripple(const Lamp& lamp, double periods) {
  std::vector<double> steps{0, lamp.duty};
  if (!lamp.waveform.empty()) {
    const std::size_t count = lamp.waveform.size();
    steps.clear();
    for (std::size_t i = 0; i < count; ++i)
      steps.push_back(static_cast<double>(i) / static_cast<double>(count));
  }
  double ripple = 0;
  for (const double step : steps)
    for (const double back : {0.0, periods}) {
      const double begin = step - back - std::floor(step - back);
      const double light = light_until(lamp, begin + periods) - light_until(lamp, begin);
      ripple = std::max(ripple, std::abs(light / periods - lamp.mean_light()));
    }
  return ripple;
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  const Lamp& lamp = *seen.lamp;
  if (!lamp.frequency_hz) return {};
  const Sensor& sensor = view.scene.sensor;
  const double ripple = max_ripple(lamp, *lamp.frequency_hz * sensor.exposure_s);
  if (!(sensor.row_time_s > 0)) return {ripple * seen.peak_e, 0};
  const double radius = seen.radius_px + blur_width_px(seen, view) + 0.5;
  const double min_light = lamp.mean_light() - ripple;
  const double shift = min_light > 0 ? std::min(1.0, 0.7 * ripple / min_light) : 1;
  return {ripple * seen.peak_e, shift * radius};
}

Bound bound(const SceneView& view) { return sum_of_overlapping(view, bound_of); }

}  // namespace
}  // namespace modulation_effect

double lit_fraction(const Lamp& lamp, double start_s, double exposure_s) {
  if (!lamp.frequency_hz) return 1;
  const double first = start_s * *lamp.frequency_hz + lamp.phase;
  const double begin = first - std::floor(first);
  const double length = exposure_s * *lamp.frequency_hz;
  return std::clamp((modulation_effect::light_until(lamp, begin + length) -
                     modulation_effect::light_until(lamp, begin)) /
                        length,
                    0.0, 1.0);
}

LightMoments light_moments(const Lamp& lamp, bool blinks, double begin_s, double length_s) {
  LightMoments light{lamp.mean_light(), 0.5 * length_s, length_s * std::sqrt(1.0 / 12)};
  if (!lamp.frequency_hz || !blinks) return light;
  light.mean = lit_fraction(lamp, begin_s, length_s);
  // Over so many periods the light is even to 1e-3 of the interval.
  if (length_s * *lamp.frequency_hz > 1000) return light;
  const modulation_effect::PieceSums sums = modulation_effect::sum_pieces(lamp, begin_s, length_s);
  if (!(sums.light > 0)) return light;
  const double mean = sums.first / sums.light;
  light.mean_time_s = 0.5 * length_s + mean;
  light.sigma_s = std::sqrt(std::max(0.0, sums.second / sums.light - mean * mean));
  return light;
}

std::vector<double> lit_fractions(const Lamp& lamp, const Frame& frame, int first, int count) {
  const Sensor& sensor = frame.scene.sensor;
  std::vector<double> fractions(static_cast<std::size_t>(count), 1);
  if (!lamp.frequency_hz || Motion(frame).kind(lamp) != Motion::Kind::still) return fractions;
  std::fill(fractions.begin(), fractions.end(), lamp.mean_light());
  if (!frame.plan.applies(Effect::modulation)) return fractions;
  for (int i = 0; i < count; ++i)
    fractions[i] = lit_fraction(lamp, frame.options.start_s + (first + i) * sensor.row_time_s,
                                sensor.exposure_s);
  return fractions;
}

const EffectModel modulation_model{Effect::modulation, Stage::lamp_image,
                                   modulation_effect::called_for, "no lamp has a frequency_hz",
                                   modulation_effect::bound};

}  // namespace occ::internal::simulate
