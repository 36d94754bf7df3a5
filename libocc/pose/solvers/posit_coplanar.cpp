// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/posit_coplanar.hpp"

#include <cmath>
#include <complex>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

constexpr int max_coplanar_steps = 500;
constexpr double coplanar_converged = 1e-14;  // change of the perspective corrections

struct Plane {
  Eigen::Matrix3Xd points;  // in the plane's axes, z = 0
  internal::core::OrthogonalFactors factors;
};

// One of the two scaled orthographic poses of image points: I = I0 + lambda n, J = J0 + mu n with
// I . J = 0 and |I| = |J|, that is (lambda + i mu)^2 = |J0|^2 - |I0|^2 - 2 i I0 . J0. `sign`
// selects the square root.
Rigid3 orthographic_pose(const Plane& plane, const Eigen::MatrixXd& image, double sign) {
  const Eigen::Matrix<double, 3, 2> scaled = plane.factors.solve(image);
  const Eigen::Vector2d i0 = scaled.col(0).head<2>(), j0 = scaled.col(1).head<2>();
  const std::complex<double> root =
      sign * std::sqrt(std::complex<double>(j0.squaredNorm() - i0.squaredNorm(), -2 * i0.dot(j0)));
  const Eigen::Vector3d i(i0.x(), i0.y(), root.real()), j(j0.x(), j0.y(), root.imag());
  const double z = 1 / std::sqrt(i.norm() * j.norm());
  Rigid3 pose;
  pose.rotation.row(0) = i.normalized();
  pose.rotation.row(1) = j.normalized();
  pose.rotation.row(2) = pose.rotation.row(0).cross(pose.rotation.row(1)).normalized();
  pose.translation << scaled(2, 0) * z, scaled(2, 1) * z, z;
  return pose;
}

// Iterates one of the two poses: each step takes the pose whose optical axis is nearer to the
// previous one.
Rigid3 iterate_pose(const Plane& plane, const Eigen::Matrix2Xd& image, double first_sign) {
  Eigen::VectorXd w = Eigen::VectorXd::Ones(image.cols());
  Rigid3 pose;
  for (int step = 0; step < max_coplanar_steps; ++step) {
    const Eigen::MatrixXd corrected = w.asDiagonal() * image.transpose();
    const Eigen::RowVector3d before = pose.rotation.row(2);
    pose = orthographic_pose(plane, corrected, first_sign);
    if (step > 0) {
      const Rigid3 other = orthographic_pose(plane, corrected, -first_sign);
      if (other.rotation.row(2).dot(before) > pose.rotation.row(2).dot(before)) pose = other;
    }
    const Eigen::VectorXd next =
        ((pose.rotation.row(2) * plane.points).array() / pose.translation.z() + 1).transpose();
    const double change = (next - w).cwiseAbs().maxCoeff();
    w = next;
    if (!(change > coplanar_converged)) break;
  }
  return pose;
}

void solve_posit_coplanar(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const std::optional<PinholeFrame> frame = pinhole_frame(problem);
  const PointLayout layout = point_layout(problem.points);
  if (!frame || problem.size() < 4 || !spans_plane(layout)) return;
  Eigen::Matrix3Xd points = layout.axes.transpose() * (problem.points.colwise() - layout.centroid);
  points.row(2).setZero();
  Eigen::MatrixXd model = points.transpose();
  model.col(2).setOnes();
  const Plane plane{points, internal::core::OrthogonalFactors(model)};
  const Rigid3 plane_from_world{layout.axes.transpose(),
                                -(layout.axes.transpose() * layout.centroid)};
  for (const double sign : {1.0, -1.0}) {
    Rigid3 pose = iterate_pose(plane, frame->image, sign);
    if (!pose.rotation.allFinite()) continue;
    pose.rotation = nearest_rotation(pose.rotation);
    candidates.push_back(frame->cam_from_world(pose * plane_from_world));
  }
}

}  // namespace

constexpr Solver posit_coplanar_solver = {
    /*name=*/"posit_coplanar",
    /*min_points=*/4,
    /*max_points=*/0,
    /*max_candidates=*/2, Layout::coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "diverges at short distances: with four points in one case of three at 2 times their size, one "
    "of twelve at 4 times, one of seventy at 10 times; rejects bearings more than 89.9 deg from "
    "their mean",
    /*source=*/"Oberkampf, DeMenthon, Davis, CVIU 63, 1996", solve_posit_coplanar};

}  // namespace occ
