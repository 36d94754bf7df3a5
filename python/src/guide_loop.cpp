// SPDX-License-Identifier: Apache-2.0
// Closed-loop simulation: options, and records as columns.
#include <pybind11/functional.h>

#include "fields.hpp"
#include "guide_estimator.hpp"
#include "libocc/guide/closed_loop.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Columns = py::typing::Dict<py::str, py::array>;

void define_faults(py::module_& m) {
  using L = LampFailure;
  define_documented<L>(
      m, "LampFailure", "A lamp that is off for a while.",
      std::make_tuple(required_field("lamp", &L::lamp, "id of the lamp"),
                      field("from_s", &L::from_s, "[s]"), field("to_s", &L::to_s, "[s]")));
  using O = OdometryFault;
  define_documented<O>(m, "OdometryFault", "Interval with a gross error of the odometry.",
                       std::make_tuple(required_field("from_s", &O::from_s, "[s]"),
                                       required_field("to_s", &O::to_s, "[s]"),
                                       field("scale", &O::scale, "factor of the reported length"),
                                       field("turn_rate_rad_s", &O::turn_rate_rad_s,
                                             "added to the reported turn rate [rad/s]")));
  using K = Kidnapping;
  define_documented<K>(m, "Kidnapping", "Moves the vehicle to another pose without any odometry.",
                       std::make_tuple(required_field("at_s", &K::at_s, "[s]"),
                                       required_field("to", &K::to, "PlanarPose")));
  using C = ClockJump;
  define_documented<C>(m, "ClockJump", "Sets the camera's clock forward.",
                       std::make_tuple(required_field("at_s", &C::at_s, "[s]"),
                                       required_field("by_s", &C::by_s, "[s]")));
  using F = LoopFaults;
  define_documented<F>(
      m, "LoopFaults", "Faults in a closed loop; none by default.",
      std::make_tuple(
          field("latency_s", &F::latency_s, "from the capture of an image to its arrival [s]"),
          field("frame_loss", &F::frame_loss, "probability that an image is lost"),
          field("frame_repeat", &F::frame_repeat, "probability that an image arrives twice"),
          field("lamp_failures", &F::lamp_failures, "list of LampFailure"),
          field("odometry_faults", &F::odometry_faults, "list of OdometryFault"),
          field("kidnappings", &F::kidnappings, "list of Kidnapping"),
          field("clock_jumps", &F::clock_jumps, "list of ClockJump")));
}

void define_world(py::module_& m) {
  using W = WorldErrors;
  define_documented<W>(
      m, "WorldErrors",
      "Differences of the simulated world from the scene and the options; none by default.",
      std::make_tuple(
          field("map_sigma_m", &W::map_sigma_m,
                "standard deviation of the lamps' positions along each axis, drawn from the seed "
                "[m]"),
          field("lens", &W::lens,
                "dict of errors of the camera's parameters by name: true minus assumed value"),
          field("mount_rotation_rad", &W::mount_rotation_rad,
                "(3,) rotation vector of the camera from its assumed mount, in its own axes [rad]"),
          field("mount_shift_m", &W::mount_shift_m, "(3,) shift of the camera, likewise [m]"),
          field(
              "clock_s", &W::clock_s,
              "time stamps minus capture times; images arrive when they are stamped or later [s]"),
          field("floor_tilt_rad", &W::floor_tilt_rad,
                "amplitude of roll and pitch on the floor's waves [rad]"),
          field("floor_height_m", &W::floor_height_m, "amplitude of their height [m]"),
          field("floor_wave_m", &W::floor_wave_m, "their length [m]"),
          field("exposure", &W::exposure, "true over assumed exposure time"),
          field("ambient_w_m2", &W::ambient_w_m2,
                "further irradiance of the sensor by other light than the lamps' [W/m^2]"),
          field("ambient_flicker", &W::ambient_flicker,
                "its relative amplitude, the same in all lines of an image"),
          field("flicker_hz", &W::flicker_hz, "its frequency [Hz]")));
}

/// Options of the tracker that are relevant for a loop.
auto tracker_fields() {
  using T = TrackerOptions;
  return std::make_tuple(
      field("floor", &T::floor, "PlanarFilterOptions of the tracker's floor"),
      field("gate_sigma", &T::gate_sigma, "gate between a lamp and a blob [sigma]"),
      field("gate_model_sigma_px", &T::model_sigma_px, "camera and map error in that gate [px]"),
      field("coast_s", &T::coast_s, "maximum duration of prediction without lamps [s]"),
      field("coast_sigma_m", &T::coast_sigma_m, "maximum sigma of the prediction [m]"),
      field("confirmations", &T::confirmations,
            "number of images that must agree on an unexpected pose"),
      field("mount_sigma_rad", &T::mount_sigma_rad,
            "constant error of the camera's rotation on the vehicle about each of its axes [rad]"),
      field("mount_sigma_m", &T::mount_sigma_m,
            "constant error of its position along each of its axes [m]"),
      field("clock_sigma_s", &T::clock_sigma_s, "constant error of the time stamps [s]"),
      field("alert_limit_m", &T::alert_limit_m,
            "the vehicle stops while the protection level is above it; None: no level [m]"),
      field("integrity_risk", &T::integrity_risk,
            "probability that the error exceeds the protection level undetected"));
}

