// SPDX-License-Identifier: Apache-2.0
// Verdicts of an update, with their reasons, and what differs beside the place.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/name_list.hpp"
#include "libocc/core/math.hpp"
#include "libocc/survey/internal/lamp_changes.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

std::string text_of(double value, const char* unit = "", int digits = 4) {
  std::ostringstream text;
  text.precision(digits);
  text << value << unit;
  return text.str();
}

std::string text_of(const Vector3d& value) {
  std::ostringstream text;
  text.precision(3);
  text << value.x() << " " << value.y() << " " << value.z();
  return text.str();
}

const char* shape_name(LampShape shape) {
  switch (shape) {
    case LampShape::disc:
      return "disc";
    case LampShape::rectangle:
      return "rectangle";
    case LampShape::lame:
      return "lame";
    case LampShape::polygon:
      return "polygon";
    case LampShape::point:
      break;
  }
  return "point";
}

// The two normals of a disc in one view change with the view, the right one does not. Views that
// are nearer than this do not separate them beyond the errors of the rims.
constexpr double min_spread_rad = 0.3;

constexpr double assumed_tilt_rad = 0.2;  // of a lamp that is assumed to face as the others

std::string mm(double length_m) { return text_of(1e3 * length_m, " mm", 3); }

}  // namespace

std::string LampChanges::names(const std::vector<int>& pictures) const {
  std::vector<std::string> names;
  for (const int picture : pictures) names.push_back(pictures_[picture].name);
  return core::name_list(names, 5);
}

void LampChanges::compare_looks(LampUpdate& update, const Lamp& old, int place) const {
  const BlockLamp& seen = measured(place);
  const bool has_form = old.shape == LampShape::disc || old.shape == LampShape::rectangle;
  if (seen.has_shape && has_form && seen.lamp.shape != old.shape)
    update.changes.push_back({"shape", shape_name(old.shape), shape_name(seen.lamp.shape), 0});
  const double before = lamp_size(old), after = lamp_size(seen.lamp);
  if (seen.has_shape && before > 0 && after > 0) {
    // Rims of one lamp in two cameras, whose responses differ; the common part is size_factor_.
    const double model = has_size_factor_ ? 0.02 : 0.04;
    const double sigma =
        std::sqrt(square(old.size_sigma) + square(seen.lamp.size_sigma) + square(model));
    const double statistic = std::abs(std::log(after / (before * size_factor_))) / sigma;
    if (statistic > max_normal_)
      update.changes.push_back({"size", mm(before), mm(after / size_factor_), statistic});
    constexpr double model_tilt_rad = 0.03;  // of a normal by the rim of a lamp seen from below
    const double tilt =
        std::atan2(old.normal.cross(seen.lamp.normal).norm(), old.normal.dot(seen.lamp.normal));
    const double tilt_sigma =
        std::sqrt(square(old.tilt_sigma_rad.value_or(0)) +
                  square(seen.lamp.tilt_sigma_rad.value_or(0)) + square(model_tilt_rad));
    if (tilt > max_normal_ * tilt_sigma && seen.spread_rad > min_spread_rad)
      update.changes.push_back(
          {"normal", text_of(old.normal), text_of(seen.lamp.normal), tilt / tilt_sigma});
  }
  const RelativeLight light = light_of(old, place);
  if (light.power && power_factor_ > 0) {
    constexpr double model = 0.1;  // emission in the directions of the pictures
    const double power = *light.power / power_factor_;
    const double sigma =
        std::sqrt(square(old.power_sigma) + square(light.power_sigma) + square(model));
    const double statistic = std::abs(std::log(power / old.power_w)) / sigma;
    if (statistic > max_normal_)
      update.changes.push_back(
          {"power", text_of(old.power_w, " W", 3), text_of(power, " W", 3), statistic});
  }
  if (!seen.light.colour || !has_colours_) return;
  constexpr double overlap = 0.03;      // as in scene/lamp_colours.cpp
  constexpr double colour_model = 0.1;  // of a ratio of channels, without the common white balance
  const Vector3d colour = seen.light.colour->cwiseQuotient(colour_factor_);
  const Eigen::Array3d a = (old.colour / old.colour.sum()).array() + overlap;
  const Eigen::Array3d b = (colour / colour.sum()).array() + overlap;
  double statistic = 0;
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < j; ++k)
      statistic = std::max(statistic,
                           std::abs(std::log(b[j] / b[k]) - std::log(a[j] / a[k])) / colour_model);
  if (statistic > max_normal_)
    update.changes.push_back(
        {"colour", text_of(old.colour), text_of(Vector3d(3 * colour / colour.sum())), statistic});
}

