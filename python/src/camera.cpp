// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/camera.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include "fields.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/camera_file.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

// Keywords of the factory, except width and height, that differ from their defaults.
std::string line_text(const RotatingLine& line) {
  std::string text = ", c_px=" + value_repr(line.c_px) + ", cy_px=" + value_repr(line.cy_px) +
                     ", angle_per_px_rad=" + value_repr(line.angle_per_px_rad);
  const auto add = [&](const char* name, double value) {
    if (value != 0) text += std::string(", ") + name + "=" + value_repr(value);
  };
  add("tilt_x_rad", line.tilt_x_rad);
  add("tilt_y_rad", line.tilt_y_rad);
  if (!line.eccentricity_m.isZero(0)) text += ", eccentricity_m=" + value_repr(line.eccentricity_m);
  add("k1", line.k1);
  add("k2", line.k2);
  for (const double t : line.tumbling_rad)
    if (t != 0) return text + ", tumbling_rad=" + value_repr(line.tumbling_rad);
  return text;
}

std::string camera_repr(const Camera& camera) {
  std::string text = std::string("Camera.") + name_of(camera.kind()) +
                     "(width=" + value_repr(camera.width()) +
                     ", height=" + value_repr(camera.height());
  if (camera.kind() == CameraKind::equirectangular) {
    for (const CameraParameter& parameter : camera.parameters())
      text += ", " + parameter.name + "=" + value_repr(parameter.value);
    return text + ")";
  }
  if (std::isfinite(camera.period_px())) return text + line_text(camera.line()) + ")";
  text += ", fx_px=" + value_repr(camera.fx_px()) + ", fy_px=" + value_repr(camera.fy_px()) +
          ", cx_px=" + value_repr(camera.cx_px()) + ", cy_px=" + value_repr(camera.cy_px());
  if (camera.kind() == CameraKind::double_sphere) {
    const std::vector<CameraParameter> all = camera.parameters();
    return text + ", xi=" + value_repr(all[4].value) + ", alpha=" + value_repr(all[5].value) + ")";
  }
  if (!camera.distortion().empty()) text += ", distortion=" + value_repr(camera.distortion());
  for (const CameraParameter& constant : camera.constants())
    text += ", " + constant.name + "=" + value_repr(constant.value);
  if (camera.skew_px() != 0) text += ", skew_px=" + value_repr(camera.skew_px());
  const auto sigmas = camera.independent_sigmas();
  if (sigmas && !sigmas->empty())
    text += ", parameter_sigmas=" + py::repr(py::cast(*sigmas)).cast<std::string>();
  return text + ")";
}

using Sigmas = std::optional<std::map<std::string, double>>;

Camera with_sigmas(const Camera& camera, const Sigmas& sigmas) {
  return sigmas ? camera.with_parameter_sigmas(*sigmas) : camera;
}

template <Camera (*factory)(int, int, double, double, double, double, const std::vector<double>&,
                            double)>
Camera make_lens(int width, int height, double fx_px, double fy_px, double cx_px, double cy_px,
                 const std::vector<double>& distortion, double skew_px, const Sigmas& sigmas) {
  return with_sigmas(factory(width, height, fx_px, fy_px, cx_px, cy_px, distortion, skew_px),
                     sigmas);
}

Camera make_double_sphere(int width, int height, double fx_px, double fy_px, double cx_px,
                          double cy_px, double xi, double alpha, const Sigmas& sigmas) {
  return with_sigmas(Camera::double_sphere(width, height, fx_px, fy_px, cx_px, cy_px, xi, alpha),
                     sigmas);
}

template <Camera (*factory)(int, int, double, double, double, double, const std::vector<double>&,
                            double, double, double)>
Camera make_brown(int width, int height, double fx_px, double fy_px, double cx_px, double cy_px,
                  const std::vector<double>& distortion, double unit_px, double r0, double skew_px,
                  const Sigmas& sigmas) {
  return with_sigmas(
      factory(width, height, fx_px, fy_px, cx_px, cy_px, distortion, unit_px, r0, skew_px), sigmas);
}

