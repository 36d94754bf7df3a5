// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/dlt.hpp"

#include <Eigen/Dense>

#include "libocc/core/internal/dense.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_dlt(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const Eigen::Index n = problem.points.cols();
  if (n < 6 || !spans_space(point_layout(problem.points))) return;
  Eigen::MatrixXd equations(2 * n, 12);  // unknowns: the columns of P, one after another
  const Eigen::Matrix4Xd points = problem.points.colwise().homogeneous();
  for (Eigen::Index i = 0; i < n; ++i) {
    const TangentBasis basis = tangent_basis(problem.bearings.col(i));
    for (int column = 0; column < 4; ++column)
      equations.block<2, 3>(2 * i, 3 * column) = points(column, i) * basis;
  }
  const Eigen::VectorXd entries = smallest_right_vector(equations);
  Eigen::Matrix<double, 3, 4> projection =
      Eigen::Map<const Eigen::Matrix<double, 3, 4>>(entries.data());
  // The sign that puts the points in front of the camera.
  if ((projection * points).cwiseProduct(problem.bearings).sum() < 0) projection *= -1;
  const auto svd = internal::core::jacobi_svd<Eigen::Matrix3d>(
      projection.leftCols<3>(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::DiagonalMatrix<double, 3> signs(1, 1, handedness < 0 ? -1 : 1);
  Rigid3 pose;
  pose.rotation = svd.matrixU() * signs * svd.matrixV().transpose();
  pose.translation = projection.col(3) / svd.singularValues().mean();
  candidates.push_back(pose);
}

}  // namespace

constexpr Solver dlt_solver = {
    /*name=*/"dlt",
    /*min_points=*/6,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::not_coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "nearly flat points; with noise, errors are the largest of all solvers: fifteen times those of "
    "sqpnp on six points, four times on twenty",
    /*source=*/"Hartley, Zisserman 2004, section 7.1", solve_dlt};

}  // namespace occ
