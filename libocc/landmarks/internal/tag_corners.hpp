// SPDX-License-Identifier: Apache-2.0
// Internal: refines the corners of a dark square on a light ground (or the reverse) from about half
// a pixel to a few hundredths of a pixel.
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
  /// Known bends: see AprilTagOptions::bends_px.
  std::optional<std::array<double, 4>> bends_px;
};

/// `grey`: one channel. `border`: width of the uniform rings inside and outside the sides, relative
/// to the side. Returns false if a side is too short, has too little contrast, or leaves the image.
bool refine_corners(const Image& grey, double border, TagCorners& corners);

}  // namespace occ::internal::landmarks
