// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/coverage.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/internal/rim_painter.hpp"

namespace occ {
namespace {

double fraction(double position) { return position - std::floor(position); }

// Pixels touched by light between two positions on one axis, within an image of `size` pixels.
struct Range {
  int first = 0, count = 0;
};

Range touched(double low, double high, int reach, int size) {
  // In floating point first: a rim may lie further out than an int can say.
  const double first = std::max(0.0, std::floor(low) - reach);
  const double last = std::min(size - 1.0, std::floor(high) + reach + 1);
  if (!(first <= last)) return {};
  return {static_cast<int>(first), static_cast<int>(last - first) + 1};
}

// Makes the patch as large as the pixels that are touched; their values are anything.
void set_extent(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int reach, int width,
                int height, Patch& patch) {
  const Range columns = touched(low.x(), high.x(), reach, width);
  const Range rows = touched(low.y(), high.y(), reach, height);
  const bool empty = columns.count == 0 || rows.count == 0;
  patch.x0 = empty ? 0 : columns.first;
  patch.y0 = empty ? 0 : rows.first;
  patch.width = empty ? 0 : columns.count;
  patch.height = empty ? 0 : rows.count;
  patch.values.resize(static_cast<std::size_t>(patch.width) *
                      static_cast<std::size_t>(patch.height));
}

template <typename AnyContour>
void set_extent(const AnyContour& contour, const PixelPsf& psf, int width, int height,
                Patch& patch) {
  if (contour.empty()) {
    patch = {};
    return;
  }
  Eigen::Vector2d low = contour.front().px, high = low;
  for (const auto& point : contour) {
    low = low.cwiseMin(point.px);
    high = high.cwiseMax(point.px);
  }
  set_extent(low, high, psf.reach(), width, height, patch);
}

double dy_of(const ContourPoint& point) { return point.dy_px; }
double dy_of(const MovingContourPoint& point) { return point.step_px.y(); }

// Sign that makes coverage positive: a pixel to the right of the shape's left flank sees light.
template <typename AnyContour>
double orientation(const AnyContour& contour) {
  const double origin = contour.front().px.x();
  double area = 0;
  for (const auto& point : contour) area += (point.px.x() - origin) * dy_of(point);
  return area > 0 ? -1 : 1;
}

Footprint footprint(const Eigen::Vector2d& px, const PixelPsf& psf, const Patch& patch) {
  Footprint print;
  // In floating point first, and no further left than where the whole patch is to its right.
  const double row = std::floor(px.y()) - psf.reach() - patch.y0;
  const double column = std::floor(px.x()) - psf.reach() - patch.x0;
  if (!(row + psf.count() > 0 && row < patch.height && column < patch.width)) return print;
  print.on_canvas = true;
  print.top = static_cast<int>(row);
  print.first_row = std::max(0, -print.top);
  print.end_row = std::min(psf.count(), patch.height - print.top);
  print.left = static_cast<int>(std::max(column, -1.0 * psf.count()));
  print.first_column = std::max(0, -print.left);
  print.end_column = std::min(psf.count() + 1, patch.width - print.left);
  return print;
}

template <typename AnyContour>
void paint(const AnyContour& contour, const PixelPsf& psf, const Patch& patch, Canvas& canvas) {
  const double sign = orientation(contour);
  for (const auto& point : contour) {
    const Footprint print = footprint(point.px, psf, patch);
    if (!print.on_canvas) continue;
    canvas.paint(print, psf.stencil(fraction(point.px.x())), psf.stencil(fraction(point.px.y())),
                 sign * dy_of(point));
  }
}

template <typename AnyContour>
void paint_moments(const AnyContour& contour, const PixelPsf& psf, int image_width,
                   int image_height, Simd simd, CoverageMoments& moments) {
  set_extent(contour, psf, image_width, image_height, moments.c);
  for (Patch* patch : {&moments.m_x, &moments.m_y}) {
    patch->x0 = moments.c.x0;
    patch->y0 = moments.c.y0;
    patch->width = moments.c.width;
    patch->height = moments.c.height;
    patch->values.resize(moments.c.values.size());
  }
  if (moments.c.width == 0) return;
  Canvas canvas(simd, psf.tables(), moments.c.width, moments.c.height, true);
  paint(contour, psf, moments.c, canvas);
  canvas.sum(moments.c.values.data(), moments.m_x.values.data(), moments.m_y.values.data());
}

std::vector<double> buffer(const PixelPsf& psf) {
  return std::vector<double>(static_cast<std::size_t>(psf.count()) + 1);
}

// Light that counts for derivatives, a part of that of the nearest pixel.
constexpr double least_light = 2e-4;

// Of the touched pixels, those that get light that counts.
struct Span {
  int first, end;
};
Span trimmed(const std::vector<double>& weights, int first, int end) {
  const auto faint = [&](int k) { return weights[static_cast<std::size_t>(k)] < least_light; };
  while (first < end && faint(first)) ++first;
  while (first < end && faint(end - 1)) --end;
  return {first, end};
}

// Paints what a contour point adds to the derivatives; kept from point to point for its storage.
class DerivativePainter {
 public:
  DerivativePainter(const PixelPsf& psf, double outward)
      : psf_(psf),
        outward_(outward),
        across_(buffer(psf)),
        down_(buffer(psf)),
        across_slopes_(buffer(psf)),
        down_slopes_(buffer(psf)),
        columns_(across_.size()) {}

