// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/coverage.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/internal/rim_painter.hpp"

namespace occ {

using namespace internal::formation;
namespace {

double fraction(double position) { return position - std::floor(position); }

// Pixels first <= i < end on one axis.
struct Range {
  int first = 0, end = 0;
};

// Pixels reached by light between two positions, within a range.
Range touched(double low, double high, int reach, const Range& within) {
  // Compared as floating-point numbers, because a rim may be outside the range of int.
  const double first = std::max<double>(within.first, std::floor(low) - reach);
  const double last = std::min(within.end - 1.0, std::floor(high) + reach + 1);
  if (!(first <= last)) return {};
  return {static_cast<int>(first), static_cast<int>(last) + 1};
}

struct Extent {
  Range columns, rows;

  bool empty() const { return columns.end == columns.first || rows.end == rows.first; }
};

// Pixels reached by light between two corners, within the image extended by `margin`.
Extent touched(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int reach, int width,
               int height, int margin) {
  return {touched(low.x(), high.x(), reach, {-margin, width + margin}),
          touched(low.y(), high.y(), reach, {-margin, height + margin})};
}

template <typename AnyContour>
Extent touched(const AnyContour& contour, const PixelPsf& psf, int width, int height, int margin) {
  if (contour.empty()) return {};
  Eigen::Vector2d low = contour.front().px, high = low;
  for (const auto& point : contour) {
    low = low.cwiseMin(point.px);
    high = high.cwiseMax(point.px);
  }
  return touched(low, high, psf.reach(), width, height, margin);
}

// Sets the patch to the extent; its values are undefined.
void set_extent(const Extent& extent, Patch& patch) {
  const bool empty = extent.empty();
  patch.x0 = empty ? 0 : extent.columns.first;
  patch.y0 = empty ? 0 : extent.rows.first;
  patch.width = empty ? 0 : extent.columns.end - extent.columns.first;
  patch.height = empty ? 0 : extent.rows.end - extent.rows.first;
  patch.values.resize(static_cast<std::size_t>(patch.width) *
                      static_cast<std::size_t>(patch.height));
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

template <typename AnyContour, typename Real>
void add_points(const AnyContour& contour, const Extent& extent, Canvas<Real>& canvas) {
  const double sign = orientation(contour);
  for (const auto& point : contour)
    canvas.add({point.px.x() - extent.columns.first, point.px.y() - extent.rows.first,
                sign * dy_of(point)});
}

void copy_rows(const double* from, std::ptrdiff_t stride, Patch& patch) {
  for (int y = 0; y < patch.height; ++y)
    std::copy_n(from + y * stride, patch.width,
                patch.values.begin() + y * static_cast<std::ptrdiff_t>(patch.width));
}

template <typename AnyContour>
void paint_moments(const AnyContour& contour, const PixelPsf& psf, int image_width,
                   int image_height, Simd simd, CoverageMoments& moments) {
  const Extent extent = touched(contour, psf, image_width, image_height, 0);
  for (Patch* patch : {&moments.c, &moments.m_x, &moments.m_y}) set_extent(extent, *patch);
  if (extent.empty()) return;
  Canvas<double> canvas(simd);
  canvas.prepare(moments.c.width, moments.c.height, true);
  add_points(contour, extent, canvas);
  canvas.paint(psf);
  canvas.sum();
  copy_rows(canvas.c(), canvas.row_stride(), moments.c);
  copy_rows(canvas.m_x(), canvas.row_stride(), moments.m_x);
  copy_rows(canvas.m_y(), canvas.row_stride(), moments.m_y);
}

std::vector<double> buffer(const PixelPsf& psf) {
  return std::vector<double>(static_cast<std::size_t>(psf.count()) + 1);
}

// Weights below this are ignored in derivatives, for speed; see the error of CoverageDerivatives.
constexpr double min_light = 2e-4;

// Interval of the reached pixels.
struct Span {
  int first, end;
};
// Removes pixels with negligible weights at both ends.
Span trimmed(const std::vector<double>& weights, int first, int end) {
  const auto faint = [&](int k) { return weights[k] < min_light; };
  while (first < end && faint(first)) ++first;
  while (first < end && faint(end - 1)) --end;
  return {first, end};
}

// Part of `count` pixels from `first` on that is inside an axis of `size` pixels.
Span on_canvas(double first, int count, int size) {
  if (!(first + count > 0 && first < size)) return {0, 0};
  const int begin = static_cast<int>(first);
  return {std::max(0, -begin), std::min(count, size - begin)};
}

// Adds the contributions of contour points to the derivatives; keeps its buffers from point to
// point.
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

  void paint(const MovingContourPoint& point, const Patch& patch,
             std::vector<CoverageDerivatives::Row>& d) {
    const double top = std::floor(point.px.y()) - psf_.reach() - patch.y0;
    const double left = std::floor(point.px.x()) - psf_.reach() - patch.x0;
    Span row = on_canvas(top, psf_.count(), patch.height);
    Span column = on_canvas(left, psf_.count(), patch.width);
    if (row.first >= row.end || column.first >= column.end) return;
    psf_.weights(fraction(point.px.x()), across_.data());
    psf_.weights(fraction(point.px.y()), down_.data());
    psf_.slopes(fraction(point.px.x()), across_slopes_.data());
    psf_.slopes(fraction(point.px.y()), down_slopes_.data());
    row = trimmed(down_, row.first, row.end);
    column = trimmed(across_, column.first, column.end);
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
      const auto down = static_cast<float>(down_[k]);
      const auto slope = static_cast<float>(-spread * down_slopes_[k] * point.step_px.x());
      CoverageDerivatives::Row* to =
          &d[static_cast<std::size_t>(static_cast<int>(top) + k) *
                 static_cast<std::size_t>(patch.width) +
             static_cast<std::size_t>(static_cast<int>(left) + column.first)];
      add_row(to, down, slope, column);
    }
  }

