// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "libocc/camera/internal/line_model.hpp"
#include "libocc/camera/internal/polynomial.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::camera {

LineBase::Checked LineBase::checked(RotatingLine line) {
  require(line.width > 0, "width", line.width, "positive");
  require(line.height > 0, "height", line.height, "positive");
  if (line.angle_per_px_rad == 0) line.angle_per_px_rad = 2 * pi / line.width;
  require(line.angle_per_px_rad > 0 && line.angle_per_px_rad < pi / 2, "angle_per_px_rad",
          line.angle_per_px_rad, "positive and below pi/2");
  require(line.c_px > 0 && std::isfinite(line.c_px), "c_px", line.c_px, "positive and finite");
  require(std::isfinite(line.cy_px), "cy_px", line.cy_px, "finite");
  for (const auto& [name, tilt] :
       {std::pair{"tilt_x_rad", line.tilt_x_rad}, std::pair{"tilt_y_rad", line.tilt_y_rad}})
    require(std::abs(tilt) < pi / 4, name, tilt, "a small tilt, within pi/4");
  require(line.eccentricity_m.allFinite(), "eccentricity_m", line.eccentricity_m.transpose(),
          "finite");
  require(std::isfinite(line.k1), "k1", line.k1, "finite");
  require(std::isfinite(line.k2), "k2", line.k2, "finite");
  for (std::size_t i = 0; i < line.tumbling_rad.size(); ++i)
    require(std::abs(line.tumbling_rad[i]) < 0.1, "tumbling_rad[" + std::to_string(i) + "]",
            line.tumbling_rad[i], "a small angle, within 0.1");
  return {line};
}

LineBase::LineBase(CameraKind kind, const RotatingLine& line, double seam)
    : LineBase(kind, checked(line), seam) {}

LineBase::LineBase(CameraKind kind, const Checked& checked, double seam)
    : CameraModel(kind, checked.line.width, checked.line.height,
                  {1 / checked.line.angle_per_px_rad, checked.line.c_px, 0, checked.line.cy_px, 0}),
      line_(checked.line),
      seam_(seam),
      max_eta_(std::numeric_limits<double>::infinity()) {
  period_px_ = 2 * pi / line_.angle_per_px_rad;
  const Polynomial slope{1, -3 * line_.k1, -5 * line_.k2};  // d h / d eta in eta^2
  const std::vector<double> ends = sign_changes(slope, 1e12);
  if (!ends.empty()) max_eta_ = std::sqrt(ends.front());
}

std::vector<CameraParameter> LineBase::parameters() const {
  const RotatingLine& l = line_;
  std::vector<CameraParameter> all{{"angle_per_px_rad", "rad", l.angle_per_px_rad},
                                   {"c_px", "px", l.c_px},
                                   {"cy_px", "px", l.cy_px},
                                   {"tilt_x_rad", "rad", l.tilt_x_rad},
                                   {"tilt_y_rad", "rad", l.tilt_y_rad},
                                   {"ex_m", "m", l.eccentricity_m.x(), true},
                                   {"ey_m", "m", l.eccentricity_m.y(), true},
                                   {"ez_m", "m", l.eccentricity_m.z(), true},
                                   {"k1", "1", l.k1},
                                   {"k2", "1", l.k2}};
  for (std::size_t i = 0; i < l.tumbling_rad.size(); ++i)
    all.push_back({"tumbling" + std::to_string(i + 1) + "_rad", "rad", l.tumbling_rad[i]});
  return all;
}

RotatingLine LineBase::with_values(const Eigen::VectorXd& v) const {
  RotatingLine line = line_;
  line.angle_per_px_rad = v[0];
  line.c_px = v[1];
  line.cy_px = v[2];
  line.tilt_x_rad = v[3];
  line.tilt_y_rad = v[4];
  line.eccentricity_m = v.segment<3>(5);
  line.k1 = v[8];
  line.k2 = v[9];
  std::copy(v.begin() + first_tumbling, v.end(), line.tumbling_rad.begin());
  return line;
}

// Newton's method inside a bracket; `undistorted` grows throughout the domain.
std::optional<double> LineBase::distorted(double h) const {
  if (line_.k1 == 0 && line_.k2 == 0) return h;
  const double target = std::abs(h);
  double low = 0, high = max_eta_, eta = std::min(target, high);
  if (std::isfinite(high) && !(target < undistorted(high))) return std::nullopt;
  for (int i = 0; i < 100; ++i) {
    const double error = undistorted(eta) - target;
    if (std::abs(error) <= 1e-16 * target) break;
    (error < 0 ? low : high) = eta;
    const double next = eta - error / undistorted_slope(eta);
    const double before = eta;
    eta = next > low && next < high ? next : std::isfinite(high) ? 0.5 * (low + high) : 2 * eta;
    if (eta == before) break;
  }
  return std::copysign(eta, h);
}

double LineBase::column(double theta) const {
  const double plain = theta / line_.angle_per_px_rad;
  double at = plain - period_px_ * std::floor((plain - seam_) / period_px_);
  if (at >= seam_ + period_px_) at -= period_px_;  // rounding
  return at;
}

double LineBase::max_angle_rad() const {
  return std::isfinite(max_eta_) ? std::atan(undistorted(max_eta_)) : pi / 2;
}

double LineBase::depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const Eigen::Vector3d from_axis(point.x(), point.y(), 0);
  return CameraModel::depth_m(from_axis, gradient);
}

}  // namespace occ::internal::camera