auto loop_fields() {
  using O = LoopOptions;
  return std::tuple_cat(
      std::make_tuple(
          field("vehicle", &O::vehicle, "Vehicle"),
          field("vehicle_height_m", &O::vehicle_height_m,
                "boxes above this height are ignored [m]"),
          field("follower", &O::follower, "Follower"),
          field("pure_pursuit", &O::pure_pursuit, "PurePursuitOptions"),
          field("stanley", &O::stanley, "StanleyOptions"),
          field("docking", &O::docking, "DockOptions"),
          field("estimation", &O::estimation, "LoopEstimation"),
          field("camera_place_m", &O::camera_place_m,
                "(3,) position on the vehicle, z above the floor [m]"),
          field("camera_pan_rad", &O::camera_pan_rad, "see camera_on_vehicle() [rad]"),
          field("camera_tilt_rad", &O::camera_tilt_rad, "see camera_on_vehicle() [rad]"),
          field("pan_tilt", &O::pan_tilt, "PanTiltPlan that replaces the fixed angles"),
          field("pan_tilt_rate_rad_s", &O::pan_tilt_rate_rad_s,
                "maximum rate of each axis [rad/s]"),
          field("frame_rate_hz", &O::frame_rate_hz, "[Hz]"),
          field("control_rate_hz", &O::control_rate_hz, "[Hz]"),
          field("clock_guard_s", &O::clock_guard_s,
                "change of the images' transport delay that indicates a clock jump [s]"),
          field("image_noise", &O::image_noise, "shot and read noise"),
          field("start", &O::start, "PlanarPose, true pose; None: begin of the route"),
          field("start_sigma_m", &O::start_sigma_m,
                "standard deviation of the initial pose error [m]"),
          field("start_sigma_rad", &O::start_sigma_rad,
                "standard deviation of the initial heading error [rad]"),
          field("max_s", &O::max_s, "maximum duration of the run [s]"),
          field("max_lost_s", &O::max_lost_s, "maximum time without a pose or with an alert [s]"),
          field("faults", &O::faults, "LoopFaults"), field("world", &O::world, "WorldErrors"),
          field("seed", &O::seed, "seed of all random numbers")),
      fields_within(&O::tracker, tracker_fields()));
}

void define_metrics(py::module_& m) {
  using M = LoopMetrics;
  define_documented<M>(
      m, "LoopMetrics", "Metrics of a closed-loop run.",
      std::make_tuple(
          field("duration_s", &M::duration_s, "[s]"), field("driven_m", &M::driven_m, "[m]"),
          field("cross_track_mean_m", &M::cross_track_mean_m, "mean magnitude on the route [m]"),
          field("cross_track_rmse_m", &M::cross_track_rmse_m, "[m]"),
          field("cross_track_max_m", &M::cross_track_max_m, "[m]"),
          field("position_rmse_m", &M::position_rmse_m, "error of the estimate [m]"),
          field("position_max_m", &M::position_max_m, "[m]"),
          field("position_sigma_m", &M::position_sigma_m,
                "stated for it: root of the mean trace of its covariance [m]"),
          field("heading_rmse_rad", &M::heading_rmse_rad, "[rad]"),
          field("heading_max_rad", &M::heading_max_rad, "[rad]"),
          field("final_error", &M::final_error,
                "PlanarPose relative to the dock or the route's end"),
          field("final_position_error_m", &M::final_position_error_m, "magnitude [m]"),
          field("final_heading_error_rad", &M::final_heading_error_rad, "magnitude [rad]"),
          field("frames", &M::frames, "images captured"),
          field("availability", &M::availability, "share of the images that were tracked"),
          field("three_lamps", &M::three_lamps,
                "share of the images whose pose uses three lamps or more"),
          field("longest_outage_s", &M::longest_outage_s,
                "longest time between tracked images [s]"),
          field("lost_s", &M::lost_s, "time without a pose [s]"),
          field("alert_s", &M::alert_s, "time with a protection level above the alert limit [s]"),
          field("protection_level_m", &M::protection_level_m,
                "median over the steps that have one; 0 without an alert limit [m]"),
          field("misleading_s", &M::misleading_s,
                "time in which the error exceeds the protection level [s]"),
          field("relocations", &M::relocations, "confirmed jumps of the pose"),
          field("clock_jumps", &M::clock_jumps, "number of jumps detected"),
          field("nees", &M::nees, "mean over the steps; 3 is expected"),
          field("nis_per_dof", &M::nis_per_dof, "over all images; 1 is expected"),
          field("frame_mean_s", &M::frame_mean_s,
                "mean processing time per image on this machine [s]"),
          field("frame_median_s", &M::frame_median_s, "[s]"),
          field("frame_p99_s", &M::frame_p99_s, "[s]"),
          field("limited_steps", &M::limited_steps,
                "steps in which the command exceeded the vehicle's limits")));
}

