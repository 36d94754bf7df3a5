// SPDX-License-Identifier: Apache-2.0
// Least-squares problem of the refinement: rims, centroids or pixels, fluxes, prior. Residuals are
// (measured - predicted) / sigma. Huber's weights of rim points and fluxes are computed at each
// linearisation and constant until the next one, so that the costs of trial steps are comparable.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/lamp_parts.hpp"
#include "libocc/refine/internal/lamp_pixels.hpp"
#include "libocc/refine/internal/lamp_rim.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"

namespace occ::internal::refine {

class LIBOCC_API RefineProblem {
 public:
  /// Keeps references to the first three arguments. A lamp without the measurements of this rung
  /// uses the next lower one.
  RefineProblem(const Observations& observations, const Scene& scene, const RefineOptions& options,
                Rung rung);

  /// Normal equations at a state; sets the weights. False if a lamp is not visible.
  bool linearise(const State& state, const Eigen::Vector3d& pivot, PoseNormalEquations& normal);

  /// Contributions of the lamps and the priors to the last linearisation.
  const NormalParts& parts() const { return parts_; }

  /// Parts of the lamps in the information of pose and shared errors, with the errors of each lamp
  /// eliminated.
  struct LampSums {
    Matrix8 information = Matrix8::Zero();
    SharedSums shared;  ///< `information` with the prior
  };
  std::vector<LampSums> lamp_sums(const State& state, const Eigen::Vector3d& pivot);

  /// r^T r with the weights of the last linearisation; infinite if a lamp is not visible. Not for
  /// Rung::direct.
  double chi2(const State& state);

  /// Centroid minus the predicted centre of the lamp's image, with derivatives; empty if the lamp
  /// is not visible.
  struct CentroidResidual {
    Eigen::Vector2d residual_px;
    Eigen::Matrix<double, 2, 8> jacobian;
    Eigen::Matrix2d information;      ///< with the errors of the lamp
    Eigen::Matrix2Xd by_shared = {};  ///< derivative by the shared errors
    /// Covariance with all errors.
    Eigen::Matrix2d covariance_px2() const;
  };
  std::optional<CentroidResidual> centroid_residual(const LampObservation& lamp, const State& state,
                                                    const Eigen::Vector3d& pivot) const;

  /// Sets LampObservation::own_chi2 and own_coordinates of the lamps, at the last linearisation.
  void report_own_chi2(const State& state, std::vector<LampObservation>& lamps) const;

  /// Estimates of the errors of the lamps, in units of their standard deviations, and of the shared
  /// ones by the last linearisation, the latter after a step of the unknowns.
  const LampError& lamp_error(std::size_t lamp) const { return rims_[lamp].unit_error(); }
  Eigen::VectorXd shared_estimate(const Vector8& step) const;

  /// Pixels of a lamp on the direct rung, or null.
  /// Frees the emission of all lamps if the pixels contradict the scene's emission significantly.
  /// `normal`: the last linearisation, at the minimum. Returns true if it changed anything.
  bool free_emission(const PoseNormalEquations& normal);

  const LampPixels* pixels(std::size_t lamp) const { return pixels_[lamp].get(); }

  /// Mean of the lamps' centres in the camera's frame.
  Eigen::Vector3d pivot(const State& state) const;

  /// Largest motion of a lamp's image by a step.
  double max_motion_px(const State& state, const Eigen::Vector3d& pivot, const Vector8& step) const;

 private:
  struct Held {
    bool by_rim = false;
    double flux_weight = 1;
    Eigen::Matrix2d centroid_information = Eigen::Matrix2d::Zero();
    Eigen::Matrix2Xd by_shared;
  };

  bool add_lamp(std::size_t index, const State& state, const Eigen::Vector3d& pivot,
                PoseNormalEquations& normal, SharedSums* shared);
  bool add_centroid(const LampObservation& lamp, const State& state, const Eigen::Vector3d& pivot,
                    PoseNormalEquations& normal, SharedSums* shared, Held& held) const;
  void eliminate_shared(const SharedSums& shared, PoseNormalEquations& normal);
  bool add_flux(const LampObservation& lamp, const State& state, const Eigen::Vector3d& pivot,
                double& weight, PoseNormalEquations& normal) const;
  void add_priors(const State& state, const Eigen::Vector3d& pivot,
                  PoseNormalEquations& normal) const;
  bool estimates_log_factor() const;

  const Observations& observations_;
  const Scene& scene_;
  const RefineOptions& options_;
  Rung rung_;
  std::vector<LampRim> rims_;  // one for each lamp, possibly empty
  std::optional<PixelNoise> noise_;
  std::optional<PixelPsf> psf_;
  PixelScratch scratch_;
  std::vector<std::unique_ptr<LampPixels>> pixels_;  // one for each lamp, possibly null
  std::vector<Held> held_;                           // from the last linearisation
  NormalParts parts_;                                // also from it
  Eigen::MatrixXd shared_gain_;                      // inverse information of the shared errors
  Eigen::VectorXd shared_estimate_;
  Eigen::Matrix<double, 8, Eigen::Dynamic> shared_mixed_;
};

}  // namespace occ::internal::refine
