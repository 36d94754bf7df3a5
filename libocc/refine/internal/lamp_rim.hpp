// SPDX-License-Identifier: Apache-2.0
// One lamp's rim in the normal equations. Its residuals are r = (d - growth - n . s) / sigma, d the
// distance along the measured normal n, s the shift by the gradient of the lamp's light. An error o
// ~ N(0, S) that is common to the lamp (a growth of its own rim and an offset in the image) would
// add v . o / sigma with v = (1, n) to each; it is eliminated in closed form (Woodbury):
//     r^T (I + V S V^T)^-1 r = r^T r - u^T (S^-1 + N)^-1 u,   V = v / sigma, u = V^T r, N = V^T V.
//
// Huber's weights are for stray points: each is weighed by what is left of it after the size and
// place that fit the lamp best, in units of its sigma or of the lamp's own scatter if that is
// larger.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/normal.hpp"
#include "libocc/refine/internal/observations.hpp"

namespace occ::internal::refine {

class LampRim {
 public:
  /// Empty unless the lamp has a rim. Keeps references.
  LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim, const Scene& scene);

  /// Residuals and their derivatives at a state. Returns how many points are lost: their rays miss
  /// the lamp.
  int linearise(const State& state, const Eigen::Vector3d& pivot);

  /// Adds what was linearised, weighted; the weights are held for chi2() until the next time.
  void add_to(Normal& normal, double huber_sigma);

  /// r^T r at a state under the weights held; lost points cost a constant.
  double chi2(const State& state) const;

 private:
  void weigh_points(double huber_sigma);
  double robust_excess() const;

  const LampObservation& lamp_;
  const RimObservation* points_;
  const Scene& scene_;

  // One column or entry for each point: d residual / d (turn of the lamp, shift of its centre,
  // growth), the residual, and v / sigma.
  using Rows = Eigen::Matrix<double, 11, Eigen::Dynamic>;
  Rows rows_, weighted_;
  Eigen::VectorXd weights_;  // 0 for a lost one

  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();  // from the pivot to the lamp's centre
  int lost_ = 0;
  double threshold_ = 0;                                   // of Huber's function
  Eigen::Matrix3d common_gain_ = Eigen::Matrix3d::Zero();  // (S^-1 + N)^-1
};

}  // namespace occ::internal::refine
