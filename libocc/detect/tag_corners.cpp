// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/tag_corners.hpp"
//
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace occ {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double least_reach_px = 1.2;  // across a side; less does not hold the blur of an edge
constexpr double most_reach_px = 5;
constexpr double ring_part = 0.85, blur_px = 0.8;
constexpr double step_px = 0.25;         // of a profile
constexpr double corner_part = 0.06;     // of a side, at each end, beside the reach: the other side
constexpr double model_sigma_px = 0.03;  // what straight sides and interpolation leave

class Grey {
 public:
  explicit Grey(const Image& image) : image_(image) {}

  bool holds(const Vector2d& px) const {
    return px.minCoeff() >= 0 && px.x() < image_.width - 1 && px.y() < image_.height - 1;
  }

  // Bilinear.
  double at(const Vector2d& px) const {
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const double u = px.x() - x, v = px.y() - y;
    return (1 - v) * ((1 - u) * pixel(x, y) + u * pixel(x + 1, y)) +
           v * ((1 - u) * pixel(x, y + 1) + u * pixel(x + 1, y + 1));
  }

 private:
  double pixel(int x, int y) const {
    const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                   static_cast<std::size_t>(x);
    return image_.type == PixelType::u8 ? image_.u8[i] : image_.u16[i];
  }

  const Image& image_;
};

// n . p = d, with the covariance of (angle of n, d at `middle`).
struct Line {
  Vector2d normal, middle;
  double angle_information = 0, offset_information = 0;  // for edges of unit variance
  double squared = 0;                                    // of the edges' distances from it
  int edges = 0;
};

// Where along the profile a sharp step would have to be to let as much light through: the levels on
// both sides are those of the profile's ends.
bool edge_at(const std::vector<double>& profile, double& offset) {
  const std::size_t n = profile.size(), ends = std::max<std::size_t>(2, n / 8);
  double low = 0, high = 0, sum = 0;
  for (std::size_t i = 0; i < ends; ++i) {
    low += profile[i];
    high += profile[n - 1 - i];
  }
  low /= static_cast<double>(ends);
  high /= static_cast<double>(ends);
  constexpr double least_contrast = 8;
  if (!(std::abs(high - low) > least_contrast)) return false;
  // Trapezium rule: the ends count half.
  for (std::size_t i = 0; i < n; ++i)
    sum += (i == 0 || i == n - 1 ? 0.5 : 1) * (profile[i] - low) / (high - low);
  offset = step_px * (0.5 * static_cast<double>(n - 1) - sum);
  return true;
}

// The line that fits edges best, which are (along, across) a side from `origin`.
bool through(const std::vector<Vector2d>& edges, const Vector2d& origin, const Vector2d& along,
             Line& line) {
  constexpr std::size_t least_edges = 5;
  if (edges.size() < least_edges) return false;
  const Vector2d normal(-along.y(), along.x());
  const auto n = static_cast<double>(edges.size());
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& e : edges) mean += e / n;
  double ss = 0, st = 0;
  for (const Vector2d& e : edges) {
    ss += (e.x() - mean.x()) * (e.x() - mean.x());
    st += (e.x() - mean.x()) * (e.y() - mean.y());
  }
  const double slope = st / ss;
  line.squared = 0;
  for (const Vector2d& e : edges)
    line.squared += std::pow(e.y() - mean.y() - slope * (e.x() - mean.x()), 2);
  line.normal = (normal - slope * along).normalized();
  line.middle = origin + mean.x() * along + mean.y() * normal;
  line.angle_information = ss;
  line.offset_information = n;
  line.edges = static_cast<int>(edges.size());
  return true;
}

