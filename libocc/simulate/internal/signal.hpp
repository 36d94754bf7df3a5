// SPDX-License-Identifier: Apache-2.0
// Mean signal electrons of each pixel, without dark current: the sum of all light on the sensor.
// Most pixels are zero, so the rectangles with other pixels are recorded.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "libocc/simulate/simulate.hpp"

namespace occ::internal::simulate {

/// One value for each place in a mosaic of two by two pixels: 2 (y mod 2) + x mod 2.
using ByPlace = std::array<double, 4>;
inline std::size_t place_of(int x, int y) {
  return static_cast<std::size_t>(2 * (y & 1) + (x & 1));
}

class Signal {
 public:
  Signal(int width, int height)
      : width_(width),
        height_(height),
        stride_((width + 7) / 8 * 8 | 8),  // an odd number of cache lines: rows share no cache sets
        electrons_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height) + padding) {
  }

  /// Number of values after each pixel that may be read and have zero added to them.
  static constexpr int padding = 16;

  int width() const { return width_; }
  int height() const { return height_; }
  double* row(int y) { return electrons_.data() + y * stride_; }
  const double* row(int y) const { return electrons_.data() + y * stride_; }

  /// Records that pixels of the rectangle may become non-zero. To be called before row() is
  /// written.
  void touch(const PixelRectangle& rectangle);
  void touch_everything() { touch({0, 0, width_, height_}); }

  /// Calls visit(x0, y, count) for runs of pixels that may be non-zero, each pixel once, row by
  /// row.
  template <typename Visit>
  void for_touched(Visit visit) const;

  /// Rectangles with all pixels that may be non-zero; they may overlap.
  const std::vector<PixelRectangle>& touched() const { return touched_; }

  /// Adds light that all pixels of a place receive. Kept apart from the rows, without a pass over
  /// the image.
  void add_everywhere(const ByPlace& electrons) {
    for (std::size_t i = 0; i < electrons.size(); ++i) everywhere_[i] += electrons[i];
  }
  const ByPlace& everywhere() const { return everywhere_; }

  /// Adds the light of all pixels to the rows, and sets it to 0.
  void move_everywhere_to_rows();

  /// Sets all pixels to 0.
  void clear();

 private:
  /// Interval of columns.
  struct Run {
    int begin, end;
  };
  std::vector<Run> runs(int y) const;  ///< disjoint, from left to right

  int width_, height_;
  std::ptrdiff_t stride_;
  std::vector<double> electrons_;
  std::vector<PixelRectangle> touched_;
  ByPlace everywhere_{};
};

template <typename Visit>
void Signal::for_touched(Visit visit) const {
  int first = height_, end = 0;
  for (const PixelRectangle& part : touched_) {
    first = std::min(first, part.y0);
    end = std::max(end, part.y0 + part.height);
  }
  for (int y = first; y < end; ++y)
    for (const Run& run : runs(y)) visit(run.begin, y, run.end - run.begin);
}

}  // namespace occ::internal::simulate
