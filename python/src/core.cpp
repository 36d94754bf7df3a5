// SPDX-License-Identifier: Apache-2.0
#include <pybind11/native_enum.h>
#include <pybind11/stl/filesystem.h>

#include "casters.hpp"
#include "libocc/core/image_file.hpp"
#include "libocc/core/status.hpp"
#include "module.hpp"

namespace occ::python {

void define_core(py::module_& m) {
  py::native_enum<Status>(m, "Status", "enum.Enum", "Status of a result.")
      .value("ok", Status::ok, "one solution, which fits")
      .value("ambiguous", Status::ambiguous, "several solutions fit equally well")
      .value("no_lamps", Status::no_lamps, "nothing is brighter than the background")
      .value("too_few_lamps", Status::too_few_lamps,
             "fewer identified lamps than the problem needs")
      .value("no_pose", Status::no_pose, "no pose fits the measurements")
      .value("degenerate", Status::degenerate, "the lamps do not determine the pose")
      .value("not_converged", Status::not_converged,
             "the refinement stopped before its tolerance was met")
      .value("budget_not_met", Status::budget_not_met,
             "best possible solution, which misses the requested time or error")
      .finalize();

  m.def(
      "read_image",
      [](const std::filesystem::path& path) { return to_numpy(reading(path, &read_image)); },
      py::arg("path"),
      R"(Reads an 8- or 16-bit image (PNG, JPEG, TIFF, PGM, PPM) without conversion.

Returns: (height, width) array, or (height, width, 3 or 4) in the order red, green, blue;
  uint8 or uint16.
Raises: FileNotFoundError or OSError when the file cannot be opened; ValueError when it is not a
  complete image of a supported format and type; the message names the format of the file.)");

  m.def(
      "write_image",
      [](const std::filesystem::path& path, const NumpyImage& image) {
        writing(path, [&](const std::string& name) { write_image(name, image.view); });
      },
      py::arg("path"), py::arg("image"),
      R"(Writes an image in the format of the name's extension: .png, .jpg, .jpeg, .tif, .tiff, .pgm
(grey), .ppm (colour) or .pnm. After an error the file is unchanged.

Raises: OSError when it cannot be written, or when the format does not store the image.)");

  m.def(
      "encode_image",
      [](const NumpyImage& image, const std::string& extension) {
        try {
          const std::vector<unsigned char> bytes = [&] {
            py::gil_scoped_release unlocked;
            return encode_image(extension, image.view);
          }();
          return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        } catch (const std::runtime_error& error) {
          throw py::value_error(error.what());
        }
      },
      py::arg("image"), py::arg("extension") = ".png",
      "Returns the bytes that write_image() writes to a file with this extension. Raises: "
      "ValueError when the format does not support the image.");
}

}  // namespace occ::python

PYBIND11_MODULE(_core, m) {
  m.doc() = "The compiled part of libocc; use `import libocc`.";
  m.attr("__version__") = LIBOCC_VERSION;
  occ::python::define_core(m);
  occ::python::define_codes(m);
  occ::python::define_camera(m);
  occ::python::define_scene(m);
  occ::python::define_formation(m);
  occ::python::define_light(m);
  occ::python::define_trajectory(m);
  occ::python::define_simulate(m);
  occ::python::define_detect(m);
  occ::python::define_identify(m);
  occ::python::define_objects(m);
  occ::python::define_locate(m);
  occ::python::define_decode(m);
  occ::python::define_motion(m);
  occ::python::define_tracker(m);
  occ::python::define_guide(m);
  occ::python::define_pose(m);
  occ::python::define_smoother(m);
  occ::python::define_consistency(m);
  occ::python::define_calibrate(m);
  occ::python::define_network(m);
  occ::python::define_adjust(m);
  occ::python::define_network_statistics(m);
  occ::python::define_test_field(m);
  occ::python::define_marker_boards(m);
  occ::python::define_targets(m);
  occ::python::define_start_network(m);
  occ::python::define_survey(m);
  occ::python::define_map_update(m);
}
