// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/striped_lamp.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/stripe_shape.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {
namespace {

/// Chords of the ellipse |shape d| = rim on each line.
class OutlineChords {
 public:
  OutlineChords(const StripedShape& shape, double rim)
      : centre_(shape.centre), metric_(shape.shape.transpose() * shape.shape), rim_(rim) {}

  double half_lines() const { return rim_ * std::sqrt(metric_.inverse()(0, 0)); }
  double along() const { return metric_(1, 1); }

  struct Chord {
    double middle, half;  ///< middle and half length [pos]
    double across;        ///< |shape d|^2 at the middle
  };
  Chord at(int line) const {
    const double dl = line - centre_[0];
    const double slope = metric_(0, 1) / metric_(1, 1);
    const double across = (metric_(0, 0) - slope * metric_(0, 1)) * dl * dl;
    const double half = std::sqrt(std::max(0.0, (rim_ * rim_ - across) / metric_(1, 1)));
    return {centre_[1] - slope * dl, half, across};
  }

 private:
  Eigen::Vector2d centre_;
  Eigen::Matrix2d metric_;
  double rim_;
};

constexpr int max_lines = 512;  // in a signal; bounds the time for a very large lamp

/// Sums signal and model over the samples [from, to) of a line; returns the number of samples used.
/// The model is exp(range (1 - across - along (pos - middle)^2)), computed by recurrence.
int add_samples(const LineWindow& window, int line, int from, int to,
                const OutlineChords::Chord& chord, double along, double range, double clipped,
                double& seen, double& expected) {
  const float* signal = window.line(line);
  const double step = window.stride, d = window.pos(from) - chord.middle;
  double value = std::exp(range * (1 - chord.across - along * d * d));
  double ratio = std::exp(-range * along * step * (2 * d + step));
  const double ratio_ratio = std::exp(-2 * range * along * step * step);
  int count = 0;
  for (int i = from; i < to; ++i, value *= ratio, ratio *= ratio_ratio) {
    if (range > 0 && signal[i] >= clipped) continue;
    seen += signal[i];
    expected += value;
    ++count;
  }
  return count;
}

enum class Side { both, low, high };

/// Mean of log(1 + signal / floor) along each line. The logarithm reduces the range of a
/// bell-shaped profile to that of its stripes.
LineSignal compressed_signal(const LineWindow& window, const LineBox& all, double floor) {
  const int too_many = std::max(0, all.lines() - max_lines);
  const LineBox part = all.grown(-(too_many + 1) / 2, 0);
  const int from = window.sample_from(part.pos0);
  const int to = std::max(from + 1, window.sample_from(part.pos1 + 1));
  const int step = 1 + (to - from) / 48;
  const auto inverse = static_cast<float>(1 / floor);
  LineSignal signal;
  signal.line0 = part.line0;
  for (int line = part.line0; line <= part.line1; ++line) {
    const float* s = window.line(line);
    double sum = 0;
    int count = 0;
    for (int i = from; i < to; i += step, ++count)
      sum += std::log1p(std::max(0.0f, s[i]) * inverse);
    signal.value.push_back(sum / count);
    signal.weight.push_back(1);
  }
  return signal;
}

/// Relative size of the part of the ellipse in which the shape predicts the signal reliably.
double reliable_part(const StripedShape& shape) {
  switch (shape.kind) {
    case StripedShape::Kind::disc:  // all except the blurred rim
      return 1 - 1.5 * std::sqrt((shape.shape.transpose() * shape.shape)(1, 1));
    case StripedShape::Kind::outline:  // the ellipse exceeds e.g. a rectangle between its corners
      return 0.75;
    case StripedShape::Kind::gaussian:
      break;
  }
  return 0.9;
}

/// Signal of each line over the signal of the same lamp without blinking. Lines that the lamp
/// hardly covers have weight 0.
LineSignal demodulated_signal(const LineWindow& window, const StripedShape& shape, double clipped,
                              Side side = Side::both) {
  const double range = shape.log_range;  // 0: uniform
  const OutlineChords chords(shape, reliable_part(shape));
  LineSignal signal;
  signal.line0 =
      std::max(window.box.line0, static_cast<int>(shape.centre[0] - chords.half_lines()));
  const int last = std::min({window.box.line1, signal.line0 + max_lines - 1,
                             static_cast<int>(shape.centre[0] + chords.half_lines())});
  for (int line = signal.line0; line <= last; ++line) {
    const OutlineChords::Chord chord = chords.at(line);
    const double low = side == Side::high ? chord.middle : chord.middle - chord.half;
    const double high = side == Side::low ? chord.middle : chord.middle + chord.half;
    double seen = 0, expected = 0;
    const int count = add_samples(window, line, window.sample_from(low), window.sample_from(high),
                                  chord, chords.along(), range, clipped, seen, expected);
    signal.value.push_back(count > 0 ? seen / expected : 0);
    signal.weight.push_back(count >= 3 ? 1 : 0);
  }
  return signal;
}

// The signal is compressed by log(1 + signal / knee), with the knee as a part of its maximum.
constexpr double default_knee = 0.1;  // weights stripes of different height similarly
constexpr double linear_knee = 10;    // hardly any compression

/// Signal with equally high stripes. For discs and outlines the signal is unchanged. The Gaussian
/// model fits only approximately: the remaining fall-off would bias the stripes towards the centre.
/// Compression by a logarithm reduces this bias.
LineSignal flattened(LineSignal signal, const StripedShape& shape, double cycles_per_line,
                     double knee) {
  if (shape.kind != StripedShape::Kind::gaussian) return signal;
  const double highest = *std::max_element(signal.value.begin(), signal.value.end());
  for (double& value : signal.value) value = std::log1p(std::max(0.0, value) / (knee * highest));
  return envelope_normalised(signal, 0.4 / cycles_per_line);
}

Blink fit_demodulated(const LineSignal& signal, const StripedShape& shape, const Blink& coarse,
                      const LampLimits& limits) {
  if (shape.kind != StripedShape::Kind::gaussian) {
    // The baseline of this signal is flat, so it also shows a weak peak that the coarse one hides.
    const double f = strongest_frequency(signal, limits.max_cycles_per_line);
    return f > 0 ? fit_blink(signal, f, 1) : Blink{};
  }
  const double f = coarse.cycles_per_line;
  Blink blink = fit_blink(flattened(signal, shape, f, default_knee), f, 2);
  if (!(blink.cycles_per_line > 0)) return blink;
  const Blink other = fit_blink(flattened(signal, shape, f, linear_knee), f, 2);
  // Model error of a stripe's centre in a bell-shaped profile. The slope of n stripes over L lines
  // then has the relative error sqrt(12 / n) / L.
  constexpr double stripe_sigma_lines = 0.15;
  const double lines = blink.periods / blink.cycles_per_line;
  const double model_sigma = stripe_sigma_lines * blink.cycles_per_line *
                             std::sqrt(12 / std::max(1.0, blink.periods)) / lines;
  blink.sigma = std::hypot(blink.sigma, other.cycles_per_line - blink.cycles_per_line, model_sigma);
  return blink;
}

/// True if both halves of the lines have the same amplitude and phase. Structure in the scene
/// (window bars, shelves) is seldom that regular.
bool consistent_across(const LineWindow& window, const StripedShape& shape, const Blink& blink,
                       double clipped) {
  std::complex<double> side[2];
  for (int i = 0; i < 2; ++i) {
    const LineSignal half =
        demodulated_signal(window, shape, clipped, i == 0 ? Side::low : Side::high);
    const double f = blink.cycles_per_line;
    side[i] = amplitude_at(flattened(half, shape, f, default_knee), f) *
              std::polar(1.0, 2 * pi * f * half.line0);
  }
  return std::abs(side[0] - side[1]) < 0.25 * std::abs(side[0] + side[1]);
}

/// Significance test. The F statistic uses a variance inflated for correlated residuals, so 6 is
/// hardly ever exceeded by chance. Structure that is not periodic leaves more than 30 %
/// unexplained.
bool significant(const Blink& blink, const StripedShape& shape) {
  return blink.periods >= 2 * reliable_part(shape) && blink.f_statistic > 6 &&
         blink.explained > 0.7 && blink.amplitude() > 0.05 * std::abs(blink.mean);
}

/// Sums the signal and number of the lit pixels inside the outline, enlarged by 10 % for its blur.
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

/// True if there are two or more dark lines between lit ones.
bool has_gaps(const LineSignal& signal) {
  const double highest = *std::max_element(signal.value.begin(), signal.value.end());
  const auto lit = [&](double value) { return value > 0.5 * highest; };
  const auto dark = [&](double value) { return value < 0.2 * highest; };
  const auto first = std::find_if(signal.value.begin(), signal.value.end(), lit);
  const auto last = std::find_if(signal.value.rbegin(), signal.value.rend(), lit).base();
  return first < last && std::count_if(first, last, dark) >= 2;
}

/// Measures the blink of a lamp of known shape; empty when there are no significant stripes.
std::optional<StripedLamp> measure_blink(const LineWindow& window, const StripedShape& shape,
                                         const Blink& coarse, const LampLimits& limits) {
  const LineSignal signal = demodulated_signal(window, shape, limits.clipped);
  if (signal.lines() < 8) return std::nullopt;
  StripedLamp lamp;
  lamp.shape = shape;
  lamp.blink = fit_demodulated(signal, shape, coarse, limits);
  if (!significant(lamp.blink, shape) ||
      !consistent_across(window, shape, lamp.blink, limits.clipped)) {
    if (shape.kind != StripedShape::Kind::disc || !has_gaps(signal)) return std::nullopt;
    lamp.blink = {};
  }
  lamp.evidence = -0.5 * signal.lines() * std::log(std::max(1e-6, 1 - lamp.blink.explained));
  return lamp;
}

std::optional<StripedLamp> measure_gaussian(const LampContext& context, const LampRegion& region,
                                            const Blink& coarse, const LampLimits& limits) {
  const LineWindow window = context.window(region.extent, limited_stride(region.extent));
  const double peak = robust_peak(window, limits.lit);
  GaussianOptions options{std::max(limits.lit, 1e-3 * peak), limits.clipped, &coarse};
  auto shape = fit_gaussian(window, options);
  if (!shape) return std::nullopt;
  auto lamp = measure_blink(window, *shape, coarse, limits);
  if (!lamp) return std::nullopt;
  options.blink = &lamp->blink;  // refit with the final instead of the coarse frequency
  shape = fit_gaussian(window, options);
  if (!shape) return std::nullopt;
  lamp->shape = *shape;
  add_light(window, limits.lit, *lamp);
  return lamp;
}

}  // namespace

