// SPDX-License-Identifier: Apache-2.0
// Model of a room and its camera: camera, sensor, lens, lamps, boxes, tags. Data only.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/radiometry/sensor.hpp"
#include "libocc/scene/effects.hpp"
#include "libocc/scene/lamp.hpp"
#include "libocc/scene/lens.hpp"
#include "libocc/scene/tag.hpp"

namespace occ {

/// A box room with one corner at the world's origin.
struct Room {
  Eigen::Vector3d size_m = Eigen::Vector3d(4, 4, 3);  ///< along x, y, z; the floor is at z = 0
  double wall_reflectance = 0;  ///< diffuse, of all six surfaces; 0 to below 1
};

/// An opaque box that occludes lamps, with its sides along the axes of the world.
struct LIBOCC_API Box {
  /// Opposite corners in the world.
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero(), max_m = Eigen::Vector3d::Zero();

  /// Returns true if the point is inside; the surface is outside.
  bool contains(const Eigen::Vector3d& point) const {
    return (point - min_m).minCoeff() > 0 && (max_m - point).minCoeff() > 0;
  }
  /// Returns true if the line of sight between two points passes through the inside.
  bool hides(const Eigen::Vector3d& to, const Eigen::Vector3d& from) const;
};

/// A room with its lamps and the camera that observes them.
struct LIBOCC_API Scene {
  /// Projection; its size is the image's.
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Sensor sensor;            ///< exposure, noise and response
  std::vector<Lamp> lamps;  ///< unique ids
  /// Standard deviations of the positions of all lamps without Lamp::position_sigma_m, along the
  /// axes of the world; none: their positions are exact.
  std::optional<PerAxis> map_sigma_m;
  /// Relative standard deviation of the scale of the map: the positions of all lamps, about their
  /// mean, and the sizes of all lamps are wrong by the same factor, which no picture shows. That is
  /// so if the map was made from pictures by lamps of a nominal size, by tags or by one distance.
  double map_scale_sigma = 0;
  std::optional<Room> room;          ///< walls; empty: none
  Lens lens;                         ///< blur, vignetting, glare
  std::vector<Box> boxes;            ///< occlude lamps
  std::vector<Tag> tags;             ///< landmarks beside the lamps; not rendered
  double ambient_w_m2 = 0;           ///< irradiance of the sensor from other sources than lamps
  Effects effects;                   ///< effects that a rendered image contains
  std::vector<std::string> assumed;  ///< notes on values that the scene's source does not give

  /// Checks every part. Two lamps, or two tags of a family, must not share an id. Normalises axes.
  /// Throws std::invalid_argument naming the part, the field and its value.
  void validate();

  /// The scene without the effects that are switched off: the model of images rendered with these
  /// effects. Removes distortion, vignetting, glare, ghosts, ambient light, reflections by walls,
  /// pixel gains, mosaic, response curve, boxes and the full well; lamps then have their mean
  /// light.
  Scene as_rendered() const;

  /// Lamp::position_sigma_m, or map_sigma_m; none: the lamp's position has no error of its own.
  std::optional<PerAxis> position_sigma_m(const Lamp& lamp) const {
    return lamp.position_sigma_m ? lamp.position_sigma_m : map_sigma_m;
  }
  bool has_discs() const;           ///< true if a lamp is not known to have straight sides
  bool has_straight_sides() const;  ///< true if the image of a lamp may be a polygon
  /// True if the image of a lamp may be neither an ellipse nor a convex polygon.
  bool has_free_forms() const;
  bool has_hollows() const;                      ///< true if a lamp is a polygon that is not convex
  Eigen::Vector3d mean_lamp_position_m() const;  ///< zero if there are no lamps
  /// Variances of the lamp's position along the axes of the world, with the shared errors.
  Eigen::Vector3d position_variance_m2(const Lamp& lamp) const;
};

}  // namespace occ
