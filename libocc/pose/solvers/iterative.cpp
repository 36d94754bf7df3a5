// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/iterative.hpp"

#include <opencv2/calib3d.hpp>

#include "libocc/pose/internal/opencv_pnp.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_iterative(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 4 || !spans_plane(point_layout(problem.points))) return;
  add_opencv_poses(problem, cv::SOLVEPNP_ITERATIVE, candidates);
}

}  // namespace

constexpr Solver iterative_solver = {
    /*name=*/"iterative",
    /*min_points=*/4,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "points that are not in a plane must be six or more; may converge to the wrong one of a "
    "plane's two poses; rejects bearings more than 89.9 deg from their mean",
    /*source=*/"OpenCV SOLVEPNP_ITERATIVE: homography or DLT, then Levenberg-Marquardt",
    solve_iterative};

}  // namespace occ