Camera make_equirectangular(int width, int height, std::optional<double> angle_per_px_rad,
                            std::optional<double> fy_px, std::optional<double> cx_px,
                            std::optional<double> cy_px, const Sigmas& sigmas) {
  const double angle = angle_per_px_rad.value_or(2 * pi / width);
  return with_sigmas(Camera::equirectangular(width, height, angle, fy_px.value_or(1 / angle),
                                             cx_px.value_or((width - 1) / 2.0),
                                             cy_px.value_or((height - 1) / 2.0)),
                     sigmas);
}

using State = py::typing::Tuple<py::object, py::ellipsis>;

std::vector<double> values_of(const std::vector<CameraParameter>& parameters) {
  std::vector<double> values;
  for (const CameraParameter& parameter : parameters) values.push_back(parameter.value);
  return values;
}

State camera_state(const Camera& c) {
  return py::make_tuple(
      c.kind(), c.width(), c.height(), c.distortion().size(), values_of(c.parameters()),
      c.is_exact() ? py::none() : py::cast(c.parameter_covariance()), values_of(c.constants()));
}

// A camera of the given kind; its parameters are replaced afterwards.
Camera blank_camera(CameraKind kind, int width, int height, std::size_t coefficients,
                    const std::vector<double>& constants) {
  const std::vector<double> zeros(coefficients, 0.0);
  RotatingLine line;
  line.width = width;
  line.height = height;
  line.c_px = 1;
  switch (kind) {
    case CameraKind::fisheye:
      return Camera::fisheye(width, height, 1, 1, 0, 0, zeros);
    case CameraKind::double_sphere:
      return Camera::double_sphere(width, height, 1, 1, 0, 0, 0, 0);
    case CameraKind::brown_forward:
      return Camera::brown_forward(width, height, 1, 1, 0, 0, zeros, constants.at(0),
                                   constants.at(1));
    case CameraKind::brown_backward:
      return Camera::brown_backward(width, height, 1, 1, 0, 0, zeros, constants.at(0),
                                    constants.at(1));
    case CameraKind::equirectangular:
      return Camera::equirectangular(width, height, 1, 1, 0, 0);
    case CameraKind::rotating_line:
      return Camera::rotating_line(line);
    case CameraKind::rotating_line_first_order:
      return Camera::rotating_line_first_order(line);
    case CameraKind::pinhole:
      break;
  }
  return Camera::pinhole(width, height, 1, 1, 0, 0, zeros);
}

Camera camera_from_state(const State& s) {
  const Camera blank = blank_camera(s[0].cast<CameraKind>(), s[1].cast<int>(), s[2].cast<int>(),
                                    s[3].cast<std::size_t>(), s[6].cast<std::vector<double>>());
  const Camera camera = blank.with_parameters(s[4].cast<Eigen::VectorXd>());
  return s[5].is_none() ? camera : camera.with_parameter_covariance(s[5].cast<Eigen::MatrixXd>());
}

template <Camera (*factory)(const RotatingLine&)>
Camera make_line(int width, int height, double c_px, std::optional<double> cy_px,
                 std::optional<double> angle_per_px_rad, double tilt_x_rad, double tilt_y_rad,
                 const Eigen::Vector3d& eccentricity_m, double k1, double k2,
                 const std::array<double, 6>& tumbling_rad, const Sigmas& sigmas) {
  RotatingLine line;
  line.width = width;
  line.height = height;
  line.c_px = c_px;
  line.cy_px = cy_px.value_or((height - 1) / 2.0);
  line.angle_per_px_rad = angle_per_px_rad.value_or(0);
  line.tilt_x_rad = tilt_x_rad;
  line.tilt_y_rad = tilt_y_rad;
  line.eccentricity_m = eccentricity_m;
  line.k1 = k1;
  line.k2 = k2;
  line.tumbling_rad = tumbling_rad;
  return with_sigmas(factory(line), sigmas);
}

template <Camera (*factory)(const RotatingLine&)>
void define_line(py::class_<Camera>& camera, const char* name, const char* doc) {
  camera.def_static(
      name, &make_line<factory>, py::kw_only(), py::arg("width"), py::arg("height"),
      py::arg("c_px"), py::arg("cy_px") = py::none(), py::arg("angle_per_px_rad") = py::none(),
      py::arg("tilt_x_rad") = 0.0, py::arg("tilt_y_rad") = 0.0,
      py::arg_v("eccentricity_m", Eigen::Vector3d(0, 0, 0), "(0, 0, 0)"), py::arg("k1") = 0.0,
      py::arg("k2") = 0.0, py::arg_v("tumbling_rad", std::array<double, 6>{}, "(0, 0, 0, 0, 0, 0)"),
      py::arg("parameter_sigmas") = py::none(), doc);
}

