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
  const auto fields =
      std::make_tuple(field("x_m", &P::x_m, "x of the body's origin [m, world]"),
                      field("y_m", &P::y_m, "y of the body's origin [m, world]"),
                      field("heading_rad", &P::heading_rad,
                            "azimuth of the body's x axis about the world's Z [rad]"));
  const std::string doc = R"(Pose of a vehicle on a floor, world_from_body; x forward, y left, z up.

a * b is the pose a after the increment b in its own frame. Covariances are (3, 3) in the order
[x_m, y_m, heading_rad], along the world's axes.

>>> import libocc as occ
>>> occ.guide.PlanarPose(x_m=1, heading_rad=0.5) * occ.guide.PlanarPose(heading_rad=0.25)
PlanarPose(x_m=1.0, heading_rad=0.75))";
  py::class_<P> cls(m, "PlanarPose",
                    (doc + fields_doc(fields, "Keywords (and properties)")).c_str());
  define_value(cls, fields);
  define_repr(cls, "PlanarPose", fields);
  cls.def(py::self * py::self)
      .def("inverse", &P::inverse, "Returns the inverse: body_from_world as a PlanarPose.")
      .def(
          "body_from_world",
          [](const P& pose, double height_m) { return body_from_world(pose, height_m); },
          py::arg("height_m") = 0.0,
          "Returns body_from_world (4x4) of an upright body with its origin at this height [m].")
      .def_static(
          "of_body", [](const Rigid3& pose) { return planar_pose(pose); },
          py::arg("body_from_world"),
          "Returns the planar part of a body's pose (4x4): x and y of its origin, azimuth of its x "
          "axis.");
}

void define_inputs(py::module_& m) {
  using O = Odometry;
  define_documented<O>(
      m, "Odometry", "Measured motion of a body between two times.",
      std::make_tuple(required_field("from_s", &O::from_s, "begin [s]"),
                      required_field("to_s", &O::to_s, "end [s]"),
                      required_field("to_from_from", &O::to_from_from,
                                     "4x4, from the body's frame at from_s to that at to_s"),
                      required_field("covariance", &O::covariance,
                                     "(6, 6) of to_from_from [rotation rad, translation m], left "
                                     "perturbation")));
  using P = PlanarOdometry;
  define_documented<P>(
      m, "PlanarOdometry", "Measured motion of a vehicle on a floor between two times.",
      std::make_tuple(
          required_field("from_s", &P::from_s, "begin [s]"),
          required_field("to_s", &P::to_s, "end [s]"),
          required_field("increment", &P::increment,
                         "PlanarPose at to_s in the body's frame at from_s"),
          required_field("covariance", &P::covariance,
                         "(3, 3) [x_m, y_m, heading_rad], in the body's frame at from_s")));
  using I = ImuSample;
  define_documented<I>(
      m, "ImuSample", "Inertial measurement along the body's axes.",
      std::make_tuple(required_field("time_s", &I::time_s, "time of the sample [s]"),
                      field("turn_rate_rad_s", &I::turn_rate_rad_s,
                            "(3,) rotation rate of the gyroscope [rad/s]"),
                      field("acceleration_m_s2", &I::acceleration_m_s2,
                            "(3,) specific force: +9.81 upwards at rest [m/s^2]")));
  using S = PoseObservation;
  ResultClass<S>(m, "PoseObservation",
                 "Likelihood of a camera's pose from one image, to second order about a pose.")
      .def_static("of_pose", &S::of_pose, py::arg("time_s"), py::arg("cam_from_world"),
                  py::arg("covariance"), py::arg("cam_from_body") = Rigid3{},
                  "Returns the observation of a pose (4x4) with covariance (6, 6), such as those "
                  "of a Fix. cam_from_body: mounting of the camera (4x4). Raises: ValueError if "
                  "the covariance is not positive definite.")
      .def_readonly("time_s", &S::time_s, "Time of the image [s].")
      .def_readonly("cam_from_world", &S::cam_from_world, "Pose, 4x4.")
      .def_readonly("information", &S::information,
                    "(6, 6) of the left perturbation; may be singular.")
      .def_readonly("gradient", &S::gradient,
                    "(6,) derivative of half of chi2 by the left perturbation.")
      .def_readonly("cam_from_body", &S::cam_from_body, "Mounting of the camera, 4x4.");
}

void define_updates(py::module_& m) {
  py::native_enum<FilterOutcome>(m, "FilterOutcome", "enum.Enum",
                                 "Outcome of adding a measurement to a filter.")
      .value("accepted", FilterOutcome::accepted)
      .value("gated", FilterOutcome::gated, "rejected: contradicts the prediction")
      .value("too_old", FilterOutcome::too_old, "rejected: older than the filter's history")
      .value("overlapping", FilterOutcome::overlapping,
             "rejected: earlier odometry covers part of its time")
      .value("not_started", FilterOutcome::not_started, "ignored: the filter has no pose yet")
      .finalize();
  using U = FilterUpdate;
  ResultClass<U>(m, "FilterUpdate", "Result of adding a measurement to a filter.")
      .def_readonly("outcome", &U::outcome, "FilterOutcome.")
      .def_property_readonly("accepted", &U::accepted, "True if the outcome is accepted.")
      .def_readonly("nis", &U::nis, "Normalised innovation squared.")
      .def_readonly("nis_dof", &U::nis_dof, "Degrees of freedom of nis.")
      .def("__repr__", [](const U& u) {
        return "<FilterUpdate: " + value_repr(u.outcome) + ", nis " + value_repr(u.nis) + " of " +
               std::to_string(u.nis_dof) + ">";
      });
}

