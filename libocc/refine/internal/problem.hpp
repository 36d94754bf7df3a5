// SPDX-License-Identifier: Apache-2.0
// The refinement's least-squares problem: rims or centroids, fluxes, prior. Residuals are measured
// minus predicted, over their sigma. Huber's weights, for rim points and fluxes, are set where the
// equations are linearised and held until the next time, so that a solver's trial steps compare
// like with like.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/lamp_pixels.hpp"
#include "libocc/refine/internal/lamp_rim.hpp"
#include "libocc/refine/internal/normal.hpp"
#include "libocc/refine/internal/observations.hpp"

namespace occ::internal::refine {

class LIBOCC_API RefineProblem {
 public:
  /// Keeps references to the first three. Lamps are taken by this rung or, where
  /// they do not offer it, the next cheaper one.
  RefineProblem(const Observations& observations, const Scene& scene, const RefineOptions& options,
                Rung rung);

  /// Normal equations at a state; sets the weights. False where a lamp cannot be seen at all.
  bool linearise(const State& state, const Eigen::Vector3d& pivot, Normal& normal);

  /// r^T r under the weights of the last linearisation; infinity where a lamp cannot be seen. Not
  /// for Rung::direct.
  double chi2(const State& state) const;

  /// A centroid minus the predicted centre of the lamp's image, and its derivatives; nothing where
  /// the lamp cannot be seen.
  struct Place {
    Eigen::Vector2d residual_px;
    Eigen::Matrix<double, 2, 8> jacobian;
  };
  std::optional<Place> place(const LampObservation& lamp, const State& state,
                             const Eigen::Vector3d& pivot) const;

  /// A lamp that is taken by its pixels, or null.
  const LampPixels* pixels(std::size_t lamp) const { return pixels_[lamp].get(); }

  /// Mean of the lamps' centres in the camera's frame.
  Eigen::Vector3d pivot(const State& state) const;

  /// How far [px] a step moves the image of the lamp that it moves most.
  double largest_motion_px(const State& state, const Eigen::Vector3d& pivot,
                           const Vector8& step) const;

 private:
  struct Held {
    bool by_rim = false;
    double flux_weight = 1;
  };

  bool add_lamp(std::size_t index, const State& state, const Eigen::Vector3d& pivot,
                Normal& normal);
  bool add_place(const LampObservation& lamp, const State& state, const Eigen::Vector3d& pivot,
                 Normal& normal) const;
  bool add_flux(const LampObservation& lamp, const State& state, const Eigen::Vector3d& pivot,
                double& weight, Normal& normal) const;
  void add_priors(const State& state, const Eigen::Vector3d& pivot, Normal& normal) const;
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
  std::vector<Held> held_;                           // since the last linearisation
};

}  // namespace occ::internal::refine
