// SPDX-License-Identifier: Apache-2.0
// Internal: a part of the image in rolling-shutter coordinates, and the lamp candidates in it.
//
// A *line* is exposed at once: an image row, or a column when the sensor reads out columns. *pos*
// is the pixel index along the line. Stripes are parallel to the lines for both readout directions.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"

namespace occ::internal::detect {

/// Box of lines and positions, both ends included.
struct LineBox {
  int line0 = 0, line1 = -1, pos0 = 0, pos1 = -1;

  int lines() const { return line1 - line0 + 1; }
  int length() const { return pos1 - pos0 + 1; }
  double area() const { return static_cast<double>(lines()) * length(); }
  LineBox& operator+=(const LineBox& other);
  /// Box enlarged by this many lines and pixels on every side.
  LineBox grown(int by_lines, int by_pos) const;
  LineBox cut_to(const LineBox& other) const;
  bool meets(const LineBox& other) const;
  bool holds(double line, double pos) const;
};

/// Box of a component. `columns`: lines are image columns.
LineBox line_box(const Component& component, bool columns);

/// Box of the whole image.
LineBox line_box(const LinearImage& image, bool columns);

/// Linear signal above the background. Stripes hardly change along a line, so a large window may
/// contain only every `stride`-th pos.
struct LineWindow {
  LineBox box;
  int stride = 1;
  int samples = 0;            ///< samples per line
  std::vector<float> signal;  ///< line by line

  LineWindow(const LinearImage& image, const LineBox& box, bool columns, double background_dn,
             int stride = 1);

  const float* line(int line) const {
    return signal.data() +
           static_cast<std::size_t>(line - box.line0) * static_cast<std::size_t>(samples);
  }
  int pos(int sample) const { return box.pos0 + sample * stride; }
  /// Index of the first sample at or after a pos, clamped to [0, samples].
  int sample_from(double pos) const;
};

/// Stride for which a window has at most about 65536 samples.
int limited_stride(const LineBox& box);

/// Signal that 2 % of the pixels above `lit` exceed: the maximum without single hot pixels.
double robust_peak(const LineWindow& window, double lit);

/// True if two boxes lie one after the other like stripes of one lamp: the middle of the shorter is
/// within the longer, and the gap is at most half the longer. (A lamp shows two periods or more,
/// and its dark phase is shorter than a period.)
bool stacked(const LineBox& a, const LineBox& b);

/// Returns the boxes of the lamp candidates in a window: pixels above `level` are connected to
/// stripes, and stripes are joined across gaps that one lamp can have. A stack is split between two
/// lamps at an unusually wide gap, or at a stripe much shorter than those on both sides (a waist).
std::vector<LineBox> find_lamp_regions(const LineWindow& window, double level);

}  // namespace occ::internal::detect
