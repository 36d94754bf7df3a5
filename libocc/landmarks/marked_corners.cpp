// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/marked_corners.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/landmarks/internal/corner_fit.hpp"
#include "libocc/landmarks/internal/edge_bend.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"
#include "libocc/landmarks/internal/grid_scatter.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;

/// Predicted image of a corner.
struct CornerPrediction {
  Matrix3d px_from_board = Matrix3d::Identity();
  Vector2d px = Vector2d::Zero();
  Matrix2d px_per_m = Matrix2d::Identity();  // derivative by the position on the board

  Vector2d at(const Vector2d& offset_m) const { return px + px_per_m * offset_m; }
  Vector2d mapped(const Vector2d& at_m) const {
    return (px_from_board * at_m.homogeneous()).hnormalized();
  }
  /// Distance of a line that is `distance_m` away on the board and parallel to an edge.
  double clearance_px(double distance_m) const {
    return distance_m * std::abs(px_per_m.determinant()) /
           std::max(px_per_m.col(0).norm(), px_per_m.col(1).norm());
  }
};

/// A position on the board with its image.
struct KnownPoint {
  Vector2d at_m, px;
};

/// Points around `at_m` within `reach_m` per axis, the nearest first.
std::vector<KnownPoint> nearest_points(const std::vector<KnownPoint>& all, const Vector2d& at_m,
                                       double reach_m, std::size_t max_points) {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector2d off_m = all[i].at_m - at_m;
    if (off_m.cwiseAbs().maxCoeff() <= reach_m) near.emplace_back(off_m.squaredNorm(), i);
  }
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), max_points));
  std::vector<KnownPoint> points;
  for (const auto& [distance, i] : near) points.push_back(all[i]);
  return points;
}

/// Prediction by a homography from known points around the corner.
std::optional<CornerPrediction> predicted(const std::vector<KnownPoint>& known,
                                          const Vector2d& at_m) {
  std::vector<Vector2d> plane_m, px;
  for (const KnownPoint& point : known) {
    plane_m.push_back(point.at_m);
    px.push_back(point.px);
  }
  const Matrix3d h = plane_homography(plane_m, px);
  const Eigen::Vector3d image = h * at_m.homogeneous();
  CornerPrediction found;
  found.px_from_board = h;
  found.px = image.hnormalized();
  found.px_per_m = (h.topLeftCorner<2, 2>() - found.px * h.block<1, 2>(2, 0)) / image.z();
  if (!found.px.allFinite() || !found.px_per_m.allFinite()) return std::nullopt;
  return found;
}

/// Predicts corners by the nearest tags.
class TagPredictor {
 public:
  TagPredictor(const MarkedBoard& board, const std::vector<AprilTag>& detected,
               const BoardTagPlacement& placement)
      : reach_m_(board.reach_m) {
    for (const PlacedTag& placed : placement.tags) {
      const BoardTag& tag = board.tags[placed.on_board];
      const Vector2d middle = 0.5 * (tag.corners_m[0] + tag.corners_m[2]);
      tags_.push_back({middle, &tag, &detected[placed.detected]});
    }
  }

  /// nullopt if no tag is within reach.
  std::optional<CornerPrediction> operator()(const Vector2d& at_m) const {
    constexpr std::size_t max_tags = 4;  // those around a corner; farther ones add distortion
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      const Vector2d off_m = tags_[i].middle_m - at_m;
      if (off_m.cwiseAbs().maxCoeff() <= reach_m_) near.emplace_back(off_m.squaredNorm(), i);
    }
    if (near.empty()) return std::nullopt;
    std::sort(near.begin(), near.end());
    near.resize(std::min(near.size(), max_tags));
    std::vector<KnownPoint> known;
    for (const auto& [distance, i] : near)
      for (std::size_t k = 0; k < 4; ++k)
        known.push_back({tags_[i].on_board->corners_m[k], tags_[i].seen->corners_px[k]});
    return predicted(known, at_m);
  }

 private:
  struct SeenTag {
    Vector2d middle_m;
    const BoardTag* on_board;
    const AprilTag* seen;
  };

  double reach_m_;
  std::vector<SeenTag> tags_;
};

