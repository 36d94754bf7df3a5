// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/p3p_triples.hpp"

#include <array>
#include <cmath>

#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/spread.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ::internal::pose {
namespace {

struct Scored {
  Rigid3 pose;
  double chi2 = 0;
};

// Best first.
struct ScoredPoses {
  std::array<Scored, 4> list;
  std::size_t count = 0;

  void insert(const Scored& scored) {
    std::size_t at = count++;
    for (; at > 0 && scored.chi2 < list[at - 1].chi2; --at) list[at] = list[at - 1];
    list[at] = scored;
  }
};

ScoredPoses poses_of(const Triple& triple, const Eigen::Matrix3Xd& points,
                     const Eigen::Matrix3Xd& bearings, const SeenPoints& seen) {
  constexpr double any_rad = 0.3;  // noise on a double root; the other points judge
  Eigen::Matrix3d three_points, three_bearings;
  for (int k = 0; k < 3; ++k) {
    three_points.col(k) = points.col(triple[k]);
    three_bearings.col(k) = bearings.col(triple[k]);
  }
  std::array<Rigid3, 4> poses;
  const int count = p3p_within(three_bearings, three_points, any_rad, poses);
  ScoredPoses scored;
  for (int i = 0; i < count; ++i) {
    const Rigid3& pose = poses[i];
    const double chi2 = point_chi2(seen, pose);
    if (std::isfinite(chi2)) scored.insert({pose, chi2});
  }
  return scored;
}

}  // namespace

void solve_p3p_triples(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings,
                       const SeenPoints& seen, double enough, std::vector<Rigid3>& candidates) {
  ScoredPoses best;
  for (const Triple& triple : triples_to_try(points, bearings)) {
    const ScoredPoses poses = poses_of(triple, points, bearings, seen);
    if (poses.count > 0 && (best.count == 0 || poses.list[0].chi2 < best.list[0].chi2))
      best = poses;
    if (best.count > 0 && best.list[0].chi2 <= enough) break;
  }
  for (std::size_t i = 0; i < best.count; ++i) candidates.push_back(best.list[i].pose);
}

SeenPoints seen_along(const PoseProblem& problem) {
  SeenPoints seen;
  seen.reserve(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const Eigen::Vector3d bearing = problem.bearings.col(i);
    seen.add(problem.points.col(i), bearing, tangent_basis(bearing),
             problem.origins.cols() > 0 ? Eigen::Vector3d(problem.origins.col(i))
                                        : Eigen::Vector3d::Zero());
  }
  return seen;
}

void solve_p3p_triples(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  solve_p3p_triples(problem.points, problem.bearings, seen_along(problem), 0, candidates);
}

}  // namespace occ::internal::pose
