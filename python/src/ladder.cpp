// SPDX-License-Identifier: Apache-2.0
// Choice of the refinement's rung, computing times of rungs, and the measurements of `libocc
// ladder`.
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
  py::class_<RungCost> cost(m, "RungCost",
                            "Computing time of one rung of the refinement, for one pose.");
  const auto terms = std::make_tuple(
      field("fixed_s", &RungCost::fixed_s, "constant part [s]"),
      field("per_lamp_s", &RungCost::per_lamp_s, "for each lamp [s]"),
      field("per_rim_point_s", &RungCost::per_rim_point_s, "for each rim point [s]"),
      field("per_pixel_s", &RungCost::per_pixel_s, "for each pixel around the lamps [s]"));
  define_value(cost, terms);
  define_repr(cost, "RungCost", terms);

  py::class_<RungCosts> costs(m, "RungCosts",
                              R"(Computing time of each rung on a machine, for locate(costs=...).

`libocc ladder --costs FILE.yaml` measures them. The defaults were measured on one core of an x86-64
server of about 2.5 GHz.)");
  const auto rungs =
      std::make_tuple(field("points", &RungCosts::points, "RungCost of Rung.points"),
                      field("centres", &RungCosts::centres, "RungCost of Rung.centres"),
                      field("rims", &RungCosts::rims, "RungCost of Rung.rims"),
                      field("direct", &RungCosts::direct, "RungCost of Rung.direct"));
  define_value(costs, rungs);
  define_repr(costs, "RungCosts", rungs);
  costs
      .def_static(
          "load", [](const Path& path) { return reading(path, &read_rung_costs); }, py::arg("path"),
          "Reads a YAML file. Raises: FileNotFoundError or OSError when it cannot be opened,\n"
          "ValueError naming file, line and key when its content is wrong.")
      .def(
          "save",
          [](const RungCosts& c, const Path& path) {
            writing(path, [&](const std::string& name) { write_rung_costs(name, c); });
          },
          py::arg("path"),
          "Writes a YAML file. After an error the file is unchanged. Raises: OSError.");
}

void define_choice(py::module_& m) {
  ResultClass<RungForecast>(m, "RungForecast", "Predicted time and error of a rung.")
      .def_readonly("rung", &RungForecast::rung, "Rung.")
      .def_readonly("predicted_s", &RungForecast::predicted_s,
                    "Predicted time of the refinement [s].")
      .def_readonly("predicted_sigma_m", &RungForecast::predicted_sigma_m,
                    "Predicted root of the trace of the position's covariance [m]; None if the "
                    "choice did not depend on it.")
      .def("__repr__", [](const RungForecast& f) {
        return "<RungForecast: " + std::string(to_string(f.rung)) + ", " +
               value_repr(f.predicted_s) + " s, sigma " + value_repr(f.predicted_sigma_m) + " m>";
      });
  ResultClass<RungChoice>(m, "RungChoice", "Rung of the refinement, with the reason.")
      .def_readonly("rung", &RungChoice::rung, "Rung.")
      .def_readonly("predicted_s", &RungChoice::predicted_s,
                    "Predicted time of the refinement [s].")
      .def_readonly("predicted_sigma_m", &RungChoice::predicted_sigma_m,
                    "Predicted root of the trace of the position's covariance [m]; if it was not "
                    "predicted, the bound at the fix.")
      .def_readonly("met", &RungChoice::met, "True if the prediction meets budget and target.")
      .def_readonly("reason", &RungChoice::reason,
                    "A sentence; if not met, it states what would be needed.")
      .def_readonly("alternatives", &RungChoice::alternatives,
                    "RungForecast of each rung considered, fastest first.")
      .def("__repr__", [](const RungChoice& c) {
        return "<RungChoice: " + std::string(to_string(c.rung)) + (c.met ? "" : ", not met") + ">";
      });
}

