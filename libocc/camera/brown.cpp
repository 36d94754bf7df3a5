// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/brown.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/camera/internal/polynomial.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::camera;
namespace {

constexpr const char* brown_coefficient_names[] = {"a1", "a2", "a3", "b1", "b2", "c1", "c2"};

/// Powers of s that convert coefficients to coordinates on the plane z = 1.
constexpr std::array<int, 7> powers{2, 4, 6, 1, 1, 0, 0};

double power(double base, int exponent) {
  double product = 1;
  for (int i = 0; i < exponent; ++i) product *= base;
  return product;
}

}  // namespace

BrownModel::BrownModel(CameraKind kind, int width, int height, const CameraMatrix& matrix,
                       const std::vector<double>& distortion, double unit_px, double r0)
    : CameraModel(kind, width, height, matrix, distortion),
      unit_px_(unit_px),
      r0_(r0),
      max_radius_(infinity) {
  require_size_and_matrix();
  const std::size_t n = distortion.size();
  require(n == 0 || n == 7, "distortion's length", n, "0 or 7");
  require(unit_px > 0 && std::isfinite(unit_px), "unit_px", unit_px, "positive and finite");
  require(r0 >= 0 && std::isfinite(r0), "r0", r0, "zero or positive, and finite");
  const double s = matrix_.fx / unit_px_;
  for (std::size_t i = 0; i < n; ++i) {
    require(std::isfinite(distortion[i]), "distortion[" + std::to_string(i) + "]", distortion[i],
            "finite");
    k_[i] = distortion[i] * power(s, powers[i]);
  }
  const double balanced = r0_ * r0_ / (s * s);
  centre_ = 1 - balanced * (k_[0] + balanced * (k_[1] + balanced * k_[2]));
  require(centre_ > 0 && std::isfinite(centre_), "distortion's scale at the centre", centre_,
          "positive");
  const Polynomial growth{centre_, 3 * k_[0], 5 * k_[1], 7 * k_[2]};  // in r^2
  constexpr double limit = 1e12;  // r = 1e6: within 1e-6 rad of a right angle
  const std::vector<double> ends = sign_changes(growth, limit);
  if (!ends.empty()) max_radius_ = std::sqrt(ends.front());
}

std::vector<CameraParameter> BrownModel::parameters() const {
  std::vector<CameraParameter> all{{"fx_px", "px", matrix_.fx},
                                   {"fy_px", "px", matrix_.fy},
                                   {"cx_px", "px", matrix_.cx},
                                   {"cy_px", "px", matrix_.cy},
                                   {"skew_px", "px", matrix_.skew}};
  for (std::size_t i = 0; i < distortion_.size(); ++i)
    all.push_back({brown_coefficient_names[i], "1", distortion_[i]});
  return all;
}

std::vector<CameraParameter> BrownModel::constants() const {
  return {{"unit_px", "px", unit_px_}, {"r0", "1", r0_}};
}

CameraModel::Pointer BrownModel::with_parameters(const Eigen::VectorXd& v) const {
  return std::make_shared<BrownModel>(kind_, width_, height_,
                                      CameraMatrix{v[0], v[1], v[2], v[3], v[4]},
                                      std::vector<double>(v.begin() + 5, v.end()), unit_px_, r0_);
}

CameraModel::Pointer BrownModel::without_distortion() const {
  if (distortion_.empty()) return nullptr;
  return std::make_shared<BrownModel>(kind_, width_, height_, matrix_, std::vector<double>{},
                                      unit_px_, r0_);
}

double BrownModel::max_angle_rad() const {
  if (!(max_radius_ < infinity)) return pi / 2;
  return std::atan(is_forward() ? max_radius_ : radial(max_radius_));
}

double BrownModel::depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  if (gradient) *gradient = Eigen::Vector3d::UnitZ();
  return point.z();
}

double BrownModel::radial(double r) const {
  const double t = r * r;
  return r * (centre_ + t * (k_[0] + t * (k_[1] + t * k_[2])));
}

double BrownModel::radial_slope(double r) const {
  const double t = r * r;
  return centre_ + t * (3 * k_[0] + t * (5 * k_[1] + t * 7 * k_[2]));
}

Eigen::Vector2d BrownModel::polynomial(const Eigen::Vector2d& p, Eigen::Matrix2d* jacobian) const {
  const double x = p.x(), y = p.y(), t = x * x + y * y;
  const double factor = centre_ + t * (k_[0] + t * (k_[1] + t * k_[2]));
  const double slope = k_[0] + t * (2 * k_[1] + t * 3 * k_[2]);  // d factor / d t
  const double b1 = k_[3], b2 = k_[4], c1 = k_[5], c2 = k_[6];
  if (jacobian) {
    const double mixed = 2 * (x * y * slope + b1 * y + b2 * x);
    *jacobian << factor + 2 * x * x * slope + 6 * b1 * x + 2 * b2 * y + c1, mixed + c2,  //
        mixed, factor + 2 * y * y * slope + 2 * b1 * x + 6 * b2 * y;
  }
  return {x * (factor + c1) + b1 * (t + 2 * x * x) + 2 * b2 * x * y + c2 * y,
          y * factor + 2 * b1 * x * y + b2 * (t + 2 * y * y)};
}

BrownModel::Coefficients BrownModel::by_coefficients(const Eigen::Vector2d& p) const {
  const double x = p.x(), y = p.y(), t = x * x + y * y, s = matrix_.fx / unit_px_;
  const double t0 = r0_ * r0_ / (s * s);
  Coefficients d;
  d << (t - t0) * x, (t * t - t0 * t0) * x, (t * t * t - t0 * t0 * t0) * x, t + 2 * x * x,
      2 * x * y, x, y,  //
      (t - t0) * y, (t * t - t0 * t0) * y, (t * t * t - t0 * t0 * t0) * y, 2 * x * y, t + 2 * y * y,
      0, 0;
  for (int i = 0; i < 7; ++i) d.col(i) *= power(s, powers[i]);
  return d;
}

