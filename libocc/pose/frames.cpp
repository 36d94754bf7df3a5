// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/frames.hpp"

#include "libocc/geometry/internal/shortest_quaternion.hpp"

namespace occ::internal::pose {
namespace {

// Rotation about the mean bearing. Image axes along a symmetry of the points would make exact
// zeros, by which some solvers divide.
constexpr double roll_rad = 0.7391;

constexpr double min_z = 1e-3;  // cos(89.94 deg); image points grow without bound below it

}  // namespace

Rigid3 PinholeFrame::cam_from_world(const Rigid3& turned_from_world) const {
  return {turned_from_cam.transpose() * turned_from_world.rotation,
          turned_from_cam.transpose() * turned_from_world.translation};
}

std::optional<PinholeFrame> pinhole_frame(const PoseProblem& problem) {
  const Eigen::Vector3d mean = problem.bearings.rowwise().mean();
  PinholeFrame frame;
  frame.turned_from_cam = (Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()) *
                           geometry::shortest_quaternion(mean, Eigen::Vector3d::UnitZ()))
                              .toRotationMatrix();
  const Eigen::Matrix3Xd turned = frame.turned_from_cam * problem.bearings;
  if (!turned.allFinite() || !(turned.row(2).minCoeff() >= min_z)) return std::nullopt;
  frame.image = turned.colwise().hnormalized();
  return frame;
}

}  // namespace occ::internal::pose
