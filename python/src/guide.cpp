// SPDX-License-Identifier: Apache-2.0
// Vehicles, routes, controllers and docking.
#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/guide/controller.hpp"
#include "libocc/guide/docking.hpp"
#include "libocc/guide/mount.hpp"
#include "libocc/guide/route.hpp"
#include "libocc/guide/vehicle.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

void define_vehicle_values(py::module_& m) {
  py::native_enum<Drive>(m, "Drive", "enum.Enum", "Kinematics of a vehicle.")
      .value("differential", Drive::differential)
      .value("ackermann", Drive::ackermann)
      .finalize();
  using N = DriveNoise;
  define_documented<N>(
      m, "DriveNoise",
      "Noise of wheels and odometry; zero by default. After a distance d, the error of a wheel has "
      "the standard deviation k sqrt(d).",
      std::make_tuple(
          field("drive", &N::drive,
                "deviation from the command, reported by the odometry [sqrt(m)]"),
          field("slip", &N::slip, "slip of the wheels, not reported [sqrt(m)]"),
          field("slip_share", &N::slip_share, "constant share of each wheel's travel that is lost"),
          field("sideways_slip", &N::sideways_slip, "lateral slip [sqrt(m)]"),
          field("odometry", &N::odometry, "noise of the reported wheel travel [sqrt(m)]"),
          field("left_scale", &N::left_scale, "reported over true travel of the left wheel"),
          field("right_scale", &N::right_scale, "reported over true travel of the right wheel"),
          field("scale_sigma", &N::scale_sigma,
                "sigma of both scales in the reported covariance")));
  using V = Vehicle;
  define_documented<V>(
      m, "Vehicle", "A vehicle's size, limits and noise.",
      std::make_tuple(
          field("drive", &V::drive, "Drive"),
          field("track_m", &V::track_m, "distance between the two unsteered wheels [m]"),
          field("wheelbase_m", &V::wheelbase_m,
                "Ackermann: distance from the origin to the front axle [m]"),
          field("radius_m", &V::radius_m,
                "radius of a disc about the origin that contains the vehicle [m]"),
          field("max_speed_m_s", &V::max_speed_m_s, "also backwards [m/s]"),
          field("max_acceleration_m_s2", &V::max_acceleration_m_s2, "also for braking [m/s^2]"),
          field("max_turn_rate_rad_s", &V::max_turn_rate_rad_s, "differential drive [rad/s]"),
          field("max_turn_acceleration_rad_s2", &V::max_turn_acceleration_rad_s2, "[rad/s^2]"),
          field("max_steering_rad", &V::max_steering_rad, "Ackermann [rad]"),
          field("max_steering_rate_rad_s", &V::max_steering_rate_rad_s, "Ackermann [rad/s]"),
          field("noise", &V::noise, "DriveNoise")));
  using C = DriveCommand;
  define_documented<C>(
      m, "DriveCommand", "Command of a vehicle.",
      std::make_tuple(
          field("speed_m_s", &C::speed_m_s, "speed of the origin; negative: backwards [m/s]"),
          field("turn_rate_rad_s", &C::turn_rate_rad_s, "differential drive [rad/s]"),
          field("steering_rad", &C::steering_rad, "Ackermann, left positive [rad]")));
  using S = DriveState;
  define_documented<S>(
      m, "DriveState", "Pose and motion of a vehicle.",
      std::make_tuple(field("time_s", &S::time_s, "[s]"), field("pose", &S::pose, "PlanarPose"),
                      field("speed_m_s", &S::speed_m_s, "[m/s]"),
                      field("turn_rate_rad_s", &S::turn_rate_rad_s, "rate of the heading [rad/s]"),
                      field("steering_rad", &S::steering_rad, "Ackermann [rad]")));
  using L = DriveLimited;
  define_documented<L>(
      m, "DriveLimited", "Limits that prevented the execution of a command.",
      std::make_tuple(
          field("speed", &L::speed, "max_speed_m_s"),
          field("turn", &L::turn, "maximum turn rate or steering angle"),
          field("acceleration", &L::acceleration, "maximum acceleration, within the step"),
          field("turn_change", &L::turn_change,
                "maximum change of turn rate or steering, within the step")));
}

