// SPDX-License-Identifier: Apache-2.0
// Relative radiant intensity of a lamp from a measured distribution (photometric_file.hpp).
//
//   I(theta, C) = P f(theta, C),   integral of f over the lit hemisphere = 1       [1/sr]
//
// theta is the emission angle from the lamp's normal (gamma of the file), 0 to pi/2; light behind
// the lamp's plane is ignored. C is the angle about the normal: C = 0 along Lamp::x_axis and C = 90
// degrees along x_axis x normal, so it runs counter-clockwise seen from behind the lamp (from above
// for a ceiling lamp; CIE 121-1996). The spectrum is assumed to be the same in all directions, so
// radiant and luminous intensity are proportional.
//
// f is interpolated by bicubic Hermite polynomials in theta and, periodically, in C. Value and
// gradient are continuous, also on the normal, where the planes C and C + pi continue each other.
// Between monotone values of a plane the curve is monotone (Huynh 1993, internal/hermite_grid.hpp).
#pragma once

#include <Eigen/Core>
#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/radiometry/photometric_file.hpp"

namespace occ {

/// Emission of a lamp as a function of the direction. Immutable, so copies share the table.
class LIBOCC_API EmissionProfile {
 public:
  /// Throws std::invalid_argument as PhotometricDistribution::validate() does, and for a
  /// distribution without light at gamma < 90 degrees.
  explicit EmissionProfile(PhotometricDistribution distribution);

  /// f [1/sr] along a unit vector with coordinates along (x_axis, x_axis x normal, normal); 0 for
  /// directions behind the lamp's plane. `gradient`: derivative by the direction, perpendicular to
  /// it; zero where f is 0.
  double density(const Eigen::Vector3d& direction, Eigen::Vector3d* gradient = nullptr) const;

  /// True unless the distribution is rotationally symmetric about the normal.
  bool depends_on_c() const { return distribution_.horizontal_rad.size() > 1; }

  /// Order m of the Lambertian lamp with the same mean cosine of the emission angle,
  /// (m + 1) / (m + 2); at least 0.01. For estimates only.
  double equivalent_order() const { return equivalent_order_; }

  /// The distribution that the profile was made of.
  const PhotometricDistribution& distribution() const { return distribution_; }

 private:
  struct Grid;
  PhotometricDistribution distribution_;
  std::shared_ptr<const Grid> grid_;
  double equivalent_order_ = 1;
};

}  // namespace occ
