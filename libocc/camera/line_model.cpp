// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/internal/line_model.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace occ {

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

/// e_i x, the generator of a turn about axis i.
Eigen::Matrix3d generator(int i) {
  Eigen::Matrix3d g = Eigen::Matrix3d::Zero();
  g((i + 2) % 3, (i + 1) % 3) = 1;
  g((i + 1) % 3, (i + 2) % 3) = -1;
  return g;
}

}  // namespace

/// The turntable at an angle: point in its frame = R_Z(-theta) W(theta)^T point.
struct LineModel::Turn {
  Turn(const RotatingLine& line, bool tumbles, double theta)
      : c(std::cos(theta)), s(std::sin(theta)) {
    if (!tumbles) return;
    const std::array<double, 6>& t = line.tumbling_rad;
    const double c2 = c * c - s * s, s2 = 2 * s * c;
    // T1 e^(-i theta) + T2 e^(2 i theta) + T3 e^(-2 i theta): by each real and imaginary part
    by << c, s, c2, -s2, c2, s2,  //
        -s, c, s2, c2, -s2, c2;
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> all(t.data());
    w = by * all;
    Eigen::Matrix<double, 2, 6> slope;
    slope << -s, c, -2 * s2, -2 * c2, -2 * s2, 2 * c2,  //
        -c, -s, 2 * c2, -2 * s2, -2 * c2, -2 * s2;
    w_slope = slope * all;
    x = about_x(w.x());
    y = about_y(w.y());
  }

  Eigen::Vector3d back(const Eigen::Vector3d& p) const {  // R_Z(-theta) p
    return {c * p.x() + s * p.y(), -s * p.x() + c * p.y(), p.z()};
  }
  Eigen::Vector3d forth(const Eigen::Vector3d& p) const {  // R_Z(theta) p
    return {c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()};
  }
  Eigen::Matrix3d back_matrix() const {
    Eigen::Matrix3d r;
    r << c, s, 0, -s, c, 0, 0, 0, 1;
    return r;
  }
  /// d back(p) / d theta.
  Eigen::Vector3d back_slope(const Eigen::Vector3d& p) const {
    return {-s * p.x() + c * p.y(), -c * p.x() - s * p.y(), 0};
  }
  Eigen::Matrix3d wobble() const { return x * y; }                      // W
  Eigen::Matrix3d wobble_by_x() const { return generator(0) * x * y; }  // dW / dw_x
  Eigen::Matrix3d wobble_by_y() const { return x * generator(1) * y; }

  double c, s;
  Eigen::Matrix<double, 2, 6> by = Eigen::Matrix<double, 2, 6>::Zero();
  Eigen::Vector2d w = Eigen::Vector2d::Zero(), w_slope = Eigen::Vector2d::Zero();
  Eigen::Matrix3d x = Eigen::Matrix3d::Identity(), y = x;
};

LineModel::LineModel(const RotatingLine& line, double seam) : LineBase(line, seam) {
  const Eigen::Matrix3d turn_x = about_x(line.tilt_x_rad), turn_y = about_y(line.tilt_y_rad);
  array_ = turn_y * turn_x;
  d_tilt_x_ = array_ * generator(0);
  d_tilt_y_ = generator(1) * array_;
  tumbles_ = false;
  for (const double t : line.tumbling_rad) tumbles_ = tumbles_ || t != 0;
}

Camera LineModel::with_parameters(const Eigen::VectorXd& values) const {
  return Camera::rotating_line(with_values(values)).with_seam_at(seam_);
}

