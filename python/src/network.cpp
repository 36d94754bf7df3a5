// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/network.hpp"

#include <limits>

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using RowsX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

int index_of_last(std::size_t size) { return static_cast<int>(size) - 1; }

int add_camera(Network& n, const std::string& name, const Camera& camera,
               const std::vector<std::string>& free_parameters) {
  n.cameras.push_back({name, camera, free_parameters});
  return index_of_last(n.cameras.size());
}

int add_station(Network& n, const std::string& name, const Rigid3& pose, bool fixed) {
  n.stations.push_back({name, pose, fixed});
  return index_of_last(n.stations.size());
}

int add_mount(Network& n, const std::string& name, const Rigid3& pose, bool fixed) {
  n.mounts.push_back({name, pose, fixed});
  return index_of_last(n.mounts.size());
}

int add_image(Network& n, const std::string& name, int camera,
              const std::optional<Rigid3>& cam_from_world, const std::optional<int>& station,
              int mount) {
  require(cam_from_world.has_value() != station.has_value(), "cam_from_world", !!cam_from_world,
          "given if station is not, and omitted otherwise");
  if (cam_from_world) return n.add_image(name, camera, *cam_from_world);
  n.images.push_back({name, camera, *station, mount});
  return index_of_last(n.images.size());
}

int add_point(Network& n, const std::string& name, const Eigen::Vector3d& position_m, bool fixed) {
  n.points.push_back({name, position_m, fixed});
  return index_of_last(n.points.size());
}

int add_body(Network& n, const std::string& name, const Rows3& corners_m, const Rigid3& pose,
             bool scale_free, bool fixed) {
  NetworkBody body{name, corners_m.transpose(), pose};
  body.scale_free = scale_free;
  body.fixed = fixed;
  n.bodies.push_back(body);
  return index_of_last(n.bodies.size());
}

Eigen::Vector2d both_axes(const py::object& sigma_px) {
  if (py::isinstance<py::float_>(sigma_px) || py::isinstance<py::int_>(sigma_px))
    return Eigen::Vector2d::Constant(sigma_px.cast<double>());
  return sigma_px.cast<Eigen::Vector2d>();
}

void observe(Network& n, int image, const std::vector<Target>& targets, const Rows2& pixels,
             const py::object& sigma_px) {
  const auto count = static_cast<Eigen::Index>(targets.size());
  require(pixels.rows() == count, "pixels", pixels.rows(), "a row for each target");
  const Eigen::Vector2d sigma = both_axes(sigma_px);
  for (Eigen::Index i = 0; i < count; ++i)
    n.observations.push_back({image, targets[i], pixels.row(i).transpose(), sigma});
}

RowsX rows_of_points(const Network& n) {
  RowsX rows(static_cast<Eigen::Index>(n.points.size()), 3);
  for (std::size_t i = 0; i < n.points.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = n.points[i].position_m.transpose();
  return rows;
}

template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return names;
}

/// Columns: image, point, body, corner, x, y, sigma x, sigma y, used.
RowsX rows_of_observations(const Network& n) {
  RowsX rows(static_cast<Eigen::Index>(n.observations.size()), 9);
  Eigen::Index i = 0;
  for (const ImageObservation& o : n.observations)
    rows.row(i++) << o.image, o.target.point, o.target.body, o.target.corner, o.pixel.x(),
        o.pixel.y(), o.sigma_px.x(), o.sigma_px.y(), o.used;
  return rows;
}

void define_target(py::module_& m) {
  ResultClass<Target> target(m, "Target", R"(A point of a network, or a corner of a body.

>>> import libocc as occ
>>> occ.network.Target.point(3) == occ.network.Target.point(3)
True)");
  target.def_static("point", &Target::of_point, py::arg("point"), "Point with this index.")
      .def_static("corner", &Target::of_corner, py::arg("body"), py::arg("corner"),
                  "Corner of a body, by their indices.")
      .def_readonly("point_index", &Target::point, "Index of the point; -1 for a corner.")
      .def_readonly("body_index", &Target::body, "Index of the body; -1 for a point.")
      .def_readonly("corner_index", &Target::corner, "Index of the corner.")
      .def("__eq__",
           [](const Target& a, const py::object& b) {
             return py::isinstance<Target>(b) && a == b.cast<const Target&>();
           })
      .def("__hash__",
           [](const Target& t) { return py::hash(py::make_tuple(t.point, t.body, t.corner)); })
      .def("__repr__", [](const Target& t) {
        return t.point >= 0 ? "Target.point(" + std::to_string(t.point) + ")"
                            : "Target.corner(" + std::to_string(t.body) + ", " +
                                  std::to_string(t.corner) + ")";
      });
}

