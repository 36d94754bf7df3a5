// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/irradiance_field.hpp"

#include <algorithm>
#include <array>

#include "libocc/formation/light.hpp"

namespace occ {
namespace {

// Irradiance at grid nodes `step` pixels apart; the first is one step before (x0, y0), so that a
// cubic stencil fits around every pixel.
struct Grid {
  int step = 0, columns = 0, rows = 0;
  std::vector<double> nodes;
  bool complete = true;  // every node sees the lamp's lit side
};

Grid sample(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
            const Sensor& sensor, const Patch& field) {
  Grid grid;
  // A fiftieth of the focal length: cubics then err by about 1e-7.
  grid.step = std::clamp(static_cast<int>(std::min(camera.fx_px(), camera.fy_px()) / 50), 1, 16);
  grid.columns = (field.width - 1) / grid.step + 4;
  grid.rows = (field.height - 1) / grid.step + 4;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d px(field.x0 + (column - 1) * grid.step,
                               field.y0 + (row - 1) * grid.step);
      grid.nodes.push_back(irradiance_at(lamp, cam_from_world, camera, sensor, px));
      grid.complete = grid.complete && grid.nodes.back() > 0;
    }
  return grid;
}

// Lagrange's cubic weights of the nodes -1, 0, 1, 2 at t in [0, 1).
std::array<double, 4> cubic(double t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

void interpolate(const Grid& grid, Patch& field) {
  std::vector<std::array<double, 4>> weights(static_cast<std::size_t>(grid.step));
  for (int i = 0; i < grid.step; ++i)
    weights[static_cast<std::size_t>(i)] = cubic(static_cast<double>(i) / grid.step);
  std::vector<double> line(static_cast<std::size_t>(grid.columns));
  for (int y = 0; y < field.height; ++y) {
    const auto& down = weights[static_cast<std::size_t>(y % grid.step)];
    const double* nodes = &grid.nodes[static_cast<std::size_t>(y / grid.step * grid.columns)];
    for (int i = 0; i < grid.columns; ++i)
      line[static_cast<std::size_t>(i)] = down[0] * nodes[i] + down[1] * nodes[i + grid.columns] +
                                          down[2] * nodes[i + 2 * grid.columns] +
                                          down[3] * nodes[i + 3 * grid.columns];
    for (int x = 0; x < field.width; ++x) {
      const auto& across = weights[static_cast<std::size_t>(x % grid.step)];
      const double* at = &line[static_cast<std::size_t>(x / grid.step)];
      field.values.push_back(across[0] * at[0] + across[1] * at[1] + across[2] * at[2] +
                             across[3] * at[3]);
    }
  }
}

void evaluate(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
              const Sensor& sensor, Patch& field) {
  const auto centre = camera.project(cam_from_world * lamp.centre_m);
  const double at_centre =
      centre ? irradiance_at(lamp, cam_from_world, camera, sensor, *centre) : 0;
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const Eigen::Vector2d px(field.x0 + x, field.y0 + y);
      const double here = irradiance_at(lamp, cam_from_world, camera, sensor, px);
      field.values.push_back(here > 0 ? here : at_centre);
    }
}

}  // namespace

Patch irradiance_field(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                       const Sensor& sensor, int x0, int y0, int x1, int y1) {
  Patch field{x0, y0, x1 - x0, y1 - y0, {}};
  field.values.reserve(static_cast<std::size_t>(field.width) *
                       static_cast<std::size_t>(field.height));
  const Grid grid = sample(lamp, cam_from_world, camera, sensor, field);
  if (grid.complete)
    interpolate(grid, field);
  else
    evaluate(lamp, cam_from_world, camera, sensor, field);
  return field;
}

}  // namespace occ
