// SPDX-License-Identifier: Apache-2.0
#include <apriltag/apriltag.h>

#include <algorithm>

#include "libocc/core/internal/april_family.hpp"
#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/target_outline.hpp"
#include "libocc/simulate/targets.hpp"

namespace occ::internal::simulate {

using namespace internal::core;
namespace {

// Adds the borders between black and white along one line of the grid; adjacent borders are joined.
// `black(i, line)` refers to the cell behind the line, `corner(i, line)` is a corner of cells. With
// `backwards`, black behind the line is on the left in the direction of decreasing i.
template <typename Black, typename Corner>
void add_line(int cells, int line, bool backwards, const Black& black, const Corner& corner,
              std::vector<PrintEdge>& edges) {
  int begin = 0, sense = 0;
  for (int i = 0; i <= cells; ++i) {
    const int here = i == cells ? 0 : int{black(i, line)} - int{black(i, line - 1)};
    if (here == sense) continue;
    if (sense != 0) {
      const Eigen::Vector2d low = corner(begin, line), high = corner(i, line);
      edges.push_back((sense > 0) == backwards ? PrintEdge{high, low} : PrintEdge{low, high});
    }
    begin = i;
    sense = here;
  }
}

// Cells of the print: a white ring, next to it the black border of the square (inside the ring, or
// outside if the family's border is reversed), and the bits of the code, the first bit highest.
Eigen::ArrayXXi white_cells(const apriltag_family_t& family, std::uint64_t code) {
  const int n = family.total_width, border = (n - family.width_at_border) / 2;
  const int ring = family.reversed_border ? border : border - 1;
  Eigen::ArrayXXi white = Eigen::ArrayXXi::Zero(n, n);
  white.block(ring, ring, n - 2 * ring, n - 2 * ring) = 1;
  white.block(ring + 1, ring + 1, n - 2 * ring - 2, n - 2 * ring - 2) = 0;
  for (std::uint32_t i = 0; i < family.nbits; ++i) {
    const bool set = (code >> (family.nbits - i - 1) & 1) != 0;
    if (set)
      white(static_cast<int>(family.bit_y[i]) + border,
            static_cast<int>(family.bit_x[i]) + border) = 1;
  }
  return white;
}

}  // namespace

std::vector<PrintEdge> cell_outline(int columns, int rows,
                                    const std::function<bool(int column, int row)>& black) {
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < columns && y < rows && black(x, y);
  };
  const auto corner = [](int x, int y) { return Eigen::Vector2d(x, -y); };
  std::vector<PrintEdge> edges;
  for (int line = 0; line <= rows; ++line) add_line(columns, line, true, inside, corner, edges);
  for (int line = 0; line <= columns; ++line)
    add_line(
        rows, line, false, [&](int y, int x) { return inside(x, y); },
        [&](int y, int x) { return corner(x, y); }, edges);
  return edges;
}

TagPrint tag_print(const std::string& family, int id) {
  const TagPattern pattern = tag_pattern(family, id);
  const int n = static_cast<int>(pattern.black.rows());
  TagPrint print;
  print.cell = 2.0 / pattern.square_cells;
  print.half_width = 0.5 * n * print.cell;
  print.black = cell_outline(n, n, [&](int x, int y) { return pattern.black(y, x); });
  const Eigen::Vector2d origin(-print.half_width, print.half_width);
  for (PrintEdge& edge : print.black)
    edge = {origin + print.cell * edge.from, origin + print.cell * edge.to};
  return print;
}

}  // namespace occ::internal::simulate

namespace occ {

TagPattern tag_pattern(const std::string& family, int id, int border_cells) {
  using internal::core::bordered_family_names;
  require(border_cells >= 1 && border_cells <= 4, "tag: border_cells", border_cells,
          "between 1 and 4");
  const internal::core::AprilFamily codes = internal::core::make_april_family(family, border_cells);
  require(codes != nullptr, "tag: family", family, "a known one");
  const std::vector<std::string> bordered = bordered_family_names();
  require(border_cells == 1 || std::count(bordered.begin(), bordered.end(), family) > 0,
          "tag: border_cells", border_cells, "1 for the family " + family);
  require(id >= 0 && id < static_cast<int>(codes->ncodes), "tag: id", id,
          "below " + std::to_string(codes->ncodes) + ", the number of tags of " + family);
  TagPattern pattern;
  pattern.black = internal::simulate::white_cells(*codes, codes->codes[id]) == 0;
  pattern.square_cells = codes->width_at_border;
  return pattern;
}

}  // namespace occ
