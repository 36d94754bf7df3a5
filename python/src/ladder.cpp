// SPDX-License-Identifier: Apache-2.0
// Which rung was chosen, what rungs cost, and what `libocc ladder` measures.
#include "libocc/ladder/ladder.hpp"

#include <pybind11/stl/filesystem.h>

#include <filesystem>

#include "fields.hpp"
#include "libocc/refine/rung_choice.hpp"
#include "libocc/refine/rung_costs.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Path = std::filesystem::path;

void define_costs(py::module_& m) {
  py::class_<RungCost> cost(m, "RungCost", "What refining one pose takes by one rung.");
  const auto terms = std::make_tuple(
      field("fixed_s", &RungCost::fixed_s, "whatever there is to refine by [s]"),
      field("per_lamp_s", &RungCost::per_lamp_s, "for each lamp [s]"),
      field("per_rim_point_s", &RungCost::per_rim_point_s, "for each point of its rim [s]"),
      field("per_pixel_s", &RungCost::per_pixel_s, "for each pixel around it [s]"));
  define_value(cost, terms);
  define_repr(cost, "RungCost", terms);

  py::class_<RungCosts> costs(m, "RungCosts",
                              R"(What each rung takes on a machine: for locate(costs=...).

`libocc ladder --costs FILE.yaml` measures them; the defaults are those of an ordinary server.)");
  const auto rungs = std::make_tuple(field("points", &RungCosts::points, "of Rung.points"),
                                     field("centres", &RungCosts::centres, "of Rung.centres"),
                                     field("rims", &RungCosts::rims, "of Rung.rims"),
                                     field("direct", &RungCosts::direct, "of Rung.direct"));
  define_value(costs, rungs);
  define_repr(costs, "RungCosts", rungs);
  costs
      .def_static(
          "load", [](const Path& path) { return reading(path, &read_rung_costs); }, py::arg("path"),
          "Reads a file of costs. Raises: FileNotFoundError or OSError when it cannot be opened,\n"
          "ValueError naming file, line and key when its content is wrong.")
      .def(
          "save",
          [](const RungCosts& c, const Path& path) {
            writing(path, [&](const std::string& name) { write_rung_costs(name, c); });
          },
          py::arg("path"), "Writes a file, whole or not at all. Raises: OSError.");
}

void define_choice(py::module_& m) {
  ResultClass<RungForecast>(m, "RungForecast", "What a rung was predicted to take and to reach.")
      .def_readonly("rung", &RungForecast::rung, "Rung.")
      .def_readonly("predicted_s", &RungForecast::predicted_s, "Time of the refinement [s].")
      .def_readonly("predicted_sigma_m", &RungForecast::predicted_sigma_m,
                    "Of the position [m], or None when nothing depended on it.")
      .def("__repr__", [](const RungForecast& f) {
        return "<RungForecast: " + std::string(to_string(f.rung)) + ", " +
               value_repr(f.predicted_s) + " s, sigma " + value_repr(f.predicted_sigma_m) + " m>";
      });
  ResultClass<RungChoice>(m, "RungChoice", "By which rung a pose was refined, and why.")
      .def_readonly("rung", &RungChoice::rung, "Rung.")
      .def_readonly("predicted_s", &RungChoice::predicted_s, "Time of the refinement [s].")
      .def_readonly("predicted_sigma_m", &RungChoice::predicted_sigma_m,
                    "Of the position [m]: root of the trace of its covariance's bound.")
      .def_readonly("met", &RungChoice::met, "Whether budget and target are, as predicted.")
      .def_readonly("reason", &RungChoice::reason, "A sentence; unless met, what it would take.")
      .def_readonly("alternatives", &RungChoice::alternatives,
                    "A RungForecast for each rung that was considered, cheapest first.")
      .def("__repr__", [](const RungChoice& c) {
        return "<RungChoice: " + std::string(to_string(c.rung)) +
               (c.met ? "" : ", not what was asked for") + ">";
      });
}

