// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/p3p_gao.hpp"
//
#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/opengv_types.hpp"

namespace occ {

void solve_p3p_gao(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  OpengvPoses world_from_cam;
  world_from_cam.reserve(4);
  opengv::absolute_pose::modules::p3p_gao_main(opengv_vectors(problem.bearings),
                                               opengv_vectors(problem.points), world_from_cam);
  for (const OpengvPose& pose : world_from_cam) candidates.push_back(cam_from_world(pose));
}

}  // namespace occ
