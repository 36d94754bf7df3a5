// SPDX-License-Identifier: Apache-2.0
// An AprilTag as a landmark: its id and its pose. Data only. Seen upright from the front, x points
// right, y points up, and the normal points towards the viewer.
#pragma once

#include <Eigen/Core>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// An AprilTag of known pose and size.
struct LIBOCC_API Tag {
  int id = 0;                       ///< number within its family
  std::string family = "tag36h11";  ///< a name in april_tag_families()
  double size_m = 0;  ///< side of the square whose corners are detected (outside of the border)
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< centre in the world
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();  ///< direction towards the printed side
  Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX();  ///< right on the print; unit after validate()

  /// Pose of the tag's frame: origin at the centre, x along x_axis, z along the normal.
  Rigid3 world_from_tag() const;

  /// Makes normal and x_axis unit and orthogonal. Throws std::invalid_argument naming the tag, the
  /// field and its value.
  void validate();
};

/// Corners of a tag in its own frame [m]; columns: lower left, lower right, upper right, upper
/// left.
LIBOCC_API Eigen::Matrix<double, 3, 4> tag_corners(double size_m);

}  // namespace occ
