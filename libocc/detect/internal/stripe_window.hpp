// SPDX-License-Identifier: Apache-2.0
// Internal: a part of the image as a rolling shutter sees it. A *line* is exposed at once (an image
// row, or a column of a turned image) and *pos* runs along it, so that stripes lie along lines
// whichever way the sensor is read.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/linear_image.hpp"

namespace occ::internal::detect {

/// Both ends included.
struct LineBox {
  int line0 = 0, line1 = -1, pos0 = 0, pos1 = -1;

  int lines() const { return line1 - line0 + 1; }
  int length() const { return pos1 - pos0 + 1; }
  double area() const { return static_cast<double>(lines()) * length(); }
  LineBox& operator+=(const LineBox& other);
  /// Grown by a number of lines and pixels on every side.
  LineBox grown(int by_lines, int by_pos) const;
  LineBox cut_to(const LineBox& other) const;
  bool meets(const LineBox& other) const;
  bool holds(double line, double pos) const;
};

/// Box of a component; `columns`: lines are image columns.
LineBox line_box(const Component& component, bool columns);

/// The whole image.
LineBox line_box(const LinearImage& image, bool columns);

/// Linear signal above the background. Stripes hardly change along a line, so that a large window
/// may be read with only every `stride`-th pos.
struct LineWindow {
  LineBox box;
  int stride = 1;
  int samples = 0;            ///< of each line
  std::vector<float> signal;  ///< line by line

  LineWindow(const LinearImage& image, const LineBox& box, bool columns, double background_dn,
             int stride = 1);

  const float* line(int line) const {
    return signal.data() +
           static_cast<std::size_t>(line - box.line0) * static_cast<std::size_t>(samples);
  }
  int pos(int sample) const { return box.pos0 + sample * stride; }
  /// First sample at or after a pos, not below 0 and not above `samples`.
  int sample_from(double pos) const;
};

/// The stride with which a window has about 65536 samples at most.
int modest_stride(const LineBox& box);

/// What 2 % of the lit pixels of a window exceed: bright, but no single hot pixel.
double robust_peak(const LineWindow& window, double lit);

}  // namespace occ::internal::detect
