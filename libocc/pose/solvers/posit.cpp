// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/posit.hpp"

#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

constexpr int max_posit_steps = 200;
constexpr double posit_converged = 1e-14;  // change of the perspective corrections

void solve_posit(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const std::optional<PinholeFrame> frame = pinhole_frame(problem);
  const Eigen::Index n = problem.points.cols();
  if (!frame || !spans_space(point_layout(problem.points))) return;
  Eigen::MatrixXd model = Eigen::MatrixXd::Ones(n, 4);
  model.leftCols<3>() = problem.points.transpose();
  const internal::core::OrthogonalFactors factors(model);
  Eigen::VectorXd w = Eigen::VectorXd::Ones(n);
  Rigid3 pose;
  for (int step = 0; step < max_posit_steps; ++step) {
    const Eigen::Matrix<double, 4, 2> scaled =
        factors.solve(w.asDiagonal() * frame->image.transpose());
    const Eigen::Vector3d i = scaled.col(0).head<3>(), j = scaled.col(1).head<3>();
    const double z = 1 / std::sqrt(i.norm() * j.norm());
    pose.rotation.row(0) = i.normalized();
    pose.rotation.row(1) = j.normalized();
    pose.rotation.row(2) = pose.rotation.row(0).cross(pose.rotation.row(1)).normalized();
    pose.translation << scaled(3, 0) * z, scaled(3, 1) * z, z;
    const Eigen::VectorXd next =
        ((pose.rotation.row(2) * problem.points).array() / z + 1).transpose();
    const double change = (next - w).cwiseAbs().maxCoeff();
    w = next;
    if (!(change > posit_converged)) break;
  }
  if (!pose.rotation.allFinite()) return;
  pose.rotation = nearest_rotation(pose.rotation);
  candidates.push_back(frame->cam_from_world(pose));
}

}  // namespace

constexpr Solver posit_solver = {
    /*name=*/"posit",
    /*min_points=*/4,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::not_coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "diverges at short distances: with four points in one case of three at 1.5 times their size, "
    "one of eleven at 2 times, one of 170 at 3 times; rejects bearings more than 89.9 deg from "
    "their mean",
    /*source=*/"DeMenthon, Davis, IJCV 15, 1995", solve_posit};

}  // namespace occ
