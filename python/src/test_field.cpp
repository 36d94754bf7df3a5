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
      field("camera", &D::camera, "camera of all images"),
      field("free_parameters", &D::free_parameters, "its unknown parameters"),
      field("room_m", &D::room_m, "size of the room [m]"),
      field("stations", &D::stations, "number of stations"),
      field("station_height_m", &D::station_height_m, "[m]"),
      field("station_height_step_m", &D::station_height_step_m,
            "difference of alternating heights [m]"),
      field("station_ring", &D::station_ring, "semi-axes over the room's half sides"),
      field("station_tilt_rad", &D::station_tilt_rad, "amount of the random tilt"),
      field("targets", &D::targets, "number of points on walls and ceiling"),
      field("lowest_target_m", &D::lowest_target_m, "[m]"),
      field("ceiling", &D::ceiling, "the ceiling has targets, too"),
      field("tags", &D::tags, "number of additional AprilTags, on the walls"),
      field("tag_side_m", &D::tag_side_m, "outer side of the black border [m]"),
      field("sigma_px", &D::sigma_px, "standard deviation of an image point, column and row [px]"),
      field("start_error_m", &D::start_error_m, "standard deviation of the start values [m]"),
      field("seed", &D::seed, "seed of all random numbers"));
}

auto source_fields() {
  using S = ScaleSource;
  return std::make_tuple(
      required_field("name", &S::name, "label"), field("bars", &S::bars, "number of scale bars"),
      field("bar_m", &S::bar_m, "length of each [m]"), field("bar_sigma_m", &S::bar_sigma_m, "[m]"),
      field("distances", &S::distances, "number of distances between targets"),
      field("distance_m", &S::distance_m, "approximate length [m]"),
      field("distance_sigma_m", &S::distance_sigma_m, "[m]"),
      field("tags", &S::tags, "number of tags of known size"),
      field("tag_side_m", &S::tag_side_m, "[m]"));
}

}  // namespace

void define_test_field(py::module_& m) {
  py::class_<TestFieldDesign> design(
      m, "TestFieldDesign", "Design of a test field: a room with targets, stations and a camera.");
  define_value(design, design_fields());
  define_repr(design, "TestFieldDesign", design_fields());
  ResultClass<TestField>(m, "TestField", "A simulated network with noise, and without.")
      .def_readonly("network", &TestField::network, "Network with noisy pixels and start values.")
      .def_readonly("truth", &TestField::truth, "Network without errors.");
  py::class_<ScaleSource> source(m, "ScaleSource", "Source of a network's scale.");
  define_value(source, source_fields());
  define_repr(source, "ScaleSource", source_fields());
  ResultClass<ScalePrediction>(m, "ScalePrediction", "Predicted precision with a ScaleSource.")
      .def_readonly("name", &ScalePrediction::name, "Label of the source.")
      .def_readonly("scale_sigma", &ScalePrediction::scale_sigma,
                    "Relative standard deviation of the scale.")
      .def_readonly("point_sigma_m", &ScalePrediction::point_sigma_m,
                    "R.m.s. of the points' 3D standard deviation.")
      .def_readonly("at_10_m_sigma_m", &ScalePrediction::at_10_m_sigma_m,
                    "Standard deviation of the distance nearest 10 m.");
  m.def("paper_panorama_camera", &paper_panorama_camera,
        "Returns the panorama camera of the published precision table that the default design "
        "reproduces: a rotating line with a 35 mm lens, 10 200 pixels of 8 um and 40 000 columns.");
  m.def("paper_additional_parameters", &paper_additional_parameters,
        "Returns the names of its nine additional parameters: all except e_z and the tumbling.");
  m.def("simulate_test_field", &simulate_test_field, py::arg("design"),
        py::call_guard<py::gil_scoped_release>(),
        R"(Simulates the network of a TestFieldDesign. Raises: ValueError for an invalid design.)");
  m.def(
      "compare_scale",
      [](const TestFieldDesign& d, const std::vector<ScaleSource>& sources) {
        const Predictions found = compare_scale(d, sources);
        if (!found.ok()) throw std::invalid_argument(found.message);
        return found.value;
      },
      py::arg("design"), py::arg("sources"), py::call_guard<py::gil_scoped_release>(),
      R"(Predicts the precision of a test field with each ScaleSource, before any image is taken.

Returns: a ScalePrediction for each. Raises: ValueError for an invalid or undetermined design.)");
}

}  // namespace occ::python
