// SPDX-License-Identifier: Apache-2.0
// One lamp's pixels in the normal equations. The mean signal of a pixel is
//     mu = exp(a) (S + s dS/ds) + b
// with S the lamp's rendered image, and unknowns of the lamp's own: a, ln of its light over the
// scene's (prior: the flux model's); b, the background; s, ln of its PSF's width over the scene's
// (prior: sigma 0.1); and, when camera and map have an error, the lamp's shift in the image. They
// are eliminated in closed form (Schur complement) wherever the equations are linearised.
//
// Where the rim's pixels miss the model by more than chance, as under a PSF that is no Gaussian,
// they get the variance that explains it, in proportion to the square of the light's step: an edge
// is wrong on its bright side by as much as on its dark side, which the sensor's noise alone would
// trust far more.
//
// Residuals are whitened by the variance that belongs to the mean, which is held while derivatives
// are taken: quasi-likelihood (Wedderburn, Biometrika 61, 1974, eq (1)), whose estimate is that of
// maximum likelihood up to the information in the variance itself, half of (d ln var)^2 a pixel.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/formation/lamp_image.hpp"
#include "libocc/refine/internal/normal.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pixel_noise.hpp"

namespace occ::internal::refine {

/// Storage for one lamp's rendered image and linearised pixels, lent to all lamps in turn.
struct PixelScratch {
  LampImage image;
  Eigen::Matrix<float, 10, Eigen::Dynamic> rows;  // one column for each pixel at the rim
};

class LampPixels {
 public:
  /// Keeps references. Without a window the lamp's pixels are taken to read what the scene says:
  /// then it tells what they know of the pose, the information in the variance included.
  LampPixels(const LampObservation& lamp, const Scene& scene, const RefineOptions& options,
             const PixelNoise& noise, const PixelPsf& psf, PixelScratch& scratch);

  /// Renders at a state and linearises; false when the lamp cannot be seen.
  bool linearise(const State& state, const Eigen::Vector3d& pivot);

  /// Adds what was linearised, unknowns of the lamp's own eliminated, and moves these to where they
  /// fit best at this pose.
  void add_to(Normal& normal);

  /// How much larger residuals at the rim are than their sigmas, at the last linearisation: 1 when
  /// the model and its noise are right.
  double misfit() const { return misfit_; }

  /// ln of the PSF's width over the one it was rendered with.
  double log_spread() const { return own_.log_spread; }

  /// What the lamp's pixels know of its place in the image, when its size is known but its light
  /// and the background are not [1/px^2]; of the last linearisation.
  Eigen::Matrix2d place_information() const;

  /// What they know of ln of its light, when its background is not known.
  double light_information() const;

 private:
  // Columns of the linearised pixels: turn and shift of the lamp, its own unknowns, residual.
  enum Column { spread = 6, light, background, residual, columns };
  using Products = Eigen::Matrix<double, columns, columns>;
  // Unknowns of the sums: pose, log_factor, own ones, residual.
  enum Unknown {
    log_factor = 6,
    own_light,
    own_background,
    own_spread,
    own_x,
    own_y,
    rest,
    unknowns
  };
  using Sums = Eigen::Matrix<double, unknowns, unknowns>;
  struct Own {
    double log_light = 0, background_e = 0, log_spread = 0;
  };
  struct Flat;  // sums over the pixels away from the rim

  void guess(const State& state);
  void fit_own(const State& state);
  void accumulate();
  double precision(const PixelMoments& moments, double error, double edge_e2, Flat& flat);
  void add_flat_pixel(double signal, double full, double reads, Flat& flat);
  void add_rim_pixel(double signal, double full, double coverage, const CoverageDerivatives::Row& d,
                     double reads, Flat& flat);
  void weigh_down();
  Sums sums() const;
  void add_own_priors(const State& state, Sums& sums) const;
  void move_own(const Eigen::Vector3d& step);

  const LampObservation& lamp_;
  const Scene& scene_;
  const RefineOptions& options_;
  const PixelNoise& noise_;
  const PixelPsf& psf_;

  PixelScratch& scratch_;
  State state_;
  Vector6 d_log_light_ = Vector6::Zero();
  Own own_;
  bool started_ = false;
  PixelMoments dark_;     // of a pixel that no light of the lamp reaches
  double amount_ = 1;     // exp(own_.log_light)
  double threshold_ = 0;  // of Huber's function
  double misfit_ = 1;     // over the sensor's noise
  double left_ = 1;       // over the edge's variance, too
  double edge_variance_ = 0, next_edge_variance_ = 0;  // relative to the light's step squared
  Eigen::Index rim_count_ = 0;
  int count_ = 0;  // pixels used
  double robust_excess_ = 0;
  Products products_ = Products::Zero();
  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();  // from the pivot to the lamp's centre
  Eigen::Matrix<double, 3, 2> shift_of_px_;        // of its centre, for a shift in the image
};

}  // namespace occ::internal::refine
