// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/observed_rim.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/camera/internal/parameter_values.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/rim_errors.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// Rim points, of which each row is divided by the sigma of its noise.
struct RimRows {
  MatrixXd b;  ///< derivatives by the common errors
  MatrixXd j;  ///< derivatives by the unknowns of OutlineObservation, and by the camera's
  VectorXd y;  ///< measured minus predicted
};

std::optional<RimRows> rows_of(const Lamp& lamp, const Blob& blob, const Rigid3& pose,
                               const Camera& camera, bool with_camera) {
  constexpr double step = 1e-5;      // of the logarithm of the aspect ratio, numerical derivative
  constexpr double huber_sigma = 3;  // residuals beyond it have a lower weight
  constexpr double huber_px = 0.02;  // error of the reference
  const LampInCam in_cam = lamp_in_cam(lamp, pose);
  Lamp stretched = lamp;
  stretched.size_m[0] *= std::exp(0.5 * step);
  stretched.size_m[1] *= std::exp(-0.5 * step);
  const LampInCam stretched_in_cam = lamp_in_cam(stretched, pose);
  const Index parameters = with_camera ? static_cast<Index>(camera.parameters().size()) : 0;
  const Index count = static_cast<Index>(blob.rim.size());
  RimRows rows{MatrixXd(count, 5), MatrixXd(count, 8 + parameters), VectorXd(count)};
  Index row = 0;
  for (const RimPoint& point : blob.rim) {
    const auto ray = rim_ray(point, camera);
    const auto residual = ray ? rim_distance_px(in_cam, *ray) : std::nullopt;
    if (!residual) continue;
    // Derivatives at the predicted rim: those at the measured point would depend on its noise.
    RimPoint predicted = point;
    predicted.px -= *residual * point.normal;
    const auto foot = rim_ray(predicted, camera);
    Eigen::Matrix<double, 1, 6> jacobian;
    const auto rest = foot ? rim_distance_px(in_cam, *foot, &jacobian) : std::nullopt;
    if (!rest) continue;
    rows.j.row(row).head<6>() = jacobian;
    rows.j(row, 6) = 0;
    if (lamp.shape != LampShape::disc) {
      const auto moved = rim_distance_px(stretched_in_cam, *foot);
      if (!moved) continue;
      rows.j(row, 6) = (*moved - *rest) / step;
    }
    rows.j(row, 7) = -1;
    if (with_camera) {
      Camera::ParameterJacobian by_camera;
      if (!camera.project(foot->bearing, nullptr, &by_camera)) continue;
      rows.j.row(row).tail(parameters) = -point.normal.transpose() * by_camera;
    }
    rows.b.row(row) = core::common_rim_errors(point.normal).transpose();
    rows.y[row] = *residual;
    const double excess = std::abs(*residual) / (huber_sigma * point.sigma_px + huber_px);
    const double scale = 1 / (point.sigma_px * std::sqrt(std::max(1.0, excess)));
    rows.b.row(row) *= scale;
    rows.j.row(row) *= scale;
    rows.y[row++] *= scale;
  }
  constexpr Index min_points = 12;  // eight unknowns, and four for the noise
  if (row < min_points) return std::nullopt;
  rows.b.conservativeResize(row, Eigen::NoChange);
  rows.j.conservativeResize(row, Eigen::NoChange);
  rows.y.conservativeResize(row);
  return rows;
}

/// Rows R and constant z with R^T R = F and R^T z = g, for a positive semidefinite F.
void set_rows(const MatrixXd& f, const VectorXd& g, OutlineObservation& outline) {
  const VectorXd unit = f.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = unit.asDiagonal() * f * unit.asDiagonal();
  const auto eigen = core::symmetric_eigen<MatrixXd>(scaled);
  constexpr double min_share = 1e-6;  // of the information of an unknown; the rest is not linear
  std::vector<Index> kept;
  for (Index k = 0; k < f.rows(); ++k)
    if (eigen.eigenvalues()[k] > min_share) kept.push_back(k);
  const Index count = static_cast<Index>(kept.size());
  outline.rows.resize(count, 8);
  outline.by_camera.resize(f.rows() > 8 ? count : 0, f.rows() - 8);
  outline.constant.resize(count);
  for (Index i = 0; i < count; ++i) {
    const double root = std::sqrt(eigen.eigenvalues()[kept[i]]);
    const VectorXd direction = eigen.eigenvectors().col(kept[i]);
    const VectorXd row = root * direction.cwiseQuotient(unit);
    outline.rows.row(i) = row.head<8>();
    if (f.rows() > 8) outline.by_camera.row(i) = row.tail(f.rows() - 8);
    outline.constant[i] = direction.dot(unit.cwiseProduct(g)) / root;
  }
}

}  // namespace

