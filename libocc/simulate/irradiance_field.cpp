// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/irradiance_field.hpp"

#include <algorithm>
#include <array>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/formation/light.hpp"

namespace occ {
namespace {

constexpr std::size_t most_step = 16;

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
  grid.step = std::clamp(static_cast<int>(std::min(camera.fx_px(), camera.fy_px()) / 50), 1,
                         static_cast<int>(most_step));
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

/// Weights of every pixel between two nodes, of one node after the other.
using Weights = std::array<std::array<double, most_step>, 4>;

Weights weights_between(int step) {
  Weights weights{};
  for (int i = 0; i < step; ++i) {
    const std::array<double, 4> at = cubic(static_cast<double>(i) / step);
    for (std::size_t node = 0; node < 4; ++node)
      weights[node][static_cast<std::size_t>(i)] = at[node];
  }
  return weights;
}

struct Line {
  const double* nodes;
  int step, pixels;
};

template <Simd>
LIBOCC_INLINE void interpolate_line_body(Line line, const Weights& weights, double* to) {
  const double* at = line.nodes;
  for (int x = 0; x < line.pixels; x += line.step, ++at) {
    const int count = line.pixels - x < line.step ? line.pixels - x : line.step;
    for (int i = 0; i < count; ++i)
      to[x + i] = weights[0].data()[i] * at[0] + weights[1].data()[i] * at[1] +
                  weights[2].data()[i] * at[2] + weights[3].data()[i] * at[3];
  }
}
LIBOCC_MULTIVERSION(interpolate_line, (Line line, const Weights& weights, double* to),
                    (line, weights, to))

void interpolate(Simd simd, const Grid& grid, Patch& field) {
  const Weights weights = weights_between(grid.step);
  const auto interpolate_line = interpolate_line_for(simd);
  std::vector<double> line(static_cast<std::size_t>(grid.columns));
  double* to = field.values.data();
  for (int y = 0; y < field.height; ++y, to += field.width) {
    const auto down = static_cast<std::size_t>(y % grid.step);
    const double* nodes = &grid.nodes[static_cast<std::size_t>(y / grid.step * grid.columns)];
    for (int i = 0; i < grid.columns; ++i)
      line[static_cast<std::size_t>(i)] = weights[0][down] * nodes[i] +
                                          weights[1][down] * nodes[i + grid.columns] +
                                          weights[2][down] * nodes[i + 2 * grid.columns] +
                                          weights[3][down] * nodes[i + 3 * grid.columns];
    interpolate_line({line.data(), grid.step, field.width}, weights, to);
  }
}

void evaluate(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
              const Sensor& sensor, Patch& field) {
  const auto centre = camera.project(cam_from_world * lamp.centre_m);
  const double at_centre =
      centre ? irradiance_at(lamp, cam_from_world, camera, sensor, *centre) : 0;
  double* to = field.values.data();
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const Eigen::Vector2d px(field.x0 + x, field.y0 + y);
      const double here = irradiance_at(lamp, cam_from_world, camera, sensor, px);
      *to++ = here > 0 ? here : at_centre;
    }
}

}  // namespace

Patch irradiance_field(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                       const Sensor& sensor, int x0, int y0, int x1, int y1, Simd simd) {
  Patch field{x0, y0, x1 - x0, y1 - y0, {}};
  field.values.resize(static_cast<std::size_t>(field.width) *
                      static_cast<std::size_t>(field.height));
  const Grid grid = sample(lamp, cam_from_world, camera, sensor, field);
  if (grid.complete)
    interpolate(simd, grid, field);
  else
    evaluate(lamp, cam_from_world, camera, sensor, field);
  return field;
}

}  // namespace occ
