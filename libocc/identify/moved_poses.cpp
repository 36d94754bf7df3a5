// SPDX-License-Identifier: Apache-2.0
// Rivals of a pose by symmetries of the map: motions that map most of the matched lamps to lamps.
// They are found from the map alone, so they are known as well where the search was cut short or
// where a last pose excludes them.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/identify/internal/last_pose.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t max_motions = 64;   // those that map the most lamps; a ring of 16 has 31
constexpr std::size_t max_searched = 16;  // those whose poses may match other blobs as well: this
                                          // takes time with the number of lamps of the map

struct Motion {
  Rigid3 moved;  // of the map
  std::array<int, 3> lamps;
  int mapped = 0;
};

// Three matched lamps near the middle of the matched ones: others are at the border of the map.
struct Corner {
  Assignment pairs;
  Eigen::Vector3d first, second, third;
};

template <class Value>
const Pair& least(const std::vector<Pair>& pairs, const Value& value) {
  return *std::min_element(pairs.begin(), pairs.end(),
                           [&](const Pair& a, const Pair& b) { return value(a) < value(b); });
}

std::optional<Corner> corner_of(const AssignmentProblem& problem, const std::vector<Pair>& pairs) {
  constexpr double min_sine = 0.3, never = 1e300;
  const auto at = [&](const Pair& p) { return problem.map_point(p.map_point).centre; };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Pair& p : pairs) mean += at(p) / static_cast<double>(pairs.size());
  Corner c;
  c.pairs[0] = least(pairs, [&](const Pair& p) { return (at(p) - mean).squaredNorm(); });
  c.first = at(c.pairs[0]);
  c.pairs[1] = least(pairs, [&](const Pair& p) {
    const double apart2 = (at(p) - c.first).squaredNorm();
    return apart2 > 0 ? apart2 : never;
  });
  c.second = at(c.pairs[1]);
  const Eigen::Vector3d side = c.second - c.first;
  const auto sine_rejected = [&](const Eigen::Vector3d& other) {
    return other.cross(side).norm() < min_sine * other.norm() * side.norm();
  };
  c.pairs[2] = least(pairs, [&](const Pair& p) {
    const Eigen::Vector3d other = at(p) - c.first;
    return !(other.squaredNorm() > 0) || sine_rejected(other) ? never : other.squaredNorm();
  });
  c.third = at(c.pairs[2]);
  if (!(side.squaredNorm() > 0) || sine_rejected(c.third - c.first)) return std::nullopt;
  return c;
}