void define_building(py::class_<Network>& network) {
  network
      .def("add_camera", &add_camera, py::arg("name"), py::arg("camera"),
           py::arg_v("free_parameters", std::vector<std::string>{}, "[]"),
           "Adds a camera; returns its index. free_parameters: unknown ones of camera.parameters, "
           "or "
           "\"f_px\" for fx_px and fy_px in their ratio.")
      .def("add_station", &add_station, py::arg("name"), py::arg("station_from_world"),
           py::arg("fixed") = false, "Adds the pose of a rig; returns its index.")
      .def("add_mount", &add_mount, py::arg("name"), py::arg("cam_from_station"),
           py::arg("fixed") = false, "Adds the pose of a camera on a rig; returns its index.")
      .def("add_image", &add_image, py::arg("name"), py::arg("camera"),
           py::arg("cam_from_world") = py::none(), py::kw_only(), py::arg("station") = py::none(),
           py::arg("mount") = -1,
           "Adds an image by the start value of its pose (4x4), or by a station (and mount); "
           "returns its index.")
      .def("add_point", &add_point, py::arg("name"), py::arg("position_m"),
           py::arg("fixed") = false,
           "Adds a point with the start value of its position; returns its index.")
      .def("add_body", &add_body, py::arg("name"), py::arg("corners_m"), py::arg("world_from_body"),
           py::kw_only(), py::arg("scale_free") = false, py::arg("fixed") = false,
           "Adds a body of points (n, 3); scale_free: its size is unknown. Returns its index.")
      .def("observe", &observe, py::arg("image"), py::arg("targets"), py::arg("pixels"),
           py::arg("sigma_px") = 0.5,
           "Adds image points (n, 2) of Targets; sigma_px: one for both axes, or (2,).")
      .def(
          "set_camera",
          [](Network& n, int camera, const Camera& model,
             const std::vector<std::string>& free_parameters) {
            require(camera >= 0 && camera < static_cast<int>(n.cameras.size()), "camera", camera,
                    "the index of a camera");
            NetworkCamera& changed = n.cameras[camera];
            changed.camera = model;
            changed.free_parameters = free_parameters;
          },
          py::arg("camera"), py::arg("model"), py::arg("free_parameters"),
          "Replaces a camera's model and the names of its unknown parameters.")
      .def(
          "drop",
          [](Network& n, const std::vector<int>& observations) {
            for (const int i : observations) {
              require(i >= 0 && i < static_cast<int>(n.observations.size()), "observation", i,
                      "the index of an observation");
              n.observations[i].used = false;
            }
          },
          py::arg("observations"),
          "Marks observations (indices) as not used; they stay in the list.")
      .def(
          "shift_observation",
          [](Network& n, int observation, const Eigen::Vector2d& shift_px) {
            require(observation >= 0 && observation < static_cast<int>(n.observations.size()),
                    "observation", observation, "the index of an observation");
            n.observations[observation].pixel += shift_px;
          },
          py::arg("observation"), py::arg("shift_px"),
          "Shifts an observation, to simulate a gross error.")
      .def(
          "add_distance",
          [](Network& n, const Target& from, const Target& to, double length_m, double sigma_m) {
            n.distances.push_back({from, to, length_m, sigma_m});
          },
          py::arg("from_"), py::arg("to"), py::arg("length_m"), py::arg("sigma_m"),
          "Adds a measured distance of two targets, such as a scale bar.")
      .def(
          "add_control",
          [](Network& n, const Target& target, const Eigen::Vector3d& position_m,
             const Eigen::Matrix3d& covariance_m2) {
            n.control.push_back({target, position_m, covariance_m2});
          },
          py::arg("target"), py::arg("position_m"), py::arg("covariance_m2"),
          "Adds a control point.")
      .def(
          "add_parameter_prior",
          [](Network& n, int camera, const std::string& parameter, double value, double sigma) {
            n.parameter_priors.push_back({camera, parameter, value, sigma});
          },
          py::arg("camera"), py::arg("parameter"), py::arg("value"), py::arg("sigma"),
          "Adds prior knowledge of a camera parameter.")
      .def(
          "add_pose_prior",
          [](Network& n, int station, const Rigid3& pose, const Matrix6& covariance) {
            n.pose_priors.push_back({station, pose, covariance});
          },
          py::arg("station"), py::arg("station_from_world"), py::arg("covariance"),
          "Adds prior knowledge of a station's pose (covariance of its left perturbation).");
}

