// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/false_alarms.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/explain.hpp"

namespace occ::internal::identify {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

double log_factorial(double n) { return std::lgamma(n + 1); }

const Eigen::Vector2d& pixel(const AssignmentProblem& problem, int sighting) {
  return (*problem.blobs)[problem.sighting(sighting).blob].centroid_px;
}

// A rectangle about blobs, and how many are inside.
struct Area {
  double px2 = 0;
  int blobs = 0;
};

Area area_about(const AssignmentProblem& problem, const std::vector<Pair>& pairs) {
  constexpr double min_px = 4;
  Eigen::Vector2d low = pixel(problem, pairs.front().sighting), high = low;
  for (const Pair& p : pairs) {
    low = low.cwiseMin(pixel(problem, p.sighting));
    high = high.cwiseMax(pixel(problem, p.sighting));
  }
  Area area{(high - low).cwiseMax(min_px).prod(), 0};
  for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s) {
    const Eigen::Vector2d& px = pixel(problem, s);
    area.blobs += (px - low).minCoeff() >= 0 && (high - px).minCoeff() >= 0;
  }
  return area;
}

// rad^2 that a pixel covers.
double pixel_rad2(const AssignmentProblem& problem, int sighting) {
  Eigen::Matrix<double, 3, 2> by_pixel;
  problem.camera->unproject(pixel(problem, sighting), &by_pixel);
  return (problem.sighting(sighting).tangent * by_pixel).determinant();
}

// Logarithm of p times the area^m: what the three pairs in front make of the others.
double log_volume(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                  const Rigid3& start) {
  const std::vector<Pair> three(pairs.begin(), pairs.begin() + 3);
  const FittedPose estimate = fit_pose(problem, three, start);
  const auto further = static_cast<double>(pairs.size() - 3);
  double chi2 = estimate.chi2, volume = 0;
  for (auto pair = pairs.begin() + 3; pair != pairs.end(); ++pair) {
    const std::optional<PairFit> fit = fit_of_pair(problem, *pair, estimate);
    if (!fit) return never;
    chi2 += fit->chi2;
    volume +=
        std::log(pi * std::sqrt(fit->determinant) / std::abs(pixel_rad2(problem, pair->sighting)));
  }
  constexpr double exact = 1e-3;  // nobody measures so well
  return volume + further * std::log(std::max(chi2, exact)) - log_factorial(further);
}

double min_log_volume(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                      const Rigid3& pose) {
  constexpr std::size_t enough = 10;  // pairs, of which all threes are tried
  const std::size_t count = std::min(pairs.size(), enough);
  double least = never;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b)
      for (std::size_t c = b + 1; c < count; ++c) {
        std::vector<Pair> order{pairs[a], pairs[b], pairs[c]};
        for (std::size_t i = 0; i < pairs.size(); ++i)
          if (i != a && i != b && i != c) order.push_back(pairs[i]);
        least = std::min(least, log_volume(problem, order, pose));
      }
  return least;
}

double log_tests(double blobs, double points, double facing, double agree) {
  const double further = agree - 3;
  return std::log(std::max(1.0, blobs - 3)) + std::log(4 * blobs * (blobs - 1) * (blobs - 2)) +
         std::log(points * (points - 1) * (points - 2) / 6) + log_factorial(blobs - 3) -
         log_factorial(further) - log_factorial(blobs - agree) + log_factorial(facing - 3) -
         log_factorial(facing - agree);
}

std::vector<Pair> pairs_of(const AssignmentProblem& problem, const Hypothesis& hypothesis) {
  std::vector<Pair> pairs;
  for (const Match& match : hypothesis.matches)
    for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s)
      if (problem.sighting(s).blob == match.blob) pairs.push_back({s, match.lamp});
  return pairs;
}

std::vector<Pair> all_sightings(const AssignmentProblem& problem) {
  std::vector<Pair> all;
  for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s) all.push_back({s, 0});
  return all;
}

}  // namespace

int min_pairs(const AssignmentProblem& problem, double max_log10_false_alarms) {
  const Area area = area_about(problem, all_sightings(problem));
  double share = 1;  // of the area, by the blob that is known best
  for (int s = 0; s < area.blobs; ++s)
    share = std::min(share, pi * std::sqrt(problem.sighting(s).covariance.determinant()) /
                                std::abs(pixel_rad2(problem, s)) / area.px2);
  const auto points = static_cast<double>(problem.targets.size());
  const int most = std::min(area.blobs, static_cast<int>(points));
  for (int agree = 4; agree <= most; ++agree) {
    const double further = agree - 3;
    const double log_p = further * std::log(share * further) - log_factorial(further);
    const double log_nfa = log_tests(area.blobs, points, agree, agree) + log_p;
    if (log_nfa <= max_log10_false_alarms * std::log(10.0)) return agree;
  }
  return most + 1;
}

double log10_false_alarms(const AssignmentProblem& problem, const Hypothesis& hypothesis) {
  const std::vector<Pair> pairs = pairs_of(problem, hypothesis);
  if (pairs.size() <= 3) return never;
  const Rigid3& from_world = hypothesis.cam_from_world;
  const Rigid3 pose{from_world.rotation,
                    from_world.translation + from_world.rotation * problem.origin};
  const double volume = min_log_volume(problem, pairs, pose);
  const Eigen::Vector3d eye = pose.origin_in_source();
  const auto facing = std::count_if(problem.targets.begin(), problem.targets.end(),
                                    [&](const MapPoint& t) { return faces(t, eye); });
  double most = -never;
  for (const Area& area :
       {area_about(problem, all_sightings(problem)), area_about(problem, pairs)}) {
    const auto agree = static_cast<double>(pairs.size());
    const double log_p = std::min(0.0, volume - (agree - 3) * std::log(area.px2));
    const double tests = log_tests(area.blobs, static_cast<double>(problem.targets.size()),
                                   std::max(static_cast<double>(facing), agree), agree);
    most = std::max(most, (tests + log_p) / std::log(10.0));
  }
  return most;
}

}  // namespace occ::internal::identify
