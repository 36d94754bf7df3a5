// SPDX-License-Identifier: Apache-2.0
// Which of a point's images agree about it, cameras and stations as they are: consensus over pairs
// of rays (Fischler, Bolles 1981). Robust weights alone do not do: of a handful of rays each one
// holds some direction of the point, and a gross error is followed as far as it leads.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

/// Indices of the used observations of each unknown point.
std::vector<std::vector<int>> sightings_of_points(const Network& network,
                                                  const NetworkLayout& layout);

/// Where the rays of some observations meet; nothing when they are parallel.
std::optional<Eigen::Vector3d> meeting_of(const Network& network, const NetworkState& state,
                                          const std::vector<int>& observations);

struct PointAgreement {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::vector<int> disagree;  ///< observations beyond the limit there
  /// More than half of the images agree, three at least; or no other choice has as many.
  bool sound = false;
};

/// `limit`: length of a residual, in sigmas. Not moved when most agree where the point is.
PointAgreement agreement_about(const Network& network, const NetworkState& state, int point,
                               const std::vector<int>& observations, double limit);

}  // namespace occ::internal::network
