// SPDX-License-Identifier: Apache-2.0
// Sizes of lamps before the first adjustment. A view gives a distance in units of the lamp's size
// only. Lamps of one kind, of the same shape and the same ratio of the sides, count as equally
// large. The ratio of the sizes of two kinds follows as if their lamps were in one plane: the
// distance along a ray with the angle a to the plane's normal is proportional to 1 / cos a.
#pragma once

#include <vector>

#include "libocc/survey/internal/lamp_map.hpp"

namespace occ::internal::survey {

/// Size of a lamp in any common unit, with its relative standard deviation.
struct LampSize {
  double size = 1, sigma = 0;
};

/// Ratio of the longer to the shorter side of a rectangle; 1 for a disc.
double aspect_of(const LampShapeView& view);
double aspect_of(const Lamp& lamp);

/// Direction of the longer side of a rectangle; zero for a disc.
Eigen::Vector3d long_side(const LampShapeView& view);
Eigen::Vector3d long_side(const Lamp& lamp);

/// Largest ratio of the aspect ratios of one kind: error of the width of a tube in the image.
constexpr double max_aspect_ratio = 1.15;

/// True if a view may show a lamp of this shape and aspect ratio.
bool is_of_kind(const LampShapeView& view, LampShape shape, double aspect);

/// Lamps of a picture of the same kind and, if `by_plane`, of about the same size in one plane.
struct LampGroups {
  std::vector<int> group_of;       ///< group of each view
  std::vector<double> plane_size;  ///< size of each view, over the distance of the plane
  int count = 0;                   ///< number of groups
};
LampGroups groups_of(const std::vector<LampShapeView>& views, bool by_plane);

/// Sizes of the lamps of a picture, in the unit of the largest group. `spread`: relative standard
/// deviation within a group.
std::vector<LampSize> sizes_of(const std::vector<LampShapeView>& views, const LampGroups& groups,
                               double spread);

/// Size of a further lamp, which a picture with a known pose shows.
LampSize size_of_further_lamp(const LampShapeView& view, const Rigid3& cam_from_map,
                              const std::vector<MapLamp>& lamps, double spread);

}  // namespace occ::internal::survey
