// SPDX-License-Identifier: Apache-2.0
// The light of lamps: the Lambertian formulas and the power that a camera receives.
#include <pybind11/typing.h>

#include <memory>

#include "casters.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/received_power.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style>;
/// Anything that numpy converts to an array of numbers.
using Matrices = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Ints = py::array_t<int, py::array::c_style>;
using Bools = py::array_t<bool, py::array::c_style>;

/// Received power at one pose or several; with several, the first axis of the arrays is the pose.
struct Received {
  Doubles lamp_power_w, power_w;
  Ints visible;
  Bools whole;
};

std::vector<Rigid3> poses_of(const Matrices& matrices) {
  const bool fits = (matrices.ndim() == 2 || matrices.ndim() == 3) &&
                    matrices.shape(matrices.ndim() - 1) == 4 &&
                    matrices.shape(matrices.ndim() - 2) == 4;
  if (!fits)
    throw py::value_error("cam_from_world must be of shape (4, 4) or (n, 4, 4), got " +
                          py::cast<std::string>(py::repr(matrices.attr("shape"))));
  const bool many = matrices.ndim() == 3;
  std::vector<Rigid3> poses;
  for (py::ssize_t i = 0; i < (many ? matrices.shape(0) : 1); ++i) {
    using Matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    const std::string name = many ? "cam_from_world[" + std::to_string(i) + "]" : "cam_from_world";
    poses.push_back(
        Rigid3::from_matrix(Eigen::Map<const Matrix>(matrices.data() + 16 * i), name.c_str()));
  }
  return poses;
}

Received received(const Scene& scene, const Matrices& cam_from_world) {
  const std::vector<Rigid3> poses = poses_of(cam_from_world);
  const std::vector<ReceivedPower> all = [&] {
    py::gil_scoped_release unlocked;
    return received_power(scene, poses);
  }();
  std::vector<py::ssize_t> of_poses, of_lamps;
  if (cam_from_world.ndim() == 3) of_poses = {cam_from_world.shape(0)};
  of_lamps = of_poses;
  of_lamps.push_back(static_cast<py::ssize_t>(scene.lamps.size()));
  Received out{Doubles(of_lamps), Doubles(of_poses), Ints(of_poses), Bools(of_lamps)};
  double *lamp_w = out.lamp_power_w.mutable_data(), *total_w = out.power_w.mutable_data();
  int* visible = out.visible.mutable_data();
  bool* whole = out.whole.mutable_data();
  for (const ReceivedPower& one : all) {
    *total_w++ = one.total_w();
    *visible++ = one.visible();
    for (const ReceivedLamp& lamp : one.lamps) {
      *lamp_w++ = lamp.power_w;
      *whole++ = lamp.whole;
    }
  }
  return out;
}

void define_formulas(py::module_& m) {
  m.def("lambertian_order", &lambertian_order, py::arg("half_power_rad"),
        "Returns the Lambertian order m = -ln 2 / ln cos(half_power_rad): 1 for 60 degrees.");
  m.def("radiant_intensity", &radiant_intensity, py::arg("power_w"), py::arg("order"),
        py::arg("cos_emission"),
        "Returns the radiant intensity of a Lambertian lamp [W/sr]; 0 behind it.");
  m.def("radiance", &radiance, py::arg("power_w"), py::arg("order"), py::arg("area_m2"),
        py::arg("cos_emission"), "Returns the radiance of a flat Lambertian lamp [W/(m^2 sr)].");
  m.def("aperture_power", &aperture_power, py::arg("power_w"), py::arg("order"),
        py::arg("cos_emission"), py::arg("cos_incidence"), py::arg("distance_m"),
        py::arg("area_m2"),
        "Returns the power through an aperture [W]; for area_m2 = 1 the irradiance [W/m^2].");
  m.def("dbm", py::vectorize(&dbm), py::arg("power_w"),
        "Returns a power in dBm, decibels over one milliwatt; minus infinity for power 0. Accepts "
        "arrays.");
}

}  // namespace

void define_light(py::module_& m) {
  define_formulas(m);
  ResultClass<Received>(m, "ReceivedPower",
                        "Power of the lamps' light that passes the aperture. With several poses, "
                        "the first axis of the arrays is the pose.")
      .def_readonly("power_w", &Received::power_w, "() or (n,) power of all lamps [W].")
      .def_readonly("lamp_power_w", &Received::lamp_power_w,
                    "(lamps,) or (n, lamps) power of each lamp [W], in the scene's order.")
      .def_readonly("visible", &Received::visible,
                    "() or (n,) number of lamps of which some light arrives.")
      .def_readonly("whole", &Received::whole,
                    "(lamps,) or (n, lamps): the whole face of the lamp is visible.")
      .def("__repr__", [](const Received& r) {
        return "<ReceivedPower: " + (r.power_w.ndim() == 0
                                         ? std::to_string(dbm(*r.power_w.data())) + " dBm, " +
                                               std::to_string(*r.visible.data()) + " lamps visible>"
                                         : std::to_string(r.power_w.size()) + " poses>");
      });
  m.def("received_power", &received, py::arg("scene"), py::arg("cam_from_world"),
        R"(Computes the power of the lamps' light received by the scene's camera.

cam_from_world: one pose (4, 4) or many (n, 4, 4). A lamp counts with the part of its face that is
in the field of view, emits towards the camera and is not occluded by boxes; blinking lamps count as
lit. Returns: ReceivedPower. Raises: ValueError for a matrix that is not a rigid transform.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=64, height=48, fx_px=40, fy_px=40, cx_px=31.5, cy_px=23.5)
>>> scene = occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
>>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
>>> round(occ.photometry.dbm(float(occ.received_power(scene, pose).power_w)), 2)
-59.01)");
}

}  // namespace occ::python
