// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/detect/internal/plateau.hpp"
#include "libocc/detect/internal/polygon.hpp"
#include "libocc/detect/internal/rim_profiles.hpp"
#include "libocc/detect/internal/rim_tail.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

// The ends of a tube determine each other's corners slowly. More passes are only for defocus.
constexpr int max_sharp_polygon_passes = 12, max_polygon_passes = 20;
constexpr double polygon_settled_px = 0.01;  // convergence limit for centroid, size and blur
// Min distance of a rim point from a corner: beyond it, the blur of the other side takes less than
// a fourteenth of the light, which RimProfiles allows for.
constexpr double corner_sigmas = 1.5;
constexpr double saturated_corner_px = 3;  // the rounding of a clipped corner is not modelled

// Error of a side by the model of an edge, a Gaussian for the blur and the pixel's box, and by that
// of the plateau. Found on rendered panels, at all angles.
constexpr double edge_model_px = 0.001;

// Scatter of the light over its level from which on each row and column has a level of its own, as
// of single LEDs behind a diffuser.
constexpr double max_texture = 0.04;
// Level of the outline of a rectangle whose textured light has dark gaps along the sides.
constexpr double dim_level = 0.25;
// Min area of such a rectangle with its blur, over that of the blob: it may be one of several
// lamps.
constexpr double min_covered = 0.8;

/// Lines across a side whose points no corner rounds: beyond `margin_px` from the side's ends, and
/// of a lamp that the image border cuts away from it, where there may be one just outside.
std::vector<RimLine> lines_across(const Patch& patch, const Component& component,
                                  const Polygon& polygon, std::size_t side, double margin_px) {
  constexpr int border_px = 7;
  std::vector<RimLine> lines = polygon.lines(side, margin_px);
  if (!component.touches_border) return lines;
  const auto is_near_border = [&](const RimLine& line) {
    const Eigen::Vector2d px = line.point(line.edge);
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    return !patch.contains(x - border_px, y - border_px) ||
           !patch.contains(x + border_px, y + border_px);
  };
  lines.erase(std::remove_if(lines.begin(), lines.end(), is_near_border), lines.end());
  return lines;
}

/// Points of each side.
using SidePoints = std::vector<std::vector<RimPoint>>;

std::vector<RimPoint> all_of(const SidePoints& points) {
  std::vector<RimPoint> all;
  for (const auto& side : points) all.insert(all.end(), side.begin(), side.end());
  return all;
}

std::size_t count(const SidePoints& points) {
  std::size_t sum = 0;
  for (const auto& side : points) sum += side.size();
  return sum;
}

/// Shift of the polygon's centroid when a side moves outwards by one pixel: the area that it adds,
/// about its middle.
Eigen::Vector2d centroid_by_side(const Polygon& polygon, std::size_t side) {
  const Eigen::Vector2d from = polygon.corners_px[side], to = polygon.corner_after(side);
  return (0.5 * (from + to) - polygon.centroid_px) * (to - from).norm() / polygon.area_px2;
}

/// Distance by which a side may lie farther outside than it was measured: from the measured edge to
/// where the light falls below a quarter of the plateau, beyond the blur. Tubes have dim ends.
double softness_px(const Patch& patch, const Polygon& polygon, std::size_t side, double level,
                   double blur_px) {
  constexpr double low = 0.25, low_sigmas = 0.674;   // where a blurred step falls to that
  constexpr double certain = 1.5, certain_px = 0.5;  // the blur is not known better
  const double max_px = 0.5 * std::sqrt(polygon.second_moments_px2.trace());
  std::vector<double> excess;
  for (const RimLine& line : polygon.lines(side, 0)) {
    const double expected_px = certain * low_sigmas * blur_px / line.cosine() + certain_px;
    double beyond = expected_px;
    for (; beyond < max_px; ++beyond) {
      const int at = static_cast<int>(std::lround(line.edge + line.outward * beyond));
      if (!line.inside(patch, at, at) || *line.pixel(patch, at) < low * level) break;
    }
    excess.push_back((beyond - expected_px) * line.cosine());
  }
  return excess.empty() ? 0 : median(excess);
}

