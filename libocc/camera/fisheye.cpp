// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/fisheye.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/camera/internal/polynomial.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::camera;

FisheyeModel::FisheyeModel(int width, int height, const CameraMatrix& matrix,
                           const std::vector<double>& distortion)
    : CameraModel(CameraKind::fisheye, width, height, matrix, distortion), max_angle_(pi) {
  require_size_and_matrix();
  require(distortion.size() <= 4, "distortion's length", distortion.size(), "at most 4");
  for (std::size_t i = 0; i < distortion.size(); ++i)
    require(std::isfinite(distortion[i]), "distortion[" + std::to_string(i) + "]", distortion[i],
            "finite");
  std::copy(distortion.begin(), distortion.end(), k_.begin());
  const Polynomial growth{1, 3 * k_[0], 5 * k_[1], 7 * k_[2], 9 * k_[3]};  // d d / d a in a^2
  const std::vector<double> ends = sign_changes(growth, pi * pi);
  if (!ends.empty()) max_angle_ = std::sqrt(ends.front());
}

double FisheyeModel::distorted(double a) const {
  const double s = a * a;
  return a * (1 + s * (k_[0] + s * (k_[1] + s * (k_[2] + s * k_[3]))));
}

double FisheyeModel::slope(double a) const {
  const double s = a * a;
  return 1 + s * (3 * k_[0] + s * (5 * k_[1] + s * (7 * k_[2] + s * 9 * k_[3])));
}

// Newton's method inside a bracket; d grows throughout the domain.
double FisheyeModel::undistorted(double distorted_angle) const {
  double low = 0, high = max_angle_, a = std::min(distorted_angle, high);
  for (int i = 0; i < 100; ++i) {
    const double error = distorted(a) - distorted_angle;
    if (std::abs(error) <= 1e-16 * distorted_angle) break;
    (error < 0 ? low : high) = a;
    const double next = a - error / slope(a);
    const double before = a;
    a = next > low && next < high ? next : 0.5 * (low + high);
    if (a == before) break;
  }
  return a;
}

std::vector<CameraParameter> FisheyeModel::parameters() const {
  std::vector<CameraParameter> all{{"fx_px", "px", matrix_.fx},
                                   {"fy_px", "px", matrix_.fy},
                                   {"cx_px", "px", matrix_.cx},
                                   {"cy_px", "px", matrix_.cy},
                                   {"skew_px", "px", matrix_.skew}};
  for (std::size_t i = 0; i < distortion_.size(); ++i)
    all.push_back({"k" + std::to_string(i + 1), "1", k_[i]});
  return all;
}

CameraModel::Pointer FisheyeModel::with_parameters(const Eigen::VectorXd& v) const {
  return std::make_shared<FisheyeModel>(width_, height_, CameraMatrix{v[0], v[1], v[2], v[3], v[4]},
                                        std::vector<double>(v.begin() + 5, v.end()));
}

CameraModel::Pointer FisheyeModel::without_distortion() const {
  if (distortion_.empty()) return nullptr;
  return std::make_shared<FisheyeModel>(width_, height_, matrix_, std::vector<double>{});
}

std::optional<Eigen::Vector2d> FisheyeModel::project(const Eigen::Vector3d& point,
                                                     PointJacobian* d_point,
                                                     ParameterJacobian* d_parameters) const {
  const double r2 = point.head<2>().squaredNorm(), r = std::sqrt(r2), z = point.z();
  const double length2 = r2 + z * z;
  if (!(length2 > 0) || !std::isfinite(length2)) return std::nullopt;
  const double a = std::atan2(r, z);
  if (!(a < max_angle_)) return std::nullopt;
  if (r == 0 && z < 0)
    return std::nullopt;  // on the axis behind the camera the direction is undefined
  const double d = distorted(a);
  // Near the axis d / r tends to 1 / z.
  const bool on_axis = r <= 1e-12 * std::abs(z);
  const double scale = on_axis ? 1 / z : d / r;
  const Eigen::Vector2d plane = scale * point.head<2>();
  if (d_point) {
    Eigen::Matrix<double, 2, 3> d_plane;
    d_plane.leftCols<2>() = scale * Eigen::Matrix2d::Identity();
    if (on_axis) {
      d_plane.col(2) = -plane / z;
    } else {
      const Eigen::Vector2d along = point.head<2>() / r;
      const double rate = slope(a) / length2;  // d d = rate (z dr - r dz)
      d_plane.leftCols<2>() += along * along.transpose() * (rate * z - scale);
      d_plane.col(2) = -along * rate * r;
    }
    *d_point = matrix_.d_px() * d_plane;
  }
  if (d_parameters) {
    d_parameters->resize(2, parameter_count());
    d_parameters->leftCols<5>() << plane.x(), 0, 1, 0, plane.y(), 0, plane.y(), 0, 1, 0;
    Eigen::Vector2d column =
        matrix_.d_px() * (on_axis ? plane : Eigen::Vector2d(point.head<2>() * a / r));
    for (int i = 5; i < parameter_count(); ++i) {
      column *= a * a;
      d_parameters->col(i) = column;
    }
  }
  const Eigen::Vector2d pixel = matrix_.to_px(plane);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> FisheyeModel::unproject(const Eigen::Vector2d& pixel,
                                                       PixelJacobian* jacobian) const {
  const Eigen::Vector2d plane = matrix_.from_px(pixel);
  const double d = plane.norm();
  if (!(d < distorted(max_angle_))) return std::nullopt;
  const double a = undistorted(d), sine = std::sin(a), cosine = std::cos(a);
  const bool on_axis = d < 1e-12;
  const double scale = on_axis ? 1 : sine / d;
  const Eigen::Vector3d bearing(scale * plane.x(), scale * plane.y(), cosine);
  if (jacobian) {
    Eigen::Matrix<double, 3, 2> d_plane;
    d_plane << scale, 0, 0, scale, -plane.x(), -plane.y();
    if (!on_axis) {
      const Eigen::Vector2d along = plane / d;
      const double d_angle = 1 / slope(a);
      d_plane.topRows<2>() += along * along.transpose() * (cosine * d_angle - scale);
      d_plane.row(2) = -sine * d_angle * along.transpose();
    }
    *jacobian = d_plane * matrix_.d_plane();
  }
  return bearing.normalized();
}

}  // namespace occ
