// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/trajectory.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include "casters.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/motion.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

Trajectory make_trajectory(const std::vector<double>& times_s, const std::vector<Rigid3>& poses) {
  require(times_s.size() == poses.size(), "cam_from_world", poses.size(),
          "as many as times_s: " + std::to_string(times_s.size()));
  std::vector<Waypoint> waypoints;
  for (std::size_t i = 0; i < times_s.size(); ++i) waypoints.push_back({times_s[i], poses[i]});
  return Trajectory(std::move(waypoints));
}

std::vector<double> times_of(const Trajectory& trajectory) {
  std::vector<double> times_s;
  for (const Waypoint& waypoint : trajectory.waypoints()) times_s.push_back(waypoint.time_s);
  return times_s;
}

std::vector<Rigid3> poses_of(const Trajectory& trajectory) {
  std::vector<Rigid3> poses;
  for (const Waypoint& waypoint : trajectory.waypoints()) poses.push_back(waypoint.cam_from_world);
  return poses;
}

Trajectory parse_text(const std::string& text) {
  try {
    return parse_trajectory(text);
  } catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

void define_times_and_poses(py::class_<Trajectory>& cls) {
  cls.def_property_readonly("times_s", &times_of, "Times of the waypoints [s].")
      .def_property_readonly("poses", &poses_of, "cam_from_world of the waypoints, 4x4 each.")
      .def_property_readonly("begin_s", &Trajectory::begin_s, "Time of the first waypoint [s].")
      .def_property_readonly("end_s", &Trajectory::end_s, "Time of the last waypoint [s].")
      .def("cam_from_world", &Trajectory::cam_from_world, py::arg("time_s"),
           "Returns the pose at a time, 4x4. Raises: ValueError before the first waypoint or after "
           "the last.")
      .def(
          "velocity",
          [](const Trajectory& t, double time_s, std::optional<double> to_s) {
            return to_s ? t.velocity(time_s, *to_s) : t.velocity(time_s);
          },
          py::arg("time_s"), py::arg("to_s") = py::none(),
          "Returns the velocity (6,) as defined by simulate() [rad/s, m/s] at time_s; with to_s, "
          "the constant velocity from the pose at time_s to the pose at to_s.");
}

}  // namespace

void define_trajectory(py::module_& m) {
  py::class_<Trajectory> cls(m, "Trajectory",
                             R"(Poses of a camera over time, interpolated between waypoints.

times_s: increasing times of the waypoints. cam_from_world: the pose at each, 4x4. Between waypoints
the camera moves on a screw at constant velocity (the geodesic of SE(3)), rotating by less than pi.
Raises: ValueError naming the waypoint.

>>> import libocc as occ
>>> poses = [occ.look_at(position_m=[x, 0, 1], target_m=[x, 0, 3], up=[0, 1, 0]) for x in (1, 2)]
>>> walk = occ.Trajectory(times_s=[0, 2], cam_from_world=poses)
>>> walk.velocity(0.5).round(3).tolist()
[0.0, 0.0, 0.0, 0.5, 0.0, 0.0])");
  cls.def(py::init(&make_trajectory), py::arg("times_s"), py::arg("cam_from_world"))
      .def_static(
          "load", [](const std::filesystem::path& path) { return reading(path, &read_trajectory); },
          py::arg("path"),
          R"(Reads waypoints in YAML, or a file in TUM's format.

TUM's format has lines `t tx ty tz qx qy qz qw`, the camera's pose in the world.
Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file and line.)")
      .def(
          "save",
          [](const Trajectory& trajectory, const std::filesystem::path& path) {
            writing(path, [&](const std::string& name) { write_trajectory(name, trajectory); });
          },
          py::arg("path"), "Writes a file in TUM's format. After an error the file is unchanged.")
      .def_static("parse", &parse_text, py::arg("text"),
                  "Reads text as load() does. Raises: ValueError naming the line.")
      .def("format", &format_trajectory, "Returns the text that save() writes.")
      .def("__len__", [](const Trajectory& t) { return t.waypoints().size(); })
      .def("__repr__",
           [](const Trajectory& t) {
             return "<Trajectory: " + std::to_string(t.waypoints().size()) + " waypoints, " +
                    std::to_string(t.end_s() - t.begin_s()) + " s>";
           })
      .def(py::pickle([](const Trajectory& t) { return py::make_tuple(times_of(t), poses_of(t)); },
                      [](const py::typing::Tuple<std::vector<double>, std::vector<Rigid3>>& state) {
                        return make_trajectory(state[0].cast<std::vector<double>>(),
                                               state[1].cast<std::vector<Rigid3>>());
                      }));
  define_times_and_poses(cls);
  m.def("moved_pose", &moved_pose, py::arg("cam_from_world"), py::arg("velocity"),
        py::arg("time_s"),
        "Returns the pose (4x4) after time_s of constant velocity (6,), as defined by simulate().");
}

}  // namespace occ::python
