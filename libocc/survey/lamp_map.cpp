// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_map.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/survey/internal/lamp_kinds.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double gate_chi2_3 = 21.1;  // exceeded by a correct match with probability 1e-4, 3 dof
constexpr double side_sigmas = 4;     // tolerance of the sides of a triangle
constexpr int max_triples = 300;      // of a picture, largest first; 12 lamps have 220
constexpr int max_hypotheses = 4000;  // refined for one picture
constexpr double normal_sigma_rad = 0.3;  // of a lamp seen from below, and of lamps that hang askew
constexpr double max_turn_rad = 0.2;      // of the sides of a rectangle between map and picture
constexpr double max_tag_tilt_rad = 0.4;  // of its normal
constexpr double max_line_width = 0.1;    // over the length, of lamps on a line

struct Triple {
  std::array<int, 3> of{};
  double area = 0;
};

std::vector<Triple> triples_by_area(const std::vector<LampShapeView>& views) {
  std::vector<Triple> all;
  const int count = static_cast<int>(views.size());
  std::vector<Vector3d> at;
  for (const LampShapeView& view : views) at.push_back(view_position(view, 1));
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j)
      for (int k = j + 1; k < count; ++k)
        all.push_back({{i, j, k}, (at[j] - at[i]).cross(at[k] - at[i]).norm()});
  std::stable_sort(all.begin(), all.end(),
                   [](const Triple& a, const Triple& b) { return a.area > b.area; });
  if (all.size() > max_triples) all.resize(max_triples);
  return all;
}