void define_estimates(py::module_& m) {
  using P = PosePrediction;
  ResultClass<P>(m, "PosePrediction", "Pose and velocity of a body, predicted to a time.")
      .def_readonly("time_s", &P::time_s, "Time [s].")
      .def_readonly("body_from_world", &P::body_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &P::covariance,
                    "(6, 6) of body_from_world [rotation rad, translation m], left perturbation.")
      .def_readonly("velocity", &P::velocity,
                    "(6,) velocity of body_from_world's left perturbation [rad/s, m/s].")
      .def_readonly("velocity_covariance", &P::velocity_covariance,
                    "(6, 6) covariance of the velocity.");
  using E = PoseEstimate;
  ResultClass<E, P>(m, "PoseEstimate", "Prediction with the biases of the inertial sensors.")
      .def_readonly("gyro_bias_rad_s", &E::gyro_bias_rad_s, "(3,) bias of the gyroscope [rad/s].")
      .def_readonly("accelerometer_bias_m_s2", &E::accelerometer_bias_m_s2,
                    "(3,) bias of the accelerometer [m/s^2].");
  using F = PlanarEstimate;
  ResultClass<F>(m, "PlanarEstimate", "Pose and velocity of a vehicle on a floor.")
      .def_readonly("time_s", &F::time_s, "Time [s].")
      .def_readonly("pose", &F::pose, "PlanarPose.")
      .def_readonly("covariance", &F::covariance, "(3, 3) of [x_m, y_m, heading_rad].")
      .def_readonly("velocity", &F::velocity,
                    "(3,) forward, left, rotation in the body's frame [m/s, m/s, rad/s].")
      .def_readonly("velocity_covariance", &F::velocity_covariance,
                    "(3, 3) covariance of the velocity.")
      .def_readonly("gyro_bias_rad_s", &F::gyro_bias_rad_s, "Bias of the gyroscope [rad/s].");
}

auto planar_filter_fields() {
  using O = PlanarFilterOptions;
  return std::make_tuple(
      field("height_m", &O::height_m, "height of the body's origin above the world's z = 0 [m]"),
      field("height_sigma_m", &O::height_sigma_m,
            "standard deviation of the height from image to image [m]"),
      field("tilt_sigma_rad", &O::tilt_sigma_rad,
            "standard deviation of roll and of pitch from image to image [rad]"),
      field("acceleration_noise", &O::acceleration_noise,
            "root spectral density of the forward acceleration without odometry [m/s^2/sqrt(Hz)]"),
      field("lateral_noise", &O::lateral_noise,
            "root spectral density of the acceleration to the left without odometry "
            "[m/s^2/sqrt(Hz)]"),
      field(
          "turn_acceleration_noise", &O::turn_acceleration_noise,
          "root spectral density of the angular acceleration without odometry [rad/s^2/sqrt(Hz)]"),
      field("gyro_noise", &O::gyro_noise, "noise of the gyroscope [rad/s/sqrt(Hz)]"),
      field("gyro_bias_sigma", &O::gyro_bias_sigma,
            "standard deviation of the gyroscope's initial bias [rad/s]"),
      field("gyro_bias_walk", &O::gyro_bias_walk, "random walk of this bias [rad/s^2/sqrt(Hz)]"),
      field("imu_hold_s", &O::imu_hold_s,
            "time for which a sample is used if no other follows [s]"),
      field("start_speed_sigma_m_s", &O::start_speed_sigma_m_s,
            "standard deviation of the initial velocity, which is zero [m/s]"),
      field("start_turn_sigma_rad_s", &O::start_turn_sigma_rad_s,
            "standard deviation of the initial rotation rate, which is zero [rad/s]"),
      field("gate_sigma", &O::gate_sigma, "gate for the NIS of an image [sigma]; inf: no gate"),
      field("history_s", &O::history_s, "maximum delay of a measurement [s]"));
}

