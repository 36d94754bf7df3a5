// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/false_alarms.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

double log_factorial(double n) { return std::lgamma(n + 1); }

const Eigen::Vector2d& pixel(const AssignmentProblem& problem, int observation) {
  return (*problem.blobs)[problem.observation(observation).blob].centroid_px;
}

// Bounding box of blobs, and the number of blobs inside.
struct Area {
  double px2 = 0;
  int blobs = 0;
};

Area area_about(const AssignmentProblem& problem, const std::vector<Pair>& pairs) {
  constexpr double min_px = 4;
  Eigen::Vector2d low = pixel(problem, pairs.front().observation), high = low;
  for (const Pair& p : pairs) {
    low = low.cwiseMin(pixel(problem, p.observation));
    high = high.cwiseMax(pixel(problem, p.observation));
  }
  Area area{(high - low).cwiseMax(min_px).prod(), 0};
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
    const Eigen::Vector2d& px = pixel(problem, s);
    area.blobs += (px - low).minCoeff() >= 0 && (high - px).minCoeff() >= 0;
  }
  return area;
}

// Solid angle of a pixel [rad^2].
double pixel_rad2(const AssignmentProblem& problem, int observation) {
  Eigen::Matrix<double, 3, 2> by_pixel;
  problem.camera->unproject(pixel(problem, observation), &by_pixel);
  return (problem.observation(observation).tangent * by_pixel).determinant();
}

// Logarithm of p * area^m, where the first three pairs define the pose.
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
    volume += std::log(pi * std::sqrt(fit->determinant) /
                       std::abs(pixel_rad2(problem, pair->observation)));
  }
  constexpr double exact = 1e-3;  // lower bound of chi-square; no measurement is so exact
  return volume + further * std::log(std::max(chi2, exact)) - log_factorial(further);
}

double min_log_volume(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                      const Rigid3& pose) {
  constexpr std::size_t enough = 10;  // number of pairs of which all triples are tried
  const std::size_t count = std::min(pairs.size(), enough);
  double min_volume = never;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b)
      for (std::size_t c = b + 1; c < count; ++c) {
        std::vector<Pair> order{pairs[a], pairs[b], pairs[c]};
        for (std::size_t i = 0; i < pairs.size(); ++i)
          if (i != a && i != b && i != c) order.push_back(pairs[i]);
        min_volume = std::min(min_volume, log_volume(problem, order, pose));
      }
  return min_volume;
}

double log_tests(double blobs, double points, double facing, double agree) {
  const double further = agree - 3;
  return std::log(std::max(1.0, blobs - 3)) + std::log(4 * blobs * (blobs - 1) * (blobs - 2)) +
         std::log(points * (points - 1) * (points - 2) / 6) + log_factorial(blobs - 3) -
         log_factorial(further) - log_factorial(blobs - agree) + log_factorial(facing - 3) -
         log_factorial(facing - agree);
}

std::vector<Pair> all_observations(const AssignmentProblem& problem) {
  std::vector<Pair> all;
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) all.push_back({s, 0});
  return all;
}

}  // namespace

int min_pairs(const AssignmentProblem& problem, double max_log10_false_alarms) {
  const Area area = area_about(problem, all_observations(problem));
  double share = 1;  // smallest share of the area that a blob's covariance covers
  for (int s = 0; s < area.blobs; ++s)
    share = std::min(share, pi * std::sqrt(problem.observation(s).covariance.determinant()) /
                                std::abs(pixel_rad2(problem, s)) / area.px2);
  const auto points = static_cast<double>(problem.map_points.size());
  const int max_pairs = std::min(area.blobs, static_cast<int>(points));
  for (int agree = 4; agree <= max_pairs; ++agree) {
    const double further = agree - 3;
    const double log_p = further * std::log(share * further) - log_factorial(further);
    const double log_nfa = log_tests(area.blobs, points, agree, agree) + log_p;
    if (log_nfa <= max_log10_false_alarms * std::log(10.0)) return agree;
  }
  return max_pairs + 1;
}

double log10_false_alarms(const AssignmentProblem& problem, const Hypothesis& hypothesis) {
  const std::vector<Pair> pairs = pairs_of(problem, hypothesis);
  if (pairs.size() <= 3) return never;
  const Rigid3& from_world = hypothesis.cam_from_world;
  const Rigid3 pose{from_world.rotation,
                    from_world.translation + from_world.rotation * problem.origin};
  const double volume = min_log_volume(problem, pairs, pose);
  const Eigen::Vector3d eye = pose.origin_in_source();
  const auto facing = std::count_if(problem.map_points.begin(), problem.map_points.end(),
                                    [&](const MapPoint& t) { return faces(t, eye); });
  double largest = -never;
  for (const Area& area :
       {area_about(problem, all_observations(problem)), area_about(problem, pairs)}) {
    const auto agree = static_cast<double>(pairs.size());
    const double log_p = std::min(0.0, volume - (agree - 3) * std::log(area.px2));
    const double tests = log_tests(area.blobs, static_cast<double>(problem.map_points.size()),
                                   std::max(static_cast<double>(facing), agree), agree);
    largest = std::max(largest, (tests + log_p) / std::log(10.0));
  }
  return largest;
}

}  // namespace occ::internal::identify