void define_drive(py::module_& m) {
  using D = DriveStep;
  ResultClass<D>(m, "DriveStep", "Result of a command.")
      .def_readonly("state", &D::state, "DriveState: true state.")
      .def_readonly("odometry", &D::odometry, "PlanarOdometry reported by the wheels.")
      .def_readonly("limited", &D::limited, "DriveLimited.");
  m.def(
      "drive",
      [](const Vehicle& vehicle, const DriveState& state, const DriveCommand& command, double dt_s,
         std::uint64_t seed) {
        Random random(seed);
        return drive(vehicle, state, command, dt_s, random);
      },
      py::arg("vehicle"), py::arg("state"), py::arg("command"), py::arg("dt_s"),
      py::arg("seed") = 0,
      R"(Advances a vehicle by dt_s seconds along the exact arc of its mean speed and turn rate.

Commands beyond the limits are clipped and reported in `limited`. seed: of the noise; use a
different one for each step. Raises: ValueError for values that are not finite.

>>> import libocc as occ
>>> step = occ.guide.drive(occ.guide.Vehicle(), occ.guide.DriveState(speed_m_s=0.5), occ.guide.DriveCommand(speed_m_s=0.5), 0.1)
>>> round(step.state.pose.x_m, 3), step.limited
(0.05, DriveLimited()))");
  m.def("camera_on_vehicle", &camera_on_vehicle, py::arg("place_m"), py::arg("pan_rad") = 0,
        py::arg("tilt_rad") = 0,
        "Returns cam_from_body (4x4) of a camera on a vehicle at place_m (3,), above the floor. At "
        "pan and tilt 0 it looks up, with the image's x axis forward. Pan rotates it to the left; "
        "tilt bends the view from the vertical towards the pan direction.");
}

auto waypoint_fields() {
  using W = RouteWaypoint;
  return std::make_tuple(
      required_field("position_m", &W::position_m, "(2,) [m]"),
      field("corner_radius_m", &W::corner_radius_m,
            "replaces the route's corner_radius_m; 0: sharp [m]"),
      field("speed_m_s", &W::speed_m_s, "speed from here on; None: unchanged [m/s]"));
}

auto route_fields() {
  using O = RouteOptions;
  return std::make_tuple(
      field("shape", &O::shape, "RouteShape"),
      field("closed", &O::closed, "joins the last way-point to the first"),
      field("laps", &O::laps, "number of laps of a closed route"),
      field("corner_radius_m", &O::corner_radius_m, "reduced where a line is too short for it [m]"),
      field("speed_m_s", &O::speed_m_s, "speed at the first way-point [m/s]"),
      field("dock", &O::dock, "PlanarPose of the vehicle at the end, or None"));
}

using RouteRows = Eigen::Matrix<double, Eigen::Dynamic, 5, Eigen::RowMajor>;

RouteRows sampled_rows(const Route& route, double step_m) {
  const std::vector<RoutePlace> places = route.sampled(step_m);
  RouteRows rows(static_cast<Eigen::Index>(places.size()), 5);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const RoutePlace& place = places[i];
    rows.row(static_cast<Eigen::Index>(i)) << place.along_m, place.pose.x_m, place.pose.y_m,
        place.pose.heading_rad, place.curvature_1_m;
  }
  return rows;
}

std::vector<RouteWaypoint> plain_waypoints(const Rows2& positions) {
  std::vector<RouteWaypoint> waypoints;
  for (Eigen::Index i = 0; i < positions.rows(); ++i)
    waypoints.push_back({positions.row(i).transpose(), {}, {}});
  return waypoints;
}

State route_state(const Route& route) {
  const RouteOptions& o = route.options();
  State state;
  state["waypoints"] = py::cast(route.waypoints());
  state["shape"] = py::cast(o.shape);
  state["closed"] = py::cast(o.closed);
  state["laps"] = py::cast(o.laps);
  state["corner_radius_m"] = py::cast(o.corner_radius_m);
  state["speed_m_s"] = py::cast(o.speed_m_s);
  state["dock"] = py::cast(o.dock);
  return state;
}

