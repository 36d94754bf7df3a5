// SPDX-License-Identifier: Apache-2.0
// A camera: pixel of a point in the camera frame, and ray of a pixel. It holds one model of any
// kind; equation, domain and source of each model are in its own header:
//
//   pinhole with OpenCV's lens distortion              libocc/camera/pinhole.hpp
//   fisheye (Kannala, Brandt)                          libocc/camera/fisheye.hpp
//   double sphere (Usenko, Demmel, Cremers)            libocc/camera/double_sphere.hpp
//   pinhole with Brown's distortion, two forms         libocc/camera/brown.hpp
//   equirectangular panorama                           libocc/camera/equirectangular.hpp
//   rotating line, exact and in its first-order form   libocc/camera/rotating_line.hpp
//
// Frames: x right, y down, z forward (of a rotating line: z down along its axis). Pixel (0, 0) is
// the centre of the first pixel. Outside a model's domain `project` and `unproject` return nothing.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Ray of a pixel in the camera frame.
struct Ray {
  Eigen::Vector3d origin;     ///< [m]; zero for a camera with one projection centre
  Eigen::Vector3d direction;  ///< unit
};

/// Name of a change of both focal lengths, fx_px and fy_px, that keeps their ratio; its unit is
/// that of fx_px.
inline constexpr const char* common_focal_length = "f_px";

/// Camera of any model; immutable and cheap to copy.
class LIBOCC_API Camera {
 public:
  /// Upper limit of parameters().size() for any model.
  static constexpr int max_parameters = CameraModel::max_parameters;
  /// Derivative of a pixel by all parameters; 2 x parameters().size().
  using ParameterJacobian = CameraModel::ParameterJacobian;

