// SPDX-License-Identifier: Apache-2.0
// Which measured lamp is which lamp of the map: pairs, the test of their places, and the pictures
// that show or miss a place.
#include "libocc/survey/internal/lamp_changes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"
#include "libocc/scene/view.hpp"

namespace occ::internal::survey {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

double lamp_size(const Lamp& lamp) { return std::sqrt(lamp.area_m2() / pi); }

MatrixXd map_covariance(const Scene& map, double map_sigma_m, int& assumed) {
  const Index count = static_cast<Index>(map.lamps.size());
  MatrixXd covariance = MatrixXd::Zero(3 * count, 3 * count);
  const Vector3d middle_m = map.mean_lamp_position_m();
  const auto by_scale_m = [&](const Lamp& lamp) -> Vector3d {
    return map.map_scale_sigma * (lamp.centre_m - middle_m);
  };
  assumed = 0;
  for (Index i = 0; i < count; ++i) {
    const Lamp& lamp = map.lamps[i];
    const auto own = map.position_sigma_m(lamp);
    const bool is_assumed = !own && lamp.shared_errors_m.empty();
    assumed += is_assumed;
    const Vector3d sigma = own          ? Vector3d(*own)
                           : is_assumed ? Vector3d(Vector3d::Constant(map_sigma_m))
                                        : Vector3d(Vector3d::Zero());
    covariance.block<3, 3>(3 * i, 3 * i) = sigma.array().square().matrix().asDiagonal();
    for (Index j = 0; j <= i; ++j) {
      const std::vector<Vector3d>& a = lamp.shared_errors_m;
      const std::vector<Vector3d>& b = map.lamps[j].shared_errors_m;
      Eigen::Matrix3d shared = by_scale_m(lamp) * by_scale_m(map.lamps[j]).transpose();
      for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
        shared += a[k] * b[k].transpose();
      covariance.block<3, 3>(3 * i, 3 * j) += shared;
      if (j < i) covariance.block<3, 3>(3 * j, 3 * i) += shared.transpose();
    }
  }
  return covariance;
}

namespace {

enum class Sight { none, seen, missed };

/// Sight of a place in one picture.
Sight sight_of(const Lamp& lamp, double sigma_m, int own, const LampBlock& block, int picture,
               const Rigid3& pose, const std::vector<Blob>& blobs, const Scene& map,
               double max_range) {
  const std::vector<int>& lamp_of_blob = block.lamp_of_blob(picture);
  if (own >= 0 && std::find(lamp_of_blob.begin(), lamp_of_blob.end(), own) != lamp_of_blob.end())
    return Sight::seen;
  const Vector3d in_cam = pose * lamp.centre_m;
  const double range = in_cam.norm();
  constexpr double min_cosine = 0.3;  // a lamp seen from the side may be too faint
  if (-(pose.rotation * lamp.normal).dot(in_cam) < min_cosine * range || range > max_range)
    return Sight::none;
  if (hidden_by_box(map.boxes, lamp.centre_m, pose.origin_in_source())) return Sight::none;
  const auto px = map.camera.project(in_cam);
  if (!px) return Sight::none;
  const double px_per_m = std::max(map.camera.fx_px(), map.camera.fy_px()) / range;
  constexpr double error_px = 2;      // of a pose and of a blob's border
  constexpr double place_sigmas = 3;  // of the place in the map
  const double error = error_px + place_sigmas * sigma_m * px_per_m;
  const double margin = 2 * lamp.reach_m() * px_per_m + error;
  if (border_distance_px(map.camera, *px) < margin) return Sight::none;
  for (std::size_t b = 0; b < blobs.size(); ++b) {
    const Blob& blob = blobs[b];
    const auto is_inside = [&](double grown) {
      return px->x() > blob.x0 - grown && px->x() < blob.x1 + grown && px->y() > blob.y0 - grown &&
             px->y() < blob.y1 + grown;
    };
    const bool is_whole = !blob.cut_by_border && !blob.merged;
    if (lamp_of_blob[b] >= 0 || !is_whole) {  // another lamp, or a lamp and more
      if (is_inside(is_whole ? 0 : margin)) return Sight::none;
    } else if (is_inside(error)) {
      return Sight::seen;
    }
  }
  return Sight::missed;
}

}  // namespace

PlaceEvidence place_evidence(const Lamp& lamp, double sigma_m, int own, const LampBlock& block,
                             const std::vector<SurveyPicture>& pictures, const Scene& map) {
  PlaceEvidence evidence;
  double max_range = 0;
  for (const BlockLamp& other : block.lamps())
    for (const int picture : other.pictures)
      max_range = std::max(max_range, (*block.pose(picture) * other.lamp.centre_m).norm());
  std::vector<Vector3d> directions;
  for (const int picture : block.pictures()) {
    const Rigid3 pose = *block.pose(picture);
    const Sight sight =
        sight_of(lamp, sigma_m, own, block, picture, pose, pictures[picture].blobs, map, max_range);
    if (sight == Sight::seen) evidence.seen.push_back(picture);
    if (sight != Sight::missed) continue;
    evidence.missed.push_back(picture);
    const Vector3d direction = (pose.origin_in_source() - lamp.centre_m).normalized();
    for (const Vector3d& other : directions)
      evidence.spread_rad = std::max(
          evidence.spread_rad, std::atan2(other.cross(direction).norm(), other.dot(direction)));
    directions.push_back(direction);
  }
  return evidence;
}

LampChanges::LampChanges(const Scene& map, const std::vector<LinkedBlock>& blocks,
                         const std::vector<SurveyPicture>& pictures, const UpdateOptions& options)
    : map_(map),
      blocks_(blocks),
      pictures_(pictures),
      options_(options),
      max_statistic_(chi2_quantile(1 - options.false_alarm, 3)),
      max_normal_(normal_quantile(1 - 0.5 * options.false_alarm)),
      covariance_(map_covariance(map, options.map_sigma_m, assumed_sigmas_)),
      place_of_(map.lamps.size(), -1) {
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t i = 0; i < blocks[b].block.lamps().size(); ++i)
      places_.push_back({static_cast<int>(b), static_cast<int>(i)});
  is_coded_.assign(places_.size(), false);
  lamp_of_.assign(places_.size(), -1);
  pair_by_code();
  pair_by_place();
  pair_overlapping();
  skip_duplicates();
  compare_places();
  for (std::size_t a = 0; a < map.lamps.size(); ++a) {
    PlaceEvidence all;
    const double sigma_m =
        std::sqrt(covariance_.diagonal().segment<3>(3 * static_cast<Index>(a)).maxCoeff());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      int own = -1;
      for (std::size_t p = 0; p < places_.size(); ++p)
        if (places_[p].block == static_cast<int>(b) && lamp_of_[p] == static_cast<int>(a))
          own = places_[p].lamp;
      const PlaceEvidence one =
          place_evidence(map.lamps[a], sigma_m, own, blocks[b].block, pictures, map);
      all.seen.insert(all.seen.end(), one.seen.begin(), one.seen.end());
      all.missed.insert(all.missed.end(), one.missed.begin(), one.missed.end());
      all.spread_rad = std::max(all.spread_rad, one.spread_rad);
    }
    std::sort(all.seen.begin(), all.seen.end());
    std::sort(all.missed.begin(), all.missed.end());
    evidence_.push_back(std::move(all));
  }
  has_colours_ = internal::scene::states_colours(map.lamps);
  find_common_factors();
}

