// SPDX-License-Identifier: Apache-2.0
// The datum in terms of a network's unknowns: how an open similarity moves each of them (G), and
// the conditions that hold it (B).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/network/datum.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

/// datum_defect of a network whose unknowns have these values.
DatumDefect defect_at(const Network& network, const NetworkState& state);

/// G: all unknowns x the defect.
Eigen::MatrixXd open_directions(const Network& network, const NetworkLayout& layout,
                                const NetworkState& state, const DatumDefect& defect);

/// How a direction moves a place of the world: 3 x the defect.
Eigen::Matrix3Xd moves_of(const DatumDefect& defect, const Eigen::Vector3d& position_m);

/// Conditions on the places of some targets: sum over them of rows_k * (how far target k moved) =
/// 0, and after these rows perhaps one more: that the distance of two targets is kept.
struct DatumConditions {
  std::vector<Target> targets;
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 3>> rows;
  std::vector<Target> distance;  ///< none or two
};

/// Nothing when the targets do not hold the defect.
std::optional<DatumConditions> conditions_of(const Network& network, const NetworkLayout& layout,
                                             const Datum& datum, const DatumDefect& defect);

/// B: all unknowns x the defect.
Eigen::MatrixXd over_unknowns(const DatumConditions& conditions, const Network& network,
                              const NetworkLayout& layout, const NetworkState& state);

}  // namespace occ::internal::network
