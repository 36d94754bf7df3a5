// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/functional.h>
#include <pybind11/pybind11.h>

#include <functional>
#include <optional>

#include "libocc/guide/closed_loop.hpp"

namespace occ::python {

/// Python function that returns an estimator for a scene: an object with the methods start,
/// add_odometry, add_image and at, see LoopEstimator.
using EstimatorFactory = std::function<pybind11::object(const Scene&)>;

void define_estimated_pose(pybind11::module_& m);
MakeEstimator estimators_of(const std::optional<EstimatorFactory>& factory);

}  // namespace occ::python
