// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/object.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

constexpr std::size_t max_points = 1000;  // check_places() takes quadratic time

void validate_point(ObjectPoint& p) {
  check_fields(p, object_point_fields, [&] { return "point " + std::to_string(p.id) + ": "; });
  const double excess = std::abs(p.normal.squaredNorm() - 1);
  if (excess > 8 * std::numeric_limits<double>::epsilon()) p.normal.stableNormalize();
}

// Points at one place have one image, so their correspondences would be ambiguous.
void check_places(const std::vector<ObjectPoint>& points) {
  double size_m = 0;
  for (const ObjectPoint& p : points)
    size_m = std::max(size_m, (p.position_m - points.front().position_m).norm());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (!((points[i].position_m - points[j].position_m).norm() > 1e-9 * size_m))
        require(false, "point " + std::to_string(points[i].id) + ": position_m",
                vector_text(points[i].position_m),
                "different from that of point " + std::to_string(points[j].id));
}

}  // namespace

bool ObjectPoint::seen_from(const Eigen::Vector3d& camera_position) const {
  const Eigen::Vector3d to_camera = camera_position - position_m;
  return std::atan2(normal.cross(to_camera).norm(), normal.dot(to_camera)) <= cone_rad;
}

void Object::validate() {
  require(!name.empty(), "name", "nothing", "a word");
  require(!points.empty() && points.size() <= max_points, "points' number", points.size(),
          "1 to 1000");
  std::map<int, std::size_t> ids;
  for (ObjectPoint& point : points) {
    validate_point(point);
    require(ids.emplace(point.id, ids.size()).second, "points: id", point.id, "unique");
  }
  check_places(points);
}

}  // namespace occ
