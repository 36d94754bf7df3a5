// SPDX-License-Identifier: Apache-2.0
// The rotating line camera, exact and in first-order form; equations in rotating_line.hpp.
#pragma once

#include "libocc/camera/internal/model.hpp"
#include "libocc/camera/rotating_line.hpp"

namespace occ::internal::camera {

/// What both forms share: parameters and the array's distortion.
class LineBase : public CameraModel {
 public:
  LineBase(const RotatingLine& line, double seam);
  const RotatingLine& line() const { return line_; }
  std::vector<CameraParameter> parameters() const override;
  double max_angle_rad() const override;
  bool is_central() const override { return line_.eccentricity_m.isZero(0); }

 protected:
  static constexpr int tumbling_at = 10;  // index of the first tumbling parameter
  int parameter_count() const { return static_cast<int>(tumbling_at + line_.tumbling_rad.size()); }
  RotatingLine with_values(const Eigen::VectorXd& values) const;

  double straight(double eta) const {
    return eta - eta * eta * eta * (line_.k1 + line_.k2 * eta * eta);
  }
  double straight_slope(double eta) const {
    return 1 - eta * eta * (3 * line_.k1 + 5 * line_.k2 * eta * eta);
  }
  /// eta of an undistorted h, or nothing beyond the domain.
  std::optional<double> bent(double h) const;
  /// Column of an angle [rad], after the seam.
  double column(double theta) const;

  RotatingLine line_;
  double seam_;
  double max_eta_;
};

class LineModel final : public LineBase {
 public:
  LineModel(const RotatingLine& line, double seam);
  Camera with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                         Camera::ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Jacobian32* jacobian) const override;
  Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const override;

 private:
  struct Turn;
  struct Wobble;
  /// The turntable's angle at which the array sees the point, or nothing.
  std::optional<Turn> turn_of(const Eigen::Vector3d& point) const;
  std::optional<Turn> plain_turn(const Eigen::Vector3d& point) const;

  Eigen::Matrix3d array_;  // R_Y(ly) R_X(lx)
  Eigen::Matrix3d d_tilt_x_, d_tilt_y_;
  bool tumbles_;
};

class FirstOrderLineModel final : public LineBase {
 public:
  using LineBase::LineBase;
  Camera with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                         Camera::ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Jacobian32* jacobian) const override;
  Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const override;
};

}  // namespace occ::internal::camera
