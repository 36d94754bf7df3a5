// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/upright_p2p.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ {
namespace {

// Tolerance within which a cosine above 1 is rounding of a double root.
constexpr double upright_rounding = 1e-12;

// Smallest horizontal part of unit vectors that determines a heading; below, it is
// rounding.
constexpr double min_horizontal = 1e-10;

void solve_upright_p2p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (!problem.up_in_cam || problem.size() < 2) return;
  const Eigen::Vector3d f0 = problem.bearings.col(0), f1 = problem.bearings.col(1);
  const Eigen::Vector3d side = problem.points.col(0) - problem.points.col(1);
  Eigen::Vector3d o0 = Eigen::Vector3d::Zero(), o1 = o0;
  if (problem.origins.cols() >= 2) o0 = problem.origins.col(0), o1 = problem.origins.col(1);
  const Eigen::Matrix3d cam_from_upright =
      shortest_rotation(Eigen::Vector3d::UnitZ(), *problem.up_in_cam);
  const Eigen::Vector3d normal_in_cam = f0.cross(f1);
  const Eigen::Vector3d n = cam_from_upright.transpose() * normal_in_cam;
  const double a = n.head<2>().dot(side.head<2>());
  const double b = n.y() * side.x() - n.x() * side.y();
  const double c = n.z() * side.z() - normal_in_cam.dot(o0 - o1);
  const double amplitude = std::hypot(a, b);
  if (!(amplitude > min_horizontal * n.norm() * side.norm())) return;
  if (!(std::abs(c) <= amplitude * (1 + upright_rounding))) return;
  const double centre = std::atan2(b, a);
  const double half = std::atan2(std::sqrt(std::max(0.0, (amplitude - c) * (amplitude + c))), -c);
  for (const double heading : {centre + half, centre - half}) {
    Rigid3 pose;
    pose.rotation =
        cam_from_upright * Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    // Depths at which the rays are nearest to each other, the second one shifted by `apart`.
    const Eigen::Vector3d apart = pose.rotation * side - (o0 - o1);
    const double depth0 = apart.cross(f1).dot(normal_in_cam) / normal_in_cam.squaredNorm();
    const double depth1 = apart.cross(f0).dot(normal_in_cam) / normal_in_cam.squaredNorm();
    pose.translation = 0.5 * (depth0 * f0 + o0 + depth1 * f1 + o1) -
                       0.5 * (pose.rotation * (problem.points.col(0) + problem.points.col(1)));
    candidates.push_back(pose);
  }
}

}  // namespace

constexpr Solver upright_p2p_solver = {/*name=*/"upright_p2p",
                                       /*min_points=*/2,
                                       /*max_points=*/2,
                                       /*max_candidates=*/2, Layout::any,
                                       /*needs_up=*/true,
                                       /*takes_origins=*/true,
                                       /*failures=*/
                                       "the heading is undetermined when both points are at the "
                                       "camera's height or one is above the other",
                                       /*source=*/"Kukelova, Bujnak, Pajdla, ACCV 2010",
                                       solve_upright_p2p};

}  // namespace occ
