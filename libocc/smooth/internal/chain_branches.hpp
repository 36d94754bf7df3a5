// SPDX-License-Identifier: Apache-2.0
// Several start values for a chain of linked poses: a bank of filters (multiple hypotheses).
//
// A frame of three lamps has up to four poses (P3P), a frame of lamps in a plane has two. Each pose
// of the first such frame starts a hypothesis: a pose, its covariance, and the chi2 of all frames
// so far. Odometry predicts it to the next frame, whose observations update it (the minimum of
// prediction and observations by the Levenberg-Marquardt method). While the prediction is wide
// against the distance of the lamps, the poses of the frame itself are start values of that
// minimum, too, and a hypothesis may split. Hypotheses at one place are merged; one that is
// implausible against the best is deleted. If no hypothesis agrees with a frame, the poses of the
// frame start new ones behind a gross error of odometry.
//
// Source: Reid, "An algorithm for tracking multiple targets", IEEE Trans. Automatic Control 24(6),
// 1979 (hypotheses, their merging and deletion); here of one body.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"

namespace occ::internal::smooth {

/// Risk of a wrong minimum above which a result is ambiguous, that of Fix.risk.
constexpr double max_risk = 1e-4;
/// -2 ln(max_risk): difference of chi2 at which a second minimum has this likelihood ratio.
constexpr double open_chi2 = 18.42;

/// chi2 of a gross error of odometry, before its size is known: -2 ln of its probability.
double gross_error_chi2(const SmootherOptions& options);

/// chi2 of a link that its inflated covariance leaves out; 0 for one that is not contradicted.
template <class Body>
double gross_error_chi2(const Link<Body>& link, const SmootherOptions& options);

/// chi2 of the node's sightings that are aside: for each that of a residual of the image's
/// diagonal.
template <class Body>
double outside_chi2(const Chain<Body>& chain, const Node<Body>& node);

/// Poses of a chain with the estimate of their chi2.
template <class Body>
struct BranchStart {
  std::vector<typename Body::Pose> poses;
  double chi2 = 0;
};

enum class TimeDirection { forward, backward };

/// Start values of all poses of a chain whose poses are all linked, lowest chi2 first; one that the
/// others do not leave plausible is left out. Empty if no node alone determines its pose.
template <class Body>
std::vector<BranchStart<Body>> branch_starts(const Chain<Body>& chain,
                                             const SmootherOptions& options,
                                             TimeDirection direction);

/// True if a prediction of this covariance can lead to one minimum only: its position is known to a
/// small part of the distance to the nearest point.
template <class Body>
bool is_narrow(const Body& body, const Node<Body>& node, const typename Body::Pose& predicted,
               const typename Body::Block& covariance);

/// Covariance of the pose at the other end of a link from that at one end.
template <class Body>
typename Body::Block carried_covariance(const Link<Body>& link, const typename Body::Pose& from,
                                        const typename Body::Pose& to,
                                        const typename Body::Block& covariance,
                                        TimeDirection direction);

}  // namespace occ::internal::smooth
