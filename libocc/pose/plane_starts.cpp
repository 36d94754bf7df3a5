// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/plane_starts.hpp"

#include "libocc/geometry/so3.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/missing_method.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::pose {

std::vector<Rigid3> plane_starts(const PoseProblem& problem) {
  const bool has_ippe = is_in_build("ippe");
  CandidateOptions options;
  options.polish = false;
  options.tolerance_rad = 4;  // accept all; the fit decides
  std::vector<Rigid3> poses;
  for (const PoseCandidate& start :
       pose_candidates(problem, has_ippe ? "ippe" : "homography", options).value)
    poses.push_back(start.cam_from_world);
  if (!has_ippe && !poses.empty()) poses.push_back(reflected_pose(problem, poses.front()));
  return poses;
}

Rigid3 reflected_pose(const PoseProblem& problem, const Rigid3& cam_from_world) {
  const PointLayout layout = point_layout(problem.points);
  const Eigen::Vector3d centre = cam_from_world * layout.centroid;
  const Eigen::Vector3d view = centre.normalized();
  const Eigen::Vector3d normal = cam_from_world.rotation * layout.axes.col(2);
  const Eigen::Vector3d reflected = 2 * view.dot(normal) * view - normal;
  Rigid3 pose;
  pose.rotation = shortest_rotation(normal, reflected) * cam_from_world.rotation;
  pose.translation = centre - pose.rotation * layout.centroid;
  return pose;
}

}  // namespace occ::internal::pose
