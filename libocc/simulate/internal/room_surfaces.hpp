// SPDX-License-Identifier: Apache-2.0
// Light on the six surfaces of the room. The surfaces are diffuse and have one reflectance. Boxes
// cast no shadows on them.
#pragma once

#include <array>
#include <vector>

#include "libocc/scene/internal/lamp_emission.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::simulate {

/// Inside of the room: six rectangles. Faces 2 k and 2 k + 1 are perpendicular to axis k, at its
/// lower and upper end.
class RoomSurfaces {
 public:
  /// `lamp_light` is a factor on each lamp's light.
  RoomSurfaces(const Scene& scene, const std::vector<double>& lamp_light);

  struct Hit {
    int face = 0;
    Eigen::Vector3d point;
  };
  /// Intersection of a ray from inside with the surfaces.
  Hit hit(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;

  /// Direct irradiance by the lamps [W/m^2].
  double direct(int face, const Eigen::Vector3d& point) const;

  /// Irradiance by the other surfaces [W/m^2]; 0 before solve_interreflection().
  double indirect(int face, const Eigen::Vector3d& point) const;

  /// Computes the irradiance by the other surfaces: radiosity (Goral, Torrance, Greenberg,
  /// Battaile, SIGGRAPH 1984), iterated to convergence.
  void solve_interreflection();

  /// Largest direct irradiance of a grid of points and of the points nearest to the lamps [W/m^2].
  double max_direct() const;

  Eigen::Vector3d normal(int face) const;  ///< inwards
  const Eigen::Vector3d& size_m() const { return room_.size_m; }
  double reflectance() const { return room_.wall_reflectance; }

 private:
  struct Tile {
    int face;
    Eigen::Vector3d centre;
    std::array<Eigen::Vector3d, 4> corners;
    double radiosity = 0;
  };
  Eigen::Vector3d at(int face, double u, double v) const;  // u and v in [0, 1]
  std::vector<Tile> tiles() const;
  double from_tiles(const std::vector<Tile>& tiles, int face, const Eigen::Vector3d& point) const;

  struct Element {
    Eigen::Vector3d at, normal;
    std::size_t lamp;  // index of its emission
    double power_w;
  };

  Room room_;
  std::vector<internal::scene::LampEmission> emissions_;  // one per lamp
  std::vector<Element> elements_;                         // small parts of the lamps
  // Indirect irradiance at the nodes of each face, its borders included.
  std::array<std::vector<double>, 6> nodes_;
};

}  // namespace occ::internal::simulate
