// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/ippe.hpp"

#include <opencv2/calib3d.hpp>

#include "libocc/pose/internal/opencv_pnp.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_ippe(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 4 || !spans_plane(point_layout(problem.points))) return;
  add_opencv_poses(problem, cv::SOLVEPNP_IPPE, candidates);
}

}  // namespace

constexpr Solver ippe_solver = {/*name=*/"ippe",
                                /*min_points=*/4,
                                /*max_points=*/0,
                                /*max_candidates=*/2, Layout::coplanar,
                                /*needs_up=*/false,
                                /*takes_origins=*/false,
                                /*failures=*/
                                "with noise, errors are three times those of sqpnp on four points; "
                                "rejects bearings more than 89.9 deg from their mean",
                                /*source=*/"Collins, Bartoli, IJCV 109, 2014; OpenCV", solve_ippe};

}  // namespace occ