void define_reading(py::class_<Network>& network) {
  network
      .def_property_readonly(
          "cameras",
          [](const Network& n) {
            std::vector<Camera> all;
            for (const NetworkCamera& c : n.cameras) all.push_back(c.camera);
            return all;
          },
          "Camera models.")
      .def_property_readonly(
          "camera_names", [](const Network& n) { return names_of(n.cameras); },
          "Names of the cameras.")
      .def_property_readonly(
          "free_parameters",
          [](const Network& n) {
            std::vector<std::vector<std::string>> all;
            for (const NetworkCamera& c : n.cameras) all.push_back(c.free_parameters);
            return all;
          },
          "Names of the unknown parameters of each camera.")
      .def_property_readonly(
          "image_names", [](const Network& n) { return names_of(n.images); },
          "Names of the images.")
      .def_property_readonly(
          "image_cameras",
          [](const Network& n) {
            std::vector<int> all;
            for (const NetworkImage& i : n.images) all.push_back(i.camera);
            return all;
          },
          "Camera index of each image.")
      .def_property_readonly(
          "station_names", [](const Network& n) { return names_of(n.stations); },
          "Names of the stations.")
      .def_property_readonly(
          "point_names", [](const Network& n) { return names_of(n.points); },
          "Names of the points.")
      .def_property_readonly(
          "body_names", [](const Network& n) { return names_of(n.bodies); }, "Names of the bodies.")
      .def_property_readonly("points_m", &rows_of_points, "Positions of the points (n, 3) [m].")
      .def_property_readonly(
          "body_poses",
          [](const Network& n) {
            std::vector<Rigid3> all;
            for (const NetworkBody& b : n.bodies) all.push_back(b.world_from_body);
            return all;
          },
          "world_from_body of each body, 4x4.")
      .def_property_readonly(
          "body_corners_m",
          [](const Network& n) {
            std::vector<RowsX> all;
            for (const NetworkBody& b : n.bodies) all.push_back(b.corners_m.transpose());
            return all;
          },
          "Corners of each body in its frame, (n, 3) [m].")
      .def_property_readonly(
          "body_scales",
          [](const Network& n) {
            std::vector<double> all;
            for (const NetworkBody& b : n.bodies) all.push_back(b.scale);
            return all;
          },
          "Scale of each body.")
      .def_property_readonly("observations", &rows_of_observations,
                             "(n, 9) image, point, body, corner, x, y [px], their sigmas, used.")
      .def_property_readonly(
          "outlines",
          [](const Network& n) {
            std::vector<int> observations;
            for (const OutlineObservation& outline : n.outlines)
              observations.push_back(outline.observation);
            return observations;
          },
          "Indices of the observations that are centres of observed outlines, as the rims of lamps "
          "in a survey are.")
      .def(
          "position_m", [](const Network& n, const Target& t) { return n.position_m(t); },
          py::arg("target"), "Returns the position of a target (3,) [m].")
      .def(
          "name_of", [](const Network& n, const Target& t) { return n.name_of(t); },
          py::arg("target"), "Returns the name of a point, or of a body with the corner's number.")
      .def(
          "cam_from_world",
          [](const Network& n, int image) {
            require(image >= 0 && image < static_cast<int>(n.images.size()), "image", image,
                    "the index of an image");
            return n.cam_from_world(image);
          },
          py::arg("image"), "Returns the pose of an image, 4x4.")
      .def(
          "copy", [](const Network& n) { return n; }, "Returns an independent copy.")
      .def("check", &check_network,
           "Checks all elements. Raises: ValueError naming an invalid one.")
      .def("__repr__", [](const Network& n) {
        return "<Network: " + std::to_string(n.images.size()) + " images, " +
               std::to_string(n.points.size()) + " points, " + std::to_string(n.bodies.size()) +
               " bodies, " + std::to_string(n.observations.size()) + " observations>";
      });
}

}  // namespace

void define_network(py::module_& m) {
  define_target(m);
  py::class_<Network> network(
      m, "Network", R"(A photogrammetric network: cameras, images, points, bodies and observations.

Every add_ method returns an index. Lengths are in metres; start values may be rough.

>>> import libocc as occ, numpy as np
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240)
>>> network = occ.network.Network()
>>> main = network.add_camera("main", camera, ["fx_px", "fy_px"])
>>> image = network.add_image("a.png", main, np.eye(4))
>>> lamp = network.add_point("lamp", [0.1, 0, 2])
>>> network.observe(image, [occ.network.Target.point(lamp)], [[345, 240]], 0.1)
>>> network
<Network: 1 images, 1 points, 0 bodies, 1 observations>)");
  network.def(py::init<>());
  define_building(network);
  define_reading(network);
  define_network_elements(network);
  define_free_parameters(m);
}

}  // namespace occ::python
