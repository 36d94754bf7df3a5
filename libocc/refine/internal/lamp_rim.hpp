// SPDX-License-Identifier: Apache-2.0
// One lamp's rim in the normal equations. Residuals: r = (d - growth - m) / sigma, with d the
// distance along the measured normal n, and m the displacement by the lamp's light (rim_light.hpp).
// An error o ~ N(0, S) common to the lamp (Blob::rim_covariance_px2: growth of its rim, shift and
// stretch) adds v . o / sigma to each residual, v = (1, n_x, n_y, n_x^2 - n_y^2, 2 n_x n_y). It is
// eliminated in closed form (Woodbury):
//     r^T (I + V S V^T)^-1 r = r^T r - u^T (S^-1 + N)^-1 u,   V = v / sigma, u = V^T r, N = V^T V.
//
// Errors e of the lamp in the scene (scene_errors.hpp) are eliminated in the same way, with the
// derivatives d r / d e in V. They can move the rim by many pixels, so the rim is linearised at
// their estimate e0 of the step before: r = r(e0) - (d r / d e) e0. Errors that all lamps share are
// left to the caller, with the coupling to them.
//
// Huber's weights reduce stray points. They depend on the residuals after the best fit of the
// lamp's size and position, in units of sigma or of the lamp's scatter if that is larger.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"

namespace occ::internal::refine {

class LampRim {
 public:
  /// Empty unless the lamp has a rim. Keeps references.
  LampRim(const LampObservation& lamp, const Observations& all, const Scene& scene,
          double huber_sigma);

  /// Computes residuals and derivatives at a state. Returns the number of lost points, whose rays
  /// miss the lamp.
  int linearise(const State& state, const Eigen::Vector3d& pivot);

  /// Adds the weighted residuals; chi2() uses these weights until the next call. `shared`: null if
  /// there are none.
  void add_to(PoseNormalEquations& normal, SharedSums* shared);

  /// r^T r at a state with the current weights; each lost point adds a constant. Adds the gradient
  /// by the shared errors to `by_shared`; null if there are none.
  double chi2(const State& state, Eigen::VectorXd* by_shared);

  /// Reduction of chi-square if the lamp alone is moved, at the last linearisation.
  double own_chi2() const;

  /// Estimate of the errors of the lamp in the scene, in units of their standard deviations.
  const LampError& unit_error() const { return next_unit_error_; }

 private:
  static constexpr int commons = 5, rows = 8 + commons;
  using Products = Eigen::Matrix<double, rows, rows>;

  bool has_errors() const { return lamp_.errors || all_.shared_errors.count() > 0; }
  LampInCam lamp_at(const Rigid3& cam_from_world) const;
  void linearise_on_rim(Eigen::Index index, double distance_px, const LampInCam& lamp,
                        Eigen::Matrix<double, 1, 6>& d_lamp);
  void weigh_points();
  double chi2_with_errors(const State& state, Eigen::VectorXd* by_shared);
  void follow_errors(const State& state, const Eigen::Vector3d& pivot,
                     const Eigen::VectorXd* weights);
  bool is_stable(const State& state, const Eigen::Vector3d& pivot, const Eigen::VectorXd* weights);
  void predict_errors(const State& state);
  void displace(const State& state, const Eigen::Vector3d& pivot);
  int linearise_rim(const State& state, const Eigen::Vector3d& pivot);
  void step_back();
  Products weighted_products();
  Eigen::MatrixXd eliminate(const Products& products);
  LampError limits() const;
  bool is_within_limits() const;
  LampError within_limits(LampError unit, Eigen::MatrixXd information, Eigen::VectorXd pull) const;
  void set_estimate(const LampError& unit);
  void add_with_errors(Eigen::MatrixXd sums, PoseNormalEquations& normal, SharedSums* shared);
  double robust_excess() const;

  const LampObservation& lamp_;
  const RimObservation* points_;
  const Observations& all_;
  const Scene& scene_;
  double huber_sigma_;

  // One column for each point: d residual / d (rotation of the lamp, shift of its centre, growth),
  // the residual, and v / sigma.
  using Rows = Eigen::Matrix<double, rows, Eigen::Dynamic>;
  Rows rows_, weighted_;
  Eigen::VectorXd weights_;  // 0 for a lost one

  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();  // from the pivot to the lamp's centre
  int lost_ = 0;
  double threshold_ = 0;                                         // corner of Huber's loss
  RimErrorCovariance common_gain_ = RimErrorCovariance::Zero();  // (S^-1 + N)^-1

  Eigen::Matrix3d shift_information_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d shift_gradient_ = Eigen::Vector3d::Zero();

  // With errors of the scene. The common errors are then v and those of the lamp.
  LampError unit_error_ = LampError::Zero(), next_unit_error_ = LampError::Zero();
  LampError error_ = LampError::Zero();  // of unit_error_
  // Linearised estimate of the errors, about the state where the rim was last linearised.
  struct {
    State state;
    Eigen::Matrix<double, 7, Eigen::Dynamic> by_state;  // columns as in the sums of eliminate()
  } estimate_;
  Eigen::Matrix<double, 6, 7> unit_motion_;  // see unit_motion()
  std::optional<Eigen::MatrixXd> sums_;      // of the last pass, if the rows are still those
  Eigen::RowVectorXd seen_, back_;           // residuals r(e0), and (d r / d e) e0
  Eigen::MatrixXd by_shared_;  // a column for each point: d residual / d shared errors
  Eigen::Matrix<double, commons, 6> common_root_ =
      Eigen::Matrix<double, commons, 6>::Zero();  // of S
};

}  // namespace occ::internal::refine
