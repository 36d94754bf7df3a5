// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/hidden_sides.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <utility>

#include "libocc/core/internal/blob_spread.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/locate/fix.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"
#include "libocc/scene/internal/rectangle_corners.hpp"

namespace occ::internal::locate {
namespace {

constexpr double sigma_px = 0.3;  // of a side or a centre, for their weights against a prior
constexpr double gate_px = 0.8;   // max distance of a visible side from that of its lamp

using Corners = std::vector<Eigen::Vector3d>;

/// Corners of a lamp in the world, clockwise in the image. Empty for curves and hollow outlines.
Corners corners_of(const Lamp& lamp) {
  Corners corners;
  if (lamp.shape == LampShape::rectangle) {
    const Eigen::Matrix<double, 3, 4> offsets = scene::rectangle_corners(lamp);
    for (const auto& offset : offsets.colwise()) corners.push_back(lamp.centre_m + offset);
  } else if (lamp.shape == LampShape::polygon && scene::is_convex(lamp.corners_m)) {
    const Eigen::Vector3d across = lamp.normal.cross(lamp.x_axis);
    for (auto p = lamp.corners_m.rbegin(); p != lamp.corners_m.rend(); ++p)
      corners.push_back(lamp.centre_m + p->x() * lamp.x_axis + p->y() * across);
  }
  return corners;
}

/// Part of a measured side away from its corners, as two directions in the camera's frame.
struct SeenSide {
  std::size_t blob, side;
  const Corners* lamp;  ///< in the world
  std::array<Eigen::Vector3d, 2> ends;
  /// Index of the corner where the side of the lamp begins that has the same direction; empty
  /// without one.
  std::optional<std::size_t> of_lamp = std::nullopt;
};

/// Centre of a lamp without measured sides.
struct SeenCentre {
  Eigen::Vector3d centre_m, bearing;
  double sigma_px;
};

/// Distances of the ends of a measured side outwards from the lamp's side [px].
using Distances = std::array<double, 2>;

/// True if a side of a blob that the image border cuts is that border.
bool is_at_border(const Blob& blob, std::size_t side, const Camera& camera) {
  constexpr double border_px = 4;
  const Eigen::Vector2d& from = blob.corners_px[side];
  const Eigen::Vector2d& to = blob.corners_px[(side + 1) % blob.corners_px.size()];
  const Eigen::Vector2d upper = from.cwiseMax(to), lower = from.cwiseMin(to);
  return blob.cut_by_border &&
         (upper.minCoeff() < border_px || lower.x() > camera.width() - 1 - border_px ||
          lower.y() > camera.height() - 1 - border_px);
}

class Sides {
 public:
  Sides(const Hypothesis& hypothesis, const std::vector<Blob>& blobs, const Scene& scene)
      : focal_px_(0.5 * (scene.camera.fx_px() + scene.camera.fy_px())) {
    corners_.reserve(hypothesis.matches.size());
    for (const Match& match : hypothesis.matches) add(match, blobs, scene);
    name(hypothesis.cam_from_world);
  }

  const std::vector<SeenSide>& seen() const { return sides_; }

  /// Empty without a side of the lamp.
  std::optional<Distances> distances_px(const SeenSide& seen, const Rigid3& pose) const {
    if (!seen.of_lamp) return std::nullopt;
    const Eigen::Vector3d out = outwards(*seen.lamp, *seen.of_lamp, pose);
    return Distances{focal_px_ * out.dot(seen.ends[0]), focal_px_ * out.dot(seen.ends[1])};
  }

  /// True if a measured side lies inside all sides of its lamp.
  bool is_inside(const SeenSide& seen, const Rigid3& pose) const {
    for (std::size_t i = 0; i < seen.lamp->size(); ++i) {
      const Eigen::Vector3d out = outwards(*seen.lamp, i, pose);
      for (const Eigen::Vector3d& end : seen.ends)
        if (focal_px_ * out.dot(end) > gate_px) return false;
    }
    return true;
  }