/// Prediction by measured corners; nullopt if they are too few or on a line.
std::optional<CornerPrediction> predicted_by(const std::vector<KnownPoint>& near,
                                             const Vector2d& at_m, double step_m) {
  constexpr std::size_t min_points = 6;
  constexpr double min_extent = 0.15;  // r.m.s. across the longest direction, of step_m
  if (near.size() < min_points) return std::nullopt;
  const auto n = static_cast<double>(near.size());
  Vector2d mean = Vector2d::Zero();
  for (const KnownPoint& point : near) mean += point.at_m / n;
  Matrix2d scatter = Matrix2d::Zero();
  for (const KnownPoint& point : near)
    scatter += (point.at_m - mean) * (point.at_m - mean).transpose() / n;
  const double smallest =
      0.5 * (scatter.trace() - std::hypot(scatter(0, 0) - scatter(1, 1), 2 * scatter(0, 1)));
  if (!(smallest > min_extent * min_extent * step_m * step_m)) return std::nullopt;
  return predicted(near, at_m);
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Start of the fit; nullopt if the image is not brighter in the bright sector.
std::optional<CornerStart> start_of(const GreyImage& grey, const MarkedCorner& corner,
                                    const CornerPrediction& prediction, double max_window_px) {
  constexpr double part_of_clearance = 0.5;  // the rest is for the blur of the next edges
  constexpr double min_radius_px = 3;        // twice as many pixels as unknowns
  const Vector2d dark = prediction.at(corner.dark_m), bright = prediction.at(corner.bright_m);
  if (!grey.holds(dark) || !grey.holds(bright)) return std::nullopt;
  CornerStart start;
  start.px = prediction.px;
  start.contrast = grey.at(bright) - grey.at(dark);
  if (!(start.contrast > 0)) return std::nullopt;
  // A bright sector is between the edges along x and y on its side.
  const double sx = corner.dark_m.x() > 0 ? 1 : -1, sy = corner.dark_m.y() > 0 ? -1 : 1;
  start.edges[0] = (sx * prediction.px_per_m.col(0)).normalized();
  start.edges[1] = (sy * prediction.px_per_m.col(1)).normalized();
  if (cross(start.edges[0], start.edges[1]) < 0) std::swap(start.edges[0], start.edges[1]);
  start.radius_px = std::clamp(part_of_clearance * prediction.clearance_px(corner.clear_m),
                               min_radius_px, std::max(min_radius_px, max_window_px));
  for (const auto& rectangle : corner.excluded_m) {
    std::array<Vector2d, 4> quad;
    for (std::size_t k = 0; k < 4; ++k) quad[k] = prediction.at(rectangle[k]);
    start.excluded.push_back(quad);
  }
  return start;
}

/// Fits a corner; the margin of the excluded parts and the window grow with the blur.
bool fit_marked(const GreyImage& grey, CornerStart& start, double max_radius_px, CornerFit& fit) {
  constexpr double min_margin_px = 1.5;
  constexpr double margin_blurs = 2;  // an edge at this distance changes the level by 2 %
  constexpr double radius_blurs = 3;  // as for chessboards
  constexpr int max_fits = 4;
  start.margin_px = min_margin_px;
  for (int i = 0; i < max_fits; ++i) {
    if (!fit_corner(grey, start, fit)) {
      if (start.radius_px >= max_radius_px) return false;
      start.radius_px = std::min(2 * start.radius_px, max_radius_px);
      start.blur_px *= 2;
      continue;
    }
    const double margin_px = margin_blurs * fit.blur_px;
    const bool is_wide =
        start.radius_px >= radius_blurs * fit.blur_px || start.radius_px >= max_radius_px;
    if (margin_px <= start.margin_px && is_wide) return true;
    start.margin_px = std::max(start.margin_px, 1.1 * margin_px);
    if (!is_wide)
      start.radius_px =
          std::min(std::max(1.5 * start.radius_px, radius_blurs * fit.blur_px), max_radius_px);
    start.blur_px = fit.blur_px;
  }
  return false;
}

/// A fit with the index of its corner.
struct IndexedFit {
  int index = 0;
  bool swapped = false;  // the first edge of the start is along y
  CornerStart start;     // of the last fit
  CornerFit fit;
};

/// Removes fits with much larger residuals than the others: something covers a part of the window.
void remove_misfits(std::vector<IndexedFit>& fits) {
  constexpr double usual_misfit = 0.08;  // of the contrast: tones of paper, errors of the model
  constexpr double max_ratio = 3;
  if (fits.empty()) return;
  std::vector<double> misfits;
  for (const IndexedFit& each : fits) misfits.push_back(each.fit.misfit);
  std::nth_element(misfits.begin(),
                   misfits.begin() + static_cast<std::ptrdiff_t>(misfits.size() / 2),
                   misfits.end());
  const double limit = std::max(usual_misfit, max_ratio * misfits[misfits.size() / 2]);
  fits.erase(std::remove_if(fits.begin(), fits.end(),
                            [&](const IndexedFit& each) { return each.fit.misfit > limit; }),
             fits.end());
}

std::vector<KnownPoint> known_points(const MarkedBoard& board,
                                     const std::vector<IndexedFit>& fits) {
  std::vector<KnownPoint> known;
  for (const IndexedFit& each : fits)
    known.push_back({board.corners[static_cast<std::size_t>(each.index)].at_m, each.fit.px});
  return known;
}

/// Distance of a corner from its prediction by the others, relative to the tolerance; 0 if they do
/// not predict it.
double stray_ratio(const std::vector<KnownPoint>& others, const KnownPoint& corner, double step_m) {
  constexpr std::size_t max_points = 12;
  constexpr double min_off_px = 0.3, max_ratio = 4;
  const std::vector<KnownPoint> near = nearest_points(others, corner.at_m, 2 * step_m, max_points);
  const auto prediction = predicted_by(near, corner.at_m, step_m);
  if (!prediction) return 0;
  // Usual errors: the residuals of the neighbours, which contain noise and lens distortion, times
  // the leverage of an affine fit.
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double squared_px2 = 0;
  for (const KnownPoint& point : near) {
    const Eigen::Vector3d row = ((point.at_m - corner.at_m) / step_m).homogeneous();
    moments += row * row.transpose();
    squared_px2 += (prediction->mapped(point.at_m) - point.px).squaredNorm();
  }
  const double freedom = std::max(1.0, 2 * static_cast<double>(near.size()) - 8);
  const double leverage = core::inverse(moments)(2, 2);
  const double usual_px = std::sqrt(squared_px2 / freedom * (1 + leverage));
  return (prediction->px - corner.px).norm() / (min_off_px + max_ratio * usual_px);
}

/// Removes corners that are not where their neighbours predict them: corners of another pattern, in
/// front of the board. The worst one is removed first, because it also moves its neighbours.
void remove_strays(const MarkedBoard& board, std::vector<IndexedFit>& fits) {
  while (true) {
    const std::vector<KnownPoint> known = known_points(board, fits);
    double worst_ratio = 1;
    std::size_t worst = known.size();
    for (std::size_t i = 0; i < known.size(); ++i) {
      std::vector<KnownPoint> others = known;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const double ratio = stray_ratio(others, known[i], board.step_m);
      if (!(ratio > worst_ratio)) continue;
      worst_ratio = ratio;
      worst = i;
    }
    if (worst == known.size()) return;
    fits.erase(fits.begin() + static_cast<std::ptrdiff_t>(worst));
  }
}

/// Fits the corner at its predicted place; false if it is covered, or another one.
bool measure_corner(const GreyImage& grey, const MarkedCorner& corner,
                    const CornerPrediction& prediction, double max_window_px, IndexedFit& found) {
  constexpr double max_gradient = 0.6;  // 1.7 if one of the four sectors has the wrong tone
  constexpr double max_shift_px = 1, max_shift_part = 0.08;  // errors of the prediction
  const auto start = start_of(grey, corner, prediction, max_window_px);
  if (!start) return false;
  const double clearance_px = prediction.clearance_px(corner.clear_m);
  found.start = *start;
  const Vector2d& first = start->edges[0];
  found.swapped = std::abs(first.dot(prediction.px_per_m.col(0).normalized())) <
                  std::abs(first.dot(prediction.px_per_m.col(1).normalized()));
  return fit_marked(grey, found.start, std::max(start->radius_px, 0.5 * clearance_px), found.fit) &&
         found.fit.gradient < max_gradient &&
         (found.fit.px - prediction.px).norm() < max_shift_px + max_shift_part * clearance_px;
}

/// Bend of the line of the board through `corner` along an axis.
Vector2d line_bend(const std::vector<KnownPoint>& known, const KnownPoint& corner, int axis,
                   double step_m) {
  constexpr double same_line = 1e-6;  // of step_m
  constexpr double reach_steps = 2.5;
  std::vector<KnownPoint> line;
  for (const KnownPoint& point : known) {
    const Vector2d off_m = point.at_m - corner.at_m;
    if (std::abs(off_m[1 - axis]) < same_line * step_m && off_m.norm() > same_line * step_m)
      line.push_back(point);
  }
  std::vector<Vector2d> others;
  for (const KnownPoint& point :
       nearest_points(line, corner.at_m, reach_steps * step_m, max_bend_points))
    others.push_back(point.px);
  return edge_bend(corner.px, others);
}

/// Fits the corners again with the bends of the lines through them. Straight edges would move the
/// corners of a board near a fisheye lens towards the middle of the image, by 0.02 px.
void fit_bent(const GreyImage& grey, const MarkedBoard& board, std::vector<IndexedFit>& fits) {
  constexpr double max_shift_px = 0.3;  // a larger one is a change to another minimum
  const std::vector<KnownPoint> known = known_points(board, fits);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    IndexedFit& each = fits[i];
    CornerStart start = each.start;
    for (auto& quad : start.excluded)  // they were about the predicted corner
      for (Vector2d& px : quad) px += each.fit.px - each.start.px;
    continue_from(each.fit, start);
    for (const int axis : {0, 1})
      start.bends_per_px[static_cast<std::size_t>(each.swapped ? 1 - axis : axis)] =
          line_bend(known, known[i], axis, board.step_m);
    CornerFit fit;
    if (fit_corner(grey, start, fit) && (fit.px - each.fit.px).norm() < max_shift_px)
      each.fit = std::move(fit);
  }
}