const BlockLamp& LampChanges::measured(int place) const {
  return blocks_[places_[place].block].block.lamps()[places_[place].lamp];
}

void LampChanges::pair_by_code() {
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const LampSignal& seen = measured(static_cast<int>(p)).signal;
    std::vector<int> lamps;
    for (std::size_t a = 0; a < map_.lamps.size(); ++a) {
      const Lamp& lamp = map_.lamps[a];
      constexpr double sigmas = 4, tolerance = 0.02;  // of the clocks of lamp and rows
      const bool agrees =
          seen.id ? *seen.id == lamp.id
                  : seen.frequency_hz > 0 && lamp.frequency_hz && !lamp.code &&
                        std::abs(seen.frequency_hz - *lamp.frequency_hz) <
                            sigmas * seen.frequency_sigma_hz + tolerance * *lamp.frequency_hz;
      if (agrees) lamps.push_back(static_cast<int>(a));
    }
    if (lamps.size() != 1) continue;  // several lamps may share a frequency
    is_coded_[p] = true;
    pairs_.push_back({lamps[0], static_cast<int>(p)});
    lamp_of_[p] = lamps[0];
    if (place_of_[lamps[0]] < 0) place_of_[lamps[0]] = static_cast<int>(p);
  }
}

void LampChanges::pair_by_place() {
  for (std::size_t p = 0; p < places_.size(); ++p) {
    const int lamp = blocks_[places_[p].block].lamp_of[places_[p].lamp];
    if (lamp < 0) continue;
    if (is_coded_[p]) {
      if (lamp_of_[p] == lamp) linked_.push_back({lamp, static_cast<int>(p)});
      continue;
    }
    if (place_of_[lamp] >= 0 && is_coded_[place_of_[lamp]]) continue;  // its code is elsewhere
    linked_.push_back({lamp, static_cast<int>(p)});
    pairs_.push_back({lamp, static_cast<int>(p)});
    lamp_of_[p] = lamp;
    if (place_of_[lamp] < 0) place_of_[lamp] = static_cast<int>(p);
  }
}

