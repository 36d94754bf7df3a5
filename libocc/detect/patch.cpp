// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/patch.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::detect {
namespace {

/// Plane value = at + x * right + y * down, with variances from its fit.
struct Plane {
  double at = 0, right = 0, down = 0;
  double variance = 0;     ///< variance of the values about the plane
  double at_variance = 0;  ///< variance of `at`

  double operator()(double x, double y) const { return at + right * x + down * y; }
};

/// Sums for a least-squares plane through the pixels whose height above an initial plane lies
/// between two bounds. Heights are small, so single precision suffices. Columns are summed in eight
/// lanes (SIMD).
class PlaneSums {
 public:
  static constexpr std::size_t lanes = 8;

  /// Pixels with heights from `low` to `high` above the plane are used.
  PlaneSums(const Plane& plane, double low, double high) : plane_(plane), low_(low), high_(high) {}

  /// Adds rows of pixels, `stride` floats apart; the first pixel is at (x, y), the next row at
  /// y + step. `counts` is 1 for the columns to use and 0 for others. Its length is the number of
  /// columns rounded up to whole lanes; that many pixels of each row must be readable.
  void add_rows(const float* pixels, std::ptrdiff_t stride, int rows, double x, double y,
                double step, const std::vector<float>& counts);

  /// Returns the plane fitted to these pixels; empty when they are too few.
  std::optional<Plane> fit() const;

 private:
  enum Sum { n, x, y, xx, xy, yy, v, xv, yv, vv, count };

  double total(Sum which) const;

