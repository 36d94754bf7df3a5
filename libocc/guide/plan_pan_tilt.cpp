// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/plan_pan_tilt.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "libocc/core/internal/parallel.hpp"
#include "libocc/core/require.hpp"
#include "libocc/guide/internal/route_view.hpp"
#include "libocc/guide/mount.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::guide;
namespace {

constexpr double blind_knot_cost = 1e4;
constexpr double check_step_m = 0.02;
constexpr double max_sigma_m = 1;  // larger bounds cost the same

std::vector<RoutePlace> even_places(const Route& route, double step_m) {
  const int count = std::max(1, static_cast<int>(std::ceil(route.length_m() / step_m - 1e-9)));
  std::vector<RoutePlace> places;
  for (int i = 0; i <= count; ++i) places.push_back(route.at(route.length_m() * i / count));
  return places;
}

/// Rejects grids on which an axis cannot reach the next angle between two positions, and would
/// never move.
void require_steps(const PanTiltOptions& options, const Route& route) {
  double speed = 0;
  for (const RoutePiece& piece : route.pieces()) speed = std::max(speed, piece.speed_m_s);
  const double length_m = route.length_m();
  const double time_s = length_m / std::ceil(length_m / options.step_m - 1e-9) / speed;
  const auto check = [&](int count, double range, double rate, const char* name) {
    if (count == 1 || rate == 0 || range == 0) return;
    require(range / (count - 1) <= rate * time_s, name, count,
            "large enough for an axis to reach the next angle while the vehicle drives step_m");
  };
  check(options.pans, options.max_pan_rad - options.min_pan_rad, options.pan_rate_rad_s, "pans");
  check(options.tilts, options.max_tilt_rad - options.min_tilt_rad, options.tilt_rate_rad_s,
        "tilts");
}

/// Planning with a slightly larger margin keeps the view valid between the positions checked.
VisibilityOptions with_margin(VisibilityOptions view) {
  view.margin_px += 2;
  return view;
}

class PanTiltSearch {
 public:
  PanTiltSearch(const Scene& scene, const Route& route, const PanTiltOptions& options)
      : route_(route),
        options_(options),
        views_(scene, options.view),
        margin_views_(scene, with_margin(options.view)),
        places_(even_places(route, options.step_m)),
        states_(static_cast<std::size_t>(options.pans) * static_cast<std::size_t>(options.tilts)) {}

  PanTiltResult run() {
    look();
    plan();
    PanTiltResult result;
    result.plan = traced();
    check(result);
    return result;
  }

 private:
  double pan_of(std::size_t state) const {
    const auto i = static_cast<double>(state / static_cast<std::size_t>(options_.tilts));
    return grid(i, options_.pans, options_.min_pan_rad, options_.max_pan_rad);
  }
  double tilt_of(std::size_t state) const {
    const auto i = static_cast<double>(state % static_cast<std::size_t>(options_.tilts));
    return grid(i, options_.tilts, options_.min_tilt_rad, options_.max_tilt_rad);
  }
  static double grid(double i, int count, double low, double high) {
    return count == 1 ? low : low + (high - low) * i / (count - 1);
  }
  Rigid3 mount(double pan_rad, double tilt_rad) const {
    return camera_on_vehicle(options_.view.camera_place_m, pan_rad, tilt_rad);
  }

  /// Computes the cost of each position for each pair of angles.
  void look() {
    std::vector<Rigid3> mounts;
    for (std::size_t s = 0; s < states_; ++s) mounts.push_back(mount(pan_of(s), tilt_of(s)));
    here_.assign(places_.size(), std::vector<double>(states_, 0));
    for_each_index(places_.size(), [&](std::size_t i) {
      const PlanarPose& pose = places_[i].pose;
      const Rigid3 body = body_from_world(pose);
      for (std::size_t s = 0; s < states_; ++s) {
        const std::vector<int> lamps = margin_views_.in_view(mounts[s] * body);
        Visibility seen;
        views_.bound(pose, mounts[s], lamps, seen);
        const int missing = options_.min_lamps - static_cast<int>(lamps.size());
        here_[i][s] = options_.sigma_cost_1_m * std::min(seen.position_sigma_m, max_sigma_m) +
                      (missing > 0 ? blind_knot_cost * missing : 0);
      }
    });
  }

  void plan() {
    costs_ = here_[0];
    from_.assign(places_.size(), std::vector<std::size_t>(states_, 0));
    for (std::size_t i = 1; i < places_.size(); ++i) {
      std::vector<double> next(states_);
      for_each_index(states_, [&](std::size_t to) { next[to] = here_[i][to] + reach(i, to); });
      costs_ = std::move(next);
    }
  }

  /// Computes the minimum cost of each pair of angles at position i.
  double reach(std::size_t i, std::size_t to) {
    const double way_m = places_[i].along_m - places_[i - 1].along_m;
    const double time_s = way_m / std::max(places_[i - 1].speed_m_s, places_[i].speed_m_s);
    double min_cost = std::numeric_limits<double>::infinity();
    for (std::size_t from = 0; from < states_; ++from) {
      const double pan = std::abs(pan_of(to) - pan_of(from));
      const double tilt = std::abs(tilt_of(to) - tilt_of(from));
      if (pan > options_.pan_rate_rad_s * time_s || tilt > options_.tilt_rate_rad_s * time_s)
        continue;
      double cost = costs_[from] + pan + tilt;
      if (!(cost < min_cost)) continue;
      cost += blind_knot_cost * blind_between(i, from, to);
      if (!(cost < min_cost)) continue;
      min_cost = cost;
      from_[i][to] = from;
    }
    return min_cost;
  }

