// SPDX-License-Identifier: Apache-2.0
// Use of links in a growing map: starts from linked blobs, which need no rims, and codes.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/survey/internal/growing_map.hpp"

namespace occ::internal::survey {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double nominal_size = 1e-3;   // over the distance, of lamps without any rim
constexpr double nominal_sigma = 0.05;  // likewise, of a position before the adjustment

/// Normal of the plane that fits the positions best, on the side of `viewer`.
Vector3d plane_normal(const std::vector<MapLamp>& lamps, const Vector3d& viewer) {
  Vector3d mean = Vector3d::Zero();
  for (const MapLamp& lamp : lamps) mean += lamp.position / static_cast<double>(lamps.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const MapLamp& lamp : lamps)
    scatter += (lamp.position - mean) * (lamp.position - mean).transpose();
  const Vector3d normal =
      core::symmetric_eigen<Matrix3d>(scatter, Eigen::ComputeEigenvectors).eigenvectors().col(0);
  return normal.dot(viewer - mean) < 0 ? Vector3d(-normal) : normal;
}

/// A start after its adjustment.
struct AdjustedStart {
  const PointStarts* start = nullptr;
  double misfit = 0;              ///< chi-square, with a penalty for each observation without use
  double variance = 1;            ///< a posteriori variance factor, at least 1
  std::map<int, Vector3d> lamps;  ///< positions by link
};

/// True if the lamps of two maps have different distances, up to a scale.
bool differ(const AdjustedStart& a, const AdjustedStart& b) {
  std::vector<double> in_a, in_b;
  double sum_a = 0, sum_b = 0;
  for (const auto& [i, at] : a.lamps)
    for (const auto& [j, other] : a.lamps) {
      if (j >= i || b.lamps.count(i) == 0 || b.lamps.count(j) == 0) continue;
      in_a.push_back((at - other).norm());
      in_b.push_back((b.lamps.at(i) - b.lamps.at(j)).norm());
      sum_a += in_a.back();
      sum_b += in_b.back();
    }
  constexpr double max_difference = 0.02;  // of the mean distance, far beyond adjusted errors
  for (std::size_t i = 0; i < in_a.size(); ++i)
    if (std::abs(in_a[i] / sum_a - in_b[i] / sum_b) * static_cast<double>(in_a.size()) >
        max_difference)
      return true;
  return false;
}

}  // namespace

int GrowingMap::linked_blobs(int picture) const {
  int count = 0;
  for (std::size_t b = 0; b < input_[picture].blobs.size(); ++b)
    count += links_.link(picture, static_cast<int>(b)) >= 0;
  return count;
}

bool GrowingMap::links_are_on_a_line(int picture) const {
  std::vector<Vector3d> bearings;
  for (std::size_t b = 0; b < input_[picture].blobs.size(); ++b) {
    const auto bearing = camera_.unproject(input_[picture].blobs[b].centroid_px);
    if (bearing && links_.link(picture, static_cast<int>(b)) >= 0) bearings.push_back(*bearing);
  }
  constexpr double max_width = 0.03;  // over the length, far beyond the noise of a distant corridor
  return line_normal(bearings, max_width).has_value();
}

std::vector<PointStarts> GrowingMap::link_starts() const {
  std::vector<PixelsOfPoints> pixels(input_.size());
  for (std::size_t i = 0; i < input_.size(); ++i)
    for (std::size_t b = 0; b < input_[i].blobs.size(); ++b) {
      const int link = links_.link(static_cast<int>(i), static_cast<int>(b));
      if (link >= 0) pixels[i][link] = input_[i].blobs[b].centroid_px;
    }
  return free_starts(std::vector<Camera>(input_.size(), camera_), pixels);
}

void GrowingMap::start(const PointStarts& starts) {
  clear();
  std::map<int, int> lamp_of_link;
  for (const auto& [link, at] : starts.points_m) {
    lamp_of_link[link] = static_cast<int>(map_.lamps.size());
    map_.lamps.emplace_back().position = at;
  }
  Vector3d viewer = Vector3d::Zero();
  std::vector<std::vector<double>> sizes(map_.lamps.size()), distances(map_.lamps.size());
  for (const auto& [picture, pose] : starts.cam_from_world) {
    viewer += pose.origin_in_source() / static_cast<double>(starts.cam_from_world.size());
    PlacedPicture placed;
    placed.picture = picture;
    placed.cam_from_map = pose;
    for (std::size_t b = 0; b < input_[picture].blobs.size(); ++b) {
      const auto lamp = lamp_of_link.find(links_.link(picture, static_cast<int>(b)));
      placed.lamp_of.push_back(lamp == lamp_of_link.end() ? -1 : lamp->second);
      if (lamp == lamp_of_link.end()) continue;
      distances[lamp->second].push_back((pose * map_.lamps[lamp->second].position).norm());
    }
    for (const LampShapeView& view : pictures_[picture].views)
      if (const int lamp = placed.lamp_of[view.blob]; lamp >= 0) {
        sizes[lamp].push_back((pose * map_.lamps[lamp].position).norm() / view.range);
        map_.lamps[lamp].shape = view.shape;
        map_.lamps[lamp].aspect = aspect_of(view);
      }
    add(std::move(placed));
  }
  const Vector3d normal = plane_normal(map_.lamps, viewer);
  for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp) {
    MapLamp& known = map_.lamps[lamp];
    const double distance = median(distances[lamp]);
    known.size = sizes[lamp].empty() ? nominal_size * distance : median(sizes[lamp]);
    known.size_sigma = options_.size_spread;
    known.covariance = square(nominal_sigma * distance) * Matrix3d::Identity();
    known.normal = normal;
  }
}