void define_kinds(py::module_& m) {
  py::native_enum<CameraKind>(m, "CameraKind", "enum.Enum", "Kinds of camera models.")
      .value("pinhole", CameraKind::pinhole)
      .value("fisheye", CameraKind::fisheye)
      .value("double_sphere", CameraKind::double_sphere)
      .value("brown_forward", CameraKind::brown_forward)
      .value("brown_backward", CameraKind::brown_backward)
      .value("equirectangular", CameraKind::equirectangular)
      .value("rotating_line", CameraKind::rotating_line)
      .value("rotating_line_first_order", CameraKind::rotating_line_first_order)
      .finalize();
  py::native_enum<CameraFormat>(m, "CameraFormat", "enum.Enum", "Formats of a camera file.")
      .value("libocc", CameraFormat::libocc)
      .value("opencv", CameraFormat::opencv)
      .value("ros", CameraFormat::ros)
      .finalize();
  const auto fields = std::make_tuple(
      field("name", &CameraParameter::name, "name in the factories and camera files"),
      field("unit", &CameraParameter::unit, "px, rad, m or 1"),
      field("value", &CameraParameter::value, "value in that unit"),
      field("is_length", &CameraParameter::is_length, "true if it scales with the scene"));
  ResultClass<CameraParameter> parameter(m, "CameraParameter", "One parameter of a camera model.");
  define_properties(parameter, fields);
  define_repr(parameter, "CameraParameter", fields);
  ResultClass<Ray> ray(m, "Ray", "Ray of a pixel in the camera frame.");
  ray.def_readonly("origin", &Ray::origin,
                   "(3,) point of the ray [m]; zero for a camera with one projection centre.")
      .def_readonly("direction", &Ray::direction, "(3,) unit vector.");
}

// Both forms of Brown's distortion.
template <Camera (*factory)(int, int, double, double, double, double, const std::vector<double>&,
                            double, double, double)>
void define_brown(py::class_<Camera>& camera, const char* name, const char* doc) {
  camera.def_static(name, &make_brown<factory>, py::kw_only(), py::arg("width"), py::arg("height"),
                    py::arg("fx_px"), py::arg("fy_px"), py::arg("cx_px"), py::arg("cy_px"),
                    py::arg_v("distortion", std::vector<double>{}, "[]"), py::arg("unit_px"),
                    py::arg("r0") = 0.0, py::arg("skew_px") = 0.0,
                    py::arg("parameter_sigmas") = py::none(), doc);
}

