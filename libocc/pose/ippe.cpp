// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/ippe.hpp"
//
#include <opencv2/calib3d.hpp>

#include "libocc/pose/opencv_pnp.hpp"
#include "libocc/pose/point_layout.hpp"

namespace occ {

void solve_ippe(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 4 || !spans_plane(point_layout(problem.points))) return;
  add_opencv_poses(problem, cv::SOLVEPNP_IPPE, candidates);
}

}  // namespace occ