/// True if no side may lie farther outside by more than a share of the polygon's extent there.
bool has_true_size(const Polygon& polygon, const std::vector<double>& softness) {
  constexpr double max_share = 0.05;
  for (std::size_t i = 0; i < softness.size(); ++i) {
    const Eigen::Vector2d normal = polygon.normal(i);
    double lowest = infinity, highest = -infinity;
    for (const Eigen::Vector2d& corner : polygon.corners_px) {
      lowest = std::min(lowest, corner.dot(normal));
      highest = std::max(highest, corner.dot(normal));
    }
    if (softness[i] > max_share * (highest - lowest)) return false;
  }
  return true;
}

/// Covariance of the polygon's centroid by the noise of the points. A side that turns by r moves it
/// by length^3 r / 12 / area along the side.
Eigen::Matrix2d centre_covariance(const Polygon& polygon, const SidePoints& points) {
  constexpr double unmeasured_px = 0.5;  // error of a side without points
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < polygon.sides.size(); ++i) {
    const Eigen::Vector2d along = polygon.corner_after(i) - polygon.corners_px[i];
    double information = 0;
    for (const RimPoint& point : points[i]) information += 1 / square(point.sigma_px);
    const double variance =
        information > 0 ? 1 / information + square(edge_model_px) : square(unmeasured_px);
    const Eigen::Vector2d by_shift = centroid_by_side(polygon, i);
    // Points evenly spaced along a side: the variance of its direction is 12 times as large, over
    // the square of its length.
    const Eigen::Vector2d by_turn = along.norm() / std::sqrt(12.0) / polygon.area_px2 * along;
    sum += variance * (by_shift * by_shift.transpose() + by_turn * by_turn.transpose());
  }
  return sum;
}

/// Covariance of the centroid by the error of the plateau at the middle of each side. `by_level`:
/// shift of a side per grey level.
Eigen::Matrix2d covariance_of_plateau(const Polygon& polygon, const Plateau& plateau,
                                      double pixel_variance, double by_level) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  const auto middle = [&](std::size_t i) -> Eigen::Vector2d {
    return 0.5 * (polygon.corners_px[i] + polygon.corner_after(i));
  };
  for (std::size_t i = 0; i < polygon.sides.size(); ++i)
    for (std::size_t j = 0; j < polygon.sides.size(); ++j)
      sum += plateau.level_covariance(middle(i), middle(j)) * centroid_by_side(polygon, i) *
             centroid_by_side(polygon, j).transpose();
  return square(by_level) * pixel_variance * sum;
}

/// Mean square of the sums of this many neighbouring residuals from a side over their variances,
/// beyond chance; at least 1. The errors of neighbours may be alike, as by JPEG or the texture of
/// the light: then sums of several scatter by more than their variances.
double excess_scatter(const Polygon& polygon, const SidePoints& points, std::size_t neighbours,
                      double sigmas_of_chance) {
  constexpr double unknowns = 3;  // of a side
  double chi2 = 0, dof = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PolygonSide& side = polygon.sides[i];
    const std::size_t sums = points[i].size() / neighbours;
    const double kept = static_cast<double>(sums) - unknowns;
    if (neighbours > 1 && kept <= 0) continue;
    dof += std::max(0.0, kept);
    double sum = 0;
    for (std::size_t k = 0; k < sums * neighbours; ++k) {
      const RimPoint& point = points[i][k];
      const double off = point.px[side.column ? 1 : 0] - side.edge(side.u_of(point.px));
      const double slope = side.slope(side.u_of(point.px));
      sum += off / (point.sigma_px * std::sqrt(1 + square(slope)));
      if ((k + 1) % neighbours != 0) continue;
      chi2 += square(sum) / static_cast<double>(neighbours);
      sum = 0;
    }
  }
  return dof < 1 ? 1 : std::max(1.0, chi2 / dof - sigmas_of_chance * std::sqrt(2 / dof));
}

