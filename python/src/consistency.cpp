// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/consistency.hpp"

#include <variant>

#include "fields.hpp"
#include "libocc/core/statistics.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Squared =
    Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
using Dofs = std::variant<int, Eigen::MatrixXi>;

Eigen::MatrixXi dofs_of(const Dofs& dof, const Squared& squared) {
  if (const int* same = std::get_if<int>(&dof))
    return Eigen::MatrixXi::Constant(squared.rows(), squared.cols(), *same);
  return std::get<Eigen::MatrixXi>(dof);
}

}  // namespace

void define_consistency(py::module_& m) {
  py::native_enum<Consistency>(m, "Consistency", "enum.Enum",
                               "Whether covariances are those of the errors.")
      .value("consistent", Consistency::consistent)
      .value("optimistic", Consistency::optimistic, "errors are larger than the covariances say")
      .value("pessimistic", Consistency::pessimistic, "smaller")
      .finalize();
  using R = ConsistencyReport;
  ResultClass<R>(m, "ConsistencyReport",
                 "Means of NEES or NIS in units of their expectation, 1 of a consistent estimator.")
      .def_readonly("mean", &R::mean, "Over all values.")
      .def_readonly("low", &R::low, "End of the mean's interval.")
      .def_readonly("high", &R::high, "Alike.")
      .def_readonly("verdict", &R::verdict, "A Consistency.")
      .def_readonly("count", &R::count, "Values.")
      .def_readonly("effective_dof", &R::effective_dof, "Of the mean's interval.")
      .def_readonly("mean_at", &R::mean_at, "(times,) over the runs.")
      .def_readonly("low_at", &R::low_at, "(times,) interval of mean_at.")
      .def_readonly("high_at", &R::high_at, "(times,) alike.")
      .def_readonly("share_inside", &R::share_inside, "Of the times, inside their intervals.")
      .def("__repr__", [](const R& r) {
        return "<ConsistencyReport: " + std::string(to_string(r.verdict)) + ", mean " +
               value_repr(r.mean) + " in " + value_repr(r.low) + " to " + value_repr(r.high) + ">";
      });
  m.def("normalised_squared_error", &normalised_squared_error, py::arg("error"),
        py::arg("covariance"),
        "error . covariance^-1 error, (n,) and (n, n): NEES, or NIS of an innovation. Raises: "
        "ValueError unless the covariance is positive definite.");
  m.def(
      "nees",
      [](const Squared& squared, const Dofs& dof, double confidence) {
        return nees(squared, dofs_of(dof, squared), confidence);
      },
      py::arg("squared"), py::arg("dof"), py::arg("confidence") = 0.95,
      R"(Whether normalised estimation errors squared are as large as they should be.

squared: (runs, times). dof: a number, or of each value, 0 where there is none. The values of a run may
depend on each other: how much is told by the spread of ten runs or more.
Returns: ConsistencyReport, with intervals of this confidence.
Raises: ValueError for shapes that differ, values that are negative or not finite, no value.)");
  m.def(
      "nis",
      [](const Squared& squared, const Dofs& dof, double confidence) {
        return nis(squared, dofs_of(dof, squared), confidence);
      },
      py::arg("squared"), py::arg("dof"), py::arg("confidence") = 0.95,
      "The same of normalised innovations squared, which are independent in time: one run is "
      "enough.");
  m.def("chi2_quantile", &chi2_quantile, py::arg("probability"), py::arg("dof"),
        "The value that a chi-square variable does not exceed with this probability.");
}

}  // namespace occ::python