template <class T, class Items, class Get>
py::array column(const Items& items, const Get& get) {
  py::array_t<T> values(static_cast<py::ssize_t>(items.size()));
  auto view = values.template mutable_unchecked<1>();
  for (std::size_t i = 0; i < items.size(); ++i)
    view(static_cast<py::ssize_t>(i)) = static_cast<T>(get(items[i]));
  return values;
}

void add_poses(Columns& columns, const std::vector<LoopRecord>& records) {
  using R = LoopRecord;
  columns["true_x_m"] = column<double>(records, [](const R& r) { return r.truth.x_m; });
  columns["true_y_m"] = column<double>(records, [](const R& r) { return r.truth.y_m; });
  columns["true_heading_rad"] =
      column<double>(records, [](const R& r) { return r.truth.heading_rad; });
  columns["x_m"] = column<double>(records, [](const R& r) { return r.estimate.pose.x_m; });
  columns["y_m"] = column<double>(records, [](const R& r) { return r.estimate.pose.y_m; });
  columns["heading_rad"] =
      column<double>(records, [](const R& r) { return r.estimate.pose.heading_rad; });
  py::array_t<double> covariance(
      {static_cast<py::ssize_t>(records.size()), py::ssize_t{3}, py::ssize_t{3}});
  auto view = covariance.mutable_unchecked<3>();
  for (std::size_t i = 0; i < records.size(); ++i)
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col)
        view(static_cast<py::ssize_t>(i), row, col) = records[i].estimate.covariance(row, col);
  columns["covariance"] = covariance;
}

Columns record_columns(const LoopResult& result) {
  using R = LoopRecord;
  const std::vector<R>& records = result.records;
  Columns columns;
  columns["time_s"] = column<double>(records, [](const R& r) { return r.time_s; });
  add_poses(columns, records);
  columns["state"] =
      column<int>(records, [](const R& r) { return static_cast<int>(r.estimate.state); });
  columns["lamps"] = column<int>(records, [](const R& r) { return r.estimate.lamps; });
  columns["along_m"] = column<double>(records, [](const R& r) { return r.along_m; });
  columns["deviation_m"] = column<double>(records, [](const R& r) { return r.deviation_m; });
  columns["speed_m_s"] = column<double>(records, [](const R& r) { return r.command.speed_m_s; });
  columns["turn_rate_rad_s"] =
      column<double>(records, [](const R& r) { return r.command.turn_rate_rad_s; });
  columns["steering_rad"] =
      column<double>(records, [](const R& r) { return r.command.steering_rad; });
  columns["limited"] =
      column<bool>(records, [](const R& r) { return r.limited.speed || r.limited.turn; });
  columns["pan_rad"] = column<double>(records, [](const R& r) { return r.pan_rad; });
  columns["tilt_rad"] = column<double>(records, [](const R& r) { return r.tilt_rad; });
  columns["protection_level_m"] =
      column<double>(records, [](const R& r) { return r.estimate.protection_level_m; });
  columns["alert"] = column<bool>(records, [](const R& r) { return r.alert; });
  columns["docking"] = column<bool>(records, [](const R& r) { return r.docking; });
  columns["frames"] = column<int>(records, [](const R& r) { return r.frames; });
  return columns;
}

Columns frame_columns(const LoopResult& result) {
  using F = LoopFrame;
  const std::vector<F>& frames = result.frames;
  Columns columns;
  columns["captured_s"] = column<double>(frames, [](const F& f) { return f.captured_s; });
  columns["arrived_s"] = column<double>(frames, [](const F& f) { return f.arrived_s; });
  columns["lost"] = column<bool>(frames, [](const F& f) { return f.lost; });
  columns["state"] = column<int>(frames, [](const F& f) { return static_cast<int>(f.state); });
  columns["lamps_in_view"] = column<int>(frames, [](const F& f) { return f.lamps_in_view; });
  columns["lamps_used"] = column<int>(frames, [](const F& f) { return f.lamps_used; });
  columns["nis"] = column<double>(frames, [](const F& f) { return f.nis; });
  columns["nis_dof"] = column<int>(frames, [](const F& f) { return f.nis_dof; });
  columns["relocated"] = column<bool>(frames, [](const F& f) { return f.relocated; });
  columns["clock_jumped_s"] = column<double>(frames, [](const F& f) { return f.clock_jumped_s; });
  columns["taken_s"] = column<double>(frames, [](const F& f) { return f.taken_s; });
  return columns;
}