 private:
  void add_row(CoverageDerivatives::Row* to, float down, float slope, const Span& column) const {
    for (int i = column.first; i < column.end; ++i, ++to) {
      const CoverageDerivatives::Row& from = columns_[i];
      for (std::size_t n = 0; n < 8; ++n) (*to)[n] += down * from[n];
      (*to)[6] += slope * from[7];
    }
  }

  const PixelPsf& psf_;
  double outward_;
  std::vector<double> across_, down_, across_slopes_, down_slopes_;
  std::vector<CoverageDerivatives::Row> columns_;  // by column, without the factor of the row
};

}  // namespace

CoveragePainter::CoveragePainter(Simd simd) : canvas_(std::make_unique<Canvas<float>>(simd)) {}
CoveragePainter::CoveragePainter(CoveragePainter&&) noexcept = default;
CoveragePainter& CoveragePainter::operator=(CoveragePainter&&) noexcept = default;
CoveragePainter::~CoveragePainter() = default;

CoverageRows CoveragePainter::paint(const Contour& contour, const PixelPsf& psf, int image_width,
                                    int image_height) {
  static_assert(CoverageRows::margin == Canvas<float>::margin);
  const Extent all = touched(contour, psf, image_width, image_height, CoverageRows::margin);
  const Extent inside = touched(contour, psf, image_width, image_height, 0);
  if (inside.empty()) return {};
  canvas_->prepare(all.columns.end - all.columns.first, all.rows.end - all.rows.first, false);
  add_points(contour, all, *canvas_);
  canvas_->paint(psf);
  canvas_->sum();
  const std::ptrdiff_t stride = canvas_->row_stride();
  return {inside.columns.first,
          inside.rows.first,
          inside.columns.end - inside.columns.first,
          inside.rows.end - inside.rows.first,
          canvas_->c() + (inside.rows.first - all.rows.first) * stride + inside.columns.first -
              all.columns.first,
          stride};
}

Patch coverage(const Contour& contour, const PixelPsf& psf, int image_width, int image_height,
               Simd simd) {
  Patch patch;
  const Extent extent = touched(contour, psf, image_width, image_height, 0);
  set_extent(extent, patch);
  if (extent.empty()) return patch;
  Canvas<double> canvas(simd);
  canvas.prepare(patch.width, patch.height, false);
  add_points(contour, extent, canvas);
  canvas.paint(psf);
  canvas.sum();
  copy_rows(canvas.c(), canvas.row_stride(), patch);
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
  for (const MovingContourPoint& point : contour) painter.paint(point, moments.c, out.d);
}

Patch coverage(const std::vector<Eigen::Vector2d>& rim_px, double psf_sigma_px, int image_width,
               int image_height) {
  return coverage(smooth_contour(rim_px), PixelPsf(psf_sigma_px), image_width, image_height);
}

Patch point_coverage(const Eigen::Vector2d& px, const PixelPsf& psf, int image_width,
                     int image_height) {
  Patch patch;
  set_extent(touched(px, px, psf.reach(), image_width, image_height, 0), patch);
  if (patch.width == 0) return patch;
  std::vector<double> across = buffer(psf), down = buffer(psf);
  psf.weights(fraction(px.x()), across.data());
  psf.weights(fraction(px.y()), down.data());
  const int left = patch.x0 - (static_cast<int>(std::floor(px.x())) - psf.reach());
  const int top = patch.y0 - (static_cast<int>(std::floor(px.y())) - psf.reach());
  for (int y = 0; y < patch.height; ++y)
    for (int x = 0; x < patch.width; ++x)
      patch.values[y * patch.width + x] = down[top + y] * across[left + x];
  return patch;
}

Patch point_coverage(const Eigen::Vector2d& px, double psf_sigma_px, int image_width,
                     int image_height) {
  return point_coverage(px, PixelPsf(psf_sigma_px), image_width, image_height);
}

}  // namespace occ
