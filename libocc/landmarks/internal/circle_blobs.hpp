// SPDX-License-Identifier: Apache-2.0
// Internal: elliptical blobs of a grey image, and the square lattices that they form.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "libocc/landmarks/internal/saddles.hpp"

namespace occ::internal::landmarks {

/// A connected region that is darker (or brighter) than its surroundings, with the moments of an
/// ellipse, in pixels of a GreyLevel.
struct EllipseBlob {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< centroid
  /// Central second moments per area. Those of an ellipse with the half axis a are a^2 / 4.
  Eigen::Matrix2d moments = Eigen::Matrix2d::Identity();
  double area_px2 = 0;
};

/// Blobs of one polarity. The threshold is the mean of a neighbourhood of 33 px, which suits discs
/// with a diameter of 4 to 30 px.
std::vector<EllipseBlob> find_ellipses(const GreyLevel& level, bool dark);

/// Positions (u, v) of blobs in a square lattice, with their indices; right-handed in the image.
using BlobLattice = std::map<std::pair<int, int>, std::size_t>;

/// Calls `use` with each lattice of at least `min_blobs` blobs, until it returns true. A lattice
/// grows from four neighbouring blobs. Further blobs are searched where the others predict them.
void for_each_lattice(const std::vector<EllipseBlob>& blobs, std::size_t min_blobs,
                      const std::function<bool(const BlobLattice&)>& use);

}  // namespace occ::internal::landmarks
