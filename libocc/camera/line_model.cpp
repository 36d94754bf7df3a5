// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/internal/line_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace occ::internal::camera {

namespace {

Eigen::Matrix3d about_x(double a) {
  const double c = std::cos(a), s = std::sin(a);
  Eigen::Matrix3d r;
  r << 1, 0, 0, 0, c, -s, 0, s, c;
  return r;
}

Eigen::Matrix3d about_y(double a) {
  const double c = std::cos(a), s = std::sin(a);
  Eigen::Matrix3d r;
  r << c, 0, s, 0, 1, 0, -s, 0, c;
  return r;
}

/// Cross-product matrix of e_i, the generator of a rotation about axis i.
Eigen::Matrix3d generator(int i) {
  Eigen::Matrix3d g = Eigen::Matrix3d::Zero();
  g((i + 2) % 3, (i + 1) % 3) = 1;
  g((i + 1) % 3, (i + 2) % 3) = -1;
  return g;
}

using ByTumbling = Eigen::Matrix<double, 2, 6>;

/// d (w_x, w_y) / d (tumbling parameters) for w_x + i w_y = T1 e^(-i theta) + T2 e^(2 i theta) + T3
/// e^(-2 i theta).
ByTumbling by_tumbling(double c, double s) {
  const double c2 = c * c - s * s, s2 = 2 * s * c;
  ByTumbling by;
  by << c, s, c2, -s2, c2, s2,  //
      -s, c, s2, c2, -s2, c2;
  return by;
}

/// Derivative of by_tumbling by theta.
ByTumbling by_tumbling_slope(double c, double s) {
  const double c2 = c * c - s * s, s2 = 2 * s * c;
  ByTumbling by;
  by << -s, c, -2 * s2, -2 * c2, -2 * s2, 2 * c2,  //
      -c, -s, 2 * c2, -2 * s2, -2 * c2, -2 * s2;
  return by;
}

}  // namespace

/// The turntable at an angle theta. A point in its frame is R_Z(-theta) W(theta)^T point.
struct LineModel::Turntable {
  double c, s;  // cosine and sine of theta

  Eigen::Vector3d from_camera(const Eigen::Vector3d& p) const {  // R_Z(-theta) p
    return {c * p.x() + s * p.y(), -s * p.x() + c * p.y(), p.z()};
  }
  Eigen::Vector3d to_camera(const Eigen::Vector3d& p) const {  // R_Z(theta) p
    return {c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()};
  }
  /// d from_camera(p) / d theta.
  Eigen::Vector3d from_camera_slope(const Eigen::Vector3d& p) const {
    return {-s * p.x() + c * p.y(), -c * p.x() - s * p.y(), 0};
  }
};

/// Tumbling rotation W and its derivatives.
struct LineModel::Tumbling {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d by_x = generator(0), by_y = generator(1);
  Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();  // by theta

  Tumbling() = default;
  Tumbling(const RotatingLine& line, const Turntable& at) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> all(line.tumbling_rad.data());
    const Eigen::Vector2d w = by_tumbling(at.c, at.s) * all;
    const Eigen::Vector2d w_slope = by_tumbling_slope(at.c, at.s) * all;
    const Eigen::Matrix3d x = about_x(w.x()), y = about_y(w.y());
    rotation = x * y;
    by_x = generator(0) * rotation;
    by_y = rotation * generator(1);
    slope = w_slope.x() * by_x + w_slope.y() * by_y;
  }
};

LineModel::LineModel(const RotatingLine& line, double seam)
    : LineBase(CameraKind::rotating_line, line, seam) {
  const Eigen::Matrix3d tilt_x = about_x(line.tilt_x_rad), tilt_y = about_y(line.tilt_y_rad);
  array_ = tilt_y * tilt_x;
  d_tilt_x_ = array_ * generator(0);
  d_tilt_y_ = generator(1) * array_;
  tumbles_ = false;
  for (const double t : line.tumbling_rad) tumbles_ = tumbles_ || t != 0;
}

