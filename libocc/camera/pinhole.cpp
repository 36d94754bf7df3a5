// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/pinhole.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/camera/internal/distortion.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::camera;
namespace {

constexpr const char* coefficient_names[] = {"k1", "k2", "p1", "p2", "k3", "k4",    "k5",
                                             "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"};

void require_distortion(const std::vector<double>& distortion) {
  const std::size_t n = distortion.size();
  require(n == 0 || n == 4 || n == 5 || n == 8 || n == 12 || n == 14, "distortion's length", n,
          "0, 4, 5, 8, 12 or 14");
  for (std::size_t i = 0; i < n; ++i) {
    const std::string name = "distortion[" + std::to_string(i) + "]";
    require(std::isfinite(distortion[i]), name, distortion[i], "finite");
    const bool is_tilt = i >= 12;
    require(!is_tilt || std::abs(distortion[i]) < pi / 2, name, distortion[i],
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

PinholeModel::PinholeModel(int width, int height, const CameraMatrix& matrix,
                           const std::vector<double>& distortion)
    : CameraModel(CameraKind::pinhole, width, height, matrix, distortion) {
  require_size_and_matrix();
  require_distortion(distortion);
  std::copy(distortion.begin(), distortion.end(), k_.begin());
  distorts_ = std::any_of(k_.begin(), k_.begin() + 12, [](double c) { return c != 0; });
  tilted_ = k_[12] != 0 || k_[13] != 0;
  tilt_ = tilt_homography(k_[12], k_[13]);
  max_radius_squared_ = domain_radius_squared(k_);
}

std::vector<CameraParameter> PinholeModel::parameters() const {
  std::vector<CameraParameter> all{{"fx_px", "px", matrix_.fx},
                                   {"fy_px", "px", matrix_.fy},
                                   {"cx_px", "px", matrix_.cx},
                                   {"cy_px", "px", matrix_.cy},
                                   {"skew_px", "px", matrix_.skew}};
  for (std::size_t i = 0; i < distortion_.size(); ++i)
    all.push_back({coefficient_names[i], i < 12 ? "1" : "rad", distortion_[i]});
  return all;
}

CameraModel::Pointer PinholeModel::with_parameters(const Eigen::VectorXd& v) const {
  return std::make_shared<PinholeModel>(width_, height_, CameraMatrix{v[0], v[1], v[2], v[3], v[4]},
                                        std::vector<double>(v.begin() + 5, v.end()));
}

CameraModel::Pointer PinholeModel::without_distortion() const {
  if (distortion_.empty()) return nullptr;
  return std::make_shared<PinholeModel>(width_, height_, matrix_, std::vector<double>{});
}

double PinholeModel::max_angle_rad() const { return std::atan(std::sqrt(max_radius_squared_)); }

double PinholeModel::depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  if (gradient) *gradient = Eigen::Vector3d::UnitZ();
  return point.z();
}

std::optional<Eigen::Vector2d> PinholeModel::project(const Eigen::Vector3d& point,
                                                     PointJacobian* jacobian,
                                                     ParameterJacobian* d_parameters) const {
  if (!(point.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / point.z();
  const Eigen::Vector2d undistorted = point.head<2>() * inverse_z;
  Eigen::Vector2d p = undistorted;
  if (!(p.squaredNorm() < max_radius_squared_)) return std::nullopt;
  PointJacobian d_point;
  if (jacobian) {
    d_point << inverse_z, 0, -p.x() * inverse_z, 0, inverse_z, -p.y() * inverse_z;
  }
  Eigen::Matrix2d step;
  if (distorts_) {
    p = distort(k_, p, jacobian ? &step : nullptr);
    if (jacobian) d_point = step * d_point;
  }
  const Eigen::Vector2d distorted = p;
  Eigen::Matrix2d d_tilt = Eigen::Matrix2d::Identity();
  if (tilted_) {
    const std::optional<Eigen::Vector2d> on_sensor =
        apply_homography(tilt_, p, jacobian || d_parameters ? &d_tilt : nullptr);
    if (!on_sensor) return std::nullopt;
    p = *on_sensor;
    if (jacobian) d_point = d_tilt * d_point;
  }
  if (jacobian) {
    jacobian->row(0) = matrix_.fx * d_point.row(0) + matrix_.skew * d_point.row(1);
    jacobian->row(1) = matrix_.fy * d_point.row(1);
  }
  const Eigen::Vector2d pixel = matrix_.to_px(p);
  if (!pixel.allFinite()) return std::nullopt;
  if (d_parameters) differentiate(undistorted, distorted, p, d_tilt, *d_parameters);
  return pixel;
}

void PinholeModel::differentiate(const Eigen::Vector2d& undistorted,
                                 const Eigen::Vector2d& distorted, const Eigen::Vector2d& on_sensor,
                                 const Eigen::Matrix2d& d_tilt,
                                 ParameterJacobian& d_parameters) const {
  const auto n = static_cast<Eigen::Index>(distortion_.size());
  d_parameters.resize(2, 5 + n);
  d_parameters.leftCols<5>() << on_sensor.x(), 0, 1, 0, on_sensor.y(),  //
      0, on_sensor.y(), 0, 1, 0;
  if (n == 0) return;
  const Eigen::Matrix2d k = matrix_.d_px();
  const Eigen::Matrix<double, 2, 12> d_lens = distort_by_coefficients(k_, undistorted);
  const Eigen::Index lens = std::min<Eigen::Index>(n, 12);
  d_parameters.middleCols(5, lens) = k * d_tilt * d_lens.leftCols(lens);
  if (n > 12) d_parameters.rightCols<2>() = k * tilt_by_angles(k_[12], k_[13], distorted);
}

std::optional<Eigen::Vector3d> PinholeModel::unproject(const Eigen::Vector2d& pixel,
                                                       PixelJacobian* jacobian) const {
  Eigen::Vector2d p = matrix_.from_px(pixel);
  Eigen::Matrix2d d_pixel, step;  // d point on the plane z = 1 / d pixel
  if (jacobian) d_pixel = matrix_.d_plane();
  if (tilted_) {
    const std::optional<Eigen::Vector2d> off_sensor =
        apply_homography(tilt_.inverse(), p, jacobian ? &step : nullptr);
    if (!off_sensor) return std::nullopt;
    p = *off_sensor;
    if (jacobian) d_pixel = step * d_pixel;
  }
  if (distorts_) {
    const std::optional<Eigen::Vector2d> undistorted = undistort(k_, max_radius_squared_, p);
    if (!undistorted) return std::nullopt;
    p = *undistorted;
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

}  // namespace occ