  Plane plane_;
  double low_, high_;
  alignas(32) std::array<std::array<float, lanes>, count> sums_ = {};
};

constexpr int enough_pixels = 24;  // for a stable plane: eight per parameter

using Lanes = float __attribute__((vector_size(4 * PlaneSums::lanes)));
using LaneMask = int __attribute__((vector_size(4 * PlaneSums::lanes)));

struct Rows {
  const float* pixels;
  std::ptrdiff_t stride;
  int rows;
  const float* counts;
  std::size_t columns;
  float x, y, step;          ///< position of the first pixel; distance between rows
  float start, right, down;  ///< height of the plane at the first pixel, its slopes
  float low, high;
};

/// Adds to the sums of n, x, y, xx, xy, yy, v, xv, yv, vv, `lanes` floats each. The inner loop is
/// over rows, so that the sums of a column stay in registers.
inline __attribute__((always_inline)) void add(const Rows& r, float* sums) {
  constexpr std::size_t lanes = PlaneSums::lanes;
  const Lanes first = {0, 1, 2, 3, 4, 5, 6, 7};
  for (std::size_t column = 0; column < r.columns; column += lanes) {
    const Lanes offset = first + static_cast<float>(static_cast<int>(column));
    const Lanes x = r.x + offset, start = r.start + r.right * offset;
    LaneMask counts;
    std::memcpy(&counts, r.counts + column, sizeof counts);
    Lanes n = {}, ny = {}, nyy = {}, v = {}, vy = {}, vv = {};
    const float* pixels = r.pixels + column;
    for (int row = 0; row < r.rows; ++row, pixels += r.stride) {
      const float below = r.step * static_cast<float>(row), y = r.y + below;
      Lanes height;
      std::memcpy(&height, pixels, sizeof height);
      height -= start + r.down * below;
      const LaneMask within = (height >= r.low) & (height <= r.high) & counts;
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

constexpr int lamp_margin_px = 2;            // margin of the box that still contains lamp light
constexpr double clip = 3;                   // outlier limit of background pixels [sigma]
constexpr double clipped_variance = 0.9733;  // variance of a unit normal truncated at 3 sigmas

std::size_t whole_lanes(std::size_t columns) {
  return (columns + PlaneSums::lanes - 1) / PlaneSums::lanes * PlaneSums::lanes;
}

}  // namespace

void Patch::load(const LinearImage& image, const Component& component, double limit_dn,
                 const Sensor* sensor) {
  x0_ = std::max(0, component.x0 - margin_px);
  y0_ = std::max(0, component.y0 - margin_px);
  width_ = std::min(image.width() - 1, component.x1 + margin_px) - x0_ + 1;
  height_ = std::min(image.height() - 1, component.y1 + margin_px) - y0_ + 1;
  // PlaneSums reads whole lanes, also at the end of the last row.
  signal_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) +
                 PlaneSums::lanes);
  image.read(x0_, y0_, width_, height_, signal_.data());
  subtract_background(image, component, limit_dn);
  set_noise(image, component, sensor);
  full_scale_signal_ = image.linear_dn(image.full_scale_dn()) - background_dn_;
}

void Patch::subtract_background(const LinearImage& image, const Component& component,
                                double limit_dn) {
  const int left = component.x0 - lamp_margin_px - x0_, right = component.x1 + lamp_margin_px - x0_;
  const int top = component.y0 - lamp_margin_px - y0_, bottom = component.y1 + lamp_margin_px - y0_;
  const double middle_x = 0.5 * (component.x0 + component.x1) - x0_;
  const double middle_y = 0.5 * (component.y0 + component.y1) - y0_;
  // Columns of the ring of background pixels: above and below the box, and beside it.
  const auto columns = static_cast<std::size_t>(width_);
  std::vector<float> everywhere(whole_lanes(columns), 0.0f);
  std::fill_n(everywhere.begin(), columns, 1.0f);
  std::vector<float> beside = everywhere;
  std::fill(beside.begin() + std::max(0, left), beside.begin() + std::min(width_, right + 1), 0.0f);
  // Fits a plane to the ring's pixels between two heights above another plane.
  const auto fit = [&](const Plane& plane, double low, double high, int row_step) {
    PlaneSums sums(plane, low, high);
    const auto add = [&](int y0, int y1, const std::vector<float>& counts) {
      if (y1 < y0) return;
      sums.add_rows(signal_.data() + static_cast<std::ptrdiff_t>(y0) * width_, row_step * width_,
                    (y1 - y0) / row_step + 1, -middle_x, y0 - middle_y, row_step, counts);
    };
    add(0, top - 1, everywhere);
    add(std::max(0, top), std::min(bottom, height_ - 1), beside);
    add(bottom + 1, height_ - 1, everywhere);
    return sums.fit();
  };
  Plane plane;
  plane.at = image.linear_dn(component.background_dn);
  plane.variance = plane.at_variance =
      square(component.noise_dn * image.slope(component.background_dn));
  const std::optional<Plane> dim = fit(plane, -std::numeric_limits<double>::infinity(),
                                       limit_dn - plane.at, height_ < 16 ? 1 : 3);
  if (dim) {
    plane = *dim;
    // Second fit without outliers: dim neighbours, hot pixels.
    const double reach = clip * std::sqrt(std::max(plane.variance, 1.0 / 12));
    if (const std::optional<Plane> clean = fit(plane, -reach, reach, 1)) {
      plane = *clean;
      plane.variance /= clipped_variance;
    }
  }
  background_dn_ = plane.at;
  background_sigma_dn_ = std::sqrt(plane.at_variance);
  ring_variance_ = plane.variance;
  const float slope = static_cast<float>(plane.right);
  for (int y = 0; y < height_; ++y) {
    float* row = signal_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float start = static_cast<float>(plane(-middle_x, y - middle_y));
    for (int x = 0; x < width_; ++x) row[x] -= start + slope * static_cast<float>(x);
  }
}

void Patch::set_noise(const LinearImage& image, const Component& component, const Sensor* sensor) {
  const auto quantisation = [&](double stored_dn) {
    const double slope = image.slope(stored_dn);
    return slope * slope / 12;
  };
  const double dark = quantisation(component.background_dn);
  noise_ = {std::max(ring_variance_, dark), 0, false};
  if (!sensor) return;
  const double gain = sensor->gain_dn_per_e;
  const double read = gain * sensor->read_noise_e;
  const double below = std::max(0.0, background_dn_) * gain;  // shot noise of the background
  noise_.floor = std::max(ring_variance_, read * read + below + dark);
  const double signal = image.linear_dn(component.peak_dn) - background_dn_;
  const double bright = quantisation(component.peak_dn);
  noise_.per_dn = gain + (signal > 0 ? std::max(0.0, bright - dark) / signal : 0);
  noise_.known = true;
}

}  // namespace occ::internal::detect
