// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/lamp.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libocc/core/internal/area_moments.hpp"
#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/radiometry/emission_profile.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

// A vector that is unit to rounding is not changed, so that validating twice changes no bit.
Eigen::Vector3d unit(const Eigen::Vector3d& v) {
  const double excess = std::abs(v.squaredNorm() - 1);
  return excess <= 8 * std::numeric_limits<double>::epsilon() ? v : v.stableNormalized();
}

// Unit part of `axis` perpendicular to the unit vector `normal`; zero when the two are parallel to
// 1e-3 rad (0.06 degrees).
Eigen::Vector3d perpendicular(const Eigen::Vector3d& axis, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d direction = unit(axis);
  const double along = direction.dot(normal);
  if (std::abs(along) <= 8 * std::numeric_limits<double>::epsilon()) return direction;
  const Eigen::Vector3d rest = direction - along * normal;
  if (!(rest.norm() > 1e-3)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = rest.normalized();
  return unit(first - first.dot(normal) *
                          normal);  // the second projection removes the rounding of the first
}

Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d x = perpendicular(Eigen::Vector3d::UnitX(), normal);
  return x.isZero() ? perpendicular(Eigen::Vector3d::UnitY(), normal) : x;
}

template <typename T>
void require_of_lamp(bool holds, int id, const char* field, const T& value, const char* rule) {
  if (!holds) require(false, "lamp " + std::to_string(id) + ": " + field, value, rule);
}

void check_waveform(const Lamp& lamp) {
  if (lamp.waveform.empty()) return;
  require_of_lamp(lamp.frequency_hz.has_value(), lamp.id, "frequency_hz", "none",
                  "given together with `waveform`");
  bool any = false;
  for (const double level : lamp.waveform) {
    require_of_lamp(level >= 0 && level <= 1, lamp.id, "waveform", level,
                    "a list of levels in [0, 1]");
    any = any || level > 0;
  }
  require_of_lamp(any, lamp.id, "waveform", 0.0, "above zero in a part of the period");
}

// A lamp without radius or size takes that of the luminous opening of its photometry.
void complete_from_opening(Lamp& lamp) {
  if (!lamp.photometry) return;
  const PhotometricDistribution& distribution = lamp.photometry->distribution();
  if (distribution.opening == OpeningShape::sideways) return;
  if (is_disc(lamp) && lamp.radius_m == 0) {
    lamp.set_photometry(lamp.photometry);
  } else if (has_sides(lamp) && lamp.size_m.isZero()) {
    Lamp opening;
    opening.set_photometry(lamp.photometry);
    if (opening.shape == lamp.shape) lamp.size_m = opening.size_m;
  }
}

}  // namespace

double Lamp::area_m2() const {
  if (shape == LampShape::disc) return pi * radius_m * radius_m;
  if (shape == LampShape::rectangle) return size_m.x() * size_m.y();
  if (shape == LampShape::lame)
    return size_m.x() * size_m.y() *
           std::exp(2 * std::lgamma(1 + 1 / exponent) - std::lgamma(1 + 2 / exponent));
  if (shape == LampShape::polygon) return outline_moments(corners_m).area;
  return 0;
}

double Lamp::reach_m() const {
  if (shape == LampShape::disc) return radius_m;
  if (shape == LampShape::rectangle) return size_m.norm() / 2;
  if (shape == LampShape::point) return 0;
  if (shape == LampShape::polygon) {
    double reach_m = 0;
    for (const Eigen::Vector2d& corner : corners_m) reach_m = std::max(reach_m, corner.norm());
    return reach_m;
  }
  // The largest x^2 + y^2 on the curve lies on an axis for n <= 2; else Hoelder's inequality in x^2
  // and y^2 gives it.
  if (exponent <= 2) return size_m.maxCoeff() / 2;
  const double dual = 2 * exponent / (exponent - 2);
  const double longer = size_m.maxCoeff(), ratio = size_m.minCoeff() / longer;
  return longer / 2 * std::pow(1 + std::pow(ratio, dual), 1 / dual);
}

double Lamp::order() const {
  return photometry ? photometry->equivalent_order() : lambertian_order(half_power_rad);
}

bool Lamp::uses_x_axis() const {
  return may_have_corners(*this) || (photometry && photometry->depends_on_c());
}

void Lamp::set_photometry(std::shared_ptr<const EmissionProfile> profile) {
  require(profile != nullptr, "profile", "none", "an EmissionProfile");
  const PhotometricDistribution& distribution = profile->distribution();
  const Eigen::Vector2d size = distribution.size_m;
  switch (distribution.opening) {
    case OpeningShape::sideways:
      require(false, "shape", "none",
              "given, because the luminous opening of the photometry faces sideways");
      break;
    case OpeningShape::point:
      shape = LampShape::point;
      break;
    case OpeningShape::rectangle:
      shape = LampShape::rectangle;
      size_m = size;
      break;
    case OpeningShape::ellipse:
      shape = size.x() == size.y() ? LampShape::disc : LampShape::lame;
      radius_m = size.x() / 2;
      size_m = size;
      exponent = 2;
      break;
  }
  photometry = std::move(profile);
}

double Lamp::mean_light() const {
  if (!frequency_hz) return 1;
  if (waveform.empty()) return duty;
  return std::accumulate(waveform.begin(), waveform.end(), 0.0) /
         static_cast<double>(waveform.size());
}

bool Lamp::may_show(const Blob& blob) const {
  return blob.corners_px.empty() || may_have_corners(*this);
}

std::vector<std::array<int, 3>> Lamp::face_triangles() const {
  if (!is_polygon(*this)) return {};
  return triangles_of(corners_m);
}

bool Lamp::shows_lit_side(const Eigen::Vector3d& seen_from) const {
  return (seen_from - centre_m).dot(normal) > 0;
}

void Lamp::set_code(const LampCode& lamp_code) {
  require(lamp_code.id >= 0, "id", lamp_code.id, "zero or positive");
  Waveform wave = encode_id(static_cast<std::uint32_t>(lamp_code.id), lamp_code.code);
  const auto channels = static_cast<int>(wave.chips.size());
  require(lamp_code.channel >= 0 && lamp_code.channel < channels, "channel", lamp_code.channel,
          "below the code's " + std::to_string(channels));
  frequency_hz = wave.frequency_hz();
  waveform = std::move(wave.chips[lamp_code.channel]);
  code = lamp_code;
}

void Lamp::validate() {
  if (code && waveform.empty()) set_code(*code);
  complete_from_opening(*this);
  check_fields(*this, lamp_fields, [this] { return "lamp " + std::to_string(id) + ": "; });
  check_waveform(*this);
  for (const Eigen::Vector3d& displacement_m : shared_errors_m)
    if (!displacement_m.allFinite())
      require_of_lamp(false, id, "shared_errors_m", vector_text(displacement_m), "finite");
  if (!(colour.allFinite() && colour.minCoeff() >= 0 && colour.maxCoeff() > 0))
    require_of_lamp(false, id, "colour", vector_text(colour),
                    "three numbers, zero or positive, not all zero");

  normal = unit(normal);
  const Eigen::Vector3d given = x_axis;
  x_axis = uses_x_axis() ? perpendicular(x_axis, normal) : any_perpendicular(normal);
  if (x_axis.isZero())
    require_of_lamp(false, id, "x_axis", vector_text(given), "not parallel to the normal");
  if (is_polygon(*this)) validate_polygon(*this);
}

}  // namespace occ
