// SPDX-License-Identifier: Apache-2.0
// How well a network determines its unknowns: the covariance of points, poses and parameters at its
// present state, which is also the Cramer-Rao bound of a design that was never photographed. The
// pixels do not matter, only who sees what with which sigma.
//
//     Q_p = V^-1 + V^-1 E^T Q_c E V^-1       Q_c = S^-1 in the datum where stations hold it,
//
// then the S-transformation to the datum asked for (datum.hpp). Memory grows with the number of
// reduced unknowns squared, time with points times that.
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

struct ErrorEllipsoid {
  Eigen::Vector3d semi_axes_m;  ///< one sigma, the longest first
  Eigen::Matrix3d directions;   ///< columns, unit
};

LIBOCC_API ErrorEllipsoid error_ellipsoid(const Eigen::Matrix3d& covariance_m2);

/// Nothing in it is NaN: what was left out of the adjustment has an infinite variance, what is
/// fixed has none.
class LIBOCC_API Precision {
 public:
  Precision();  ///< of no network at all
  ~Precision();
  Precision(const Precision&);
  Precision(Precision&&) noexcept;
  Precision& operator=(const Precision&);
  Precision& operator=(Precision&&) noexcept;

  /// Defect of the datum and number of the unknowns.
  int defect() const;
  int unknowns() const;

  Eigen::Matrix3d point(int point) const;
  /// Of all points at once, in their order.
  std::vector<Eigen::Matrix3d> points() const;
  Eigen::Matrix3d position(const Target& target) const;
  /// Of two positions together.
  Matrix6 positions(const Target& a, const Target& b) const;
  /// Of their distance; 0 when both are fixed.
  double distance_sigma_m(const Target& a, const Target& b) const;

  /// Of the size of the whole, relative: of the scale that fits all points and corners best. 0
  /// where the datum holds it.
  double scale_sigma() const;

  /// Of a pose's left perturbation (geometry/rigid.hpp).
  Matrix6 station(int station) const;
  Matrix6 mount(int mount) const;
  Matrix6 body(int body) const;
  /// Of where a station is in the world.
  Eigen::Matrix3d station_position(int station) const;
  /// Standard deviation of a body's scale, relative; 0 when that is known.
  double body_scale_sigma(int body) const;

  /// Of a camera's free parameters, in the order of NetworkCamera::free_parameters.
  Eigen::MatrixXd parameters(int camera) const;
  Eigen::MatrixXd parameter_correlation(int camera) const;

  /// The same in another datum, without solving again.
  Result<Precision> in_datum(const Datum& datum) const;

  /// All of it times a factor: sigma0 squared, when sigmas of observations were guessed.
  Precision scaled(double variance_factor) const;

  const internal::network::PrecisionState& state() const { return *state_; }

 private:
  friend Result<Precision> precision(const Network&, const Datum&, int);
  std::shared_ptr<const internal::network::PrecisionState> state_;
};

/// `degenerate`: something is not determined; the message names it. Throws std::invalid_argument as
/// check_network and check_datum do.
LIBOCC_API Result<Precision> precision(const Network& network, const Datum& datum = {},
                                       int threads = 2);

}  // namespace occ
