// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/search_by_outline.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/area_moments.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t max_rays = 48;
constexpr double fit_px = 0.3, growth_px = 3;  // as of corners, see search_by_corners.cpp
constexpr double lost_px = 30;                 // distance that counts for a lost ray
constexpr double max_lost = 0.1;               // part of the rays

/// The lamp's shape about the origin, facing along +z.
Lamp with_own_axes(const Lamp& lamp) {
  Lamp shape;
  shape.shape = lamp.shape;
  shape.radius_m = lamp.radius_m;
  shape.size_m = lamp.size_m;
  shape.exponent = lamp.exponent;
  shape.corners_m = lamp.corners_m;
  shape.normal = Eigen::Vector3d::UnitZ();
  shape.x_axis = Eigen::Vector3d::UnitX();
  return shape;
}

bool is_same_shape(const Lamp& a, const Lamp& b) {
  return a.shape == b.shape && a.radius_m == b.radius_m && a.size_m == b.size_m &&
         a.exponent == b.exponent && a.corners_m == b.corners_m;
}

/// True if the outline determines the pose, or that of a disc but for its turn.
bool determines_pose(const Lamp& lamp) {
  return lamp.shape == LampShape::disc || lamp.shape == LampShape::rectangle ||
         lamp.shape == LampShape::polygon || (lamp.shape == LampShape::lame && lamp.exponent != 2);
}

Eigen::Matrix2d power_of(const Eigen::Matrix2d& symmetric, double exponent) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().array().pow(exponent).matrix().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

Eigen::Matrix2d face_moments_m2(const Lamp& lamp) {
  constexpr int points = 128;
  std::vector<Eigen::Vector2d> outline;
  for (const Eigen::Vector3d& point : rim_in_world(with_own_axes(lamp), points))
    outline.push_back(point.head<2>());
  return core::outline_moments(outline).second;
}

OutlineSearch::OutlineSearch(const AssignmentProblem& problem, const Blob& blob)
    : problem_(problem),
      blob_(blob),
      sigma_px_(std::hypot(fit_px, problem.options->model_sigma_px) +
                (blob.saturated ? growth_px : 0)) {
  if (!blob.cut_by_border && !blob.rim.empty()) find_rays();
}

void OutlineSearch::find_rays() {
  const std::size_t step = std::max<std::size_t>(1, blob_.rim.size() / max_rays);
  for (std::size_t i = 0; i < blob_.rim.size(); i += step)
    if (const auto ray = rim_ray(blob_.rim[i], *problem_.camera)) rays_.push_back(*ray);
}

/// With the second moments S of the image as angles and D of the face, the map A of the face to
/// angles has A D A^T = S, so A = S^1/2 Q D^-1/2 with any orthogonal Q. det Q = -1, because the
/// face is seen from its lit side, along which angles are right-handed about the view and the
/// lamp's axes about the normal. A is the upper left part of the rotation over the distance; the
/// largest singular value of that part is 1, and two rotations have it.
std::vector<Rigid3> OutlineSearch::starts(const Lamp& shape) const {
  const int turns = shape.shape == LampShape::disc ? 1 : 24;
  std::vector<Rigid3> all;
  Eigen::Matrix<double, 3, 2> by_pixel;
  const auto bearing = problem_.camera->unproject(blob_.centroid_px, &by_pixel);
  if (!bearing) return all;
  Eigen::Matrix3d view;  // rows: two directions across the bearing, and the bearing
  view.row(2) = bearing->normalized().transpose();
  view.row(0) = view.row(2).transpose().unitOrthogonal().transpose();
  view.row(1) = view.row(2).cross(view.row(0));
  const Eigen::Matrix2d by_px = view.topRows<2>() * by_pixel / bearing->norm();
  const Ellipse& ellipse = blob_.ellipse;
  const Eigen::Rotation2Dd axes(ellipse.angle_rad);
  const Eigen::Vector2d half(ellipse.semi_major_px / 2, ellipse.semi_minor_px / 2);
  const Eigen::Matrix2d image = axes.toRotationMatrix() * half.asDiagonal();
  const Eigen::Matrix2d angles = by_px * image * image.transpose() * by_px.transpose();
  const Eigen::Matrix2d root = power_of(angles, 0.5),
                        inverse = power_of(face_moments_m2(shape), -0.5);
  if (!root.allFinite() || !inverse.allFinite()) return all;
  for (int turn = 0; turn < turns; ++turn) {
    Eigen::Matrix2d mirror = Eigen::Rotation2Dd(2 * pi * turn / turns).toRotationMatrix();
    mirror.col(1) *= -1;
    const Eigen::Matrix2d affine = root * mirror * inverse;
    const double largest = Eigen::JacobiSVD<Eigen::Matrix2d>(affine).singularValues()[0];
    const Eigen::Matrix2d part = affine / largest;
    for (const double side : {1.0, -1.0}) {
      // The columns of the rotation are unit and orthogonal.
      Eigen::Vector2d depth;
      for (int i = 0; i < 2; ++i)
        depth[i] = side * std::sqrt(std::max(0.0, 1 - part.col(i).squaredNorm()));
      if (depth.prod() * -part.col(0).dot(part.col(1)) < 0) depth[1] *= -1;
      Eigen::Matrix3d rotation;
      rotation.col(0) << part.col(0), depth[0];
      rotation.col(1) << part.col(1), depth[1];
      rotation.col(0).normalize();
      rotation.col(1) -= rotation.col(0).dot(rotation.col(1)) * rotation.col(0);
      rotation.col(1).normalize();
      rotation.col(2) = rotation.col(0).cross(rotation.col(1));
      all.push_back({view.transpose() * rotation, view.row(2).transpose() / largest});
    }
  }
  return all;
}

