// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/outline.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace occ::internal::detect {
namespace {

// Max scatter of an ellipse's crossings: in pixels, and as a part of the semi-minor axis.
constexpr double rough_px = 0.3, rough = 0.03;

/// The component's box with a margin, at least one pixel inside the patch so that gradients exist.
struct OutlineBox {
  int x0, y0, x1, y1;
};

OutlineBox box_of(const Patch& patch, const Component& component) {
  constexpr int room = 2;
  return {std::max(component.x0 - room, patch.x0() + 1),
          std::max(component.y0 - room, patch.y0() + 1),
          std::min(component.x1 + room, patch.x0() + patch.width() - 2),
          std::min(component.y1 + room, patch.y0() + patch.height() - 2)};
}

/// Index of the first of `count` pixels, `step` apart, whose signal exceeds the level. Returns 0 if
/// it is the very first pixel (blob cut by the border) or if there is none.
int first_above(const float* first, std::ptrdiff_t step, int count, float level) {
  for (int i = 0; i < count; ++i, first += step)
    if (*first > level) return i;
  return 0;
}

}  // namespace

double weighted_mean_signal(const Patch& patch, const Component& component) {
  double sum = 0, squares = 0;
  for (int y = component.y0; y <= component.y1; ++y) {
    const float* row = patch.at(component.x0, y);
    for (int x = component.x0; x <= component.x1; ++x) {
      const double v = *row++;
      sum += v;
      squares += v * v;
    }
  }
  return sum > 0 ? squares / sum : 0;
}

std::vector<RimPoint> scan_outline(const Patch& patch, const Component& component, double level) {
  std::vector<RimPoint> out;
  const OutlineBox box = box_of(patch, component);
  const std::ptrdiff_t row = patch.width();
  const float threshold = static_cast<float>(level);
  // Follows one line across the blob from (x, y) in direction (dx, dy).
  const auto enter = [&](int x, int y, int dx, int dy, int count) {
    const std::ptrdiff_t step = dx + dy * row;
    const float* first = patch.at(x, y);
    const int i = first_above(first, step, count, threshold);
    if (i == 0) return;
    const float* inside = first + i * step;
    const float* outside = inside - step;
    const double fraction = (level - *outside) / (*inside - *outside);
    const Eigen::Vector2d gradient(inside[1] - inside[-1] + outside[1] - outside[-1],
                                   inside[row] - inside[-row] + outside[row] - outside[-row]);
    const Eigen::Vector2d direction(dx, dy);
    if (2 * std::pow(gradient.dot(direction), 2) < gradient.squaredNorm()) return;
    const double at = i - 1 + fraction;
    out.push_back({Eigen::Vector2d(x, y) + at * direction, -gradient.normalized(), 1});
  };
  const int width = box.x1 - box.x0 + 1, height = box.y1 - box.y0 + 1;
  for (int x = box.x0; x <= box.x1; ++x) {
    enter(x, box.y0, 0, 1, height);
    enter(x, box.y1, 0, -1, height);
  }
  for (int y = box.y0; y <= box.y1; ++y) {
    enter(box.x0, y, 1, 0, width);
    enter(box.x1, y, -1, 0, width);
  }
  return out;
}

std::optional<Outline> find_outline(const Patch& patch, const Component& component, double level) {
  std::vector<RimPoint> points = scan_outline(patch, component, level);
  std::optional<EllipseFit> fit = fit_ellipse(points);
  if (!fit) return std::nullopt;
  if (fit->rms_px > rough_px) {
    // A few crossings may belong to another object: refit without outliers.
    const std::size_t all = points.size();
    const double gate = std::max(1.0, 2 * fit->rms_px);
    const auto far = [&](const RimPoint& p) { return std::abs(fit->conic.distance(p.px)) > gate; };
    points.erase(std::remove_if(points.begin(), points.end(), far), points.end());
    if (4 * points.size() < 3 * all) return Outline{fit->conic, true};
    const std::optional<EllipseFit> again = fit_ellipse(points, fit->conic);
    if (again) fit = again;
  }
  const double size = fit->conic.ellipse().semi_minor_px;
  return Outline{fit->conic, fit->rms_px > std::max(rough_px, rough * size)};
}

}  // namespace occ::internal::detect
