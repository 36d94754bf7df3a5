// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/plane_sums.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <numeric>

#include "libocc/core/abi.hpp"

namespace occ::internal::detect {
namespace {

constexpr int enough_pixels = 24;

using Lanes = float __attribute__((vector_size(4 * PlaneSums::lanes)));
using Mask = int __attribute__((vector_size(4 * PlaneSums::lanes)));

struct Rows {
  const float* pixels;
  std::ptrdiff_t stride;
  int rows;
  const float* counts;
  std::size_t columns;
  float x, y, step;          ///< of the first pixel, from row to row
  float start, right, down;  ///< height of the plane there, its slopes
  float low, high;
};

/// Adds to sums of n, x, y, xx, xy, yy, v, xv, yv, vv, `lanes` floats each. Columns outside, rows
/// inside: a column's sums stay in registers.
inline __attribute__((always_inline)) void add(const Rows& r, float* sums) {
  constexpr std::size_t lanes = PlaneSums::lanes;
  const Lanes first = {0, 1, 2, 3, 4, 5, 6, 7};
  for (std::size_t column = 0; column < r.columns; column += lanes) {
    const Lanes offset = first + static_cast<float>(static_cast<int>(column));
    const Lanes x = r.x + offset, start = r.start + r.right * offset;
    Mask counts;
    std::memcpy(&counts, r.counts + column, sizeof counts);
    Lanes n = {}, ny = {}, nyy = {}, v = {}, vy = {}, vv = {};
    const float* pixels = r.pixels + column;
    for (int row = 0; row < r.rows; ++row, pixels += r.stride) {
      const float below = r.step * static_cast<float>(row), y = r.y + below;
      Lanes height;
      std::memcpy(&height, pixels, sizeof height);
      height -= start + r.down * below;
      const Mask within = (height >= r.low) & (height <= r.high) & counts;
      Lanes one;
      std::memcpy(&one, &within, sizeof one);
      const Lanes value = one * height;
      n += one;
      ny += one * y;
      nyy += one * (y * y);
      v += value;
      vy += value * y;
      vv += value * height;
    }
    const Lanes added[] = {n, n * x, ny, n * x * x, ny * x, nyy, v, v * x, vy, vv};
    for (const Lanes& sum : added) {
      Lanes total;
      std::memcpy(&total, sums, sizeof total);
      total += sum;
      std::memcpy(sums, &total, sizeof total);
      sums += lanes;
    }
    sums -= lanes * std::size(added);
  }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void add_avx2(const Rows& rows, float* sums) { add(rows, sums); }

void add_fast(const Rows& rows, float* sums) {
  static const bool avx2 = __builtin_cpu_supports("avx2");
  avx2 ? add_avx2(rows, sums) : add(rows, sums);
}
#else
void add_fast(const Rows& rows, float* sums) { add(rows, sums); }
#endif

}  // namespace

void PlaneSums::add_rows(const float* pixels, std::ptrdiff_t stride, int rows, double first_x,
                         double first_y, double step, const std::vector<float>& counts) {
  const auto f = [](double value) { return static_cast<float>(value); };
  add_fast({pixels, stride, rows, counts.data(), counts.size(), f(first_x), f(first_y), f(step),
            f(plane_(first_x, first_y)), f(plane_.right), f(plane_.down), f(low_), f(high_)},
           sums_.front().data());
}

double PlaneSums::total(Sum which) const {
  const auto& sums = sums_[which];
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

std::optional<Plane> PlaneSums::fit() const {
  const double pixels = total(n);
  if (pixels < enough_pixels) return std::nullopt;
  Eigen::Matrix3d normal;
  normal << pixels, total(x), total(y),  //
      total(x), total(xx), total(xy),    //
      total(y), total(xy), total(yy);
  const Eigen::Vector3d right(total(v), total(xv), total(yv));
  Plane plane = plane_;
  if (!(normal.determinant() > 1e-6 * normal.diagonal().prod())) {  // all in one row or column
    const double mean = right[0] / pixels;
    plane.at += mean;
    plane.variance = std::max(0.0, total(vv) / pixels - mean * mean);
    plane.at_variance = plane.variance / pixels;
    return plane;
  }
  const Eigen::Matrix3d inverse = normal.inverse();
  const Eigen::Vector3d change = inverse * right;
  plane.at += change[0];
  plane.right += change[1];
  plane.down += change[2];
  plane.variance = std::max(0.0, total(vv) - change.dot(right)) / (pixels - 3);
  plane.at_variance = inverse(0, 0) * plane.variance;
  return plane;
}

}  // namespace occ::internal::detect
