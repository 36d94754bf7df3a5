// SPDX-License-Identifier: Apache-2.0
// Visibility of lamps from a floor, and plans that keep them in view.
#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/guide/plan_pan_tilt.hpp"
#include "libocc/guide/plan_route.hpp"
#include "libocc/guide/visibility.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using GapRows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;
using KnotRows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Visibility of several poses on the floor, as arrays.
struct FloorVisibility {
  std::vector<Visibility> seen;

  template <class Get>
  Eigen::VectorXd column(const Get& get) const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(seen.size()));
    for (std::size_t i = 0; i < seen.size(); ++i)
      values[static_cast<Eigen::Index>(i)] = static_cast<double>(get(seen[i]));
    return values;
  }
};

auto view_fields() {
  using O = VisibilityOptions;
  return std::make_tuple(
      field("camera_place_m", &O::camera_place_m,
            "(3,) position on the vehicle, z above the floor [m]"),
      field("camera_pan_rad", &O::camera_pan_rad, "see camera_on_vehicle() [rad]"),
      field("camera_tilt_rad", &O::camera_tilt_rad, "see camera_on_vehicle() [rad]"),
      field("margin_px", &O::margin_px,
            "minimum distance of a lamp's rim from the image border [px]"),
      field("sigma_px", &O::sigma_px, "error of a lamp's centre in the image [px]"),
      field("heading_sigma_rad", &O::heading_sigma_rad,
            "prior knowledge of the heading; infinity: none [rad]"));
}

auto plan_fields() {
  using O = RoutePlanOptions;
  return std::tuple_cat(
      std::make_tuple(
          field("min_lamps", &O::min_lamps, "minimum number in view everywhere"),
          field("max_sigma_m", &O::max_sigma_m, "limit of position_sigma_m everywhere [m]"),
          field("cell_m", &O::cell_m, "cell of the lattice [m]"),
          field("corner_radius_m", &O::corner_radius_m, "[m]"),
          field("vehicle_radius_m", &O::vehicle_radius_m, "[m]"),
          field("vehicle_height_m", &O::vehicle_height_m,
                "boxes above this height are ignored [m]"),
          field("speed_m_s", &O::speed_m_s, "speed of the route [m/s]"),
          field("turn_cost_m", &O::turn_cost_m, "cost of a corner, as additional length [m]")),
      fields_within(&O::view, view_fields()));
}

auto pan_tilt_fields() {
  using O = PanTiltOptions;
  return std::tuple_cat(
      std::make_tuple(field("min_lamps", &O::min_lamps, "minimum number in view everywhere"),
                      field("min_pan_rad", &O::min_pan_rad, "[rad]"),
                      field("max_pan_rad", &O::max_pan_rad, "[rad]"),
                      field("min_tilt_rad", &O::min_tilt_rad, "[rad]"),
                      field("max_tilt_rad", &O::max_tilt_rad, "[rad]"),
                      field("pans", &O::pans, "grid points of pan, both ends included"),
                      field("tilts", &O::tilts, "grid points of tilt, both ends included"),
                      field("pan_rate_rad_s", &O::pan_rate_rad_s, "[rad/s]"),
                      field("tilt_rate_rad_s", &O::tilt_rate_rad_s, "[rad/s]"),
                      field("step_m", &O::step_m, "maximum distance between the plan's knots [m]"),
                      field("sigma_cost_1_m", &O::sigma_cost_1_m,
                            "cost of a bound, relative to a rotation by 1 rad [1/m]")),
      fields_within(&O::view, view_fields()));
}

GapRows gap_rows(const std::vector<ViewGap>& gaps) {
  GapRows rows(static_cast<Eigen::Index>(gaps.size()), 6);
  for (std::size_t i = 0; i < gaps.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) << gaps[i].from_m, gaps[i].to_m,
        gaps[i].from.transpose(), gaps[i].to.transpose();
  return rows;
}

PanTiltPlan plan_of_rows(const Rows3& rows) {
  PanTiltPlan plan;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    plan.knots.push_back({rows(i, 0), rows(i, 1), rows(i, 2)});
  plan.validate();
  return plan;
}