Lamp LampChanges::lamp_at(const Lamp& old, int place, const std::vector<LampChange>& changes,
                          bool is_moved) const {
  const BlockLamp& seen = measured(place);
  Lamp lamp = old;
  for (const LampChange& change : changes) {
    if (change.quantity == "shape" || change.quantity == "size") {
      lamp.shape = seen.lamp.shape;
      lamp.radius_m = seen.lamp.radius_m / size_factor_;
      lamp.size_m = seen.lamp.size_m / size_factor_;
      lamp.size_sigma = seen.lamp.size_sigma;
      lamp.photometry.reset();  // that of another luminaire
      lamp.x_axis = seen.lamp.x_axis;
    }
    if (change.quantity == "normal" || change.quantity == "shape") {
      lamp.normal = seen.lamp.normal;
      lamp.tilt_sigma_rad = seen.lamp.tilt_sigma_rad;
      lamp.x_axis = seen.lamp.x_axis;
    }
    if (change.quantity == "power") lamp.power_w = *light_of(old, place).power / power_factor_;
    if (change.quantity == "colour") {
      const Vector3d colour = seen.light.colour->cwiseQuotient(colour_factor_);
      lamp.colour = 3 * colour / colour.sum();
    }
  }
  if (is_moved && seen.has_shape && lamp.uses_x_axis() && lamp.shape == seen.lamp.shape)
    lamp.x_axis = seen.lamp.x_axis;
  lamp.validate();
  return lamp;
}

std::optional<int> LampChanges::far_move(int lamp, const std::vector<int>& gone,
                                         std::string& reason) const {
  const Lamp& old = map_.lamps[lamp];
  const auto distance = [&](const Lamp& from, int place) {
    return (measured(place).lamp.centre_m - from.centre_m).norm();
  };
  int best = -1, nearest = -1;
  for (int p = 0; p < static_cast<int>(places_.size()); ++p) {
    if (lamp_of_[p] >= 0) continue;
    if (nearest < 0 || distance(old, p) < distance(old, nearest)) nearest = p;
    if (distance(old, p) > options_.max_move_m) continue;
    LampUpdate looks;
    compare_looks(looks, old, p);
    if (!looks.changes.empty()) {
      reason = "a new lamp " + mm(distance(old, p)) + " away has another " +
               looks.changes[0].quantity + ", so that it is not assumed to be this one";
      continue;
    }
    if (best < 0 || distance(old, p) < distance(old, best)) best = p;
  }
  if (best < 0) {
    if (reason.empty() && nearest >= 0)
      reason = "the nearest new lamp is " + text_of(distance(old, nearest), " m", 3) +
               " away, more than max_move_m = " + text_of(options_.max_move_m, " m") +
               ", so that it is not assumed to be this one";
    return std::nullopt;
  }
  constexpr double min_ratio = 2;  // of the distances of the next candidate and of this one
  const double moved = distance(old, best);
  bool is_unique = true;
  for (int p = 0; p < static_cast<int>(places_.size()); ++p)
    is_unique =
        is_unique && (p == best || lamp_of_[p] >= 0 || distance(old, p) > min_ratio * moved);
  for (const int other : gone)
    is_unique =
        is_unique && (other == lamp || distance(map_.lamps[other], best) > min_ratio * moved);
  if (!is_unique) {
    reason = "a new lamp is " + mm(moved) +
             " away, and another lamp is nearly as near, so that none is assumed to be this one";
    return std::nullopt;
  }
  reason = "assumed to be the new lamp " + mm(moved) +
           " away: within max_move_m = " + text_of(options_.max_move_m, " m") +
           ", it looks the same, and no other lamp is near";
  return best;
}