CameraModel::Pointer LineModel::with_parameters(const Eigen::VectorXd& values) const {
  return std::make_shared<LineModel>(with_values(values), seam_);
}

CameraModel::Pointer LineModel::with_seam_at(double column) const {
  return std::make_shared<LineModel>(line_, column);
}

// theta = azimuth + atan2(nx, ny) - asin(sine), computed by its sine and cosine.
std::optional<LineModel::Turntable> LineModel::turntable_without_tumbling(
    const Eigen::Vector3d& point) const {
  const Eigen::Vector3d n = array_.col(1);
  const double across2 = n.x() * n.x() + n.y() * n.y();
  const double rho2 = point.x() * point.x() + point.y() * point.y();
  const double height = n.dot(line_.eccentricity_m) - n.z() * point.z();
  const double cosine2 = across2 * rho2 - height * height;  // times N^2 rho^2
  if (!(cosine2 > 0)) return std::nullopt;
  const double cosine = std::sqrt(cosine2);
  // Cosine and sine of atan2(nx, ny) - asin(sine), times N^2 rho; then those of theta.
  const double c = n.y() * cosine + n.x() * height, s = n.x() * cosine - n.y() * height;
  const double inverse = 1 / (across2 * rho2);
  return Turntable{(point.x() * c - point.y() * s) * inverse,
                   (point.y() * c + point.x() * s) * inverse};
}