Route route_of_state(const State& state) {
  const auto waypoints = state["waypoints"].cast<std::vector<RouteWaypoint>>();
  RouteOptions options;
  options.shape = state["shape"].cast<RouteShape>();
  options.closed = state["closed"].cast<bool>();
  options.laps = state["laps"].cast<int>();
  options.corner_radius_m = state["corner_radius_m"].cast<double>();
  options.speed_m_s = state["speed_m_s"].cast<double>();
  options.dock = state["dock"].cast<std::optional<PlanarPose>>();
  return Route(waypoints, options);
}

template <class Waypoints, class Make>
void define_route_from(py::class_<Route>& cls, const Make& make) {
  const auto fields = route_fields();
  define_constructor(
      cls, fields,
      [make](RouteOptions options, const Waypoints& waypoints) {
        return Route(make(waypoints), options);
      },
      py::arg("waypoints"), py::kw_only());
}

void define_route_queries(py::class_<Route>& cls) {
  cls.def_property_readonly("length_m", &Route::length_m, "Length of all laps [m].")
      .def_property_readonly("lap_m", &Route::lap_m, "Length of one lap [m].")
      .def_property_readonly("waypoints", &Route::waypoints, "List of RouteWaypoint.")
      .def_property_readonly(
          "dock", [](const Route& r) { return r.dock(); }, "PlanarPose, or None.")
      .def("at", &Route::at, py::arg("along_m"), "RoutePlace; clipped to the route.")
      .def("nearest", &Route::nearest, py::arg("position_m"), py::arg("near_m") = py::none(),
           py::arg("window_m") = 0.5,
           "Returns the nearest RoutePlace to position_m (2,). near_m: searches only within "
           "window_m of this distance along the route.")
      .def("sampled", &sampled_rows, py::arg("step_m"),
           "(n, 5): along_m, x_m, y_m, heading_rad, curvature_1_m, at most step_m apart.")
      .def("__repr__",
           [](const Route& r) {
             return "<Route: " + std::to_string(r.waypoints().size()) + " way-points, " +
                    std::to_string(r.length_m()) + " m>";
           })
      .def(py::pickle(&route_state, &route_of_state));
}

void define_route(py::module_& m) {
  py::native_enum<RouteShape>(m, "RouteShape", "enum.Enum",
                              "Shape of the connection between way-points.")
      .value("lines", RouteShape::lines)
      .value("spline", RouteShape::spline)
      .finalize();
  define_documented<RouteWaypoint>(m, "RouteWaypoint", "A way-point of a route.",
                                   waypoint_fields());
  using P = RoutePlace;
  ResultClass<P>(m, "RoutePlace", "A point of a route.")
      .def_readonly("along_m", &P::along_m, "Distance from the start of the route [m].")
      .def_readonly("pose", &P::pose, "PlanarPose, heading along the route.")
      .def_readonly("deviation_m", &P::deviation_m,
                    "Offset of the queried position to the left of the route [m].")
      .def_readonly("curvature_1_m", &P::curvature_1_m, "Left positive [1/m].")
      .def_readonly("speed_m_s", &P::speed_m_s, "[m/s].");
  py::class_<Route> cls(m, "Route",
                        (R"(Route of a vehicle: lines and arcs, parametrised by arc length.

waypoints: (n, 2), or RouteWaypoints with individual corners and speeds. Raises: ValueError naming
the way-point.

>>> import libocc as occ
>>> route = occ.guide.Route([[1, 1], [3, 1], [3, 3]], corner_radius_m=0.5)
>>> round(route.length_m, 3), route.at(0.5).pose
(3.785, PlanarPose(x_m=1.5, y_m=1.0)))" +
                         fields_doc(route_fields(), "Options"))
                            .c_str());
  define_route_from<std::vector<RouteWaypoint>>(
      cls, [](const std::vector<RouteWaypoint>& waypoints) { return waypoints; });
  define_route_from<Rows2>(cls, &plain_waypoints);
  define_route_queries(cls);
  using C = RouteConflict;
  ResultClass<C>(m, "RouteConflict",
                 "Section of a route where the vehicle would touch a wall or box.")
      .def_readonly("from_m", &C::from_m, "Along the route [m].")
      .def_readonly("to_m", &C::to_m, "Along the route [m].")
      .def_readonly("position_m", &C::position_m, "(2,) position with the smallest clearance [m].")
      .def_readonly("clearance_m", &C::clearance_m, "Smallest clearance; negative: inside [m].")
      .def_readonly("what", &C::what, "Name of the wall or box.");
  m.def("route_conflicts", &route_conflicts, py::arg("route"), py::arg("scene"),
        py::arg("radius_m"), py::arg("height_m"),
        "Returns the RouteConflicts of a disc of radius_m and height_m along the route and at its "
        "dock, in the order of the route.");
}

