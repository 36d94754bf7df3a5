// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/pinhole_frame.hpp"

#include <Eigen/Geometry>

namespace occ::internal::pose {
namespace {

// About the mean bearing. Image axes along a symmetry of the lamps make exact zeros, which some
// solvers divide by.
constexpr double roll_rad = 0.7391;

constexpr double min_z = 1e-3;  // of a unit bearing; image points grow without bound below it

}  // namespace

Rigid3 PinholeFrame::cam_from_world(const Rigid3& turned_from_world) const {
  return {turned_from_cam.transpose() * turned_from_world.rotation,
          turned_from_cam.transpose() * turned_from_world.translation};
}

std::optional<PinholeFrame> pinhole_frame(const PoseProblem& problem) {
  const Eigen::Vector3d mean = problem.bearings.rowwise().mean();
  PinholeFrame frame;
  frame.turned_from_cam = (Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()) *
                           Eigen::Quaterniond::FromTwoVectors(mean, Eigen::Vector3d::UnitZ()))
                              .toRotationMatrix();
  const Eigen::Matrix3Xd turned = frame.turned_from_cam * problem.bearings;
  if (!turned.allFinite() || !(turned.row(2).minCoeff() >= min_z)) return std::nullopt;
  frame.image = turned.colwise().hnormalized();
  return frame;
}

}  // namespace occ::internal::pose
