// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "libocc/camera/internal/distortion.hpp"
#include "libocc/camera/internal/double_sphere.hpp"
#include "libocc/camera/internal/fisheye.hpp"
#include "libocc/camera/internal/line_model.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::camera;

namespace {

constexpr double half_pi = 1.57079632679489661923;

void require_finite(const char* name, double value) {
  require(std::isfinite(value), name, value, "finite");
}

void require_focal_length(const char* name, double value) {
  require(value > 0 && std::isfinite(value), name, value, "positive and finite");
}

void require_distortion_finite(const std::vector<double>& distortion) {
  for (std::size_t i = 0; i < distortion.size(); ++i)
    require_finite(("distortion[" + std::to_string(i) + "]").c_str(), distortion[i]);
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

/// What all cameras but the rotating line need.
void require_matrix(int width, int height, double fx_px, double fy_px, double cx_px, double cy_px,
                    double skew_px) {
  require(width > 0, "width", width, "positive");
  require(height > 0, "height", height, "positive");
  require_focal_length("fx_px", fx_px);
  require_focal_length("fy_px", fy_px);
  require_finite("cx_px", cx_px);
  require_finite("cy_px", cy_px);
  require_finite("skew_px", skew_px);
}

bool turns(CameraKind kind) {
  return kind == CameraKind::rotating_line || kind == CameraKind::rotating_line_first_order;
}

constexpr const char* distortion_names[] = {"k1", "k2", "p1", "p2", "k3", "k4",    "k5",
                                            "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"};

}  // namespace

const char* name_of(CameraKind kind) {
  switch (kind) {
    case CameraKind::pinhole:
      return "pinhole";
    case CameraKind::fisheye:
      return "fisheye";
    case CameraKind::double_sphere:
      return "double_sphere";
    case CameraKind::rotating_line:
      return "rotating_line";
    case CameraKind::rotating_line_first_order:
      return "rotating_line_first_order";
  }
  return "";
}

Eigen::Vector3d CameraModel::origin(const Eigen::Vector2d&) const {
  return Eigen::Vector3d::Zero();
}

Camera Camera::of_model(CameraKind kind, const CameraSize& size,
                        std::shared_ptr<const CameraModel> model) {
  Camera camera{Private{}};
  camera.kind_ = kind;
  camera.width_ = size.width;
  camera.height_ = size.height;
  camera.fx_ = size.fx;
  camera.fy_ = size.fy;
  camera.cx_ = size.cx;
  camera.cy_ = size.cy;
  camera.model_ = std::move(model);
  return camera;
}

Camera Camera::fisheye(int width, int height, double fx_px, double fy_px, double cx_px,
                       double cy_px, const std::vector<double>& distortion, double skew_px) {
  require_matrix(width, height, fx_px, fy_px, cx_px, cy_px, skew_px);
  require(distortion.size() <= 4, "distortion's length", distortion.size(), "at most 4");
  require_distortion_finite(distortion);
  Camera camera =
      of_model(CameraKind::fisheye, {width, height, fx_px, fy_px, cx_px, cy_px},
               std::make_shared<FisheyeModel>(
                   width, height, PlaneMap{fx_px, fy_px, cx_px, cy_px, skew_px}, distortion));
  camera.skew_ = skew_px;
  camera.distortion_ = distortion;
  return camera;
}

Camera Camera::double_sphere(int width, int height, double fx_px, double fy_px, double cx_px,
                             double cy_px, double xi, double alpha) {
  require_matrix(width, height, fx_px, fy_px, cx_px, cy_px, 0);
  require(xi > -1 && xi <= 1, "xi", xi, "in (-1, 1]");
  require(alpha >= 0 && alpha <= 1, "alpha", alpha, "in [0, 1]");
  Camera camera = of_model(CameraKind::double_sphere, {width, height, fx_px, fy_px, cx_px, cy_px},
                           std::make_shared<DoubleSphereModel>(
                               width, height, PlaneMap{fx_px, fy_px, cx_px, cy_px, 0}, xi, alpha));
  return camera;
}

namespace {

/// The line with its default angle, after a check of every number.
RotatingLine checked(RotatingLine line) {
  require(line.width > 0, "width", line.width, "positive");
  require(line.height > 0, "height", line.height, "positive");
  if (line.angle_per_px_rad == 0) line.angle_per_px_rad = 4 * half_pi / line.width;
  require(line.angle_per_px_rad > 0 && line.angle_per_px_rad < half_pi, "angle_per_px_rad",
          line.angle_per_px_rad, "positive and below pi/2");
  require_focal_length("c_px", line.c_px);
  require_finite("cy_px", line.cy_px);
  for (const auto& [name, tilt] :
       {std::pair{"tilt_x_rad", line.tilt_x_rad}, std::pair{"tilt_y_rad", line.tilt_y_rad}})
    require(std::abs(tilt) < half_pi / 2, name, tilt, "a small tilt, within pi/4");
  require(line.eccentricity_m.allFinite(), "eccentricity_m", line.eccentricity_m.transpose(),
          "finite");
  require_finite("k1", line.k1);
  require_finite("k2", line.k2);
  for (std::size_t i = 0; i < line.tumbling_rad.size(); ++i)
    require(std::abs(line.tumbling_rad[i]) < 0.1, "tumbling_rad[" + std::to_string(i) + "]",
            line.tumbling_rad[i], "a small angle, within 0.1");
  return line;
}

}  // namespace

Camera Camera::rotating_line(const RotatingLine& given) {
  const RotatingLine line = checked(given);
  return of_model(CameraKind::rotating_line,
                  {line.width, line.height, 1 / line.angle_per_px_rad, line.c_px, 0, line.cy_px},
                  std::make_shared<LineModel>(line, -0.5));
}

Camera Camera::rotating_line_first_order(const RotatingLine& given) {
  const RotatingLine line = checked(given);
  for (const double term : line.tumbling_rad)
    require(term == 0, "tumbling_rad", term, "zero in the first-order form");
  return of_model(CameraKind::rotating_line_first_order,
                  {line.width, line.height, 1 / line.angle_per_px_rad, line.c_px, 0, line.cy_px},
                  std::make_shared<FirstOrderLineModel>(line, -0.5));
}

Camera Camera::with_seam_at(double column) const {
  require_finite("column", column);
  Camera camera = *this;
  if (kind_ == CameraKind::rotating_line)
    camera.model_ = std::make_shared<LineModel>(line(), column);
  if (kind_ == CameraKind::rotating_line_first_order)
    camera.model_ = std::make_shared<FirstOrderLineModel>(line(), column);
  return camera;
}

const RotatingLine& Camera::line() const {
  if (kind_ == CameraKind::rotating_line) return static_cast<const LineModel&>(*model_).line();
  if (kind_ == CameraKind::rotating_line_first_order)
    return static_cast<const FirstOrderLineModel&>(*model_).line();
  throw std::logic_error(std::string("a ") + name_of(kind_) + " camera is no rotating line");
}

bool Camera::is_central() const { return !model_ || model_->is_central(); }

double Camera::period_px() const {
  return turns(kind_) ? 4 * half_pi / line().angle_per_px_rad
                      : std::numeric_limits<double>::infinity();
}

Eigen::Vector2d Camera::difference_px(const Eigen::Vector2d& to,
                                      const Eigen::Vector2d& from) const {
  Eigen::Vector2d difference = to - from;
  const double period = period_px();
  if (std::isfinite(period)) difference.x() = std::remainder(difference.x(), period);
  return difference;
}

std::vector<CameraParameter> Camera::parameters() const {
  if (model_) return model_->parameters();
  std::vector<CameraParameter> all{{"fx_px", "px", fx_},
                                   {"fy_px", "px", fy_},
                                   {"cx_px", "px", cx_},
                                   {"cy_px", "px", cy_},
                                   {"skew_px", "px", skew_}};
  for (std::size_t i = 0; i < distortion_.size(); ++i)
    all.push_back({distortion_names[i], i < 12 ? "1" : "rad", distortion_[i]});
  return all;
}

Camera Camera::with_parameters(const Eigen::VectorXd& v) const {
  const auto expected =
      static_cast<Eigen::Index>(model_ ? model_->parameters().size() : 5 + distortion_.size());
  require(v.size() == expected, "values' length", v.size(), std::to_string(expected));
  if (model_) return model_->with_parameters(v);
  return pinhole(width_, height_, v[0], v[1], v[2], v[3], {v.begin() + 5, v.end()}, v[4]);
}

Camera Camera::pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                       double cy_px, const std::vector<double>& distortion, double skew_px) {
  require_matrix(width, height, fx_px, fy_px, cx_px, cy_px, skew_px);
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
  if (distortion_.empty()) return *this;
  if (kind_ == CameraKind::fisheye) return fisheye(width_, height_, fx_, fy_, cx_, cy_, {}, skew_);
  return pinhole(width_, height_, fx_, fy_, cx_, cy_, {}, skew_);
}

