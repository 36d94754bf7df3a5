// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/network_statistics.hpp"

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/network/measure_points.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using Statistics = Result<NetworkStatistics>;
using Selected = Result<Selection>;
using Components = Result<VarianceComponents>;
using Checked = Result<CheckResult>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

template <class Member>
auto rows_of(Member member) {
  return [member](const Statistics& s) {
    Rows rows(static_cast<Eigen::Index>(s->image_observations.size()), 2);
    Eigen::Index i = 0;
    for (const ObservationStatistics& o : s->image_observations)
      rows.row(i++) = (o.*member).transpose();
    return rows;
  };
}

void define_statistics(py::module_& m) {
  using S = NetworkStatistics;
  using O = ObservationStatistics;
  ResultClass<Statistics> statistics(m, "NetworkStatistics", R"(Reliability of an adjusted network.

Arrays (n, 2) have a row for each image observation, columns along x and y; zero when not used.)");
  define_result(statistics);
  statistics
      .def_property_readonly("sigma0", value_of(&S::sigma0),
                             "A posteriori standard deviation of unit weight.")
      .def_property_readonly("sigma0_low", value_of(&S::sigma0_low),
                             "Lower limit (95 %) for correct sigmas.")
      .def_property_readonly("sigma0_high", value_of(&S::sigma0_high), "Upper limit (95 %).")
      .def_property_readonly("redundancy_sum", value_of(&S::redundancy),
                             "observations - unknowns + defect")
      .def_property_readonly("w_critical", value_of(&S::w_critical),
                             "Critical value of w: 1 % false alarms for all tests together.")
      .def_property_readonly("tau_critical", value_of(&S::tau_critical),
                             "Critical value of tau, likewise.")
      .def_property_readonly("residual_px", rows_of(&O::residual_px), "Observed minus projected.")
      .def_property_readonly("redundancy", rows_of(&O::redundancy), "Redundancy numbers, 0 to 1.")
      .def_property_readonly("w", rows_of(&O::w), "Baarda's test statistic.")
      .def_property_readonly("tau", rows_of(&O::tau), "Pope's test statistic.")
      .def_property_readonly("detectable_px", rows_of(&O::detectable_px),
                             "Minimal detectable error (0.1 % false alarms, 80 % power).")
      .def_property_readonly("external", rows_of(&O::external),
                             "Largest effect of that error on the unknowns, in sigmas.")
      .def_property_readonly(
          "image_rms_px",
          [](const Statistics& s) {
            Rows rows(static_cast<Eigen::Index>(s->rms_px_of_image.size()), 2);
            for (std::size_t i = 0; i < s->rms_px_of_image.size(); ++i)
              rows.row(static_cast<Eigen::Index>(i)) = s->rms_px_of_image[i].transpose();
            return rows;
          },
          "R.m.s. residual of each image, (images, 2).");
  m.def("network_statistics", &network_statistics, py::arg("network"), py::arg("threads") = 2,
        py::call_guard<py::gil_scoped_release>(),
        "Computes the NetworkStatistics of an adjusted Network.");
}

void define_parameters(py::module_& m) {
  using P = ParameterStatistics;
  const auto fields = std::make_tuple(
      field("camera", &P::camera, "index of the camera"), field("name", &P::name, "parameter"),
      field("unit", &P::unit, "unit of value and sigma"), field("value", &P::value, "estimated"),
      field("nominal", &P::nominal, "value if not estimated"),
      field("sigma", &P::sigma, "standard deviation of the value"),
      field("t", &P::t, "|value - nominal| / sigma"),
      field("significant", &P::significant, "two-sided test at 1 %"),
      field("correlation", &P::correlation, "largest with another parameter of its camera"),
      field("correlated_with", &P::correlated_with, "that other parameter"),
      field("highly_correlated", &P::highly_correlated, "its magnitude exceeds 0.9"));
  ResultClass<P> parameter(m, "ParameterStatistics", "Significance of an estimated parameter.");
  define_properties(parameter, fields);
  define_repr(parameter, "ParameterStatistics", fields);
  m.def(
      "parameter_statistics",
      [](const Network& adjusted, const Network& nominal, const Result<Precision>& known) {
        return parameter_statistics(adjusted, nominal, known.value);
      },
      py::arg("network"), py::arg("nominal"), py::arg("precision"),
      "Computes the ParameterStatistics of all free parameters. nominal: the network with their "
      "values if they are not estimated.");
}

