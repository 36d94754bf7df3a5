// SPDX-License-Identifier: Apache-2.0
// The additive first-order form of Amiri Parian and Gruen, eqs 10-15: each term is evaluated at the
// image point as if the other terms were zero.
#include <ceres/jet.h>

#include <array>
#include <cmath>

#include "libocc/camera/internal/line_model.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::camera {

namespace {

constexpr int size = 3 + 10;  // the point and all parameters except tumbling
using Jet = ceres::Jet<double, size>;

template <typename T>
struct LineValues {
  T angle_per_px, c, cy, lx, ly, ex, ey, ez, k1, k2;
};

double value_of(double x) { return x; }
template <int n>
double value_of(const ceres::Jet<double, n>& x) {
  return x.a;
}

template <typename T, typename U>
T undistorted_h(const T& eta, const LineValues<U>& v) {
  return eta - eta * eta * eta * (v.k1 + v.k2 * eta * eta);
}

/// The ideal h of an undistorted image point: h minus dy_lx / c and dy_ly / c.
template <typename T, typename U>
T ideal_h(const T& h, const LineValues<U>& v) {
  using std::cos, std::sin, std::sqrt;
  const U sine = sin(v.lx);
  return h * cos(v.lx) / sqrt(1.0 + h * h * sine * sine) -
         sin(v.ly) * (1.0 + h * h) / (cos(v.ly) + h * sin(v.ly));
}

/// Inverts eta -> ideal h by Newton's method.
std::optional<double> eta_of(double h, const LineValues<double>& v) {
  using Scalar = ceres::Jet<double, 1>;
  double eta = h;
  for (int i = 0; i < 50; ++i) {
    const Scalar f = ideal_h(undistorted_h(Scalar(eta, 0), v), v);
    if (!(f.v[0] > 0)) return std::nullopt;
    const double step = (f.a - h) / f.v[0];
    eta -= step;
    if (std::abs(step) <= 1e-15 * (1 + std::abs(eta)) || (i > 20 && std::abs(step) < 1e-13))
      return eta;
  }
  return std::nullopt;
}

/// Ideal azimuth of a point, counted from the seam, and its ideal h.
template <typename T>
std::array<T, 2> azimuth_and_h(const LineValues<T>& v, const std::array<T, 3>& p, double seam,
                               int width) {
  using std::atan2, std::cos, std::sin, std::sqrt;
  T azimuth = atan2(p[1], p[0]);
  const double turns = std::floor(value_of(azimuth - v.angle_per_px * seam) / (2 * pi));
  azimuth = azimuth - 2 * pi * turns;
  const T nominal = azimuth / v.angle_per_px * (2 * pi / width);
  const T x = p[0] - (cos(nominal) * v.ex - sin(nominal) * v.ey);
  const T y = p[1] - (sin(nominal) * v.ex + cos(nominal) * v.ey);
  T off = atan2(y, x) - azimuth;
  off = off - 2 * pi * std::round(value_of(off) / (2 * pi));
  return {azimuth + off, (p[2] - v.ez) / sqrt(x * x + y * y)};
}

LineValues<double> values_of(const RotatingLine& l) {
  return {l.angle_per_px_rad,
          l.c_px,
          l.cy_px,
          l.tilt_x_rad,
          l.tilt_y_rad,
          l.eccentricity_m.x(),
          l.eccentricity_m.y(),
          l.eccentricity_m.z(),
          l.k1,
          l.k2};
}

LineValues<Jet> jets_of(const LineValues<double>& v) {
  return {{v.angle_per_px, 3}, {v.c, 4},  {v.cy, 5},  {v.lx, 6},  {v.ly, 7},
          {v.ex, 8},           {v.ey, 9}, {v.ez, 10}, {v.k1, 11}, {v.k2, 12}};
}

}  // namespace

FirstOrderLineModel::FirstOrderLineModel(const RotatingLine& line, double seam)
    : LineBase(CameraKind::rotating_line_first_order, line, seam) {
  for (const double term : line_.tumbling_rad)
    require(term == 0, "tumbling_rad", term, "zero in the first-order form");
}

CameraModel::Pointer FirstOrderLineModel::with_parameters(const Eigen::VectorXd& values) const {
  return std::make_shared<FirstOrderLineModel>(with_values(values), seam_);
}