auto pace_fields() {
  using O = PaceOptions;
  return std::make_tuple(
      field("braking", &O::braking, "share of the vehicle's acceleration used for braking"),
      field("slow_radius_m", &O::slow_radius_m, "radius below which the speed is reduced [m]"),
      field("min_speed_m_s", &O::min_speed_m_s, "speed at the end and in the sharpest curve [m/s]"),
      field("end_speed_m_s", &O::end_speed_m_s, "speed at the end of the route [m/s]"));
}

void define_controller_values(py::module_& m) {
  define_documented<PaceOptions>(m, "PaceOptions", "Speed profile on a route.", pace_fields());
  using P = PurePursuitOptions;
  define_documented<P>(
      m, "PurePursuitOptions", "Options of regulated pure pursuit.",
      std::make_tuple(
          field("lookahead_s", &P::lookahead_s, "look-ahead distance divided by speed [s]"),
          field("min_lookahead_m", &P::min_lookahead_m, "[m]"),
          field("max_lookahead_m", &P::max_lookahead_m, "[m]"),
          field("turn_on_spot_rad", &P::turn_on_spot_rad,
                "differential drive: heading error above which it turns first [rad]"),
          field("pace", &P::pace, "PaceOptions")));
  using S = StanleyOptions;
  define_documented<S>(
      m, "StanleyOptions", "Options of the Stanley controller.",
      std::make_tuple(
          field("gain_1_s", &S::gain_1_s, "gain of the deviation [1/s]"),
          field("soft_m_s", &S::soft_m_s, "added to the speed [m/s]"),
          field("yaw_damping_s", &S::yaw_damping_s, "damping of the turn rate error [s]"),
          field("preview_s", &S::preview_s,
                "preview of the curvature [s]; None: from the vehicle's limits"),
          field("guide_point_m", &S::guide_point_m,
                "distance ahead of the origin [m]; wheelbase: as published"),
          field("virtual_wheelbase_m", &S::virtual_wheelbase_m,
                "wheelbase used for a differential drive [m]"),
          field("turn_on_spot_rad", &S::turn_on_spot_rad, "as in PurePursuitOptions [rad]"),
          field("pace", &S::pace, "PaceOptions")));
  using O = ControlOutput;
  ResultClass<O>(m, "ControlOutput", "Output of a controller.")
      .def_readonly("command", &O::command, "DriveCommand.")
      .def_readonly("place", &O::place, "RoutePlace nearest to the vehicle.")
      .def_readonly("heading_error_rad", &O::heading_error_rad,
                    "Route heading minus vehicle heading [rad].")
      .def_readonly("speed_limited", &O::speed_limited,
                    "The route's speed exceeds the vehicle's limit.")
      .def_readonly("curve_limited", &O::curve_limited,
                    "The required curvature exceeds the vehicle's limit.")
      .def_readonly("at_end", &O::at_end,
                    "The end of the route is beside the vehicle or behind it.");
}

