// SPDX-License-Identifier: Apache-2.0
// Start values of poses and points for an adjustment: resection of images and intersection of
// points in turn, from known poses or points, or from images alone.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Pixels of the points in an image, by the number of the point.
using PixelsOfPoints = std::map<int, Eigen::Vector2d>;

/// Approximate poses and positions.
struct PointStarts {
  std::map<int, Rigid3> cam_from_world;     ///< key: index of the image
  std::map<int, Eigen::Vector3d> points_m;  ///< key: number of the point
};

/// Extends known poses and positions: resection of an image with four known points or more, those
/// with most first, and intersection of a point that two images with poses show from directions
/// that differ by 2 degrees or more. Images and points that do not follow are left out. cameras:
/// of each image. Throws std::invalid_argument if the sizes differ.
LIBOCC_API PointStarts start_values(const std::vector<Camera>& cameras,
                                    const std::vector<PixelsOfPoints>& images, PointStarts known);

/// Starts from images alone: relative orientations of two images with many common points and large
/// angles between their rays, then start_values(). The frame is that of one image, with the
/// distance of 1 between both. The results of up to three such pairs, of which each may have
/// several relative orientations (see relative_orientation()): those with most images first, then
/// those with the smallest median errors. Wrong ones must be expected: an adjustment of each
/// decides. Empty if no two images have four common points, seen from different places. Throws
/// std::invalid_argument if the sizes differ.
LIBOCC_API std::vector<PointStarts> free_starts(const std::vector<Camera>& cameras,
                                                const std::vector<PixelsOfPoints>& images);

}  // namespace occ
