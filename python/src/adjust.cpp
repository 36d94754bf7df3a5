// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/adjust.hpp"

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/precision.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Adjusted = Result<Adjustment>;
using Known = Result<Precision>;

auto adjust_fields() {
  using O = AdjustOptions;
  return std::make_tuple(
      field("robust", &O::robust, "gross errors are expected"),
      field("snooping", &O::snooping, "Baarda's, after it"),
      field("false_alarm", &O::false_alarm, "chance that any good observation is taken away"),
      field("max_iterations", &O::max_iterations, "of each stage"),
      field("tolerance_sigma", &O::tolerance_sigma, "of the last step"),
      field("threads", &O::threads, "1 or 2; the bits are the same"),
      field("datum", &O::datum, "in which the result is given"));
}

auto datum_fields() {
  return std::make_tuple(field("kind", &Datum::kind, "a DatumKind"),
                         field("targets", &Datum::targets, "over which; none: all"));
}

Adjusted run(const Network& network, const AdjustOptions& options, const py::object& progress) {
  AdjustCallback callback;
  if (!progress.is_none())
    callback = [&](const AdjustProgress& p) {
      py::gil_scoped_acquire locked;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      const py::object answer = progress(p.stage, p.iteration, p.cost, p.rejected);
      return answer.is_none() || answer.cast<bool>();
    };
  py::gil_scoped_release unlocked;
  return adjust(network, options, callback);
}

