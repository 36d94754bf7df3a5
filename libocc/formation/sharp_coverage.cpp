// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/sharp_coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::formation {
namespace {

double signed_area(const Chords& chords) {
  double area = 0;
  const Eigen::Vector2d origin = chords.front().from;
  for (const RimChord& c : chords)
    area += 0.5 * cross_2d(c.from - origin, c.to - origin) + c.bulge_px2;
  return area;
}

// Paints a chord piece by piece between pixel borders. Pixel i covers [i - 1/2, i + 1/2].
class ChordPainter {
 public:
  ChordPainter(double weight, int first_row, int end_row, CoverageMoments& steps)
      : weight_(weight),
        first_row_(std::max(first_row, steps.c.y0)),
        end_row_(std::min(end_row, steps.c.y0 + steps.c.height)),
        steps_(steps) {}

  void paint(const RimChord& chord) {
    chord_ = chord;
    along_ = chord.to - chord.from;
    // Clips to the rows, then treats the parts left of, in and right of the columns separately.
    double begin = 0, end = 1;
    clip(1, first_row_ - 0.5, end_row_ - 0.5, begin, end);
    if (!(begin < end)) return;
    const double left = steps_.c.x0 - 0.5, right = steps_.c.x0 + steps_.c.width - 0.5;
    double in = begin, out = end;
    clip(0, left, right, in, out);
    if (!(in < out)) {
      if (chord.from.x() + 0.5 * (begin + end) * along_.x() < left) walk(begin, end, true);
      return;
    }
    const bool enters_from_left = chord.from.x() + begin * along_.x() < left;
    const bool leaves_to_left = chord.from.x() + end * along_.x() < left;
    if (enters_from_left) walk(begin, in, true);
    walk(in, out, false);
    if (leaves_to_left) walk(out, end, true);
  }

 private:
  // Restricts the parameters to those at which a coordinate is between two values.
  void clip(int axis, double low, double high, double& begin, double& end) const {
    const double from = chord_.from[axis], along = along_[axis];
    if (along == 0) {
      if (!(from >= low && from < high)) end = begin;
      return;
    }
    const double a = (low - from) / along, b = (high - from) / along;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }

  // Pixel borders that the chord crosses on one axis, in the order of its parameter.
  struct Crossings {
    double from, along, border, next;
    Crossings(double position, double step, double begin) : from(position + 0.5), along(step) {
      const double at = from + begin * along;
      border = along > 0 ? std::floor(at) + 1 : std::ceil(at) - 1;
      next = along == 0 ? std::numeric_limits<double>::infinity() : (border - from) / along;
    }
    void advance() {
      border += along > 0 ? 1 : -1;
      next = (border - from) / along;
    }
  };

  void walk(double begin, double end, bool left_of_patch) {
    Crossings rows(chord_.from.y(), along_.y(), begin);
    Crossings columns(chord_.from.x(), left_of_patch ? 0 : along_.x(), begin);
    for (double at = begin; at < end;) {
      const double next = std::min({rows.next, columns.next, end});
      if (next > at) piece(at, next, left_of_patch);
      if (rows.next <= next) rows.advance();
      if (columns.next <= next) columns.advance();
      at = std::max(at, next);
    }
  }

  // Fraction of the bulge up to t.
  static double share(double t) { return t * t * (3 - 2 * t); }