/// Two lamps cannot be nearer than their sizes, so that one of them is the other, moved.
void LampChanges::pair_overlapping() {
  struct Near {
    double distance;
    int lamp, place;
  };
  std::vector<Near> all;
  for (std::size_t a = 0; a < map_.lamps.size(); ++a) {
    if (place_of_[a] >= 0) continue;
    for (std::size_t p = 0; p < places_.size(); ++p) {
      if (lamp_of_[p] >= 0) continue;
      const Lamp &old = map_.lamps[a], &seen = measured(static_cast<int>(p)).lamp;
      const double distance = (old.centre_m - seen.centre_m).norm();
      const double reach = std::max(lamp_size(old) + lamp_size(seen), 4 * options_.map_sigma_m);
      if (distance < reach) all.push_back({distance, static_cast<int>(a), static_cast<int>(p)});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Near& a, const Near& b) { return a.distance < b.distance; });
  for (const Near& near : all) {
    if (place_of_[near.lamp] >= 0 || lamp_of_[near.place] >= 0) continue;
    place_of_[near.lamp] = near.place;
    lamp_of_[near.place] = near.lamp;
    pairs_.push_back({near.lamp, near.place});
  }
}

/// Two constellations may show one new lamp: the first place is used.
void LampChanges::skip_duplicates() {
  for (std::size_t p = 0; p < places_.size(); ++p)
    for (std::size_t q = 0; q < p; ++q) {
      if (lamp_of_[p] != -1 || lamp_of_[q] != -1 || places_[p].block == places_[q].block) continue;
      const Lamp &a = measured(static_cast<int>(p)).lamp, &b = measured(static_cast<int>(q)).lamp;
      const double reach = std::max(lamp_size(a) + lamp_size(b), 4 * options_.map_sigma_m);
      if ((a.centre_m - b.centre_m).norm() < reach) lamp_of_[p] = no_lamp;
    }
}

void LampChanges::compare_places() {
  Eigen::Matrix3Xd map(3, static_cast<Index>(map_.lamps.size()));
  for (std::size_t a = 0; a < map_.lamps.size(); ++a)
    map.col(static_cast<Index>(a)) = map_.lamps[a].centre_m;
  const Index count = static_cast<Index>(places_.size());
  Eigen::Matrix3Xd places(3, count);
  for (Index p = 0; p < count; ++p) places.col(p) = measured(static_cast<int>(p)).lamp.centre_m;
  MatrixXd covariance = MatrixXd::Zero(3 * count, 3 * count);
  Index first = 0;
  for (const LinkedBlock& linked : blocks_) {
    const Index size = static_cast<Index>(linked.block.lamps().size());
    auto part = covariance.block(3 * first, 3 * first, 3 * size, 3 * size);
    part = linked.block.covariance();
    add_free_similarity(places.middleCols(first, size), part);
    first += size;
  }
  statistics_.emplace(std::move(map), covariance_, std::move(places), std::move(covariance));
  is_tested_ = statistics_->set_unchanged(linked_);
  if (!is_tested_) return;
  constexpr int min_unchanged = 4;  // three determine the similarity
  statistics_->separate(pairs_, max_statistic_, min_unchanged);
}

RelativeLight LampChanges::light_of(const Lamp& old, int place) const {
  return blocks_[places_[place].block].block.light_as(old, places_[place].lamp);
}

void LampChanges::find_common_factors() {
  std::vector<double> sizes, powers;
  std::array<std::vector<double>, 3> colours;
  for (std::size_t a = 0; a < map_.lamps.size(); ++a) {
    if (place_of_[a] < 0) continue;
    const BlockLamp& seen = measured(place_of_[a]);
    const double before = lamp_size(map_.lamps[a]), after = lamp_size(seen.lamp);
    if (seen.has_shape && before > 0 && after > 0) sizes.push_back(after / before);
    const RelativeLight light = light_of(map_.lamps[a], place_of_[a]);
    if (light.power) powers.push_back(*light.power / map_.lamps[a].power_w);
    if (!seen.light.colour) continue;
    for (int c = 0; c < 3; ++c)
      colours[static_cast<std::size_t>(c)].push_back((*seen.light.colour)[c] /
                                                     std::max(map_.lamps[a].colour[c], 1e-3));
  }
  constexpr std::size_t min_lamps = 3;  // the median is then not that of the one changed lamp
  has_size_factor_ = sizes.size() >= min_lamps;
  if (has_size_factor_) size_factor_ = median(sizes);
  if (powers.size() >= min_lamps) power_factor_ = median(powers);
  if (colours[0].size() < min_lamps) return;
  for (int c = 0; c < 3; ++c) colour_factor_[c] = median(colours[static_cast<std::size_t>(c)]);
}

bool LampChanges::is_gone(const PlaceEvidence& evidence) const {
  constexpr double min_spread_rad = 0.1;  // one obstacle hides a lamp from neighbouring places
  constexpr double max_seen_share = 0.1;  // more often seen: hidden in the others
  const double seen = static_cast<double>(evidence.seen.size());
  const double missed = static_cast<double>(evidence.missed.size());
  return static_cast<int>(evidence.missed.size()) >= options_.min_gone_pictures &&
         evidence.spread_rad >= min_spread_rad && seen <= max_seen_share * (seen + missed);
}

}  // namespace occ::internal::survey
