// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/irradiance_field.hpp"

#include <algorithm>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/formation/light.hpp"

namespace occ::internal::simulate {
namespace {

using Weights = IrradianceField::Weights;
constexpr int max_step = IrradianceField::max_step;

// Distance of the nodes: the largest power of two up to 1/50 of the focal length. The error of the
// cubics is about 1e-7 then.
int step_of(const Camera& camera) {
  const double max_px = std::min(camera.fx_px(), camera.fy_px()) / 50;
  int step = 1;
  while (step < max_step && 2 * step <= max_px) step *= 2;
  return step;
}

// Lagrange's cubic weights of the nodes -1, 0, 1, 2 at t.
std::array<double, 4> cubic_weights(double t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

Weights weights_from(double first, int step) {
  Weights weights{};
  for (int i = 0; i < step; ++i) {
    const std::array<double, 4> at = cubic_weights(first + static_cast<double>(i) / step);
    for (std::size_t node = 0; node < 4; ++node) weights[node][i] = static_cast<float>(at[node]);
  }
  return weights;
}

// The four nodes for an interval: centred on it, or shifted at the border.
struct Stencil {
  int first;
  std::size_t interval;  // index among the three between the nodes
};
LIBOCC_INLINE Stencil stencil_of(int interval, int nodes) {
  int first = interval - 1 < nodes - 4 ? interval - 1 : nodes - 4;
  if (first < 0) first = 0;
  return {first, static_cast<std::size_t>(interval - first)};
}

struct Grid {
  const float* nodes;
  int columns, rows, step, height;
  const Weights* weights;
  float* lines;  // buffer for all pixels on all rows of nodes
};

// Interpolates along the rows of nodes, then between these rows.
LIBOCC_INLINE void interpolate_all(const Grid& grid, int step, float* __restrict to) {
  float* __restrict line = grid.lines;
  for (int row = 0; row < grid.rows; ++row)
    for (int interval = 0; interval + 1 < grid.columns; ++interval, line += step) {
      const Stencil across = stencil_of(interval, grid.columns);
      const float* __restrict w = grid.weights[across.interval].data()->data();
      const float* n = grid.nodes + row * grid.columns + across.first;
      const float n0 = n[0], n1 = n[1], n2 = n[2], n3 = n[3];
      for (int i = 0; i < step; ++i)
        line[i] =
            w[i] * n0 + w[i + max_step] * n1 + w[i + 2 * max_step] * n2 + w[i + 3 * max_step] * n3;
    }
  const std::ptrdiff_t width = (grid.columns - 1) * step;
  for (int y = 0; y < grid.height; ++y, to += width) {
    const Stencil down = stencil_of(y / step, grid.rows);
    const float* w = grid.weights[down.interval].data()->data() + y % step;
    const float w0 = w[0], w1 = w[max_step], w2 = w[2 * max_step], w3 = w[3 * max_step];
    const float* __restrict from = grid.lines + down.first * width;
    for (std::ptrdiff_t x = 0; x < width; ++x)
      to[x] =
          w0 * from[x] + w1 * from[x + width] + w2 * from[x + 2 * width] + w3 * from[x + 3 * width];
  }
}

template <Simd>
LIBOCC_INLINE void interpolate_body(Grid grid, float* to) {
  // The usual step as a constant lets the compiler unroll the loop.
  grid.step == max_step ? interpolate_all(grid, max_step, to)
                        : interpolate_all(grid, grid.step, to);
}
LIBOCC_MULTIVERSION(interpolate, (Grid grid, float* to), (grid, to))

}  // namespace

void IrradianceField::fill(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                           const Sensor& sensor, PatchOf<float>& field) {
  if (const int step = step_of(camera); step != step_) {
    step_ = step;
    weights_ = {weights_from(-1, step), weights_from(0, step), weights_from(1, step)};
  }
  const int columns = std::max(4, (field.width + step_ - 1) / step_ + 1);
  const int rows = std::max(4, (field.height + step_ - 1) / step_ + 1);
  field.width = (columns - 1) * step_;
  field.values.resize(static_cast<std::size_t>(field.width) *
                      static_cast<std::size_t>(field.height));
  const LampIrradiance irradiance(lamp, cam_from_world, camera, sensor);
  bool complete = true;  // every node sees the lamp's lit side
  nodes_.clear();
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      nodes_.push_back(
          static_cast<float>(irradiance.at({field.x0 + column * step_, field.y0 + row * step_})));
      complete = complete && nodes_.back() > 0;
    }
  if (complete) {
    lines_.resize(static_cast<std::size_t>(field.width) * static_cast<std::size_t>(rows));
    return interpolate_for(simd_)(
        {nodes_.data(), columns, rows, step_, field.height, weights_.data(), lines_.data()},
        field.values.data());
  }
  const auto centre = camera.project(cam_from_world * lamp.centre_m);
  const double at_centre = centre ? irradiance.at(*centre) : 0;
  float* to = field.values.data();
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const double here = irradiance.at({field.x0 + x, field.y0 + y});
      *to++ = static_cast<float>(here > 0 ? here : at_centre);
    }
}

}  // namespace occ::internal::simulate
