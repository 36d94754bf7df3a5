// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/camera/internal/line_model.hpp"
#include "libocc/camera/internal/polynomial.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::camera {

LineBase::LineBase(const RotatingLine& line, double seam)
    : line_(line), seam_(seam), max_eta_(std::numeric_limits<double>::infinity()) {
  const std::vector<double> ends = sign_changes({1, -3 * line.k1, -5 * line.k2}, 1e12);  // of eta^2
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
  std::copy(v.begin() + tumbling_at, v.end(), line.tumbling_rad.begin());
  return line;
}

// Newton's method inside a bracket: `straight` grows throughout the domain.
std::optional<double> LineBase::bent(double h) const {
  if (line_.k1 == 0 && line_.k2 == 0) return h;
  const double wanted = std::abs(h);
  double low = 0, high = max_eta_, eta = std::min(wanted, high);
  if (std::isfinite(high) && !(wanted < straight(high))) return std::nullopt;
  for (int i = 0; i < 100; ++i) {
    const double error = straight(eta) - wanted;
    if (std::abs(error) <= 1e-16 * wanted) break;
    (error < 0 ? low : high) = eta;
    const double next = eta - error / straight_slope(eta);
    const double before = eta;
    eta = next > low && next < high ? next : std::isfinite(high) ? 0.5 * (low + high) : 2 * eta;
    if (eta == before) break;
  }
  return std::copysign(eta, h);
}

double LineBase::column(double theta) const {
  const double period = 2 * pi / line_.angle_per_px_rad;
  const double plain = theta / line_.angle_per_px_rad;
  double at = plain - period * std::floor((plain - seam_) / period);
  if (at >= seam_ + period) at -= period;  // rounding
  return at;
}

double LineBase::max_angle_rad() const {
  return std::isfinite(max_eta_) ? std::atan(straight(max_eta_)) : pi / 2;
}

}  // namespace occ::internal::camera