/// A picture, the map, and the hypotheses so far.
class Matcher {
 public:
  Matcher(const PictureViews& picture, const LampMap& map,
          const std::vector<PictureViews>& pictures, const Camera& camera,
          const MatchCandidates& candidates, const Rigid3* neighbour)
      : picture_(picture), map_(map), pictures_(pictures), camera_(camera), neighbour_(neighbour) {
    std::vector<int> all(map.lamps.size());
    std::iota(all.begin(), all.end(), 0);
    for (std::size_t v = 0; v < picture.views.size(); ++v) {
      lamps_of_view_.push_back(candidates.empty() ? all : candidates[v]);
      std::vector<int>& lamps = lamps_of_view_.back();
      const auto is_other = [&](int p) { return map.lamps[p].tag != picture.views[v].tag; };
      lamps.erase(std::remove_if(lamps.begin(), lamps.end(), is_other), lamps.end());
    }
    std::vector<double> ranges;
    for (const LampShapeView& view : picture.views) ranges.push_back(view.range);
    field_sr_ = field_of_view_sr(camera);
    std::vector<double> sizes;
    for (const MapLamp& lamp : map.lamps) sizes.push_back(lamp.size);
    field_ = std::sqrt(field_sr_) * median(ranges) * median(sizes);
    double triples = 0;  // hypotheses: three views, each with another lamp
    const std::size_t count = lamps_of_view_.size();
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < j; ++k)
          triples += static_cast<double>(lamps_of_view_[i].size()) *
                     std::max(1.0, static_cast<double>(lamps_of_view_[j].size()) - 1) *
                     std::max(1.0, static_cast<double>(lamps_of_view_[k].size()) - 2);
    log10_triples_ = std::log10(std::max(1.0, triples));
    common_normal_ = neighbour ? mapped_normal(*neighbour) : common_normal(picture.views);
    std::vector<Vector3d> bearings;
    for (const LampShapeView& view : picture.views) bearings.push_back(view.bearing);
    line_normal_ = line_normal(bearings, max_line_width);
  }

  std::vector<MapMatch> run() {
    for (const Triple& triple : triples_by_area(picture_.views)) search(triple);
    for (std::size_t v = 0; v < picture_.views.size(); ++v)
      if (picture_.views[v].tag >= 0)
        for (const int p : lamps_of_view_[v]) try_views({static_cast<int>(v)}, {p}, 0);
    if (found_.empty() && neighbour_) search_pairs();
    std::stable_sort(found_.begin(), found_.end(), [](const MapMatch& a, const MapMatch& b) {
      return a.log10_false_alarms < b.log10_false_alarms;
    });
    return std::move(found_);
  }

 private:
  /// Mean normal of the lamps in the camera frame of a pose; zero without lamps.
  Vector3d mapped_normal(const Rigid3& pose) const {
    Vector3d sum = Vector3d::Zero();
    for (const MapLamp& lamp : map_.lamps)
      if (lamp.tag < 0) sum += lamp.normal;
    return pose.rotation * sum.normalized();
  }

  /// Normal of a view that is nearest to a direction.
  const Vector3d& nearest_normal(int view, const Vector3d& direction) const {
    const std::vector<Vector3d>& normals = picture_.views[view].normals;
    return *std::max_element(
        normals.begin(), normals.end(),
        [&](const Vector3d& a, const Vector3d& b) { return a.dot(direction) < b.dot(direction); });
  }

  bool is_same_kind(int view, int lamp) const {
    return is_of_kind(picture_.views[view], map_.lamps[lamp].shape, map_.lamps[lamp].aspect);
  }

  /// False if the sides of a rectangle, or sides and normal of a tag, have another direction in the
  /// map.
  bool axes_agree(const MapMatch& match, int view, int lamp) const {
    const MapLamp& known = map_.lamps[lamp];
    if (known.x_axis.isZero()) return true;
    if (known.tag >= 0) {
      const LampShapeView& seen = picture_.views[view];
      const Matrix3d& rotation = match.cam_from_map.rotation;
      return (rotation * known.x_axis).dot(seen.x_axis) > std::cos(max_turn_rad) &&
             (rotation * known.normal).dot(seen.normals[0]) > std::cos(max_tag_tilt_rad);
    }
    const double cosine =
        std::abs((match.cam_from_map.rotation * known.x_axis).dot(long_side(picture_.views[view])));
    const double sine = std::sqrt(std::max(0.0, 1 - square(cosine)));
    if (is_square(known)) return std::min(cosine, sine) < std::sin(max_turn_rad);
    return sine < std::sin(max_turn_rad);
  }

  static bool is_square(const MapLamp& lamp) { return lamp.aspect < max_aspect_ratio; }

  Vector3d position(int view, int lamp) const {
    return view_position(picture_.views[view], map_.lamps[lamp].size);
  }
  Matrix3d covariance(int view, int lamp) const {
    return view_covariance(picture_.views[view], map_.lamps[lamp].size,
                           map_.lamps[lamp].size_sigma);
  }

  /// Tolerance of the side between two views if it is that between two lamps; nothing if the
  /// lengths differ by more.
  std::optional<double> side_tolerance(int i, int j, int p, int q) const {
    if (!is_same_kind(i, p) || !is_same_kind(j, q)) return std::nullopt;
    const Vector3d seen = position(j, q) - position(i, p);
    const Vector3d mapped = map_.lamps[q].position - map_.lamps[p].position;
    const double length = seen.norm(), map_length = mapped.norm();
    if (!(length > 0) || !(map_length > 0)) return std::nullopt;
    const Vector3d u = seen / length, v = mapped / map_length;
    const double variance = u.dot((covariance(i, p) + covariance(j, q)) * u) +
                            v.dot((map_.lamps[p].covariance + map_.lamps[q].covariance) * v);
    const double tolerance = side_sigmas * std::sqrt(variance);
    if (std::abs(length - map_length) > tolerance) return std::nullopt;
    return tolerance;
  }

  void search(const Triple& triple) {
    const auto [i, j, k] = triple.of;
    for (const int p : lamps_of_view_[i])
      for (const int q : lamps_of_view_[j]) {
        if (q == p) continue;
        const auto first = side_tolerance(i, j, p, q);
        if (!first) continue;
        for (const int r : lamps_of_view_[k]) {
          if (r == p || r == q) continue;
          const auto second = side_tolerance(i, k, p, r);
          if (!second) continue;
          const auto third = side_tolerance(j, k, q, r);
          if (!third) continue;
          if (tried_.size() >= max_hypotheses) return;
          double log10_sides = 0, best_side = 0;
          for (const double tolerance : {*first, *second, *third}) {
            const double log10_side = std::log10(std::min(1.0, 2 * tolerance / field_));
            log10_sides += log10_side;
            best_side = std::min(best_side, log10_side);
          }
          if (line_normal_) log10_sides -= best_side;  // the third side follows from two
          try_views({i, j, k}, {p, q, r}, log10_sides);
        }
      }
  }

  /// Two lamps, whose normals determine the rotation about the line through them.
  void search_pairs() {
    const int count = static_cast<int>(picture_.views.size());
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j)
        for (const int p : lamps_of_view_[i])
          for (const int q : lamps_of_view_[j])
            if (p != q && map_.lamps[p].tag < 0 && map_.lamps[q].tag < 0 &&
                side_tolerance(i, j, p, q))
              try_views({i, j}, {p, q}, 0);
  }

  /// The motion by three lamps, by two, or by one tag.
  void try_views(const std::vector<int>& views, const std::vector<int>& lamps, double log10_sides) {
    const std::size_t count = views.size();
    std::vector<int> lamp_of_view(picture_.views.size(), -1);
    Vector3d from = Vector3d::Zero(), to = Vector3d::Zero();
    for (std::size_t n = 0; n < count; ++n) {
      lamp_of_view[views[n]] = lamps[n];
      from += map_.lamps[lamps[n]].position / static_cast<double>(count);
      to += position(views[n], lamps[n]) / static_cast<double>(count);
    }
    Matrix3d product = Matrix3d::Zero(), by_normals = Matrix3d::Zero();
    for (std::size_t n = 0; n < count; ++n) {
      product +=
          (position(views[n], lamps[n]) - to) * (map_.lamps[lamps[n]].position - from).transpose();
      by_normals +=
          nearest_normal(views[n], common_normal_) * map_.lamps[lamps[n]].normal.transpose();
      if (count == 1)
        by_normals += picture_.views[views[n]].x_axis * map_.lamps[lamps[n]].x_axis.transpose();
    }
    constexpr double normal_weight = 0.01;  // enough for lamps on a line
    product += (count == 1 ? 1 : normal_weight * product.norm()) * by_normals;
    MapMatch match;
    match.cam_from_map.rotation = nearest_rotation(product);
    match.cam_from_map.translation = to - match.cam_from_map.rotation * from;
    // The motion of the mirrored triangle shows the dark sides.
    for (std::size_t n = 0; n < count; ++n)
      if ((match.cam_from_map.rotation * map_.lamps[lamps[n]].normal)
              .dot(picture_.views[views[n]].bearing) > 0)
        return;
    match.lamp_of_view = lamp_of_view;
    if (!refine(match)) return;
    for (int round = 0; round < 3; ++round) {
      const std::vector<int> before = match.lamp_of_view;
      associate(match);
      if (match.matches < (count < 3 ? 2 : 3) || !tried_.insert({round, match.lamp_of_view}).second)
        return;
      if (match.lamp_of_view == before) break;
      if (!refine(match)) return;
    }
    if (!final_.insert(match.lamp_of_view).second) return;
    score(match, log10_sides, views);
    found_.push_back(std::move(match));
  }

  /// Gauss-Newton steps with the current assignment; false if the motion is undetermined.
  bool refine(MapMatch& match) const {
    constexpr int steps = 4;  // the start is within the gates, where the problem is nearly linear
    Matrix6 information;
    for (int step = 0; step < steps; ++step) {
      information.setZero();
      Vector6 gradient = Vector6::Zero();
      for (std::size_t v = 0; v < match.lamp_of_view.size(); ++v) {
        if (match.lamp_of_view[v] < 0) continue;
        const Linear at = linear(match, static_cast<int>(v), match.lamp_of_view[v]);
        const Matrix3d weight = core::inverse<Matrix3d>(at.covariance);
        information += at.jacobian.transpose() * weight * at.jacobian;
        gradient += at.jacobian.transpose() * (weight * at.error);
        const auto add_direction = [&](const Vector3d& mapped, const Vector3d& seen, double sigma) {
          const Matrix3d turn = skew(mapped);
          information.topLeftCorner<3, 3>() -= turn * turn / square(sigma);
          gradient.head<3>() -= turn * (seen - mapped) / square(sigma);
        };
        // Normals determine the rotation about a line of lamps.
        const MapLamp& lamp = map_.lamps[match.lamp_of_view[v]];
        const Vector3d normal = match.cam_from_map.rotation * lamp.normal;
        const Vector3d& seen = nearest_normal(static_cast<int>(v), normal);
        if (lamp.tag < 0) {
          add_direction(normal, seen, normal_sigma_rad);
        } else {  // a view has given the axes of the map as well
          const double sigma = std::sqrt(2.0) * picture_.views[v].tilt_sigma_rad;
          add_direction(normal, seen, sigma);
          add_direction(match.cam_from_map.rotation * lamp.x_axis, picture_.views[v].x_axis, sigma);
        }
      }
      const core::Cholesky<Matrix6> factors(information);
      if (!factors.exists()) return false;
      const Vector6 delta = factors.solve(Vector6(-gradient));
      if (!delta.allFinite()) return false;
      match.cam_from_map = perturb(match.cam_from_map, delta);
    }
    match.covariance = core::inverse<Matrix6>(information);
    return match.covariance.allFinite();
  }

  struct Linear {
    Vector3d error;
    Matrix3d covariance;  // of map and view, without that of the motion
    Eigen::Matrix<double, 3, 6> jacobian;
  };
  Linear linear(const MapMatch& match, int view, int lamp) const {
    const Matrix3d& rotation = match.cam_from_map.rotation;
    const Vector3d mapped = match.cam_from_map * map_.lamps[lamp].position;
    Linear at;
    at.error = mapped - position(view, lamp);
    at.covariance =
        rotation * map_.lamps[lamp].covariance * rotation.transpose() + covariance(view, lamp);
    at.jacobian << -skew(mapped), Matrix3d::Identity();
    return at;
  }

  /// Gives each view the lamp with the smallest distance in its gate; a lamp has one view.
  void associate(MapMatch& match) const {
    struct Pair {
      double chi2;
      int view, lamp;
    };
    std::vector<Pair> pairs;
    for (int v = 0; v < static_cast<int>(picture_.views.size()); ++v)
      for (const int p : lamps_of_view_[v]) {
        if (!is_same_kind(v, p) || !axes_agree(match, v, p)) continue;
        const Vector3d mapped = match.cam_from_map * map_.lamps[p].position;
        constexpr double max_angle_cosine = 0.9;  // 26 degrees; larger errors have no gate
        if (mapped.dot(picture_.views[v].bearing) < max_angle_cosine * mapped.norm()) continue;
        Linear at = linear(match, v, p);
        at.covariance += at.jacobian * match.covariance * at.jacobian.transpose();
        const double chi2 = at.error.dot(core::inverse<Matrix3d>(at.covariance) * at.error);
        if (chi2 < gate_chi2_3) pairs.push_back({chi2, v, p});
      }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& a, const Pair& b) { return a.chi2 < b.chi2; });
    std::vector<bool> taken(map_.lamps.size(), false);
    std::fill(match.lamp_of_view.begin(), match.lamp_of_view.end(), -1);
    match.matches = 0;
    for (const Pair& pair : pairs) {
      if (match.lamp_of_view[pair.view] >= 0 || taken[pair.lamp]) continue;
      match.lamp_of_view[pair.view] = pair.lamp;
      taken[pair.lamp] = true;
      ++match.matches;
    }
  }

  /// `views`: those of the hypothesis, three lamps or one tag; two lamps are no evidence.
  void score(MapMatch& match, double log10_sides, const std::vector<int>& views) const {
    const double n = static_cast<double>(picture_.views.size());
    const bool by_tag = views.size() == 1;
    double log10_nfa = views.size() < 3 ? 0 : log10_triples_ + log10_sides;
    std::vector<double> terms;
    for (std::size_t v = 0; v < match.lamp_of_view.size(); ++v) {
      if (match.lamp_of_view[v] < 0 || (by_tag && static_cast<int>(v) == views[0])) continue;
      Linear at = linear(match, static_cast<int>(v), match.lamp_of_view[v]);
      at.covariance += at.jacobian * match.covariance * at.jacobian.transpose();
      const Vector3d& bearing = picture_.views[v].bearing;
      const double range = position(static_cast<int>(v), match.lamp_of_view[v]).norm();
      if (line_normal_) {
        const Vector3d along = line_normal_->cross(bearing).normalized();
        const double gate = 2 * std::sqrt(gate_chi2_3 * along.dot(at.covariance * along)) / range;
        terms.push_back(std::log10(std::min(1.0, n * gate / std::sqrt(field_sr_))));
        continue;
      }
      const Matrix3d to_local = shortest_rotation(bearing, Vector3d::UnitZ());
      const Eigen::Matrix2d across =
          (to_local * at.covariance * to_local.transpose()).topLeftCorner<2, 2>();
      const double area =
          pi * gate_chi2_3 * std::sqrt(std::max(0.0, across.determinant())) / square(range);
      terms.push_back(std::log10(std::min(1.0, n * area / field_sr_)));
    }
    std::sort(terms.begin(), terms.end());  // the hypothesis takes the best ones
    for (std::size_t i = by_tag ? 0 : views.size(); i < terms.size(); ++i) log10_nfa += terms[i];
    // Lamps of one ceiling are parallel: their sides count once.
    double log10_sides_agree = 0;
    for (const int lamp : match.lamp_of_view)
      if (lamp >= 0 && map_.lamps[lamp].tag >= 0)
        log10_nfa += std::log10(max_turn_rad / pi * (1 - std::cos(max_tag_tilt_rad)));
      else if (lamp >= 0 && !map_.lamps[lamp].x_axis.isZero())
        log10_sides_agree =
            std::min(log10_sides_agree,
                     std::log10(2 * max_turn_rad / (is_square(map_.lamps[lamp]) ? pi / 2 : pi)));
    log10_nfa += log10_sides_agree;
    match.contradictions = missing(match) + extra(match);
    match.log10_false_alarms = log10_nfa + missing_log10 * match.contradictions;
  }

  /// Lamps that should be in the picture and are not.
  int missing(const MapMatch& match) const {
    std::vector<bool> matched(map_.lamps.size(), false);
    for (const int lamp : match.lamp_of_view)
      if (lamp >= 0) matched[lamp] = true;
    int count = 0;
    for (std::size_t p = 0; p < map_.lamps.size(); ++p)
      if (!matched[p] && map_.lamps[p].tag < 0 &&
          is_absent(map_.lamps[p].position, map_.lamps[p].normal, map_.lamps[p].size,
                    match.cam_from_map, *picture_.blobs))
        ++count;
    return count;
  }

  /// Views without a lamp that a placed picture should show and does not.
  int extra(const MapMatch& match) const {
    const Rigid3 map_from_cam = match.cam_from_map.inverse();
    int count = 0;
    for (std::size_t v = 0; v < picture_.views.size(); ++v) {
      if (match.lamp_of_view[v] >= 0 || picture_.views[v].tag >= 0) continue;
      const double size =
          size_of_further_lamp(picture_.views[v], match.cam_from_map, map_.lamps, 0).size;
      const Vector3d at = map_from_cam * view_position(picture_.views[v], size);
      for (const PlacedPicture& placed : map_.placed)
        if (is_absent(at, map_.lamps[0].normal, size, placed.cam_from_map,
                      *pictures_[placed.picture].blobs)) {
          ++count;
          break;
        }
    }
    return count;
  }

  /// True if a lamp is well inside a picture, with its lit side, and no blob is near its image.
  bool is_absent(const Vector3d& at, const Vector3d& normal, double size, const Rigid3& pose,
                 const std::vector<Blob>& blobs) const {
    const Vector3d in_cam = pose * at;
    constexpr double min_cosine = 0.2;  // a lamp seen from the side may be too faint
    if (-(pose.rotation * normal).dot(in_cam) < min_cosine * in_cam.norm()) return false;
    const auto px = camera_.project(in_cam);
    if (!px) return false;
    // Distance of two radii: the lamp is whole, and errors of the map are smaller than a lamp.
    const double margin = 2 * size / in_cam.norm() * std::max(camera_.fx_px(), camera_.fy_px());
    if (px->x() < margin || px->y() < margin || px->x() > camera_.width() - margin ||
        px->y() > camera_.height() - margin)
      return false;
    for (const Blob& blob : blobs)
      if (px->x() > blob.x0 - margin && px->x() < blob.x1 + margin && px->y() > blob.y0 - margin &&
          px->y() < blob.y1 + margin)
        return false;
    return true;
  }

  const PictureViews& picture_;
  const LampMap& map_;
  const std::vector<PictureViews>& pictures_;
  const Camera& camera_;
  const Rigid3* neighbour_;
  std::vector<std::vector<int>> lamps_of_view_;
  Vector3d common_normal_;               // of the picture's lamps, camera frame
  std::optional<Vector3d> line_normal_;  // of the plane of camera and lamps, if these are on a line
  double field_sr_ = 1, field_ = 1, log10_triples_ = 0;
  std::set<std::pair<int, std::vector<int>>> tried_;
  std::set<std::vector<int>> final_;
  std::vector<MapMatch> found_;
};

}  // namespace

