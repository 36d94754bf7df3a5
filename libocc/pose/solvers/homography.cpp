// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/homography.hpp"

#include <Eigen/Dense>

#include "libocc/core/internal/dense.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_homography(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const Eigen::Index n = problem.points.cols();
  const PointLayout layout = point_layout(problem.points);
  if (n < 4 || !spans_plane(layout)) return;
  const Eigen::Matrix3Xd in_plane =
      (layout.axes.leftCols<2>().transpose() * (problem.points.colwise() - layout.centroid))
          .colwise()
          .homogeneous();
  Eigen::MatrixXd equations(2 * n, 9);  // unknowns: the columns of H, one after another
  for (Eigen::Index i = 0; i < n; ++i) {
    const TangentBasis basis = tangent_basis(problem.bearings.col(i));
    for (int column = 0; column < 3; ++column)
      equations.block<2, 3>(2 * i, 3 * column) = in_plane(column, i) * basis;
  }
  const Eigen::VectorXd entries = smallest_right_vector(equations);
  Eigen::Matrix3d homography = Eigen::Map<const Eigen::Matrix3d>(entries.data());
  if ((homography * in_plane).cwiseProduct(problem.bearings).sum() < 0) homography *= -1;
  // Nearest pair of orthonormal columns; the mean singular value is the homography's scale.
  const auto svd = internal::core::jacobi_svd<Eigen::MatrixXd>(
      homography.leftCols<2>(), Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::Matrix3d cam_from_plane;
  cam_from_plane.leftCols<2>() = svd.matrixU() * svd.matrixV().transpose();
  cam_from_plane.col(2) = cam_from_plane.col(0).cross(cam_from_plane.col(1));
  Rigid3 pose;
  pose.rotation = cam_from_plane * layout.axes.transpose();
  pose.translation =
      homography.col(2) / svd.singularValues().mean() - pose.rotation * layout.centroid;
  candidates.push_back(pose);
}

}  // namespace

constexpr Solver homography_solver = {
    /*name=*/"homography",
    /*min_points=*/4,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "with noise, errors are the largest of the planar solvers: five times those of ippe on four "
    "points",
    /*source=*/"Hartley, Zisserman 2004, section 4.1; Zhang, PAMI 22(11), 2000", solve_homography};

}  // namespace occ
