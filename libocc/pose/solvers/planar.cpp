// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/planar.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {
namespace {

// Smallest sine of an elevation, and smallest horizontal part of a direction that determines a
// heading; below, rounding dominates.
constexpr double min_sine = 1e-9;

void check(const Eigen::Ref<const Eigen::Matrix3Xd>& bearings,
           const Eigen::Ref<const Eigen::Matrix3Xd>& points, const PlanarCamera& camera) {
  constexpr double tolerance = 1e-6;
  require_finite(points, "points");
  require(std::isfinite(camera.height_m), "height_m", camera.height_m, "finite");
  require(std::abs(camera.up_in_cam.norm() - 1) <= tolerance, "up_in_cam",
          camera.up_in_cam.transpose(), "of unit length");
  for (Eigen::Index i = 0; i < bearings.cols(); ++i)
    require(std::abs(bearings.col(i).norm() - 1) <= tolerance,
            "bearings[" + std::to_string(i) + "]", bearings.col(i).transpose(), "of unit length");
}

Eigen::Matrix3d cam_from_level(const PlanarCamera& camera) {
  return shortest_rotation(Eigen::Vector3d::UnitZ(), camera.up_in_cam);
}

double azimuth(const Eigen::Vector3d& v) { return std::atan2(v.y(), v.x()); }

// The pose whose level frame is rotated by `turn` from the world and has `point` at `seen`.
Rigid3 pose_from_point(const Eigen::Matrix3d& from_level, double turn, const Eigen::Vector3d& seen,
                       const Eigen::Vector3d& point) {
  Rigid3 pose;
  pose.rotation = from_level * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation = from_level * seen - pose.rotation * point;
  return pose;
}

double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Distance along a bearing (level frame) to a point `over_camera_m` above the camera; not positive
// if there is none.
double depth_along(const Eigen::Vector3d& level, double over_camera_m) {
  return std::abs(level.z()) > min_sine ? over_camera_m / level.z() : 0;
}

}  // namespace

// The steeper bearing determines the position of its point (`first`).
std::vector<PoseCandidate> planar_poses(const Eigen::Matrix<double, 3, 2>& bearings,
                                        const Eigen::Matrix<double, 3, 2>& points,
                                        const PlanarCamera& camera) {
  check(bearings, points, camera);
  const Eigen::Matrix3d from_level = cam_from_level(camera);
  const Eigen::Matrix<double, 3, 2> level = from_level.transpose() * bearings;
  const int first = std::abs(level(2, 0)) >= std::abs(level(2, 1)) ? 0 : 1, second = 1 - first;
  const double depth = depth_along(level.col(first), points(2, first) - camera.height_m);
  if (!(depth > 0)) return {};
  const Eigen::Vector3d seen = depth * level.col(first);
  const Eigen::Vector2d along = level.col(second).head<2>(), from = seen.head<2>();
  Eigen::Vector3d side = points.col(second) - points.col(first);
  side.z() = 0;
  const double a = along.squaredNorm(), b = along.dot(from);
  const double c = from.squaredNorm() - side.squaredNorm();
  const double reach2 = from.squaredNorm() + side.squaredNorm();
  if (!(side.squaredNorm() > min_sine * min_sine * points.squaredNorm()) ||
      !(a > min_sine * min_sine))
    return {};
  const double discriminant = b * b - a * c;
  if (!(discriminant > -1e-12 * a * reach2)) return {};  // rounding of a tangent
  const double root = std::sqrt(std::max(0.0, discriminant));
  std::vector<PoseCandidate> found;
  for (const double distance : {(b + root) / a, (b - root) / a}) {
    if (!(distance > 0)) continue;
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();
    apart.head<2>() = distance * along - from;
    PoseCandidate candidate;
    candidate.cam_from_world =
        pose_from_point(from_level, azimuth(apart) - azimuth(side), seen, points.col(first));
    candidate.misfit_rad =
        angle(bearings.col(second), candidate.cam_from_world * Eigen::Vector3d(points.col(second)));
    found.push_back(candidate);
  }
  std::stable_sort(found.begin(), found.end(), [](const PoseCandidate& x, const PoseCandidate& y) {
    return x.misfit_rad < y.misfit_rad;
  });
  return found;
}

std::vector<PoseCandidate> planar_poses(const Eigen::Vector3d& bearing,
                                        const Eigen::Vector3d& point, double heading_rad,
                                        const PlanarCamera& camera) {
  check(bearing, point, camera);
  require(std::isfinite(heading_rad), "heading_rad", heading_rad, "finite");
  const Eigen::Matrix3d from_level = cam_from_level(camera);
  const Eigen::Vector3d level = from_level.transpose() * bearing;
  const Eigen::Vector3d right = from_level.row(0).transpose();
  const double depth = depth_along(level, point.z() - camera.height_m);
  if (!(depth > 0) || !(right.head<2>().norm() > min_sine)) return {};
  return {{pose_from_point(from_level, azimuth(right) - heading_rad, depth * level, point), 0}};
}

}  // namespace occ
