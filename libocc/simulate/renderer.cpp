// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/renderer.hpp"

#include <numeric>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/blooming.hpp"
#include "libocc/simulate/internal/check_place.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/gain.hpp"
#include "libocc/simulate/internal/ghosts.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/modulation.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/planning.hpp"
#include "libocc/simulate/internal/room_light.hpp"
#include "libocc/simulate/internal/storage.hpp"
#include "libocc/simulate/internal/truth.hpp"

namespace occ {
namespace {

constexpr double no_electrons = 1e-6;  // less than this in a pixel is rounding

// One row of a lamp's image, its light in parts of what it is while lit; sums in lanes, so that
// their order does not depend on the instructions.
constexpr int lanes = 8;
struct Row {
  const double *image, *lit;
  std::ptrdiff_t lit_step;  // 0 or 1
  double even, odd;         // what columns x0, x0 + 2, ... get of the light, and the others
  int count;
};

LIBOCC_INLINE void add_pixel(const Row& row, int at, int lane, double* to, double* sums) {
  const double light = row.image[at] * row.lit[at * row.lit_step];
  const double electrons = light * (lane % 2 == 0 ? row.even : row.odd);
  const double counted = electrons > no_electrons ? electrons : 0;
  to[at] += counted;
  sums[lane] += counted;
}

LIBOCC_INLINE void add_pixels(const Row& row, double* to, double* sums) {
  double mine[lanes];
  for (int i = 0; i < lanes; ++i) mine[i] = sums[i];
  int x = 0;
  for (; x + lanes <= row.count; x += lanes)
    for (int i = 0; i < lanes; ++i) add_pixel(row, x + i, i, to, mine);
  for (int i = 0; x + i < row.count; ++i) add_pixel(row, x + i, i, to, mine);
  for (int i = 0; i < lanes; ++i) sums[i] = mine[i];
}

template <Simd>
LIBOCC_INLINE void add_row_body(Row row, double* to, double* sums) {
  row.lit_step = 0;
  add_pixels(row, to, sums);
}
LIBOCC_MULTIVERSION(add_row, (Row row, double* to, double* sums), (row, to, sums))

template <Simd>
LIBOCC_INLINE void add_row_by_columns_body(Row row, double* to, double* sums) {
  row.lit_step = 1;
  add_pixels(row, to, sums);
}
LIBOCC_MULTIVERSION(add_row_by_columns, (Row row, double* to, double* sums), (row, to, sums))

ByPlace colours_of(const Eigen::Vector3d& colour, const Frame& frame) {
  if (!frame.plan.applies(Effect::mosaic)) return {1, 1, 1, 1};
  return light_by_place(frame.scene.sensor, colour);
}

// Adds a lamp's image as its blinking lets each line see it, by the colours that pixels see;
// returns the electrons added.
double add_lamp(const Patch& image, const Lamp& lamp, const Frame& frame, Signal& signal) {
  if (image.width == 0) return 0;
  signal.touch({image.x0, image.y0, image.width, image.height});
  const bool by_columns = frame.scene.sensor.readout == Readout::columns;
  const Simd simd = frame.storage.simd();
  const auto add_row = by_columns ? add_row_by_columns_for(simd) : add_row_for(simd);
  const std::vector<double> lit = lit_fractions(lamp, frame, by_columns ? image.x0 : image.y0,
                                                by_columns ? image.width : image.height);
  const ByPlace colours = colours_of(lamp.colour, frame);
  double sums[lanes] = {};
  for (int y = 0; y < image.height; ++y)
    add_row({image.values.data() + y * static_cast<std::ptrdiff_t>(image.width),
             lit.data() + (by_columns ? 0 : y), by_columns ? 1 : 0,
             colours[place_of(image.x0, image.y0 + y)],
             colours[place_of(image.x0 + 1, image.y0 + y)], image.width},
            signal.row(image.y0 + y) + image.x0, sums);
  return std::accumulate(sums, sums + lanes, 0.0);
}

Scene validated(Scene scene) {
  scene.validate();
  return scene;
}

// Light that every pixel of a place gets alike: ambient light, and the lens's glare of the lamps'.
void add_evenly(const Frame& frame, const ByPlace& lamp_electrons, Signal& signal) {
  const Sensor& sensor = frame.scene.sensor;
  ByPlace even{};
  if (frame.plan.applies(Effect::ambient)) {
    const double ambient = sensor.electrons(frame.scene.ambient_w_m2) - sensor.electrons(0);
    even = colours_of(Eigen::Vector3d::Ones(), frame);
    for (double& electrons : even) electrons *= ambient;
  }
  if (frame.plan.applies(Effect::glare)) {
    const double pixels = static_cast<double>(signal.width()) * signal.height();
    for (std::size_t place = 0; place < even.size(); ++place)
      even[place] += frame.scene.lens.veiling_glare * lamp_electrons[place] / pixels;
  }
  if (even != ByPlace{}) signal.add_everywhere(even);
}

// Ghosts are what a camera of another focal length sees, turned about its axis where the scale is
// negative. The aperture stays as it is, though it goes with the focal length.
void add_ghosts(const Frame& frame, Signal& signal) {
  for (const Ghost& ghost : frame.scene.lens.ghosts) {
    const GhostView view = ghost_view(frame.scene, frame.cam_from_world, frame.options, ghost);
    const Frame ghost_frame{view.scene, view.cam_from_world, view.options, frame.plan,
                            frame.storage};
    const LampRenderer renderer(ghost_frame);
    for (const Lamp& lamp : view.scene.lamps)
      if (const auto image = renderer.render(lamp)) add_lamp(*image, lamp, ghost_frame, signal);
  }
}

RenderPlan plan_of(const Scene& scene, const Rigid3& pose, const SimulateOptions& options) {
  if (!depends_on_bounds(scene.effects)) return make_plan(scene, options, nullptr);
  const View view = make_view(scene, pose, options);
  return make_plan(scene, options, &view);
}

}  // namespace

class Renderer::Workshop {
 public:
  Workshop(const Scene& scene, const RendererOptions& options)
      : scene_(validated(scene)),
        signal_(scene_.camera.width(), scene_.camera.height()),
        exposure_(options.simd),
        storage_(options.simd) {}

