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
                               "Verdict on the covariances of an estimator.")
      .value("consistent", Consistency::consistent, "the mean is inside its interval")
      .value("optimistic", Consistency::optimistic, "errors are larger than the covariances")
      .value("pessimistic", Consistency::pessimistic, "errors are smaller than the covariances")
      .finalize();
  using R = ConsistencyReport;
  ResultClass<R>(m, "ConsistencyReport",
                 "Result of nees() or nis(). Means are in units of their expectation: 1 for a "
                 "consistent estimator.")
      .def_readonly("mean", &R::mean, "Mean of all values.")
      .def_readonly("low", &R::low, "Lower end of the mean's interval.")
      .def_readonly("high", &R::high, "Upper end of the mean's interval.")
      .def_readonly("verdict", &R::verdict, "Consistency.")
      .def_readonly("count", &R::count, "Number of values.")
      .def_readonly("effective_dof", &R::effective_dof,
                    "Degrees of freedom of the mean's interval.")
      .def_readonly("mean_at", &R::mean_at, "(times,) mean over the runs at each time.")
      .def_readonly("low_at", &R::low_at, "(times,) lower end of the interval of mean_at.")
      .def_readonly("high_at", &R::high_at, "(times,) upper end of the interval of mean_at.")
      .def_readonly("share_inside", &R::share_inside,
                    "Share of the times whose mean is inside its interval.")
      .def("__repr__", [](const R& r) {
        return "<ConsistencyReport: " + std::string(to_string(r.verdict)) + ", mean " +
               value_repr(r.mean) + " in " + value_repr(r.low) + " to " + value_repr(r.high) + ">";
      });
  m.def("normalised_squared_error", &normalised_squared_error, py::arg("error"),
        py::arg("covariance"),
        "Returns error . covariance^-1 error: NEES of an estimation error, NIS of an innovation. "
        "error: (n,). covariance: (n, n). Raises: ValueError for sizes that differ, or a "
        "covariance that is not positive definite.");
  m.def(
      "nees",
      [](const Squared& squared, const Dofs& dof, double confidence) {
        return nees(squared, dofs_of(dof, squared), confidence);
      },
      py::arg("squared"), py::arg("dof"), py::arg("confidence") = 0.95,
      R"(Tests whether normalised estimation errors squared (NEES) agree with their expectation.

squared: (runs, times). dof: degrees of freedom, one number or (runs, times); 0 marks a missing value.
confidence: probability of the two-sided intervals. Values of one run may be correlated; their
correlation is estimated from the scatter of the runs' means, which takes ten runs or more.
Returns: ConsistencyReport.
Raises: ValueError for shapes that differ, values that are negative or not finite, or no values.
Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001,
eqs. (5.4.2-5) to (5.4.2-17).)");
  m.def(
      "nis",
      [](const Squared& squared, const Dofs& dof, double confidence) {
        return nis(squared, dofs_of(dof, squared), confidence);
      },
      py::arg("squared"), py::arg("dof"), py::arg("confidence") = 0.95,
      "Tests normalised innovations squared (NIS) like nees(). They are independent in time, so "
      "one run is enough.");
  m.def("chi2_quantile", &chi2_quantile, py::arg("probability"), py::arg("dof"),
        "Returns the value that a chi-square variable does not exceed with this probability.");
}

}  // namespace occ::python
