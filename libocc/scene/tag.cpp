// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/tag.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;

Rigid3 Tag::world_from_tag() const {
  Rigid3 pose;
  pose.rotation << x_axis, normal.cross(x_axis), normal;
  pose.translation = centre_m;
  return pose;
}

void Tag::validate() {
  require(id >= 0, "tags: id", id, "zero or positive");
  const std::string name = "tag " + std::to_string(id) + ": ";
  require(!family.empty(), name + "family", family, "a name such as tag36h11");
  check_fields(*this, tag_fields, name);
  const bool has_normal = normal.allFinite() && normal.norm() > 0;
  require(has_normal, name + "normal", vector_text(normal), "a direction");
  const bool has_x =
      x_axis.allFinite() && x_axis.cross(normal).norm() > 1e-6 * x_axis.norm() * normal.norm();
  require(has_x, name + "x_axis", vector_text(x_axis), "a direction not parallel to the normal");
  constexpr double rounding = 1e-14;  // unit to rounding: not changed by a second call
  if (std::abs(normal.squaredNorm() - 1) > rounding) normal.normalize();
  if (std::abs(x_axis.dot(normal)) > rounding || std::abs(x_axis.squaredNorm() - 1) > rounding)
    x_axis = (x_axis - normal * normal.dot(x_axis)).normalized();
}

Eigen::Matrix<double, 3, 4> tag_corners(double size_m) {
  Eigen::Matrix<double, 3, 4> corners;
  corners << -1, 1, 1, -1,  //
      -1, -1, 1, 1,         //
      0, 0, 0, 0;
  return 0.5 * size_m * corners;
}

}  // namespace occ
