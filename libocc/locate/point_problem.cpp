// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/point_problem.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <string>

#include "libocc/core/require.hpp"

namespace occ::internal::locate {

using namespace internal::pose;

namespace {

// Two rows across the ray over sigma, so that the residual is a distance in the image. Exact for a
// pinhole (projection onto the plane z = 1), to first order about the bearing for other cameras.
void see_point(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px, int i,
               PointProblem& p) {
  Eigen::Matrix<double, 2, 3> across;
  const Eigen::Vector3d point = p.points.col(i);
  if (camera.is_pinhole() && camera.distortion().empty()) {
    across << camera.fx_px(), camera.skew_px(), camera.cx_px() - pixel.x(),  //
        0, camera.fy_px(), camera.cy_px() - pixel.y();
    const double y = -across(1, 2) / across(1, 1);
    const double x = -(across(0, 2) + across(0, 1) * y) / across(0, 0);
    p.bearings.col(i) = Eigen::Vector3d(x, y, 1) / std::sqrt(x * x + y * y + 1);
    p.seen.add(point, Eigen::Vector3d::UnitZ(), across / sigma_px);
    return;
  }
  Eigen::Matrix<double, 3, 2> by_pixel;
  const std::optional<Eigen::Vector3d> bearing = camera.unproject(pixel, &by_pixel);
  if (!bearing)
    require(false, "points_px[" + std::to_string(i) + "]", pixel.transpose(),
            "inside the camera's domain");
  across = (by_pixel.transpose() * by_pixel).inverse() * by_pixel.transpose();
  p.bearings.col(i) = *bearing;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (!camera.is_central()) {  // in the unit of the points' frame
    origin = camera.ray(pixel)->origin / p.frame.size_m;
    p.origins.col(i) = origin;
  }
  p.seen.add(point, *bearing, across / sigma_px, origin);
}

}  // namespace

PointProblem make_point_problem(const Eigen::Matrix3Xd& points_in_world,
                                const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                const Eigen::VectorXd& sigmas_px) {
  PointProblem p;
  const auto n = static_cast<int>(points_in_world.cols());
  p.points = points_in_world;
  p.frame = normalise(p.points);
  p.bearings.resize(3, n);
  if (!camera.is_central()) p.origins.resize(3, n);
  p.seen.reserve(n);
  for (int i = 0; i < n; ++i)
    see_point(camera, points_px.col(i), sigmas_px[sigmas_px.size() == 1 ? 0 : i], i, p);
  return p;
}

bool on_a_line(const PointProblem& problem, const Triple& spread) {
  return !std::isfinite(problem.points.sum()) ||
         internal::pose::on_a_line(problem.points, spread, problem.frame.offset());
}

}  // namespace occ::internal::locate