using Observer = std::function<bool(double, double)>;

/// Calls the observer ten times a second and checks for Ctrl-C.
LoopObserver observing(const std::optional<Observer>& observer, double control_rate_hz) {
  const int every = std::max(1, static_cast<int>(control_rate_hz / 10));
  return [observer, every, step = 0](const LoopRecord& record) mutable {
    if (++step % every != 0) return true;
    py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return !observer || (*observer)(record.time_s, record.along_m);
  };
}

void define_result_class(py::module_& m) {
  using R = LoopResult;
  ResultClass<R>(m, "LoopResult", "A run of the closed loop.")
      .def_property_readonly(
          "ok", [](const R& r) { return r.outcome == LoopOutcome::arrived; },
          "True if the vehicle arrived.")
      .def_readonly("outcome", &R::outcome, "LoopOutcome.")
      .def_readonly("message", &R::message, "Reason for the end of the run.")
      .def_readonly("metrics", &R::metrics, "LoopMetrics.")
      .def_property_readonly(
          "records", &record_columns,
          R"(Columns by name, an entry for each control step: time_s; true_x_m, true_y_m,
true_heading_rad; x_m, y_m, heading_rad of the estimate with covariance (n, 3, 3); state (0 searching,
1 tracking, 2 coasting, 3 lost), lamps; along_m and deviation_m of the true pose; speed_m_s,
turn_rate_rad_s, steering_rad of the command, limited; pan_rad, tilt_rad; protection_level_m (inf:
unknown), alert; docking; frames arrived.)")
      .def_property_readonly(
          "frames", &frame_columns,
          R"(Columns by name, an entry for each image: captured_s, arrived_s, lost, state,
lamps_in_view, lamps_used, nis, nis_dof, relocated, clock_jumped_s, taken_s.)")
      .def("__repr__", [](const R& r) {
        return std::string("<LoopResult: ") + to_string(r.outcome) + ", " + r.message + ">";
      });
}

void define_enums(py::module_& m) {
  py::native_enum<Follower>(m, "Follower", "enum.Enum", "Controller that follows the route.")
      .value("pure_pursuit", Follower::pure_pursuit)
      .value("stanley", Follower::stanley)
      .finalize();
  py::native_enum<LoopEstimation>(m, "LoopEstimation", "enum.Enum", "Estimator of the pose.")
      .value("tracker", LoopEstimation::tracker)
      .value("locate", LoopEstimation::locate)
      .finalize();
  py::native_enum<LoopOutcome>(m, "LoopOutcome", "enum.Enum", "Outcome of a run.")
      .value("arrived", LoopOutcome::arrived)
      .value("collision", LoopOutcome::collision)
      .value("lost", LoopOutcome::lost)
      .value("out_of_time", LoopOutcome::out_of_time)
      .finalize();
}

}  // namespace

void define_closed_loop(py::module_& m) {
  define_enums(m);
  define_faults(m);
  define_world(m);
  define_estimated_pose(m);
  define_documented<LoopOptions>(m, "LoopOptions", "Options of closed_loop().", loop_fields());
  define_metrics(m);
  define_result_class(m);
  m.def(
      "closed_loop",
      [](const Scene& scene, const Route& route, const LoopOptions& options,
         const std::optional<Observer>& observer,
         const std::optional<EstimatorFactory>& make_estimator) {
        py::gil_scoped_release unlocked;
        return closed_loop(scene, route, options, estimators_of(make_estimator),
                           observing(observer, options.control_rate_hz));
      },
      py::arg("scene"), py::arg("route"), py::arg_v("options", LoopOptions{}, "LoopOptions()"),
      py::arg("observer") = py::none(), py::arg("make_estimator") = py::none(),
      R"(Simulates a vehicle on a route: world, rendered image, pose estimate, controller, world.

scene.camera is the vehicle's camera. observer(time_s, along_m) is called ten times per simulated
second; returning False ends the run. make_estimator(scene) replaces the estimator: it returns an
object with the methods start(time_s, pose, covariance), add_odometry(step),
add_image(image, captured_s, now_s, cam_from_body) and at(time_s), of which the last two return an
EstimatedPose. Returns: LoopResult; the same seed gives the same run.
Raises: ValueError naming the option, or the conflict of the route with a wall or box.

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
>>> run = occ.guide.closed_loop(scene, occ.guide.Route([[1.5, 2], [2.5, 2]]))
>>> run.outcome.name, run.metrics.cross_track_rmse_m < 0.002
('arrived', True))");
}

}  // namespace occ::python
