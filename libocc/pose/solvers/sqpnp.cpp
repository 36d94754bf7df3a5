// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/sqpnp.hpp"

#include <opencv2/calib3d.hpp>

#include "libocc/pose/internal/opencv_pnp.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_sqpnp(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 3 || !spans_plane(point_layout(problem.points))) return;
  add_opencv_poses(problem, cv::SOLVEPNP_SQPNP, candidates);
}

}  // namespace

constexpr Solver sqpnp_solver = {
    /*name=*/"sqpnp",
    /*min_points=*/3,
    /*max_points=*/0,
    /*max_candidates=*/18, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "misses one pose in six with three points and one in fifty with four; small targets with "
    "noise; rejects bearings more than 89.9 deg from their mean",
    /*source=*/"Terzakis, Lourakis, ECCV 2020; OpenCV", solve_sqpnp};

}  // namespace occ