std::optional<double> LineModel::angle_of(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d n = array_.col(1);
  const double across = std::hypot(n.x(), n.y());
  const auto closed_form = [&](const Eigen::Vector3d& p) -> std::optional<double> {
    const double sine =
        (n.dot(line_.eccentricity_m) - n.z() * p.z()) / (across * std::hypot(p.x(), p.y()));
    if (!(std::abs(sine) < 1)) return std::nullopt;
    return std::atan2(p.y(), p.x()) + std::atan2(n.x(), n.y()) - std::asin(sine);
  };
  std::optional<double> theta = closed_form(point);
  if (!theta || !tumbles_) return theta;
  for (int i = 0; i < 30; ++i) {  // Newton's method: tumbling is a small turn
    const Turn turn(line_, true, *theta);
    const Eigen::Vector3d still = turn.wobble().transpose() * point;
    const Eigen::Matrix3d d_wobble =
        turn.w_slope.x() * turn.wobble_by_x() + turn.w_slope.y() * turn.wobble_by_y();
    const double error = n.dot(turn.back(still) - line_.eccentricity_m);
    const double slope = n.dot(turn.back_slope(still) + turn.back(d_wobble.transpose() * point));
    const double step = error / slope;
    if (!std::isfinite(step)) return std::nullopt;
    *theta -= step;
    if (std::abs(step) < 1e-15) return theta;
    if (std::abs(step) < 1e-13 && i > 5) return theta;  // as good as rounding allows
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> LineModel::project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                                  Camera::ParameterJacobian* d_parameters) const {
  if (!point.allFinite()) return std::nullopt;
  const std::optional<double> theta = angle_of(point);
  if (!theta) return std::nullopt;
  const Turn turn(line_, tumbles_, *theta);
  const Eigen::Matrix3d wobble = turn.wobble();
  const Eigen::Vector3d still = tumbles_ ? Eigen::Vector3d(wobble.transpose() * point) : point;
  const Eigen::Vector3d q = turn.back(still) - line_.eccentricity_m;
  const Eigen::Vector3d a = array_.transpose() * q;
  if (!(a.x() > 0)) return std::nullopt;
  const double h = a.z() / a.x();
  const std::optional<double> eta = bent(h);
  if (!eta) return std::nullopt;
  const double at = column(*theta);
  const Eigen::Vector2d pixel(at, line_.cy_px + line_.c_px * *eta);
  if (!pixel.allFinite()) return std::nullopt;
  if (!d_point && !d_parameters) return pixel;

  // a_y = 0 defines theta; what moves a otherwise moves theta and h by these:
  Eigen::Vector3d q_slope = turn.back_slope(still);
  if (tumbles_) {
    const Eigen::Matrix3d d_wobble =
        turn.w_slope.x() * turn.wobble_by_x() + turn.w_slope.y() * turn.wobble_by_y();
    q_slope += turn.back(d_wobble.transpose() * point);
  }
  const Eigen::Vector3d a_slope = array_.transpose() * q_slope;
  const Eigen::RowVector3d theta_by_a(0, -1 / a_slope.y(), 0);
  Eigen::RowVector3d h_by_a(-h / a.x(), 0, 1 / a.x());
  h_by_a += h_by_a.dot(a_slope) * theta_by_a;
  Eigen::Matrix<double, 2, 3> by_a;  // pixel by a
  const double bend = 1 / straight_slope(*eta);
  by_a << theta_by_a / line_.angle_per_px_rad, line_.c_px * bend * h_by_a;
  const Eigen::Matrix<double, 2, 3> by_q = by_a * array_.transpose();
  const Eigen::Matrix<double, 2, 3> by_still = by_q * turn.back_matrix();
  if (d_point) *d_point = tumbles_ ? Jacobian23(by_still * wobble.transpose()) : by_still;
  if (!d_parameters) return pixel;

  Camera::ParameterJacobian& d = *d_parameters;
  d.setZero(2, parameter_count());
  d(0, 0) = -at / line_.angle_per_px_rad;
  d(1, 1) = *eta;
  d(1, 2) = 1;
  d.col(3) = by_a * (d_tilt_x_.transpose() * q);
  d.col(4) = by_a * (d_tilt_y_.transpose() * q);
  d.middleCols<3>(5) = -by_q;
  const double cube = *eta * *eta * *eta;
  d(1, 8) = line_.c_px * bend * cube;
  d(1, 9) = d(1, 8) * *eta * *eta;
  Eigen::Matrix<double, 2, 2> by_w;
  by_w << by_still * (turn.wobble_by_x().transpose() * point),
      by_still * (turn.wobble_by_y().transpose() * point);
  const Turn unit = tumbles_ ? turn : Turn(line_, true, *theta);
  d.rightCols<6>() = by_w * unit.by;
  return pixel;
}

std::optional<Eigen::Vector3d> LineModel::unproject(const Eigen::Vector2d& pixel,
                                                    Jacobian32* jacobian) const {
  const double eta = (pixel.y() - line_.cy_px) / line_.c_px;
  if (!(std::abs(eta) < max_eta_)) return std::nullopt;
  const Turn turn(line_, tumbles_, pixel.x() * line_.angle_per_px_rad);
  const Eigen::Matrix3d wobble = turn.wobble();
  const Eigen::Vector3d in_array(1, 0, straight(eta));
  const double length = in_array.norm();
  const Eigen::Vector3d in_turn = array_ * in_array / length;
  const Eigen::Vector3d bearing = wobble * turn.forth(in_turn);
  if (!bearing.allFinite()) return std::nullopt;
  if (jacobian) {
    const Eigen::Vector3d sideways = turn.forth({-in_turn.y(), in_turn.x(), 0});
    Eigen::Vector3d by_theta = wobble * sideways;
    if (tumbles_)
      by_theta += (turn.w_slope.x() * turn.wobble_by_x() + turn.w_slope.y() * turn.wobble_by_y()) *
                  turn.forth(in_turn);
    const Eigen::Vector3d up = array_.col(2) * (straight_slope(eta) / (line_.c_px * length));
    jacobian->col(0) = by_theta * line_.angle_per_px_rad;
    const Eigen::Vector3d by_row = wobble * turn.forth(up);
    jacobian->col(1) = by_row - bearing * bearing.dot(by_row);
  }
  return bearing.normalized();
}

Eigen::Vector3d LineModel::origin(const Eigen::Vector2d& pixel) const {
  const Turn turn(line_, tumbles_, pixel.x() * line_.angle_per_px_rad);
  return turn.wobble() * turn.forth(line_.eccentricity_m);
}

}  // namespace occ
