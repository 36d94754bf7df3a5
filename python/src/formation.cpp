// SPDX-License-Identifier: Apache-2.0
// Where a lamp's image is predicted to be: for pictures and for checks.
#include "casters.hpp"
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
      R"((n, 2) pixels of a lamp's rim, counter-clockwise seen from its lit side; one for a point lamp.

None when the lamp shows its dark side or part of the rim is outside the lens model.)");
  m.def(
      "project_lamp_centre",
      [](const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera) {
        return project_lamp_centre(lamp, cam_from_world, camera);
      },
      py::arg("lamp"), py::arg("cam_from_world"), py::arg("camera"),
      R"((2,) pixel of the centre of a lamp's image: of the ellipse of a disc, which is not where the
disc's own centre projects. None as in project_rim().)");
}

}  // namespace occ::python
