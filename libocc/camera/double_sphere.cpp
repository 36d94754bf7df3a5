// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/double_sphere.hpp"

#include <Eigen/LU>
#include <cmath>

#include "libocc/core/require.hpp"

namespace occ {

DoubleSphereModel::DoubleSphereModel(int width, int height, const CameraMatrix& matrix, double xi,
                                     double alpha)
    : CameraModel(CameraKind::double_sphere, width, height, matrix), xi_(xi), alpha_(alpha) {
  require_size_and_matrix();
  require(xi > -1 && xi <= 1, "xi", xi, "in (-1, 1]");
  require(alpha >= 0 && alpha <= 1, "alpha", alpha, "in [0, 1]");
  w1_ = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;  // eq. 45
  w2_ = (w1_ + xi) / std::sqrt(2 * w1_ * xi + xi * xi + 1);        // eq. 44
}

std::vector<CameraParameter> DoubleSphereModel::parameters() const {
  return {{"fx_px", "px", matrix_.fx},
          {"fy_px", "px", matrix_.fy},
          {"cx_px", "px", matrix_.cx},
          {"cy_px", "px", matrix_.cy},
          {"xi", "1", xi_},
          {"alpha", "1", alpha_}};
}

CameraModel::Pointer DoubleSphereModel::with_parameters(const Eigen::VectorXd& v) const {
  return std::make_shared<DoubleSphereModel>(width_, height_,
                                             CameraMatrix{v[0], v[1], v[2], v[3], 0}, v[4], v[5]);
}

// The edge of the domain z > -w2 |X| (eq. 43).
double DoubleSphereModel::max_angle_rad() const { return std::acos(-w2_); }

std::optional<Eigen::Vector2d> DoubleSphereModel::project(const Eigen::Vector3d& point,
                                                          PointJacobian* d_point,
                                                          ParameterJacobian* d_parameters) const {
  const double length = point.norm();  // d1 (eq. 41)
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  const Eigen::Vector3d b = point / length;
  if (!(b.z() > -w2_)) return std::nullopt;
  const double h = xi_ + b.z();
  const double d2 = std::sqrt(b.head<2>().squaredNorm() + h * h);  // eq. 42, over d1
  const double below = alpha_ * d2 + (1 - alpha_) * h;
  if (!(below > 1e-12)) return std::nullopt;
  const Eigen::Vector2d plane = b.head<2>() / below;  // eq. 40
  if (d_point) {
    const Eigen::RowVector3d d_below =
        Eigen::RowVector3d(alpha_ * b.x() / d2, alpha_ * b.y() / d2, alpha_ * h / d2 + 1 - alpha_);
    Eigen::Matrix<double, 2, 3> d_b = -plane * d_below / below;
    d_b.leftCols<2>() += Eigen::Matrix2d::Identity() / below;
    *d_point = matrix_.d_px() * d_b * (Eigen::Matrix3d::Identity() - b * b.transpose()) / length;
  }
  if (d_parameters) {
    d_parameters->resize(2, 6);
    d_parameters->leftCols<4>() << plane.x(), 0, 1, 0, 0, plane.y(), 0, 1;
    const Eigen::Vector2d d_below = -(matrix_.d_px() * plane) / below;
    d_parameters->col(4) = d_below * (alpha_ * h / d2 + 1 - alpha_);
    d_parameters->col(5) = d_below * (d2 - h);
  }
  const Eigen::Vector2d pixel = matrix_.to_px(plane);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> DoubleSphereModel::unproject(const Eigen::Vector2d& pixel,
                                                            PixelJacobian* jacobian) const {
  const Eigen::Vector2d m = matrix_.from_px(pixel);
  const double r2 = m.squaredNorm();
  const double inside = 1 - (2 * alpha_ - 1) * r2;  // eqs 46-50
  if (!(inside >= 0) || !std::isfinite(r2)) return std::nullopt;
  const double root = std::sqrt(inside);
  const double mz = (1 - alpha_ * alpha_ * r2) / (alpha_ * root + 1 - alpha_);
  const double under = mz * mz + (1 - xi_ * xi_) * r2;
  if (!(under >= 0)) return std::nullopt;
  const double scale = (mz * xi_ + std::sqrt(under)) / (mz * mz + r2);
  const Eigen::Vector3d b =
      Eigen::Vector3d(scale * m.x(), scale * m.y(), scale * mz - xi_).normalized();
  if (!(b.z() > -w2_)) return std::nullopt;
  if (jacobian) {  // inverse of the projection's Jacobian in the plane orthogonal to the bearing
    PointJacobian d_point;
    if (!project(b, &d_point, nullptr)) return std::nullopt;
    Eigen::Matrix3d square;
    square << d_point, b.transpose();
    *jacobian = square.inverse().leftCols<2>();
  }
  return b;
}

}  // namespace occ
