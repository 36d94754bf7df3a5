// SPDX-License-Identifier: Apache-2.0
// Consistency tests: do the covariances of an estimator match its errors? The normalised squared
// error
//
//   NEES = error . P^-1 error   (estimation error),   NIS = innovation . S^-1 innovation
//
// of a consistent estimator is chi-square distributed; its degrees of freedom are the number of
// components of the error. Over N independent runs, N mean(NEES) at one time has N dof degrees of
// freedom, which gives an interval for each time. NIS of a consistent estimator are independent in
// time, so one run is enough. NEES are correlated in time: their overall mean has nu = 2 R / s^2
// degrees of freedom, where s^2 is the variance of the means of the R runs (in units of their
// expectation). nu is limited to the range from one time to independent times.
//
// Source: Bar-Shalom, Li, Kirubarajan, "Estimation with applications to tracking and navigation",
// Wiley 2001, section 5.4, eqs (5.4.2-5) to (5.4.2-17); nu by matching two moments (Satterthwaite,
// Biometrics 2, 1946).
#pragma once

#include <Eigen/Core>
#include <string>

#include "libocc/core/abi.hpp"

namespace occ {

/// Verdict on an estimator's covariances.
enum class Consistency {
  consistent,   ///< the overall mean is inside its interval
  optimistic,   ///< the errors are larger than the covariances
  pessimistic,  ///< the errors are smaller than the covariances
};

/// The enumerator's name, e.g. "optimistic".
LIBOCC_API const char* to_string(Consistency verdict);

/// Means are in units of their expectation: 1 for a consistent estimator.
struct ConsistencyReport {
  double mean = 0;                                ///< over all values
  double low = 0, high = 0;                       ///< interval of `mean`
  Consistency verdict = Consistency::consistent;  ///< compares `mean` with its interval
  int count = 0;                                  ///< number of values
  double effective_dof = 0;                       ///< degrees of freedom of the interval
  Eigen::VectorXd mean_at, low_at, high_at;  ///< over the runs at each time; 0, 0, 0 without values
  double share_inside = 1;  ///< share of the times inside; `confidence` if consistent
};

/// error . covariance^-1 error. Throws std::invalid_argument when sizes differ, a number is not
/// finite, or the covariance is not positive definite.
LIBOCC_API double normalised_squared_error(const Eigen::VectorXd& error,
                                           const Eigen::MatrixXd& covariance);

/// `squared`: runs x times; `dof`: the same shape, 0 marks a missing value; `confidence`:
/// probability of the two-sided intervals. With fewer than ten runs nu cannot be estimated; the
/// value of one time is used, which makes the interval too wide. Throws std::invalid_argument for
/// shapes that differ, for negative or non-finite values, and without any value.
LIBOCC_API ConsistencyReport nees(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                                  double confidence = 0.95);

/// Report for values that are independent in time (innovations).
LIBOCC_API ConsistencyReport nis(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                                 double confidence = 0.95);

}  // namespace occ
