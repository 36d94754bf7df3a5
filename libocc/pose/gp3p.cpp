// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/gp3p.hpp"
//
#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/generic_frame.hpp"
#include "libocc/pose/opengv_types.hpp"

namespace occ {

void solve_gp3p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const Eigen::Matrix3d turn = generic_rotation();
  const Eigen::Matrix3d bearings = problem.bearings, points = turn * problem.points;
  Eigen::Matrix3d origins = Eigen::Matrix3d::Zero();
  if (problem.origins.cols() == 3) origins = problem.origins;
  OpengvPoses turned_from_cam;
  opengv::absolute_pose::modules::gp3p_main(bearings, origins, points, turned_from_cam);
  for (const OpengvPose& pose : turned_from_cam)
    candidates.push_back(cam_from_world(pose) * Rigid3{turn, Eigen::Vector3d::Zero()});
}

}  // namespace occ