/// That of a rim that is not clipped: of single points, or of groups of neighbours.
double excess_of_measured_edges(const Polygon& polygon, const SidePoints& points) {
  constexpr std::size_t group = 6;
  return std::max(excess_scatter(polygon, points, 1, 1),
                  excess_scatter(polygon, points, group, 2));  // few degrees of freedom
}

/// True if the sides turn between the corners by a part of the 360 degrees of all corners, as those
/// of a polygon around a curve do: the points in the middle half of a side lie outside those in its
/// outer quarters. A lens bends the sides less.
bool is_curve(const Polygon& polygon, const SidePoints& points) {
  constexpr double max_turn_rad = 0.12 * 2 * pi;
  if (points.size() <= 4) return false;
  double turn_rad = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d from = polygon.corners_px[i], to = polygon.corner_after(i);
    const double length = (to - from).norm();
    const Eigen::Vector2d along = (to - from) / length, normal = polygon.normal(i);
    double low = length, high = 0;
    for (const RimPoint& point : points[i]) {
      low = std::min(low, along.dot(point.px - from));
      high = std::max(high, along.dot(point.px - from));
    }
    const double half = 0.5 * (high - low);
    struct {
      double count = 0, off = 0, at2 = 0;
    } middle, outer;
    for (const RimPoint& point : points[i]) {
      const double at = along.dot(point.px - from) - low - half;
      auto& sums = std::abs(at) < 0.5 * half ? middle : outer;
      ++sums.count;
      sums.off += normal.dot(point.px - from);
      sums.at2 += square(at);
    }
    if (middle.count < 1 || outer.count < 2) continue;
    const double bulge_px = middle.off / middle.count - outer.off / outer.count;
    const double by_curvature_px2 = 0.5 * (outer.at2 / outer.count - middle.at2 / middle.count);
    if (by_curvature_px2 > 0) turn_rad += bulge_px / by_curvature_px2 * length;
  }
  return turn_rad > max_turn_rad;
}

/// Joins the points of all sides, with the sides' normals, and inflates their variances by the
/// excess of the observed scatter.
void finish(const SidePoints& points, double excess, PolygonRim& rim) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PolygonSide& side = rim.polygon.sides[i];
    for (RimPoint point : points[i]) {
      const double slope = side.slope(side.u_of(point.px));
      const double cosine = side.outward / std::sqrt(1 + square(slope));
      point.normal = side.column ? Eigen::Vector2d(-slope * cosine, cosine)
                                 : Eigen::Vector2d(cosine, -slope * cosine);
      point.sigma_px *= std::sqrt(excess);
      rim.points.push_back(point);
    }
  }
  rim.centre_covariance_px2 += excess * centre_covariance(rim.polygon, points);
}

/// Errors of the estimated plateau, as for discs (rim.cpp).
void add_plateau_noise(const RimModel& model, const RimProfiles& profiles, const SidePoints& points,
                       PolygonRim& rim) {
  const double pixel_variance = model.noise.variance(model.plateau.level());
  const Eigen::Matrix2d response = shift_response(all_of(points), profiles.by_gradient);
  const double growth = profiles.by_level / static_cast<double>(count(points));
  if (model.plateau.uniform()) rim.light_response_px2 = -model.plateau.level() * response;
  rim.common_covariance_px2 = plateau_errors(model, growth, response);
  // Independent errors of four sides: half of their variance for a shift, less for growth and
  // stretch.
  rim.common_covariance_px2.diagonal().array() += square(edge_model_px) / 2;
  rim.centre_covariance_px2 =
      covariance_of_plateau(rim.polygon, model.plateau, pixel_variance, growth);
}

