// SPDX-License-Identifier: Apache-2.0
// Covariance of a network's points, poses and parameters at its current state. It depends on the
// geometry and the sigmas of the observations, not on the observed pixels, so it is also the
// Cramer-Rao bound of a planned network.
//
//     Q_p = V^-1 + V^-1 E^T Q_c E V^-1       Q_c = D (D S D)^+ D,  D = diag(S)^-1/2,
//
// followed by the S-transformation to the requested datum (datum.hpp). Memory grows with the square
// of the number of reduced unknowns, time with that times the number of points.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/network.hpp"

namespace occ {

namespace internal::network {
struct PrecisionState;
}

/// Covariances in one datum. Elements that were left out of the adjustment have an infinite
/// variance, fixed elements a zero one; no element is NaN. Invalid indices and targets throw
/// std::invalid_argument.
class LIBOCC_API Precision {
 public:
  Precision();  ///< precision of an empty network
  ~Precision();
  Precision(const Precision&);
  Precision(Precision&&) noexcept;
  Precision& operator=(const Precision&);
  Precision& operator=(Precision&&) noexcept;

  int defect() const;  ///< datum defect
  /// Number of scalar unknowns.
  int unknowns() const;

  /// Covariance of a point's position [m^2].
  Eigen::Matrix3d point(int point) const;
  /// Covariances of all points, in their order.
  std::vector<Eigen::Matrix3d> points() const;
  /// Covariance of a point's position [m], the rotation of its outline [rad], about its x and y
  /// axes if it is round, else about the world's, and the logarithms of its sizes: 6 x 6 or 8 x 8.
  /// Infinite for a point that was left out. Throws std::invalid_argument for a point without an
  /// observed outline.
  Eigen::MatrixXd outline(int point) const;
  /// Covariance of a target's position [m^2].
  Eigen::Matrix3d position(const Target& target) const;
  /// Joint covariance of two positions.
  Matrix6 positions(const Target& a, const Target& b) const;
  /// Joint covariance of positions, 3n x 3n [m^2], in the order of the targets. Rows and columns of
  /// targets that were left out are zero except for an infinite diagonal.
  Eigen::MatrixXd joint(const std::vector<Target>& targets) const;
  /// Standard deviation of the distance; 0 when both targets are fixed.
  double distance_sigma_m(const Target& a, const Target& b) const;

  /// Relative standard deviation of the network's scale (best fit over all points and corners); 0
  /// if the datum fixes the scale.
  double scale_sigma() const;

  /// Covariance of a pose's left perturbation (geometry/rigid.hpp).
  Matrix6 station(int station) const;
  /// Covariance of a mount's left perturbation (geometry/rigid.hpp).
  Matrix6 mount(int mount) const;
  /// Covariance of the left perturbation of world_from_body.
  Matrix6 body(int body) const;
  /// Covariance of a station's position in the world [m^2].
  Eigen::Matrix3d station_position(int station) const;
  /// Relative standard deviation of a body's scale; 0 when the size is known.
  double body_scale_sigma(int body) const;

  /// Covariance and correlation of a camera's free parameters, in the order of
  /// NetworkCamera::free_parameters.
  Eigen::MatrixXd parameters(int camera) const;
  /// Standard deviation of NetworkCamera::outline_growth_px; 0 if it is known.
  double outline_growth_sigma_px(int camera) const;
  /// Correlation coefficients, -1 to 1; order as parameters().
  Eigen::MatrixXd parameter_correlation(int camera) const;

  /// Covariances in another datum, by S-transformation. Status as precision().
  Result<Precision> in_datum(const Datum& datum) const;

  /// All covariances multiplied by a factor, for example sigma0 squared if the observations' sigmas
  /// are known only up to a factor. Throws std::invalid_argument for a negative factor.
  Precision scaled(double variance_factor) const;

  /// Content, for the library's own use.
  const internal::network::PrecisionState& state() const { return *state_; }

 private:
  friend Result<Precision> precision(const Network&, const Datum&, int);
  std::shared_ptr<const internal::network::PrecisionState> state_;
};

/// Status: ok; too_few_lamps and degenerate as adjust(): the message names the unknowns that are
/// not determined. Throws std::invalid_argument as check_network() and check_datum() do.
LIBOCC_API Result<Precision> precision(const Network& network, const Datum& datum = {},
                                       int threads = 2);

}  // namespace occ