// Newton's method, started without tumbling, which is a small rotation.
std::optional<LineModel::Turntable> LineModel::turntable_at(const Eigen::Vector3d& point) const {
  std::optional<Turntable> turn = turntable_without_tumbling(point);
  if (!turn || !tumbles_) return turn;
  const Eigen::Vector3d n = array_.col(1);
  double theta = std::atan2(turn->s, turn->c);
  for (int i = 0; i < 30; ++i) {
    const Tumbling tumbling(line_, *turn);
    const Eigen::Vector3d steady = tumbling.rotation.transpose() * point;
    const double error = n.dot(turn->from_camera(steady) - line_.eccentricity_m);
    const double slope = n.dot(turn->from_camera_slope(steady) +
                               turn->from_camera(tumbling.slope.transpose() * point));
    const double step = error / slope;
    if (!std::isfinite(step)) return std::nullopt;
    theta -= step;
    turn = Turntable{std::cos(theta), std::sin(theta)};
    if (std::abs(step) < 1e-15) return turn;
    if (std::abs(step) < 1e-13 && i > 5) return turn;  // limited by rounding
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> LineModel::project(const Eigen::Vector3d& point,
                                                  PointJacobian* d_point,
                                                  ParameterJacobian* d_parameters) const {
  if (!point.allFinite()) return std::nullopt;
  const std::optional<Turntable> turn = turntable_at(point);
  if (!turn) return std::nullopt;
  Tumbling tumbling;
  if (tumbles_) tumbling = Tumbling(line_, *turn);
  const Eigen::Vector3d steady =
      tumbles_ ? Eigen::Vector3d(tumbling.rotation.transpose() * point) : point;
  const Eigen::Vector3d q = turn->from_camera(steady) - line_.eccentricity_m;
  const Eigen::Vector3d a = array_.transpose() * q;
  if (!(a.x() > 0)) return std::nullopt;
  const double h = a.z() / a.x();
  const std::optional<double> eta = distorted(h);
  if (!eta) return std::nullopt;
  const double at = column(std::atan2(turn->s, turn->c));
  const Eigen::Vector2d pixel(at, line_.cy_px + line_.c_px * *eta);
  if (!pixel.allFinite()) return std::nullopt;
  if (!d_point && !d_parameters) return pixel;

  // a_y = 0 defines theta. Derivatives of theta and h by a change of a:
  Eigen::Vector3d q_slope = turn->from_camera_slope(steady);
  if (tumbles_) q_slope += turn->from_camera(tumbling.slope.transpose() * point);
  const Eigen::Vector3d a_slope = array_.transpose() * q_slope;
  const double inverse_depth = 1 / a.x(), theta_by_y = -1 / a_slope.y();
  const double h_by_y = (a_slope.z() - h * a_slope.x()) * inverse_depth * theta_by_y;
  const double bend = 1 / undistorted_slope(*eta), px_per_h = line_.c_px * bend;
  PointJacobian by_a;                                 // d pixel / d a
  by_a << 0, theta_by_y / line_.angle_per_px_rad, 0,  //
      -px_per_h * h * inverse_depth, px_per_h * h_by_y, px_per_h * inverse_depth;
  const PointJacobian by_q = by_a * array_.transpose();
  PointJacobian by_steady;  // = by_q R_Z(-theta)
  by_steady << turn->c * by_q.col(0) - turn->s * by_q.col(1),
      turn->s * by_q.col(0) + turn->c * by_q.col(1), by_q.col(2);
  if (d_point)
    *d_point = tumbles_ ? PointJacobian(by_steady * tumbling.rotation.transpose()) : by_steady;
  if (!d_parameters) return pixel;

  ParameterJacobian& d = *d_parameters;
  d.resize(2, parameter_count());
  const double cube = *eta * *eta * *eta;
  d.leftCols<3>() << -at / line_.angle_per_px_rad, 0, 0, 0, *eta, 1;
  d.col(3) = by_a * (d_tilt_x_.transpose() * q);
  d.col(4) = by_a * (d_tilt_y_.transpose() * q);
  d.middleCols<3>(5) = -by_q;
  d.col(8) << 0, px_per_h * cube;
  d.col(9) << 0, px_per_h * cube * *eta * *eta;
  Eigen::Matrix2d by_w;
  by_w << by_steady * (tumbling.by_x.transpose() * point),
      by_steady * (tumbling.by_y.transpose() * point);
  d.rightCols<6>() = by_w * by_tumbling(turn->c, turn->s);
  return pixel;
}

std::optional<Eigen::Vector3d> LineModel::unproject(const Eigen::Vector2d& pixel,
                                                    PixelJacobian* jacobian) const {
  const double eta = (pixel.y() - line_.cy_px) / line_.c_px;
  if (!(std::abs(eta) < max_eta_)) return std::nullopt;
  const double theta = pixel.x() * line_.angle_per_px_rad;
  const Turntable turn{std::cos(theta), std::sin(theta)};
  Tumbling tumbling;
  if (tumbles_) tumbling = Tumbling(line_, turn);
  const Eigen::Vector3d in_array(1, 0, undistorted(eta));
  const double length = in_array.norm();
  const Eigen::Vector3d in_turn = array_ * in_array / length;
  const Eigen::Vector3d bearing = tumbling.rotation * turn.to_camera(in_turn);
  if (!bearing.allFinite()) return std::nullopt;
  if (jacobian) {
    const Eigen::Vector3d by_theta =
        tumbling.rotation * turn.to_camera({-in_turn.y(), in_turn.x(), 0}) +
        tumbling.slope * turn.to_camera(in_turn);
    const Eigen::Vector3d up = array_.col(2) * (undistorted_slope(eta) / (line_.c_px * length));
    const Eigen::Vector3d by_row = tumbling.rotation * turn.to_camera(up);
    jacobian->col(0) = by_theta * line_.angle_per_px_rad;
    jacobian->col(1) = by_row - bearing * bearing.dot(by_row);
  }
  return bearing.normalized();
}

Eigen::Vector3d LineModel::origin(const Eigen::Vector2d& pixel) const {
  const double theta = pixel.x() * line_.angle_per_px_rad;
  const Turntable turn{std::cos(theta), std::sin(theta)};
  const Eigen::Vector3d in_frame = turn.to_camera(line_.eccentricity_m);
  return tumbles_ ? Eigen::Vector3d(Tumbling(line_, turn).rotation * in_frame) : in_frame;
}

}  // namespace occ::internal::camera
