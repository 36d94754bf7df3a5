// SPDX-License-Identifier: Apache-2.0
// Arrays hold a point in each row: the transpose of the columns that C++ takes, at the same place.
#pragma once

#include "casters.hpp"

namespace occ::python {

using Rows2 = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>>;
using Rows3 = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;

}  // namespace occ::python
