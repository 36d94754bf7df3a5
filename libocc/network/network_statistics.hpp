// SPDX-License-Identifier: Apache-2.0
// What the field asks of an adjusted network: how much of each observation is controlled by others,
// which errors would have been found, which parameters matter.
//
//     r_i = 1 - (J Q J^T)_ii / sigma_i^2     redundancy number; their sum is the redundancy
//     w_i = v_i / (sigma_i sqrt(r_i))        Baarda's test, normal when nothing is wrong
//     tau_i = w_i / sigma0                   Pope's, when sigma0 is estimated with it
//     4.13 sigma_i / sqrt(r_i)               least error found (0.1 % false alarms, 80 % power)
//     4.13 sqrt((1 - r_i) / r_i)             what that error does to any function of the
//                                            unknowns at most, in its sigmas (external reliability)
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

struct ObservationStatistics {
  bool used = false;                                      ///< all else is zero when not
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< seen minus projected
  Eigen::Vector2d redundancy = Eigen::Vector2d::Zero();
  Eigen::Vector2d w = Eigen::Vector2d::Zero();
  Eigen::Vector2d tau = Eigen::Vector2d::Zero();
  Eigen::Vector2d detectable_px = Eigen::Vector2d::Zero();  ///< infinite where nothing controls it
  Eigen::Vector2d external = Eigen::Vector2d::Zero();       ///< infinite likewise
};

struct DistanceStatistics {
  bool used = false;
  double residual_m = 0;  ///< stated minus adjusted
  double redundancy = 0, w = 0, detectable_m = 0;
};

struct NetworkStatistics {
  int observations = 0, unknowns = 0, defect = 0;
  double redundancy = 0;        ///< observations - unknowns + defect
  double image_redundancy = 0;  ///< of which image observations have this
  double sigma0 = 1;
  double sigma0_low = 0, sigma0_high = 0;   ///< 95 % interval of sigma0 when sigmas are right
  double w_critical = 0, tau_critical = 0;  ///< 1 % false alarms among all observations
  Eigen::Vector2d rms_px = Eigen::Vector2d::Zero();
  std::vector<ObservationStatistics> image_observations;  ///< in the network's order
  std::vector<DistanceStatistics> distances;
  std::vector<Eigen::Vector2d> rms_px_of_image;
};

/// Of a network as adjust() returns it. `degenerate`: something is not determined.
LIBOCC_API Result<NetworkStatistics> network_statistics(const Network& adjusted, int threads = 2);

struct ParameterStatistics {
  int camera = 0;
  std::string name, unit;
  double value = 0, nominal = 0, sigma = 0;
  double t = 0;              ///< |value - nominal| / sigma
  bool significant = false;  ///< t beyond 1 % in both directions
  double correlation = 0;    ///< the largest with any other parameter of its camera
  std::string correlated_with;
  bool entangled = false;  ///< |correlation| > 0.9
};

/// `nominal`: the same network with the values that the parameters would have if they were not
/// estimated, for example as it was before. Precision: of `adjusted`.
LIBOCC_API std::vector<ParameterStatistics> parameter_statistics(const Network& adjusted,
                                                                 const Network& nominal,
                                                                 const Precision& precision);

struct SelectOptions {
  AdjustOptions adjust;
  double false_alarm = 0.01;      ///< a parameter stays that is significant at this level
  double max_correlation = 0.98;  ///< of two more alike, the less significant goes
  std::vector<std::string> keep;  ///< names that are never dropped
};

struct SelectionStep {
  std::string dropped;  ///< "k2 of camera"; empty: the first adjustment, with all
  std::string reason;
  double sigma0 = 0;
  double bic = 0;  ///< chi^2 + (free parameters) ln(observations)
};

struct Selection {
  Adjustment adjustment;  ///< with what was kept
  std::vector<SelectionStep> steps;
};

/// From all free parameters of a network, those that the observations ask for: backwards, the worst
/// first, with an adjustment after each. A dropped parameter has its value in `network`. Status:
/// that of the last adjustment.
LIBOCC_API Result<Selection> select_parameters(const Network& network,
                                               const SelectOptions& options = {});

struct VarianceComponent {
  int camera = 0, axis = 0;  ///< 0: columns, 1: rows
  double factor = 1;         ///< of the sigmas as they were stated
  double redundancy = 0;
  int observations = 0;
};

struct VarianceComponents {
  std::vector<VarianceComponent> components;
  Adjustment adjustment;  ///< with the new sigmas
  int rounds = 0;
};

/// Foerstner's simplified iteration: factor^2 <- factor^2 (v^T P v) / (sum of r), adjusted anew
/// until no factor changes by more than a thousandth. A component whose redundancy is below 1 is
/// left.
LIBOCC_API Result<VarianceComponents> variance_components(const Network& network,
                                                          const AdjustOptions& options = {});

struct CheckPoint {
  Target target;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

struct CheckResult {
  Eigen::Vector3d rmse_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d predicted_m = Eigen::Vector3d::Zero();  ///< root of the mean variance
  double rmse_3d_m = 0, predicted_3d_m = 0;
  std::vector<Eigen::Vector3d> errors_m;
};

/// Errors at points whose places are known better, against what the covariance says. What is open
/// is fitted to the check points themselves, and the covariance is that of the same datum.
LIBOCC_API Result<CheckResult> check_points(const Network& adjusted, const Precision& precision,
                                            const std::vector<CheckPoint>& points);

struct ProjectionUncertainty {
  Eigen::MatrixXd x_px, y_px;  ///< of the grid's columns and rows
  Eigen::MatrixXd sigma_px;  ///< rows x columns; the larger semi-axis; infinite outside the domain
  double mean_px = 0, worst_px = 0;
};

/// How far a pixel of a calibrated camera may be off, over the image. What a small turn of the
/// camera (and, at a finite range, a small shift) would do alike does not count: it is made the
/// best of over the grid (Kogan, mrcal, "projection uncertainty"). `covariance`: of the free
/// parameters `free`, in their order. range_m: distance of what is looked at; infinite: turn alone.
LIBOCC_API ProjectionUncertainty projection_uncertainty(
    const Camera& camera, const std::vector<std::string>& free, const Eigen::MatrixXd& covariance,
    int columns, int rows, double range_m = std::numeric_limits<double>::infinity());

}  // namespace occ