  /// Share of the step to this position without sufficient view.
  double blind_between(std::size_t i, std::size_t from, std::size_t to) const {
    const double way_m = places_[i].along_m - places_[i - 1].along_m;
    const int parts = std::max(2, static_cast<int>(std::ceil(way_m / check_step_m)));
    int blind = 0;
    for (int k = 1; k < parts; ++k) {
      const double share = static_cast<double>(k) / parts;
      const auto between = [&](double a, double b) { return a + share * (b - a); };
      const RoutePlace place = route_.at(between(places_[i - 1].along_m, places_[i].along_m));
      const Rigid3 camera =
          mount(between(pan_of(from), pan_of(to)), between(tilt_of(from), tilt_of(to)));
      const int count = margin_views_.count_in_view(camera * body_from_world(place.pose));
      blind += count >= options_.min_lamps ? 0 : 1;
    }
    return static_cast<double>(blind) / parts;
  }

  PanTiltPlan traced() const {
    PanTiltPlan plan;
    auto state =
        static_cast<std::size_t>(std::min_element(costs_.begin(), costs_.end()) - costs_.begin());
    for (std::size_t i = places_.size(); i-- > 0;) {
      plan.knots.push_back({places_[i].along_m, pan_of(state), tilt_of(state)});
      state = from_[i][state];
    }
    std::reverse(plan.knots.begin(), plan.knots.end());
    return plan;
  }

  void check(PanTiltResult& result) const {
    GapList gaps;
    for (const RoutePlace& place : route_.sampled(std::min(check_step_m, 0.5 * options_.step_m))) {
      const PanTiltKnot knot = result.plan.at(place.along_m);
      const Rigid3 cam_from_world =
          mount(knot.pan_rad, knot.tilt_rad) * body_from_world(place.pose);
      gaps.add(place, views_.count_in_view(cam_from_world) >= options_.min_lamps);
    }
    result.gaps = std::move(gaps).found();
    double blind_m = 0;
    for (const ViewGap& gap : result.gaps) blind_m += gap.to_m - gap.from_m;
    result.seen_share = 1 - blind_m / route_.length_m();
    result.status = result.gaps.empty() ? PlanStatus::ok : PlanStatus::blind;
    if (result.gaps.empty()) return;
    const ViewGap& gap = result.gaps.front();
    std::ostringstream text;
    text << "no pan and tilt keep " << options_.min_lamps << " lamps in view along " << blind_m
         << " m of the route in " << result.gaps.size() << " sections, the first from "
         << gap.from_m << " m at (" << gap.from.x() << ", " << gap.from.y() << ") to " << gap.to_m
         << " m";
    result.message = text.str();
  }

  const Route& route_;
  const PanTiltOptions& options_;
  LampViews views_, margin_views_;
  std::vector<RoutePlace> places_;
  std::size_t states_;
  std::vector<std::vector<double>> here_;       // [position][state]
  std::vector<double> costs_;                   // cost of the best path to each state
  std::vector<std::vector<std::size_t>> from_;  // place, state: the state before
};

}  // namespace

void PanTiltOptions::validate() const {
  view.validate();
  require(min_lamps >= 1, "min_lamps", min_lamps, ">= 1");
  require(std::isfinite(min_pan_rad), "min_pan_rad", min_pan_rad, "finite");
  require(std::isfinite(max_pan_rad) && max_pan_rad >= min_pan_rad, "max_pan_rad", max_pan_rad,
          "finite and >= min_pan_rad");
  require(std::isfinite(min_tilt_rad), "min_tilt_rad", min_tilt_rad, "finite");
  require(std::isfinite(max_tilt_rad) && max_tilt_rad >= min_tilt_rad, "max_tilt_rad", max_tilt_rad,
          "finite and >= min_tilt_rad");
  require(pans >= 1, "pans", pans, ">= 1");
  require(tilts >= 1 && static_cast<long>(pans) * tilts <= 4096, "tilts", tilts,
          ">= 1, the grid no more than 4096 pairs");
  require(pan_rate_rad_s >= 0, "pan_rate_rad_s", pan_rate_rad_s, ">= 0");
  require(tilt_rate_rad_s >= 0, "tilt_rate_rad_s", tilt_rate_rad_s, ">= 0");
  require(std::isfinite(step_m) && step_m > 0, "step_m", step_m, "positive");
  require(std::isfinite(sigma_cost_1_m) && sigma_cost_1_m >= 0, "sigma_cost_1_m", sigma_cost_1_m,
          "finite and >= 0");
}

PanTiltResult plan_pan_tilt(const Scene& scene, const Route& route, const PanTiltOptions& options) {
  options.validate();
  Scene checked = scene;
  checked.validate();
  require_steps(options, route);
  return PanTiltSearch(checked, route, options).run();
}

}  // namespace occ
