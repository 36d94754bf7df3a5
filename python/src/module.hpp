// SPDX-License-Identifier: Apache-2.0
// Functions that define the parts of the compiled module, in the order of the calls.
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace occ {
struct Network;
}

namespace occ::python {

namespace py = pybind11;

void define_core(py::module_& m);
void define_codes(py::module_& m);
void define_camera(py::module_& m);
void define_effects(py::module_& m);      // called by define_scene
void define_tag(py::module_& m);          // called by define_scene
void define_photometric(py::module_& m);  // called by define_scene
void define_scene(py::module_& m);
void define_formation(py::module_& m);
void define_light(py::module_& m);
void define_trajectory(py::module_& m);
void define_renderer(py::module_& m);  // called by define_simulate
void define_simulate(py::module_& m);
void define_detect(py::module_& m);
void define_identify(py::module_& m);
void define_bound(py::module_& m);   // called by define_locate
void define_ladder(py::module_& m);  // called by define_locate
void define_objects(py::module_& m);
void define_locate(py::module_& m);
void define_decode(py::module_& m);
void define_motion(py::module_& m);
void define_tracker(py::module_& m);
void define_guide(py::module_& m);
void define_guide_plans(py::module_& m);  // called by define_guide
void define_closed_loop(py::module_& m);  // called by define_guide
void define_robust_pose(py::module_& m);  // called by define_pose
void define_april_tags(py::module_& m);   // called by define_pose
void define_headlights(py::module_& m);   // called by define_pose
void define_pose(py::module_& m);
void define_smoother(py::module_& m);
void define_consistency(py::module_& m);
void define_calibrate(py::module_& m);
void define_calibrate_light(py::module_& m);  // called by define_calibrate
void define_network(py::module_& m);
void define_network_elements(py::class_<Network>& network);  // called by define_network
void define_free_parameters(py::module_& m);                 // called by define_network
void define_adjust(py::module_& m);
void define_network_statistics(py::module_& m);
void define_test_field(py::module_& m);
void define_marker_boards(py::module_& m);
void define_targets(py::module_& m);
void define_start_network(py::module_& m);
void define_map_update(py::module_& m);
void define_survey(py::module_& m);

/// Runs `read(path)` without the GIL. Translates its std::runtime_error, with the same message, to
/// FileNotFoundError or OSError when the file cannot be opened, else to ValueError.
template <class Read>
auto reading(const std::filesystem::path& path, Read&& read) {
  try {
    py::gil_scoped_release unlocked;
    return read(path.string());
  } catch (const std::runtime_error& error) {
    std::error_code ignored;
    PyObject* type = PyExc_ValueError;
    if (!std::filesystem::exists(path, ignored)) {
      type = PyExc_FileNotFoundError;
    } else if (std::filesystem::is_directory(path, ignored) || !std::ifstream(path)) {
      type = PyExc_OSError;
    }
    py::set_error(type, error.what());
    throw py::error_already_set();
  }
}

/// Runs `write(path)` without the GIL and translates its std::runtime_error to OSError.
template <class Write>
void writing(const std::filesystem::path& path, Write&& write) {
  try {
    py::gil_scoped_release unlocked;
    write(path.string());
  } catch (const std::runtime_error& error) {
    py::set_error(PyExc_OSError, error.what());
    throw py::error_already_set();
  }
}

}  // namespace occ::python
