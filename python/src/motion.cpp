// SPDX-License-Identifier: Apache-2.0
// Poses on a floor, motion sensors and the filters.
#include <pybind11/operators.h>

#include "fields.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {

template <>
struct Members<PoseEstimate> {
  static auto tie(PoseEstimate& e) {
    return std::tie(static_cast<PosePrediction&>(e), e.gyro_bias_rad_s, e.accelerometer_bias_m_s2);
  }
};

namespace {

void define_planar_pose(py::module_& m) {
  using P = PlanarPose;
  const auto fields = std::make_tuple(
      field("x_m", &P::x_m, "of the body's origin [m, world]"), field("y_m", &P::y_m, "alike"),
      field("heading_rad", &P::heading_rad, "azimuth of the body's x axis, forward"));
  const std::string doc = R"(Where a vehicle is on a floor: world_from_body; x forward, y left.

a * b is the pose that is b in a's frame. Covariances are (3, 3), of [x_m, y_m, heading_rad].

>>> import libocc as occ
>>> occ.PlanarPose(x_m=1, heading_rad=0.5) * occ.PlanarPose(heading_rad=0.25)
PlanarPose(x_m=1.0, heading_rad=0.75))";
  py::class_<P> cls(m, "PlanarPose",
                    (doc + fields_doc(fields, "Keywords (and properties)")).c_str());
  define_value(cls, fields);
  define_repr(cls, "PlanarPose", fields);
  cls.def(py::self * py::self)
      .def("inverse", &P::inverse, "The world in the body's frame.")
      .def(
          "body_from_world",
          [](const P& pose, double height_m) { return body_from_world(pose, height_m); },
          py::arg("height_m") = 0.0, "4x4 of an upright body whose origin is at this height [m].")
      .def_static(
          "of_body", [](const Rigid3& pose) { return planar_pose(pose); },
          py::arg("body_from_world"), "The planar part of a body's pose (4x4).");
}

void define_inputs(py::module_& m) {
  using O = Odometry;
  define_documented<O>(
      m, "Odometry", "How a body has moved between two times.",
      std::make_tuple(required_field("from_s", &O::from_s, "begin [s]"),
                      required_field("to_s", &O::to_s, "end [s]"),
                      required_field("to_from_from", &O::to_from_from,
                                     "4x4, from the body's frame at from_s to that at to_s"),
                      required_field("covariance", &O::covariance,
                                     "(6, 6) [rotation, translation], left perturbation")));
  using P = PlanarOdometry;
  define_documented<P>(
      m, "PlanarOdometry", "How a vehicle on a floor has moved between two times.",
      std::make_tuple(
          required_field("from_s", &P::from_s, "begin [s]"),
          required_field("to_s", &P::to_s, "end [s]"),
          required_field("increment", &P::increment, "PlanarPose at to_s in the frame of from_s"),
          required_field("covariance", &P::covariance, "(3, 3) in the frame of from_s")));
  using I = ImuSample;
  define_documented<I>(
      m, "ImuSample", "What a gyroscope and an accelerometer read, along the body's axes.",
      std::make_tuple(required_field("time_s", &I::time_s, "of the sample [s]"),
                      field("turn_rate_rad_s", &I::turn_rate_rad_s, "(3,) [rad/s]"),
                      field("acceleration_m_s2", &I::acceleration_m_s2,
                            "(3,) specific force: +9.81 upwards at rest [m/s^2]")));
  using S = PoseObservation;
  ResultClass<S>(m, "PoseObservation",
                 "What one image says of a camera's pose, to second order about it.")
      .def_static("of_pose", &S::of_pose, py::arg("time_s"), py::arg("cam_from_world"),
                  py::arg("covariance"), py::arg("cam_from_body") = Rigid3{},
                  "From a pose (4x4) with covariance (6, 6), as a Fix has them; cam_from_body: how "
                  "the camera is mounted. Raises: ValueError unless that is positive definite.")
      .def_readonly("time_s", &S::time_s, "When it was seen [s].")
      .def_readonly("cam_from_world", &S::cam_from_world, "Pose, 4x4.")
      .def_readonly("information", &S::information, "(6, 6), may be singular.")
      .def_readonly("gradient", &S::gradient, "(6,) of half of chi2.")
      .def_readonly("cam_from_body", &S::cam_from_body, "4x4.");
}

