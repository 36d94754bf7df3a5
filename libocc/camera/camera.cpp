// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/camera/internal/distortion.hpp"
#include "libocc/core/require.hpp"

namespace occ {

namespace {

constexpr double half_pi = 1.57079632679489661923;

void require_finite(const char* name, double value) {
  require(std::isfinite(value), name, value, "finite");
}

void require_focal_length(const char* name, double value) {
  require(value > 0 && std::isfinite(value), name, value, "positive and finite");
}

void require_distortion(const std::vector<double>& distortion) {
  const std::size_t n = distortion.size();
  require(n == 0 || n == 4 || n == 5 || n == 8 || n == 12 || n == 14, "distortion's length", n,
          "0, 4, 5, 8, 12 or 14");
  for (std::size_t i = 0; i < n; ++i) {
    const std::string name = "distortion[" + std::to_string(i) + "]";
    require(std::isfinite(distortion[i]), name, distortion[i], "finite");
    const bool is_tilt = i >= 12;
    require(!is_tilt || std::abs(distortion[i]) < half_pi, name, distortion[i],
            "a tilt in (-pi/2, pi/2)");
  }
}

/// A point after a homography of the plane z = 1, or nothing behind its horizon; `jacobian` becomes
/// d out / d in.
std::optional<Eigen::Vector2d> apply_homography(const Eigen::Matrix3d& h, const Eigen::Vector2d& p,
                                                Eigen::Matrix2d* jacobian) {
  const Eigen::Vector3d v = h * p.homogeneous();
  if (!(v.z() > 0)) return std::nullopt;
  const Eigen::Vector2d out = v.head<2>() / v.z();
  if (jacobian) {
    *jacobian = (h.topLeftCorner<2, 2>() - out * h.bottomLeftCorner<1, 2>()) / v.z();
  }
  return out;
}

}  // namespace

Camera Camera::pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                       double cy_px, const std::vector<double>& distortion, double skew_px) {
  require(width > 0, "width", width, "positive");
  require(height > 0, "height", height, "positive");
  require_focal_length("fx_px", fx_px);
  require_focal_length("fy_px", fy_px);
  require_finite("cx_px", cx_px);
  require_finite("cy_px", cy_px);
  require_finite("skew_px", skew_px);
  require_distortion(distortion);
  Camera camera{Private{}};
  camera.width_ = width;
  camera.height_ = height;
  camera.fx_ = fx_px;
  camera.fy_ = fy_px;
  camera.cx_ = cx_px;
  camera.cy_ = cy_px;
  camera.skew_ = skew_px;
  camera.distortion_ = distortion;
  std::copy(distortion.begin(), distortion.end(), camera.k_.begin());
  camera.bends_ =
      std::any_of(camera.k_.begin(), camera.k_.begin() + 12, [](double c) { return c != 0; });
  camera.tilted_ = camera.k_[12] != 0 || camera.k_[13] != 0;
  camera.tilt_ = tilt_homography(camera.k_[12], camera.k_[13]);
  camera.max_radius_squared_ = domain_radius_squared(camera.k_);
  return camera;
}

Camera Camera::without_distortion() const {
  return pinhole(width_, height_, fx_, fy_, cx_, cy_, {}, skew_);
}

Eigen::Matrix3d Camera::matrix() const {
  Eigen::Matrix3d k;
  k << fx_, skew_, cx_, 0, fy_, cy_, 0, 0, 1;
  return k;
}

double Camera::max_angle_rad() const { return std::atan(std::sqrt(max_radius_squared_)); }

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point_in_cam,
                                               Eigen::Matrix<double, 2, 3>* jacobian) const {
  if (!(point_in_cam.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / point_in_cam.z();
  Eigen::Vector2d p = point_in_cam.head<2>() * inverse_z;
  if (!(p.squaredNorm() < max_radius_squared_)) return std::nullopt;
  Eigen::Matrix<double, 2, 3> d_point;
  if (jacobian) {
    d_point << inverse_z, 0, -p.x() * inverse_z, 0, inverse_z, -p.y() * inverse_z;
  }
  Eigen::Matrix2d step;
  if (bends_) {
    p = distort(k_, p, jacobian ? &step : nullptr);
    if (jacobian) d_point = step * d_point;
  }
  if (tilted_) {
    const std::optional<Eigen::Vector2d> on_sensor =
        apply_homography(tilt_, p, jacobian ? &step : nullptr);
    if (!on_sensor) return std::nullopt;
    p = *on_sensor;
    if (jacobian) d_point = step * d_point;
  }
  if (jacobian) {
    jacobian->row(0) = fx_ * d_point.row(0) + skew_ * d_point.row(1);
    jacobian->row(1) = fy_ * d_point.row(1);
  }
  const Eigen::Vector2d pixel(fx_ * p.x() + skew_ * p.y() + cx_, fy_ * p.y() + cy_);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel,
                                                 Eigen::Matrix<double, 3, 2>* jacobian) const {
  if (!pixel.allFinite()) return std::nullopt;
  const double y = (pixel.y() - cy_) / fy_;
  Eigen::Vector2d p((pixel.x() - cx_ - skew_ * y) / fx_, y);
  Eigen::Matrix2d d_pixel, step;  // d point on the plane z = 1 / d pixel
  d_pixel << 1 / fx_, -skew_ / (fx_ * fy_), 0, 1 / fy_;
  if (tilted_) {
    const std::optional<Eigen::Vector2d> off_sensor =
        apply_homography(tilt_.inverse(), p, jacobian ? &step : nullptr);
    if (!off_sensor) return std::nullopt;
    p = *off_sensor;
    if (jacobian) d_pixel = step * d_pixel;
  }
  if (bends_) {
    const std::optional<Eigen::Vector2d> straight = undistort(k_, max_radius_squared_, p);
    if (!straight) return std::nullopt;
    p = *straight;
    if (jacobian) {
      distort(k_, p, &step);
      d_pixel = step.inverse() * d_pixel;
    }
  }
  const double length = std::sqrt(p.squaredNorm() + 1);
  const Eigen::Vector3d bearing = p.homogeneous() / length;
  if (jacobian) {
    const Eigen::Matrix3d across =
        (Eigen::Matrix3d::Identity() - bearing * bearing.transpose()) / length;
    *jacobian = across.leftCols<2>() * d_pixel;
  }
  if (!(bearing.z() > 0)) return std::nullopt;
  return bearing;
}

bool Camera::contains(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= -0.5 && pixel.x() < width_ - 0.5 && pixel.y() >= -0.5 &&
         pixel.y() < height_ - 0.5;
}

}  // namespace occ
