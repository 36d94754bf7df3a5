// SPDX-License-Identifier: Apache-2.0
// The datum in terms of a network's unknowns: the null space G of the design matrix, spanned by the
// similarities that no observation determines, and the datum conditions B^T dx = 0 (datum.hpp).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/network/datum.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

/// datum_defect() of a network whose unknowns have the values of `state`.
DatumDefect defect_at(const Network& network, const NetworkState& state);

/// Basis G of the null space: all unknowns x defect.
Eigen::MatrixXd datum_null_space(const Network& network, const NetworkLayout& layout,
                                 const NetworkState& state, const DatumDefect& defect);

/// Derivative of a point's position with respect to the defect's directions: 3 x defect [m].
Eigen::Matrix3Xd similarity_jacobian(const DatumDefect& defect, const Eigen::Vector3d& position_m);

/// Conditions on the displacements d_k of some targets, and on the rotations w_k of their outlines:
/// sum over k of rows_k d_k + outline_rows_k w_k = 0. If `distance` is not empty, one more
/// condition follows these rows: the distance of the two targets is kept.
struct DatumConditions {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  std::vector<Target> targets;
  std::vector<Rows> rows;
  std::vector<Rows> outline_rows;  ///< empty for targets without an unknown outline
  std::vector<Target> distance;    ///< none or two
};

/// Adds the derivative of the sum of outline_rows_k w_k by the defect's directions.
void add_outlines(const DatumConditions& conditions, const Network& network,
                  const DatumDefect& defect, Eigen::MatrixXd& sum);

/// Nothing when the targets do not determine the datum.
std::optional<DatumConditions> datum_conditions(const Network& network, const NetworkLayout& layout,
                                                const Datum& datum, const DatumDefect& defect);

/// B: all unknowns x defect.
Eigen::MatrixXd condition_matrix(const DatumConditions& conditions, const Network& network,
                                 const NetworkLayout& layout, const NetworkState& state);

/// Centres o of the similarity X' = s X + (1 - s) o that each station's frame undergoes when the
/// network is scaled and its images remain unchanged.
///
/// The centre is the station's origin, except where a displacement of the station compensates a
/// known length: the height e_z of a panorama camera's centre above its turntable, or the lever arm
/// of a camera on a known mount. One such length per station does not determine the scale. Two
/// lengths that require different centres do.
struct ScaleCentres {
  std::vector<Eigen::Vector3d> station;  ///< o, in the station's frame
  std::vector<Eigen::Vector3d> mount;    ///< displacement of a free mount that belongs to it
  std::vector<char> height_compensated;  ///< for each camera: e_z is known, yet it holds no scale
  double conflict_m = 0;  ///< largest distance between two required centres; 0: the scale is free
};

ScaleCentres scale_centres(const Network& network, const NetworkState& state);

/// Camera parameter e_z.
constexpr const char* height_name = "ez_m";

}  // namespace occ::internal::network