KnotRows knot_rows(const PanTiltPlan& plan) {
  KnotRows rows(static_cast<Eigen::Index>(plan.knots.size()), 3);
  for (std::size_t i = 0; i < plan.knots.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) << plan.knots[i].along_m, plan.knots[i].pan_rad,
        plan.knots[i].tilt_rad;
  return rows;
}

void define_visibility(py::module_& m) {
  using F = FloorVisibility;
  ResultClass<F>(m, "FloorVisibility", "Visibility of lamps from n poses on a floor.")
      .def_property_readonly(
          "lamps",
          [](const F& f) {
            std::vector<std::vector<int>> lamps;
            for (const Visibility& seen : f.seen) lamps.push_back(seen.lamps);
            return lamps;
          },
          "Ids of the lamps completely in view, a list for each pose.")
      .def_property_readonly(
          "lamps_in_view",
          [](const F& f) { return f.column([](const Visibility& v) { return v.lamps.size(); }); },
          "(n,) number of lamps completely in view.")
      .def_property_readonly(
          "power_w", [](const F& f) { return f.column([](const auto& v) { return v.power_w; }); },
          "(n,) power of all lamps through the lens [W].")
      .def_property_readonly(
          "position_sigma_m",
          [](const F& f) { return f.column([](const auto& v) { return v.position_sigma_m; }); },
          "(n,) root of the trace of the position bound [m]; infinite where there is none.")
      .def_property_readonly(
          "heading_sigma_rad",
          [](const F& f) { return f.column([](const auto& v) { return v.heading_sigma_rad; }); },
          "(n,) bound of the heading [rad].");
  const auto fields = view_fields();
  define_function(
      m, "visibility", fields,
      [](VisibilityOptions options, const Scene& scene, const Rows3& poses) {
        std::vector<PlanarPose> all;
        for (Eigen::Index i = 0; i < poses.rows(); ++i)
          all.push_back({poses(i, 0), poses(i, 1), poses(i, 2)});
        py::gil_scoped_release unlocked;
        return F{visibility(scene, all, options)};
      },
      py::arg("scene"), py::arg("poses"), py::kw_only(),
      (R"(Predicts the lamps in view and the accuracy of the pose for poses on a floor.

poses: (n, 3), x_m, y_m, heading_rad. Returns: FloorVisibility.

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
>>> occ.guide.visibility(scene, [[2, 2, 0], [0.5, 0.5, 0]]).lamps
[[0, 1, 2, 3], [0]])" +
       fields_doc(fields, "Options"))
          .c_str());
}

std::vector<PlanGoal> goals_of(const std::vector<std::vector<double>>& goals) {
  std::vector<PlanGoal> out;
  for (std::size_t i = 0; i < goals.size(); ++i) {
    require(goals[i].size() == 2 || goals[i].size() == 3, "goals[" + std::to_string(i) + "]",
            goals[i].size(), "(x_m, y_m) or (x_m, y_m, heading_rad)");
    PlanGoal goal;
    goal.position_m = {goals[i][0], goals[i][1]};
    if (goals[i].size() == 3) goal.heading_rad = goals[i][2];
    out.push_back(goal);
  }
  return out;
}

