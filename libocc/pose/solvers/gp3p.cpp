// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/gp3p.hpp"

#include <Eigen/Dense>
#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/opengv.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

constexpr int max_rotations = 4;          // limit of the attempts
constexpr double max_misfit_sine = 1e-7;  // between a bearing and the direction to its point

struct ThreeRays {
  Eigen::Matrix3d bearings, points, origins;
};

bool reproduces(const Rigid3& pose, const ThreeRays& rays) {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d seen = pose * rays.points.col(i) - rays.origins.col(i);
    if (!(seen.cross(rays.bearings.col(i)).norm() < max_misfit_sine * seen.norm())) return false;
  }
  return true;
}

// Appends the poses found in a world rotated by `rotation`; returns how many reproduce the
// bearings.
int add_poses(const ThreeRays& rays, const Eigen::Matrix3d& rotation,
              std::vector<Rigid3>& candidates) {
  OpengvPoses turned_from_cam;
  opengv::absolute_pose::modules::gp3p_main(rays.bearings, rays.origins, rotation * rays.points,
                                            turned_from_cam);
  int exact = 0;
  for (const OpengvPose& pose : turned_from_cam) {
    candidates.push_back(cam_from_world(pose) * Rigid3{rotation, Eigen::Vector3d::Zero()});
    exact += reproduces(candidates.back(), rays) ? 1 : 0;
  }
  return exact;
}

// Rotates the world until a pose reproduces the bearings, see gp3p.hpp.
void solve_gp3p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() != 3 || !spans_plane(point_layout(problem.points))) return;
  ThreeRays rays{problem.bearings, problem.points, Eigen::Matrix3d::Zero()};
  if (problem.origins.cols() == 3) rays.origins = problem.origins;
  const std::size_t before = candidates.size();
  Eigen::Matrix3d rotation = generic_rotation();
  for (int k = 0; k < max_rotations; ++k, rotation = rotation * generic_rotation()) {
    candidates.resize(before);
    if (add_poses(rays, rotation, candidates) > 0) return;
  }
}

}  // namespace

constexpr Solver gp3p_solver = {
    /*name=*/"gp3p",
    /*min_points=*/3,
    /*max_points=*/3,
    /*max_candidates=*/8, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/true,
    /*failures=*/
    "misses one pose in fifty; before polishing, one in seven is wrong by more than 1e-6",
    /*source=*/"Kneip, Furgale, Siegwart, ICRA 2013; OpenGV", solve_gp3p};

}  // namespace occ