void LampChanges::add_evidence(LampUpdate& update, int lamp) const {
  update.seen = evidence_[lamp].seen;
  update.missed = evidence_[lamp].missed;
}

LampUpdate LampChanges::moved_lamp(int lamp, int place, const std::string& reason) const {
  const PlaceTest test = statistics_->test({lamp, place});
  const Lamp& old = map_.lamps[lamp];
  LampUpdate update;
  update.fate = LampFate::moved;
  update.has_test = true;
  update.displacement_m = test.moved;
  update.displacement_covariance_m2 = test.covariance;
  update.statistic = test.statistic;
  const Vector3d along = test.moved.normalized();
  update.displacement_sigma_m = std::sqrt(std::max(0.0, along.dot(test.covariance * along)));
  compare_looks(update, old, place);
  update.lamp = lamp_at(old, place, update.changes, true);
  update.reason = reason;
  return update;
}

bool LampChanges::is_unchanged(int lamp) const {
  return std::all_of(pairs_.begin(), pairs_.end(), [&](const PlacePair& pair) {
    return pair.lamp != lamp || statistics_->is_unchanged(pair);
  });
}

LampUpdate LampChanges::measured_verdict(int lamp, int place) {
  for (const PlacePair& pair : pairs_)  // of two constellations, the one that differs from the map
    if (pair.lamp == lamp && !statistics_->is_unchanged(pair)) place = pair.place;
  place_of_[lamp] = place;
  LampUpdate update = moved_lamp(lamp, place, "");
  if (is_unchanged(lamp)) {
    update.fate = update.changes.empty() ? LampFate::unchanged : LampFate::changed;
    update.lamp = lamp_at(map_.lamps[lamp], place, update.changes, false);
    update.reason = "at its place: " + mm(update.displacement_m.norm()) + " from the map, sigma " +
                    mm(update.displacement_sigma_m) + ", chi-square " +
                    text_of(update.statistic, "", 3) + " of at most " +
                    text_of(max_statistic_, "", 3);
    for (const LampChange& change : update.changes)
      update.reason += "; another " + change.quantity + ": " + change.before + " before, " +
                       change.after + " now";
  } else {
    const double distance = update.displacement_m.norm();
    update.reason = "chi-square " + text_of(update.statistic, "", 3) + " exceeds " +
                    text_of(max_statistic_, "", 3) + "; ";
    update.reason += is_coded_[place] ? "its code shows that it is this lamp"
                     : distance < lamp_size(map_.lamps[lamp]) + lamp_size(measured(place).lamp)
                         ? "it overlaps the old place, so that it is this lamp"
                         : "it is nearer than max_move_m = " + text_of(options_.max_move_m, " m");
  }
  if (!evidence_[lamp].missed.empty())
    update.reason += "; seen in " + std::to_string(evidence_[lamp].seen.size()) +
                     " pictures, hidden or dark in " + names(evidence_[lamp].missed);
  return update;
}