void define_steps(py::module_& m) {
  py::class_<LadderStep>(m, "LadderStep", "A method that computes a pose from assigned blobs.")
      .def_readonly("name", &LadderStep::name, "Name, as ladder_frame() accepts it.")
      .def_readonly("family", &LadderStep::family, "Package of the implementation.")
      .def_readonly("what", &LadderStep::what, "Description for tables.")
      .def_readonly("observations", &LadderStep::observations,
                    "Rung whose observations it uses; they determine its bound.")
      .def("__repr__",
           [](const LadderStep& s) { return "<LadderStep: " + std::string(s.name) + ">"; });
  m.def("ladder_steps", &ladder_steps,
        "Returns all methods, roughly from the fastest to the slowest.");
  m.def(
      "missing_ladder_steps",
      [] {
        py::typing::Dict<py::str, py::str> options;
        for (const MissingMethod& step : missing_ladder_steps()) options[step.name] = step.option;
        return options;
      },
      "Returns the methods that this build lacks, with the CMake option that includes each.");

  using B = LadderBound;
  ResultClass<B>(m, "LadderBound", "Root mean square errors at the true pose; 0: no bound.")
      .def_readonly("position_m", &B::position_m, "Cramer-Rao bound [m].")
      .def_readonly("rotation_rad", &B::rotation_rad, "Cramer-Rao bound [rad].")
      .def_readonly("position_expected_m", &B::position_expected_m,
                    "Bound plus the bias of Rung.points [m].")
      .def_readonly("rotation_expected_rad", &B::rotation_expected_rad,
                    "Bound plus the bias of Rung.points [rad].")
      .def("__repr__",
           [](const B& b) { return "<LadderBound: " + value_repr(b.position_m) + " m>"; });

  using O = LadderOutcome;
  ResultClass<O>(m, "LadderOutcome", "Time and error of one method on one image.")
      .def_readonly("name", &O::name, "Name of the method.")
      .def_readonly("answered", &O::answered, "True if it returned a pose.")
      .def_readonly("cam_from_world", &O::cam_from_world, "Pose, 4x4.")
      .def_readonly("time_s", &O::time_s, "Mean time of a call [s].")
      .def_readonly("position_error_m", &O::position_error_m,
                    "Distance from the true position [m].")
      .def_readonly("rotation_error_rad", &O::rotation_error_rad,
                    "Angle between the true and the computed rotation [rad].")
      .def_readonly("bound", &O::bound, "LadderBound of the method's observations.")
      .def("__repr__", [](const O& o) { return "<LadderOutcome: " + std::string(o.name) + ">"; });
}

/// Results of the selected methods on one image.
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
  if (problem.matches.empty()) return frame;
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
  ResultClass<F>(m, "LadderFrame", "Times and errors of several methods on one image.")
      .def_readonly("detect_s", &F::detect_s, "Time of the detection [s].")
      .def_readonly("pixels", &F::pixels, "LadderBound of all pixels (Rung.direct).")
      .def_readonly("points", &F::points, "LadderBound of the centroids (Rung.points).")
      .def_readonly("points_in_world_m", &F::points_in_world_m,
                    "(n, 3) centres of the matched lamps [m, world].")
      .def_readonly("points_px", &F::points_px, "(n, 2) centroids of their blobs [px].")
      .def_readonly("outcomes", &F::outcomes, "LadderOutcome of each method that the lamps allow.")
      .def("__repr__", [](const F& f) {
        return "<LadderFrame: " + std::to_string(f.points_px.rows()) + " lamps>";
      });
  m.def("ladder_frame", &ladder_frame, py::arg("image"), py::arg("scene"),
        py::arg("cam_from_world"), py::arg("steps"), py::arg("min_time_s") = 5e-5,
        R"(Runs and times methods of the ladder on an image with known pose.

cam_from_world: true pose, 4x4. steps: names in ladder_steps(); methods that do not suit the number
or the layout of the lamps are left out. min_time_s: each method is called repeatedly for at least
this CPU time.
Returns: LadderFrame; with fewer than three lamps it has no outcomes, unless one is a rectangle.
Raises: ValueError for an unknown method or an image that does not have the camera's size.)");
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
      "Times the refinement alone, from a pose 9 mm and 0.6 degrees off. Returns: (lamps, rim "
      "points, pixels, time [s]); the time is 0 if the refinement failed.");
}

}  // namespace

void define_ladder(py::module_& m) {
  define_costs(m);
  define_choice(m);
  define_steps(m);
  define_frame(m);
}

}  // namespace occ::python
