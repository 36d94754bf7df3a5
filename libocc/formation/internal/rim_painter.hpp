// SPDX-License-Identifier: Apache-2.0
// The inner loops of formation/coverage.cpp: points of a rim painted as steps along the rows that
// they touch, so that a point costs the same however many pixels lie to its right, and the sums of
// these steps.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/pixel_psf.hpp"

namespace occ {

/// Where on the canvas a point's light falls. Of the touched rows (columns), `first_row` ...
/// `end_row` - 1 are on it, the touched row 0 being row `top` of the canvas, and so on.
struct Footprint {
  bool on_canvas = false;
  int top = 0, first_row = 0, end_row = 0;
  int left = 0, first_column = 0, end_column = 0;
};

/// Steps of coverage and of its first moments, side by side for each row.
class Canvas {
 public:
  /// Dark. Without moments it holds coverage alone.
  Canvas(Simd simd, const PsfTables& tables, int width, int height, bool with_moments);

  /// Adds a point with its share `amount` of the contour.
  void paint(const Footprint& print, const PsfStencil& across, const PsfStencil& down,
             double amount);

  /// Coverage, or its moments, row by row; without moments m_x and m_y are null.
  void sum(double* c, double* m_x, double* m_y) const;

 private:
  Simd simd_;
  PsfTables tables_;
  int width_, height_;
  bool with_moments_;
  std::ptrdiff_t stride_;      // from one of a row's sums to the next
  std::size_t begin_ = 0;      // of the aligned part of steps_
  std::vector<double> steps_;  // of each row: c, m_x, m_y
  std::vector<double> buffer_;
};

}  // namespace occ
