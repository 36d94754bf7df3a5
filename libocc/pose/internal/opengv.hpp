// SPDX-License-Identifier: Apache-2.0
// OpenGV's containers as Eigen types, and conversion of its poses (world_from_cam, 3x4).
#pragma once

#include <Eigen/Core>
#include <Eigen/StdVector>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

using OpengvVectors = std::vector<Eigen::Vector3d, Eigen::aligned_allocator<Eigen::Vector3d>>;
using OpengvPose = Eigen::Matrix<double, 3, 4>;
using OpengvPoses = std::vector<OpengvPose, Eigen::aligned_allocator<OpengvPose>>;

inline OpengvVectors opengv_vectors(const Eigen::Matrix3Xd& columns) {
  OpengvVectors vectors(static_cast<std::size_t>(columns.cols()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    vectors[i] = columns.col(static_cast<Eigen::Index>(i));
  return vectors;
}

inline Rigid3 cam_from_world(const OpengvPose& world_from_cam) {
  return Rigid3{world_from_cam.leftCols<3>(), world_from_cam.col(3)}.inverse();
}

/// Appends the poses of one of OpenGV's P3P functions (`solve`: bearings, points -> poses).
template <class Solve>
void add_opengv_p3p(const Solve& solve, const PoseProblem& problem,
                    std::vector<Rigid3>& candidates) {
  OpengvPoses world_from_cam;
  world_from_cam.reserve(4);
  solve(opengv_vectors(problem.bearings), opengv_vectors(problem.points), world_from_cam);
  for (const OpengvPose& pose : world_from_cam) candidates.push_back(cam_from_world(pose));
}

}  // namespace occ::internal::pose
