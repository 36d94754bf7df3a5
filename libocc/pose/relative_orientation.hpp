// SPDX-License-Identifier: Apache-2.0
// Relative orientation of two images from common points, without a map.
//
// The essential matrix follows from five pairs of bearings: Stewenius, Engels, Nister, "Recent
// developments on direct relative orientation", ISPRS Journal 60(4), 2006. In the null space
// x E_0 + y E_1 + z E_2 + E_3 of the epipolar conditions, ten cubic equations hold; x is an
// eigenvalue of the action matrix of the multiplication by x. Random samples of five pairs are
// scored by their median epipolar error, as up to a third of the pairs may be gross errors.
//
// Four points of a plane determine the homography H = R + t n^T / d between both images, which has
// two decompositions: Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision", Springer 2004,
// section 5.3.3.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Pose of the second image in the frame of the first.
struct RelativePose {
  Rigid3 second_from_first;  ///< the distance between both projection centres is 1
  double error_rad = 0;      ///< median angle between a bearing and its epipolar plane
  /// Points in front of both images whose rays meet at 2 degrees or more.
  int intersected = 0;
  double angle_rad = 0;  ///< median angle between the rays of the points in front of both images
};

/// Essential matrices E with b^T E a = 0 for five pairs of bearings, 3 x 5; up to ten, each of norm
/// 1. Throws std::invalid_argument for another size.
LIBOCC_API std::vector<Eigen::Matrix3d> essential_matrices(const Eigen::Matrix3Xd& first,
                                                           const Eigen::Matrix3Xd& second);

/// Poses of two images from four or more points of a plane, up to two. first, second: unit
/// bearings, 3 x n. Empty if they do not determine a homography, or if the images are only turned.
/// Throws std::invalid_argument if the sizes differ or n is below 4.
LIBOCC_API std::vector<RelativePose> planar_orientations(const Eigen::Matrix3Xd& first,
                                                         const Eigen::Matrix3Xd& second);

/// Poses of two images from common points, best first. first, second: unit bearings, 3 x n. Points
/// of a plane may have two poses. Four points are assumed to be in a plane; with five, the results
/// are those of a plane and all poses of the essential matrices, which further images must tell
/// apart. Empty with fewer than four points, or if no pose has half of them in front of both
/// images. `seed`: of the samples, if there are more than seven points. Throws
/// std::invalid_argument if the sizes differ.
LIBOCC_API std::vector<RelativePose> relative_orientation(const Eigen::Matrix3Xd& first,
                                                          const Eigen::Matrix3Xd& second,
                                                          std::uint64_t seed = 0);

}  // namespace occ
