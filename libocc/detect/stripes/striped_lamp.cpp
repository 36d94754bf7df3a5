// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/striped_lamp.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/stripe_demodulation.hpp"

namespace occ::internal::detect {
namespace {

constexpr double usual_knee = 0.1;   // of the logarithm that compresses a signal, of its highest
constexpr double distant_knee = 10;  // hardly compresses

/// The blink with its stripes equally high. A disc's lines are equally bright as they are. A glow
/// is never quite as the model says: what is left of its fall-off would pull the stripes together,
/// less so when the signal is compressed by a logarithm.
LineSignal flattened(LineSignal signal, const StripedShape& shape, double cycles_per_line,
                     double knee) {
  if (shape.kind != StripedShape::Kind::glow) return signal;
  const double highest = *std::max_element(signal.value.begin(), signal.value.end());
  for (double& value : signal.value) value = std::log1p(std::max(0.0, value) / (knee * highest));
  return levelled(signal, 0.4 / cycles_per_line);
}

Blink fit_demodulated(const LineSignal& signal, const StripedShape& shape, const Blink& coarse,
                      const LampLimits& limits) {
  if (shape.kind != StripedShape::Kind::glow) {
    // Level as it is, this signal shows even a weak line that the coarse one hides.
    const double f = strongest_line(signal, limits.max_cycles_per_line);
    return f > 0 ? fit_blink(signal, f, 1) : Blink{};
  }
  const double f = coarse.cycles_per_line;
  Blink blink = fit_blink(flattened(signal, shape, f, usual_knee), f, 2);
  if (!(blink.cycles_per_line > 0)) return blink;
  const Blink other = fit_blink(flattened(signal, shape, f, distant_knee), f, 2);
  // A stripe's centre in a glow is uncertain by the model; the slope of n of them over L lines is
  // then by sqrt(12 / n) / L.
  constexpr double stripe_sigma_lines = 0.15;
  const double lines = blink.periods / blink.cycles_per_line;
  const double of_model = stripe_sigma_lines * blink.cycles_per_line *
                          std::sqrt(12 / std::max(1.0, blink.periods)) / lines;
  blink.sigma = std::hypot(blink.sigma, other.cycles_per_line - blink.cycles_per_line, of_model);
  return blink;
}

/// Natural structure (window bars, shelves) seldom continues in step across the whole body.
bool same_on_both_sides(const LineWindow& window, const StripedShape& shape, const Blink& blink,
                        double clipped) {
  std::complex<double> side[2];
  for (int i = 0; i < 2; ++i) {
    const LineSignal half =
        demodulated_signal(window, shape, clipped, i == 0 ? Side::low : Side::high);
    const double f = blink.cycles_per_line;
    side[i] = amplitude_at(flattened(half, shape, f, usual_knee), f) *
              std::polar(1.0, 6.283185307179586 * f * half.line0);
  }
  return std::abs(side[0] - side[1]) < 0.25 * std::abs(side[0] + side[1]);
}

/// F is over a variance that counts the correlation of what is left, so 6 is far beyond chance;
/// structure of other kinds leaves more than 30 % unexplained.
bool significant(const Blink& blink, const StripedShape& shape) {
  return blink.periods >= 2 * dependable_part(shape) && blink.f_test > 6 && blink.explained > 0.7 &&
         blink.amplitude() > 0.05 * std::abs(blink.mean);
}

/// Signal and number of the lit pixels within the outline (a little wider, for its blur).
void add_light(const LineWindow& window, double lit, StripedLamp& lamp) {
  const OutlineChords chords(lamp.shape, 1.1);
  for (int line = window.box.line0; line <= window.box.line1; ++line) {
    const OutlineChords::Chord chord = chords.at(line);
    const int to = window.sample_from(chord.middle + chord.half);
    const float* signal = window.line(line);
    for (int i = window.sample_from(chord.middle - chord.half); i < to; ++i) {
      if (!(signal[i] > lit)) continue;
      lamp.signal += static_cast<double>(signal[i]) * window.stride;
      lamp.lit_px += window.stride;
    }
  }
}

/// Dark lines between lit ones.
bool has_gaps(const LineSignal& signal) {
  const double highest = *std::max_element(signal.value.begin(), signal.value.end());
  const auto lit = [&](double value) { return value > 0.5 * highest; };
  const auto dark = [&](double value) { return value < 0.2 * highest; };
  const auto first = std::find_if(signal.value.begin(), signal.value.end(), lit);
  const auto last = std::find_if(signal.value.rbegin(), signal.value.rend(), lit).base();
  return first < last && std::count_if(first, last, dark) >= 2;
}

std::optional<StripedLamp> finish(const LineWindow& window, const StripedShape& shape,
                                  const Blink& coarse, const LampLimits& limits) {
  const LineSignal signal = demodulated_signal(window, shape, limits.clipped);
  if (signal.lines() < 8) return std::nullopt;
  StripedLamp lamp;
  lamp.shape = shape;
  lamp.blink = fit_demodulated(signal, shape, coarse, limits);
  if (!significant(lamp.blink, shape) ||
      !same_on_both_sides(window, shape, lamp.blink, limits.clipped)) {
    if (shape.kind != StripedShape::Kind::disc || !has_gaps(signal)) return std::nullopt;
    lamp.blink = {};
  }
  lamp.evidence = -0.5 * signal.lines() * std::log(std::max(1e-6, 1 - lamp.blink.explained));
  return lamp;
}

std::optional<StripedLamp> measure_glow(const Surroundings& around, const BodyPlace& place,
                                        const Blink& coarse, const LampLimits& limits) {
  const LineWindow window = around.window(place.territory, modest_stride(place.territory));
  const double peak = robust_peak(window, limits.lit);
  GlowOptions options{std::max(limits.lit, 1e-3 * peak), limits.clipped, &coarse};
  auto shape = fit_glow(window, options);
  if (!shape) return std::nullopt;
  auto lamp = finish(window, *shape, coarse, limits);
  if (!lamp) return std::nullopt;
  options.blink = &lamp->blink;  // so far the shape's fit knew the coarse frequency only
  shape = fit_glow(window, options);
  if (!shape) return std::nullopt;
  lamp->shape = *shape;
  add_light(window, limits.lit, *lamp);
  return lamp;
}

}  // namespace

LineWindow Surroundings::window(const LineBox& box, int stride) const {
  LineWindow out(image, box, columns, background_dn, stride);
  for (const StripedShape& shape : found) {
    const OutlineChords chords(shape, 1.2);
    const double middle = shape.centre[0], half = chords.half_lines();
    const int last = std::min(box.line1, static_cast<int>(middle + half));
    for (int line = std::max(box.line0, static_cast<int>(middle - half)); line <= last; ++line) {
      const OutlineChords::Chord chord = chords.at(line);
      float* signal = out.signal.data() + (out.line(line) - out.line(box.line0));
      const int to = out.sample_from(chord.middle + chord.half);
      for (int i = out.sample_from(chord.middle - chord.half); i < to; ++i) signal[i] = 0;
    }
  }
  return out;
}

Blink coarse_blink(const LineWindow& window, double peak, const BodyPlace& place,
                   const LampLimits& limits) {
  LineBox part = place.territory;
  part.pos0 = place.body.pos0;
  part.pos1 = place.body.pos1;
  part = part.cut_to(window.box);
  const LineSignal signal = compressed_signal(window, part, std::max(limits.lit, 0.005 * peak));
  const double f = strongest_line(levelled(signal, part.lines() / 8.0), limits.max_cycles_per_line);
  if (!(f > 0)) return {};
  const Blink blink = fit_blink(levelled(signal, 0.4 / f), f, 2, 2);
  return blink.explained > 0.4 ? blink : Blink{};
}

std::optional<StripedLamp> measure_striped_lamp(const Surroundings& around, const BodyPlace& place,
                                                const Blink& coarse, const LampLimits& limits) {
  const LineBox& body = place.body;
  const LineBox close = body.grown(8 + body.lines() / 4, 8 + body.length() / 4);
  const LineWindow window = around.window(close.cut_to(place.territory), 1);
  const double peak = robust_peak(window, limits.lit);
  const bool clipped = peak >= limits.clipped;
  if (const auto chords = sharp_chords(window, body, peak, clipped)) {
    const auto disc = fit_disc(*chords);
    auto lamp = finish(window, disc ? *disc : fit_outline(chords->half), coarse, limits);
    if (lamp) add_light(window, limits.lit, *lamp);
    return lamp;
  }
  if (!(coarse.cycles_per_line > 0)) return std::nullopt;
  return measure_glow(around, place, coarse, limits);
}

}  // namespace occ::internal::detect
