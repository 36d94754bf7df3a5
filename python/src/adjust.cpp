// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/adjust.hpp"

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/precision.hpp"
#include "module.hpp"
#include "progress.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Adjusted = Result<Adjustment>;
using Known = Result<Precision>;

auto adjust_fields() {
  using O = AdjustOptions;
  return std::make_tuple(
      field("robust", &O::robust, "robust estimation; needed if gross errors are expected"),
      field("snooping", &O::snooping, "data snooping after it (Baarda)"),
      field("false_alarm", &O::false_alarm,
            "probability that snooping rejects any correct observation"),
      field("max_iterations", &O::max_iterations, "limit for each stage"),
      field("tolerance_sigma", &O::tolerance_sigma, "norm of the last step, in sigmas"),
      field("threads", &O::threads, "at least 1; any number gives the same bits"),
      field("datum", &O::datum, "datum of the result"));
}

auto datum_fields() {
  return std::make_tuple(field("kind", &Datum::kind, "kind of the conditions"),
                         field("targets", &Datum::targets, "targets of the conditions; none: all"));
}

Adjusted run(const Network& network, const AdjustOptions& options, const py::object& progress) {
  AdjustCallback callback;
  if (!progress.is_none())
    callback = [&](const AdjustProgress& p) {
      return report_progress(progress, p.stage, p.iteration, p.cost, p.rejected);
    };
  py::gil_scoped_release unlocked;
  return adjust(network, options, callback);
}

void define_datum(py::module_& m) {
  py::native_enum<DatumKind>(m, "DatumKind", "enum.Enum", "Kind of datum conditions.")
      .value("inner", DatumKind::inner)
      .value("minimal", DatumKind::minimal)
      .value("control", DatumKind::control)
      .value("scale_only", DatumKind::scale_only)
      .finalize();
  py::class_<Datum> datum(
      m, "Datum",
      R"(Datum of a network: conditions for the datum defect that the observations leave.

inner: inner constraints over targets; minimal: as many coordinates of three targets as the defect;
control: no conditions; scale_only: inner constraints, the distance of two targets for the scale.)");
  define_value(datum, datum_fields());
  define_repr(datum, "Datum", datum_fields());
}

