// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/renderer.hpp"

#include <cmath>
#include <numeric>
#include <optional>

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

using namespace internal::simulate;
namespace {

constexpr double no_electrons = 1e-6;  // less than this in a pixel is rounding

// One row of a lamp's image, its light in parts of what it is while lit; in whole vectors, zeros
// after the image. Sums are in lanes, so that their order does not depend on the instructions.
constexpr int lanes = PaddedPatch::padding;
static_assert(lanes <= Signal::spare);
struct Row {
  const float* image;
  const double* lit;
  double even, odd;  // what columns x0, x0 + 2, ... get of the light, and the others
  int count;
};

LIBOCC_INLINE void add_pixel(double light, double colour, double* to, double* sum) {
  const double electrons = light * colour;
  const double counted = electrons > no_electrons ? electrons : 0;
  *to += counted;
  *sum += counted;
}

template <Simd>
LIBOCC_INLINE void add_row_body(Row row, double* __restrict to, double* sums) {
  double mine[lanes];
  for (int i = 0; i < lanes; ++i) mine[i] = sums[i];
  const double lit = *row.lit;
  for (int x = 0; x < row.count; x += lanes)
    for (int i = 0; i < lanes; ++i)
      add_pixel(static_cast<double>(row.image[x + i]) * lit, i % 2 == 0 ? row.even : row.odd,
                to + x + i, mine + i);
  for (int i = 0; i < lanes; ++i) sums[i] = mine[i];
}
LIBOCC_MULTIVERSION(add_row, (Row row, double* to, double* sums), (row, to, sums))

template <Simd>
LIBOCC_INLINE void add_row_by_columns_body(Row row, double* __restrict to, double* sums) {
  for (int x = 0; x < row.count; ++x)
    add_pixel(static_cast<double>(row.image[x]) * row.lit[x], x % 2 == 0 ? row.even : row.odd,
              to + x, sums + x % lanes);
}
LIBOCC_MULTIVERSION(add_row_by_columns, (Row row, double* to, double* sums), (row, to, sums))

ByPlace colours_of(const Eigen::Vector3d& colour, const Frame& frame) {
  if (!frame.plan.applies(Effect::mosaic)) return {1, 1, 1, 1};
  return light_by_place(frame.scene.sensor, colour);
}

// Adds a lamp's image as its blinking lets each line see it, by the colours that pixels see;
// returns the electrons added.
double add_lamp(const PaddedPatch& image, const Lamp& lamp, const Frame& frame, Signal& signal) {
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
    add_row(
        {image.row(y), lit.data() + (by_columns ? 0 : y), colours[place_of(image.x0, image.y0 + y)],
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
    PaddedPatch image;
    for (const Lamp& lamp : view.scene.lamps)
      if (renderer.render(lamp, image)) add_lamp(image, lamp, ghost_frame, signal);
  }
}

bool differ_in_frame_alone(const SimulateOptions& a, const SimulateOptions& b) {
  return a.noise == b.noise && a.noise_area == b.noise_area && a.start_s == b.start_s &&
         a.spacing_sigma == b.spacing_sigma && a.velocity == b.velocity;
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
    const RenderPlan& plan = plan_of(out.cam_from_world, options);
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
  // What is planned without bounds holds for the next image, too.
  const RenderPlan& plan_of(const Rigid3& pose, const SimulateOptions& options) {
    if (depends_on_bounds(scene_.effects)) {
      const SceneView view = make_view(scene_, pose, options);
      plan_ = make_plan(scene_, options, &view);
    } else if (!plan_ || !differ_in_frame_alone(options, planned_)) {
      plan_ = make_plan(scene_, options, nullptr);
    }
    planned_ = options;
    return *plan_;
  }

  // Returns what all pixels together would get of the lamps' light if all were of the same place.
  ByPlace add_lamps(const Frame& frame, std::vector<LampTruth>& truths) {
    const LampRenderer renderer(frame);
    ByPlace sum{};
    truths.resize(scene_.lamps.size());
    for (std::size_t i = 0; i < scene_.lamps.size(); ++i) {
      const Lamp& lamp = scene_.lamps[i];
      truths[i] = lamp_truth(lamp, frame, renderer.motion(), renderer.camera());
      if (std::isfinite(scene_.camera.period_px())) {
        truths[i].electrons = add_around_seam(frame, lamp, truths[i]);
      } else {
        if (!renderer.render(lamp, image_)) continue;
        truths[i].electrons = add_lamp(image_, lamp, frame, signal_);
      }
      const ByPlace colours = colours_of(lamp.colour, frame);
      const double mean = 0.25 * std::accumulate(colours.begin(), colours.end(), 0.0);
      for (std::size_t place = 0; place < sum.size() && mean > 0; ++place)
        sum[place] += truths[i].electrons * colours[place] / mean;
    }
    return sum;
  }

  // Where the image repeats itself a lamp's may go on at the other end: it is drawn there as well,
  // by cameras whose seam is opposite to it.
  double add_around_seam(const Frame& frame, const Lamp& lamp, LampTruth& truth) {
    const double period = scene_.camera.period_px();
    const double column = truth.centre_px.x();
    const double other = column + (column < 0.5 * period ? period : -period);
    double electrons = 0;
    for (const double at : {column, other}) {
      const LampRenderer renderer(frame, rendered_camera(frame).with_seam_at(at - 0.5 * period));
      if (at == column) truth = lamp_truth(lamp, frame, renderer.motion(), renderer.camera());
      if (renderer.render(lamp, image_)) electrons += add_lamp(image_, lamp, frame, signal_);
    }
    return electrons;
  }

  const Scene scene_;
  Signal signal_;
  Exposure exposure_;
  Storage storage_;
  std::optional<RenderPlan> plan_;
  SimulateOptions planned_;  // options of the plan
  PaddedPatch image_;        // of one lamp after the other
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