// Factories of the models other than the pinhole.
void define_factories(py::class_<Camera>& camera) {
  camera
      .def_static("fisheye", &make_lens<&Camera::fisheye>, py::kw_only(), py::arg("width"),
                  py::arg("height"), py::arg("fx_px"), py::arg("fy_px"), py::arg("cx_px"),
                  py::arg("cy_px"), py::arg_v("distortion", std::vector<double>{}, "[]"),
                  py::arg("skew_px") = 0.0, py::arg("parameter_sigmas") = py::none(),
                  R"(Creates a fisheye camera of Kannala and Brandt in OpenCV's form.

width, height: [px]; fx_px, fy_px, cx_px, cy_px: focal lengths and principal point; distortion: at
most 4 coefficients; parameter_sigmas: as of pinhole(). Equations and source:
libocc/camera/fisheye.hpp.
Raises: ValueError naming the argument and its value.

>>> import libocc as occ
>>> camera = occ.Camera.fisheye(width=800, height=800, fx_px=250, fy_px=250, cx_px=399.5, cy_px=399.5)
>>> camera.project([1, 0, -0.2]) is None  # behind the image plane, but in the domain
False)")
      .def_static("double_sphere", &make_double_sphere, py::kw_only(), py::arg("width"),
                  py::arg("height"), py::arg("fx_px"), py::arg("fy_px"), py::arg("cx_px"),
                  py::arg("cy_px"), py::arg("xi"), py::arg("alpha"),
                  py::arg("parameter_sigmas") = py::none(),
                  R"(Creates a double sphere camera of Usenko, Demmel and Cremers (3DV 2018).

xi: in (-1, 1]; alpha: in [0, 1]; parameter_sigmas: as of pinhole(). Equations: libocc/camera/double_sphere.hpp.
Raises: ValueError naming the argument and its value.)")
      .def_static(
          "equirectangular", &make_equirectangular, py::kw_only(), py::arg("width"),
          py::arg("height"), py::arg("angle_per_px_rad") = py::none(),
          py::arg("fy_px") = py::none(), py::arg("cx_px") = py::none(),
          py::arg("cy_px") = py::none(), py::arg("parameter_sigmas") = py::none(),
          R"(Creates an equirectangular panorama: columns are longitudes, rows are latitudes.

angle_per_px_rad: angle between columns (default: 2 pi / width); fy_px: pixels per radian of latitude
(default: 1 / angle_per_px_rad); cx_px, cy_px: pixel of the z axis (default: the centre).
Equations and source: libocc/camera/equirectangular.hpp. Raises: ValueError naming the argument.

>>> import libocc as occ
>>> camera = occ.Camera.equirectangular(width=3600, height=1800)
>>> camera.project([2, 0, 2]).round(9).tolist()  # an eighth of a rotation, on the horizon
[2249.5, 899.5])");
  define_brown<&Camera::brown_forward>(
      camera, "brown_forward",
      R"(Creates a pinhole with Brown's distortion as a function of ideal coordinates (AICON, JAICOV).

distortion: [], or a1 a2 a3 b1 b2 c1 c2 for coordinates in units of unit_px pixels, for example the
pixels per millimetre; r0: radius without radial correction, in this unit; parameter_sigmas: as of
pinhole(). Equations and source: libocc/camera/brown.hpp.
Raises: ValueError naming the argument and its value.

>>> import libocc as occ
>>> camera = occ.Camera.brown_forward(width=640, height=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240,
...                                   distortion=[1e-3, 0, 0, 0, 0, 0, 0], unit_px=100)
>>> camera.project([0.2, 0, 1]).round(6).tolist()  # at 1 unit, corrected to 1.001
[420.1, 240.0])");
  define_brown<&Camera::brown_backward>(
      camera, "brown_backward",
      R"(Creates a pinhole with Brown's distortion as a function of measured coordinates.

This is the form of PhotoModeler and DBAT. Arguments: as of brown_forward(). Equations and source:
libocc/camera/brown.hpp.

>>> import libocc as occ
>>> camera = occ.Camera.brown_backward(width=640, height=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240,
...                                    distortion=[1e-3, 0, 0, 0, 0, 0, 0], unit_px=100)
>>> camera.unproject([420, 240]).round(6).tolist()  # at 1 unit, corrected to 1.001
[0.196305, 0.0, 0.980543])");
  define_line<&Camera::rotating_line>(
      camera, "rotating_line",
      R"(Creates a rotating line camera: a linear array on a turntable.

Columns are angles of the turntable, rows are positions on the array. The frame's Z is the turntable's
axis towards increasing rows; columns increase from X to Y.
width, height: [px]; c_px: camera constant over the array's pixel pitch; cy_px: row of the horizon
(default: the middle); angle_per_px_rad: angle between columns (default: 2 pi / width); tilt_x_rad,
tilt_y_rad: tilt of the array; eccentricity_m (3,): offset of the projection centre from the axis;
k1, k2: distortion along the array; tumbling_rad (6,): Fourier terms of the axis's wobble;
parameter_sigmas: as of pinhole().
Equations: libocc/camera/rotating_line.hpp. Raises: ValueError naming the argument and its value.

>>> import libocc as occ
>>> camera = occ.Camera.rotating_line(width=3600, height=1000, c_px=573)
>>> camera.project([0, 2, 0]).round(9).tolist()  # a quarter of a rotation, on the horizon
[900.0, 499.5])");
  define_line<&Camera::rotating_line_first_order>(
      camera, "rotating_line_first_order",
      "Creates the additive first-order form of rotating_line, for comparison; tumbling_rad must "
      "be zero. Equations: libocc/camera/rotating_line.hpp.");
}

