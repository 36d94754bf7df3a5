// SPDX-License-Identifier: Apache-2.0
// Similarities that map a constellation of lamps onto a known map, of which a part has changed.
//
// Two lamps with their normals, and two lamps of the map with about the same sizes, give a
// hypothesis: a similarity. It is refined with all lamps in a gate that shrinks to the errors of
// both maps (iteratively reweighted least squares with the weights of Geman and McClure,
// "Statistical methods for tomographic image reconstruction", 1987; closed form of each step:
// Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
// 1991). The expected number of accidental similarities with k or more of n lamps in the gates is
// at most
//
//     NFA = N / C(k, 2) sum over j >= k - 2 of C(n - 2, j) p^j (1 - p)^(n - 2 - j),
//
// with N the number of hypotheses, of which C(k, 2) lead to one similarity, and p the part of the
// map's volume that its gates cover. The height of the volume is that of a gate if all lamps are on
// one ceiling.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/network/datum.hpp"

namespace occ::internal::survey {

/// A lamp of one of the two maps.
struct LinkLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();  ///< towards the lit side
  double size = 0;                                     ///< as in LampShapeView; 0: unknown
};

/// A similarity with its inliers.
struct LinkWay {
  Similarity map_from_lamps;
  std::vector<int> lamp_of;       ///< lamp of the map for each lamp; -1: none in the gate
  int matches = 0;                ///< number of lamps in a gate
  double log10_false_alarms = 0;  ///< base-10 logarithm of NFA
};

/// Similarities with at least three matches, those with most matches first. Two ways differ in the
/// lamp of the map of at least half of the matches of the worse one.
LIBOCC_API std::vector<LinkWay> link_ways(const std::vector<LinkLamp>& lamps,
                                          const std::vector<LinkLamp>& map);

}  // namespace occ::internal::survey
