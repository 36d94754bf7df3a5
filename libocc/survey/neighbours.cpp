// SPDX-License-Identifier: Apache-2.0
// A neighbour in a recording limits which lamps a picture shows and how far the camera moved. A
// small motion is evidence of a match.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/survey/internal/growing_map.hpp"

namespace occ::internal::survey {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<int> GrowingMap::placed_neighbours(int picture) const {
  std::vector<int> neighbours;
  for (const int other : {picture - 1, picture + 1})
    if (other >= 0 && other < static_cast<int>(place_of_.size()) && place_of_[other] >= 0)
      neighbours.push_back(place_of_[other]);
  return neighbours;
}

int GrowingMap::placed_neighbour(int picture) const {
  const std::vector<int> neighbours = placed_neighbours(picture);
  return neighbours.empty() ? -1 : neighbours[0];
}

MatchCandidates GrowingMap::candidates_near(int picture, int neighbour) const {
  const Rigid3& near = map_.placed[neighbour].cam_from_map;
  // Single lamps move by up to twice the median, as those above a camera that passes below them.
  const double min_cosine = std::cos(std::min(pi, 2 * options_.max_motion_rad));
  MatchCandidates candidates;
  for (const LampShapeView& view : pictures_[picture].views) {
    candidates.emplace_back();
    for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp) {
      const Vector3d in_cam = near * map_.lamps[lamp].position;
      if (in_cam.dot(view.bearing) > min_cosine * in_cam.norm())
        candidates.back().push_back(static_cast<int>(lamp));
    }
  }
  return candidates;
}

std::vector<MapMatch> GrowingMap::without_fast_motions(int picture,
                                                       std::vector<MapMatch> matches) const {
  const std::vector<int> neighbours = placed_neighbours(picture);
  const auto is_fast = [&](const MapMatch& match) {
    for (const int neighbour : neighbours) {
      const Rigid3& before = map_.placed[neighbour].cam_from_map;
      std::vector<double> angles;
      for (const int lamp : match.lamp_of_view) {
        if (lamp < 0) continue;
        const Vector3d a = (before * map_.lamps[lamp].position).normalized();
        const Vector3d b = (match.cam_from_map * map_.lamps[lamp].position).normalized();
        angles.push_back(std::atan2(a.cross(b).norm(), a.dot(b)));
      }
      if (median(angles) > options_.max_motion_rad) return true;
      // The far lamps of a corridor have much the same directions one lamp further on, or in a
      // camera that looks back from the other end.
      constexpr double max_turn = 4, max_shift = 2;  // over max_motion_rad
      const Matrix3d turn = match.cam_from_map.rotation * before.rotation.transpose();
      if (so3_log(turn).norm() > max_turn * options_.max_motion_rad) return true;
      double nearest = infinity;
      for (const int lamp : map_.placed[neighbour].lamp_of)
        if (lamp >= 0) nearest = std::min(nearest, (before * map_.lamps[lamp].position).norm());
      const Vector3d shift = match.cam_from_map.origin_in_source() - before.origin_in_source();
      if (shift.norm() > max_shift * options_.max_motion_rad * nearest) return true;
    }
    return false;
  };
  matches.erase(std::remove_if(matches.begin(), matches.end(), is_fast), matches.end());
  return matches;
}

void GrowingMap::count_small_motions(int picture, int neighbour,
                                     std::vector<MapMatch>& matches) const {
  const Rigid3& near = map_.placed[neighbour].cam_from_map;
  const std::vector<LampShapeView>& views = pictures_[picture].views;
  const std::vector<int>& seen = map_.placed[neighbour].lamp_of;
  const std::ptrdiff_t seen_before =
      std::count_if(seen.begin(), seen.end(), [](int lamp) { return lamp >= 0; });
  const double lamps =
      std::max(static_cast<double>(views.size()), static_cast<double>(seen_before));
  const double field_sr = field_of_view_sr(camera_);
  for (MapMatch& match : matches) {
    double max_angle = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (match.lamp_of_view[v] < 0) continue;
      const Vector3d before = near * map_.lamps[match.lamp_of_view[v]].position;
      max_angle = std::max(max_angle, std::atan2(before.cross(views[v].bearing).norm(),
                                                 before.dot(views[v].bearing)));
    }
    const double by_chance = std::min(1.0, lamps * pi * square(max_angle) / field_sr);
    match.log10_false_alarms =
        std::min(match.log10_false_alarms,
                 neighbour_log10 + match.matches * std::log10(std::max(by_chance, 1e-9)) +
                     missing_log10 * match.contradictions);
  }
  std::stable_sort(matches.begin(), matches.end(), [](const MapMatch& a, const MapMatch& b) {
    return a.log10_false_alarms < b.log10_false_alarms;
  });
}

}  // namespace occ::internal::survey
