// SPDX-License-Identifier: Apache-2.0
// Rows of the design matrix of an observed outline (OutlineObservation).
#pragma once

#include <Eigen/Core>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

/// Linearised outline: r + A dx_image + B dx_target, with the unknowns of its image and of its
/// point (position, rotations, logarithms of sizes).
struct OutlineRows {
  Eigen::MatrixXd a, b;
  Eigen::VectorXd r;
  Eigen::MatrixXd centre_a, centre_b;  ///< contribution to the rows of the centre [px]
  Eigen::Vector2d centre_r;

  /// Adds the displacement of the centre to the rows of its observation.
  void displace_centre(const Eigen::Vector2d& sigma_px, ObservationRows& rows) const;
};

OutlineRows outline_rows_of(const Network& network, const NetworkLayout& layout,
                            const NetworkState& state, const OutlineObservation& outline);

}  // namespace occ::internal::network
