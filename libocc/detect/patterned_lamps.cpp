// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/patterned_lamps.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/flood.hpp"
#include "libocc/detect/internal/measure.hpp"
#include "libocc/detect/internal/patch.hpp"
#include "libocc/detect/internal/pixel_hull.hpp"
#include "libocc/detect/internal/quadrilateral.hpp"

namespace occ::internal::detect {
namespace {

constexpr std::size_t max_parts = 256;  // the largest ones
constexpr int min_part_px = 12;         // area; smaller blobs are specks
// Parts of one lamp: gap over the length of the shorter part, ratio of their areas and of their
// brightness.
constexpr double max_gap = 0.2, min_area_ratio = 0.04, min_brightness_ratio = 0.4;
// Least share of the outline that the parts fill. Two tubes of 3 cm with a gap of 10 cm: 0.4.
constexpr double min_filled_by_parts = 0.2;
// Error of the centre of an outline of whole pixels, and its part of the length: along a narrow
// tube, the blurred light falls with the distance.
constexpr double outline_sigma_px = 0.1, outline_sigma = 0.0015;
// Largest difference between the centre of the outline and the centroid of the light, over the
// length. A lamp with a dark side exceeds it; a light that falls by a third along a tube does not.
constexpr double max_asymmetry = 0.1;

struct BrightPart {
  std::size_t index = 0;  // of component and blob
  std::vector<Pixel> hull;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double length_px = 0;  // largest distance between two corners of the hull
  double bright_px = 0;  // pixels above the level of the outline
  double mean_dn = 0;    // above background, weighted by itself
  bool saturated = false;
};

bool comes_before_in_image(const Pixel& a, const Pixel& b) {
  return std::pair(a.y, a.x) < std::pair(b.y, b.x);
}

/// Difference of a region from a component in place and area [px].
double difference_px(const Places& region, const Component& component) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& [x, y] : region) sum += Eigen::Vector2d(x, y);
  const auto area = static_cast<double>(region.size());
  return (sum / area - component.shape.mean()).norm() +
         std::abs(area - component.area_px) / std::sqrt(static_cast<double>(component.area_px));
}

/// The connected pixels (8 neighbours) of the component's box above a level that are most likely
/// the component: its box may contain others.
Places pixels_of(const Patch& patch, const Component& component, double level) {
  const int x0 = component.x0, y0 = component.y0, x1 = component.x1, y1 = component.y1;
  const int width = x1 - x0 + 1;
  std::vector<char> taken(static_cast<std::size_t>(width) * static_cast<std::size_t>(y1 - y0 + 1));
  const auto take = [&](int x, int y) {
    if (x < x0 || x > x1 || y < y0 || y > y1 || !(*patch.at(x, y) > level)) return false;
    char& is_taken = taken[static_cast<std::size_t>((y - y0) * width + x - x0)];
    return !std::exchange(is_taken, 1);
  };
  Places best;
  double least = infinity;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      if (!take(x, y)) continue;
      Places region = flood({x, y}, all_steps, take);
      const double off = difference_px(region, component);
      if (off < least) least = off, best = std::move(region);
    }
  return best;
}

/// Largest distance between two corners [px].
double length_px(const std::vector<Pixel>& hull) {
  std::int64_t best = 0;
  for (const Pixel& a : hull)
    for (const Pixel& b : hull)
      best = std::max(best, (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y));
  return std::sqrt(static_cast<double>(best));
}