void define_updates(py::module_& m) {
  py::native_enum<FilterOutcome>(m, "FilterOutcome", "enum.Enum",
                                 "What a filter made of a measurement.")
      .value("accepted", FilterOutcome::accepted)
      .value("gated", FilterOutcome::gated)
      .value("too_old", FilterOutcome::too_old)
      .value("overlapping", FilterOutcome::overlapping)
      .value("not_started", FilterOutcome::not_started)
      .finalize();
  using U = FilterUpdate;
  ResultClass<U>(m, "FilterUpdate", "What a filter made of a measurement.")
      .def_readonly("outcome", &U::outcome, "A FilterOutcome.")
      .def_property_readonly("accepted", &U::accepted, "Whether it was taken.")
      .def_readonly("nis", &U::nis, "Normalised innovation squared.")
      .def_readonly("nis_dof", &U::nis_dof, "Its degrees of freedom.")
      .def("__repr__", [](const U& u) {
        return "<FilterUpdate: " + value_repr(u.outcome) + ", nis " + value_repr(u.nis) + " of " +
               std::to_string(u.nis_dof) + ">";
      });
}

void define_estimates(py::module_& m) {
  using P = PosePrediction;
  ResultClass<P>(m, "PosePrediction", "Where a body is expected to be.")
      .def_readonly("time_s", &P::time_s, "[s].")
      .def_readonly("body_from_world", &P::body_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &P::covariance,
                    "(6, 6) [rotation, translation], left perturbation.")
      .def_readonly("velocity", &P::velocity,
                    "(6,) of body_from_world's left perturbation [rad/s, m/s].")
      .def_readonly("velocity_covariance", &P::velocity_covariance, "(6, 6) of it.");
  using E = PoseEstimate;
  ResultClass<E, P>(m, "PoseEstimate", "Where a body is, and the biases of its inertial sensors.")
      .def_readonly("gyro_bias_rad_s", &E::gyro_bias_rad_s, "(3,) [rad/s].")
      .def_readonly("accelerometer_bias_m_s2", &E::accelerometer_bias_m_s2, "(3,) [m/s^2].");
  using F = PlanarEstimate;
  ResultClass<F>(m, "PlanarEstimate", "Where a vehicle is on its floor.")
      .def_readonly("time_s", &F::time_s, "[s].")
      .def_readonly("pose", &F::pose, "PlanarPose.")
      .def_readonly("covariance", &F::covariance, "(3, 3) of [x_m, y_m, heading_rad].")
      .def_readonly("velocity", &F::velocity, "(3,) forward, left, turn [m/s, m/s, rad/s].")
      .def_readonly("velocity_covariance", &F::velocity_covariance, "(3, 3) of it.")
      .def_readonly("gyro_bias_rad_s", &F::gyro_bias_rad_s, "[rad/s].");
}

auto planar_filter_fields() {
  using O = PlanarFilterOptions;
  return std::make_tuple(
      field("height_m", &O::height_m, "of the body's origin above the world's z = 0 [m]"),
      field("height_sigma_m", &O::height_sigma_m, "of the floor, from image to image [m]"),
      field("tilt_sigma_rad", &O::tilt_sigma_rad, "of roll and of pitch, alike [rad]"),
      field("acceleration_noise", &O::acceleration_noise,
            "forward, without odometry [m/s^2/sqrt(Hz)]"),
      field("lateral_noise", &O::lateral_noise, "to the left, alike"),
      field("turn_acceleration_noise", &O::turn_acceleration_noise, "alike [rad/s^2/sqrt(Hz)]"),
      field("gyro_noise", &O::gyro_noise, "[rad/s/sqrt(Hz)]"),
      field("gyro_bias_sigma", &O::gyro_bias_sigma, "at the start [rad/s]"),
      field("gyro_bias_walk", &O::gyro_bias_walk, "[rad/s^2/sqrt(Hz)]"),
      field("imu_hold_s", &O::imu_hold_s, "a sample is held so long [s]"),
      field("start_speed_sigma_m_s", &O::start_speed_sigma_m_s, "at the start [m/s]"),
      field("start_turn_sigma_rad_s", &O::start_turn_sigma_rad_s, "at the start [rad/s]"),
      field("gate_sigma", &O::gate_sigma, "an image beyond this contradicts the prediction"),
      field("history_s", &O::history_s, "measurements may be so late [s]"));
}