Eigen::Matrix3d frame(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                      const Eigen::Vector3d& c) {
  Eigen::Matrix3d axes;
  axes.col(0) = (b - a).normalized();
  axes.col(2) = (b - a).cross(c - a).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

// Number of pairs whose lamp is mapped to a lamp; -1 if more than `max_lost` are not.
int count_mapped(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                 const Rigid3& motion, double tolerance_m, int max_lost) {
  int mapped = 0, lost = 0;
  const double tolerance2 = tolerance_m * tolerance_m;
  for (const Pair& p : pairs) {
    const Eigen::Vector3d to = motion * problem.map_point(p.map_point).centre;
    const bool found =
        std::any_of(problem.map_points.begin(), problem.map_points.end(),
                    [&](const MapPoint& t) { return (t.centre - to).squaredNorm() < tolerance2; });
    mapped += found;
    lost += !found;
    if (lost > max_lost) return -1;
  }
  return mapped;
}

enum class Handedness { kept, reversed };

// Returns the motions other than the identity that map the three lamps to lamps of the same
// distances, and most of the pairs' lamps to lamps. `reversed`: motions with a reflection.
std::vector<Motion> motions_of(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                               const Corner& corner, double tolerance_m, Handedness handedness) {
  const int max_lost = static_cast<int>(pairs.size()) / 6;
  const int count = static_cast<int>(problem.map_points.size());
  const double ab = (corner.second - corner.first).norm(),
               ac = (corner.third - corner.first).norm(),
               bc = (corner.third - corner.second).norm();
  Eigen::Matrix3d from = frame(corner.first, corner.second, corner.third);
  if (handedness == Handedness::reversed) from.col(2) = -from.col(2);
  const auto at = [&](int t) -> const Eigen::Vector3d& { return problem.map_point(t).centre; };
  const auto differs = [&](int a, int b, double length) {
    return std::abs((at(a) - at(b)).norm() - length) > tolerance_m;
  };
  std::vector<Motion> motions;
  for (int a = 0; a < count; ++a)
    for (int b = 0; b < count; ++b) {
      if (b == a || differs(a, b, ab)) continue;
      for (int c = 0; c < count; ++c) {
        if (c == a || c == b || differs(a, c, ac) || differs(b, c, bc)) continue;
        if (a == corner.pairs[0].map_point && b == corner.pairs[1].map_point &&
            c == corner.pairs[2].map_point)
          continue;
        Motion motion{{}, {a, b, c}};
        motion.moved.rotation = frame(at(a), at(b), at(c)) * from.transpose();
        motion.moved.translation =
            (at(a) + at(b) + at(c)) / 3 -
            motion.moved.rotation * ((corner.first + corner.second + corner.third) / 3);
        motion.mapped = count_mapped(problem, pairs, motion.moved, tolerance_m, max_lost);
        if (motion.mapped >= 0) motions.push_back(motion);
      }
    }
  std::stable_sort(motions.begin(), motions.end(),
                   [](const Motion& a, const Motion& b) { return a.mapped > b.mapped; });
  if (motions.size() > max_motions) motions.resize(max_motions);
  return motions;
}

// Returns the best pose moved with all its pairs; empty if a lamp is mapped to none, to one that
// its blob cannot be or that faces away, or if the pairs fit much worse. One of several equal poses
// may have found its last pair, at the limit of a gate, by rounding alone.
std::optional<PoseHypothesis> moved_pairs(const AssignmentProblem& problem,
                                          const PoseHypothesis& best, const Rigid3& motion,
                                          double tolerance_m) {
  PoseHypothesis moved;
  for (const Pair& p : best.pairs) {
    const Eigen::Vector3d to = motion * problem.map_point(p.map_point).centre;
    int nearest = -1;
    double nearest2 = tolerance_m * tolerance_m;
    for (int t = 0; t < static_cast<int>(problem.map_points.size()); ++t) {
      const double off2 = (problem.map_point(t).centre - to).squaredNorm();
      const bool used = std::any_of(moved.pairs.begin(), moved.pairs.end(),
                                    [&](const Pair& other) { return other.map_point == t; });
      if (!(off2 < nearest2) || used || !problem.allows(p.observation, t)) continue;
      nearest = t;
      nearest2 = off2;
    }
    if (nearest < 0) return std::nullopt;
    moved.pairs.push_back({p.observation, nearest});
  }
  moved.estimate = fit_pose(problem, moved.pairs, best.estimate.pose * motion.inverse());
  const Eigen::Vector3d camera = moved.estimate.pose.origin_in_source();
  for (const Pair& p : moved.pairs)
    if (!faces(problem.map_point(p.map_point), camera)) return std::nullopt;
  const FittedPose as_found = fit_pose(problem, best.pairs, best.estimate.pose);
  if (moved.estimate.chi2 > as_found.chi2 + max_hypothesis_delta_chi2) return std::nullopt;
  moved.chi2 = moved.estimate.chi2;
  return moved;
}

// Error of a lamp's place that the gates of blobs and poses permit.
double tolerance_m(const AssignmentProblem& problem, const PoseHypothesis& e) {
  double sum = 0;
  for (const Pair& p : e.pairs)
    sum += problem.observation(p.observation).sigma_rad *
           (e.estimate.pose * problem.map_point(p.map_point).centre).norm();
  return 2 * problem.options->gate_sigma * sum / static_cast<double>(e.pairs.size());
}

}  // namespace

bool may_match_reflections(const AssignmentProblem& problem, const PoseHypothesis& e) {
  constexpr std::size_t min_pairs = 5;  // fewer match a reflection by chance
  if (e.pairs.size() < min_pairs) return true;
  const std::optional<Corner> corner = corner_of(problem, e.pairs);
  return !corner ||
         !motions_of(problem, e.pairs, *corner, tolerance_m(problem, e), Handedness::reversed)
              .empty();
}

