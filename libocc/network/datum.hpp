// SPDX-License-Identifier: Apache-2.0
// Datum of a network. The observations determine a free network up to a similarity
// X' = exp(s) R X + t; the datum defect (0 to 7) is the number of its undetermined parameters
// (translation, rotation, scale). Lengths among the cameras' parameters (an eccentricity) and the
// translations of mounts scale with the network.
//
// With G, a basis of the undetermined directions, and the datum conditions B^T dx = 0, estimates
// and covariance in any datum follow from those in any other (S-transformation):
//
//     x' = S x,  Q' = S Q S^T,  S = I - G (B^T G)^-1 B^T
//
// (Baarda, "S-transformations and criterion matrices", 1973; Koch, "Parameter estimation and
// hypothesis testing in linear models", 1999, section 3.3). Inner constraints over points (B = G in
// their rows, zero elsewhere) give the least trace of the points' covariance (Meissl 1962). All
// points have the same weight. The rotation of an unknown outline counts with the outline's size as
// arm, so that outlines determine the rotation about a line of points; other unknowns have no part.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/network.hpp"

namespace occ {

/// Kinds of datum.
enum class DatumKind {
  inner,    ///< inner constraints over `targets`; none given: over all points and corners
  minimal,  ///< as many coordinates of three `targets` as the defect; none given: three far apart
  control,  ///< no conditions: observations and fixed elements determine the datum
  scale_only,  ///< inner constraints for translation and rotation; distance of two `targets` for
               ///< scale
};

/// Definition of the coordinate system of a network.
struct Datum {
  DatumKind kind = DatumKind::inner;  ///< inner constraints by default
  std::vector<Target> targets;        ///< minimal: three or none; scale_only: two or none
};

/// Throws std::invalid_argument for an invalid target or a wrong number of targets.
LIBOCC_API void check_datum(const Network& network, const Datum& datum);

/// A similarity of the world: X' = scale * (rotation * X) + translation.
struct Similarity {
  double scale = 1;                                        ///< positive; 1: no change of lengths
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant +1
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< [m]

  /// Position after the similarity [m].
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

/// Network after a similarity of the world that leaves all images unchanged. It moves points,
/// bodies and stations; a scale also multiplies the mounts' translations and all lengths among the
/// cameras' parameters. The corners of bodies are kept; their `scale` is multiplied. Throws
/// std::invalid_argument for a scale that is not positive.
LIBOCC_API Network transformed(Network network, const Similarity& similarity);

/// Undetermined directions of a network.
struct DatumDefect {
  int translation = 0, rotation = 0, scale = 0;  ///< number of undetermined parameters of each kind
  /// Orthonormal columns over (rotation, translation, log scale) about `pivot_m`; the translation
  /// is in units of `extent_m`. As many columns as the defect.
  Eigen::Matrix<double, 7, Eigen::Dynamic> directions;
  Eigen::Vector3d pivot_m = Eigen::Vector3d::Zero();  ///< centre of rotation and scale
  double extent_m = 1;                                ///< size of the network

  /// Number of undetermined parameters, 0 to 7.
  int total() const { return static_cast<int>(directions.cols()); }
};

/// Defect that remains with the distances, control points, bodies of known size, priors and fixed
/// elements of the network.
LIBOCC_API DatumDefect datum_defect(const Network& network);

/// Moves the network, along its defect only, so that it meets the datum conditions: the coordinates
/// (or their moments, or the distance) equal those of `reference`, a network of the same points and
/// bodies. Status: ok; degenerate: the datum is `control` and there is a defect, or the targets do
/// not determine the datum.
LIBOCC_API Result<Network> in_datum(const Network& network, const Network& reference,
                                    const Datum& datum = {});

}  // namespace occ
