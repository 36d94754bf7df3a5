// SPDX-License-Identifier: Apache-2.0
// An object as a set of points that are detectable in an image: the lamps of a car, a beacon on a
// machine, corners of a body. Data only. Each point is visible from inside a cone about its normal.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// A detectable point of an object.
struct LIBOCC_API ObjectPoint {
  int id = 0;                                            ///< unique in the object
  std::string label;                                     ///< optional label
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the object's frame
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< axis of the cone; unit after validate()
  double cone_rad = 1.5707963267948966;  ///< half angle of the cone of visibility, in (0, pi];
                                         ///< pi/2: a half space, pi: all directions
  double radius_m = 0;                   ///< radius of a disc across the normal; 0: a point

  /// Returns true if a camera at this position (object's frame) is inside the cone.
  bool seen_from(const Eigen::Vector3d& camera_position) const;
};

/// A rigid set of detectable points.
struct LIBOCC_API Object {
  std::string name;                 ///< not empty
  std::vector<ObjectPoint> points;  ///< 1 to 1000

  /// Checks all fields and makes the normals unit. A second call changes nothing. Throws
  /// std::invalid_argument naming the point, the field and its value for an empty name, no points
  /// or more than 1000, two points with one id or at one place, and numbers out of range.
  void validate();
};

/// Version of the object schema that this library writes; it reads this version and earlier ones.
inline constexpr int object_schema_version = 1;

/// Reads an object. Throws std::runtime_error "FILE:LINE: key `points[2].cone_deg`: must be in (0,
/// 180], got 200".
LIBOCC_API Object read_object(const std::string& path);

/// Reads an object from text; messages use `name` in place of a file name.
LIBOCC_API Object parse_object(const std::string& text, const std::string& name = "<text>");

/// Text that parse_object reads back to an equal object.
LIBOCC_API std::string format_object(const Object& object);

/// Writes the file completely or leaves it unchanged. Throws std::runtime_error naming the file.
LIBOCC_API void write_object(const std::string& path, const Object& object);

}  // namespace occ