void define_adjustment(py::module_& m) {
  using A = Adjustment;
  ResultClass<RejectedObservation>(m, "RejectedObservation",
                                   "Observation rejected as a gross error.")
      .def_readonly("observation", &RejectedObservation::observation, "Index of the observation.")
      .def_readonly("normalised", &RejectedObservation::normalised, "Residual over its sigma.")
      .def_readonly("reason", &RejectedObservation::reason,
                    "robust, snooping, not in view, no agreement.");
  ResultClass<RejectedDistance>(m, "RejectedDistance", "Distance rejected as a gross error.")
      .def_readonly("distance", &RejectedDistance::distance, "Index of the distance.")
      .def_readonly("normalised", &RejectedDistance::normalised, "Residual over its sigma.")
      .def_readonly("residual_m", &RejectedDistance::residual_m, "Measured minus adjusted length.")
      .def_readonly("name", &RejectedDistance::name, "\"distance 2 (p21 to p33, 2.002 m)\".");
  ResultClass<RejectedControl>(m, "RejectedControl", "Control point rejected as a gross error.")
      .def_readonly("control", &RejectedControl::control, "Index of the control point.")
      .def_readonly("normalised", &RejectedControl::normalised,
                    "Length of the residual in its sigmas.")
      .def_readonly("coordinate", &RejectedControl::coordinate,
                    "0, 1 or 2: x, y or z differs most.")
      .def_readonly("residual_m", &RejectedControl::residual_m,
                    "Known minus adjusted value of that coordinate.")
      .def_readonly("name", &RejectedControl::name, "\"control point 2 (p11)\".");
  ResultClass<LeftOut>(m, "LeftOut", "Something observed that is not in the adjustment.")
      .def_property_readonly(
          "kind",
          [](const LeftOut& one) {
            static const char* const names[] = {"station", "point", "body", "distance", "control"};
            return names[static_cast<int>(one.kind)];
          },
          "\"station\", \"point\", \"body\", \"distance\" or \"control\".")
      .def_readonly("index", &LeftOut::index, "Index in its list.")
      .def_readonly("name", &LeftOut::name, "Kind and name.")
      .def_readonly("reason", &LeftOut::reason, "A clause: \"is observed in one image only\".");
  ResultClass<Adjusted> adjusted(m, "Adjustment", "An adjusted network; the last state if not ok.");
  define_result(adjusted);
  adjusted.def_property_readonly("network", value_of(&A::network), "Network with the estimates.")
      .def_property_readonly("iterations", value_of(&A::iterations),
                             "Number of steps of all stages.")
      .def_property_readonly("cost", value_of(&A::cost), "Half the weighted sum of squares.")
      .def_property_readonly("observations", value_of(&A::observations),
                             "Number of used scalar observations.")
      .def_property_readonly("unknowns", value_of(&A::unknowns), "Number of unknowns.")
      .def_property_readonly("defect", value_of(&A::defect), "Datum defect, 0 to 7.")
      .def_property_readonly("redundancy", value_of(&A::redundancy),
                             "observations - unknowns + defect.")
      .def_property_readonly("sigma0", value_of(&A::sigma0),
                             "A posteriori standard deviation of unit weight.")
      .def_property_readonly("rejected", value_of(&A::rejected), "List of RejectedObservation.")
      .def_property_readonly("rejected_distances", value_of(&A::rejected_distances),
                             "List of RejectedDistance.")
      .def_property_readonly("rejected_control", value_of(&A::rejected_control),
                             "List of RejectedControl.")
      .def_property_readonly(
          "left_out", value_of(&A::left_out),
          "List of LeftOut: stations, points, bodies, distances, control points.")
      .def_property_readonly("weak_points", value_of(&A::weak_points),
                             "Indices of points with rejected rays that keep two rays, or at most "
                             "half of their rays: their errors may not be detected.")
      .def_property_readonly("rejected_share", value_of(&A::rejected_share),
                             "Rejected image points over those given, 0 to 1.")
      .def_property_readonly("warnings", value_of(&A::warnings),
                             "A sentence for each thing that the user should check.")
      .def("__repr__", [](const Adjusted& r) {
        return "<Adjustment: " + std::string(to_string(r.status)) + ", sigma0 " +
               value_repr(r.value.sigma0) + ", redundancy " + std::to_string(r.value.redundancy) +
               ">";
      });
}

void define_adjusting(py::module_& m) {
  const auto fields = adjust_fields();

  const std::string doc =
      "Adjusts a Network by weighted least squares (bundle adjustment).\n\n"
      "The network is free during the steps; the datum is set afterwards.\n"
      "progress(stage, iteration, cost, rejected): called in each step; False stops it.\n"
      "Returns: Adjustment; status ok (the message counts what was rejected), ambiguous "
      "(observations "
      "contradict each other), too_few_lamps, degenerate (the message names undetermined "
      "unknowns) or not_converged, with the last state.\n"
      "Raises: ValueError for an invalid network or option." +
      fields_doc(fields, "Options");
  define_function(
      m, "adjust", fields,
      [](AdjustOptions options, const Network& network, const py::object& progress) {
        return run(network, options, progress);
      },
      py::arg("network"), py::kw_only(), py::arg("progress") = py::none(), doc.c_str());
  m.def(
      "image_residuals_px",
      [](const Network& network) {
        const std::vector<Eigen::Vector2d> all = image_residuals_px(network);
        Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> rows(
            static_cast<Eigen::Index>(all.size()), 2);
        for (std::size_t i = 0; i < all.size(); ++i)
          rows.row(static_cast<Eigen::Index>(i)) = all[i].transpose();
        return rows;
      },
      py::arg("network"),
      "Returns the residuals (observed minus projected) of all image observations, (n, 2) [px].");
}

