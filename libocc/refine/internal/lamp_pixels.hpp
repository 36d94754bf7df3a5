// SPDX-License-Identifier: Apache-2.0
// One lamp's pixels in the normal equations. The mean signal of a pixel is
//     mu = exp(a) (S + s dS/ds) + b
// with S the lamp's rendered image. Unknowns of each lamp: a, ln of its light over the scene's
// (prior from the flux model); b, the background; s, ln of the PSF's width over the scene's (prior
// sigma 0.1); the order m of emission, with which S is rendered; and, if camera and map have
// errors, the shift of the lamp in the image. Each linearisation eliminates them in closed form
// (Schur complement).
//
// The order determines the gradient of the light over the lamp's image. A wrong gradient changes
// the grey levels at the rim, more on one side, as a shift of the lamp does. A free order thus
// costs information: for a disc with a radius of 14 pixels, the pose's sigma increases by 10 %. The
// order therefore starts with a narrow prior about the scene's order.
// RefineProblem::free_emission() replaces it by a wide one if the pixels contradict the scene
// significantly. The emission of a lamp with photometry is assumed to be exact: it has no order.
//
// If the pixels at the rim miss the model by more than chance, e.g. under a PSF that is not
// Gaussian, their variance is increased by a term proportional to the square of the light's step.
// The model error of an edge is as large on its dark side as on its bright side, but the sensor's
// noise alone would give the dark side a far larger weight.
//
// Residuals are whitened by the variance at the mean, which is constant in the derivatives:
// quasi-likelihood (Wedderburn, Biometrika 61, 1974, eq (1)). Its estimate equals that of maximum
// likelihood except for the information in the variance itself, (d ln var)^2 / 2 for each pixel.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/formation/lamp_image.hpp"
#include "libocc/refine/internal/emission.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pixel_noise.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"

namespace occ::internal::refine {

/// Storage for the rendered image and the linearised pixels of one lamp; all lamps share it.
struct PixelScratch {
  LampImage image;
  Eigen::Matrix<float, 11, Eigen::Dynamic> rows;  // one column for each pixel at the rim
};

class LampPixels {
 public:
  /// Keeps references. Without a window the pixels are assumed to equal the scene's prediction: the
  /// normal equations then hold their information about the pose, including that of the variance.
  LampPixels(const LampObservation& lamp, const Scene& scene, const RefineOptions& options,
             const PixelNoise& noise, const PixelPsf& psf, PixelScratch& scratch);

  /// Renders at a state and linearises; false if the lamp is not visible.
  bool linearise(const State& state, const Eigen::Vector3d& pivot);

  /// Adds the linearised pixels with the lamp's own unknowns eliminated, and sets these unknowns to
  /// their best fit at this pose.
  void add_to(PoseNormalEquations& normal);

  /// Replaces the prior of the lamp's emission in the normal equations of the last linearisation by
  /// that of an unknown emission.
  void exchange_emission_prior(PoseNormalEquations& normal) const;

  /// Estimates the order of emission with almost no prior from now on.
  void free_emission() { order_sigma_ = free_order_sigma_; }

  /// Ratio of the residuals at the rim to their sigmas at the last linearisation; 1 for a correct
  /// model.
  double misfit() const { return misfit_; }

  /// ln of the PSF's width over the rendered one.
  double log_spread() const { return own_.log_spread; }

  /// Information about the lamp's position in the image [1/px^2] at the last linearisation; size
  /// known, light and background unknown.
  Eigen::Matrix2d centroid_information() const;

  /// Information about ln of the light, with unknown background.
  double light_information() const;

 private:
  // Columns of the linearised pixels: rotation and shift of the lamp, its own unknowns, residual.
  enum Column { spread = 6, light, background, order, residual, columns };
  using Products = Eigen::Matrix<double, columns, columns>;
  // Unknowns of the sums: pose, log_factor, own ones, residual.
  enum Unknown {
    log_factor = 6,
    own_light,
    own_background,
    own_spread,
    own_order,
    own_x,
    own_y,
    rest,
    unknowns
  };
  using Sums = Eigen::Matrix<double, unknowns, unknowns>;
  struct Own {
    double log_light = 0, background_e = 0, log_spread = 0;
    double order = 0;  // over the scene's
  };
  struct Eliminated {  // normal equations of pose and log_factor, and the step of the own unknowns
    Eigen::Matrix<double, 7, 7> information;
    Eigen::Matrix<double, 7, 1> pull;
    double chi2;
    Eigen::Vector4d step;
    void add_to(PoseNormalEquations& normal, double sign) const;
  };
  struct Flat;  // sums over the pixels away from the rim

  EmissionSlope slope_of_light(const Rigid3& cam_from_world, const Eigen::Vector3d& centre) const;
  void guess(const State& state);
  void fit_own(const State& state);
  void accumulate();
  double precision(const PixelMoments& moments, double error, double edge_e2, Flat& flat);
  void add_flat_pixel(double signal, double full, double log_slope, double reads, Flat& flat);
  void add_rim_pixel(double signal, double full, double coverage, double log_slope,
                     const CoverageDerivatives::Row& d, double reads, Flat& flat);
  void weigh_down();
  Sums sums() const;
  void add_own_priors(const State& state, Sums& sums) const;
  void add_order_prior(double weight, Sums& sums) const;
  static Eliminated eliminate(const Sums& all);
  void move_own(const Eigen::Vector4d& step);

  const LampObservation& lamp_;
  const Scene& scene_;
  const RefineOptions& options_;
  const PixelNoise& noise_;
  const PixelPsf& psf_;

  PixelScratch& scratch_;
  State state_;
  Lamp rendered_;                          // with the estimated order of emission
  double order_;                           // of the scene's lamp
  double order_sigma_, free_order_sigma_;  // of its prior, now and after free_emission()
  double linearised_order_ = 0;            // own_.order at the last linearisation
  Sums sums_ = Sums::Zero();               // of the last linearisation, with priors
  Rigid3 first_pose_;  // at which the order does not change the light of the lamp's centre
  EmissionSlope slope_;
  Vector6 d_log_light_ = Vector6::Zero();
  Own own_;
  bool started_ = false;
  PixelMoments dark_;     // of a pixel without light of the lamp
  double amount_ = 1;     // exp(own_.log_light)
  double threshold_ = 0;  // corner of Huber's loss
  double misfit_ = 1;     // relative to the sensor's noise
  double left_ = 1;       // relative to the noise and the edge's variance
  double edge_variance_ = 0, next_edge_variance_ = 0;  // relative to the light's step squared
  Eigen::Index rim_count_ = 0;
  int count_ = 0;  // pixels used
  double robust_excess_ = 0;
  Products products_ = Products::Zero();
  Eigen::Vector3d arm_ = Eigen::Vector3d::Zero();  // from the pivot to the lamp's centre
  Eigen::Matrix<double, 3, 2> shift_of_px_;        // of its centre, for a shift in the image
};

}  // namespace occ::internal::refine
