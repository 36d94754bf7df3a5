// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ::internal::simulate {
namespace {

bool on_face(const Lamp& lamp, const Eigen::Vector3d& position) {
  constexpr double touching_m = 1e-6;  // rounding of poses
  const Eigen::Vector3d offset = position - lamp.centre_m;
  if (!(std::abs(offset.dot(lamp.normal)) < touching_m)) return false;
  const Eigen::Vector2d at(offset.dot(lamp.x_axis), offset.dot(lamp.normal.cross(lamp.x_axis)));
  const double u = std::abs(at.x()), v = std::abs(at.y());
  const Eigen::Vector2d half = 0.5 * lamp.size_m;
  switch (lamp.shape) {
    case LampShape::point:
      return offset.norm() < touching_m;
    case LampShape::disc:
      return std::hypot(u, v) < lamp.radius_m;
    case LampShape::rectangle:
      return u < half.x() && v < half.y();
    case LampShape::lame:
      return std::pow(u / half.x(), lamp.exponent) + std::pow(v / half.y(), lamp.exponent) < 1;
    case LampShape::polygon:
      return scene::contains(lamp.corners_m, at);
  }
  return false;
}

}  // namespace

void check_camera_position(const Scene& scene, const Eigen::Vector3d& position) {
  for (std::size_t i = 0; i < scene.boxes.size(); ++i)
    if (scene.boxes[i].contains(position))
      require(false, "cam_from_world", position.transpose(),
              "outside boxes[" + std::to_string(i) + "]");
  for (const Lamp& lamp : scene.lamps)
    if (on_face(lamp, position))
      require(false, "cam_from_world", position.transpose(),
              "outside lamp " + std::to_string(lamp.id));
}

void check_inside_room(const Eigen::Vector3d& size_m, const Eigen::Vector3d& position) {
  if (!(position.minCoeff() > 0 && (size_m - position).minCoeff() > 0))
    require(false, "cam_from_world", position.transpose(), "in the room whose walls are rendered");
}

}  // namespace occ::internal::simulate