CameraModel::Pointer FirstOrderLineModel::with_seam_at(double column) const {
  return std::make_shared<FirstOrderLineModel>(line_, column);
}

std::optional<Eigen::Vector2d> FirstOrderLineModel::project(const Eigen::Vector3d& point,
                                                            PointJacobian* d_point,
                                                            ParameterJacobian* d_parameters) const {
  const double reach = line_.eccentricity_m.norm();
  if (!point.allFinite() || !(point.head<2>().norm() > reach)) return std::nullopt;
  const LineValues<double> v = values_of(line_);
  const auto [azimuth, h] =
      azimuth_and_h<double>(v, {point.x(), point.y(), point.z()}, seam_, line_.width);
  const std::optional<double> eta = eta_of(h, v);
  if (!eta) return std::nullopt;
  const double sine = std::sin(v.lx);
  const double theta = azimuth + std::atan(undistorted_h(*eta, v) * sine);
  const Eigen::Vector2d pixel(column(theta), v.cy + v.c * *eta);
  if (!pixel.allFinite()) return std::nullopt;
  if (!d_point && !d_parameters) return pixel;

  const LineValues<Jet> j = jets_of(v);
  const auto [jet_azimuth, jet_h] = azimuth_and_h<Jet>(
      j, {Jet(point.x(), 0), Jet(point.y(), 1), Jet(point.z(), 2)}, seam_, line_.width);
  // The derivatives of one more step of Newton's method are those of the root.
  const ceres::Jet<double, 1> slope = ideal_h(undistorted_h(ceres::Jet<double, 1>(*eta, 0), v), v);
  const Jet jet_eta = *eta - (ideal_h(undistorted_h(Jet(*eta), j), j) - jet_h) / slope.v[0];
  const Jet jet_theta = jet_azimuth + atan(undistorted_h(jet_eta, j) * sin(j.lx));
  const Jet row = j.cy + j.c * jet_eta;
  Eigen::Matrix<double, 2, size> d;
  d << jet_theta.v.transpose() / v.angle_per_px, row.v.transpose();
  d(0, 3) -= pixel.x() / v.angle_per_px;
  if (d_point) *d_point = d.leftCols<3>();
  if (d_parameters) {
    d_parameters->setZero(2, parameter_count());
    d_parameters->leftCols<10>() = d.rightCols<10>();
  }
  return pixel;
}

std::optional<Eigen::Vector3d> FirstOrderLineModel::unproject(const Eigen::Vector2d& pixel,
                                                              PixelJacobian* jacobian) const {
  using Scalar = ceres::Jet<double, 1>;
  const LineValues<double> v = values_of(line_);
  const Scalar seen = undistorted_h(Scalar((pixel.y() - v.cy) / v.c, 0), v);
  const Scalar h = ideal_h(seen, v);
  if (!(h.v[0] > 0)) return std::nullopt;
  const Scalar azimuth = pixel.x() * v.angle_per_px - atan(seen * std::sin(v.lx));
  const double c = std::cos(azimuth.a), s = std::sin(azimuth.a), length = std::hypot(1, h.a);
  const Eigen::Vector3d bearing = Eigen::Vector3d(c, s, h.a) / length;
  if (!bearing.allFinite()) return std::nullopt;
  if (jacobian) {
    const Eigen::Vector3d sideways = Eigen::Vector3d(-s, c, 0) / length;
    const Eigen::Vector3d up = (Eigen::Vector3d::UnitZ() - bearing * bearing.z()) / length;
    jacobian->col(0) = sideways * v.angle_per_px;
    jacobian->col(1) = (up * h.v[0] + sideways * azimuth.v[0]) / v.c;
  }
  return bearing;
}

Eigen::Vector3d FirstOrderLineModel::origin(const Eigen::Vector2d& pixel) const {
  const double nominal = pixel.x() * 2 * pi / line_.width;
  const double c = std::cos(nominal), s = std::sin(nominal);
  const Eigen::Vector3d& e = line_.eccentricity_m;
  return {c * e.x() - s * e.y(), s * e.x() + c * e.y(), e.z()};
}

}  // namespace occ::internal::camera
