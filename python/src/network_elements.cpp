// SPDX-License-Identifier: Apache-2.0
// Properties of a Network that describe rigs, fixed elements, control and priors.
#include <tuple>

#include "libocc/network/network.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

/// Values of one member of all elements of a list.
template <class List, class Get>
auto each(const List& list, Get get) {
  std::vector<std::decay_t<decltype(get(list.front()))>> all;
  for (const auto& item : list) all.push_back(get(item));
  return all;
}

void define_rigs(py::class_<Network>& network) {
  network
      .def_property_readonly(
          "station_poses",
          [](const Network& n) {
            return each(n.stations, [](const auto& s) { return s.station_from_world; });
          },
          "station_from_world of each station, 4x4.")
      .def_property_readonly(
          "stations_fixed",
          [](const Network& n) { return each(n.stations, [](const auto& s) { return s.fixed; }); },
          "True for each station whose pose is error-free.")
      .def_property_readonly(
          "mount_names",
          [](const Network& n) { return each(n.mounts, [](const auto& m) { return m.name; }); },
          "Names of the mounts.")
      .def_property_readonly(
          "mount_poses",
          [](const Network& n) {
            return each(n.mounts, [](const auto& m) { return m.cam_from_station; });
          },
          "cam_from_station of each mount, 4x4.")
      .def_property_readonly(
          "mounts_fixed",
          [](const Network& n) { return each(n.mounts, [](const auto& m) { return m.fixed; }); },
          "True for each mount whose pose is error-free.")
      .def_property_readonly(
          "image_stations",
          [](const Network& n) { return each(n.images, [](const auto& i) { return i.station; }); },
          "Station index of each image.")
      .def_property_readonly(
          "image_mounts",
          [](const Network& n) { return each(n.images, [](const auto& i) { return i.mount; }); },
          "Mount index of each image; -1: the station is the camera.")
      .def_property_readonly(
          "points_fixed",
          [](const Network& n) { return each(n.points, [](const auto& p) { return p.fixed; }); },
          "True for each point that is error-free.")
      .def_property_readonly(
          "bodies_fixed",
          [](const Network& n) { return each(n.bodies, [](const auto& b) { return b.fixed; }); },
          "True for each body whose pose and scale are error-free.")
      .def_property_readonly(
          "bodies_scale_free",
          [](const Network& n) {
            return each(n.bodies, [](const auto& b) { return b.scale_free; });
          },
          "True for each body whose size is unknown.");
}

void define_knowledge(py::class_<Network>& network) {
  network
      .def_property_readonly(
          "distances",
          [](const Network& n) {
            return each(n.distances, [](const DistanceObservation& d) {
              return std::make_tuple(d.from, d.to, d.length_m, d.sigma_m, d.used);
            });
          },
          "Measured distances: from, to, length [m], sigma [m], used.")
      .def_property_readonly(
          "control",
          [](const Network& n) {
            return each(n.control, [](const ControlPoint& c) {
              return std::make_tuple(c.target, c.position_m, c.covariance_m2);
            });
          },
          "Control points: target, position (3,) [m], covariance (3, 3) [m^2].")
      .def_property_readonly(
          "parameter_priors",
          [](const Network& n) {
            return each(n.parameter_priors, [](const ParameterPrior& p) {
              return std::make_tuple(p.camera, p.parameter, p.value, p.sigma);
            });
          },
          "Prior knowledge of camera parameters: camera, name, value, sigma.")
      .def_property_readonly(
          "pose_priors",
          [](const Network& n) {
            return each(n.pose_priors, [](const PosePrior& p) {
              return std::make_tuple(p.station, p.station_from_world, p.covariance);
            });
          },
          "Prior knowledge of poses: station, station_from_world 4x4, covariance (6, 6).");
}

}  // namespace

void define_network_elements(py::class_<Network>& network) {
  define_rigs(network);
  define_knowledge(network);
}

void define_free_parameters(py::module_& m) {
  m.def("free_parameter_directions", &free_parameter_directions, py::arg("camera"),
        py::arg("free_parameters"),
        R"(Returns the derivatives of camera.parameters (rows) by free parameters (columns).

Columns are unit vectors; "f_px", which scales fx_px and fy_px together, has 1 and fy_px / fx_px. With
the covariance C of the free parameters, D C D^T is the covariance for with_parameter_covariance().
Raises: ValueError for a name that is not a free parameter of the camera.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=500, fy_px=510, cx_px=320, cy_px=240)
>>> occ.network.free_parameter_directions(camera, ["f_px"]).ravel().tolist()
[1.0, 1.02, 0.0, 0.0, 0.0])");
  m.def(
      "free_parameter_value",
      [](const Camera& camera, const std::string& name) { return free_parameter(camera, name); },
      py::arg("camera"), py::arg("name"),
      "Returns the CameraParameter of a free parameter; the value of \"f_px\" is fx_px. Raises: "
      "ValueError for a name that is not a free parameter of the camera.");
}

}  // namespace occ::python
