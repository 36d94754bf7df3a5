// SPDX-License-Identifier: Apache-2.0
// A scene seen from a pose, as the bounds of effects need it: where each lamp's image is, how large
// and how bright.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::internal::simulate {

struct LampView {
  const Lamp* lamp = nullptr;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< projection of the lamp's centre
  Eigen::Vector2d image_centre_px = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> rim_px;  ///< empty for a point
  double radius_px = 0;                 ///< of the circle about image_centre_px around the image
  double electrons = 0;                 ///< of the whole image while lit
  double full_e = 0;                    ///< no pixel inside an extended lamp's image gets more
  double peak_e = 0;                    ///< no pixel gets more, blur considered
  double distance_m = 0;
};

struct SceneView {
  const Scene& scene;
  const Rigid3& cam_from_world;
  const SimulateOptions& options;
  std::vector<LampView> lamps;  ///< those that can be rendered and reach the sensor

  /// Irradiance of the brightest point of the room's surfaces, once some bound has asked for it.
  mutable std::optional<double> brightest_wall_w_m2 = {};

  /// Grey levels of a change in electrons, wherever the response is steepest.
  double grey_levels(double electrons) const;
};

SceneView make_view(const Scene& scene, const Rigid3& cam_from_world,
                    const SimulateOptions& options);

}  // namespace occ::internal::simulate