Eigen::Matrix3d Camera::matrix() const {
  Eigen::Matrix3d k;
  k << fx_, skew_, cx_, 0, fy_, cy_, 0, 0, 1;
  return k;
}

double Camera::max_angle_rad() const {
  if (model_) return model_->max_angle_rad();
  return std::atan(std::sqrt(max_radius_squared_));
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point_in_cam,
                                               Eigen::Matrix<double, 2, 3>* jacobian) const {
  return project(point_in_cam, jacobian, nullptr);
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point_in_cam,
                                               Eigen::Matrix<double, 2, 3>* jacobian,
                                               ParameterJacobian* d_parameters) const {
  if (model_) return model_->project(point_in_cam, jacobian, d_parameters);
  if (!(point_in_cam.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / point_in_cam.z();
  const Eigen::Vector2d straight = point_in_cam.head<2>() * inverse_z;
  Eigen::Vector2d p = straight;
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
  const Eigen::Vector2d bent = p;
  Eigen::Matrix2d d_tilt = Eigen::Matrix2d::Identity();
  if (tilted_) {
    const std::optional<Eigen::Vector2d> on_sensor =
        apply_homography(tilt_, p, jacobian || d_parameters ? &d_tilt : nullptr);
    if (!on_sensor) return std::nullopt;
    p = *on_sensor;
    if (jacobian) d_point = d_tilt * d_point;
  }
  if (jacobian) {
    jacobian->row(0) = fx_ * d_point.row(0) + skew_ * d_point.row(1);
    jacobian->row(1) = fy_ * d_point.row(1);
  }
  const Eigen::Vector2d pixel(fx_ * p.x() + skew_ * p.y() + cx_, fy_ * p.y() + cy_);
  if (!pixel.allFinite()) return std::nullopt;
  if (d_parameters) differentiate(straight, bent, p, d_tilt, *d_parameters);
  return pixel;
}

void Camera::differentiate(const Eigen::Vector2d& straight, const Eigen::Vector2d& bent,
                           const Eigen::Vector2d& on_sensor, const Eigen::Matrix2d& d_tilt,
                           ParameterJacobian& d_parameters) const {
  const auto n = static_cast<Eigen::Index>(distortion_.size());
  d_parameters.resize(2, 5 + n);
  d_parameters.leftCols<5>() << on_sensor.x(), 0, 1, 0, on_sensor.y(),  //
      0, on_sensor.y(), 0, 1, 0;
  if (n == 0) return;
  Eigen::Matrix2d k;
  k << fx_, skew_, 0, fy_;
  const Eigen::Matrix<double, 2, 12> d_lens = distort_by_coefficients(k_, straight);
  const Eigen::Index lens = std::min<Eigen::Index>(n, 12);
  d_parameters.middleCols(5, lens) = k * d_tilt * d_lens.leftCols(lens);
  if (n > 12) d_parameters.rightCols<2>() = k * tilt_by_angles(k_[12], k_[13], bent);
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel,
                                                 Eigen::Matrix<double, 3, 2>* jacobian) const {
  if (!pixel.allFinite()) return std::nullopt;
  if (model_) return model_->unproject(pixel, jacobian);
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

std::optional<Ray> Camera::ray(const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> direction = unproject(pixel);
  if (!direction) return std::nullopt;
  return Ray{model_ ? model_->origin(pixel) : Eigen::Vector3d(Eigen::Vector3d::Zero()), *direction};
}

double Camera::depth_m(const Eigen::Vector3d& point_in_cam, Eigen::Vector3d* gradient) const {
  if (is_pinhole()) {
    if (gradient) *gradient = Eigen::Vector3d::UnitZ();
    return point_in_cam.z();
  }
  Eigen::Vector3d counted = point_in_cam;
  if (turns(kind_)) counted.z() = 0;
  const double depth = counted.norm();
  if (gradient) *gradient = counted / std::max(depth, std::numeric_limits<double>::min());
  return depth;
}

bool Camera::contains(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= -0.5 && pixel.x() < width_ - 0.5 && pixel.y() >= -0.5 &&
         pixel.y() < height_ - 0.5;
}

}  // namespace occ
