// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/test_field.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Predictions = Result<std::vector<ScalePrediction>>;

auto design_fields() {
  using D = TestFieldDesign;
  return std::make_tuple(
      field("camera", &D::camera, "that takes the pictures"),
      field("free_parameters", &D::free_parameters, "of it, that are unknown"),
      field("room_m", &D::room_m, "its size [m]"), field("stations", &D::stations, "how many"),
      field("station_height_m", &D::station_height_m, "[m]"),
      field("station_height_step_m", &D::station_height_step_m, "they alternate by it [m]"),
      field("station_ring", &D::station_ring, "of the room's half sides"),
      field("station_tilt_rad", &D::station_tilt_rad, "how much they are tilted"),
      field("targets", &D::targets, "points on walls and ceiling"),
      field("lowest_target_m", &D::lowest_target_m, "[m]"),
      field("ceiling", &D::ceiling, "has targets, too"),
      field("tags", &D::tags, "AprilTags besides, on the walls"),
      field("tag_side_m", &D::tag_side_m, "of the black border's outside [m]"),
      field("sigma_px", &D::sigma_px, "of a seen place, column and row [px]"),
      field("start_error_m", &D::start_error_m, "of the network's starts [m]"),
      field("seed", &D::seed, "of everything random"));
}

auto source_fields() {
  using S = ScaleSource;
  return std::make_tuple(
      required_field("name", &S::name, "for the table"), field("bars", &S::bars, "how many"),
      field("bar_m", &S::bar_m, "length of each [m]"), field("bar_sigma_m", &S::bar_sigma_m, "[m]"),
      field("distances", &S::distances, "between targets, how many"),
      field("distance_m", &S::distance_m, "so far apart [m]"),
      field("distance_sigma_m", &S::distance_sigma_m, "[m]"),
      field("tags", &S::tags, "of known size, how many"),
      field("tag_side_m", &S::tag_side_m, "[m]"));
}

}  // namespace

void define_test_field(py::module_& m) {
  py::class_<TestFieldDesign> design(m, "TestFieldDesign",
                                     "A room with targets, stations and a camera, on paper.");
  define_value(design, design_fields());
  define_repr(design, "TestFieldDesign", design_fields());
  ResultClass<TestField>(m, "TestField", "A simulated network and its truth.")
      .def_readonly("network", &TestField::network, "Noisy pixels, starts that are off.")
      .def_readonly("truth", &TestField::truth, "The same without any error.");
  py::class_<ScaleSource> source(m, "ScaleSource", "What could give a network its scale.");
  define_value(source, source_fields());
  define_repr(source, "ScaleSource", source_fields());
  ResultClass<ScalePrediction>(m, "ScalePrediction", "What a ScaleSource is worth.")
      .def_readonly("name", &ScalePrediction::name, "Of the source.")
      .def_readonly("scale_sigma", &ScalePrediction::scale_sigma, "Relative.")
      .def_readonly("point_sigma_m", &ScalePrediction::point_sigma_m, "3D, r.m.s. of the points.")
      .def_readonly("at_10_m_sigma_m", &ScalePrediction::at_10_m_sigma_m,
                    "Of the distance nearest 10 m.");
  m.def("paper_panorama_camera", &paper_panorama_camera,
        "A rotating line: 35 mm lens, 10 200 pixels of 8 um, 40 000 columns.");
  m.def("paper_additional_parameters", &paper_additional_parameters,
        "Its nine: all but ez and the tumbling.");
  m.def("simulate_test_field", &simulate_test_field, py::arg("design"),
        py::call_guard<py::gil_scoped_release>(),
        R"(A network with noise and its truth. Raises: ValueError naming what makes no sense.)");
  m.def(
      "compare_scale",
      [](const TestFieldDesign& d, const std::vector<ScaleSource>& sources) {
        const Predictions found = compare_scale(d, sources);
        if (!found.ok()) throw std::invalid_argument(found.message);
        return found.value;
      },
      py::arg("design"), py::arg("sources"), py::call_guard<py::gil_scoped_release>(),
      R"(Which scale bar is enough? The same field with each ScaleSource; before any picture is taken.

Returns: a ScalePrediction for each. Raises: ValueError; also when a field is not determined.)");
}

}  // namespace occ::python
