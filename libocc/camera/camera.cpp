// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/camera.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "libocc/camera/brown.hpp"
#include "libocc/camera/double_sphere.hpp"
#include "libocc/camera/equirectangular.hpp"
#include "libocc/camera/fisheye.hpp"
#include "libocc/camera/internal/line_model.hpp"
#include "libocc/camera/pinhole.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::camera;

Camera::Camera(CameraModel::Pointer model) : model_(std::move(model)) {}

Camera Camera::pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                       double cy_px, const std::vector<double>& distortion, double skew_px) {
  const CameraMatrix matrix{fx_px, fy_px, cx_px, cy_px, skew_px};
  return Camera(std::make_shared<PinholeModel>(width, height, matrix, distortion));
}

Camera Camera::fisheye(int width, int height, double fx_px, double fy_px, double cx_px,
                       double cy_px, const std::vector<double>& distortion, double skew_px) {
  const CameraMatrix matrix{fx_px, fy_px, cx_px, cy_px, skew_px};
  return Camera(std::make_shared<FisheyeModel>(width, height, matrix, distortion));
}

Camera Camera::double_sphere(int width, int height, double fx_px, double fy_px, double cx_px,
                             double cy_px, double xi, double alpha) {
  const CameraMatrix matrix{fx_px, fy_px, cx_px, cy_px, 0};
  return Camera(std::make_shared<DoubleSphereModel>(width, height, matrix, xi, alpha));
}

Camera Camera::brown_forward(int width, int height, double fx_px, double fy_px, double cx_px,
                             double cy_px, const std::vector<double>& distortion, double unit_px,
                             double r0, double skew_px) {
  const CameraMatrix matrix{fx_px, fy_px, cx_px, cy_px, skew_px};
  return Camera(std::make_shared<BrownModel>(CameraKind::brown_forward, width, height, matrix,
                                             distortion, unit_px, r0));
}

Camera Camera::brown_backward(int width, int height, double fx_px, double fy_px, double cx_px,
                              double cy_px, const std::vector<double>& distortion, double unit_px,
                              double r0, double skew_px) {
  const CameraMatrix matrix{fx_px, fy_px, cx_px, cy_px, skew_px};
  return Camera(std::make_shared<BrownModel>(CameraKind::brown_backward, width, height, matrix,
                                             distortion, unit_px, r0));
}

// Columns of panoramas are counted from the left edge of the first pixel, -0.5.
Camera Camera::equirectangular(int width, int height, double angle_per_px_rad, double fy_px,
                               double cx_px, double cy_px) {
  return Camera(std::make_shared<EquirectangularModel>(width, height, angle_per_px_rad, fy_px,
                                                       cx_px, cy_px, -0.5));
}

Camera Camera::rotating_line(const RotatingLine& line) {
  return Camera(std::make_shared<LineModel>(line, -0.5));
}

Camera Camera::rotating_line_first_order(const RotatingLine& line) {
  return Camera(std::make_shared<FirstOrderLineModel>(line, -0.5));
}

Camera Camera::with_parameters(const Eigen::VectorXd& values) const {
  const int expected = model_->parameter_count();
  require(values.size() == expected, "values' length", values.size(), std::to_string(expected));
  return with_model(model_->with_parameters(values));
}

// The model has the parameters of this one, or the first of them.
Camera Camera::with_model(CameraModel::Pointer model) const {
  Camera changed(std::move(model));
  const Eigen::Index count = changed.model_->parameter_count();
  if (!errors_ || count == errors_->covariance.rows()) {
    changed.errors_ = errors_;
    return changed;
  }
  return changed.with_parameter_covariance(errors_->covariance.topLeftCorner(count, count));
}

Camera Camera::without_distortion() const {
  CameraModel::Pointer model = model_->without_distortion();
  return model ? with_model(std::move(model)) : *this;
}

Camera Camera::with_seam_at(double column) const {
  require(std::isfinite(column), "column", column, "finite");
  CameraModel::Pointer model = model_->with_seam_at(column);
  return model ? with_model(std::move(model)) : *this;
}

const RotatingLine& Camera::line() const {
  const RotatingLine* line = model_->line();
  if (line) return *line;
  throw std::logic_error(std::string("a ") + name_of(kind()) + " camera is not a rotating line");
}

Eigen::Vector2d Camera::difference_px(const Eigen::Vector2d& to,
                                      const Eigen::Vector2d& from) const {
  Eigen::Vector2d difference = to - from;
  const double period = period_px();
  if (std::isfinite(period)) difference.x() = std::remainder(difference.x(), period);
  return difference;
}

Eigen::Matrix3d Camera::matrix() const {
  const CameraMatrix& m = model_->matrix();
  Eigen::Matrix3d k;
  k << m.fx, m.skew, m.cx, 0, m.fy, m.cy, 0, 0, 1;
  return k;
}

std::optional<Ray> Camera::ray(const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> direction = unproject(pixel);
  if (!direction) return std::nullopt;
  return Ray{model_->origin(pixel), *direction};
}

bool Camera::contains(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= -0.5 && pixel.x() < width() - 0.5 && pixel.y() >= -0.5 &&
         pixel.y() < height() - 0.5;
}

}  // namespace occ
