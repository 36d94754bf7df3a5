// SPDX-License-Identifier: Apache-2.0
// What is printed on a tag's paper: the outline of all that is black, from libapriltag's own
// printing of the family.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace occ::internal::simulate {

/// From one corner of the outline to the next, black on the left seen from the front (y up).
struct PrintEdge {
  Eigen::Vector2d from, to;
};

/// Outline of the black cells of a pattern of columns x rows, each of side 1: its first cell's
/// upper left corner is the origin, y up (rows of cells go down). Beyond it is white.
std::vector<PrintEdge> cell_outline(int columns, int rows,
                                    const std::function<bool(int column, int row)>& black);

/// In half sides of the tag's square: its corners are at (-1, -1) to (1, 1).
struct TagPrint {
  std::vector<PrintEdge> black;
  double half_width = 1;  ///< of the print with the quiet zone that belongs to the family
  double cell = 0.25;     ///< side of one cell
};

/// Throws std::invalid_argument naming a family that is not known or an id that it does not have.
TagPrint tag_print(const std::string& family, int id);

}  // namespace occ::internal::simulate