  /// The factories throw std::invalid_argument naming the argument. Sizes and focal lengths must be
  /// positive, every number finite; pinhole: 0, 4, 5, 8, 12 or 14 distortion coefficients, tilts
  /// within pi/2; fisheye: at most 4 coefficients; double sphere: xi in (-1, 1], alpha in [0, 1];
  /// brown: 0 or 7 coefficients, unit_px > 0, r0 >= 0.
  static Camera pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                        double cy_px, const std::vector<double>& distortion = {},
                        double skew_px = 0);
  /// Kannala and Brandt's model with up to four coefficients k1 to k4; see fisheye.hpp.
  static Camera fisheye(int width, int height, double fx_px, double fy_px, double cx_px,
                        double cy_px, const std::vector<double>& distortion = {},
                        double skew_px = 0);
  /// Double sphere model; see double_sphere.hpp.
  static Camera double_sphere(int width, int height, double fx_px, double fy_px, double cx_px,
                              double cy_px, double xi, double alpha);
  /// Pinhole with Brown's distortion a1 a2 a3 b1 b2 c1 c2 as a function of ideal coordinates in
  /// units of unit_px pixels; see brown.hpp.
  static Camera brown_forward(int width, int height, double fx_px, double fy_px, double cx_px,
                              double cy_px, const std::vector<double>& distortion, double unit_px,
                              double r0 = 0, double skew_px = 0);
  /// brown_forward() with the distortion as a function of measured coordinates.
  static Camera brown_backward(int width, int height, double fx_px, double fy_px, double cx_px,
                               double cy_px, const std::vector<double>& distortion, double unit_px,
                               double r0 = 0, double skew_px = 0);
  /// Full panorama; fy_px: pixels per radian of latitude. See equirectangular.hpp.
  static Camera equirectangular(int width, int height, double angle_per_px_rad, double fy_px,
                                double cx_px, double cy_px);
  /// Rotating line camera, exact form; see rotating_line.hpp.
  static Camera rotating_line(const RotatingLine& line);
  /// The first-order form, for comparison: see rotating_line.hpp.
  static Camera rotating_line_first_order(const RotatingLine& line);

  // Without move operations, so that a camera always has a model.
  Camera(const Camera&) = default;
  Camera& operator=(const Camera&) = default;

  /// This camera without the coefficients of `distortion()`.
  Camera without_distortion() const;

  /// Model that the camera holds.
  CameraKind kind() const { return model_->kind(); }
  /// True for the pinhole model, with or without lens distortion.
  bool is_pinhole() const { return kind() == CameraKind::pinhole; }
  /// True if all rays meet in one point, the origin of the camera frame.
  bool is_central() const { return model_->is_central(); }
  int width() const { return model_->width(); }    ///< [px]
  int height() const { return model_->height(); }  ///< [px]
  /// Focal lengths; of a panorama: pixels per radian at the horizon, along and across.
  double fx_px() const { return model_->matrix().fx; }
  /// Focal length along the columns; of a rotating line: pixels per radian across.
  double fy_px() const { return model_->matrix().fy; }
  /// Principal point; of a rotating line: pixel of the camera's X axis.
  double cx_px() const { return model_->matrix().cx; }
  /// Row of the principal point; of a rotating line: row of the horizon.
  double cy_px() const { return model_->matrix().cy; }
  /// Skew of the pixel grid: d column / d y' on the plane z = 1; 0 for most cameras.
  double skew_px() const { return model_->matrix().skew; }
  /// Coefficients in the model's order; empty without distortion.
  const std::vector<double>& distortion() const { return model_->distortion(); }
  Eigen::Matrix3d matrix() const;  ///< K

  /// Parameters of a rotating line; throws std::logic_error for any other kind.
  const RotatingLine& line() const;

  /// Largest angle from the optical axis inside the domain [rad]; without a limit pi (pinhole:
  /// pi/2). For a rotating line, which has no optical axis: largest angle from its horizon.
  double max_angle_rad() const { return model_->max_angle_rad(); }

  /// All parameters, in the order of `with_parameters` and of `d_parameters`.
  std::vector<CameraParameter> parameters() const { return model_->parameters(); }
  /// Numbers of the model that adjustments never change, such as unit_px and r0 of Brown's.
  std::vector<CameraParameter> constants() const { return model_->constants(); }
  /// This camera with other values; throws std::invalid_argument as the factories do.
  Camera with_parameters(const Eigen::VectorXd& values) const;

  /// True if no errors of the parameters are stated.
  bool is_exact() const { return !errors_; }
  /// Covariance of the errors of parameters(); zero if the camera is exact.
  Eigen::MatrixXd parameter_covariance() const;
  /// Standard deviations of the parameters that are not exact, if their errors are independent.
  std::optional<std::map<std::string, double>> independent_sigmas() const;
  /// Matrix R with R R^T = parameter_covariance(); no columns if the camera is exact.
  Eigen::MatrixXd root_of_covariance() const;
  /// This camera with a covariance of its parameters. Throws std::invalid_argument if it is not
  /// symmetric and positive semidefinite of parameters().size() rows.
  Camera with_parameter_covariance(const Eigen::MatrixXd& covariance) const;
  /// This camera with independent errors of the parameters with these names and standard
  /// deviations; f_px is an error of both focal lengths that keeps their ratio, in pixels of fx_px.
  /// Distortion coefficients of a pinhole or fisheye model that the camera does not
  /// have are added with the value zero. Throws std::invalid_argument for a name that the model
  /// does not have, for a sigma that is negative or not finite, and if all are zero.
  Camera with_parameter_sigmas(const std::map<std::string, double>& sigmas) const;

  /// Pixel of a point in the camera frame [m], or nothing outside the domain. The pixel may lie
  /// outside the image; see `contains`. `jacobian` (2x3, optional): d pixel / d point.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam,
                                         Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const {
    return model_->project(point_in_cam, jacobian, nullptr);
  }

  /// Also returns the derivative by every parameter (2 x parameters().size()).
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam,
                                         Eigen::Matrix<double, 2, 3>* d_point,
                                         ParameterJacobian* d_parameters) const {
    return model_->project(point_in_cam, d_point, d_parameters);
  }

  /// Unit bearing of a pixel, or nothing outside the domain. `jacobian` (3x2, optional): d bearing
  /// / d pixel. project(unproject(p)) == p to 1e-9 px if the camera is central.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Eigen::Matrix<double, 3, 2>* jacobian = nullptr) const {
    if (!pixel.allFinite()) return std::nullopt;
    return model_->unproject(pixel, jacobian);
  }

  /// Ray of a pixel, or nothing outside the domain. project(origin + length * direction) is the
  /// pixel for any length > 0, except for the first-order form of the rotating line.
  std::optional<Ray> ray(const Eigen::Vector2d& pixel) const;

  /// Number of columns after which the image repeats itself: 2 pi over the angle per column of a
  /// panorama (rotating line, equirectangular), infinite otherwise.
  double period_px() const { return model_->period_px(); }

  /// to - from, the shorter way around if the image repeats itself.
  Eigen::Vector2d difference_px(const Eigen::Vector2d& to, const Eigen::Vector2d& from) const;

  /// This camera with columns counted from `column` to `column` + period_px() (default: from -0.5).
  Camera with_seam_at(double column) const;

  /// Distance of a point along the aperture's direction of view, on which foreshortening depends: Z
  /// for a pinhole; the distance from the axis for a rotating line; the distance for the others,
  /// whose pupil follows the ray. `gradient` (optional): d depth / d point.
  double depth_m(const Eigen::Vector3d& point_in_cam, Eigen::Vector3d* gradient = nullptr) const {
    return model_->depth_m(point_in_cam, gradient);
  }

  /// True if a pixel lies on the sensor: -0.5 <= x < width - 0.5, and y likewise.
  bool contains(const Eigen::Vector2d& pixel) const;

 private:
  explicit Camera(CameraModel::Pointer model);
  Camera with_model(CameraModel::Pointer model) const;

  CameraModel::Pointer model_;  // never null
  struct Errors {
    Eigen::MatrixXd covariance, root;
  };
  std::shared_ptr<const Errors> errors_;  // null if the camera is exact
};

}  // namespace occ