// Edges across the side from a to b, at most reach_px off it, then the line through them.
bool fit_side(const Grey& grey, const Vector2d& a, const Vector2d& b, double reach_px, Line& line) {
  const Vector2d along = (b - a).normalized(), normal(-along.y(), along.x());
  const double length = (b - a).norm(), skip = reach_px + corner_part * length;
  const int half = static_cast<int>(reach_px / step_px);
  std::vector<double> profile(static_cast<std::size_t>(2 * half + 1));
  std::vector<Vector2d> edges;  // (along the side, across it)
  for (double s = skip; s <= length - skip; s += 1) {
    const Vector2d at = a + s * along;
    bool inside = true;
    for (int i = -half; i <= half && inside; ++i) {
      const Vector2d px = at + i * step_px * normal;
      inside = grey.holds(px);
      if (inside) profile[static_cast<std::size_t>(i + half)] = grey.at(px);
    }
    double offset = 0;
    if (!inside) return false;
    if (edge_at(profile, offset) && std::abs(offset) < reach_px) edges.push_back({s, offset});
  }
  if (!through(edges, a, along, line)) return false;
  const double most = 2.5 * std::sqrt(line.squared / line.edges);
  edges.erase(std::remove_if(edges.begin(), edges.end(),
                             [&](const Vector2d& e) {
                               const Vector2d px = a + e.x() * along + e.y() * normal;
                               return std::abs(line.normal.dot(px - line.middle)) > most;
                             }),
              edges.end());
  return through(edges, a, along, line);
}

// Where two lines meet, and what errors of the edges of unit variance do to it.
bool meet(const Line& one, const Line& two, Vector2d& px, Matrix2d& covariance) {
  Matrix2d normals;
  normals << one.normal.transpose(), two.normal.transpose();
  constexpr double least_sine = 0.05;
  if (!(std::abs(normals.determinant()) > least_sine)) return false;
  const Matrix2d inverse = normals.inverse();
  px = inverse * Vector2d(one.normal.dot(one.middle), two.normal.dot(two.middle));
  Matrix2d offsets = Matrix2d::Zero();
  const Line* lines[2] = {&one, &two};
  for (int k = 0; k < 2; ++k)
    offsets(k, k) = 1 / lines[k]->offset_information +
                    (px - lines[k]->middle).squaredNorm() / lines[k]->angle_information;
  covariance = inverse * offsets * inverse.transpose();
  return true;
}

// How far from a side its rings are of one tone for sure: their width less the blur.
double reach_of_side(const TagCorners& corners, std::size_t k, double border) {
  const Vector2d a = corners.px[k], along = (corners.px[(k + 1) % 4] - a).normalized();
  double height = most_reach_px / border;
  for (const std::size_t other : {(k + 2) % 4, (k + 3) % 4}) {
    const Vector2d to = corners.px[other] - a;
    height = std::min(height, std::abs(along.x() * to.y() - along.y() * to.x()));
  }
  return ring_part * border * height - blur_px;
}

bool refine_once(const Grey& grey, double border, TagCorners& corners) {
  std::array<Line, 4> sides;
  double squared = 0;
  int freedom = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double reach_px = reach_of_side(corners, k, border);
    if (!(reach_px >= least_reach_px) ||
        !fit_side(grey, corners.px[k], corners.px[(k + 1) % 4], reach_px, sides[k]))
      return false;
    squared += sides[k].squared;
    freedom += sides[k].edges - 2;
  }
  const double variance = squared / freedom;
  for (std::size_t k = 0; k < 4; ++k) {
    if (!meet(sides[(k + 3) % 4], sides[k], corners.px[k], corners.covariance_px2[k])) return false;
    corners.covariance_px2[k] = variance * corners.covariance_px2[k] +
                                model_sigma_px * model_sigma_px * Matrix2d::Identity();
  }
  return true;
}

}  // namespace

bool refine_corners(const Image& image, double border, TagCorners& corners) {
  constexpr int rounds = 3;  // an edge off the profile's middle is cut by its end
  constexpr double farthest_px = 1;
  const Grey grey(image);
  const TagCorners start = corners;
  for (int i = 0; i < rounds; ++i)
    if (!refine_once(grey, border, corners)) return false;
  for (std::size_t k = 0; k < 4; ++k)
    if (!((corners.px[k] - start.px[k]).norm() < farthest_px)) return false;
  return true;
}

}  // namespace occ