auto pose_filter_fields() {
  using O = PoseFilterOptions;
  return std::make_tuple(
      field("acceleration_noise", &O::acceleration_noise, "where no sensor tells [m/s^2/sqrt(Hz)]"),
      field("turn_acceleration_noise", &O::turn_acceleration_noise, "alike [rad/s^2/sqrt(Hz)]"),
      field("gyro_noise", &O::gyro_noise, "[rad/s/sqrt(Hz)]"),
      field("gyro_bias_sigma", &O::gyro_bias_sigma, "at the start [rad/s]"),
      field("gyro_bias_walk", &O::gyro_bias_walk, "[rad/s^2/sqrt(Hz)]"),
      field("accelerometer_noise", &O::accelerometer_noise, "[m/s^2/sqrt(Hz)]"),
      field("accelerometer_bias_sigma", &O::accelerometer_bias_sigma, "at the start [m/s^2]"),
      field("accelerometer_bias_walk", &O::accelerometer_bias_walk, "[m/s^3/sqrt(Hz)]"),
      field("use_accelerometer", &O::use_accelerometer, "False: samples tell turns only"),
      field("gravity_m_s2", &O::gravity_m_s2, "(3,) in the world [m/s^2]"),
      field("imu_hold_s", &O::imu_hold_s, "a sample is held so long [s]"),
      field("start_speed_sigma_m_s", &O::start_speed_sigma_m_s, "at the start [m/s]"),
      field("start_turn_sigma_rad_s", &O::start_turn_sigma_rad_s, "at the start [rad/s]"),
      field("gate_sigma", &O::gate_sigma, "an image beyond this contradicts the prediction"),
      field("history_s", &O::history_s, "measurements may be so late [s]"));
}

template <class Filter, class Step>
void define_adds(py::class_<Filter>& cls) {
  cls.def_property_readonly("started", &Filter::started, "Whether it has a pose.")
      .def("add", py::overload_cast<const Step&>(&Filter::add), py::arg("measurement"),
           "Takes odometry, an inertial sample or what an image says; may be late. Returns: "
           "FilterUpdate. Raises: ValueError for what is not finite, or times that do not rise.")
      .def("add", py::overload_cast<const ImuSample&>(&Filter::add), py::arg("measurement"))
      .def("add", py::overload_cast<const PoseObservation&>(&Filter::add), py::arg("measurement"))
      .def("at", &Filter::at, py::arg("time_s"),
           "Predicted to a time [s]; None before the start, or of a time that is forgotten.");
}

void define_filters(py::module_& m) {
  const auto planar = planar_filter_fields();
  define_documented<PlanarFilterOptions>(m, "PlanarFilterOptions",
                                         "How a vehicle moves on a floor.", planar);
  py::class_<PlanarFilter> floor(m, "PlanarFilter", R"(Where a vehicle on a floor is.

An extended Kalman filter over SE(2) of wheel odometry, a gyroscope and what images say; late
measurements count as if they had not been late.

>>> import numpy as np
>>> import libocc as occ
>>> filter = occ.PlanarFilter()
>>> filter.start(0, occ.PlanarPose(), 1e-6 * np.eye(3))
>>> wheels = occ.PlanarOdometry(from_s=0, to_s=1, increment=occ.PlanarPose(x_m=0.5), covariance=1e-6 * np.eye(3))
>>> filter.add(wheels).accepted, filter.at(0.5).pose
(True, PlanarPose(x_m=0.25)))");
  floor
      .def(py::init<const PlanarFilterOptions&>(),
           py::arg_v("options", PlanarFilterOptions{}, "PlanarFilterOptions()"))
      .def("start", &PlanarFilter::start, py::arg("time_s"), py::arg("pose"), py::arg("covariance"),
           "Begins, or begins anew, at a PlanarPose with its covariance (3, 3).");
  define_adds<PlanarFilter, PlanarOdometry>(floor);

  define_documented<PoseFilterOptions>(m, "PoseFilterOptions", "How a body moves in space.",
                                       pose_filter_fields());
  py::class_<PoseFilter> space(m, "PoseFilter", R"(Where a body in space is.

An error-state extended Kalman filter over SE(3) of odometry, gyroscope, accelerometer and what
images of any number of cameras say; late measurements count as if they had not been late.)");
  space
      .def(py::init<const PoseFilterOptions&>(),
           py::arg_v("options", PoseFilterOptions{}, "PoseFilterOptions()"))
      .def("start", &PoseFilter::start, py::arg("time_s"), py::arg("body_from_world"),
           py::arg("covariance"), "Begins, or begins anew, at a 4x4 pose, covariance (6, 6).");
  define_adds<PoseFilter, Odometry>(space);
}

}  // namespace

void define_motion(py::module_& m) {
  define_planar_pose(m);
  define_inputs(m);
  define_updates(m);
  define_estimates(m);
  define_filters(m);
}

}  // namespace occ::python
