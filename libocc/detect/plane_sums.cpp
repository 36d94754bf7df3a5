// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/plane_sums.hpp"

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cstddef>

namespace occ::detecting {
namespace {

constexpr int enough_pixels = 24;

struct Rows {
  const float* pixels;
  std::ptrdiff_t stride;
  int rows, width;
  const float* counts;
  float y, step;             ///< of the rows
  float start, right, down;  ///< height of the plane at the first pixel, its slopes
  float low, high;
};

/// `sums` holds six rows of the width.
inline __attribute__((always_inline)) void add(const Rows r, float* sums) {
  float *n = sums, *ny = n + r.width, *nyy = ny + r.width;
  float *v = nyy + r.width, *vy = v + r.width, *vv = vy + r.width;
  for (int row = 0; row < r.rows; ++row) {
    const float* pixels = r.pixels + row * r.stride;
    const float y = r.y + r.step * static_cast<float>(row), yy = y * y;
    const float start = r.start + r.down * (y - r.y);
#pragma GCC ivdep
    for (int x = 0; x < r.width; ++x) {
      const float height = pixels[x] - (start + r.right * static_cast<float>(x));
      const int within = static_cast<int>(height >= r.low) & static_cast<int>(height <= r.high);
      const float one = r.counts[x] * static_cast<float>(within);
      const float value = one * height;
      n[x] += one;
      ny[x] += one * y;
      nyy[x] += one * yy;
      v[x] += value;
      vy[x] += value * y;
      vv[x] += value * height;
    }
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

PlaneSums::PlaneSums(int width, const Plane& plane, double first_x, double low, double high)
    : plane_(plane),
      first_x_(first_x),
      low_(low),
      high_(high),
      width_(width),
      sums_(6 * static_cast<std::size_t>(width), 0.0f) {}

void PlaneSums::add_rows(const float* pixels, std::ptrdiff_t stride, int rows, double y,
                         double step, const std::vector<float>& counts) {
  const auto f = [](double value) { return static_cast<float>(value); };
  add_fast({pixels, stride, rows, width_, counts.data(), f(y), f(step), f(plane_(first_x_, y)),
            f(plane_.right), f(plane_.down), f(low_), f(high_)},
           sums_.data());
}

std::optional<Plane> PlaneSums::fit() const {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double vv = 0;
  const float *n = sums_.data(), *ny = n + width_, *nyy = ny + width_;
  const float *v = nyy + width_, *vy = v + width_, *squares = vy + width_;
  for (int i = 0; i < width_; ++i) {
    const double x = first_x_ + i;
    normal(0, 0) += n[i];
    normal(0, 1) += x * n[i];
    normal(0, 2) += ny[i];
    normal(1, 1) += x * x * n[i];
    normal(1, 2) += x * ny[i];
    normal(2, 2) += nyy[i];
    right[0] += v[i];
    right[1] += x * v[i];
    right[2] += vy[i];
    vv += squares[i];
  }
  const double pixels = normal(0, 0);
  if (pixels < enough_pixels) return std::nullopt;
  normal.triangularView<Eigen::StrictlyLower>() = normal.transpose();
  Plane plane = plane_;
  if (!(normal.determinant() > 1e-6 * normal.diagonal().prod())) {  // all in one row or column
    const double mean = right[0] / pixels;
    plane.at += mean;
    plane.variance = std::max(0.0, vv / pixels - mean * mean);
    plane.at_variance = plane.variance / pixels;
    return plane;
  }
  const Eigen::Matrix3d inverse = normal.inverse();
  const Eigen::Vector3d change = inverse * right;
  plane.at += change[0];
  plane.right += change[1];
  plane.down += change[2];
  plane.variance = std::max(0.0, vv - change.dot(right)) / (pixels - 3);
  plane.at_variance = inverse(0, 0) * plane.variance;
  return plane;
}

}  // namespace occ::detecting
