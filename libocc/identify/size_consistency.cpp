// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/size_consistency.hpp"

#include <algorithm>
#include <cmath>

namespace occ::internal::identify {
namespace {

double separation(double d1, double d2, double cosine) {
  return std::sqrt(std::max(0.0, d1 * d1 + d2 * d2 - 2 * d1 * d2 * cosine));
}

// Smallest separation: at a limit of one distance, with the other one nearest to its foot.
double min_separation(const DistanceRange& a, const DistanceRange& b, double cosine) {
  double smallest = infinity;
  const auto add = [&](double limit, const DistanceRange& other) {
    if (std::isinf(limit)) return;
    const double foot = std::clamp(limit * cosine, other.low, other.high);
    smallest = std::min(smallest, separation(limit, foot, cosine));
  };
  add(a.low, b);
  add(a.high, b);
  add(b.low, a);
  add(b.high, a);
  return smallest;
}

// Largest separation: the distance is a convex function, so it is largest at a corner.
double max_separation(const DistanceRange& a, const DistanceRange& b, double cosine) {
  if (std::isinf(a.high) || std::isinf(b.high)) return infinity;
  return std::max({separation(a.low, b.low, cosine), separation(a.low, b.high, cosine),
                   separation(a.high, b.low, cosine), separation(a.high, b.high, cosine)});
}

}  // namespace

DistanceRange distances_m(const BearingObservation& observation, const MapPoint& map_point) {
  if (!map_point.disc || observation.max_radius_rad == 0) return {};
  const double tolerance = 1 + 3 * map_point.size_sigma;
  const double low_m = map_point.radius_m / tolerance, high_m = map_point.radius_m * tolerance;
  return {low_m / observation.max_radius_rad,
          observation.min_radius_rad > 0 ? high_m / observation.min_radius_rad : infinity};
}

SizeConsistency::SizeConsistency(const AssignmentProblem& problem)
    : problem_(problem), blobs_(problem.observations.size()), points_(problem.map_points.size()) {
  constexpr std::size_t max_states = 4000000;  // bytes
  const bool sized = std::any_of(problem.observations.begin(), problem.observations.end(),
                                 [](const BearingObservation& s) { return s.max_radius_rad > 0; });
  const std::size_t states = blobs_ * blobs_ * points_ * points_;
  if (sized && states <= max_states) states_.assign(states, 0);
}

bool SizeConsistency::permits(const Pair& first, const Pair& second) {
  if (states_.empty()) return true;
  const std::size_t a = first.observation * points_ + first.map_point;
  const std::size_t b = second.observation * points_ + second.map_point;
  char& state = states_[a * blobs_ * points_ + b];
  if (state == 0) state = compute(first, second) ? 1 : 2;
  return state == 1;
}

bool SizeConsistency::compute(const Pair& first, const Pair& second) const {
  constexpr double map_error = 0.02;  // relative error of the map
  const BearingObservation &s1 = problem_.observation(first.observation),
                           &s2 = problem_.observation(second.observation);
  const MapPoint &t1 = problem_.map_point(first.map_point),
                 &t2 = problem_.map_point(second.map_point);
  const DistanceRange a = distances_m(s1, t1), b = distances_m(s2, t2);
  const double cosine = s1.bearing.dot(s2.bearing), gate = problem_.options->gate_sigma;
  const double length_m = (t1.centre - t2.centre).norm();
  const double origins_m = (s1.origin - s2.origin).norm();
  const auto error_m = [&](double d1, double d2) {
    return map_error * length_m + gate * (s1.sigma_rad * d1 + s2.sigma_rad * d2) + origins_m;
  };
  if (min_separation(a, b, cosine) > length_m + error_m(a.low, b.low)) return false;
  const double largest = max_separation(a, b, cosine);
  return std::isinf(largest) || largest > length_m - error_m(a.high, b.high);
}

}  // namespace occ::internal::identify