int GrowingMap::join_by_links() {
  constexpr Eigen::Index min_known = 4;
  std::map<int, int> lamp_of_link;
  for (const PlacedPicture& placed : map_.placed)
    for (std::size_t b = 0; b < placed.lamp_of.size(); ++b)
      if (const int link = links_.link(placed.picture, static_cast<int>(b));
          link >= 0 && placed.lamp_of[b] >= 0)
        lamp_of_link[link] = placed.lamp_of[b];
  int joined = 0;
  for (int picture = 0; picture < static_cast<int>(input_.size()); ++picture) {
    if (place_of_[picture] >= 0 || dropped_[picture]) continue;
    PlacedPicture placed;
    placed.picture = picture;
    std::vector<Vector3d> known;
    std::vector<Eigen::Vector2d> seen;
    for (std::size_t b = 0; b < input_[picture].blobs.size(); ++b) {
      const auto lamp = lamp_of_link.find(links_.link(picture, static_cast<int>(b)));
      const bool is_known =
          lamp != lamp_of_link.end() &&
          std::count(placed.lamp_of.begin(), placed.lamp_of.end(), lamp->second) == 0;
      placed.lamp_of.push_back(is_known ? lamp->second : -1);
      if (!is_known) continue;
      known.push_back(map_.lamps[lamp->second].position);
      seen.push_back(input_[picture].blobs[b].centroid_px);
    }
    const auto count = static_cast<Eigen::Index>(known.size());
    if (count < min_known) continue;
    const Result<Resection> found =
        resect(Eigen::Map<const Eigen::Matrix3Xd>(known[0].data(), 3, count),
               Eigen::Map<const Eigen::Matrix2Xd>(seen[0].data(), 2, count), camera_);
    if (!found.ok() || std::count(found->inliers.begin(), found->inliers.end(), true) < min_known)
      continue;
    placed.cam_from_map = found->cam_from_world;
    add(std::move(placed));
    ++joined;
  }
  return joined;
}

std::vector<std::optional<int>> GrowingMap::codes_of_lamps() const {
  std::vector<std::optional<int>> codes(map_.lamps.size());
  for (const PlacedPicture& placed : map_.placed)
    for (std::size_t b = 0; b < placed.lamp_of.size(); ++b)
      if (placed.lamp_of[b] >= 0)
        if (const auto code = links_.code(links_.link(placed.picture, static_cast<int>(b))))
          codes[placed.lamp_of[b]] = code;
  return codes;
}

void GrowingMap::limit_by_codes(int picture, MatchCandidates& candidates) const {
  const std::vector<std::optional<int>> codes = codes_of_lamps();
  for (std::size_t v = 0; v < candidates.size(); ++v) {
    const auto code = links_.code(links_.link(picture, pictures_[picture].views[v].blob));
    if (!code) continue;
    const bool is_known = std::count(codes.begin(), codes.end(), code) > 0;
    std::vector<int>& lamps = candidates[v];
    lamps.erase(std::remove_if(
                    lamps.begin(), lamps.end(),
                    [&](int lamp) { return is_known ? codes[lamp] != code : bool(codes[lamp]); }),
                lamps.end());
  }
}

LinkStart start_from_links(GrowingMap& growing) {
  constexpr double unused = 16;          // chi-square of an image point that is not used
  constexpr double min_difference = 20;  // of chi-square, between two maps
  const std::vector<PointStarts> starts = growing.link_starts();
  std::vector<AdjustedStart> adjusted;
  for (const PointStarts& start : starts) {
    growing.start(start);
    const Result<Adjustment> found = growing.adjust_without_lengths();
    if (!found.ok()) continue;
    AdjustedStart& one = adjusted.emplace_back();
    one.start = &start;
    one.misfit = 2 * found->cost - unused * found->observations / 2.0;
    one.variance = std::max(1.0, square(found->sigma0));
    int lamp = 0;  // in the order of the start
    for (const auto& [link, at] : start.points_m)
      one.lamps[link] = growing.map().lamps[lamp++].position;
  }
  if (adjusted.empty()) return LinkStart::none;
  const AdjustedStart& best = *std::min_element(
      adjusted.begin(), adjusted.end(),
      [](const AdjustedStart& a, const AdjustedStart& b) { return a.misfit < b.misfit; });
  for (const AdjustedStart& other : adjusted)
    if (other.misfit - best.misfit < min_difference * best.variance && differ(best, other))
      return LinkStart::ambiguous;
  growing.start(*best.start);
  return growing.adjust_without_lengths().ok() ? LinkStart::started : LinkStart::none;
}

}  // namespace occ::internal::survey