auto pose_filter_fields() {
  using O = PoseFilterOptions;
  return std::make_tuple(
      field("acceleration_noise", &O::acceleration_noise,
            "root spectral density of the acceleration without odometry and accelerometer "
            "[m/s^2/sqrt(Hz)]"),
      field("turn_acceleration_noise", &O::turn_acceleration_noise,
            "root spectral density of the angular acceleration without odometry and gyroscope "
            "[rad/s^2/sqrt(Hz)]"),
      field("gyro_noise", &O::gyro_noise, "noise of the gyroscope [rad/s/sqrt(Hz)]"),
      field("gyro_bias_sigma", &O::gyro_bias_sigma,
            "standard deviation of the gyroscope's initial bias [rad/s]"),
      field("gyro_bias_walk", &O::gyro_bias_walk, "random walk of this bias [rad/s^2/sqrt(Hz)]"),
      field("accelerometer_noise", &O::accelerometer_noise,
            "noise of the accelerometer [m/s^2/sqrt(Hz)]"),
      field("accelerometer_bias_sigma", &O::accelerometer_bias_sigma,
            "standard deviation of the accelerometer's initial bias [m/s^2]"),
      field("accelerometer_bias_walk", &O::accelerometer_bias_walk,
            "random walk of this bias [m/s^3/sqrt(Hz)]"),
      field("use_accelerometer", &O::use_accelerometer,
            "False: only the rotation rates of samples are used"),
      field("gravity_m_s2", &O::gravity_m_s2, "(3,) acceleration of gravity in the world [m/s^2]"),
      field("imu_hold_s", &O::imu_hold_s,
            "time for which a sample is used if no other follows [s]"),
      field("start_speed_sigma_m_s", &O::start_speed_sigma_m_s,
            "standard deviation of the initial velocity, which is zero [m/s]"),
      field("start_turn_sigma_rad_s", &O::start_turn_sigma_rad_s,
            "standard deviation of the initial rotation rate, which is zero [rad/s]"),
      field("gate_sigma", &O::gate_sigma, "gate for the NIS of an image [sigma]; inf: no gate"),
      field("history_s", &O::history_s, "maximum delay of a measurement [s]"));
}

template <class Filter, class Step>
void define_adds(py::class_<Filter>& cls) {
  cls.def_property_readonly("started", &Filter::started, "True if the filter has a pose.")
      .def("add", py::overload_cast<const Step&>(&Filter::add), py::arg("measurement"),
           "Adds odometry, an inertial sample or a PoseObservation, which may be late. Returns: "
           "FilterUpdate. Raises: ValueError for values that are not finite, times that do not "
           "increase, or negative variances.")
      .def("add", py::overload_cast<const ImuSample&>(&Filter::add), py::arg("measurement"))
      .def("add", py::overload_cast<const PoseObservation&>(&Filter::add), py::arg("measurement"))
      .def("at", &Filter::at, py::arg("time_s"),
           "Returns the estimate predicted to a time [s]; None before the start and before the "
           "history.");
}

void define_filters(py::module_& m) {
  const auto planar = planar_filter_fields();
  define_documented<PlanarFilterOptions>(m, "PlanarFilterOptions",
                                         "Motion and noise model of a PlanarFilter.", planar);
  py::class_<PlanarFilter> floor(m, "PlanarFilter",
                                 R"(Extended Kalman filter over SE(2) for a vehicle on a floor.

Fuses wheel odometry, a gyroscope and images (PoseObservation). Measurements may arrive late and in
any order within history_s; the result is that of the right order.
Source: Thrun, Burgard, Fox, Probabilistic Robotics, 2005, sec. 3.3 and 7.4.

>>> import numpy as np
>>> import libocc as occ
>>> filter = occ.smoothing.PlanarFilter()
>>> filter.start(0, occ.guide.PlanarPose(), 1e-6 * np.eye(3))
>>> wheels = occ.smoothing.PlanarOdometry(from_s=0, to_s=1, increment=occ.guide.PlanarPose(x_m=0.5), covariance=1e-6 * np.eye(3))
>>> filter.add(wheels).accepted, filter.at(0.5).pose
(True, PlanarPose(x_m=0.25)))");
  floor
      .def(py::init<const PlanarFilterOptions&>(),
           py::arg_v("options", PlanarFilterOptions{}, "PlanarFilterOptions()"))
      .def("start", &PlanarFilter::start, py::arg("time_s"), py::arg("pose"), py::arg("covariance"),
           "Starts or restarts at a PlanarPose with covariance (3, 3); earlier measurements are "
           "dropped.");
  define_adds<PlanarFilter, PlanarOdometry>(floor);

  define_documented<PoseFilterOptions>(
      m, "PoseFilterOptions", "Motion and noise model of a PoseFilter.", pose_filter_fields());
  py::class_<PoseFilter> space(m, "PoseFilter",
                               R"(Error-state extended Kalman filter over SE(3) for a body in space.

Fuses odometry, gyroscope, accelerometer and images (PoseObservation) of any number of cameras.
Measurements may arrive late and in any order within history_s; the result is that of the right
order. Source: Sola, arXiv:1711.02508, sec. 5 and 7.)");
  space
      .def(py::init<const PoseFilterOptions&>(),
           py::arg_v("options", PoseFilterOptions{}, "PoseFilterOptions()"))
      .def("start", &PoseFilter::start, py::arg("time_s"), py::arg("body_from_world"),
           py::arg("covariance"),
           "Starts or restarts at a pose (4x4) with covariance (6, 6); earlier measurements are "
           "dropped.");
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