void define_selection(py::module_& m) {
  using T = SelectionStep;
  ResultClass<T>(m, "SelectionStep", "One adjustment of select_parameters().")
      .def_readonly("dropped", &T::dropped, "Dropped parameter; empty: first adjustment, with all.")
      .def_readonly("reason", &T::reason, "Reason.")
      .def_readonly("sigma0", &T::sigma0, "Sigma0 after it.")
      .def_readonly("bic", &T::bic, "Bayesian information criterion after it.");
  ResultClass<Selected> selected(m, "Selection",
                                 "Parameters that the observations determine significantly.");
  define_result(selected);
  selected
      .def_property_readonly(
          "adjustment",
          [](const Selected& s) {
            return Result<Adjustment>{s->adjustment, s.status, s.message};
          },
          "Adjustment with the parameters that were kept.")
      .def_property_readonly("steps", value_of(&Selection::steps), "List of SelectionStep.");
  m.def(
      "select_parameters",
      [](const Network& network, const Datum& datum, bool robust, double false_alarm,
         double max_correlation, const std::vector<std::string>& keep,
         const std::vector<Camera>& nominal) {
        SelectOptions options;
        options.adjust.datum = datum;
        options.adjust.robust = options.adjust.snooping = robust;
        options.false_alarm = false_alarm;
        options.max_correlation = max_correlation;
        options.keep = keep;
        options.nominal = nominal;
        py::gil_scoped_release unlocked;
        return select_parameters(network, options);
      },
      py::arg("network"), py::kw_only(), py::arg_v("datum", Datum{}, "Datum()"),
      py::arg("robust") = true, py::arg("false_alarm") = SelectOptions{}.false_alarm,
      py::arg("max_correlation") = SelectOptions{}.max_correlation,
      py::arg_v("keep", std::vector<std::string>{}, "[]"),
      py::arg_v("nominal", std::vector<Camera>{}, "[]"),
      R"(Drops free camera parameters one by one until all are significant and separable.

false_alarm: level of significance. max_correlation: above it, the less significant of two goes.
keep: names that are never dropped. nominal: cameras with the values that parameters have if they
are not estimated; default: those of the network. Returns: Selection.
Raises: ValueError for nominal cameras of another number or model.)");
}

void define_components(py::module_& m) {
  using C = VarianceComponent;
  ResultClass<C>(m, "VarianceComponent", "Ratio of estimated to given sigmas of a group.")
      .def_readonly("camera", &C::camera, "Index of the camera.")
      .def_readonly("axis", &C::axis, "0: columns, 1: rows.")
      .def_readonly("factor", &C::factor, "Ratio of estimated to given sigmas.")
      .def_readonly("redundancy", &C::redundancy, "Redundancy of the group.")
      .def_readonly("observations", &C::observations, "Number of observations.");
  ResultClass<Components> components(m, "VarianceComponents", "Result of variance_components().");
  define_result(components);
  components
      .def_property_readonly("components", value_of(&VarianceComponents::components),
                             "List of VarianceComponent.")
      .def_property_readonly("rounds", value_of(&VarianceComponents::rounds),
                             "Number of iterations.")
      .def_property_readonly(
          "adjustment",
          [](const Components& c) {
            return Result<Adjustment>{c->adjustment, c.status, c.message};
          },
          "Adjustment with the new sigmas.");
  m.def(
      "variance_components",
      [](const Network& network, const Datum& datum) {
        AdjustOptions options;
        options.datum = datum;
        return variance_components(network, options);
      },
      py::arg("network"), py::arg_v("datum", Datum{}, "Datum()"),
      py::call_guard<py::gil_scoped_release>(),
      "Estimates sigmas of each camera's columns and rows from the residuals (Foerstner 1979).");
}

