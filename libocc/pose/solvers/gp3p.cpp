// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/gp3p.hpp"

#include <Eigen/Dense>
#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/internal/generic_frame.hpp"
#include "libocc/pose/internal/opengv_types.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::pose {
namespace {

constexpr int max_turns = 4;
constexpr double reproduced = 1e-7;  // sin of the angle between a bearing and its point

struct ThreeRays {
  Eigen::Matrix3d bearings, points, origins;
};

bool reproduces(const Rigid3& pose, const ThreeRays& rays) {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d seen = pose * rays.points.col(i) - rays.origins.col(i);
    if (!(seen.cross(rays.bearings.col(i)).norm() < reproduced * seen.norm())) return false;
  }
  return true;
}

// Poses by a world turned by `turn`; returns how many reproduce the bearings.
int add_poses(const ThreeRays& rays, const Eigen::Matrix3d& turn, std::vector<Rigid3>& candidates) {
  OpengvPoses turned_from_cam;
  opengv::absolute_pose::modules::gp3p_main(rays.bearings, rays.origins, turn * rays.points,
                                            turned_from_cam);
  int exact = 0;
  for (const OpengvPose& pose : turned_from_cam) {
    candidates.push_back(cam_from_world(pose) * Rigid3{turn, Eigen::Vector3d::Zero()});
    exact += reproduces(candidates.back(), rays) ? 1 : 0;
  }
  return exact;
}

}  // namespace

// OpenGV eliminates without pivoting, and its Cayley parameters are infinite at 180 degrees: where
// a turned world yields no pose, another may.
void solve_gp3p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() != 3 || !spans_plane(point_layout(problem.points))) return;
  ThreeRays rays{problem.bearings, problem.points, Eigen::Matrix3d::Zero()};
  if (problem.origins.cols() == 3) rays.origins = problem.origins;
  const std::size_t before = candidates.size();
  Eigen::Matrix3d turn = generic_rotation();
  for (int k = 0; k < max_turns; ++k, turn = turn * generic_rotation()) {
    candidates.resize(before);
    if (add_poses(rays, turn, candidates) > 0) return;
  }
}

}  // namespace occ::internal::pose