/// Measures corners near tags, and then those near measured ones, as long as there are more.
/// Returns the number of predicted corners inside the image.
int measure_all(const GreyImage& grey, const MarkedBoard& board, const TagPredictor& by_tags,
                double max_window_px, std::vector<IndexedFit>& fits) {
  constexpr std::size_t max_points = 12;  // around a corner; farther ones add distortion
  constexpr double border_px = 4;         // a corner nearer to the border has no window
  std::vector<bool> is_predicted(board.corners.size(), false);
  const auto measure = [&](std::size_t i, const std::optional<CornerPrediction>& prediction) {
    if (!prediction || !grey.holds(prediction->px, border_px)) return;
    is_predicted[i] = true;
    IndexedFit found;
    found.index = static_cast<int>(i);
    if (measure_corner(grey, board.corners[i], *prediction, max_window_px, found))
      fits.push_back(std::move(found));
  };
  for (std::size_t i = 0; i < board.corners.size(); ++i) measure(i, by_tags(board.corners[i].at_m));
  remove_misfits(fits);
  remove_strays(board, fits);
  for (std::size_t before = 0; fits.size() > before;) {
    before = fits.size();
    const std::vector<KnownPoint> measured = known_points(board, fits);
    const auto predicted_by_measured = [&](std::size_t i) {
      const Vector2d& at_m = board.corners[i].at_m;
      return predicted_by(nearest_points(measured, at_m, board.step_m, max_points), at_m,
                          board.step_m);
    };
    for (std::size_t i = 0; i < board.corners.size(); ++i)
      if (!is_predicted[i]) measure(i, predicted_by_measured(i));
    remove_misfits(fits);
    remove_strays(board, fits);
  }
  fit_bent(grey, board, fits);
  std::sort(fits.begin(), fits.end(),
            [](const IndexedFit& a, const IndexedFit& b) { return a.index < b.index; });
  return static_cast<int>(std::count(is_predicted.begin(), is_predicted.end(), true));
}

}  // namespace

