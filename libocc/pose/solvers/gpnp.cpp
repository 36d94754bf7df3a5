// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/gpnp.hpp"

#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/core/internal/dense.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/opengv.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

// Singular values below this share of the largest one belong to the null space.
constexpr double null_space_share = 1e-9;

void solve_gpnp(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const Eigen::Index n = problem.points.cols();
  const PointLayout layout = point_layout(problem.points);
  if (n < 6 || problem.origins.cols() != n || !spans_space(layout)) return;
  // With a single centre the system is homogeneous, and OpenGV's search would start at zero.
  if (!((problem.origins.colwise() - problem.origins.col(0)).norm() > 0)) return;
  // Control points: the centroid and a unit step along each principal axis.
  Eigen::Matrix4Xd weights(4, n);
  weights.bottomRows<3>() = layout.axes.transpose() * (problem.points.colwise() - layout.centroid);
  weights.row(0) = 1 - weights.bottomRows<3>().colwise().sum().array();
  OpengvVectors controls(4, layout.centroid);
  for (std::size_t k = 1; k < 4; ++k) controls[k] += layout.axes.col(static_cast<int>(k) - 1);

  Eigen::MatrixXd equations(2 * n, 12);  // unknowns: control points in the rig frame
  Eigen::VectorXd offsets(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TangentBasis basis = tangent_basis(problem.bearings.col(i));
    for (int k = 0; k < 4; ++k) equations.block<2, 3>(2 * i, 3 * k) = weights(k, i) * basis;
    if (problem.origins.cols() == n) offsets.segment<2>(2 * i) = basis * problem.origins.col(i);
  }
  auto svd = internal::core::jacobi_svd(equations, Eigen::ComputeThinU | Eigen::ComputeFullV);
  svd.setThreshold(null_space_share);
  const Eigen::Matrix<double, 12, 1> particular = svd.solve(offsets);
  const Eigen::Matrix<double, 12, 12> directions = svd.matrixV();
  OpengvPose world_from_cam;
  opengv::absolute_pose::modules::gpnp_main(particular, directions, controls, world_from_cam);
  candidates.push_back(cam_from_world(world_from_cam));
}

}  // namespace

constexpr Solver gpnp_solver = {
    /*name=*/"gpnp",
    /*min_points=*/6,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::not_coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/true,
    /*failures=*/
    "requires bearings from several centres: returns nothing for one camera; nearly flat points",
    /*source=*/"Kneip, Furgale, Siegwart, ICRA 2013; search by OpenGV", solve_gpnp};

}  // namespace occ
