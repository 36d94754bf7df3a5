// SPDX-License-Identifier: Apache-2.0
// A network from images of lamps whose names are known, for surveying where they hang: each image
// gets its pose from the lamps whose place is about known, and each other lamp that two images see
// the place where its rays meet. Lamps are points of the network, named "lamp 7", none fixed.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "libocc/calibrate/start_network.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct LampSighting {
  int id = 0;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = 0.01 * Eigen::Matrix2d::Identity();
};

struct SurveyImage {
  std::string name;
  int camera = 0;
  std::vector<LampSighting> lamps;
};

/// lamps_m: about where they are, by id; those not named are found. Status: ok; too_few_lamps:
/// fewer than two images have a pose. Images that see fewer than four lamps of known place, and
/// lamps seen once, are left out with a warning; an id seen twice in an image is left out of it.
/// Throws std::invalid_argument for a bad camera index and values that are not finite.
LIBOCC_API Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                             const std::map<int, Eigen::Vector3d>& lamps_m,
                                             const std::vector<SurveyImage>& images);

/// With the places of a scene's lamps, and their sizes: a sighting, the centre of a lamp's image,
/// is moved to where the lamp's centre is seen (the centre of an ellipse is not that of the disc).
LIBOCC_API Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                             const Scene& scene,
                                             const std::vector<SurveyImage>& images);

}  // namespace occ