BoardPoints measure_marked(const Image& image, const MarkedBoard& board,
                           const std::vector<AprilTag>& detected,
                           const BoardTagPlacement& placement, const MarkerBoardOptions& options) {
  const GreyImage grey(image);
  std::vector<IndexedFit> fits;
  const int predicted = measure_all(grey, board, TagPredictor(board, detected, placement),
                                    options.max_window_px, fits);
  const auto n = static_cast<Eigen::Index>(fits.size());
  BoardPoints points;
  points.px.resize(2, n);
  Eigen::Matrix2Xd positions(2, n);
  std::vector<CornerFit> corner_fits;
  for (IndexedFit& each : fits) {
    const auto k = static_cast<Eigen::Index>(corner_fits.size());
    points.indices.push_back(each.index);
    points.px.col(k) = each.fit.px;
    positions.col(k) = board.corners[static_cast<std::size_t>(each.index)].at_m;
    corner_fits.push_back(std::move(each.fit));
  }
  points.covariance_px2 = noise_covariances(corner_fits);
  constexpr Eigen::Index min_points = 6;  // fewer have no redundancy beside a homography
  const double scatter_px2 =
      n < min_points
          ? 0
          : grid_scatter_px2(positions, points.px, points.covariance_px2, image_middle(image));
  points.scatter_sigma_px = std::sqrt(scatter_px2);
  const double added_px2 = options.model_sigma_px * options.model_sigma_px + scatter_px2;
  for (Matrix2d& covariance : points.covariance_px2) covariance += added_px2 * Matrix2d::Identity();
  points.tags = static_cast<int>(placement.tags.size());
  points.hidden = predicted - static_cast<int>(n);
  points.foreign_ids = placement.foreign_ids;
  points.misplaced_ids = placement.misplaced_ids;
  return points;
}

}  // namespace occ::internal::landmarks