/// The slope of a textured light at the edge is unknown. Found on rendered panels with single LEDs:
/// all sides err alike by a share of the texture times the blur.
void add_texture(double texture_px, PolygonRim& rim) {
  constexpr double growth = 0.5, other = 0.15;
  rim.common_covariance_px2.diagonal().array() += square(other * texture_px);
  rim.common_covariance_px2(0, 0) += square(growth * texture_px);
  rim.centre_covariance_px2.diagonal().array() += square(other * texture_px);
}

/// Adds the softness of each side to its points, as an error that is common to them. The centroid
/// is that between the measured sides and those at the end of the light; soft sides opposite to
/// each other, as of a tube, are about equally soft.
void add_side_softness(const std::vector<double>& softness, const SidePoints& points,
                       PolygonRim& rim) {
  constexpr double unequal = 0.1;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  std::size_t k = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d by_side = softness[i] * centroid_by_side(rim.polygon, i);
    shift += by_side;
    rim.centre_covariance_px2 += square(unequal) * by_side * by_side.transpose();
    const double common_px = softness[i] * std::sqrt(static_cast<double>(points[i].size()));
    for (std::size_t n = 0; n < points[i].size(); ++n, ++k)
      rim.points[k].sigma_px = std::hypot(rim.points[k].sigma_px, common_px);
  }
  rim.polygon.centroid_px += 0.5 * shift;
  rim.centre_covariance_px2 += 0.25 * shift * shift.transpose();
}

/// Fits the sides to their points. Empty if the polygon collapses.
bool refit(const SidePoints& points, Polygon& polygon) {
  for (std::size_t i = 0; i < points.size(); ++i) polygon.fit_side(i, points[i]);
  return polygon.update();
}

/// Area of the polygon and its blur, two sigmas wide.
double blurred_area_px2(const Polygon& polygon, double blur_px) {
  return polygon.area_px2 + 2 * blur_px * polygon.perimeter_px();
}

bool is_settled(const Polygon& before, const Polygon& after, double limit_px) {
  return (after.centroid_px - before.centroid_px).norm() < limit_px &&
         std::abs(std::sqrt(after.area_px2) - std::sqrt(before.area_px2)) < limit_px;
}

}  // namespace

std::optional<PolygonRim> measure_polygon(const Patch& patch, const Component& component,
                                          double blur_px) {
  const double mean = weighted_mean_signal(patch, component);
  std::optional<Polygon> polygon = find_polygon(patch, component, 0.5 * mean, blur_px);
  const bool gaps = !polygon;
  if (gaps) polygon = find_polygon(patch, component, dim_level * mean, blur_px);
  if (!polygon || (gaps && polygon->sides.size() != 4)) return std::nullopt;
  bool textured = false;
  for (int pass = 0; pass < max_polygon_passes; ++pass) {
    const std::optional<Plateau> plateau = Plateau::fit(patch, *polygon, blur_px);
    if (!plateau || !(plateau->level() > 0)) return std::nullopt;
    textured = textured || plateau->texture() > max_texture;
    if (gaps && !textured) return std::nullopt;
    const RimModel model{*plateau, noise_of(patch, *plateau), blur_px, textured};
    RimProfiles profiles(patch, model, polygon->centroid_px);
    SidePoints points(polygon->sides.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t first = profiles.points.size();
      for (const RimLine& line :
           lines_across(patch, component, *polygon, i, corner_sigmas * blur_px))
        profiles.add(line, AdjacentSides(*polygon, line, i, blur_px));
      points[i].assign(profiles.points.begin() + static_cast<std::ptrdiff_t>(first),
                       profiles.points.end());
    }
    if (count(points) < 4) {
      // All lines across a defocused lamp seem to have light outside.
      constexpr double broader = 1.6;
      blur_px *= broader;
      if (profiles.dazzled == 0 || blur_px > max_blur_px) return std::nullopt;
      continue;
    }
    const Polygon before = *polygon;
    if (!refit(points, *polygon)) return std::nullopt;
    const double blur = std::clamp(blur_px * (1 + std::clamp(profiles.blur_change(), -0.4, 0.6)),
                                   min_blur_px, max_blur_px);
    const bool settled = is_settled(before, *polygon, polygon_settled_px) &&
                         std::abs(blur - blur_px) < polygon_settled_px;
    if (settled || pass + 1 == max_polygon_passes) {
      if (!settled || profiles.misfit() > max_misfit) return std::nullopt;
      if (is_curve(*polygon, points)) return std::nullopt;
      if (textured && blurred_area_px2(*polygon, blur_px) < min_covered * component.area_px)
        return std::nullopt;
      PolygonRim rim;
      rim.polygon = *polygon;
      add_plateau_noise(model, profiles, points, rim);
      add_uneven_light(model, profiles, rim.common_covariance_px2, rim.centre_covariance_px2);
      if (textured) add_texture(plateau->texture() * blur_px, rim);
      std::vector<double> softness;
      for (std::size_t i = 0; i < points.size(); ++i)
        softness.push_back(softness_px(patch, *polygon, i, model.plateau.level(), blur_px));
      finish(points, excess_of_measured_edges(rim.polygon, points), rim);
      rim.is_whole = has_true_size(*polygon, softness);
      add_side_softness(softness, points, rim);
      return rim;
    }
    if (pass + 1 >= max_sharp_polygon_passes && profiles.misfit() > max_misfit) return std::nullopt;
    blur_px = blur;
  }
  return std::nullopt;
}

