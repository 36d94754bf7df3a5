// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/equirectangular.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {

EquirectangularModel::EquirectangularModel(int width, int height, double angle_per_px_rad,
                                           double fy_px, double cx_px, double cy_px, double seam)
    : CameraModel(CameraKind::equirectangular, width, height,
                  {1 / angle_per_px_rad, fy_px, cx_px, cy_px, 0}),
      angle_per_px_rad_(angle_per_px_rad),
      seam_(seam) {
  require(width > 0, "width", width, "positive");  // the default angle depends on it
  require(angle_per_px_rad > 0 && angle_per_px_rad < pi / 2, "angle_per_px_rad", angle_per_px_rad,
          "positive and below pi/2");
  require_size_and_matrix();
  period_px_ = 2 * pi / angle_per_px_rad;
}

std::vector<CameraParameter> EquirectangularModel::parameters() const {
  return {{"angle_per_px_rad", "rad", angle_per_px_rad_},
          {"fy_px", "px", matrix_.fy},
          {"cx_px", "px", matrix_.cx},
          {"cy_px", "px", matrix_.cy}};
}

CameraModel::Pointer EquirectangularModel::with_parameters(const Eigen::VectorXd& v) const {
  return std::make_shared<EquirectangularModel>(width_, height_, v[0], v[1], v[2], v[3], seam_);
}

CameraModel::Pointer EquirectangularModel::with_seam_at(double column) const {
  return std::make_shared<EquirectangularModel>(width_, height_, angle_per_px_rad_, matrix_.fy,
                                                matrix_.cx, matrix_.cy, column);
}

double EquirectangularModel::max_angle_rad() const { return pi; }

std::optional<Eigen::Vector2d> EquirectangularModel::project(
    const Eigen::Vector3d& point, PointJacobian* d_point, ParameterJacobian* d_parameters) const {
  const double x = point.x(), y = point.y(), z = point.z();
  const double rho = std::hypot(x, z);
  if (!(rho > 0) || !point.allFinite()) return std::nullopt;
  const double longitude = std::atan2(x, z), latitude = std::atan2(y, rho);
  const double plain = matrix_.cx + longitude / angle_per_px_rad_;
  double column = plain - period_px_ * std::floor((plain - seam_) / period_px_);
  if (column >= seam_ + period_px_) column -= period_px_;  // rounding
  const Eigen::Vector2d pixel(column, matrix_.cy + matrix_.fy * latitude);
  if (!pixel.allFinite()) return std::nullopt;
  if (d_point) {
    const double across = 1 / (angle_per_px_rad_ * rho);
    const double along = matrix_.fy / (rho * rho + y * y);
    *d_point << across * z / rho, 0, -across * x / rho,  //
        -along * y * x / rho, along * rho, -along * y * z / rho;
  }
  if (d_parameters) {
    d_parameters->resize(2, 4);
    *d_parameters << -(column - matrix_.cx) / angle_per_px_rad_, 0, 1, 0,  //
        0, latitude, 0, 1;
  }
  return pixel;
}

std::optional<Eigen::Vector3d> EquirectangularModel::unproject(const Eigen::Vector2d& pixel,
                                                               PixelJacobian* jacobian) const {
  const double longitude = (pixel.x() - matrix_.cx) * angle_per_px_rad_;
  const double latitude = (pixel.y() - matrix_.cy) / matrix_.fy;
  if (!(std::abs(latitude) < pi / 2) || !std::isfinite(longitude)) return std::nullopt;
  const double sine = std::sin(longitude), cosine = std::cos(longitude);
  const double up = std::sin(latitude), out = std::cos(latitude);
  if (jacobian) {
    *jacobian << angle_per_px_rad_ * out * cosine, -up * sine / matrix_.fy,  //
        0, out / matrix_.fy,                                                 //
        -angle_per_px_rad_ * out * sine, -up * cosine / matrix_.fy;
  }
  return Eigen::Vector3d(out * sine, up, out * cosine);
}

}  // namespace occ
