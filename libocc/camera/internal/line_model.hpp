// SPDX-License-Identifier: Apache-2.0
// Models of the rotating line camera, exact and in first-order form; equations in
// rotating_line.hpp.
#pragma once

#include "libocc/camera/model.hpp"
#include "libocc/camera/rotating_line.hpp"

namespace occ::internal::camera {

/// Shared by both forms: parameters, distortion along the array, seam.
class LineBase : public CameraModel {
 public:
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return first_tumbling + 6; }
  double max_angle_rad() const override;
  bool is_central() const override { return line_.eccentricity_m.isZero(0); }
  /// Distance from the turntable's axis.
  double depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const override;
  const RotatingLine* line() const override { return &line_; }

 protected:
  static constexpr int first_tumbling = 10;  // index of the first tumbling parameter

  /// Throws std::invalid_argument naming the field; replaces an angle of 0 by 2 pi / width. Columns
  /// are counted from `seam`.
  LineBase(CameraKind kind, const RotatingLine& line, double seam);
  RotatingLine with_values(const Eigen::VectorXd& values) const;

  /// h of an array position eta, and its derivative.
  double undistorted(double eta) const {
    return eta - eta * eta * eta * (line_.k1 + line_.k2 * eta * eta);
  }
  double undistorted_slope(double eta) const {
    return 1 - eta * eta * (3 * line_.k1 + 5 * line_.k2 * eta * eta);
  }
  /// eta of an undistorted h, or nothing outside the domain.
  std::optional<double> distorted(double h) const;
  /// Column of an angle [rad] of the turntable, counted from the seam.
  double column(double theta) const;

  RotatingLine line_;
  double seam_;
  double max_eta_;

 private:
  struct Checked {
    RotatingLine line;
  };
  static Checked checked(RotatingLine line);
  LineBase(CameraKind kind, const Checked& checked, double seam);
};

class LineModel final : public LineBase {
 public:
  LineModel(const RotatingLine& line, double seam);
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const override;
  Pointer with_seam_at(double column) const override;

 private:
  struct Turntable;
  struct Tumbling;
  /// The turntable's angle at which the array observes the point, or nothing.
  std::optional<Turntable> turntable_at(const Eigen::Vector3d& point) const;
  std::optional<Turntable> turntable_without_tumbling(const Eigen::Vector3d& point) const;

  Eigen::Matrix3d array_;  // R_Y(ly) R_X(lx)
  Eigen::Matrix3d d_tilt_x_, d_tilt_y_;
  bool tumbles_;
};

class FirstOrderLineModel final : public LineBase {
 public:
  FirstOrderLineModel(const RotatingLine& line, double seam);
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const override;
  Pointer with_seam_at(double column) const override;
};

}  // namespace occ::internal::camera