std::optional<PolygonRim> measure_saturated_polygon(const Patch& patch,
                                                    const Component& component) {
  const double level = rim_level * patch.full_scale_signal();
  if (!(level > 0)) return std::nullopt;
  std::optional<Polygon> polygon =
      find_polygon(patch, component, level, saturated_corner_px / corner_sigmas);
  if (!polygon) return std::nullopt;
  double last_rim_px = 0;
  for (int pass = 0; pass < max_saturated_passes; ++pass) {
    std::vector<std::vector<RimLine>> lines;
    for (std::size_t i = 0; i < polygon->sides.size(); ++i)
      lines.push_back(lines_across(patch, component, *polygon, i, saturated_corner_px));
    const auto all_lines = [&](auto&& f) {
      for (const auto& side : lines) std::for_each(side.begin(), side.end(), f);
    };
    const Tail tail = fit_tail(patch, all_lines, level);
    if (!(tail.slope > 0) || !std::isfinite(tail.bend)) return std::nullopt;
    SidePoints points;
    for (const auto& side : lines)
      points.push_back(fit_points(
          patch, [&](auto&& f) { std::for_each(side.begin(), side.end(), f); }, tail, level));
    if (count(points) < 4) return std::nullopt;
    const Polygon before = *polygon;
    if (!refit(points, *polygon)) return std::nullopt;
    const bool settled = is_settled(before, *polygon, saturated_settled_px) &&
                         std::abs(tail.rim() - last_rim_px) < saturated_settled_px;
    last_rim_px = tail.rim();
    if (!settled) continue;
    if (is_curve(*polygon, points)) return std::nullopt;
    PolygonRim rim;
    rim.polygon = *polygon;
    const double radius_px = std::sqrt(polygon->area_px2 / pi);
    const std::vector<RimPoint> all_points = all_of(points);
    rim.point_response = tail.light_response(radius_px);
    rim.light_response_px2 =
        shift_response(all_points, rim.point_response.moves(all_points, polygon->centroid_px));
    add_saturated_shift(tail_misfit(patch, all_lines, tail, level), tail.is_halo(radius_px),
                        rim.light_response_px2, rim.common_covariance_px2,
                        rim.centre_covariance_px2);
    finish(points, excess_scatter(rim.polygon, points, 1, 1), rim);
    add_unclipped_part(patch, component, rim.points, rim.centre_covariance_px2);
    return rim;
  }
  return std::nullopt;
}

}  // namespace occ::internal::detect