  void paint(const MovingContourPoint& point, const Footprint& print, int width,
             std::vector<CoverageDerivatives::Row>& d) {
    psf_.weights(fraction(point.px.x()), across_.data());
    psf_.weights(fraction(point.px.y()), down_.data());
    psf_.slopes(fraction(point.px.x()), across_slopes_.data());
    psf_.slopes(fraction(point.px.y()), down_slopes_.data());
    const Span row = trimmed(down_, print.first_row, std::min(print.end_row, psf_.count()));
    const Span column =
        trimmed(across_, print.first_column, std::min(print.end_column, psf_.count()));
    if (row.first >= row.end || column.first >= column.end) return;
    const double spread = -outward_ * psf_.sigma_px() * psf_.sigma_px();
    for (int i = column.first; i < column.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      for (std::size_t n = 0; n < 6; ++n)
        columns_[k][n] =
            static_cast<float>(outward_ * across_[k] * point.sweep[static_cast<Eigen::Index>(n)]);
      columns_[k][6] = static_cast<float>(spread * across_slopes_[k] * point.step_px.y());
      columns_[k][7] = static_cast<float>(across_[k]);
    }
    for (int k = row.first; k < row.end; ++k) {
      const auto down = static_cast<float>(down_[static_cast<std::size_t>(k)]);
      const auto slope = static_cast<float>(-spread * down_slopes_[static_cast<std::size_t>(k)] *
                                            point.step_px.x());
      CoverageDerivatives::Row* to =
          &d[static_cast<std::size_t>(print.top + k) * static_cast<std::size_t>(width) +
             static_cast<std::size_t>(print.left + column.first)];
      add_row(to, down, slope, column);
    }
  }

 private:
  void add_row(CoverageDerivatives::Row* to, float down, float slope, const Span& column) const {
    for (int i = column.first; i < column.end; ++i, ++to) {
      const CoverageDerivatives::Row& from = columns_[static_cast<std::size_t>(i)];
      for (std::size_t n = 0; n < 8; ++n) (*to)[n] += down * from[n];
      (*to)[6] += slope * from[7];
    }
  }

  const PixelPsf& psf_;
  double outward_;
  std::vector<double> across_, down_, across_slopes_, down_slopes_;
  std::vector<CoverageDerivatives::Row> columns_;  // by column: all but the factor of the row
};

}  // namespace

Patch coverage(const Contour& contour, const PixelPsf& psf, int image_width, int image_height,
               Simd simd) {
  Patch patch;
  set_extent(contour, psf, image_width, image_height, patch);
  if (patch.width == 0) return patch;
  Canvas canvas(simd, psf.tables(), patch.width, patch.height, false);
  paint(contour, psf, patch, canvas);
  canvas.sum(patch.values.data(), nullptr, nullptr);
  return patch;
}

CoverageMoments coverage_moments(const Contour& contour, const PixelPsf& psf, int image_width,
                                 int image_height, Simd simd) {
  CoverageMoments moments;
  paint_moments(contour, psf, image_width, image_height, simd, moments);
  return moments;
}

void coverage_moments(const Contour& contour, const PixelPsf& psf, int image_width,
                      int image_height, Simd simd, CoverageMoments& out) {
  paint_moments(contour, psf, image_width, image_height, simd, out);
}

void coverage_derivatives(const MovingContour& contour, const PixelPsf& psf, int image_width,
                          int image_height, CoverageDerivatives& out) {
  CoverageMoments& moments = out.moments;
  paint_moments(contour, psf, image_width, image_height, widest_simd(), moments);
  out.d.assign(moments.c.values.size(), CoverageDerivatives::Row{});
  if (moments.c.width == 0) return;
  DerivativePainter painter(psf, -orientation(contour));
  for (const MovingContourPoint& point : contour) {
    const Footprint print = footprint(point.px, psf, moments.c);
    if (!print.on_canvas) continue;
    painter.paint(point, print, moments.c.width, out.d);
  }
}

Patch coverage(const std::vector<Eigen::Vector2d>& rim_px, double psf_sigma_px, int image_width,
               int image_height) {
  return coverage(smooth_contour(rim_px), PixelPsf(psf_sigma_px), image_width, image_height);
}

Patch point_coverage(const Eigen::Vector2d& px, const PixelPsf& psf, int image_width,
                     int image_height) {
  Patch patch;
  set_extent(px, px, psf.reach(), image_width, image_height, patch);
  if (patch.width == 0) return patch;
  std::vector<double> across = buffer(psf), down = buffer(psf);
  psf.weights(fraction(px.x()), across.data());
  psf.weights(fraction(px.y()), down.data());
  const int left = patch.x0 - (static_cast<int>(std::floor(px.x())) - psf.reach());
  const int top = patch.y0 - (static_cast<int>(std::floor(px.y())) - psf.reach());
  for (int y = 0; y < patch.height; ++y)
    for (int x = 0; x < patch.width; ++x)
      patch.values[static_cast<std::size_t>(y * patch.width + x)] =
          down[static_cast<std::size_t>(top + y)] * across[static_cast<std::size_t>(left + x)];
  return patch;
}

Patch point_coverage(const Eigen::Vector2d& px, double psf_sigma_px, int image_width,
                     int image_height) {
  return point_coverage(px, PixelPsf(psf_sigma_px), image_width, image_height);
}

}  // namespace occ