// Properties and functions that every camera model has.
void define_generality(py::class_<Camera>& camera) {
  camera.def_property_readonly("kind", &Camera::kind, "CameraKind.")
      .def_property_readonly("is_central", &Camera::is_central,
                             "True if all rays meet in one point.")
      .def_property_readonly("parameters", &Camera::parameters,
                             "All CameraParameters, in the order of with_parameters.")
      .def_property_readonly("constants", &Camera::constants,
                             "CameraParameters that adjustments never change, such as unit_px.")
      .def(
          "with_parameters",
          [](const Camera& c, const Eigen::VectorXd& values) { return c.with_parameters(values); },
          py::arg("values"), "Returns this camera with other values of `parameters`, (n,).")
      .def_property_readonly("is_exact", &Camera::is_exact,
                             "True if no errors of the parameters are stated.")
      .def_property_readonly("parameter_covariance", &Camera::parameter_covariance,
                             "(n, n) covariance of the errors of `parameters`; zero if exact.")
      .def("with_parameter_covariance", &Camera::with_parameter_covariance, py::arg("covariance"),
           R"(Returns this camera with errors of its parameters, covariance (n, n).

refine(), locate() and pose_bound() estimate these errors together with the pose, so the pose's
covariance contains them.
Raises: ValueError for another size, or if it is not symmetric and positive semidefinite.)")
      .def("with_parameter_sigmas", &Camera::with_parameter_sigmas, py::arg("sigmas"),
           R"(Returns this camera with independent errors of its parameters: {name: sigma}; f_px: of
both focal lengths, whose ratio is kept, in pixels of fx_px.

Raises: ValueError for a name that the model does not have, for a sigma that is negative or not
finite, and if all are zero.)")
      .def(
          "ray", [](const Camera& c, const Eigen::Vector2d& p) { return c.ray(p); },
          py::arg("pixel"), "Returns the Ray of a pixel (2,); None outside the lens model.")
      .def_property_readonly("period_px", &Camera::period_px,
                             "Number of columns of a full rotation [px]; infinity if not periodic.")
      .def("difference_px", &Camera::difference_px, py::arg("to"), py::arg("from_"),
           "Returns to - from_ (2,) [px], the shorter way around the seam.");
}

void define_poses(py::module_& m) {
  m.def("look_at", &look_at, py::arg("position_m"), py::arg("target_m"),
        py::arg_v("up", Eigen::Vector3d(0, 0, 1), "(0, 0, 1)"),
        R"(Returns cam_from_world (4x4) of a camera at position_m [m, world] that looks at target_m.

The image's up direction is as close as possible to `up`.
Raises: ValueError when target and position coincide or the view is along `up`.

>>> import libocc as occ
>>> pose = occ.look_at(position_m=[0, 0, 1], target_m=[0, 0, 3], up=[0, 1, 0])
>>> (pose @ [0.5, 0.25, 3, 1]).round(9).tolist()
[-0.5, -0.25, 2.0, 1.0])");
  m.def(
      "heading_rad", [](const Rigid3& pose) { return heading_rad(pose); },
      py::arg("cam_from_world"),
      "Returns the azimuth [rad] about the world's Z of the camera's x axis (image right), in "
      "(-pi, pi].");
  m.def(
      "position_covariance",
      [](const Rigid3& pose, const Matrix6& covariance) {
        return position_covariance(pose, covariance);
      },
      py::arg("cam_from_world"), py::arg("covariance"),
      "Returns the 3x3 covariance [m^2, world] of the camera's position, from the 6x6 covariance "
      "of cam_from_world (left perturbation).");
}

}  // namespace