// The poses are verified without the prior. Those within six sigma of it become hypotheses, others
// are listed as excluded if this is requested.
void Search::add_moved_poses(bool list_excluded) {
  if (found_.empty() || found_.front().pairs.size() < 4) return;
  const PoseHypothesis best = found_.front();
  const std::optional<Corner> corner = corner_of(problem_, best.pairs);
  if (!corner) return;
  excluded_listed_ = list_excluded;
  const double place_m = tolerance_m(problem_, best);
  const std::vector<Motion> motions =
      motions_of(problem_, best.pairs, *corner, place_m, Handedness::kept);
  if (motions.empty()) return;
  IdentifyOptions options = *problem_.options;
  options.prior.reset();
  AssignmentProblem open = problem_;
  open.options = &options;
  Search free(open);
  free.best_support_ = best_support_;
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const Motion& motion = motions[m];
    if (m < max_searched) {
      Assignment assignment = corner->pairs;
      for (std::size_t i = 0; i < 3; ++i) assignment[i].map_point = motion.lamps[i];
      const std::vector<Pair> three(assignment.begin(), assignment.end());
      const FittedPose seed = fit_pose(open, three, best.estimate.pose * motion.moved.inverse());
      if (appearance_agrees(open, assignment, seed.pose)) free.consider(seed, assignment);
    }
    if (best.pairs.size() >= strong_pairs || motion.mapped < static_cast<int>(best.pairs.size()))
      continue;
    if (auto moved = moved_pairs(open, best, motion.moved, place_m)) free.keep(std::move(*moved));
  }
  free.merge_and_rank();
  for (PoseHypothesis& e : free.found_) {
    if (!agrees_with_prior(problem_, e)) {
      if (list_excluded) excluded_.push_back(std::move(e));
      continue;
    }
    const double chi2 = e.estimate.chi2;
    e.estimate = fit_pose_with_prior(problem_, e.pairs, e.estimate.pose);
    e.chi2 += e.estimate.chi2 - chi2;
    found_.push_back(std::move(e));
  }
  merge_and_rank();
}

// A prior is doubtful if its best pose is off by more than chance explains (a last pose apart,
// since cameras move farther than stated), or leaves most blobs and misses as many lamps as it
// matches or may be accidental; a last pose alone if its pose leaves most blobs and may be
// accidental. Searches for poses elsewhere that match as many blobs.
void Search::add_poses_elsewhere() {
  if (found_.empty()) return;
  constexpr double max_sigmas = 3.3;
  const PoseHypothesis& best = found_.front();
  const Prior& prior = *problem_.options->prior;
  const Prior others = without_last_pose(prior);
  const bool is_off = !others.empty() && others.chi2(problem_.from_world(best.estimate.pose)) >
                                             gate_chi2(max_sigmas, std::max(1, others.dof()));
  const bool leaves_most = 2 * best.pairs.size() < problem_.observations.size();
  IdentifyOptions options = *problem_.options;
  const bool is_accidental = leaves_most && chance() > max_chance_if_missing;
  const bool misses_most = leaves_most && best.missed >= static_cast<int>(best.pairs.size());
  if (is_off || misses_most || (is_accidental && !prior.last_pose))
    options.prior.reset();
  else if (is_accidental)
    options.prior = others;
  else
    return;
  AssignmentProblem open = problem_;
  open.options = &options;
  Search elsewhere(open);
  elsewhere.run();
  if (elsewhere.cut_short()) limit_elsewhere_ = elsewhere.limit_reached();
  const auto is_known = [&](const PoseHypothesis& e) {
    return std::any_of(excluded_.begin(), excluded_.end(), [&](const PoseHypothesis& known) {
      return same_pairs(known.pairs, e.pairs);
    });
  };
  for (PoseHypothesis& e : elsewhere.found_)
    if (!agrees_with_prior(problem_, e) && support(e.pairs) >= best_support_ && !is_known(e))
      excluded_.push_back(std::move(e));
}

}  // namespace occ::internal::identify
