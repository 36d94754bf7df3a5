// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/lamp.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/vector_text.hpp"

namespace occ {

using namespace internal::scene;
namespace {

// Left alone when it is unit to rounding already, so that validating twice changes no bit.
Eigen::Vector3d unit(const Eigen::Vector3d& v) {
  const double excess = std::abs(v.squaredNorm() - 1);
  return excess <= 8 * std::numeric_limits<double>::epsilon() ? v : v.stableNormalized();
}

// Unit part of `axis` perpendicular to the unit vector `normal`; zero when there is none to speak
// of (0.06 degrees).
Eigen::Vector3d perpendicular(const Eigen::Vector3d& axis, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d direction = unit(axis);
  const double along = direction.dot(normal);
  if (std::abs(along) <= 8 * std::numeric_limits<double>::epsilon()) return direction;
  const Eigen::Vector3d rest = direction - along * normal;
  if (!(rest.norm() > 1e-3)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = rest.normalized();
  return unit(first - first.dot(normal) * normal);  // once more removes the rounding of the first
}

Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d x = perpendicular(Eigen::Vector3d::UnitX(), normal);
  return x.isZero() ? perpendicular(Eigen::Vector3d::UnitY(), normal) : x;
}

// Requirements on the fields of one lamp; messages start with its id. Text is made for a bad value
// only: validate() runs before every image.
class Check {
 public:
  explicit Check(int id) : id_(id) {}

  template <typename T>
  void that(bool holds, const char* field, const T& value, const char* rule) const {
    if (!holds) require(false, "lamp " + std::to_string(id_) + ": " + field, shown(value), rule);
  }
  void finite(const Eigen::Vector3d& value, const char* field) const {
    that(value.allFinite(), field, value, "finite");
  }
  void direction(const Eigen::Vector3d& value, const char* field) const {
    finite(value, field);
    that(value.stableNorm() > 1e-9, field, value, "a direction, not zero");
  }
  void positive(double value, const char* field) const {
    that(value > 0 && std::isfinite(value), field, value, "positive");
  }

 private:
  static double shown(double value) { return value; }
  static std::string shown(const std::string& value) { return value; }
  template <typename Vector>
  static std::string shown(const Vector& value) {
    return vector_text(value);
  }

  int id_;
};

void check_waveform(const Check& check, const Lamp& lamp) {
  if (lamp.waveform.empty()) return;
  check.that(lamp.frequency_hz.has_value(), "frequency_hz", std::string("none"),
             "given beside `waveform`");
  bool any = false;
  for (const double level : lamp.waveform) {
    check.that(level >= 0 && level <= 1, "waveform", level, "a list of levels in [0, 1]");
    any = any || level > 0;
  }
  check.that(any, "waveform", 0.0, "lit for some of the time");
}

}  // namespace

double Lamp::area_m2() const {
  if (shape == LampShape::disc) return pi * radius_m * radius_m;
  if (shape == LampShape::rectangle) return size_m.x() * size_m.y();
  if (shape == LampShape::lame)
    return size_m.x() * size_m.y() *
           std::exp(2 * std::lgamma(1 + 1 / exponent) - std::lgamma(1 + 2 / exponent));
  return 0;
}

double Lamp::reach_m() const {
  if (shape == LampShape::disc) return radius_m;
  if (shape == LampShape::rectangle) return size_m.norm() / 2;
  if (shape == LampShape::point) return 0;
  // Largest x^2 + y^2 on the curve: on an axis, or by Hoelder's inequality in x^2 and y^2.
  if (exponent <= 2) return size_m.maxCoeff() / 2;
  const double dual = 2 * exponent / (exponent - 2);
  const double longer = size_m.maxCoeff(), ratio = size_m.minCoeff() / longer;
  return longer / 2 * std::pow(1 + std::pow(ratio, dual), 1 / dual);
}

double Lamp::order() const { return lambertian_order(half_power_rad); }

double Lamp::mean_light() const {
  if (!frequency_hz) return 1;
  if (waveform.empty()) return duty;
  return std::accumulate(waveform.begin(), waveform.end(), 0.0) /
         static_cast<double>(waveform.size());
}

bool Lamp::shows_lit_side(const Eigen::Vector3d& seen_from) const {
  return (seen_from - centre_m).dot(normal) > 0;
}

void Lamp::set_code(const LampCode& said) {
  require(said.id >= 0, "id", said.id, "zero or positive");
  Waveform wave = encode_id(static_cast<std::uint32_t>(said.id), said.code);
  const auto channels = static_cast<int>(wave.chips.size());
  require(said.channel >= 0 && said.channel < channels, "channel", said.channel,
          "below the code's " + std::to_string(channels));
  frequency_hz = wave.frequency_hz();
  waveform = std::move(wave.chips[said.channel]);
  code = said;
}

void Lamp::validate() {
  const Check check(id);
  if (code && waveform.empty()) set_code(*code);
  check.finite(centre_m, "centre_m");
  check.direction(normal, "normal");
  if (shape == LampShape::disc) check.positive(radius_m, "radius_m");
  const bool has_sides = shape == LampShape::rectangle || shape == LampShape::lame;
  if (has_sides) {
    check.that(size_m.allFinite() && size_m.minCoeff() > 0, "size_m", size_m,
               "two positive lengths");
    check.direction(x_axis, "x_axis");
  }
  if (shape == LampShape::lame)
    check.that(exponent >= 1 && exponent <= 100, "exponent", exponent, "in [1, 100]");
  check.positive(power_w, "power_w");
  check.that(power_sigma >= 0 && std::isfinite(power_sigma), "power_sigma", power_sigma,
             "zero or positive");
  check.that(half_power_rad > 0 && half_power_rad < pi / 2, "half_power_rad", half_power_rad,
             "in (0, pi/2)");
  if (frequency_hz) check.positive(*frequency_hz, "frequency_hz");
  check.that(duty > 0 && duty <= 1, "duty", duty, "in (0, 1]");
  check_waveform(check, *this);
  check.that(std::isfinite(phase), "phase", phase, "finite");
  check.that(colour.allFinite() && colour.minCoeff() >= 0 && colour.maxCoeff() > 0, "colour",
             colour, "three shares of the light, not all zero");

  normal = unit(normal);
  const Eigen::Vector3d given = x_axis;
  x_axis = has_sides ? perpendicular(x_axis, normal) : any_perpendicular(normal);
  check.that(!x_axis.isZero(), "x_axis", given, "across the normal, not along it");
}

}  // namespace occ