void define_camera(py::module_& m) {
  define_kinds(m);
  py::class_<Camera> camera(m, "Camera",
                            R"(A camera model: projects points to pixels and pixels to rays.

Created by pinhole (with OpenCV's lens distortion), brown_forward,
brown_backward, fisheye, double_sphere,
equirectangular or rotating_line.

Pixel (0, 0) is the centre of the first pixel; camera axes: x right, y down, z forward
(of a rotating line: z down along its axis).

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
>>> camera.project([0.1, 0, 2]).tolist()
[339.5, 239.5])");
  camera
      .def_static("pinhole", &make_lens<&Camera::pinhole>, py::kw_only(), py::arg("width"),
                  py::arg("height"), py::arg("fx_px"), py::arg("fy_px"), py::arg("cx_px"),
                  py::arg("cy_px"), py::arg_v("distortion", std::vector<double>{}, "[]"),
                  py::arg("skew_px") = 0.0, py::arg("parameter_sigmas") = py::none(),
                  R"(Creates a pinhole camera with OpenCV's lens distortion.

width, height: [px]; fx_px, fy_px, cx_px, cy_px: focal lengths and principal point.
distortion: 0, 4, 5, 8, 12 or 14 coefficients in OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6 s1 ...
parameter_sigmas: standard deviations of the errors of parameters by name, such as
{"fx_px": 3, "fy_px": 3, "k1": 0.02}; f_px is an error of both focal lengths that keeps their
ratio, in pixels of fx_px; coefficients that `distortion` does not have are added as
zeros. None: the camera is exact. Poses allow for these errors, see with_parameter_covariance.
Raises: ValueError naming the argument and its value.)")
      .def_property_readonly("width", &Camera::width, "Columns [px].")
      .def_property_readonly("height", &Camera::height, "Rows [px].")
      .def_property_readonly("fx_px", &Camera::fx_px, "Focal length along a row [px].")
      .def_property_readonly("fy_px", &Camera::fy_px, "Focal length along a column [px].")
      .def_property_readonly("cx_px", &Camera::cx_px, "Principal point, column [px].")
      .def_property_readonly("cy_px", &Camera::cy_px, "Principal point, row [px].")
      .def_property_readonly("skew_px", &Camera::skew_px, "Skew [px].")
      .def_property_readonly("distortion", &Camera::distortion,
                             "Distortion coefficients, OpenCV's order.")
      .def_property_readonly("matrix", &Camera::matrix, "Camera matrix K, 3x3.")
      .def_property_readonly(
          "max_angle_rad", &Camera::max_angle_rad,
          "Largest angle from the optical axis inside the lens model's domain [rad].")
      .def(
          "project", [](const Camera& c, const Eigen::Vector3d& p) { return c.project(p); },
          py::arg("point_in_cam_m"),
          "Returns the pixel (2,) of a point (3,) in the camera's frame [m]; None outside the lens "
          "model.")
      .def(
          "unproject", [](const Camera& c, const Eigen::Vector2d& p) { return c.unproject(p); },
          py::arg("pixel"),
          "Returns the unit bearing (3,) of a pixel (2,), camera frame; None outside the lens "
          "model.")
      .def("contains", &Camera::contains, py::arg("pixel"), "True if a pixel is on the sensor.")
      .def("__repr__", &camera_repr)
      .def("__eq__",
           [](const Camera& a, const py::object& b) {
             return py::isinstance<Camera>(b) &&
                    camera_state(a).equal(camera_state(b.cast<const Camera&>()));
           })
      .def("__hash__", [](const Camera& c) { return py::hash(py::str(camera_repr(c))); })
      .def(py::pickle(&camera_state, &camera_from_state));

  define_factories(camera);
  define_generality(camera);

  m.def("format_camera", &format_camera, py::arg("camera"),
        py::arg_v("format", CameraFormat::libocc, "CameraFormat.libocc"),
        py::arg("name") = "camera",
        R"(Returns the text of a camera file; `name` is ROS's camera_name.

Raises: ValueError when the format does not support the model.)");
  m.def(
      "write_camera",
      [](const std::filesystem::path& path, const Camera& c, CameraFormat format) {
        writing(path, [&](const std::string& name) { write_camera(name, c, format); });
      },
      py::arg("path"), py::arg("camera"),
      py::arg_v("format", CameraFormat::libocc, "CameraFormat.libocc"),
      R"(Writes a camera file; read_camera() returns the same camera, to the last bit.

After an error the file is unchanged.
Raises: OSError when it cannot be written; ValueError when the format does not support the model.)");
  m.def(
      "read_camera", [](const std::filesystem::path& path) { return reading(path, &read_camera); },
      py::arg("path"),
      R"(Reads a camera from a YAML file of libocc, OpenCV or ROS, or from a scene file.

Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key.)");
  define_poses(m);
}

}  // namespace occ::python