  /// Pose that most of the sides agree with; empty if it is not determined.
  std::optional<Rigid3> fit(Rigid3 pose, const std::optional<Prior>& prior) const {
    constexpr int iterations = 18;
    constexpr double first_px = 12, factor = 0.75, last_px = 0.8;
    double scale_px = first_px;
    for (int i = 0; i < iterations; ++i, scale_px = std::max(last_px, factor * scale_px)) {
      Matrix6 information = Matrix6::Zero();
      Vector6 gradient = Vector6::Zero();
      add_sides(pose, scale_px, information, gradient);
      add_centres(pose, scale_px, information, gradient);
      if (prior && !prior->empty()) {
        const PriorRows rows = prior->rows(pose);
        information += rows.jacobian.transpose() * rows.jacobian;
        gradient += rows.jacobian.transpose() * rows.residuals;
      }
      const core::Cholesky<Matrix6> root(information);
      if (!root.exists()) return std::nullopt;
      pose = perturb(pose, -root.solve<Vector6>(gradient));
    }
    return pose;
  }

 private:
  using Row = Eigen::Matrix<double, 1, 6>;
  static constexpr double step = 1e-6;

  static std::pair<Eigen::Vector3d, Eigen::Vector3d> side_of(const Corners& lamp, std::size_t side,
                                                             const Rigid3& pose) {
    return {pose * lamp[side], pose * lamp[(side + 1) % lamp.size()]};
  }

  /// Normal of the plane through the camera and a side, away from the lamp.
  static Eigen::Vector3d outwards(const Corners& lamp, std::size_t side, const Rigid3& pose) {
    const auto [from, to] = side_of(lamp, side, pose);
    return to.cross(from).normalized();
  }

  void add(const Match& match, const std::vector<Blob>& blobs, const Scene& scene) {
    constexpr std::array<double, 2> parts = {0.15, 0.85};
    const auto index = static_cast<std::size_t>(match.blob);
    const Blob& blob = blobs[index];
    const Lamp& lamp = scene.lamps[static_cast<std::size_t>(match.lamp)];
    const std::size_t n = blob.corners_px.size();
    if (blob.striped) return;
    Corners corners = n > 2 ? corners_of(lamp) : Corners();
    if (corners.empty()) {
      const auto bearing = scene.camera.unproject(blob.centroid_px);
      if (bearing && !blob.merged && !blob.cut_by_border)
        centres_.push_back({lamp.centre_m, bearing->normalized(),
                            std::sqrt(square(sigma_px) + blob.covariance_px2.trace() / 2)});
      return;
    }
    corners_.push_back(std::move(corners));  // reserved: addresses remain
    for (std::size_t i = 0; i < n; ++i) {
      SeenSide side{index, i, &corners_.back(), {}};
      bool is_seen = true;
      for (std::size_t k = 0; k < parts.size(); ++k) {
        const Eigen::Vector2d px =
            (1 - parts[k]) * blob.corners_px[i] + parts[k] * blob.corners_px[(i + 1) % n];
        const auto bearing = scene.camera.unproject(px);
        if (bearing) side.ends[k] = bearing->normalized();
        is_seen = is_seen && bearing;
      }
      if (is_seen && !is_at_border(blob, i, scene.camera)) sides_.push_back(side);
    }
  }

  /// Finds the sides of the lamps that the measured sides may be, by their directions.
  void name(const Rigid3& pose) {
    constexpr double min_cosine = 0.85;
    for (SeenSide& seen : sides_) {
      const Eigen::Vector3d along = (seen.ends[1] - seen.ends[0]).normalized();
      double best = min_cosine;
      seen.of_lamp.reset();
      for (std::size_t i = 0; i < seen.lamp->size(); ++i) {
        const auto [from, to] = side_of(*seen.lamp, i, pose);
        const double cosine = along.dot((to.normalized() - from.normalized()).normalized());
        if (cosine > best) best = cosine, seen.of_lamp = i;
      }
    }
  }

