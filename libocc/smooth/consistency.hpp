// SPDX-License-Identifier: Apache-2.0
// Whether an estimator's covariances are those of its errors. The normalised squared error
//
//   NEES = error . P^-1 error   (estimation error),   NIS = innovation . S^-1 innovation
//
// of a consistent one is chi-square distributed with as many degrees of freedom as the error has
// components. Over N independent runs N mean(NEES) at each time has N dof of them, which gives an
// interval at every time. NIS are independent in time too, when all is well, so one run is enough.
// NEES of successive times are not: their overall mean has nu = 2 R / s^2 degrees of freedom, s^2
// the variance of the R runs' own means (each in units of its expectation), at least those of one
// time and at most those of independent times.
//
// Source: Bar-Shalom, Li, Kirubarajan, "Estimation with applications to tracking and navigation",
// Wiley 2001, section 5.4, eqs (5.4.2-5) to (5.4.2-17); nu by matching two moments (Satterthwaite,
// Biometrics 2, 1946).
#pragma once

#include <Eigen/Core>
#include <string>

#include "libocc/core/abi.hpp"

namespace occ {

enum class Consistency {
  consistent,   ///< the overall mean is inside its interval
  optimistic,   ///< errors are larger than the covariances say
  pessimistic,  ///< smaller
};

LIBOCC_API const char* to_string(Consistency verdict);

/// Means are in units of their expectation: 1 of a consistent estimator.
struct ConsistencyReport {
  double mean = 0;
  double low = 0, high = 0;  ///< interval of `mean`
  Consistency verdict = Consistency::consistent;
  int count = 0;                             ///< values
  double effective_dof = 0;                  ///< of the interval
  Eigen::VectorXd mean_at, low_at, high_at;  ///< over the runs at each time; 0, 0, 0 without values
  double share_inside = 1;  ///< of the times; `confidence` is expected of a consistent one
};

/// error . covariance^-1 error. Throws std::invalid_argument when sizes differ, a number is not
/// finite, or the covariance is not positive definite.
LIBOCC_API double normalised_squared_error(const Eigen::VectorXd& error,
                                           const Eigen::MatrixXd& covariance);

/// squared: runs x times; dof: the same shape, 0 where there is no value. `confidence` of the
/// two-sided intervals. Fewer than ten runs do not tell nu: then it is that of one time, which is
/// an interval too wide. Throws std::invalid_argument for shapes that differ, negative or not
/// finite values, or no value at all.
LIBOCC_API ConsistencyReport nees(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                                  double confidence = 0.95);

/// The same for values that are independent in time: innovations.
LIBOCC_API ConsistencyReport nis(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                                 double confidence = 0.95);

}  // namespace occ