NetworkOutline outline_of(const Lamp& lamp) {
  NetworkOutline outline;
  outline.world_from_outline << lamp.x_axis, lamp.normal.cross(lamp.x_axis), lamp.normal;
  outline.is_round = lamp.shape == LampShape::disc;
  outline.size_m = outline.is_round ? Vector2d::Constant(lamp.radius_m) : lamp.size_m;
  return outline;
}

void set_outline(const NetworkOutline& outline, Lamp& lamp) {
  lamp.x_axis = outline.world_from_outline.col(0);
  lamp.normal = outline.world_from_outline.col(2);
  if (outline.is_round)
    lamp.radius_m = outline.size_m[0];
  else
    lamp.size_m = outline.size_m;
}

std::optional<ObservedRim> observed_rim(const Lamp& lamp, const Blob& blob,
                                        const Rigid3& cam_from_world, const Camera& camera,
                                        double model_sigma_px, bool with_camera) {
  const auto rows = rows_of(lamp, blob, cam_from_world, camera, with_camera);
  Eigen::Matrix<double, 2, 3> by_centre;
  const auto centre = camera.project(cam_from_world * lamp.centre_m, &by_centre);
  if (!rows || !centre) return std::nullopt;
  const RimErrorCovariance common =
      blob.rim_covariance_px2 + square(model_sigma_px) * RimErrorCovariance::Identity();
  const MatrixXd g5 = core::transposed_product(rows->b, rows->b);
  const MatrixXd h = core::transposed_product(rows->b, rows->j);
  const MatrixXd k = core::transposed_product(rows->j, rows->j);
  const VectorXd by = rows->b.transpose() * rows->y, jy = rows->j.transpose() * rows->y;

  // The sides of a rectangle have too few directions for a stretch.
  const Index fitted_errors = lamp.shape == LampShape::disc ? 5 : 3;
  const MatrixXd fit = g5.topLeftCorner(fitted_errors, fitted_errors);
  const core::Cholesky<MatrixXd> noise(fit);
  constexpr double singular = 1e-6;  // the rim is seen from a small part of its directions
  if (!noise.exists() || !(noise.rcond() > singular)) return std::nullopt;
  // Noise beyond that of the points, from what common errors and the shape cannot explain.
  MatrixXd all(rows->y.size(), 5 + rows->j.cols());
  all << rows->b, rows->j;
  const VectorXd fitted = core::minimum_norm_solution(all, rows->y);
  const double dof = static_cast<double>(rows->y.size()) - (lamp.shape == LampShape::disc ? 5 : 8);
  constexpr double sigmas = 3;  // of the variance of a rim without further noise
  const double factor = std::max(
      1.0, (rows->y - all * fitted).squaredNorm() / dof / (1 + sigmas * std::sqrt(2 / dof)));

  const MatrixXd inverse = core::inverse<MatrixXd>(fit).middleRows(1, 2);  // of the shift
  const MatrixXd weight = core::inverse<MatrixXd>(MatrixXd(common).inverse() + g5 / factor);
  const MatrixXd full =
      (k - core::product(core::transposed_product(h, weight), h) / factor) / factor;
  const VectorXd gradient = (jy - h.transpose() * (weight * by) / factor) / factor;
  const Vector2d shift = inverse * by.head(fitted_errors);
  const MatrixXd by_unknowns = core::product(inverse, h.topRows(fitted_errors));
  const MatrixXd by_common = core::product(inverse, g5.topRows(fitted_errors));
  const Eigen::Matrix2d covariance =
      factor * inverse.middleCols(1, 2) + by_common * common * by_common.transpose();
  const Eigen::Matrix2d shift_weight = covariance.inverse();

  ObservedRim result;
  result.centre_px = *centre + shift;
  result.sigma_px = covariance.diagonal().cwiseSqrt();
  const NetworkOutline shape = outline_of(lamp);
  result.outline.cam_from_outline = {cam_from_world.rotation * shape.world_from_outline,
                                     cam_from_world * lamp.centre_m};
  result.outline.size_m = shape.size_m;
  result.outline.centre_rows = -by_unknowns.leftCols<8>();
  result.outline.centre_rows.middleCols<3>(3) -= by_centre;
  if (with_camera) result.outline.camera_parameters = camera::parameter_values(camera);
  set_rows(full - by_unknowns.transpose() * shift_weight * by_unknowns,
           gradient - by_unknowns.transpose() * (shift_weight * shift), result.outline);
  if (!result.outline.rows.allFinite() || !result.outline.constant.allFinite()) return std::nullopt;
  return result;
}

}  // namespace occ::internal::survey
