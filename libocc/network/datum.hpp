// SPDX-License-Identifier: Apache-2.0
// The datum of a network: which similarity X' = exp(s) R X + t of everything the observations leave
// open (its defect, 0 to 7 of shift, turn and scale), and what holds it. Lengths among the cameras'
// parameters (an eccentricity) and the shifts of mounts scale along with the network.
//
// With G the directions that the observations leave open and B the datum's conditions, B^T dx = 0,
// estimates and covariance of any datum follow from those of any other (S-transformation):
//
//     x' = S x,  Q' = S Q S^T,  S = I - G (B^T G)^-1 B^T
//
// (Baarda, "S-transformations and criterion matrices", 1973; Koch, "Parameter estimation and
// hypothesis testing in linear models", 1999, section 3.3). Inner constraints over points, B = G
// there, give the least trace of the points' covariance (Meissl 1962); all points weigh the same,
// and parameters in other units take no part.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/network.hpp"

namespace occ {

enum class DatumKind {
  inner,    ///< inner constraints over `targets`; over all points and corners when none are named
  minimal,  ///< as few coordinates of `targets` (or of three far apart) as there are open
  control,  ///< observations and fixed things alone: nothing may be open
  scale_only,  ///< shift and turn by inner constraints, scale by the distance of two `targets`
};

struct Datum {
  DatumKind kind = DatumKind::inner;
  std::vector<Target> targets;  ///< minimal: three, scale_only: two, or none: those far apart
};

/// Throws std::invalid_argument for a target that is none, or another number of them.
LIBOCC_API void check_datum(const Network& network, const Datum& datum);

/// A similarity of the world: X' = scale * (rotation * X) + translation.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (rotation * point) + translation;
  }
};

/// Everything of a network moved, such that each image stays as it is: points, bodies, stations,
/// and with the scale the mounts' shifts and all lengths among the cameras' parameters. A body that
/// is of known size keeps it: what the scale would change there shows as another `scale` of it.
LIBOCC_API Network transformed(Network network, const Similarity& similarity);

struct DatumDefect {
  int shift = 0, turn = 0, scale = 0;
  /// Orthonormal columns over (turn, shift, log scale) about `pivot_m`, in units of `extent_m`.
  Eigen::Matrix<double, 7, Eigen::Dynamic> directions;
  Eigen::Vector3d pivot_m = Eigen::Vector3d::Zero();
  double extent_m = 1;

  int total() const { return static_cast<int>(directions.cols()); }
};

/// What distances, control points, bodies of known size, priors and everything fixed leave open.
LIBOCC_API DatumDefect datum_defect(const Network& network);

/// The network moved, along its defect only, so that it meets the datum's conditions: those
/// coordinates (or their moments, or the distance) are as in `reference`, a network of the same
/// points. `degenerate`: the datum is `control` and something is open, or the targets do not
/// hold it.
LIBOCC_API Result<Network> in_datum(const Network& network, const Network& reference,
                                    const Datum& datum = {});

}  // namespace occ