py::array_t<double> stacked(const std::vector<Eigen::Matrix3d>& all) {
  py::array_t<double> array(std::vector<py::ssize_t>{static_cast<py::ssize_t>(all.size()), 3, 3});
  auto out = array.mutable_unchecked<3>();
  for (std::size_t k = 0; k < all.size(); ++k)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) out(static_cast<py::ssize_t>(k), i, j) = all[k](i, j);
  return array;
}

void define_precision(py::module_& m) {
  ResultClass<Known> known(m, "Precision", "Covariances of a network's unknowns in a datum.");
  define_result(known);
  const auto of = [](auto member) {
    return [member](const Known& k, int index) { return (k.value.*member)(index); };
  };
  known
      .def_property_readonly(
          "defect", [](const Known& k) { return k.value.defect(); }, "Datum defect, 0 to 7.")
      .def_property_readonly(
          "unknowns", [](const Known& k) { return k.value.unknowns(); }, "Number of unknowns.")
      .def(
          "points", [](const Known& k) { return stacked(k.value.points()); },
          "Covariances of all points, (n, 3, 3) [m^2].")
      .def(
          "position", [](const Known& k, const Target& t) { return k.value.position(t); },
          py::arg("target"), "Covariance of a target's position, (3, 3) [m^2].")
      .def(
          "positions",
          [](const Known& k, const Target& a, const Target& b) { return k.value.positions(a, b); },
          py::arg("a"), py::arg("b"), "Joint covariance of two positions, (6, 6) [m^2].")
      .def(
          "distance_sigma_m",
          [](const Known& k, const Target& a, const Target& b) {
            return k.value.distance_sigma_m(a, b);
          },
          py::arg("a"), py::arg("b"), "Standard deviation of the distance of two targets.")
      .def(
          "joint",
          [](const Known& k, const std::vector<Target>& targets) { return k.value.joint(targets); },
          py::arg("targets"),
          "Joint covariance of the positions of n targets, (3n, 3n) [m^2]; left-out targets have "
          "an "
          "infinite diagonal.")
      .def("station", of(&Precision::station), py::arg("station"),
           "Covariance of a station's pose, (6, 6).")
      .def("station_position", of(&Precision::station_position), py::arg("station"),
           "Covariance of a station's position, (3, 3) [m^2].")
      .def("mount", of(&Precision::mount), py::arg("mount"),
           "Covariance of a mount's pose, (6, 6).")
      .def("body", of(&Precision::body), py::arg("body"), "Covariance of a body's pose, (6, 6).")
      .def("body_scale_sigma", of(&Precision::body_scale_sigma), py::arg("body"),
           "Relative standard deviation of a body's scale.")
      .def("parameters", of(&Precision::parameters), py::arg("camera"),
           "Covariance of a camera's free parameters in their order, (k, k).")
      .def("parameter_correlation", of(&Precision::parameter_correlation), py::arg("camera"),
           "Correlation of a camera's free parameters, (k, k).")
      .def(
          "in_datum", [](const Known& k, const Datum& datum) { return k.value.in_datum(datum); },
          py::arg("datum"), "Covariances in another datum, by S-transformation.")
      .def(
          "scaled",
          [](const Known& k, double factor) {
            return Known{k.value.scaled(factor), k.status, k.message};
          },
          py::arg("variance_factor"),
          "Returns all covariances times a factor, such as sigma0 squared.")
      .def("__repr__", [](const Known& k) {
        return "<Precision: " + std::string(to_string(k.status)) + ", " +
               std::to_string(k.value.unknowns()) + " unknowns, defect " +
               std::to_string(k.value.defect()) + ">";
      });
  m.def("precision", &precision, py::arg("network"), py::arg_v("datum", Datum{}, "Datum()"),
        py::arg("threads") = 2, py::call_guard<py::gil_scoped_release>(),
        R"(Computes the covariances of a network's unknowns at its current state.

They are the Cramer-Rao bound, also for a planned network without images. Returns: Precision; status
degenerate: the message names the undetermined unknowns.)");
}

}  // namespace

void define_adjust(py::module_& m) {
  define_datum(m);
  define_adjustment(m);
  define_adjusting(m);
  define_precision(m);
}

}  // namespace occ::python
