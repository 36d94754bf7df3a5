// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/saddles.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Vector2d;

constexpr int circle_points = 32, half_circle = circle_points / 2;

/// Derivatives of second order by differences of neighbouring pixels.
struct SecondDerivatives {
  float xx, yy, xy;
  float saddle() const { return xy * xy - xx * yy; }
};

LIBOCC_INLINE SecondDerivatives derivatives_at(const float* above, const float* here,
                                               const float* below) {
  return {here[-1] - 2 * here[0] + here[1], above[0] - 2 * here[0] + below[0],
          0.25F * (below[1] + above[-1] - below[-1] - above[1])};
}

template <Simd>
LIBOCC_INLINE void saddle_row_body(const float* above, const float* here, const float* below,
                                   int count, float* to) {
  for (int x = 3; x < count - 3; ++x)
    to[x] = derivatives_at(above + x, here + x, below + x).saddle();
}
LIBOCC_MULTIVERSION(saddle_row,
                    (const float* above, const float* here, const float* below, int count,
                     float* to),
                    (above, here, below, count, to))

struct SaddleMaximum {
  float response;
  int x, y;
};

constexpr int block = 32;

/// True if one of the pixels of a block has a larger response.
bool has_larger(const float* responses, float limit) {
  int larger = 0;
  for (int k = 0; k < block; ++k) larger |= responses[k] > limit;
  return larger != 0;
}

/// Local maxima of R above the threshold of the noise.
std::vector<SaddleMaximum> saddle_maxima(const GreyLevel& level) {
  // I_xy of a sharp corner with a contrast of 3 grey levels, the rounding of 8 bits included;
  // weaker ones are not measured to better than a pixel.
  constexpr float min_response = 0.6F * 0.6F;
  const int width = level.width(), height = level.height();
  const auto row_size = static_cast<std::size_t>(width);
  std::vector<float> kept(3 * row_size, 0.0F);
  const auto kept_row = [&](int y) {
    return kept.data() + static_cast<std::size_t>(y % 3) * row_size;
  };
  const auto respond = saddle_row_for(widest_simd());
  std::vector<SaddleMaximum> maxima;
  for (int y = 3; y < height - 3; ++y) {
    respond(level.row(y - 1), level.row(y), level.row(y + 1), width, kept_row(y));
    if (y < 5) continue;
    const float *above = kept_row(y - 2), *here = kept_row(y - 1), *below = kept_row(y);
    for (int x0 = 4; x0 < width - 4; x0 += block) {
      const int end = std::min(x0 + block, width - 4);
      if (end == x0 + block && !has_larger(here + x0, min_response)) continue;
      for (int x = x0; x < end; ++x) {
        const float r = here[x];
        if (!(r > min_response)) continue;
        // A plateau counts once, at its last pixel.
        const bool is_maximum = r >= here[x - 1] && r > here[x + 1] && r >= above[x - 1] &&
                                r >= above[x] && r >= above[x + 1] && r > below[x - 1] &&
                                r > below[x] && r > below[x + 1];
        if (is_maximum) maxima.push_back({r, x, y - 1});
      }
    }
  }
  return maxima;
}

/// Keeps the strongest, in the order of their rows.
void keep_strongest(std::vector<SaddleMaximum>& maxima, std::size_t count) {
  if (maxima.size() <= count) return;
  const auto stronger = [](const SaddleMaximum& a, const SaddleMaximum& b) {
    if (a.response != b.response) return a.response > b.response;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  };
  std::nth_element(maxima.begin(), maxima.begin() + static_cast<std::ptrdiff_t>(count),
                   maxima.end(), stronger);
  maxima.resize(count);
  std::sort(maxima.begin(), maxima.end(), [](const SaddleMaximum& a, const SaddleMaximum& b) {
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  });
}

/// Newton's steps to the saddle point; false if it is farther than 2 px.
bool move_to_saddle(const GreyLevel& level, Vector2d& p) {
  constexpr double max_shift_px = 2;
  constexpr int max_steps = 3;  // the start is a pixel with a large response
  const Vector2d start = p;
  for (int i = 0; i < max_steps; ++i) {
    if (!level.holds(p, 2)) return false;
    const int x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
    const float *above = level.row(y - 1) + x, *here = level.row(y) + x,
                *below = level.row(y + 1) + x;
    const SecondDerivatives d = derivatives_at(above, here, below);
    const double determinant = static_cast<double>(d.xx) * d.yy - static_cast<double>(d.xy) * d.xy;
    if (!(determinant < 0)) return false;
    const double gx = 0.5 * (here[1] - here[-1]), gy = 0.5 * (below[0] - above[0]);
    const Vector2d found(x - (d.yy * gx - d.xy * gy) / determinant,
                         y - (d.xx * gy - d.xy * gx) / determinant);
    if (!((found - start).norm() < max_shift_px)) return false;
    const bool settled = std::abs(found.x() - x) <= 0.5 && std::abs(found.y() - y) <= 0.5;
    p = found;
    if (settled) break;
  }
  return true;
}

