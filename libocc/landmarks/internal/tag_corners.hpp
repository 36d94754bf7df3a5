// SPDX-License-Identifier: Apache-2.0
// Internal: the corners of a dark square on a light ground (or the reverse) to a few hundredths of
// a pixel, from corners to half a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::landmarks {

struct TagCorners {
  std::array<Eigen::Vector2d, 4> px;
  std::array<Eigen::Matrix2d, 4> covariance_px2;
  /// How far the middle of side k is off the straight line from corner k to the next, towards
  /// (-y, x) of that direction, where the lens is known.
  std::optional<std::array<double, 4>> bends_px;
};

/// `grey`: one channel. `border`: width of the rings inside and outside the square's sides that are
/// of one tone, in sides. False when a side is too short, too faint or leaves the image.
bool refine_corners(const Image& grey, double border, TagCorners& corners);

}  // namespace occ::internal::landmarks