void define_steps(py::module_& m) {
  py::class_<LadderStep>(m, "LadderStep", "A way from blobs with names to a pose.")
      .def_readonly("name", &LadderStep::name, "For ladder_frame().")
      .def_readonly("family", &LadderStep::family, "Who wrote what it times.")
      .def_readonly("what", &LadderStep::what, "A phrase for people.")
      .def_readonly("observations", &LadderStep::observations, "What it sees, a Rung.")
      .def("__repr__",
           [](const LadderStep& s) { return "<LadderStep: " + std::string(s.name) + ">"; });
  m.def("ladder_steps", &ladder_steps, "Every step of the ladder.");

  using B = LadderBound;
  ResultClass<B>(m, "LadderBound", "Least errors, root mean squares; 0 where there is no bound.")
      .def_readonly("position_m", &B::position_m, "Cramer-Rao bound [m].")
      .def_readonly("rotation_rad", &B::rotation_rad, "Cramer-Rao bound [rad].")
      .def_readonly("position_expected_m", &B::position_expected_m, "Bound and bias [m].")
      .def_readonly("rotation_expected_rad", &B::rotation_expected_rad, "Bound and bias [rad].")
      .def("__repr__",
           [](const B& b) { return "<LadderBound: " + value_repr(b.position_m) + " m>"; });

  using O = LadderOutcome;
  ResultClass<O>(m, "LadderOutcome", "What one step took and erred on one image.")
      .def_readonly("name", &O::name, "Of the step.")
      .def_readonly("answered", &O::answered, "Whether it returned a pose.")
      .def_readonly("cam_from_world", &O::cam_from_world, "Pose, 4x4.")
      .def_readonly("time_s", &O::time_s, "Of one call [s].")
      .def_readonly("position_error_m", &O::position_error_m, "[m]")
      .def_readonly("rotation_error_rad", &O::rotation_error_rad, "[rad]")
      .def_readonly("bound", &O::bound, "LadderBound of what the step sees.")
      .def("__repr__", [](const O& o) { return "<LadderOutcome: " + std::string(o.name) + ">"; });
}

/// All chosen steps on one image.
struct LadderFrame {
  double detect_s = 0;
  LadderBound pixels, points;
  Eigen::MatrixX3d points_in_world_m;
  Eigen::MatrixX2d points_px;
  std::vector<LadderOutcome> outcomes;
};

LadderFrame ladder_frame(const NumpyImage& image, const Scene& scene, const Rigid3& cam_from_world,
                         const std::vector<std::string>& steps, double min_time_s) {
  py::gil_scoped_release unlocked;
  const LadderProblem problem = ladder_problem(image.view, scene, cam_from_world);
  LadderFrame frame;
  frame.detect_s = problem.detect_s;
  frame.points_in_world_m = problem.points_in_world.transpose();
  frame.points_px = problem.points_px.transpose();
  if (problem.matches.size() < 3) return frame;
  frame.pixels = ladder_bound(problem, Rung::direct);
  frame.points = ladder_bound(problem, Rung::points);
  for (const std::string& name : steps) {
    const LadderStep& step = ladder_step_named(name);
    if (step.suits(problem)) frame.outcomes.push_back(run_step(problem, step, min_time_s));
  }
  return frame;
}

void define_frame(py::module_& m) {
  using F = LadderFrame;
  ResultClass<F>(m, "LadderFrame", "What every step took and erred on one image.")
      .def_readonly("detect_s", &F::detect_s, "Finding the blobs [s].")
      .def_readonly("pixels", &F::pixels, "LadderBound of all pixels.")
      .def_readonly("points", &F::points, "LadderBound of the centroids.")
      .def_readonly("points_in_world_m", &F::points_in_world_m, "(n, 3) lamps' centres.")
      .def_readonly("points_px", &F::points_px, "(n, 2) their centroids.")
      .def_readonly("outcomes", &F::outcomes, "LadderOutcome of each step that suits.")
      .def("__repr__", [](const F& f) {
        return "<LadderFrame: " + std::to_string(f.points_px.rows()) + " lamps>";
      });
  m.def("ladder_frame", &ladder_frame, py::arg("image"), py::arg("scene"),
        py::arg("cam_from_world"), py::arg("steps"), py::arg("min_time_s") = 5e-5,
        R"(Runs steps of the ladder on an image whose truth is known.

steps: names of ladder_steps(); those that do not suit the lamps are left out. min_time_s: each is
called until so much time has gone by. Returns: LadderFrame, without outcomes below three lamps.
Raises: ValueError for an unknown step or an image of another size than the camera's.)");
  m.def(
      "time_refine",
      [](const NumpyImage& image, const Scene& scene, const Rigid3& cam_from_world, Rung rung,
         double min_time_s) {
        py::gil_scoped_release unlocked;
        const RefineTime t =
            time_refine(ladder_problem(image.view, scene, cam_from_world), rung, min_time_s);
        return std::make_tuple(t.work.lamps, t.work.rim_points, t.work.pixels, t.time_s);
      },
      py::arg("image"), py::arg("scene"), py::arg("cam_from_world"), py::arg("rung"),
      py::arg("min_time_s") = 1e-3,
      "Lamps, rim points, pixels, and the time [s] of refining a pose by them; 0: none found.");
}

}  // namespace

void define_ladder(py::module_& m) {
  define_costs(m);
  define_choice(m);
  define_steps(m);
  define_frame(m);
}

}  // namespace occ::python