/// Directions of the points of the circle.
const std::array<Vector2d, circle_points>& circle() {
  static const auto points = [] {
    std::array<Vector2d, circle_points> all;
    constexpr double step = 2 * 3.14159265358979323846 / circle_points;
    for (int k = 0; k < circle_points; ++k)
      all[static_cast<std::size_t>(k)] = {std::cos(step * k), std::sin(step * k)};
    return all;
  }();
  return points;
}

/// Crossings of the middle level by half a turn of grey levels with the period pi.
struct Crossings {
  double rising = -1, falling = -1;  // in points of the circle
};

std::optional<Crossings> crossings_of(const std::array<double, half_circle>& even) {
  Crossings found;
  int count = 0;
  for (int k = 0; k < half_circle; ++k) {
    const double a = even[static_cast<std::size_t>(k)],
                 b = even[static_cast<std::size_t>((k + 1) % half_circle)];
    if ((a > 0) == (b > 0)) continue;
    ++count;
    (b > 0 ? found.rising : found.falling) = k + a / (a - b);
  }
  if (count != 2) return std::nullopt;
  return found;
}

std::optional<SaddleCorner> classify_circle(const GreyLevel& level, const Vector2d& p,
                                            const CircleLimits& limits) {
  constexpr double min_contrast = 2.5;                     // grey levels; see min_response
  constexpr double min_sector = 20 / 180.0 * half_circle;  // a square tilted by 80 degrees
  if (!level.holds(p, limits.radius_px + 1)) return std::nullopt;
  std::array<double, half_circle> even, odd;
  const auto& directions = circle();
  for (std::size_t k = 0; k < half_circle; ++k) {
    const double one = level.at(p + limits.radius_px * directions[k]);
    const double two = level.at(p + limits.radius_px * directions[k + half_circle]);
    even[k] = 0.5 * (one + two);
    odd[k] = 0.5 * (one - two);
  }
  const auto [low, high] = std::minmax_element(even.begin(), even.end());
  const double contrast = *high - *low, middle = 0.5 * (*high + *low);
  if (!(contrast > min_contrast)) return std::nullopt;
  double of_even = 0, of_odd = 0;
  for (std::size_t k = 0; k < half_circle; ++k) {
    even[k] -= middle;
    of_even += even[k] * even[k];
    of_odd += odd[k] * odd[k];
  }
  if (!(of_odd < limits.max_odd_part * of_even)) return std::nullopt;
  const std::optional<Crossings> crossings = crossings_of(even);
  if (!crossings) return std::nullopt;
  double bright = crossings->falling - crossings->rising;
  if (bright < 0) bright += half_circle;
  if (bright < min_sector || bright > half_circle - min_sector) return std::nullopt;
  SaddleCorner corner;
  corner.px = p;
  corner.contrast = contrast;
  constexpr double step = 2 * 3.14159265358979323846 / circle_points;
  for (const int k : {0, 1}) {
    const double angle = step * (crossings->rising + k * bright);
    corner.edges[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
    corner.edges[static_cast<std::size_t>(k + 2)] = -corner.edges[static_cast<std::size_t>(k)];
  }
  return corner;
}

}  // namespace

std::optional<SaddleCorner> corner_near(const GreyLevel& level, Vector2d p,
                                        const CircleLimits& limits) {
  if (!move_to_saddle(level, p)) return std::nullopt;
  return classify_circle(level, p, limits);
}

std::vector<SaddleCorner> find_corners(const GreyLevel& level) {
  // More corners than those of the largest board, times the clutter of a textured background.
  constexpr std::size_t max_candidates = 20000;
  // The small circle is for squares of 5 to 10 px, the large one has less noise.
  constexpr double radii_px[] = {5, 2.5};
  std::vector<SaddleCorner> corners;
  if (level.width() < 12 || level.height() < 12) return corners;
  std::vector<SaddleMaximum> maxima = saddle_maxima(level);
  keep_strongest(maxima, max_candidates);
  for (const SaddleMaximum& maximum : maxima) {
    Vector2d p(maximum.x, maximum.y);
    if (!move_to_saddle(level, p)) continue;
    for (const double radius_px : radii_px) {
      CircleLimits limits;
      limits.radius_px = radius_px;
      const std::optional<SaddleCorner> corner = classify_circle(level, p, limits);
      if (!corner) continue;
      corners.push_back(*corner);
      break;
    }
  }
  return corners;
}

}  // namespace occ::internal::landmarks