  void add_sides(const Rigid3& pose, double scale_px, Matrix6& information,
                 Vector6& gradient) const {
    for (const SeenSide& side : sides_) {
      const auto here = distances_px(side, pose);
      if (!here) continue;
      std::array<Row, 2> by_pose;
      for (int k = 0; k < 6; ++k) {
        const auto there = distances_px(side, perturb(pose, step * Vector6::Unit(k)));
        for (std::size_t e = 0; e < 2; ++e) by_pose[e][k] = ((*there)[e] - (*here)[e]) / step;
      }
      const double off2 = std::max(square((*here)[0]), square((*here)[1]));
      const double weight = 1 / square(1 + off2 / square(scale_px)) / square(sigma_px);
      for (std::size_t e = 0; e < 2; ++e) {
        information += weight * by_pose[e].transpose() * by_pose[e];
        gradient += weight * (*here)[e] * by_pose[e].transpose();
      }
    }
  }

  void add_centres(const Rigid3& pose, double scale_px, Matrix6& information,
                   Vector6& gradient) const {
    const auto residual_px = [&](const SeenCentre& seen, const Rigid3& at) -> Eigen::Vector3d {
      return focal_px_ * ((at * seen.centre_m).normalized() - seen.bearing);
    };
    for (const SeenCentre& seen : centres_) {
      const Eigen::Vector3d here = residual_px(seen, pose);
      Eigen::Matrix<double, 3, 6> by_pose;
      for (int k = 0; k < 6; ++k)
        by_pose.col(k) = (residual_px(seen, perturb(pose, step * Vector6::Unit(k))) - here) / step;
      const double scale = std::hypot(scale_px, seen.sigma_px);
      const double weight =
          1 / square(1 + here.squaredNorm() / square(scale)) / square(seen.sigma_px);
      information += weight * by_pose.transpose() * by_pose;
      gradient += weight * by_pose.transpose() * here;
    }
  }

  double focal_px_;
  std::vector<Corners> corners_;
  std::vector<SeenSide> sides_;
  std::vector<SeenCentre> centres_;
};

/// The side of the blob's polygon that a point of its rim is nearest to.
std::size_t nearest_side(const Blob& blob, const Eigen::Vector2d& px) {
  const std::size_t n = blob.corners_px.size();
  std::size_t nearest = 0;
  double least = infinity;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d from = blob.corners_px[i], along = blob.corners_px[(i + 1) % n] - from;
    const double part = std::clamp(along.dot(px - from) / along.squaredNorm(), 0.0, 1.0);
    const double distance = (px - from - part * along).norm();
    if (distance < least) least = distance, nearest = i;
  }
  return nearest;
}

/// Keeps some points of the rim. The centroid of the lamp is anywhere in the blob or beside it.
void hide(std::vector<RimPoint> visible, Blob& blob) {
  blob.rim = std::move(visible);
  blob.covariance_px2.diagonal().array() += square(core::spread_px(blob));
  blob.hidden_in_part = true;
}

void hide_sides(const std::vector<std::size_t>& hidden, Blob& blob) {
  std::vector<RimPoint> visible;
  for (const RimPoint& point : blob.rim)
    if (std::count(hidden.begin(), hidden.end(), nearest_side(blob, point.px)) == 0)
      visible.push_back(point);
  hide(std::move(visible), blob);
}

/// Removes the points of an outline of any shape that lie inside its lamp's. False if others lie
/// outside.
bool hide_points(const Lamp& lamp, const Rigid3& pose, const Camera& camera, Blob& blob) {
  constexpr double max_outside = 0.05;  // part of the points
  std::vector<RimPoint> visible;
  std::size_t outside = 0;
  for (const RimPoint& point : blob.rim) {
    const auto ray = rim_ray(point, camera);
    const auto off = ray ? rim_distance_px(lamp, pose, *ray) : std::nullopt;
    if (off && std::abs(*off) < gate_px) visible.push_back(point);
    outside += off && *off >= gate_px;
  }
  const auto all = static_cast<double>(blob.rim.size());
  if (static_cast<double>(outside) > max_outside * all) return false;
  if (visible.size() + outside == blob.rim.size()) return true;
  hide(std::move(visible), blob);
  return true;
}

/// Indices of the blobs with corners.
std::vector<std::size_t> outlines_of(const std::vector<Blob>& blobs) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < blobs.size(); ++i)
    if (blobs[i].corners_px.size() > 2 && !blobs[i].rim.empty()) found.push_back(i);
  return found;
}

