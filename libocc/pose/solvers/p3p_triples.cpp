// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/p3p_triples.hpp"

#include <array>
#include <cmath>

#include "libocc/pose/internal/p3p_triples.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ {
namespace internal::pose {
namespace {

struct Scored {
  Rigid3 pose;
  double chi2 = 0;
};

// Sorted by chi2, smallest first.
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
  // Noise on a double root may cause such misfits; chi2 over all points ranks the poses.
  constexpr double tolerance_rad = 0.3;
  Eigen::Matrix3d three_points, three_bearings;
  for (int k = 0; k < 3; ++k) {
    three_points.col(k) = points.col(triple[k]);
    three_bearings.col(k) = bearings.col(triple[k]);
  }
  std::array<Rigid3, 4> poses;
  const int count = p3p_within(three_bearings, three_points, tolerance_rad, poses);
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

}  // namespace internal::pose

using namespace internal::pose;
namespace {

void solve_p3p_triples(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  internal::pose::solve_p3p_triples(problem.points, problem.bearings, seen_along(problem), 0,
                                    candidates);
}

}  // namespace

constexpr Solver p3p_triples_solver = {/*name=*/"p3p_triples",
                                       /*min_points=*/3,
                                       /*max_points=*/0,
                                       /*max_candidates=*/4, Layout::any,
                                       /*needs_up=*/false,
                                       /*takes_origins=*/false,
                                       /*failures=*/
                                       "returns the candidates of one triple: with four points and "
                                       "much noise, the other solution branch may be missing",
                                       /*source=*/"libocc; p3p over triples, scored by all points",
                                       solve_p3p_triples};

}  // namespace occ