  void piece(double begin, double end, bool left_of_patch) {
    const Eigen::Vector2d a = chord_.from + begin * along_, b = chord_.from + end * along_;
    const Eigen::Vector2d middle = 0.5 * (a + b);
    const auto pixel = [](double at, int first, int count) {
      return std::clamp(static_cast<int>(std::floor(at + 0.5)), first, first + count - 1);
    };
    const Patch& patch = steps_.c;
    const int y = pixel(middle.y(), patch.y0, patch.height);
    const int x = left_of_patch ? patch.x0 : pixel(middle.x(), patch.x0, patch.width);
    const double dy = weight_ * (b.y() - a.y());
    const double bulge = weight_ * chord_.bulge_px2 * (share(end) - share(begin));
    // Simpson's rule is exact for these cubics. u and v are relative to the pixel's centre.
    double area = 0, moment_x = 0, moment_y = 0, all_y = 0;
    const auto add = [&](const Eigen::Vector2d& p, double part) {
      const double u = left_of_patch ? -0.5 : p.x() - x, v = p.y() - y;
      area += part * (0.5 - u);
      moment_x += part * 0.5 * (0.25 - u * u);
      moment_y += part * v * (0.5 - u);
      all_y += part * v;
    };
    add(a, dy / 6);
    add(middle, dy * 4 / 6);
    add(b, dy / 6);
    if (!left_of_patch) {
      area -= bulge;
      moment_x -= bulge * (middle.x() - x);
      moment_y -= bulge * (middle.y() - y);
    }
    step(steps_.c, x, y, area, dy);
    step(steps_.m_x, x, y, moment_x, 0);
    step(steps_.m_y, x, y, moment_y, all_y);
  }

  // Adds a value to a pixel and another value to all pixels to its right.
  static void step(Patch& patch, int x, int y, double here, double right) {
    double* at = &patch.values[static_cast<std::size_t>(y - patch.y0) *
                                   static_cast<std::size_t>(patch.width) +
                               static_cast<std::size_t>(x - patch.x0)];
    at[0] += here;
    if (x + 1 < patch.x0 + patch.width) at[1] += right - here;
  }

  double weight_;
  int first_row_, end_row_;
  CoverageMoments& steps_;
  RimChord chord_{};
  Eigen::Vector2d along_ = Eigen::Vector2d::Zero();
};

}  // namespace

CoverageMoments dark_moments(const Chords& chords, int image_width, int image_height) {
  CoverageMoments moments;
  if (chords.empty()) return moments;
  Eigen::Vector2d low = chords.front().from, high = low;
  for (const RimChord& chord : chords) {
    low = low.cwiseMin(chord.from);
    high = high.cwiseMax(chord.from);
  }
  const double x0 = std::max(0.0, std::floor(low.x())), y0 = std::max(0.0, std::floor(low.y()));
  const double x1 = std::min(image_width - 1.0, std::floor(high.x()) + 1);
  const double y1 = std::min(image_height - 1.0, std::floor(high.y()) + 1);
  if (!(x0 <= x1 && y0 <= y1)) return moments;
  Patch& c = moments.c;
  c = {static_cast<int>(x0),
       static_cast<int>(y0),
       static_cast<int>(x1 - x0) + 1,
       static_cast<int>(y1 - y0) + 1,
       {}};
  c.values.assign(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height), 0.0);
  moments.m_x = moments.m_y = c;
  return moments;
}

void add_sharp_coverage(const Chords& chords, double weight, int first_row, int end_row,
                        CoverageMoments& steps) {
  if (chords.empty() || steps.c.width == 0) return;
  // The sign makes coverage positive: a pixel to the right of the shape's left flank sees light.
  ChordPainter painter(signed_area(chords) > 0 ? -weight : weight, first_row, end_row, steps);
  for (const RimChord& chord : chords) painter.paint(chord);
}

void sum_rows(CoverageMoments& steps) {
  for (Patch* patch : {&steps.c, &steps.m_x, &steps.m_y})
    for (int y = 0; y < patch->height; ++y) {
      double* row =
          &patch->values[static_cast<std::size_t>(y) * static_cast<std::size_t>(patch->width)];
      for (int x = 1; x < patch->width; ++x) row[x] += row[x - 1];
    }
}

CoverageMoments sharp_coverage(const Chords& chords, int image_width, int image_height) {
  CoverageMoments moments = dark_moments(chords, image_width, image_height);
  add_sharp_coverage(chords, 1, 0, image_height, moments);
  sum_rows(moments);
  return moments;
}

}  // namespace occ::internal::formation
