// SPDX-License-Identifier: Apache-2.0
// Views of numpy arrays with one point in each row. Their transposes are the matrices with one
// point in each column that C++ uses; no element is copied.
#pragma once

#include "casters.hpp"

namespace occ::python {

using Rows2 = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>>;
using Rows3 = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;

}  // namespace occ::python