void define_datum(py::module_& m) {
  py::native_enum<DatumKind>(m, "DatumKind", "enum.Enum", "What holds a network's datum.")
      .value("inner", DatumKind::inner)
      .value("minimal", DatumKind::minimal)
      .value("control", DatumKind::control)
      .value("scale_only", DatumKind::scale_only)
      .finalize();
  py::class_<Datum> datum(m, "Datum", R"(What holds what a network's observations leave open.

inner: inner constraints over targets; minimal: as few coordinates of three targets as are open;
control: the observations alone; scale_only: shift and turn inner, scale by two targets' distance.)");
  define_value(datum, datum_fields());
  define_repr(datum, "Datum", datum_fields());
}

void define_adjustment(py::module_& m) {
  using A = Adjustment;
  ResultClass<RejectedObservation>(m, "RejectedObservation", "Taken for a gross error.")
      .def_readonly("observation", &RejectedObservation::observation, "Its index.")
      .def_readonly("normalised", &RejectedObservation::normalised, "Residual over its sigma.")
      .def_readonly("reason", &RejectedObservation::reason,
                    "robust, snooping, not in view, alone.");
  ResultClass<Adjusted> adjusted(m, "Adjustment",
                                 "An adjusted network; the state so far if not ok.");
  define_result(adjusted);
  adjusted.def_property_readonly("network", value_of(&A::network), "With the estimates.")
      .def_property_readonly("iterations", value_of(&A::iterations), "Of all stages.")
      .def_property_readonly("cost", value_of(&A::cost), "Half the weighted sum of squares.")
      .def_property_readonly("observations", value_of(&A::observations), "Numbers that were used.")
      .def_property_readonly("unknowns", value_of(&A::unknowns), "How many.")
      .def_property_readonly("defect", value_of(&A::defect), "Of the datum, 0 to 7.")
      .def_property_readonly("redundancy", value_of(&A::redundancy),
                             "observations - unknowns + defect.")
      .def_property_readonly("sigma0", value_of(&A::sigma0), "Of unit weight, a posteriori.")
      .def_property_readonly("rejected", value_of(&A::rejected), "RejectedObservations.")
      .def_property_readonly("warnings", value_of(&A::warnings), "What was left out, for example.")
      .def("__repr__", [](const Adjusted& r) {
        return "<Adjustment: " + std::string(to_string(r.status)) + ", sigma0 " +
               value_repr(r.value.sigma0) + ", redundancy " + std::to_string(r.value.redundancy) +
               ">";
      });
}

void define_adjusting(py::module_& m) {
  DefaultTexts texts;
  const auto fields = adjust_fields();
  std::apply(
      [&](const auto&... f) {
        const std::string doc =
            "Bundle adjustment of a Network, gauge-free, its datum set afterwards.\n\n"
            "progress(stage, iteration, cost, rejected): called now and then; False stops it.\n"
            "Returns: Adjustment; status too_few_lamps, degenerate (the message names what is not "
            "determined) or not_converged, with the state so far.\n"
            "Raises: ValueError naming what is wrong with the network or the options." +
            fields_doc(fields, "Options");
        m.def(
            "adjust",
            [fields](const Network& network, const py::object& progress,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              return run(network, from_values<AdjustOptions>(fields, values...), progress);
            },
            py::arg("network"), py::kw_only(), py::arg("progress") = py::none(),
            argument(f, texts)..., doc.c_str());
      },
      fields);
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
      py::arg("network"), "(n, 2) seen minus projected [px] of every image observation.");
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
  ResultClass<Known> known(m, "Precision", "Covariance of a network's unknowns, in a datum.");
  define_result(known);
  const auto of = [](auto member) {
    return [member](const Known& k, int index) { return (k.value.*member)(index); };
  };
  known
      .def_property_readonly(
          "defect", [](const Known& k) { return k.value.defect(); }, "Of the datum, 0 to 7.")
      .def_property_readonly(
          "unknowns", [](const Known& k) { return k.value.unknowns(); }, "How many.")
      .def(
          "points", [](const Known& k) { return stacked(k.value.points()); },
          "(n, 3, 3) of all points [m^2].")
      .def(
          "position", [](const Known& k, const Target& t) { return k.value.position(t); },
          py::arg("target"), "(3, 3) of a target [m^2].")
      .def(
          "distance_sigma_m",
          [](const Known& k, const Target& a, const Target& b) {
            return k.value.distance_sigma_m(a, b);
          },
          py::arg("a"), py::arg("b"), "Of two targets' distance.")
      .def("station", of(&Precision::station), py::arg("station"), "(6, 6) of a pose.")
      .def("station_position", of(&Precision::station_position), py::arg("station"),
           "(3, 3) of where it is [m^2].")
      .def("mount", of(&Precision::mount), py::arg("mount"), "(6, 6) of a pose.")
      .def("body", of(&Precision::body), py::arg("body"), "(6, 6) of a pose.")
      .def("body_scale_sigma", of(&Precision::body_scale_sigma), py::arg("body"), "Relative.")
      .def("parameters", of(&Precision::parameters), py::arg("camera"),
           "(k, k) of a camera's free parameters, in their order.")
      .def("parameter_correlation", of(&Precision::parameter_correlation), py::arg("camera"),
           "(k, k).")
      .def(
          "in_datum", [](const Known& k, const Datum& datum) { return k.value.in_datum(datum); },
          py::arg("datum"), "The same in another datum, without solving again.")
      .def(
          "scaled",
          [](const Known& k, double factor) {
            return Known{k.value.scaled(factor), k.status, k.message};
          },
          py::arg("variance_factor"), "All of it times a factor, sigma0 squared for example.")
      .def("__repr__", [](const Known& k) {
        return "<Precision: " + std::string(to_string(k.status)) + ", " +
               std::to_string(k.value.unknowns()) + " unknowns, defect " +
               std::to_string(k.value.defect()) + ">";
      });
  m.def("precision", &precision, py::arg("network"), py::arg_v("datum", Datum{}, "Datum()"),
        py::arg("threads") = 2, py::call_guard<py::gil_scoped_release>(),
        R"(How well a network determines its unknowns, at its present state.

It is the Cramer-Rao bound, also of a design that was never photographed. Returns: Precision; status
degenerate: something is not determined, the message names it.)");
}

}  // namespace

void define_adjust(py::module_& m) {
  define_datum(m);
  define_adjustment(m);
  define_adjusting(m);
  define_precision(m);
}

}  // namespace occ::python
