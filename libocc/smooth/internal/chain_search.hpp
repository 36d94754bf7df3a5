// SPDX-License-Identifier: Apache-2.0
// Searches the minima of a chain from several starts, and compares them.
//
// Two minima are compared by chi2 with all that a minimum leaves out: a link with a covariance
// inflated by f costs the logarithm of its density, n ln f for n components, and that of the
// probability of a gross error; a sighting outside the camera's domain costs a residual of the
// image's diagonal. exp(-difference / 2) is then the ratio of the likelihoods.
//
// Before a link is called contradicted, the chain is searched again without the poses that oppose
// it: from the last pose to the first, and with each side of the link continued along odometry.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_solver.hpp"

namespace occ::internal::smooth {

/// A minimum, with the chain whose links and sightings it has marked.
template <class Body>
struct ChainMinimum {
  Chain<Body> chain;
  ChainSolution<Body> solution;
  double chi2 = 0;  ///< includes gross errors and sightings outside
};

/// chi2 of a solution, gross errors and sightings outside the domain included.
template <class Body>
double compared_chi2(const Chain<Body>& chain, const ChainSolution<Body>& solution,
                     const SmootherOptions& options);

/// True if all poses agree within the sigmas of `a`.
template <class Body>
bool same_minimum(const ChainSolution<Body>& a, const ChainSolution<Body>& b);

/// A minimum that the data do not separate from the best.
template <class Body>
struct OtherMinimum {
  ChainSolution<Body> solution;  ///< poses of the whole chain
  double ratio = 0;              ///< likelihood ratio to the best minimum
};

template <class Body>
struct ChainMinima {
  ChainMinimum<Body> best;
  double risk = 0;                         ///< probability of all others
  std::vector<OtherMinimum<Body>> others;  ///< best first; empty if the risk is below max_risk
};

/// Searches each linked part of the chain on its own; another minimum differs from the best in one
/// part. `start` may be empty.
template <class Body>
ChainMinima<Body> minima_of(Chain<Body> chain, const std::vector<typename Body::Pose>& start,
                            const SmootherOptions& options);

/// Sets the risk from all others, and deletes the others that it does not need.
template <class Body>
void settle_risk(ChainMinima<Body>& minima);

/// Minima of the linked part that contains node k, best first, from `start` and others. Each is the
/// whole chain with the marks of this part and the poses of all nodes; the other parts are as
/// given.
template <class Body>
std::vector<ChainMinimum<Body>> minima_at(const Chain<Body>& chain, std::size_t k,
                                          const std::vector<typename Body::Pose>& start,
                                          const SmootherOptions& options);

}  // namespace occ::internal::smooth