void define_checks(py::module_& m) {
  ResultClass<Checked> checked(m, "CheckResult", "Errors at check points.");
  define_result(checked);
  checked.def_property_readonly("rmse_m", value_of(&CheckResult::rmse_m), "R.m.s. error (3,).")
      .def_property_readonly("predicted_m", value_of(&CheckResult::predicted_m), "Predicted (3,).")
      .def_property_readonly("rmse_3d_m", value_of(&CheckResult::rmse_3d_m),
                             "R.m.s. error in space.")
      .def_property_readonly("predicted_3d_m", value_of(&CheckResult::predicted_3d_m),
                             "Predicted error in space.")
      .def_property_readonly("errors_m", value_of(&CheckResult::errors_m), "Error of each point.");
  m.def(
      "check_points",
      [](const Network& network, const Result<Precision>& known, const std::vector<Target>& targets,
         const Rows3& positions_m) {
        require(positions_m.rows() == static_cast<Eigen::Index>(targets.size()), "positions_m",
                positions_m.rows(), "a row for each target");
        std::vector<CheckPoint> points;
        for (std::size_t i = 0; i < targets.size(); ++i)
          points.push_back({targets[i], positions_m.row(static_cast<Eigen::Index>(i)).transpose()});
        return check_points(network, known.value, points);
      },
      py::arg("network"), py::arg("precision"), py::arg("targets"), py::arg("positions_m"),
      "Computes the errors at Targets with independently known positions (n, 3) [m], and their "
      "predictions.");
  m.def(
      "projection_uncertainty",
      [](const Camera& camera, const std::vector<std::string>& free,
         const Eigen::MatrixXd& covariance, int columns, int rows, double range_m) {
        const ProjectionUncertainty u =
            projection_uncertainty(camera, free, covariance, columns, rows, range_m);
        return std::make_tuple(u.sigma_px, u.mean_px, u.worst_px);
      },
      py::arg("camera"), py::arg("free_parameters"), py::arg("covariance"), py::kw_only(),
      py::arg("columns") = 24, py::arg("rows") = 18,
      py::arg_v("range_m", std::numeric_limits<double>::infinity(), "float('inf')"),
      R"(Computes the uncertainty of a calibrated camera's projection, as defined by mrcal.

The part that equals a small rotation of the camera (at a finite range: and translation) is removed.
Returns: sigma_px (rows, columns), its mean, its maximum.)");
}

using MeasuredPoints = Measurement;

void define_measuring(py::module_& m) {
  using P = MeasuredPoint;
  ResultClass<P>(m, "MeasuredPoint", "Point measured by intersection of rays.")
      .def_readonly("status", &P::status, "ok, too_few_lamps, degenerate or not_converged.")
      .def_readonly("position_m", &P::position_m, "(3,) [m].")
      .def_readonly("covariance_m2", &P::covariance_m2, "(3, 3); infinite when not ok.")
      .def_readonly("sigma0", &P::sigma0, "A posteriori, from 2n - 3 redundant observations.")
      .def_readonly("worst_residual_px", &P::worst_residual_px, "Largest absolute residual [px].")
      .def_readonly("angle_rad", &P::angle_rad, "Largest angle between two rays.")
      .def_property_readonly(
          "images", [](const P& p) { return p.observations.size(); }, "Number of image points.");
  ResultClass<MeasuredPoints> measurement(m, "Measurement", "Result of measure_points().");
  measurement.def_readonly("points", &Measurement::points, "List of MeasuredPoint.")
      .def_readonly("covariance_m2", &Measurement::covariance_m2, "Joint covariance (3n, 3n).")
      .def(
          "distance",
          [](const Measurement& x, int from, int to) {
            const int n = static_cast<int>(x.points.size());
            for (const int i : {from, to})
              require(i >= 0 && i < n, "point", i, "the index of a measured point");
            const MeasuredDistance d = distance_between(x, from, to);
            return std::make_pair(d.length_m, d.sigma_m);
          },
          py::arg("from_"), py::arg("to"), "Returns (length, sigma) [m] between two points.");
  m.def(
      "measure_points",
      [](const Network& network,
         const std::vector<std::vector<std::tuple<int, Eigen::Vector2d, Eigen::Vector2d>>>& points,
         const std::optional<Result<Precision>>& known) {
        std::vector<std::vector<PointObservation>> all;
        for (const auto& point : points) {
          all.emplace_back();
          for (const auto& [image, pixel, sigma] : point)
            all.back().push_back({image, pixel, sigma});
        }
        return measure_points(network, all, known ? &known->value : nullptr);
      },
      py::arg("network"), py::arg("points"), py::arg("precision") = py::none(),
      R"(Measures points by intersection from calibrated images, with covariance.

points: for each a list of (image, pixel (2,), sigma_px (2,)). precision: of the same network; its
uncertainty is propagated. Returns: Measurement.)");
}

}  // namespace

void define_network_statistics(py::module_& m) {
  define_statistics(m);
  define_parameters(m);
  define_selection(m);
  define_components(m);
  define_checks(m);
  define_measuring(m);
}

}  // namespace occ::python
