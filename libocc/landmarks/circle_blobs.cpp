// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/circle_blobs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/core/math.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// Mean of a square neighbourhood, by sums over all pixels above and to the left.
class LocalMean {
 public:
  LocalMean(const GreyLevel& level, int half)
      : half_(half), width_(level.width()), height_(level.height()) {
    const auto side = static_cast<std::size_t>(width_ + 1);
    sums_.assign(side * static_cast<std::size_t>(height_ + 1), 0);
    for (int y = 0; y < height_; ++y) {
      double row = 0;
      for (int x = 0; x < width_; ++x) {
        row += level.row(y)[x];
        sums_[index(x + 1, y + 1)] = sums_[index(x + 1, y)] + row;
      }
    }
  }

  double at(int x, int y) const {
    // The outer two pixels of a GreyLevel are not defined.
    const int x0 = std::max(2, x - half_), x1 = std::min(width_ - 2, x + half_ + 1);
    const int y0 = std::max(2, y - half_), y1 = std::min(height_ - 2, y + half_ + 1);
    const double sum =
        sums_[index(x1, y1)] - sums_[index(x0, y1)] - sums_[index(x1, y0)] + sums_[index(x0, y0)];
    return sum / ((x1 - x0) * (y1 - y0));
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
           static_cast<std::size_t>(x);
  }

  int half_, width_, height_;
  std::vector<double> sums_;
};

/// Sums over a region. Offsets are from its first pixel, which keeps them small.
struct RegionSums {
  int x0 = 0, y0 = 0;
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  bool at_border = false;

  void add_run(int first, int end, int row) {
    for (int at = first; at < end; ++at) {
      const double u = at - x0, v = row - y0;
      n += 1;
      x += u;
      y += v;
      xx += u * u;
      xy += u * v;
      yy += v * v;
    }
  }
};

/// A run of pixels of a row that belong to a region.
struct PixelRun {
  int row, first, end;
  std::size_t region;
};

/// Regions as a forest: each one refers to the region with which it was merged.
class RegionForest {
 public:
  std::size_t add() {
    parents_.push_back(parents_.size());
    return parents_.size() - 1;
  }
  std::size_t root(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void merge(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }
  std::size_t size() const { return parents_.size(); }

 private:
  std::vector<std::size_t> parents_;
};

/// Runs of all rows, with those that touch in the same region (four neighbours).
std::vector<PixelRun> connected_runs(const GreyLevel& level, bool dark, RegionForest& forest) {
  constexpr int half = 16;
  constexpr double min_difference = 1.5;  // grey levels; noise makes small regions
  const LocalMean mean(level, half);
  const double sign = dark ? 1 : -1;
  std::vector<PixelRun> runs;
  std::size_t above = 0;
  for (int y = 2; y < level.height() - 2; ++y) {
    const std::size_t begin = runs.size();
    const float* row = level.row(y);
    for (int x = 2; x < level.width() - 2; ++x) {
      if (!(sign * (mean.at(x, y) - row[x]) > min_difference)) continue;
      const int first = x;
      while (x < level.width() - 2 && sign * (mean.at(x, y) - row[x]) > min_difference) ++x;
      runs.push_back({y, first, x, forest.add()});
      while (above < begin && runs[above].end <= first) ++above;
      for (std::size_t k = above; k < begin && runs[k].first < x; ++k)
        forest.merge(runs[k].region, runs.back().region);
    }
    above = begin;
  }
  return runs;
}

bool is_ellipse(const RegionSums& sums, EllipseBlob& blob) {
  constexpr double min_area_px2 = 10;    // smaller ones are noise
  constexpr double max_area_px2 = 1200;  // more than a diameter of 30 px, with the blur
  constexpr double max_axes_ratio = 6;   // a tilt of 80 degrees
  constexpr double min_fill = 0.88, max_fill = 1.08;  // area of the ellipse with these moments
  if (sums.at_border || sums.n < min_area_px2 || sums.n > max_area_px2) return false;
  const Vector2d mean(sums.x / sums.n, sums.y / sums.n);
  blob.px = Vector2d(sums.x0, sums.y0) + mean;
  blob.area_px2 = sums.n;
  constexpr double pixel = 1 / 12.0;  // second moment of a pixel about its centre
  blob.moments << sums.xx / sums.n - mean.x() * mean.x() + pixel,
      sums.xy / sums.n - mean.x() * mean.y(), 0, sums.yy / sums.n - mean.y() * mean.y() + pixel;
  blob.moments(1, 0) = blob.moments(0, 1);
  const double determinant = blob.moments.determinant(), trace = blob.moments.trace();
  if (!(determinant > 0)) return false;
  const double fill = sums.n / (4 * pi * std::sqrt(determinant));
  const double root = std::sqrt(std::max(0.0, trace * trace / 4 - determinant));
  return fill > min_fill && fill < max_fill &&
         trace / 2 + root < max_axes_ratio * max_axes_ratio * (trace / 2 - root);
}

}  // namespace

std::vector<EllipseBlob> find_ellipses(const GreyLevel& level, bool dark) {
  std::vector<EllipseBlob> blobs;
  if (level.width() < 12 || level.height() < 12) return blobs;
  RegionForest forest;
  const std::vector<PixelRun> runs = connected_runs(level, dark, forest);
  std::vector<RegionSums> regions(forest.size());
  for (const PixelRun& run : runs) {
    RegionSums& sums = regions[forest.root(run.region)];
    if (sums.n == 0) {
      sums.x0 = run.first;
      sums.y0 = run.row;
    }
    sums.add_run(run.first, run.end, run.row);
    sums.at_border = sums.at_border || run.first <= 2 || run.end >= level.width() - 2 ||
                     run.row <= 2 || run.row >= level.height() - 3;
  }
  for (const RegionSums& sums : regions) {
    EllipseBlob blob;
    if (is_ellipse(sums, blob)) blobs.push_back(blob);
  }
  return blobs;
}

}  // namespace occ::internal::landmarks
