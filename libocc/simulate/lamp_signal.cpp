// SPDX-License-Identifier: Apache-2.0
#include <numeric>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace {

constexpr double min_electrons = 1e-6;  // rounding errors of the coverage are below

// One row of a lamp's image in whole vectors, with zeros after the image. Sums are kept per lane,
// so that their order does not depend on the instruction set.
constexpr int lanes = PaddedPatch::padding;
static_assert(lanes <= Signal::padding);
struct Row {
  const float* image;  // light while the lamp is lit
  const double* lit;   // lit fraction
  double even, odd;    // colour factors of the columns x0, x0 + 2, ... and x0 + 1, x0 + 3, ...
  int count;
};

LIBOCC_INLINE void add_pixel(double light, double colour, double* to, double* sum) {
  const double electrons = light * colour;
  const double counted = electrons > min_electrons ? electrons : 0;
  *to += counted;
  *sum += counted;
}

template <Simd>
LIBOCC_INLINE void add_row_body(Row row, double* __restrict to, double* sums) {
  double mine[lanes];
  for (int i = 0; i < lanes; ++i) mine[i] = sums[i];
  const double lit = *row.lit;
  for (int x = 0; x < row.count; x += lanes)
    for (int i = 0; i < lanes; ++i)
      add_pixel(static_cast<double>(row.image[x + i]) * lit, i % 2 == 0 ? row.even : row.odd,
                to + x + i, mine + i);
  for (int i = 0; i < lanes; ++i) sums[i] = mine[i];
}
LIBOCC_MULTIVERSION(add_row, (Row row, double* to, double* sums), (row, to, sums))

template <Simd>
LIBOCC_INLINE void add_row_by_columns_body(Row row, double* __restrict to, double* sums) {
  for (int x = 0; x < row.count; ++x)
    add_pixel(static_cast<double>(row.image[x]) * row.lit[x], x % 2 == 0 ? row.even : row.odd,
              to + x, sums + x % lanes);
}
LIBOCC_MULTIVERSION(add_row_by_columns, (Row row, double* to, double* sums), (row, to, sums))

}  // namespace

double add_lamp(const PaddedPatch& image, const Lamp& lamp, const Frame& frame, Signal& signal) {
  signal.touch({image.x0, image.y0, image.width, image.height});
  const bool by_columns = frame.scene.sensor.readout == Readout::columns;
  const Simd simd = frame.storage.simd();
  const auto add_row = by_columns ? add_row_by_columns_for(simd) : add_row_for(simd);
  const std::vector<double> lit = lit_fractions(lamp, frame, by_columns ? image.x0 : image.y0,
                                                by_columns ? image.width : image.height);
  const ByPlace factors = light_by_place(frame, lamp.colour);
  double sums[lanes] = {};
  for (int y = 0; y < image.height; ++y)
    add_row(
        {image.row(y), lit.data() + (by_columns ? 0 : y), factors[place_of(image.x0, image.y0 + y)],
         factors[place_of(image.x0 + 1, image.y0 + y)], image.width},
        signal.row(image.y0 + y) + image.x0, sums);
  return std::accumulate(sums, sums + lanes, 0.0);
}

}  // namespace occ::internal::simulate
