// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/camera.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include "fields.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene_file.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

std::string camera_repr(const Camera& camera) {
  std::string text =
      "Camera.pinhole(width=" + value_repr(camera.width()) +
      ", height=" + value_repr(camera.height()) + ", fx_px=" + value_repr(camera.fx_px()) +
      ", fy_px=" + value_repr(camera.fy_px()) + ", cx_px=" + value_repr(camera.cx_px()) +
      ", cy_px=" + value_repr(camera.cy_px());
  if (!camera.distortion().empty()) text += ", distortion=" + value_repr(camera.distortion());
  if (camera.skew_px() != 0) text += ", skew_px=" + value_repr(camera.skew_px());
  return text + ")";
}

using State = py::typing::Tuple<py::object, py::ellipsis>;

State camera_state(const Camera& c) {
  return py::make_tuple(c.width(), c.height(), c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px(),
                        c.distortion(), c.skew_px());
}

Camera camera_from_state(const State& s) {
  return Camera::pinhole(s[0].cast<int>(), s[1].cast<int>(), s[2].cast<double>(),
                         s[3].cast<double>(), s[4].cast<double>(), s[5].cast<double>(),
                         s[6].cast<std::vector<double>>(), s[7].cast<double>());
}

void define_poses(py::module_& m) {
  m.def("look_at", &look_at, py::arg("position_m"), py::arg("target_m"),
        py::arg_v("up", Eigen::Vector3d(0, 0, 1), "(0, 0, 1)"),
        R"(cam_from_world (4x4) of a camera at position_m [m, world] that looks at target_m.

The image's up direction is as near to `up` as it can be.
Raises: ValueError when target and position coincide or the view is along `up`.

>>> import libocc as occ
>>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
>>> (pose @ [0.5, 0.25, 3, 1]).round(9).tolist()
[-0.5, -0.25, 2.0, 1.0])");
  m.def(
      "heading_rad", [](const Rigid3& pose) { return heading_rad(pose); },
      py::arg("cam_from_world"),
      "Azimuth [rad] about the world's Z of the camera's +x axis (image right), in (-pi, pi].");
  m.def(
      "position_covariance",
      [](const Rigid3& pose, const Matrix6& covariance) {
        return position_covariance(pose, covariance);
      },
      py::arg("cam_from_world"), py::arg("covariance"),
      "3x3 covariance [m^2, world] of the camera's position, from the 6x6 one of cam_from_world.");
}

}  // namespace

void define_camera(py::module_& m) {
  py::class_<Camera> camera(m, "Camera", R"(A pinhole camera with OpenCV's lens distortion.

Pixel (0, 0) is the centre of the first pixel; camera axes: x right, y down, z forward.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
>>> camera.project([0.1, 0, 2]).tolist()
[339.5, 239.5])");
  camera
      .def_static("pinhole", &Camera::pinhole, py::kw_only(), py::arg("width"), py::arg("height"),
                  py::arg("fx_px"), py::arg("fy_px"), py::arg("cx_px"), py::arg("cy_px"),
                  py::arg_v("distortion", std::vector<double>{}, "[]"), py::arg("skew_px") = 0.0,
                  R"(Camera of a size, focal lengths and principal point in pixels.

distortion: 0, 4, 5, 8, 12 or 14 coefficients in OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6 s1 ...
Raises: ValueError naming the argument and its value.)")
      .def_property_readonly("width", &Camera::width, "Columns [px].")
      .def_property_readonly("height", &Camera::height, "Rows [px].")
      .def_property_readonly("fx_px", &Camera::fx_px, "Focal length along a row [px].")
      .def_property_readonly("fy_px", &Camera::fy_px, "Focal length along a column [px].")
      .def_property_readonly("cx_px", &Camera::cx_px, "Principal point, column [px].")
      .def_property_readonly("cy_px", &Camera::cy_px, "Principal point, row [px].")
      .def_property_readonly("skew_px", &Camera::skew_px, "Skew [px].")
      .def_property_readonly("distortion", &Camera::distortion, "Coefficients, OpenCV's order.")
      .def_property_readonly("matrix", &Camera::matrix, "K, 3x3.")
      .def_property_readonly("max_angle_rad", &Camera::max_angle_rad,
                             "Largest angle from the optical axis the lens model covers [rad].")
      .def(
          "project", [](const Camera& c, const Eigen::Vector3d& p) { return c.project(p); },
          py::arg("point_in_cam_m"),
          "Pixel (2,) of a point (3,) in the camera's frame [m]; None outside the lens model.")
      .def(
          "unproject", [](const Camera& c, const Eigen::Vector2d& p) { return c.unproject(p); },
          py::arg("pixel"), "Unit bearing (3,) of a pixel (2,); None outside the lens model.")
      .def("contains", &Camera::contains, py::arg("pixel"), "Whether a pixel is on the sensor.")
      .def("__repr__", &camera_repr)
      .def("__eq__",
           [](const Camera& a, const py::object& b) {
             return py::isinstance<Camera>(b) &&
                    camera_state(a).equal(camera_state(b.cast<const Camera&>()));
           })
      .def("__hash__", [](const Camera& c) { return py::hash(py::str(camera_repr(c))); })
      .def(py::pickle(&camera_state, &camera_from_state));

  m.def(
      "read_camera", [](const std::filesystem::path& path) { return reading(path, &read_camera); },
      py::arg("path"),
      R"(Camera from an OpenCV or ROS camera YAML file, or from a scene file.

Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key.)");
  define_poses(m);
}

}  // namespace occ::python
