// SPDX-License-Identifier: Apache-2.0
// Fields of AprilTags for tests, with cameras that look at them.
#pragma once

#include <Eigen/Geometry>

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/simulate/targets.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

/// The whole image of the targets.
inline Image render_targets(const TargetField& field, const Camera& camera,
                            const Rigid3& cam_from_world, const TargetImageOptions& options = {}) {
  return TargetRenderer(field, camera, cam_from_world, options)
      .window({0, 0, camera.width(), camera.height()});
}

inline Tag field_tag(int id, const Eigen::Vector3d& centre_m, const Eigen::Vector3d& normal,
                     double size_m, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  Tag tag;
  tag.id = id;
  tag.size_m = size_m;
  tag.centre_m = centre_m;
  tag.normal = normal.normalized();
  tag.x_axis = up.cross(tag.normal);
  tag.validate();
  return tag;
}

/// Field near the origin on the plane y = 0, seen from negative y; a few tags stand off the plane
/// and are tilted.
inline TargetField tags_on_a_wall(int columns, int rows, double size_m = 0.16) {
  TargetField field;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int id = row * columns + column;
      const double out = id % 3 == 0 ? 0.15 : 0;
      const Eigen::Vector3d at(0.36 * (column - 0.5 * (columns - 1)), -out,
                               0.36 * (0.5 * (rows - 1) - row));
      const double tilt = out > 0 ? 0.4 * ((id / 3) % 3 - 1) : 0;
      field.tags.push_back(
          field_tag(id, at, {std::sin(tilt), -std::cos(tilt), 0.1 * tilt}, size_m));
    }
  return field;
}

inline Rigid3 towards_wall(const Eigen::Vector3d& position, double roll_rad = 0) {
  Rigid3 roll;
  roll.rotation = so3_exp({0, 0, roll_rad});
  return roll * look_at(position, {0, 0, 0}, Eigen::Vector3d::UnitZ());
}

/// Field on the four walls of a room of 6 x 5 x 3 m, about one tag per metre at different heights,
/// and on boards in the room.
inline TargetField tags_in_a_room(double size_m = 0.3, int per_wall = 6) {
  TargetField field;
  int id = 0;
  const auto height = [&] { return 0.7 + 0.8 * ((id * 7) % 3) + 0.02 * (id % 5); };
  for (int k = 0; k < per_wall; ++k) {
    const double x = 6 * (k + 0.5) / per_wall, y = 5 * (k + 0.5) / per_wall;
    field.tags.push_back(field_tag(id, {x, 0, height()}, {0, 1, 0}, size_m));
    ++id;
    field.tags.push_back(field_tag(id, {6 - x, 5, height()}, {0, -1, 0}, size_m));
    ++id;
    field.tags.push_back(field_tag(id, {0, y, height()}, {1, 0, 0}, size_m));
    ++id;
    field.tags.push_back(field_tag(id, {6, 5 - y, height()}, {-1, 0, 0}, size_m));
    ++id;
  }
  return field;
}

/// Reduced version of a panorama camera of 6000 x 1500 px.
inline RotatingLine small_line(int width = 3000, int height = 1000) {
  RotatingLine l;
  l.width = width;
  l.height = height;
  l.angle_per_px_rad = 2 * pi / (width - 12.4);
  l.c_px = 0.16 * width;
  l.cy_px = 0.5 * height - 3.7;
  l.tilt_x_rad = 0.004;
  l.tilt_y_rad = -0.003;
  l.eccentricity_m = {0.012, -0.008, 0};
  l.k1 = 0.012;
  return l;
}

/// The panorama camera upright: its Z axis, towards growing rows, points down.
inline Rigid3 upright_line(const Eigen::Vector3d& position, double heading_rad,
                           double tilt_rad = 0) {
  const Eigen::Matrix3d down = (Eigen::Matrix3d() << 1, 0, 0, 0, -1, 0, 0, 0, -1).finished();
  const Eigen::Matrix3d rotation =
      so3_exp({tilt_rad, -tilt_rad, 0}) * so3_exp({0, 0, heading_rad}) * down;
  return {rotation, -(rotation * position)};
}

}  // namespace occ::test
