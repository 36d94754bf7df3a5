// SPDX-License-Identifier: Apache-2.0
// Rows of the design matrix of an observed outline (OutlineObservation).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

/// Linearised outline: r + A dx_image + B dx_target, with the unknowns of its image and of its
/// point (position, rotations, logarithms of sizes).
struct OutlineRows {
  Eigen::MatrixXd a, b;
  Eigen::VectorXd r;
};

/// Outline of an image observation; nothing if it has none. `centre`: rows of the observation, to
/// which the displacement of the outline's centre is added.
std::optional<OutlineRows> outline_rows(const Network& network, const NetworkLayout& layout,
                                        const NetworkState& state, int observation,
                                        ObservationRows& centre);

}  // namespace occ::internal::network
