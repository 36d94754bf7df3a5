// SPDX-License-Identifier: Apache-2.0
// The room's six surfaces and the light on them: diffuse, all of one reflectance. Lamps light them
// through air alone: boxes cast no shadow on them.
#pragma once

#include <array>
#include <vector>

#include "libocc/scene/scene.hpp"

namespace occ::internal::simulate {

/// The room's inside: six rectangles, of which face 2 k and 2 k + 1 lie across axis k at its lower
/// and upper end.
class RoomSurfaces {
 public:
  /// `lamp_light`: factor of each lamp's light.
  RoomSurfaces(const Scene& scene, const std::vector<double>& lamp_light);

  struct Hit {
    int face = 0;
    Eigen::Vector3d point;
  };
  /// Where a ray from inside meets the surfaces.
  Hit hit(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;

  /// Irradiance [W/m^2] by the lamps directly.
  double direct(int face, const Eigen::Vector3d& point) const;

  /// By the other surfaces, as they light each other. Zero before solve_interreflection().
  double indirect(int face, const Eigen::Vector3d& point) const;

  /// Radiosity (Goral, Torrance, Greenberg, Battaile, SIGGRAPH 1984) to convergence.
  void solve_interreflection();

  /// No point gets more directly.
  double largest_direct() const;

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
  Eigen::Vector3d at(int face, double u, double v) const;  // u, v in [0, 1]
  std::vector<Tile> tiles() const;
  double from_tiles(const std::vector<Tile>& tiles, int face, const Eigen::Vector3d& point) const;

  struct Element {
    Eigen::Vector3d at, normal;
    double order;
    double power_w;
  };

  Room room_;
  std::vector<Element> elements_;  // of the lamps, small
  /// Indirect irradiance at evenly spaced nodes of each face, its borders included.
  std::array<std::vector<double>, 6> nodes_;
};

}  // namespace occ::internal::simulate