bool BrownModel::inside(const Eigen::Vector2d& p, const Eigen::Matrix2d& jacobian) const {
  return p.norm() < max_radius_ && jacobian.determinant() > 0;
}

// The radial part, inverted by Newton's method inside a bracket, is the start of Newton's method in
// the plane.
std::optional<Eigen::Vector2d> BrownModel::inverse(const Eigen::Vector2d& value,
                                                   Eigen::Matrix2d& jacobian) const {
  const double target = value.norm();
  if (!(target < infinity)) return std::nullopt;
  double low = 0, high = max_radius_, r = std::min(target, 0.5 * max_radius_);
  for (int i = 0; i < 100; ++i) {
    const double error = radial(r) - target;
    (error < 0 ? low : high) = r;
    if (std::abs(error) <= 1e-15 * target) break;
    const double next = r - error / radial_slope(r);
    const double middle = high < infinity ? low + (high - low) / 2 : 2 * std::max(low, target);
    const double before = r;
    r = next > low && next < high ? next : middle;
    if (r == before) break;
  }
  Eigen::Vector2d point = value * (target > 0 ? r * (1 - 1e-12) / target : 0);
  const double enough = 1e-13 * (1 + target);  // some roundings; of a pixel for f = 5000 px: 1e-9
  double before = infinity;
  for (int i = 0; i < 60; ++i) {  // slow near the domain's edge, where the root is nearly double
    const Eigen::Vector2d error = polynomial(point, &jacobian) - value;
    const double size = error.norm();
    if (size <= enough && size >= 0.1 * before) break;  // only rounding is left
    before = size;
    Eigen::Vector2d step = jacobian.inverse() * error;
    if (!step.allFinite()) return std::nullopt;
    for (int j = 0; j < 64 && !((point - step).norm() < max_radius_); ++j) step /= 2;
    point -= step;
  }
  const Eigen::Vector2d error = polynomial(point, &jacobian) - value;
  if (!(inside(point, jacobian) && error.norm() <= enough)) return std::nullopt;
  return point;
}

std::optional<Eigen::Vector2d> BrownModel::project(const Eigen::Vector3d& point,
                                                   PointJacobian* d_point,
                                                   ParameterJacobian* d_parameters) const {
  if (!(point.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / point.z();
  const Eigen::Vector2d ideal = point.head<2>() * inverse_z;
  if (!ideal.allFinite()) return std::nullopt;
  Eigen::Matrix2d jacobian;  // of B
  Eigen::Vector2d measured;
  if (is_forward()) {
    measured = polynomial(ideal, &jacobian);
    if (!inside(ideal, jacobian)) return std::nullopt;
  } else {
    const std::optional<Eigen::Vector2d> found = inverse(ideal, jacobian);
    if (!found) return std::nullopt;
    measured = *found;
  }
  const Eigen::Vector2d pixel = matrix_.to_px(measured);
  if (!pixel.allFinite()) return std::nullopt;
  if (!d_point && !d_parameters) return pixel;
  const Eigen::Matrix2d d_ideal =
      matrix_.d_px() * (is_forward() ? jacobian : Eigen::Matrix2d(jacobian.inverse()));
  if (d_point) {
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << inverse_z, 0, -ideal.x() * inverse_z, 0, inverse_z, -ideal.y() * inverse_z;
    *d_point = d_ideal * by_point;
  }
  if (d_parameters) {
    const double x = measured.x(), y = measured.y();
    d_parameters->resize(2, parameter_count());
    d_parameters->leftCols<5>() << x, 0, 1, 0, y, 0, y, 0, 1, 0;
    if (distortion_.empty()) return pixel;
    // Coordinates in the unit of the coefficients grow with fx_px: B(s p) / s depends on s.
    d_parameters->col(0) += (d_ideal * ideal - matrix_.d_px() * measured) / matrix_.fx;
    if (is_forward())
      d_parameters->rightCols<7>() = matrix_.d_px() * by_coefficients(ideal);
    else
      d_parameters->rightCols<7>() = -d_ideal * by_coefficients(measured);
  }
  return pixel;
}

std::optional<Eigen::Vector3d> BrownModel::unproject(const Eigen::Vector2d& pixel,
                                                     PixelJacobian* jacobian) const {
  const Eigen::Vector2d measured = matrix_.from_px(pixel);
  Eigen::Matrix2d of_polynomial;
  Eigen::Vector2d ideal;
  if (is_forward()) {
    const std::optional<Eigen::Vector2d> found = inverse(measured, of_polynomial);
    if (!found) return std::nullopt;
    ideal = *found;
  } else {
    ideal = polynomial(measured, &of_polynomial);
    if (!ideal.allFinite() || !inside(measured, of_polynomial)) return std::nullopt;
  }
  const double length = std::sqrt(ideal.squaredNorm() + 1);
  const Eigen::Vector3d bearing = Eigen::Vector3d(ideal.x(), ideal.y(), 1) / length;
  if (!(bearing.z() > 0)) return std::nullopt;
  if (jacobian) {
    const Eigen::Matrix3d across =
        (Eigen::Matrix3d::Identity() - bearing * bearing.transpose()) / length;
    const Eigen::Matrix2d d_measured =
        is_forward() ? Eigen::Matrix2d(of_polynomial.inverse()) : of_polynomial;
    *jacobian = across.leftCols<2>() * d_measured * matrix_.d_plane();
  }
  return bearing;
}

}  // namespace occ
