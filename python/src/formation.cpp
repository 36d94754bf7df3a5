// SPDX-License-Identifier: Apache-2.0
// Projection of a lamp's rim and image centre, and the gradient of its light.
#include "casters.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "module.hpp"

namespace occ::python {

void define_formation(py::module_& m) {
  m.def(
      "project_rim",
      [](const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
         int count) -> std::optional<Eigen::MatrixX2d> {
        const auto rim = project_rim(lamp, cam_from_world, camera, count);
        if (!rim) return std::nullopt;
        return rows_of(*rim);
      },
      py::arg("lamp"), py::arg("cam_from_world"), py::arg("camera"), py::arg("count") = 64,
      R"(Returns the pixels (n, 2) of a lamp's rim, counter-clockwise seen from its lit side.

count: number of pixels; a point lamp has one. Returns None if the lamp's dark side is visible or
part of the rim is outside the lens model.)");
  m.def(
      "project_lamp_centre",
      [](const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera) {
        return project_lamp_centre(lamp, cam_from_world, camera);
      },
      py::arg("lamp"), py::arg("cam_from_world"), py::arg("camera"),
      R"(Returns the pixel (2,) of the centre of a lamp's image; None as for project_rim().

For a disc this is the centre of the ellipse, which differs from the projection of the disc's centre.)");
  m.def("log_irradiance_gradient", &log_irradiance_gradient, py::arg("lamp"),
        py::arg("cam_from_world"), py::arg("camera"), py::arg("sensor"), py::arg("px"),
        R"(Returns the gradient (2,) of the logarithm of a lamp's irradiance at a pixel [1/px].

px: pixel inside the lamp's image. Zero for a point lamp. Multiplied by Blob.light_response_px2, it is the shift
of the measured centroid from project_lamp_centre() that the uneven light causes.)");
}

}  // namespace occ::python