std::optional<BrightPart> part_of(const LinearImage& image, const DetectOptions& options,
                                  const Component& component, std::size_t index, Patch& scratch) {
  const double limit_dn = image.linear_dn(threshold_dn(component, options));
  scratch.load(image, component, limit_dn, options.sensor ? &*options.sensor : nullptr);
  const Places places =
      pixels_of(scratch, component, std::max(0.0, limit_dn - scratch.background_dn()));
  double sum = 0, squares = 0;
  for (const auto& [x, y] : places) {
    const double signal = *scratch.at(x, y);
    sum += signal;
    squares += square(signal);
  }
  if (!(sum > 0)) return std::nullopt;
  BrightPart part;
  part.index = index;
  part.mean_dn = squares / sum;
  part.saturated = component.saturated_px > 0;
  std::vector<Pixel> pixels;
  for (const auto& [x, y] : places)
    if (*scratch.at(x, y) > outline_level * part.mean_dn) pixels.push_back({x, y});
  part.bright_px = static_cast<double>(pixels.size());
  std::sort(pixels.begin(), pixels.end(), comes_before_in_image);
  part.hull = convex_hull(pixels);
  if (part.hull.size() < 3) return std::nullopt;
  part.centre_px = component.shape.mean();
  part.length_px = length_px(part.hull);
  return part;
}

/// Distance from a pixel to a side [px].
double distance_px(const Pixel& p, const Pixel& from, const Pixel& to) {
  const auto difference = [](const Pixel& a, const Pixel& b) {
    return Eigen::Vector2d(static_cast<double>(a.x - b.x), static_cast<double>(a.y - b.y));
  };
  const Eigen::Vector2d side = difference(to, from), off = difference(p, from);
  const double along = std::clamp(off.dot(side) / side.squaredNorm(), 0.0, 1.0);
  return (off - along * side).norm();
}

/// Distance between two hulls that do not overlap [px].
double gap_px(const std::vector<Pixel>& a, const std::vector<Pixel>& b) {
  double least = infinity;
  for (const auto& [points, sides] : {std::pair(&a, &b), std::pair(&b, &a)})
    for (const Pixel& p : *points)
      for (std::size_t i = 0; i < sides->size(); ++i)
        least = std::min(least, distance_px(p, (*sides)[i], (*sides)[(i + 1) % sides->size()]));
  return least;
}

/// Gap between two parts over the length of the shorter one; infinite if they are far apart or
/// differ too much to be parts of one lamp.
double relative_gap(const BrightPart& a, const BrightPart& b) {
  if (std::min(a.bright_px, b.bright_px) < min_area_ratio * std::max(a.bright_px, b.bright_px))
    return infinity;
  const bool both_clipped = a.saturated && b.saturated;
  if (!both_clipped &&
      std::min(a.mean_dn, b.mean_dn) < min_brightness_ratio * std::max(a.mean_dn, b.mean_dn))
    return infinity;
  const double shorter_px = std::min(a.length_px, b.length_px);
  const double at_least_px = (a.centre_px - b.centre_px).norm() - a.length_px - b.length_px;
  if (at_least_px > max_gap * shorter_px) return infinity;
  return gap_px(a.hull, b.hull) / shorter_px;
}

struct Group {
  std::vector<std::size_t> parts;
  std::vector<Pixel> hull;
  double bright_px = 0;

  bool is_filled() const { return bright_px >= min_filled_by_parts * pixels_inside(hull); }
};

Group united(const Group& a, const Group& b) {
  Group both = a;
  both.parts.insert(both.parts.end(), b.parts.begin(), b.parts.end());
  both.bright_px += b.bright_px;
  both.hull.insert(both.hull.end(), b.hull.begin(), b.hull.end());
  std::sort(both.hull.begin(), both.hull.end(), comes_before_in_image);
  both.hull = convex_hull(both.hull);
  return both;
}

