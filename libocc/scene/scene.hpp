// SPDX-License-Identifier: Apache-2.0
// Everything that is known before a picture is taken: camera, sensor, lamps, room. Data only.
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
  Eigen::Vector3d size_m = Eigen::Vector3d(4, 4, 3);
  double wall_reflectance = 0;
};

/// Something opaque that hides lamps, its sides along the world's axes.
struct LIBOCC_API Box {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero(), max_m = Eigen::Vector3d::Zero();

  bool contains(const Eigen::Vector3d& point) const {  ///< its surface does not count
    return (point - min_m).minCoeff() > 0 && (max_m - point).minCoeff() > 0;
  }
  bool hides(const Eigen::Vector3d& to, const Eigen::Vector3d& from) const;  ///< one from another
};

struct LIBOCC_API Scene {
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Sensor sensor;
  std::vector<Lamp> lamps;
  std::optional<Room> room;
  Lens lens;
  std::vector<Box> boxes;
  std::vector<Tag> tags;             ///< landmarks beside the lamps; not rendered
  double ambient_w_m2 = 0;           ///< on the sensor, from everything that is no lamp
  Effects effects;                   ///< which of all this a rendered image contains
  std::vector<std::string> assumed;  ///< for people: which values the scene's source does not give

  /// Checks every part and that no two lamps, or tags of a family, share an id; normalises axes.
  /// Throws std::invalid_argument naming the part, the field and its value.
  void validate();

  /// The scene without what its effects switch off, for whoever measures images that were rendered
  /// so: no distortion, vignetting, glare, ghosts, ambient light, walls' light, gains, mosaic,
  /// response curve or boxes; a well that is never full; lamps that shine at their mean level.
  Scene as_rendered() const;
};

}  // namespace occ
