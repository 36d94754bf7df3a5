// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/headlights.hpp"

#include <pybind11/stl.h>

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using R = Result<HeadlightDistance>;
using H = HeadlightDistance;

py::array_t<double> array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void define_classes(py::module_& m) {
  using G = RoadHeights;
  define_documented<G>(
      m, "RoadHeights", "Heights above the road, and the direction of the vertical.",
      std::make_tuple(field("lamps_m", &G::lamps_m, "height of the lamps [m]"),
                      field("lamps_sigma_m", &G::lamps_sigma_m, "its standard deviation [m]"),
                      field("camera_m", &G::camera_m, "height of the camera [m]"),
                      field("camera_sigma_m", &G::camera_sigma_m, "its standard deviation [m]"),
                      field("up_in_cam", &G::up_in_cam,
                            "(3,) normal of the road, unit vector in the camera frame"),
                      field("up_sigma_rad", &G::up_sigma_rad,
                            "standard deviation of the pitch between camera and road [rad]")));
  ResultClass<R> cls(m, "HeadlightDistance",
                     R"(Result of headlight_distance().

If the status is degenerate, only the bearing is valid.)");
  define_result(cls);
  cls.def_property_readonly("distance_m", value_of(&H::distance_m), "Mean distance [m].")
      .def_property_readonly("sigma_m", value_of(&H::sigma_m),
                             "Standard deviation of the distance [m].")
      .def_property_readonly("low_m", value_of(&H::low_m), "Lower end of the 95 % interval [m].")
      .def_property_readonly("high_m", value_of(&H::high_m), "Upper end of the 95 % interval [m].")
      .def_property_readonly("bearing_rad", value_of(&H::bearing_rad),
                             "Direction of the bisector, from the camera's z towards x [rad].")
      .def_property_readonly("direction_in_cam", value_of(&H::direction_in_cam),
                             "(3,) unit vector of the bisector, camera frame.")
      .def_property_readonly("separation_rad", value_of(&H::separation_rad),
                             "Angle between the lamps [rad].")
      .def_property_readonly("separation_sigma_rad", value_of(&H::separation_sigma_rad),
                             "Standard deviation of this angle [rad].")
      .def_property_readonly(
          "yaw_rad", [](const R& r) { return array_of(r.value.yaw_rad); },
          "(n,) nodes of the yaw [rad].")
      .def_property_readonly(
          "distance_of_yaw_m", [](const R& r) { return array_of(r.value.distance_of_yaw_m); },
          "(n,) distance at each yaw, from the images of the lamps alone [m].")
      .def_property_readonly(
          "yaw_density", [](const R& r) { return array_of(r.value.yaw_density); },
          "(n,) posterior density of the yaw [1/rad].")
      .def("__repr__", [](const R& r) {
        return "<HeadlightDistance: " + std::string(to_string(r.status)) + ", " +
               value_repr(r.value.low_m) + " to " + value_repr(r.value.high_m) + " m>";
      });
}

auto headlight_fields() {
  using O = HeadlightOptions;
  return std::make_tuple(
      field("separation_m", &O::separation_m, "distance between the lamps' centres [m]"),
      field("separation_sigma_m", &O::separation_sigma_m, "its standard deviation [m]"),
      field("sigma_px", &O::sigma_px, "standard deviation of a lamp's pixel coordinates"),
      field("yaw_max_rad", &O::yaw_max_rad, "maximum of |yaw|, below pi/2 [rad]"),
      field("yaw_concentration", &O::yaw_concentration,
            "kappa of the von Mises prior of the yaw; 0: uniform"),
      field("heights", &O::heights, "RoadHeights if known, else None"));
}

void define_vehicles(py::module_& m) {
  using V = VehiclePose;
  ResultClass<V>(m, "VehiclePose", "Pose of a vehicle relative to the camera.")
      .def_readonly("pose", &V::pose, "Candidate; its world frame is the vehicle's frame.")
      .def_readonly("distance_m", &V::distance_m, "Distance of the vehicle's origin [m].")
      .def_readonly("sigma_m", &V::sigma_m, "Standard deviation of the distance [m].")
      .def_readonly("yaw_rad", &V::yaw_rad,
                    "Angle about up from the line to the camera to the vehicle's x axis [rad].")
      .def_readonly("yaw_sigma_rad", &V::yaw_sigma_rad, "Standard deviation of the yaw [rad].")
      .def("__repr__", [](const V& v) {
        return "<VehiclePose: " + value_repr(v.distance_m) + " m, yaw " + value_repr(v.yaw_rad) +
               " rad>";
      });
  using P = Result<std::vector<V>>;
  ResultClass<P> poses(m, "VehiclePoses", "All plausible upright poses of a vehicle.");
  define_result(poses);
  poses
      .def_property_readonly(
          "value", [](const P& p) { return p.value; }, "List of VehiclePose, best first.")
      .def("__repr__", [](const P& p) {
        return "<VehiclePoses: " + std::string(to_string(p.status)) + ", " +
               std::to_string(p.value.size()) + ">";
      });
  m.def(
      "vehicle_poses",
      [](const Rows3& lamps_m, const Rows2& lamps_px, const Camera& camera, double sigma_px,
         const Eigen::Vector3d& up_in_cam, double max_tilt_rad) {
        return vehicle_poses(lamps_m.transpose(), lamps_px.transpose(), camera, sigma_px, up_in_cam,
                             max_tilt_rad);
      },
      py::arg("lamps_m"), py::arg("lamps_px"), py::arg("camera"), py::arg("sigma_px"),
      py::kw_only(), py::arg("up_in_cam") = Eigen::Vector3d(0, -1, 0),
      py::arg("max_tilt_rad") = 0.3,
      R"(Computes the poses of a vehicle from three or more lamps of known position on it.

lamps_m: (n, 3) in the vehicle's frame: x forward, y left, z up; n >= 3, not on a line.
lamps_px: (n, 2). sigma_px: standard deviation of a pixel coordinate. up_in_cam: (3,) vertical, unit
vector in the camera frame. max_tilt_rad: maximum angle between the vehicle's z and up_in_cam.
Returns: VehiclePoses; status as for solve_pose(), and no_pose if no pose is upright.
Raises: ValueError for counts that differ or numbers that are not finite.)");
}

}  // namespace

void define_headlights(py::module_& m) {
  define_classes(m);
  define_vehicles(m);
  const auto fields = headlight_fields();
  define_function(
      m, "headlight_distance", fields,
      [](HeadlightOptions options, const Rows2& lamps_px, const Camera& camera) {
        require(lamps_px.rows() == 2, "lamps_px", lamps_px.rows(), "two rows");
        return headlight_distance(lamps_px.transpose(), camera, options);
      },
      py::arg("lamps_px"), py::arg("camera"), py::kw_only(),
      (R"(Estimates the distance of a car of unknown yaw from the images of its two headlights.

lamps_px: (2, 2), one lamp in each row. The unknown yaw leaves an interval of distances; known
heights above the road make it shorter. Equations: libocc/locate/headlights.hpp.
Returns: HeadlightDistance; status degenerate if the lamps are less than five sigmas apart, no_pose
if no yaw agrees with the heights.
Raises: ValueError for numbers that are not finite, pixels outside the lens model, or an option out
of range.)" +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