void define_plan_route(py::module_& m) {
  py::native_enum<PlanStatus>(m, "PlanStatus", "enum.Enum", "Outcome of planning.")
      .value("ok", PlanStatus::ok)
      .value("blind", PlanStatus::blind)
      .value("blocked", PlanStatus::blocked)
      .value("start_blocked", PlanStatus::start_blocked)
      .value("goal_blocked", PlanStatus::goal_blocked)
      .finalize();
  using P = RoutePlan;
  ResultClass<P>(m, "RoutePlan",
                 "Route on which the lamps stay in view, or the reason why there is none.")
      .def_property_readonly(
          "ok", [](const P& p) { return p.status == PlanStatus::ok; }, "True if status is ok.")
      .def_readonly("status", &P::status, "PlanStatus.")
      .def_readonly("message", &P::message, "Description of the problem; empty if ok.")
      .def_readonly("route", &P::route, "Route; if status is blind, the one with the fewest gaps.")
      .def_property_readonly(
          "gaps", [](const P& p) { return gap_rows(p.gaps); },
          "(n, 6) sections without view: from and to along the route, from (x, y), to (x, y) [m].")
      .def_readonly("seen_share", &P::seen_share,
                    "Share of the route's length with sufficient view.");
  const auto fields = plan_fields();
  define_function(
      m, "plan_route", fields,
      [](RoutePlanOptions options, const Scene& scene, const PlanarPose& start,
         const std::vector<std::vector<double>>& goals) {
        const std::vector<PlanGoal> wanted = goals_of(goals);
        py::gil_scoped_release unlocked;
        return plan_route(scene, start, wanted, options);
      },
      py::arg("scene"), py::arg("start"), py::arg("goals"), py::kw_only(),
      (R"(Plans the shortest route over goals on which the lamps stay in view.

start: PlanarPose. goals: (x_m, y_m) or (x_m, y_m, heading_rad) each, reached within 0.71 of a cell.
If every route has sections without view, the status is blind and `gaps` lists them.

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
>>> plan = occ.guide.plan_route(scene, occ.guide.PlanarPose(x_m=1, y_m=2), [(3, 2)])
>>> plan.status.name, round(plan.route.length_m, 2)
('ok', 2.0))" +
       fields_doc(fields, "Options"))
          .c_str());
  define_function(
      m, "view_gaps", fields,
      [](RoutePlanOptions options, const Scene& scene, const Route& route) {
        return gap_rows(view_gaps(scene, route, options));
      },
      py::arg("scene"), py::arg("route"), py::kw_only(),
      "Returns the sections of a route without sufficient view: (n, 6) as RoutePlan.gaps. "
      "Options as for plan_route().");
}

void define_pan_tilt(py::module_& m) {
  using P = PanTiltPlan;
  py::class_<P>(m, "PanTiltPlan",
                R"(Pan and tilt of a camera as functions of the distance along a route.

knots: (n, 3), along_m, pan_rad, tilt_rad; linear interpolation between them.)")
      .def(py::init(&plan_of_rows), py::arg("knots"))
      .def_property_readonly("knots", &knot_rows, "(n, 3).")
      .def(
          "at",
          [](const P& plan, double along_m) {
            const PanTiltKnot knot = plan.at(along_m);
            return std::make_pair(knot.pan_rad, knot.tilt_rad);
          },
          py::arg("along_m"), "(pan_rad, tilt_rad).")
      .def("__repr__",
           [](const P& plan) {
             return "<PanTiltPlan: " + std::to_string(plan.knots.size()) + " knots>";
           })
      .def(py::pickle([](const P& plan) { return knot_rows(plan); },
                      [](const KnotRows& rows) { return plan_of_rows(rows); }));
  using R = PanTiltResult;
  ResultClass<R>(m, "PanTiltResult", "Plan of pan and tilt, with its gaps.")
      .def_property_readonly(
          "ok", [](const R& r) { return r.status == PlanStatus::ok; }, "True if status is ok.")
      .def_readonly("status", &R::status, "PlanStatus: ok or blind.")
      .def_readonly("message", &R::message, "Description of the gaps; empty if ok.")
      .def_readonly("plan", &R::plan, "PanTiltPlan; best plan, also if it has gaps.")
      .def_property_readonly(
          "gaps", [](const R& r) { return gap_rows(r.gaps); }, "(n, 6) as RoutePlan.gaps.")
      .def_readonly("seen_share", &R::seen_share,
                    "Share of the route's length with sufficient view.");
  const auto fields = pan_tilt_fields();
  define_function(
      m, "plan_pan_tilt", fields,
      [](PanTiltOptions options, const Scene& scene, const Route& route) {
        py::gil_scoped_release unlocked;
        return plan_pan_tilt(scene, route, options);
      },
      py::arg("scene"), py::arg("route"), py::kw_only(),
      ("Plans pan and tilt angles that keep the lamps in view along a route, within the "
       "rates of the axes. Returns: PanTiltResult." +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace

void define_guide_plans(py::module_& m) {
  define_visibility(m);
  define_plan_route(m);
  define_pan_tilt(m);
}

}  // namespace occ::python