Vector3d view_position(const LampShapeView& view, double size) {
  return view.range * size * view.bearing;
}

double field_of_view_sr(const Camera& camera) {
  const double field_x = camera.width() / camera.fx_px();
  const double field_y = camera.height() / camera.fy_px();
  return std::min(field_x * field_y, 2 * pi);
}

Matrix3d view_covariance(const LampShapeView& view, double size, double size_sigma) {
  const double range = view.range * size;
  const Matrix3d along = view.bearing * view.bearing.transpose();
  return square(range) * (square(view.angle_sigma_rad) * (Matrix3d::Identity() - along) +
                          (square(view.range_sigma) + square(size_sigma)) * along);
}

std::vector<MapMatch> match_picture(const PictureViews& picture, const LampMap& map,
                                    const std::vector<PictureViews>& pictures, const Camera& camera,
                                    const MatchCandidates& candidates, const Rigid3* neighbour) {
  if (picture.views.size() < 2 || map.lamps.size() < 2) return {};
  return Matcher(picture, map, pictures, camera, candidates, neighbour).run();
}

MatchVerdict judge_matches(const std::vector<MapMatch>& matches, double max_log10_false_alarms,
                           int min_matches) {
  MatchVerdict verdict;
  if (matches.empty() || matches[0].log10_false_alarms > max_log10_false_alarms ||
      matches[0].matches < min_matches)
    return verdict;
  verdict.kind = MatchVerdict::Kind::matched;
  verdict.ways = 1;
  const MapMatch& best = matches[0];
  for (std::size_t i = 1; i < matches.size(); ++i) {
    const MapMatch& rival = matches[i];
    int different = 0;
    for (std::size_t v = 0; v < best.lamp_of_view.size(); ++v)
      if (rival.lamp_of_view[v] >= 0 && rival.lamp_of_view[v] != best.lamp_of_view[v]) ++different;
    // Hypotheses that differ in one lamp only are the same motion with another assignment.
    if (different < 3) continue;
    if (rival.matches >= 3 && 2 * rival.matches >= best.matches &&
        rival.contradictions <= best.contradictions)
      ++verdict.ways;
  }
  if (verdict.ways > 1) verdict.kind = MatchVerdict::Kind::ambiguous;
  return verdict;
}

}  // namespace occ::internal::survey