LineWindow LampContext::window(const LineBox& box, int stride) const {
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

Blink coarse_blink(const LineWindow& window, double peak, const LampRegion& region,
                   const LampLimits& limits) {
  LineBox part = region.extent;
  part.pos0 = region.core.pos0;
  part.pos1 = region.core.pos1;
  part = part.cut_to(window.box);
  const LineSignal signal = compressed_signal(window, part, std::max(limits.lit, 0.005 * peak));
  const double f = strongest_frequency(envelope_normalised(signal, part.lines() / 8.0),
                                       limits.max_cycles_per_line);
  if (!(f > 0)) return {};
  const Blink blink = fit_blink(envelope_normalised(signal, 0.4 / f), f, 2, 2);
  return blink.explained > 0.4 ? blink : Blink{};
}

std::optional<StripedLamp> measure_striped_lamp(const LampContext& context,
                                                const LampRegion& region, const Blink& coarse,
                                                const LampLimits& limits) {
  const LineBox& core = region.core;
  const LineBox close = core.grown(8 + core.lines() / 4, 8 + core.length() / 4);
  const LineWindow window = context.window(close.cut_to(region.extent), 1);
  const double peak = robust_peak(window, limits.lit);
  const bool clipped = peak >= limits.clipped;
  if (const auto chords = sharp_chords(window, core, peak, clipped)) {
    const auto disc = fit_disc(*chords);
    auto lamp = measure_blink(window, disc ? *disc : fit_outline(chords->half), coarse, limits);
    if (lamp) add_light(window, limits.lit, *lamp);
    return lamp;
  }
  if (!(coarse.cycles_per_line > 0)) return std::nullopt;
  return measure_gaussian(context, region, coarse, limits);
}

}  // namespace occ::internal::detect
