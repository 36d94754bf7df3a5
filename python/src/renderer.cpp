// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/renderer.hpp"

#include <pybind11/typing.h>

#include <chrono>
#include <cmath>
#include <mutex>

#include "libocc/core/require.hpp"
#include "module.hpp"
#include "truth.hpp"

namespace occ::python {
namespace {

/// A Renderer that several threads can share: one thread renders, the others wait.
class SharedRenderer {
 public:
  explicit SharedRenderer(const Scene& scene)
      : scene_(std::make_shared<const Scene>(scene)), renderer_(scene) {}

  /// Releases the GIL before it waits for the lock.
  std::pair<Image, Truth> render(const Rigid3& cam_from_world, const SimulateOptions& options) {
    py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> one(busy_);
    renderer_.render(cam_from_world, options, rendered_);
    return {rendered_.image, {scene_, options, rendered_.cam_from_world, rendered_.lamps}};
  }

  /// Mean time of an image inside the library [s], measured over at least min_time_s.
  double time(const Rigid3& cam_from_world, double min_time_s, SimulateOptions options) {
    using Clock = std::chrono::steady_clock;
    require(min_time_s > 0 && std::isfinite(min_time_s), "min_time_s", min_time_s, "positive");
    py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> one(busy_);
    const auto begin = Clock::now();
    for (int images = 1;; ++images, ++options.frame) {
      renderer_.render(cam_from_world, options, rendered_);
      const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin).count();
      if (elapsed_s >= min_time_s) return elapsed_s / images;
    }
  }

  const Scene& scene() const { return *scene_; }

 private:
  std::shared_ptr<const Scene> scene_;
  Renderer renderer_;
  Rendered rendered_;
  std::mutex busy_;
};

}  // namespace

void define_renderer(py::module_& m) {
  const auto fields = options_fields();
  py::class_<SharedRenderer> cls(
      m, "Renderer",
      R"(Renders many images of one scene, bit-identical to those of simulate().

Tables are shared by all images: thousands of images per second if only the lamps have noise.
Threads that share a Renderer wait for each other; use one per thread.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
>>> renderer = occ.Renderer(occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)]))
>>> poses = [occ.look_at(position_m=[0, 0, z], target_m=[0, 0, 3], up=[0, 1, 0]) for z in (1, 2)]
>>> [int(renderer.render(pose, noise=False)[0].max()) for pose in poses]
[62, 71])");
  cls.def(py::init<const Scene&>(), py::arg("scene"));
  cls.def_property_readonly("scene", &SharedRenderer::scene, "Scene of the images.");

  define_method(
      cls, "render", fields,
      [](SimulateOptions options, SharedRenderer& renderer,
         const Rigid3& cam_from_world) -> py::typing::Tuple<PixelArray, Truth> {
        auto [image, truth] = renderer.render(cam_from_world, options);
        return py::make_tuple(to_numpy(std::move(image)), std::move(truth));
      },
      py::arg("cam_from_world"), py::kw_only(),
      ("Returns (image, truth) like simulate()." + fields_doc(fields, "Options")).c_str());
  define_method(
      cls, "time", fields,
      [](SimulateOptions options, SharedRenderer& renderer, const Rigid3& cam_from_world,
         double min_time_s) { return renderer.time(cam_from_world, min_time_s, options); },
      py::arg("cam_from_world"), py::arg("min_time_s"), py::kw_only(),
      ("Returns the mean time of an image without conversion to Python [s], measured over at "
       "least min_time_s with increasing frame numbers." +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
