// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/pixel_hull.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace occ::internal::detect {
namespace {

std::int64_t doubled_area(const std::vector<Pixel>& hull) {
  std::int64_t sum = 0;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) sum += cross(hull[0], hull[i], hull[i + 1]);
  return sum;
}

}  // namespace

std::int64_t cross(const Pixel& o, const Pixel& a, const Pixel& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

std::vector<Pixel> convex_hull(const std::vector<Pixel>& pixels) {
  std::vector<Pixel> hull;
  if (pixels.empty()) return hull;
  const auto add = [&](const Pixel& p, std::size_t keep) {
    while (hull.size() >= keep && cross(hull[hull.size() - 2], hull.back(), p) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Pixel& p : pixels) add(p, 2);
  const std::size_t lower = hull.size() + 1;
  for (auto p = pixels.rbegin() + 1; p < pixels.rend(); ++p) add(*p, lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

double pixels_inside(const std::vector<Pixel>& hull) {
  std::int64_t border = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Pixel &a = hull[i], &b = hull[(i + 1) % hull.size()];
    border += std::gcd(b.x - a.x, b.y - a.y);
  }
  return 0.5 * static_cast<double>(doubled_area(hull) + border) + 1;
}

HullQuadrilateral quadrilateral_of(const std::vector<Pixel>& hull) {
  std::int64_t most = 0;
  HullQuadrilateral best;
  for (std::size_t i = 0; i < hull.size(); ++i)
    for (std::size_t j = i + 2; j < hull.size(); ++j) {
      std::int64_t left = 0, right = 0;
      std::size_t between = i, beyond = j;
      for (std::size_t k = 0; k < hull.size(); ++k) {
        const std::int64_t side = cross(hull[i], hull[j], hull[k]);
        if (side > left) left = side, beyond = k;
        if (-side > right) right = -side, between = k;
      }
      if (left + right <= most) continue;
      most = left + right;
      best.corners = {hull[i], hull[between], hull[j], hull[beyond]};
    }
  best.share = static_cast<double>(most) / static_cast<double>(doubled_area(hull));
  return best;
}

AreaMoments area_moments(const std::vector<Pixel>& hull) {
  const auto point = [](const Pixel& p) {
    return Eigen::Vector2d(static_cast<double>(p.x), static_cast<double>(p.y));
  };
  const Eigen::Vector2d origin = point(hull[0]);
  const double doubled = static_cast<double>(doubled_area(hull));
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) {
    const Eigen::Vector2d a = point(hull[i]) - origin, b = point(hull[i + 1]) - origin;
    const double share = static_cast<double>(cross(hull[0], hull[i], hull[i + 1])) / doubled;
    first += share / 3 * (a + b);
    // Moments of a triangle with the corners 0, a, b.
    second += share / 12 * (a * a.transpose() + b * b.transpose() + (a + b) * (a + b).transpose());
  }
  return {origin + first, second - first * first.transpose()};
}

}  // namespace occ::internal::detect