LampUpdate LampChanges::unmeasured_verdict(int lamp) const {
  const PlaceEvidence& evidence = evidence_[lamp];
  const std::size_t in_view = evidence.seen.size() + evidence.missed.size();
  LampUpdate update;
  update.lamp = map_.lamps[lamp];
  if (is_gone(evidence)) {
    update.fate = LampFate::gone;
    update.reason = "should be in " + std::to_string(in_view) + " pictures, seen in " +
                    std::to_string(evidence.seen.size()) +
                    (evidence.seen.empty() ? "" : " (" + names(evidence.seen) + ")") +
                    "; missing in " + names(evidence.missed);
    return update;
  }
  update.fate = LampFate::not_seen;
  if (in_view == 0) {
    update.reason = "in view of no picture; kept as it was";
  } else if (evidence.seen.empty()) {
    const bool few = static_cast<int>(in_view) < options_.min_gone_pictures;
    update.reason =
        "should be in " + std::to_string(in_view) + " pictures (" + names(evidence.missed) +
        ") and is in none; " +
        (few ? std::to_string(options_.min_gone_pictures) + " are needed to report it as gone"
             : "their views are too alike to exclude an obstacle") +
        "; kept as it was";
  } else {
    update.reason =
        "seen in " + names(evidence.seen) + ", too few views to measure its place; kept as it was";
  }
  return update;
}

LampUpdate LampChanges::new_lamp(int place, int id) const {
  const BlockLamp& seen = measured(place);
  LampUpdate update;
  update.fate = LampFate::added;
  update.lamp = seen.lamp;
  update.lamp.id = id;
  update.lamp.radius_m /= size_factor_;
  update.lamp.size_m /= size_factor_;
  Vector3d sum = Vector3d::Zero();
  for (const Lamp& lamp : map_.lamps) sum += lamp.normal;
  const Vector3d common =
      sum.norm() > 0 ? Vector3d(sum.normalized()) : Vector3d(-Vector3d::UnitZ());
  const bool has_normal = seen.has_shape && seen.spread_rad > min_spread_rad;
  if (!has_normal) {
    update.lamp.normal = common;
    update.lamp.x_axis =
        (update.lamp.x_axis - common * common.dot(update.lamp.x_axis)).normalized();
    if (!update.lamp.x_axis.allFinite()) update.lamp.x_axis = common.unitOrthogonal();
    update.lamp.tilt_sigma_rad = assumed_tilt_rad;
  }
  constexpr double power_sigma = 0.2;  // the emission between the pictures is not measured
  update.lamp.power_sigma = power_sigma;
  if (seen.light.power && power_factor_ > 0)
    update.lamp.power_w = *seen.light.power / power_factor_;
  update.lamp.colour = Vector3d::Ones();
  if (has_colours_ && seen.light.colour) {
    const Vector3d colour = seen.light.colour->cwiseQuotient(colour_factor_);
    update.lamp.colour = 3 * colour / colour.sum();
  }
  update.lamp.validate();
  update.seen = seen.pictures;
  update.reason = "no lamp of the map is at its place; seen in " +
                  std::to_string(seen.pictures.size()) + " pictures";
  if (!has_normal) update.reason += "; its normal is assumed to be that of the map's lamps";
  return update;
}

std::string LampChanges::name_of(int block, int lamp) const {
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (places_[p].block != block || places_[p].lamp != lamp) continue;
    if (lamp_of_[p] >= 0) return "lamp " + std::to_string(map_.lamps[lamp_of_[p]].id);
    if (new_ids_[p] >= 0) return "lamp " + std::to_string(new_ids_[p]);
    break;
  }
  return "a lamp";
}