/// Number of rim points of each blob, which tells how many sides are hidden.
std::vector<std::size_t> points_left(const std::vector<Blob>& blobs) {
  std::vector<std::size_t> points;
  for (const Blob& blob : blobs) points.push_back(blob.rim.size());
  return points;
}

/// Number of lamps with an outline of which no side is hidden.
std::size_t whole_outlines(const Hypothesis& hypothesis, const std::vector<Blob>& blobs) {
  return static_cast<std::size_t>(
      std::count_if(hypothesis.matches.begin(), hypothesis.matches.end(), [&](const Match& match) {
        const Blob& blob = blobs[static_cast<std::size_t>(match.blob)];
        return !blob.rim.empty() && !blob.hidden_in_part && !blob.cut_by_border;
      }));
}

/// True if a pose fits the visible sides of a hypothesis, which is much faster to find out than all
/// poses that they may have.
bool fits(const Hypothesis& hypothesis, const std::vector<Blob>& marked, const Scene& scene,
          const std::optional<Prior>& prior) {
  RefineOptions options;
  options.prior = prior;
  const Result<Refined> refined =
      occ::refine(hypothesis.cam_from_world, hypothesis.matches, marked, scene, options);
  return refined.status != Status::not_converged && refined->rms_px < gate_px;
}

bool is_same_place(const Candidate& a, const Fix& b) {
  constexpr double max_chi2 = 25;
  const Eigen::Vector3d apart_m = a.position_m - b.position_m;
  const Eigen::Matrix3d covariance_m2 =
      position_covariance(a.cam_from_world, a.covariance) + b.position_covariance_m2;
  return apart_m.dot(covariance_m2.inverse() * apart_m) < max_chi2;
}

/// True if the place of a fix is among the candidates of another.
bool is_listed(const Fix& fix, const Fix& other) {
  return std::any_of(other.candidates.begin(), other.candidates.end(),
                     [&](const Candidate& c) { return is_same_place(c, fix); });
}

/// True if a fix by visible sides is located where the first was not, or explains more lamps.
bool is_better(const Result<Fix>& fix, const Result<Fix>& first) {
  if (rank(first.status) > 0) return rank(fix.status) < rank(first.status);
  return rank(fix.status) < 2 && fix->lamps.size() > first->lamps.size();
}

}  // namespace

