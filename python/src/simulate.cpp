// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/simulate.hpp"

#include <pybind11/typing.h>

#include <algorithm>

#include "libocc/simulate/explain.hpp"
#include "module.hpp"
#include "results.hpp"
#include "truth.hpp"

namespace occ::python {

template <>
struct Members<ExplainedEffect> {
  static auto tie(ExplainedEffect& e) {
    return std::tie(static_cast<EffectPlan&>(e), e.position_bound_m, e.cost_s);
  }
};

namespace {

std::string lamp_truth_repr(const LampTruth& lamp) {
  return "<LampTruth " + std::to_string(lamp.id) +
         (lamp.whole     ? ": whole"
          : lamp.in_view ? ": partly in view"
                         : ": out of view") +
         ", image centre " + value_repr(lamp.image_centre_px) + " px>";
}

void define_truth(py::module_& m) {
  ResultClass<LampTruth>(m, "LampTruth", "Ground truth of one lamp in a rendered image.")
      .def_readonly("id", &LampTruth::id, "Id of the lamp.")
      .def_readonly("in_view", &LampTruth::in_view, "Part of its image lies on the sensor.")
      .def_readonly("whole", &LampTruth::whole, "Its whole rim lies on the sensor.")
      .def_readonly("centre_px", &LampTruth::centre_px, "(2,) projection of the lamp's centre.")
      .def_readonly("image_centre_px", &LampTruth::image_centre_px,
                    "(2,) centre of the lamp's image; for a disc, of the ellipse.")
      .def_readonly("hidden", &LampTruth::hidden, "Fraction of its face that boxes hide.")
      .def_readonly("electrons", &LampTruth::electrons, "Signal electrons of its image.")
      .def_property_readonly(
          "rim_px", [](const LampTruth& lamp) { return rows_of(lamp.rim_px); },
          "(n, 2) rim; empty if the lamp is out of view.")
      .def("__repr__", &lamp_truth_repr);

  ResultClass<Truth>(m, "Truth", "Ground truth of a rendered image: the pose and all lamps.")
      .def_readonly("cam_from_world", &Truth::cam_from_world, "Pose, 4x4.")
      .def_property_readonly(
          "position_m", [](const Truth& t) { return t.cam_from_world.origin_in_source(); },
          "(3,) position of the camera [m, world].")
      .def_property_readonly(
          "lamps",
          [](const Truth& t) -> py::typing::Tuple<LampTruth, py::ellipsis> {
            return py::tuple(py::cast(t.lamps));
          },
          "A LampTruth for each lamp, in the order of the scene.")
      .def_property_readonly(
          "effects",
          [](const Truth& t) {
            const RenderPlan plan = plan_render(*t.scene, t.cam_from_world, t.options);
            return std::vector<EffectPlan>(plan.effects.begin(), plan.effects.end());
          },
          "An EffectPlan for each effect, as plan_render() returns them; computed at each access.")
      .def("__repr__", [](const Truth& t) {
        return "<Truth: camera at " + value_repr(t.cam_from_world.origin_in_source()) + " m, " +
               std::to_string(t.lamps.size()) + " lamps>";
      });
}

void define_plan(py::module_& m) {
  ResultClass<EffectPlan>(m, "EffectPlan", "Plan of one effect, from plan_render().")
      .def_property_readonly(
          "effect", [](const EffectPlan& p) { return effect_name(p.effect); },
          "Name of the effect.")
      .def_readonly("use", &EffectPlan::use, "Use of the effect in the scene.")
      .def_readonly("called_for", &EffectPlan::called_for,
                    "The scene has a setting that causes the effect.")
      .def_readonly("applied", &EffectPlan::applied, "simulate() renders it.")
      .def_readonly("bound_dn", &EffectPlan::bound_dn,
                    "Largest change of a pixel when it is left out [grey levels].")
      .def_readonly("bound_px", &EffectPlan::bound_px,
                    "Largest displacement of a lamp's centroid when it is left out [px].")
      .def_readonly("reason", &EffectPlan::reason, "Reason for applying it or leaving it out.")
      .def("__repr__", [](const EffectPlan& p) {
        return std::string("<EffectPlan ") + effect_name(p.effect) +
               (p.applied ? ": applied" : ": left out") + ", " + p.reason + ">";
      });
  ResultClass<ExplainedEffect, EffectPlan>(m, "ExplainedEffect",
                                           "Result of explain() for one effect.")
      .def_readonly("position_bound_m", &ExplainedEffect::position_bound_m,
                    "Largest displacement of a position solved from the lamps' centroids when it "
                    "is left out [m]; infinite if the lamps in view do not determine the pose.")
      .def_readonly(
          "cost_s", &ExplainedEffect::cost_s,
          "Time that it adds to one image of many [s], the difference of two measured times.");
  ResultClass<Explanation>(m, "Explanation", "Changes of an image by the effects, and their times.")
      .def_property_readonly(
          "effects",
          [](const Explanation& e) {
            return std::vector<ExplainedEffect>(e.effects.begin(), e.effects.end());
          },
          "An ExplainedEffect for each effect, in the order of Effects.use.")
      .def_readonly("render_s", &Explanation::render_s, "Time of one image as planned [s].")
      .def("__repr__", [](const Explanation& e) {
        const auto count = std::count_if(e.effects.begin(), e.effects.end(),
                                         [](const EffectPlan& p) { return p.applied; });
        return "<Explanation: " + std::to_string(count) + " effects applied, " +
               value_repr(1e3 * e.render_s) + " ms>";
      });
  const auto fields = options_fields();
  define_function(
      m, "explain", fields,
      [](SimulateOptions options, const Scene& scene, const Rigid3& cam_from_world,
         int repetitions) {
        py::gil_scoped_release unlocked;
        return explain(scene, cam_from_world, options, repetitions);
      },
      py::arg("scene"), py::arg("cam_from_world"), py::kw_only(), py::arg("repetitions") = 9,
      R"(Reports how much each effect changes an image of the scene, and how long it takes.

repetitions: images per measured time, of which the median is taken; 0: times are not measured.
Further keywords as for simulate(). Raises: ValueError as simulate() does.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
>>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
>>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
>>> [e.effect for e in occ.explain(scene, pose, repetitions=0).effects if e.applied]
['extent', 'light_gradient', 'psf', 'noise', 'saturation'])");
  define_function(
      m, "plan_render", fields,
      [](SimulateOptions options, const Scene& scene, const Rigid3& cam_from_world) {
        const RenderPlan plan = plan_render(scene, cam_from_world, options);
        return std::vector<EffectPlan>(plan.effects.begin(), plan.effects.end());
      },
      py::arg("scene"), py::arg("cam_from_world"), py::kw_only(),
      R"(Lists the effects that simulate() renders with the same arguments, with bounds.

Returns: an EffectPlan for each effect, in the order of Effects.use.
Raises: ValueError as simulate() does.)");
}

}  // namespace

void define_simulate(py::module_& m) {
  py::native_enum<NoiseArea>(m, "NoiseArea", "enum.Enum", "Pixels that have noise.")
      .value("everywhere", NoiseArea::everywhere)
      .value("around_lamps", NoiseArea::around_lamps)
      .finalize();
  define_plan(m);
  define_truth(m);
  const auto fields = options_fields();
  define_function(
      m, "simulate", fields,
      [](SimulateOptions options, const Scene& scene,
         const Rigid3& cam_from_world) -> py::typing::Tuple<PixelArray, Truth> {
        Rendered rendered = [&] {
          py::gil_scoped_release unlocked;
          return simulate(scene, cam_from_world, options);
        }();
        return py::make_tuple(to_numpy(std::move(rendered.image)),
                              Truth{std::make_shared<const Scene>(scene), options,
                                    rendered.cam_from_world, std::move(rendered.lamps)});
      },
      py::arg("scene"), py::arg("cam_from_world"), py::kw_only(),
      (R"(Renders the image of a scene that its camera takes from a pose.

cam_from_world: 4x4, see look_at(). Returns (image, truth): a (height, width) array, uint8 or
uint16 by the sensor's bit depth, and a Truth.
Raises: ValueError if the pose is not a rigid transform.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
>>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
>>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
>>> image, truth = occ.simulate(scene, cam_from_world=pose, seed=1)
>>> image.shape, image.dtype.name, truth.lamps[0].centre_px.tolist()
((48, 64), 'uint8', [31.5, 23.5]))" +
       fields_doc(fields, "Options"))
          .c_str());
  define_renderer(m);
}

}  // namespace occ::python