template <class Options, class Control>
void define_controller(py::module_& m, const char* name, const Control& control, const char* doc,
                       const char* options_text) {
  m.def(
      name,
      [control](const Route& route, const Vehicle& vehicle, const PlanarPose& pose,
                double speed_m_s, double turn_rate_rad_s, std::optional<double> along_m,
                const Options& options) {
        return control(route, vehicle, ControlInput{pose, speed_m_s, turn_rate_rad_s, along_m},
                       options);
      },
      py::arg("route"), py::arg("vehicle"), py::arg("pose"), py::arg("speed_m_s"),
      py::arg("turn_rate_rad_s") = 0, py::arg("along_m") = py::none(),
      py::arg_v("options", Options{}, options_text), doc);
}

void define_docking(py::module_& m) {
  py::native_enum<DockPhase>(m, "DockPhase", "enum.Enum", "Phase of docking.")
      .value("approach", DockPhase::approach)
      .value("creep", DockPhase::creep)
      .value("align", DockPhase::align)
      .value("retreat", DockPhase::retreat)
      .value("docked", DockPhase::docked)
      .finalize();
  using O = DockOptions;
  define_documented<O>(
      m, "DockOptions", "Docking: Park and Kuipers' law, then creeping along the dock's axis.",
      std::make_tuple(
          field("k1", &O::k1, "gain of the dock's heading"),
          field("k2", &O::k2, "gain of the vehicle's heading"),
          field("beta", &O::beta, "reduces the speed in curves"),
          field("lambda_", &O::lambda, "exponent of the curvature in this reduction"),
          field("approach_speed_m_s", &O::approach_speed_m_s, "[m/s]"),
          field("creep_distance_m", &O::creep_distance_m, "distance before the dock [m]"),
          field("creep_speed_m_s", &O::creep_speed_m_s, "[m/s]"),
          field("slowing_1_s", &O::slowing_1_s, "maximum creep speed per remaining distance [1/s]"),
          field("min_speed_m_s", &O::min_speed_m_s, "[m/s]"),
          field("track_length_m", &O::track_length_m, "length in which it approaches the axis [m]"),
          field("max_aside_m", &O::max_aside_m,
                "maximum offset when creeping begins [m]; beyond it the vehicle backs out"),
          field("tolerance_m", &O::tolerance_m, "along the axis [m]"),
          field("tolerance_rad", &O::tolerance_rad, "[rad]")));
  using D = DockOutput;
  ResultClass<D>(m, "DockOutput", "Output of docking.")
      .def_readonly("command", &D::command, "DriveCommand.")
      .def_readonly("phase", &D::phase, "DockPhase, for the next call.")
      .def_readonly("in_dock", &D::in_dock, "PlanarPose of the vehicle in the dock's frame.")
      .def_readonly("speed_limited", &D::speed_limited,
                    "The required speed exceeds the vehicle's limit.")
      .def_readonly("curve_limited", &D::curve_limited,
                    "The required curvature exceeds the vehicle's limit.");
  m.def("dock", &dock, py::arg("pose"), py::arg("speed_m_s"), py::arg("target"), py::arg("vehicle"),
        py::arg_v("phase", DockPhase::approach, "DockPhase.approach"),
        py::arg_v("options", DockOptions{}, "DockOptions()"),
        "Returns the DockOutput of one control step towards target, a PlanarPose. phase: DockPhase "
        "of the previous output.");
}

}  // namespace

void define_guide(py::module_& m) {
  define_vehicle_values(m);
  define_drive(m);
  define_route(m);
  define_controller_values(m);
  define_controller<PurePursuitOptions>(
      m, "pure_pursuit", &pure_pursuit,
      R"(Computes the command of regulated pure pursuit: an arc to the point at the look-ahead distance.

along_m: previous distance along the route (place.along_m of the previous output). Returns:
ControlOutput.
Source: Macenski, Singh, Martin, Gines, Autonomous Robots 47, 2023.)",
      "PurePursuitOptions()");
  define_controller<StanleyOptions>(
      m, "stanley", &stanley,
      R"(Computes the command of the Stanley controller. Arguments as for pure_pursuit().

Source: Hoffmann, Tomlin, Montemerlo, Thrun, ACC 2007, eq. (5).)",
      "StanleyOptions()");
  define_docking(m);
  define_guide_plans(m);
  define_closed_loop(m);
}

}  // namespace occ::python