std::optional<Result<Fix>> locate_by_visible_sides(
    const Attempt& first, const std::vector<Blob>& blobs, const Scene& scene,
    const std::optional<Prior>& prior,
    const std::function<std::optional<Attempt>(const std::vector<Blob>&)>& locate) {
  constexpr std::size_t max_hypotheses = 4, max_names = 3, min_whole = 2;
  constexpr int rounds = 3;  // another lamp may be matched, and hidden, once the first is marked
  std::optional<Result<Fix>> best;
  std::set<std::vector<std::size_t>> tried;
  // False if it leads to another place than the best one.
  const auto follow = [&](Hypothesis hypothesis, std::size_t whole) {
    auto marked = mark_hidden_sides(hypothesis, blobs, scene, prior);
    if (marked && whole_outlines(hypothesis, *marked) < whole) return true;
    std::optional<Attempt> attempt;
    for (int round = 0; round < rounds && marked; ++round) {
      if (!tried.insert(points_left(*marked)).second) break;
      if (!fits(hypothesis, *marked, scene, prior)) break;
      attempt = locate(*marked);
      if (!attempt || rank(attempt->fix.status) == 0 || attempt->hypotheses.empty()) break;
      hypothesis = attempt->hypotheses.front();
      marked = mark_hidden_sides(hypothesis, *marked, scene, prior);
    }
    if (!attempt || !is_better(attempt->fix, first.fix)) return true;
    if (best && !is_listed(*best.value(), *attempt->fix) &&
        !is_listed(*attempt->fix, *best.value()))
      return false;
    if (!best || rank(attempt->fix.status) < rank(best->status)) best = std::move(attempt->fix);
    return true;
  };
  for (std::size_t i = 0; i < std::min(max_hypotheses, first.hypotheses.size()); ++i) {
    const Hypothesis& hypothesis = first.hypotheses[i];
    if (rank(first.fix.status) == 0 && hypothesis.matches.size() <= first.fix->lamps.size())
      continue;
    if (!follow(hypothesis, 0)) return std::nullopt;
  }
  if (best || rank(first.fix.status) < 2) return best;
  // An outline that is hidden in part and taken for a whole one leads to wrong names. First those
  // that the border cuts are left out, then the smallest of the others as well: the rest gives the
  // names.
  std::vector<Blob> others = blobs;
  std::vector<std::size_t> cut, whole;
  for (const std::size_t i : outlines_of(blobs))
    (blobs[i].cut_by_border ? cut : whole).push_back(i);
  const auto try_without = [&](const std::vector<std::size_t>& left_out, std::size_t min_whole) {
    for (const std::size_t i : left_out) hide({}, others[i]);
    const std::optional<Attempt> attempt = locate(others);
    for (std::size_t h = 0; attempt && h < std::min(max_names, attempt->hypotheses.size()); ++h) {
      follow(attempt->hypotheses[h], min_whole);
      if (best) break;
    }
  };
  if (!cut.empty() && !whole.empty()) try_without(cut, 1);
  if (best || whole.size() <= min_whole || whole.size() > scene.lamps.size()) return best;
  try_without({*std::min_element(whole.begin(), whole.end(),
                                 [&](std::size_t a, std::size_t b) {
                                   return blobs[a].rim.size() < blobs[b].rim.size();
                                 })},
              min_whole);
  return best;
}

std::optional<std::vector<Blob>> mark_hidden_sides(const Hypothesis& hypothesis,
                                                   const std::vector<Blob>& blobs,
                                                   const Scene& scene,
                                                   const std::optional<Prior>& prior) {
  constexpr std::size_t min_visible = 4;  // each gives two equations, a pose has six unknowns
  if (!scene.camera.is_central()) return std::nullopt;
  const Sides sides(hypothesis, blobs, scene);
  if (sides.seen().size() < min_visible) return std::nullopt;
  const std::optional<Rigid3> pose = sides.fit(hypothesis.cam_from_world, prior);
  if (!pose) return std::nullopt;
  std::vector<std::vector<std::size_t>> hidden(blobs.size());
  std::size_t visible = 0;
  for (const SeenSide& side : sides.seen()) {
    const auto off = sides.distances_px(side, *pose);
    if (off && std::max(std::abs((*off)[0]), std::abs((*off)[1])) < gate_px) {
      ++visible;
      continue;
    }
    if (!sides.is_inside(side, *pose)) return std::nullopt;
    hidden[side.blob].push_back(side.side);
  }
  if (visible < min_visible) return std::nullopt;
  std::vector<Blob> marked = blobs;
  for (const Match& match : hypothesis.matches) {
    const auto i = static_cast<std::size_t>(match.blob);
    const Lamp& lamp = scene.lamps[static_cast<std::size_t>(match.lamp)];
    if (!hidden[i].empty()) hide_sides(hidden[i], marked[i]);
    if (blobs[i].free_form && lamp.shape == LampShape::polygon &&
        !hide_points(lamp, *pose, scene.camera, marked[i]))
      return std::nullopt;
  }
  if (points_left(marked) == points_left(blobs)) return std::nullopt;
  return marked;
}

}  // namespace occ::internal::locate
