// SPDX-License-Identifier: Apache-2.0
// Reliability and significance in an adjusted network: redundancy numbers, tests for gross errors,
// minimal detectable errors, significance of camera parameters, variance components, check points.
//
//     r_i = 1 - (J Q J^T)_ii / sigma_i^2     redundancy number; their sum is the redundancy
//     w_i = v_i / (sigma_i sqrt(r_i))        Baarda's test, standard normal without gross errors
//     tau_i = w_i / sigma0                   Pope's test, with sigma0 from the same adjustment
//     4.13 sigma_i / sqrt(r_i)               minimal detectable error (0.1 % false alarms, 80 %
//     power) 4.13 sqrt((1 - r_i) / r_i)             largest effect of that error on any function of
//     the
//                                            unknowns, in its sigmas (external reliability)
//
// Baarda, "A testing procedure for use in geodetic networks", 1968; Pope, "The statistics of
// residuals and the detection of outliers", NOAA TR NOS 65, 1976; Foerstner, "Ein Verfahren zur
// Schaetzung von Varianz- und Kovarianzkomponenten", AVN 86, 1979.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/network.hpp"
#include "libocc/network/precision.hpp"

namespace occ {

/// Reliability of one image observation; vectors are (x, y).
struct ObservationStatistics {
  bool used = false;                                      ///< if false, all other members are zero
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< observed - projected
  Eigen::Vector2d redundancy = Eigen::Vector2d::Zero();   ///< r_i, 0 (uncontrolled) to 1
  Eigen::Vector2d w = Eigen::Vector2d::Zero();            ///< Baarda's test value
  Eigen::Vector2d tau = Eigen::Vector2d::Zero();          ///< Pope's test value
  Eigen::Vector2d detectable_px = Eigen::Vector2d::Zero();  ///< infinite without redundancy
  Eigen::Vector2d external = Eigen::Vector2d::Zero();       ///< infinite without redundancy
};

/// Reliability of one measured distance.
struct DistanceStatistics {
  bool used = false;                               ///< if false, all other members are zero
  double residual_m = 0;                           ///< observed - adjusted
  double redundancy = 0, w = 0, detectable_m = 0;  ///< r_i, w_i and minimal detectable error
};

/// Statistics of all observations of a network.
struct NetworkStatistics {
  int observations = 0, unknowns = 0, defect = 0;  ///< scalar counts, as in Adjustment
  double redundancy = 0;                           ///< observations - unknowns + defect
  double image_redundancy = 0;                     ///< part of the image observations
  double sigma0 = 1;                               ///< a posteriori; 1 for correct sigmas
  double sigma0_low = 0, sigma0_high = 0;          ///< 95 % interval of sigma0 for correct sigmas
  double w_critical = 0, tau_critical = 0;         ///< 1 % false alarms for all tests together
  /// Residuals of all used observations in x and y.
  Eigen::Vector2d rms_px = Eigen::Vector2d::Zero();
  std::vector<ObservationStatistics> image_observations;  ///< in the network's order
  std::vector<DistanceStatistics> distances;              ///< in the network's order
  /// Residuals in x and y of each image; 0 without observations.
  std::vector<Eigen::Vector2d> rms_px_of_image;
};

/// Statistics of a network as adjust() returns it. Status: as adjust(); degenerate: unknowns that
/// no observation determines.
LIBOCC_API Result<NetworkStatistics> network_statistics(const Network& adjusted, int threads = 2);

/// Significance of one free camera parameter.
struct ParameterStatistics {
  int camera = 0;          ///< index into Network::cameras
  std::string name, unit;  ///< as in CameraParameter
  /// Estimate, value without estimation, and standard deviation.
  double value = 0, nominal = 0, sigma = 0;
  double t = 0;                    ///< |value - nominal| / sigma
  bool significant = false;        ///< two-sided test at the 1 % level
  double correlation = 0;          ///< largest (in magnitude) with another parameter of its camera
  std::string correlated_with;     ///< name of that other parameter
  bool highly_correlated = false;  ///< |correlation| > 0.9
};

/// Tests the free parameters against their nominal values. `nominal`: the same network with the
/// values that the parameters have if they are not estimated, for example before the adjustment.
/// `precision`: of `adjusted`. Throws std::invalid_argument if the networks or the precision do not
/// match.
LIBOCC_API std::vector<ParameterStatistics> parameter_statistics(const Network& adjusted,
                                                                 const Network& nominal,
                                                                 const Precision& precision);

/// Options of select_parameters().
struct SelectOptions {
  AdjustOptions adjust;           ///< for each adjustment
  double false_alarm = 0.01;      ///< level of significance required of a parameter
  double max_correlation = 0.98;  ///< above it, the less significant of two is a candidate
  std::vector<std::string> keep;  ///< names of parameters that are never dropped
  /// Cameras with the values that parameters have if they are not estimated, one for each camera of
  /// the network; empty: those of the network. Needed where the network's values come from the same
  /// observations: a parameter never differs significantly from its own estimate.
  std::vector<Camera> nominal;
};

/// One adjustment of the selection.
struct SelectionStep {
  std::string dropped;  ///< "k2 of camera"; empty: first adjustment, with all parameters
  std::string reason;   ///< why the parameter was dropped
  double sigma0 = 0;    ///< after this adjustment
  double bic = 0;       ///< chi^2 + (free parameters) ln(observations)
};

/// Result of select_parameters().
struct Selection {
  Adjustment adjustment;             ///< with the parameters that were kept
  std::vector<SelectionStep> steps;  ///< in their order; the last one is `adjustment`
};

/// Backward elimination of the free camera parameters: drops the least significant one, or one of
/// two that are highly correlated, and adjusts again, until all are significant. A dropped
/// parameter gets its nominal value. Status: that of the last adjustment. Throws
/// std::invalid_argument for nominal cameras of another number or model.
LIBOCC_API Result<Selection> select_parameters(const Network& network,
                                               const SelectOptions& options = {});

/// Observed accuracy of one axis of a camera.
struct VarianceComponent {
  int camera = 0, axis = 0;  ///< 0: columns, 1: rows
  double factor = 1;         ///< ratio of the estimated to the given sigmas
  double redundancy = 0;     ///< sum of the redundancy numbers of its observations
  int observations = 0;      ///< number of image points
};

/// Result of variance_components().
struct VarianceComponents {
  std::vector<VarianceComponent> components;  ///< two per camera: columns, rows
  Adjustment adjustment;                      ///< with the new sigmas
  int rounds = 0;                             ///< number of adjustments
};

/// Variance components of each camera's columns and rows by Foerstner's simplified iteration:
/// factor^2 <- factor^2 (v^T P v) / (sum of r), with a new adjustment, until no factor changes by
/// more than a thousandth. Components with a redundancy below 1 keep their sigmas. Status: that of
/// the last adjustment, or not_converged.
LIBOCC_API Result<VarianceComponents> variance_components(const Network& network,
                                                          const AdjustOptions& options = {});

/// Point with independently known coordinates.
struct CheckPoint {
  Target target;  ///< a point of the network
  /// Known position; the datum defect is removed before the comparison.
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

/// Comparison of estimated with known coordinates.
struct CheckResult {
  Eigen::Vector3d rmse_m = Eigen::Vector3d::Zero();  ///< root mean square errors in x, y, z
  Eigen::Vector3d predicted_m =
      Eigen::Vector3d::Zero();               ///< square root of the mean predicted variance
  double rmse_3d_m = 0, predicted_3d_m = 0;  ///< root sums of squares of the axes
  /// Estimate minus known position, in the order of the check points.
  std::vector<Eigen::Vector3d> errors_m;
};

/// Errors at check points, compared with the predicted covariance. The datum defect is removed by
/// inner constraints over the check points, for the coordinates and for the covariance. Throws
/// std::invalid_argument without check points or for a corner of a body.
LIBOCC_API Result<CheckResult> check_points(const Network& adjusted, const Precision& precision,
                                            const std::vector<CheckPoint>& points);

/// Uncertainty of a camera's projection on a grid of pixels.
struct ProjectionUncertainty {
  Eigen::MatrixXd x_px, y_px;  ///< pixel coordinates of the grid, rows x columns
  Eigen::MatrixXd sigma_px;    ///< rows x columns; larger semi-axis; infinite outside the domain
  double mean_px = 0, worst_px = 0;  ///< over the grid inside the domain
};

/// Uncertainty of the projection [px] of a calibrated camera over the image. A least squares fit
/// over the grid compensates the part that equals a small rotation of the camera (and, at a finite
/// range, a small translation) (Kogan, mrcal, "projection uncertainty"). `covariance`: of the
/// parameters `free`, in their order. range_m: distance of the object; infinite: rotation only.
/// Throws std::invalid_argument for a grid below 2 x 2, unknown names or a covariance of another
/// size.
LIBOCC_API ProjectionUncertainty projection_uncertainty(
    const Camera& camera, const std::vector<std::string>& free, const Eigen::MatrixXd& covariance,
    int columns, int rows, double range_m = std::numeric_limits<double>::infinity());

}  // namespace occ