/// The parts of each lamp. The closest ones are joined first. Those of two lamps would leave much
/// of their common hull dark.
std::vector<Group> groups_of(const std::vector<BrightPart>& parts) {
  std::vector<Group> groups;
  std::vector<std::size_t> group_of(parts.size());
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    groups.push_back({{i}, parts[i].hull, parts[i].bright_px});
    group_of[i] = i;
    for (std::size_t j = 0; j < i; ++j)
      if (const double gap = relative_gap(parts[i], parts[j]); gap <= max_gap)
        pairs.emplace_back(gap, j, i);
  }
  std::sort(pairs.begin(), pairs.end());
  for (const auto& [gap, i, j] : pairs) {
    const std::size_t to = group_of[i], from = group_of[j];
    if (to == from) continue;
    Group both = united(groups[to], groups[from]);
    if (!both.is_filled()) continue;
    for (const std::size_t part : groups[from].parts) group_of[part] = to;
    groups[to] = std::move(both);
    groups[from].parts.clear();
  }
  return groups;
}

/// The blob of a lamp with these parts; empty if they do not look like one lamp.
std::optional<Blob> joined(const std::vector<BrightPart>& parts, const Group& group,
                           const std::vector<Component>& components,
                           const std::vector<Blob>& blobs) {
  if (!group.is_filled()) return std::nullopt;
  Component all;
  for (const std::size_t i : group.parts) all += components[parts[i].index];
  const AreaMoments outline = area_moments(group.hull);
  const Eigen::Vector2d apart = all.grey.mean() - outline.centroid_px;
  if (apart.norm() > max_asymmetry * length_px(group.hull)) return std::nullopt;
  Blob blob = blobs[parts[group.parts.front()].index];
  double flux_variance = 0;
  blob.flux_dn = 0;
  for (const std::size_t i : group.parts) {
    const Blob& part = blobs[parts[i].index];
    blob.flux_dn += part.flux_dn;
    flux_variance += square(part.flux_sigma_dn);
    blob.peak_dn = std::max(blob.peak_dn, part.peak_dn);
    blob.saturated = blob.saturated || part.saturated;
    blob.cut_by_border = blob.cut_by_border || part.cut_by_border;
  }
  blob.flux_sigma_dn = std::sqrt(flux_variance);
  blob.area_px = all.area_px;
  blob.x0 = all.x0;
  blob.y0 = all.y0;
  blob.x1 = all.x1;
  blob.y1 = all.y1;
  blob.centroid_px = outline.centroid_px;
  const double sigma_px = std::hypot(outline_sigma_px, outline_sigma * length_px(group.hull));
  blob.covariance_px2 = square(sigma_px) * Eigen::Matrix2d::Identity();
  blob.ellipse = ellipse_of(outline.centroid_px, outline.second_moments_px2);
  blob.light_response_px2.setZero();
  blob.rim.clear();
  blob.corners_px.clear();
  blob.rim_covariance_px2.setZero();
  blob.merged = false;
  blob.patterned = true;
  if (blob.cut_by_border) inflate_covariance(blob);
  return blob;
}

}  // namespace

void join_parts(const LinearImage& image, const DetectOptions& options,
                const std::vector<Component>& components, std::vector<Blob>& blobs) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < components.size(); ++i)
    if (components[i].area_px >= min_part_px && is_measurable(components[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return components[a].area_px > components[b].area_px;
  });
  order.resize(std::min(order.size(), max_parts));
  std::vector<BrightPart> parts;
  Patch scratch;
  for (const std::size_t i : order)
    if (auto part = part_of(image, options, components[i], i, scratch))
      parts.push_back(*std::move(part));
  std::vector<char> is_part(blobs.size());
  std::vector<Blob> lamps;
  for (const Group& group : groups_of(parts)) {
    if (group.parts.empty()) continue;
    if (group.parts.size() == 1 && !blobs[parts[group.parts.front()].index].merged) continue;
    auto lamp = joined(parts, group, components, blobs);
    if (!lamp) continue;
    for (const std::size_t i : group.parts) is_part[parts[i].index] = 1;
    lamps.push_back(*std::move(lamp));
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < blobs.size(); ++i)
    if (!is_part[i]) std::swap(blobs[kept++], blobs[i]);
  blobs.resize(kept);
  std::move(lamps.begin(), lamps.end(), std::back_inserter(blobs));
}

}  // namespace occ::internal::detect
