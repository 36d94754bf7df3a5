// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/rung_choice.hpp"

#include <algorithm>
#include <sstream>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

using Forecasts = std::vector<RungForecast>;

std::string milliseconds(double seconds) {
  std::ostringstream text;
  text.precision(3);
  text << 1e3 * seconds << " ms";
  return text.str();
}

std::string millimetres(double metres) {
  std::ostringstream text;
  text.precision(3);
  text << 1e3 * metres << " mm";
  return text.str();
}

bool affordable(const RungForecast& f, const RungWish& wish) {
  return !wish.left_s || f.predicted_s <= wish.left_s();
}

std::string what_is_left(const RungWish& wish) {
  const double left_s = wish.left_s();
  return left_s > 0 ? milliseconds(left_s) + " are left of the budget" : "the budget is spent";
}

RungChoice taken(const RungForecast& f, const Forecasts& all, bool met, std::string reason) {
  return {f.rung, f.predicted_s, f.predicted_sigma_m, met, std::move(reason), all};
}

/// No rung fits the budget: chooses the fastest.
RungChoice over_budget(const Forecasts& all, const RungWish& wish) {
  const RungForecast& cheapest = all.front();
  return taken(cheapest, all, false,
               std::string(to_string(cheapest.rung)) + ", the cheapest, takes " +
                   milliseconds(cheapest.predicted_s) + ", and " + what_is_left(wish));
}

RungChoice by_budget(const Forecasts& all, const RungWish& wish) {
  const RungForecast* best = nullptr;
  for (const RungForecast& f : all) {
    if (affordable(f, wish) && (!best || f.rung > best->rung)) best = &f;
  }
  if (!best) return over_budget(all, wish);
  return taken(*best, all, true,
               std::string(to_string(best->rung)) +
                   " is the most accurate within the budget: " + milliseconds(best->predicted_s) +
                   " of the " + milliseconds(wish.left_s()) + " that are left");
}

/// No rung meets the target: chooses the most accurate within the budget, and reports the next one.
RungChoice short_of_target(const Forecasts& all, const RungWish& wish, const RungForecast* dearer) {
  const RungForecast* best = nullptr;
  for (const RungForecast& f : all) {
    const bool better = &f != dearer && f.predicted_sigma_m &&
                        (!best || *f.predicted_sigma_m < *best->predicted_sigma_m);
    if (better) best = &f;
  }
  if (!best) return over_budget(all, wish);
  std::string reason = std::string("no rung reaches ") + millimetres(*wish.target_sigma_m) +
                       (dearer ? " within the budget; " : "; ") + to_string(best->rung) +
                       " reaches " + millimetres(*best->predicted_sigma_m);
  if (dearer) {
    reason += std::string(", ") + to_string(dearer->rung) + " would take " +
              milliseconds(dearer->predicted_s) + ", and " + what_is_left(wish);
  } else {
    reason += ": more or larger lamps, a shorter distance or less noise would be required";
  }
  return taken(*best, all, false, std::move(reason));
}

RungChoice by_target(Forecasts& all, const RungWish& wish,
                     const std::function<double(Rung)>& sigma_of) {
  const RungForecast* dearer = nullptr;
  for (RungForecast& f : all) {
    if (!affordable(f, wish)) {
      dearer = &f;
      break;  // the following rungs are slower
    }
    f.predicted_sigma_m = sigma_of(f.rung);
    if (!affordable(f, wish)) {  // the prediction itself took time
      dearer = &f;
      break;
    }
    if (!(*f.predicted_sigma_m <= *wish.target_sigma_m)) continue;
    return taken(f, all, true,
                 std::string(to_string(f.rung)) + " is the cheapest that meets " +
                     millimetres(*wish.target_sigma_m) + ": " + millimetres(*f.predicted_sigma_m) +
                     " in " + milliseconds(f.predicted_s));
  }
  return short_of_target(all, wish, dearer);
}

}  // namespace

RungChoice choose_rung(std::vector<RungForecast> forecasts, const RungWish& wish,
                       const std::function<double(Rung)>& sigma_of) {
  require(!forecasts.empty(), "forecasts", forecasts.size(), "at least one");
  if (!wish.left_s && !wish.target_sigma_m) {
    return taken(forecasts.front(), forecasts, true,
                 std::string(to_string(forecasts.front().rung)) + ", as the options say");
  }
  std::stable_sort(
      forecasts.begin(), forecasts.end(),
      [](const RungForecast& a, const RungForecast& b) { return a.predicted_s < b.predicted_s; });
  return wish.target_sigma_m ? by_target(forecasts, wish, sigma_of) : by_budget(forecasts, wish);
}

const char* to_string(Rung rung) {
  switch (rung) {
    case Rung::points:
      return "points";
    case Rung::centres:
      return "centres";
    case Rung::rims:
      return "rims";
    case Rung::direct:
      return "direct";
  }
  return "unknown";
}

}  // namespace occ
