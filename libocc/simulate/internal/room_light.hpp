// SPDX-License-Identifier: Apache-2.0
// Light that the room's six surfaces reflect: diffuse, all of one reflectance. Lamps light them
// through air alone (boxes cast no shadow on them), and a box in front of one is black.
#pragma once

#include <array>
#include <vector>

#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/view.hpp"

namespace occ {

/// The room's inside: six rectangles, of which face 2 k and 2 k + 1 lie across axis k at its lower
/// and upper end.
class RoomSurfaces {
 public:
  explicit RoomSurfaces(const Scene& scene);

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
    const Lamp* lamp;
    Eigen::Vector3d at;
    double power_w;
  };

  Room room_;
  std::vector<Element> elements_;  // of the lamps, small
  /// Indirect irradiance at evenly spaced nodes of each face, its borders included.
  std::array<std::vector<double>, 6> nodes_;
};

/// Grey levels that a surface of this irradiance [W/m^2] brings at most.
double wall_grey_levels(const View& view, double irradiance_w_m2);

/// Adds the electrons that each pixel gets from the surfaces. Throws std::invalid_argument unless
/// the camera is in the room.
void add_room_light(const Frame& frame, std::vector<double>& signal);

}  // namespace occ
