// SPDX-License-Identifier: Apache-2.0
// What is seen from a floor, and plans that keep it in view.
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

/// Of places of the floor, as arrays.
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
      field("camera_place_m", &O::camera_place_m, "(3,) on the vehicle, above the floor [m]"),
      field("camera_pan_rad", &O::camera_pan_rad, "as camera_on_vehicle() has it"),
      field("camera_tilt_rad", &O::camera_tilt_rad, "alike"),
      field("margin_px", &O::margin_px, "a lamp's rim is so far within the image [px]"),
      field("sigma_px", &O::sigma_px, "of a lamp's centre in the image [px]"),
      field("heading_sigma_rad", &O::heading_sigma_rad,
            "known beside the image; infinity: nothing [rad]"));
}

auto plan_fields() {
  using O = RoutePlanOptions;
  return std::tuple_cat(
      std::make_tuple(
          field("min_lamps", &O::min_lamps, "in view everywhere"),
          field("max_sigma_m", &O::max_sigma_m, "of the place, everywhere [m]"),
          field("cell_m", &O::cell_m, "of the lattice [m]"),
          field("corner_radius_m", &O::corner_radius_m, "[m]"),
          field("vehicle_radius_m", &O::vehicle_radius_m, "[m]"),
          field("vehicle_height_m", &O::vehicle_height_m, "boxes above are driven under [m]"),
          field("speed_m_s", &O::speed_m_s, "of the route [m/s]"),
          field("turn_cost_m", &O::turn_cost_m, "a corner counts as so much more way [m]")),
      fields_within(&O::view, view_fields()));
}

auto pan_tilt_fields() {
  using O = PanTiltOptions;
  return std::tuple_cat(
      std::make_tuple(
          field("min_lamps", &O::min_lamps, "in view everywhere"),
          field("min_pan_rad", &O::min_pan_rad, "[rad]"),
          field("max_pan_rad", &O::max_pan_rad, "[rad]"),
          field("min_tilt_rad", &O::min_tilt_rad, "[rad]"),
          field("max_tilt_rad", &O::max_tilt_rad, "[rad]"),
          field("pans", &O::pans, "of the grid, both ends included"),
          field("tilts", &O::tilts, "alike"),
          field("pan_rate_rad_s", &O::pan_rate_rad_s, "[rad/s]"),
          field("tilt_rate_rad_s", &O::tilt_rate_rad_s, "[rad/s]"),
          field("step_m", &O::step_m, "between the plan's knots, at most [m]"),
          field("sigma_cost_1_m", &O::sigma_cost_1_m, "what a bound costs beside a turn by 1 rad")),
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
  ResultClass<F>(m, "FloorVisibility", "What is seen from n poses on a floor.")
      .def_property_readonly(
          "lamps",
          [](const F& f) {
            std::vector<std::vector<int>> lamps;
            for (const Visibility& seen : f.seen) lamps.push_back(seen.lamps);
            return lamps;
          },
          "Ids of the lamps wholly in view, a list for each pose.")
      .def_property_readonly(
          "lamps_in_view",
          [](const F& f) { return f.column([](const Visibility& v) { return v.lamps.size(); }); },
          "(n,) how many.")
      .def_property_readonly(
          "power_w", [](const F& f) { return f.column([](const auto& v) { return v.power_w; }); },
          "(n,) of all lamps through the lens [W].")
      .def_property_readonly(
          "position_sigma_m",
          [](const F& f) { return f.column([](const auto& v) { return v.position_sigma_m; }); },
          "(n,) root of the trace of the place's bound [m]; infinite where there is none.")
      .def_property_readonly(
          "heading_sigma_rad",
          [](const F& f) { return f.column([](const auto& v) { return v.heading_sigma_rad; }); },
          "(n,) [rad].");
  const auto fields = view_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "visibility",
            [fields](const Scene& scene, const Rows3& poses,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              const auto options = from_values<VisibilityOptions>(fields, values...);
              std::vector<PlanarPose> all;
              for (Eigen::Index i = 0; i < poses.rows(); ++i)
                all.push_back({poses(i, 0), poses(i, 1), poses(i, 2)});
              py::gil_scoped_release unlocked;
              return F{visibility(scene, all, options)};
            },
            py::arg("scene"), py::arg("poses"), py::kw_only(), argument(f, texts)...,
            (R"(What a vehicle would see from places of a floor, before it has been there.

poses: (n, 3), x_m, y_m, heading_rad. Returns: FloorVisibility.

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
>>> occ.visibility(scene, [[2, 2, 0], [0.5, 0.5, 0]]).lamps
[[0, 1, 2, 3], [0]])" +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
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
  py::native_enum<PlanStatus>(m, "PlanStatus", "enum.Enum", "Whether there is a plan.")
      .value("ok", PlanStatus::ok)
      .value("blind", PlanStatus::blind)
      .value("blocked", PlanStatus::blocked)
      .value("start_blocked", PlanStatus::start_blocked)
      .value("goal_blocked", PlanStatus::goal_blocked)
      .finalize();
  using P = RoutePlan;
  ResultClass<P>(m, "RoutePlan", "A route on which lamps stay in view, or where there is none.")
      .def_property_readonly(
          "ok", [](const P& p) { return p.status == PlanStatus::ok; }, "Whether there is one.")
      .def_readonly("status", &P::status, "PlanStatus.")
      .def_readonly("message", &P::message, "Where and why there is none.")
      .def_readonly("route", &P::route, "Route; the least blind one when status is blind.")
      .def_property_readonly(
          "gaps", [](const P& p) { return gap_rows(p.gaps); },
          "(n, 6) places without view: from and to along the route, from (x, y), to (x, y) [m].")
      .def_readonly("seen_share", &P::seen_share, "Of the route's length.");
  const auto fields = plan_fields();
  DefaultTexts texts, gap_texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "plan_route",
            [fields](const Scene& scene, const PlanarPose& start,
                     const std::vector<std::vector<double>>& goals,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              const auto options = from_values<RoutePlanOptions>(fields, values...);
              const std::vector<PlanGoal> wanted = goals_of(goals);
              py::gil_scoped_release unlocked;
              return plan_route(scene, start, wanted, options);
            },
            py::arg("scene"), py::arg("start"), py::arg("goals"), py::kw_only(),
            argument(f, texts)...,
            (R"(The shortest route over goals on which the lamps stay in view.

start: PlanarPose. goals: (x_m, y_m) or (x_m, y_m, heading_rad) each, met to 0.71 of a cell. Where
every way leads through places without view the status is blind, and `gaps` says which they are.

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/kookmin_four_lamps.yaml")
>>> plan = occ.plan_route(scene, occ.PlanarPose(x_m=1, y_m=2), [(3, 2)])
>>> plan.status.name, round(plan.route.length_m, 2)
('ok', 2.0))" +
             fields_doc(fields, "Options"))
                .c_str());
        m.def(
            "view_gaps",
            [fields](const Scene& scene, const Route& route,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              return gap_rows(
                  view_gaps(scene, route, from_values<RoutePlanOptions>(fields, values...)));
            },
            py::arg("scene"), py::arg("route"), py::kw_only(), argument(f, gap_texts)...,
            "Where along a route too little is seen: (n, 6) as RoutePlan.gaps; options as of "
            "plan_route().");
      },
      fields);
}

