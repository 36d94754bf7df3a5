// SPDX-License-Identifier: Apache-2.0
// The camera's geometry: where a point of the camera's frame appears, along which ray a pixel
// looks. Pinhole with OpenCV's lens distortion:
//
//   (x, y) = (X/Z, Y/Z),  r^2 = x^2 + y^2
//   radial = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
//   x' = x radial + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
//   y' = y radial + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
//   then the tilted-sensor homography of (tau_x, tau_y), then u = fx x' + skew y' + cx, v = fy y' +
//   cy.
//
// Coefficients in OpenCV's order k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]: 0, 4, 5,
// 8, 12 or 14 of them. Source: OpenCV 4.6 documentation, module calib3d, "Detailed Description".
// Domain: Z > 0 and r below the first radius at which the distorted radius stops growing (beyond it
// two rays would share a pixel). Outside it `project` and `unproject` return nothing.
//
// Fisheye (Kannala and Brandt, "A generic camera model ...", PAMI 28(8), 2006, eq. 6, as OpenCV has
// it): r = hypot(X, Y), a = atan2(r, Z), d = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8),
// (x', y') = d/r (X, Y). Domain: a below pi and below the first angle at which d stops growing.
//
// Double sphere (Usenko, Demmel, Cremers, "The double sphere camera model", 3DV 2018, eqs 40-45).
//
// Rotating line camera: libocc/camera/rotating_line.hpp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

namespace internal::camera {
class CameraModel;
}
struct RotatingLine;

enum class CameraKind { pinhole, fisheye, double_sphere, rotating_line, rotating_line_first_order };

LIBOCC_API const char* name_of(CameraKind kind);

struct CameraParameter {
  std::string name;
  std::string unit;  ///< "px", "rad", "m" or "1"
  double value = 0;
  bool is_length = false;  ///< a length in the scene, which a change of its scale changes too
};

/// Where a pixel's ray starts and where it goes, in the camera's frame.
struct Ray {
  Eigen::Vector3d origin;     ///< [m]; zero for a camera with one centre
  Eigen::Vector3d direction;  ///< unit
};

class LIBOCC_API Camera {
 public:
  static constexpr int max_parameters = 20;
  using ParameterJacobian =
      Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, max_parameters>;