OutlineSearch::Fit OutlineSearch::assess(const Lamp& shape, const Rigid3& cam_from_lamp,
                                         Vector6* gradient) const {
  Fit fit;
  fit.cam_from_lamp = cam_from_lamp;
  const LampInCam in_cam = lamp_in_cam(shape, cam_from_lamp);
  const double weight = 1 / square(sigma_px_);
  if (gradient) gradient->setZero();
  for (const RimRay& ray : rays_) {
    Eigen::Matrix<double, 1, 6> jacobian;
    const auto distance = rim_distance_px(in_cam, ray, gradient ? &jacobian : nullptr);
    if (!distance || std::abs(*distance) > lost_px) {
      fit.chi2 += weight * square(lost_px);
      ++fit.lost;
      if (!distance || !gradient) continue;
    } else {
      fit.chi2 += weight * square(*distance);
    }
    if (!gradient) continue;
    *gradient += weight * *distance * jacobian.transpose();
    fit.information += weight * jacobian.transpose() * jacobian;
  }
  return fit;
}

OutlineSearch::Fit OutlineSearch::refined(const Lamp& shape, const Rigid3& start) const {
  constexpr int max_iterations = 30;
  constexpr double settled = 1e-7;
  Vector6 gradient;
  Fit fit = assess(shape, start, &gradient);
  double damping = 1e-3;
  for (int i = 0; i < max_iterations; ++i) {
    Matrix6 damped = fit.information;
    damped.diagonal() *= 1 + damping;
    const Vector6 step = -core::solve_ldlt(damped, gradient);
    if (!step.allFinite()) break;
    const Rigid3& pose = fit.cam_from_lamp;
    Vector6 new_gradient;
    Fit next =
        assess(shape, {so3_exp(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()},
               &new_gradient);
    if (!(next.chi2 < fit.chi2)) {
      damping *= 10;
      if (damping > 1e6) break;
      continue;
    }
    const bool is_settled = step.head<3>().norm() < settled &&
                            step.tail<3>().norm() < settled * pose.translation.norm();
    fit = next;
    gradient = new_gradient;
    damping = std::max(1e-7, 0.1 * damping);  // no turn of a disc changes its outline
    if (is_settled) break;
  }
  return fit;
}

std::vector<OutlineSearch::Fit> OutlineSearch::fits(const Lamp& shape) const {
  constexpr double same = 1e-3;
  std::vector<Fit> found;
  for (const Rigid3& start : starts(shape)) {
    const Fit fit = refined(shape, start);
    const auto count = static_cast<double>(rays_.size());
    // Root mean square below twice the sigma: errors of the model are common to all points.
    if (fit.lost > max_lost * count || !(fit.chi2 < 4 * count)) continue;
    const bool is_known = std::any_of(found.begin(), found.end(), [&](const Fit& other) {
      return (other.cam_from_lamp.rotation - fit.cam_from_lamp.rotation).norm() < same &&
             (other.cam_from_lamp.translation - fit.cam_from_lamp.translation).norm() <
                 same * fit.cam_from_lamp.translation.norm();
    });
    if (!is_known) found.push_back(fit);
  }
  return found;
}

std::vector<LampPose> OutlineSearch::poses(const Lamp& lamp) {
  constexpr std::size_t min_rays = 12;
  std::vector<LampPose> found;
  const bool is_round = lamp.shape == LampShape::disc;
  if (rays_.size() < min_rays || !determines_pose(lamp) || is_round != blob_.has_elliptical_rim())
    return found;
  const Lamp shape = with_own_axes(lamp);
  auto known = std::find_if(known_.begin(), known_.end(),
                            [&](const Known& k) { return is_same_shape(k.shape, shape); });
  if (known == known_.end()) known = known_.insert(known_.end(), {shape, fits(shape)});
  Eigen::Matrix3d axes;  // columns: the lamp's axes in the world
  axes << lamp.x_axis, lamp.normal.cross(lamp.x_axis), lamp.normal;
  for (const Fit& fit : known->fits) {
    const Rigid3& pose = fit.cam_from_lamp;
    found.push_back(
        {{pose.rotation * axes.transpose(), pose.translation}, fit.information, fit.chi2});
  }
  return found;
}

}  // namespace occ::internal::identify
