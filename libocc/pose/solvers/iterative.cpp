// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/iterative.hpp"

#include <opencv2/calib3d.hpp>

#include "libocc/pose/internal/opencv_pnp.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::pose {

void solve_iterative(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 4 || !spans_plane(point_layout(problem.points))) return;
  add_opencv_poses(problem, cv::SOLVEPNP_ITERATIVE, candidates);
}

}  // namespace occ::internal::pose