void LampChanges::write(MapUpdate& result) {
  std::vector<int> gone;
  std::vector<bool> is_replaced(map_.lamps.size(), false);
  for (int a = 0; a < static_cast<int>(map_.lamps.size()); ++a) {
    const int place = place_of_[a];
    if (place >= 0 && !is_coded_[place] && is_gone(evidence_[a])) {
      lamp_of_[place] = no_lamp;  // lit in few pictures: neither this lamp nor a new one
      place_of_[a] = -1;
    } else if (place >= 0 && !is_coded_[place] && !is_unchanged(a) &&
               statistics_->test({a, place}).moved.norm() > options_.max_move_m) {
      lamp_of_[place] = place_of_[a] = -1;
      is_replaced[a] = true;
    }
    if (place_of_[a] < 0 && is_gone(evidence_[a])) gone.push_back(a);
  }
  std::vector<PlaceItem> items;
  std::vector<std::size_t> rows;
  const auto add_item = [&](PlaceItem::Kind kind, int index) {
    items.push_back({kind, index});
    rows.push_back(result.lamps.size());
  };
  const auto extent_of = [&](int a) {
    return covariance_.block<3, 3>(3 * static_cast<Index>(a), 3 * static_cast<Index>(a));
  };
  int changed = 0, expected = 0;
  for (int a = 0; a < static_cast<int>(map_.lamps.size()); ++a) {
    LampUpdate update;
    if (is_replaced[a]) {
      update.fate = LampFate::gone;
      update.lamp = map_.lamps[a];
      update.reason = "a new lamp overlaps its place, displaced by more than max_move_m = " +
                      text_of(options_.max_move_m, " m") +
                      ", so that it is not assumed to be this one";
    } else if (place_of_[a] >= 0) {
      update = measured_verdict(a, place_of_[a]);
    } else {
      std::string reason;
      const bool is_dark = std::find(gone.begin(), gone.end(), a) != gone.end();
      const std::optional<int> place = is_dark ? far_move(a, gone, reason) : std::nullopt;
      if (place) {
        place_of_[a] = *place;
        lamp_of_[*place] = a;
        update = moved_lamp(a, *place, reason);
      } else {
        update = unmeasured_verdict(a);
        if (!reason.empty()) update.reason += "; " + reason;
      }
    }
    add_evidence(update, a);
    update.old_centre_m = map_.lamps[a].centre_m;
    update.covariance_m2 = extent_of(a);
    const bool is_fused = update.fate == LampFate::unchanged || update.fate == LampFate::changed;
    if (is_fused) add_item(PlaceItem::Kind::fused, a);
    if (update.fate == LampFate::moved) add_item(PlaceItem::Kind::placed, place_of_[a]);
    if (update.fate == LampFate::not_seen) add_item(PlaceItem::Kind::kept, a);
    expected += update.fate != LampFate::not_seen;
    changed += update.fate == LampFate::moved || update.fate == LampFate::gone;
    result.lamps.push_back(std::move(update));
  }
  new_ids_.assign(places_.size(), -1);
  int id = 0;
  for (const Lamp& lamp : map_.lamps) id = std::max(id, lamp.id);
  for (int p = 0; p < static_cast<int>(places_.size()); ++p) {
    if (lamp_of_[p] != -1) continue;
    add_item(PlaceItem::Kind::placed, p);
    result.lamps.push_back(new_lamp(p, ++id));
    new_ids_[p] = id;
  }
  const PlaceEstimate estimate = statistics_->estimate(items);
  for (std::size_t i = 0; i < items.size(); ++i) {
    LampUpdate& update = result.lamps[rows[i]];
    update.lamp.centre_m = estimate.places.col(static_cast<Index>(i));
    update.covariance_m2 =
        estimate.covariance.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(i));
  }
  result.covariance_m2 = estimate.covariance;
  result.max_statistic = max_statistic_;
  result.changed_share = expected > 0 ? static_cast<double>(changed) / expected : 0;
  if (assumed_sigmas_ > 0)
    result.warnings.push_back("the map does not state the errors of " +
                              std::to_string(assumed_sigmas_) + " lamps: sigma " +
                              mm(options_.map_sigma_m) + " per axis is assumed (map_sigma_m)");
  constexpr double max_share = 0.4;
  if (result.changed_share > max_share)
    result.warnings.push_back(
        "of the lamps that pictures should show, " + text_of(100 * result.changed_share, " %", 2) +
        " moved or are gone: check that map and camera are those of this room");
}

}  // namespace occ::internal::survey
