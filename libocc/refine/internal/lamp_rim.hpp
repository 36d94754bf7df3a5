// SPDX-License-Identifier: Apache-2.0
// One lamp's rim in the normal equations. Residuals: r = (d - growth - n . s) / sigma, with d the
// distance along the measured normal n, and s the shift by the gradient of the lamp's light. An
// error o ~ N(0, S) common to the lamp (growth of its rim and an offset in the image) adds v . o /
// sigma to each residual, v = (1, n). It is eliminated in closed form (Woodbury):
//     r^T (I + V S V^T)^-1 r = r^T r - u^T (S^-1 + N)^-1 u,   V = v / sigma, u = V^T r, N = V^T V.
//
// Huber's weights reduce stray points. They depend on the residuals after the best fit of the
// lamp's size and position, in units of sigma or of the lamp's scatter if that is larger.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"

namespace occ::internal::refine {

class LampRim {
 public:
  /// Empty unless the lamp has a rim. Keeps references.
  LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim, const Scene& scene);

  /// Computes residuals and derivatives at a state. Returns the number of lost points, whose rays
  /// miss the lamp.
  int linearise(const State& state, const Eigen::Vector3d& pivot);

  /// Adds the weighted residuals; chi2() uses these weights until the next call.
  void add_to(PoseNormalEquations& normal, double huber_sigma);

  /// r^T r at a state with the current weights; each lost point adds a constant.
  double chi2(const State& state) const;

 private:
  void weigh_points(double huber_sigma);
  double robust_excess() const;

  const LampObservation& lamp_;
  const RimObservation* points_;
  const Scene& scene_;

  // One column for each point: d residual / d (rotation of the lamp, shift of its centre, growth),
  // the residual, and v / sigma.
  using Rows = Eigen::Matrix<double, 11, Eigen::Dynamic>;
  Rows rows_, weighted_;
  Eigen::VectorXd weights_;  // 0 for a lost one

  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();  // from the pivot to the lamp's centre
  int lost_ = 0;
  double threshold_ = 0;                                   // corner of Huber's loss
  Eigen::Matrix3d common_gain_ = Eigen::Matrix3d::Zero();  // (S^-1 + N)^-1
};

}  // namespace occ::internal::refine
