// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/stripe_centre.hpp"

namespace occ::internal::detect {
namespace {

/// Moments of the area between chords, those of dark lines interpolated.
struct Area {
  double sum = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();

  void add(double line, double pos0, double pos1) {
    const double width = pos1 - pos0;
    const Eigen::Vector2d middle(line, 0.5 * (pos0 + pos1));
    sum += width;
    first += width * middle;
    second += width * middle * middle.transpose();
    second(1, 1) += width * width * width / 12;
  }
};

}  // namespace

std::optional<SharpChords> sharp_chords(const LineWindow& window, const LineBox& body, double peak,
                                        bool clipped) {
  const LineBox part = body.grown(3, 3 + body.length() / 8).cut_to(window.box);
  SharpChords chords;
  chords.half = lit_chords(window, part, peak, 0.5);
  if (chords.half.size() < 5 || median_softness(chords.half) > (clipped ? 0.1 : 0.25))
    return std::nullopt;
  chords.low = lit_chords(window, part, peak, 0.35);
  chords.high = lit_chords(window, part, peak, 0.65);
  return chords;
}

StripedShape fit_outline(const std::vector<Chord>& chords) {
  Area area;
  const int gap = widest_gap(chords);
  for (std::size_t i = 0; i < chords.size(); ++i) {
    const Chord& a = chords[i];
    area.add(a.line, a.pos0, a.pos1);
    if (i + 1 == chords.size()) break;
    const Chord& b = chords[i + 1];
    for (int line = a.line + 1; line < b.line; ++line) {
      const double t = static_cast<double>(line - a.line) / (b.line - a.line);
      area.add(line, a.pos0 + t * (b.pos0 - a.pos0), a.pos1 + t * (b.pos1 - a.pos1));
    }
  }
  StripedShape outline;
  outline.kind = StripedShape::Kind::outline;
  outline.centre = area.first / area.sum;
  const Eigen::Matrix2d spread =
      area.second / area.sum - outline.centre * outline.centre.transpose();
  // An ellipse of this area's second moments: semi-axes are twice the standard deviations.
  outline.shape = Eigen::Matrix2d((4 * spread).inverse()).llt().matrixU();
  // Up to a gap may be hidden at either end: uniform, halved by the mean of both ends. Where the
  // hidden ends lie along the lines is not known either, but they are shorter than the rest.
  outline.covariance << gap * gap / 24.0, 0, 0, gap * gap / 96.0;
  outline.covariance.diagonal().array() += 0.05 * 0.05;
  return outline;
}

}  // namespace occ::internal::detect
