// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/striped_lamp.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace occ::detecting {
namespace {

constexpr int max_lines = 512;       // of a signal: bounds the time that a huge body takes
constexpr double usual_knee = 0.1;   // of the logarithm that compresses a signal, of its highest
constexpr double distant_knee = 10;  // hardly compresses

/// Mean along a line of log(1 + signal / floor): compresses a glow's range to that of its stripes.
LineSignal compressed_signal(const LineWindow& window, const LineBox& part, double floor) {
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

/// The ellipse |shape d| = rim on each line.
class Chords {
 public:
  Chords(const StripedShape& shape, double rim)
      : centre_(shape.centre), metric_(shape.shape.transpose() * shape.shape), rim_(rim) {}

  double half_lines() const { return rim_ * std::sqrt(metric_.inverse()(0, 0)); }
  double along() const { return metric_(1, 1); }

  struct Chord {
    double middle, half;  ///< pos
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

/// Adds signal and model over samples [from, to) of a line; returns how many were used. The model
/// is exp(range (1 - across - along (pos - middle)^2)), run along the line by multiplication.
int add_samples(const LineWindow& window, int line, int from, int to, const Chords::Chord& chord,
                double along, double range, double clipped, double& seen, double& expected) {
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

/// The part of the outline, by its size, that is as bright as the shape says.
double dependable_part(const StripedShape& shape) {
  switch (shape.kind) {
    case StripedShape::Kind::disc:  // but for its blurred rim
      return 1 - 1.5 * std::sqrt((shape.shape.transpose() * shape.shape)(1, 1));
    case StripedShape::Kind::outline:  // sticks out of corners
      return 0.75;
    case StripedShape::Kind::glow:
      break;
  }
  return 0.9;
}

enum class Side { both, low, high };

/// Signal of each line over the signal that the lamp would have without blinking; what is left is
/// the blink. Lines that the lamp hardly covers have weight 0.
LineSignal demodulated_signal(const LineWindow& window, const StripedShape& shape, double clipped,
                              Side side = Side::both) {
  const double range = shape.log_range;  // 0: evenly bright
  const Chords chords(shape, dependable_part(shape));
  LineSignal signal;
  signal.line0 =
      std::max(window.box.line0, static_cast<int>(shape.centre[0] - chords.half_lines()));
  const int last = std::min({window.box.line1, signal.line0 + max_lines - 1,
                             static_cast<int>(shape.centre[0] + chords.half_lines())});
  for (int line = signal.line0; line <= last; ++line) {
    const Chords::Chord chord = chords.at(line);
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

Blink fit_demodulated(const LineSignal& signal, const StripedShape& shape, const Blink& coarse) {
  const double f = coarse.cycles_per_line;
  if (shape.kind != StripedShape::Kind::glow) return fit_blink(signal, f, 1);
  Blink blink = fit_blink(flattened(signal, shape, f, usual_knee), f, 2);
  const Blink other = fit_blink(flattened(signal, shape, f, distant_knee), f, 2);
  blink.sigma = std::hypot(blink.sigma, other.cycles_per_line - blink.cycles_per_line);
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
bool significant(const Blink& blink) {
  return blink.periods >= 2 && blink.f_test > 6 && blink.explained > 0.7 &&
         blink.amplitude() > 0.05 * std::abs(blink.mean);
}

/// Signal and number of the lit pixels within the outline (a little wider, for its blur).
void add_light(const LineWindow& window, double lit, StripedLamp& lamp) {
  const Chords chords(lamp.shape, 1.1);
  for (int line = window.box.line0; line <= window.box.line1; ++line) {
    const Chords::Chord chord = chords.at(line);
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
  if (coarse.cycles_per_line > 0) lamp.blink = fit_demodulated(signal, shape, coarse);
  if (!significant(lamp.blink) || !same_on_both_sides(window, shape, lamp.blink, limits.clipped)) {
    if (shape.kind != StripedShape::Kind::disc || !has_gaps(signal)) return std::nullopt;
    lamp.blink = {};
  }
  lamp.evidence = -0.5 * signal.lines() * std::log(std::max(1e-6, 1 - lamp.blink.explained));
  return lamp;
}

std::optional<StripedLamp> measure_glow(const BodyPlace& place, const Blink& coarse,
                                        const LampLimits& limits) {
  const LineWindow window(place.image, place.territory, place.columns, place.background_dn,
                          modest_stride(place.territory));
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

Blink coarse_blink(const LineWindow& window, double peak, const BodyPlace& place,
                   const LampLimits& limits) {
  LineBox part = place.territory;
  part.pos0 = place.body.pos0;
  part.pos1 = place.body.pos1;
  part = part.cut_to(window.box);
  const int too_many = part.lines() - max_lines;
  if (too_many > 0) part = part.grown(-(too_many + 1) / 2, 0);
  const LineSignal signal = compressed_signal(window, part, std::max(limits.lit, 0.005 * peak));
  const double f = strongest_line(levelled(signal, part.lines() / 8.0), limits.max_cycles_per_line);
  if (!(f > 0)) return {};
  const Blink blink = fit_blink(levelled(signal, 0.4 / f), f, 2, 2);
  return blink.explained > 0.4 ? blink : Blink{};
}

std::optional<StripedLamp> measure_striped_lamp(const BodyPlace& place, const Blink& coarse,
                                                const LampLimits& limits) {
  const LineBox& body = place.body;
  const LineBox close = body.grown(8 + body.lines() / 4, 8 + body.length() / 4);
  const LineWindow window(place.image, close.cut_to(place.territory), place.columns,
                          place.background_dn);
  if (const auto chords = sharp_chords(window, body, robust_peak(window, limits.lit))) {
    const auto disc = fit_disc(*chords);
    auto lamp = finish(window, disc ? *disc : fit_outline(chords->half), coarse, limits);
    if (lamp) add_light(window, limits.lit, *lamp);
    return lamp;
  }
  if (!(coarse.cycles_per_line > 0)) return std::nullopt;
  return measure_glow(place, coarse, limits);
}

}  // namespace occ::detecting