  void render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
    options.validate();
    out.cam_from_world = Rigid3::from_matrix(cam_from_world.matrix());
    check_place(scene_, out.cam_from_world.origin_in_source());
    const RenderPlan plan = plan_of(scene_, out.cam_from_world, options);
    const Frame frame{scene_, out.cam_from_world, options, plan, storage_};
    signal_.clear();
    const ByPlace lamp_electrons = add_lamps(frame, out.lamps);
    if (plan.applies(Effect::ghosts)) add_ghosts(frame, signal_);
    if (plan.applies(Effect::walls)) add_room_light(frame, signal_);
    add_evenly(frame, lamp_electrons, signal_);
    if (plan.applies(Effect::gain)) apply_gain(frame, signal_);
    if (plan.applies(Effect::blooming)) apply_blooming(frame, signal_);
    exposure_.expose(signal_, frame, out);
  }

 private:
  // Returns what all pixels together would get of the lamps' light if all were of the same place.
  ByPlace add_lamps(const Frame& frame, std::vector<LampTruth>& truths) {
    const LampRenderer renderer(frame);
    ByPlace sum{};
    truths.resize(scene_.lamps.size());
    for (std::size_t i = 0; i < scene_.lamps.size(); ++i) {
      const Lamp& lamp = scene_.lamps[i];
      truths[i] = lamp_truth(lamp, frame, renderer.camera());
      const auto image = renderer.render(lamp);
      if (!image) continue;
      truths[i].electrons = add_lamp(*image, lamp, frame, signal_);
      const ByPlace colours = colours_of(lamp.colour, frame);
      const double mean = 0.25 * std::accumulate(colours.begin(), colours.end(), 0.0);
      for (std::size_t place = 0; place < sum.size() && mean > 0; ++place)
        sum[place] += truths[i].electrons * colours[place] / mean;
    }
    return sum;
  }

  const Scene scene_;
  Signal signal_;
  Exposure exposure_;
  Storage storage_;
};

Renderer::Renderer(const Scene& scene, const RendererOptions& options)
    : workshop_(std::make_unique<Workshop>(scene, options)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
  workshop_->render(cam_from_world, options, out);
}

}  // namespace occ