void define_pan_tilt(py::module_& m) {
  using P = PanTiltPlan;
  py::class_<P>(m, "PanTiltPlan", R"(How a camera pans and tilts on the way along a route.

knots: (n, 3), along_m, pan_rad, tilt_rad; straight between them.)")
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
  ResultClass<R>(m, "PanTiltResult", "A plan of pan and tilt, and where there is none.")
      .def_property_readonly(
          "ok", [](const R& r) { return r.status == PlanStatus::ok; }, "Whether there is one.")
      .def_readonly("status", &R::status, "PlanStatus: ok or blind.")
      .def_readonly("message", &R::message, "Where there is none.")
      .def_readonly("plan", &R::plan, "PanTiltPlan, the least blind one.")
      .def_property_readonly(
          "gaps", [](const R& r) { return gap_rows(r.gaps); }, "(n, 6) as RoutePlan.gaps.")
      .def_readonly("seen_share", &R::seen_share, "Of the route's length.");
  const auto fields = pan_tilt_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "plan_pan_tilt",
            [fields](const Scene& scene, const Route& route,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              const auto options = from_values<PanTiltOptions>(fields, values...);
              py::gil_scoped_release unlocked;
              return plan_pan_tilt(scene, route, options);
            },
            py::arg("scene"), py::arg("route"), py::kw_only(), argument(f, texts)...,
            ("How a camera that pans and tilts keeps lamps in view along a route, within its "
             "rates: "
             "PanTiltResult." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

}  // namespace

void define_guide_plans(py::module_& m) {
  define_visibility(m);
  define_plan_route(m);
  define_pan_tilt(m);
}

}  // namespace occ::python