  /// These throw std::invalid_argument naming the argument: sizes and focal lengths must be
  /// positive, every number finite, distortion of 0, 4, 5, 8, 12 or 14 coefficients, tilts within
  /// pi/2; fisheye: at most 4 coefficients; double sphere: xi in (-1, 1], alpha in [0, 1].
  static Camera pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                        double cy_px, const std::vector<double>& distortion = {},
                        double skew_px = 0);
  static Camera fisheye(int width, int height, double fx_px, double fy_px, double cx_px,
                        double cy_px, const std::vector<double>& distortion = {},
                        double skew_px = 0);
  static Camera double_sphere(int width, int height, double fx_px, double fy_px, double cx_px,
                              double cy_px, double xi, double alpha);
  static Camera rotating_line(const RotatingLine& line);
  /// The first-order form, for comparison: see rotating_line.hpp.
  static Camera rotating_line_first_order(const RotatingLine& line);

  /// Without the coefficients of `distortion()`; a camera that has none is itself.
  Camera without_distortion() const;

  Camera() : Camera(pinhole(640, 480, 500, 500, 319.5, 239.5)) {}

  CameraKind kind() const { return kind_; }
  bool is_pinhole() const { return kind_ == CameraKind::pinhole; }
  /// Whether all rays meet in one point, the origin of the camera's frame.
  bool is_central() const;
  int width() const { return width_; }
  int height() const { return height_; }
  /// Focal lengths; of a rotating line: pixels per radian at the horizon, along and across.
  double fx_px() const { return fx_; }
  double fy_px() const { return fy_; }
  /// Principal point; of a rotating line: where the camera's X axis looks.
  double cx_px() const { return cx_; }
  double cy_px() const { return cy_; }
  double skew_px() const { return skew_; }
  const std::vector<double>& distortion() const { return distortion_; }
  Eigen::Matrix3d matrix() const;  ///< K

  /// The rotating line that this camera is; throws std::logic_error of any other kind.
  const RotatingLine& line() const;

  /// Largest angle from the optical axis inside the domain [rad]; pi when nothing limits it
  /// (pinhole: pi/2). A rotating line has no such axis: the largest angle from its horizon.
  double max_angle_rad() const;

  /// All parameters, in the order of `with_parameters` and of `d_parameters`.
  std::vector<CameraParameter> parameters() const;
  /// This camera with other values; throws std::invalid_argument as the factories do.
  Camera with_parameters(const Eigen::VectorXd& values) const;

  /// Pixel of a point in the camera's frame [m], or nothing outside the domain. A pixel may lie
  /// outside the image: ask `contains`. `jacobian` (2x3, optional): d pixel / d point.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam,
                                         Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const;

  /// The same, with the derivative by every parameter (2 x parameters().size()).
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam,
                                         Eigen::Matrix<double, 2, 3>* d_point,
                                         ParameterJacobian* d_parameters) const;

  /// Unit bearing of a pixel, or nothing outside the domain. `jacobian` (3x2, optional): d bearing
  /// / d pixel. project(unproject(p)) == p to 1e-9 px when the camera is central.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Eigen::Matrix<double, 3, 2>* jacobian = nullptr) const;

  /// Ray of a pixel, or nothing outside the domain: project(origin + any length * direction) is the
  /// pixel, for every camera but the first-order form.
  std::optional<Ray> ray(const Eigen::Vector2d& pixel) const;

  /// Columns after which the image repeats itself: 2 pi over the angle per column of a rotating
  /// line, infinite otherwise.
  double period_px() const;

  /// to - from, the short way around when the image repeats itself.
  Eigen::Vector2d difference_px(const Eigen::Vector2d& to, const Eigen::Vector2d& from) const;

  /// This camera with columns counted from `column` to `column` + period_px() (default: from -0.5).
  Camera with_seam_at(double column) const;

  /// How far a point lies along the direction in which the aperture looks, whose foreshortening
  /// dims it: Z of a pinhole; the distance from the axis of a rotating line; of the others, whose
  /// pupil follows the ray, the distance. `gradient` (optional): d depth / d point.
  double depth_m(const Eigen::Vector3d& point_in_cam, Eigen::Vector3d* gradient = nullptr) const;

  /// Whether a pixel lies on the sensor: -0.5 <= x < width - 0.5, and y alike.
  bool contains(const Eigen::Vector2d& pixel) const;

 private:
  struct Private {};
  explicit Camera(Private) {}
  struct CameraSize {
    int width, height;
    double fx, fy, cx, cy;
  };
  static Camera of_model(CameraKind kind, const CameraSize& size,
                         std::shared_ptr<const internal::camera::CameraModel> model);
  /// d pixel / d parameters of a pinhole, from the point on the plane z = 1 after each step.
  void differentiate(const Eigen::Vector2d& straight, const Eigen::Vector2d& bent,
                     const Eigen::Vector2d& on_sensor, const Eigen::Matrix2d& d_tilt,
                     ParameterJacobian& d_parameters) const;

  CameraKind kind_ = CameraKind::pinhole;
  int width_ = 0, height_ = 0;
  double fx_ = 0, fy_ = 0, cx_ = 0, cy_ = 0, skew_ = 0;
  std::vector<double> distortion_;
  std::array<double, 14> k_{};  // padded with zeros
  bool bends_ = false;          // some coefficient but the tilt is not zero
  bool tilted_ = false;
  Eigen::Matrix3d tilt_ = Eigen::Matrix3d::Identity();
  double max_radius_squared_ = 0;                               // of r^2, infinity when unlimited
  std::shared_ptr<const internal::camera::CameraModel> model_;  // of any kind but the pinhole
};

}  // namespace occ
