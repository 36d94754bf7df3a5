// SPDX-License-Identifier: Apache-2.0
// An object by the points of it that can be found in an image: the lamps of a car, a beacon on a
// machine, corners of a body. Data only. Each point is seen from within a cone about its normal.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

struct LIBOCC_API ObjectPoint {
  int id = 0;
  std::string label;                                     ///< optional, for people
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the object's frame
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< axis of the cone; unit after validate()
  double cone_rad = 1.5707963267948966;  ///< half angle of the cone from within which it is seen,
                                         ///< in (0, pi]; pi/2: the half space, pi: from everywhere
  double radius_m = 0;                   ///< of a disc across the normal; 0: a point

  bool seen_from(const Eigen::Vector3d& camera_position) const;  ///< in the object's frame
};

struct LIBOCC_API Object {
  std::string name;
  std::vector<ObjectPoint> points;

  /// Makes normals unit. A second call changes nothing. Throws std::invalid_argument naming the
  /// point, the field and its value: an empty name, no points or more than 1000, an id of two
  /// points, points at one place, numbers out of range.
  void validate();
};

/// Version of the object schema this library writes; it reads this and earlier ones.
inline constexpr int object_schema_version = 1;

/// Reads an object. Throws std::runtime_error "FILE:LINE: key `points[2].cone_deg`: must be in (0,
/// 180], got 200".
LIBOCC_API Object read_object(const std::string& path);

/// The same from text; `name` stands for the file in messages.
LIBOCC_API Object parse_object(const std::string& text, const std::string& name = "<text>");

/// Text that parse_object reads back to an equal object.
LIBOCC_API std::string format_object(const Object& object);

/// Writes whole or not at all. Throws std::runtime_error naming the file.
LIBOCC_API void write_object(const std::string& path, const Object& object);

}  // namespace occ
