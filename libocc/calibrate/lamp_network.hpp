// SPDX-License-Identifier: Apache-2.0
// Network for surveying lamps, from images of lamps with known ids. Each image gets its pose by
// resection from the lamps with approximately known positions. Each other lamp that two images
// observe gets the intersection of its rays. Lamps are points of the network, named "lamp 7"; none
// is fixed.
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

/// Image point of a lamp.
struct SurveyObservation {
  int id = 0;                                    ///< id of the lamp
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< centre of the lamp's image
  /// Default: 0.1 px per axis.
  Eigen::Matrix2d covariance_px2 = 0.01 * Eigen::Matrix2d::Identity();
};

/// Observed lamps in one image.
struct SurveyImage {
  std::string name;                      ///< label, used in warnings
  int camera = 0;                        ///< index into the list of cameras
  std::vector<SurveyObservation> lamps;  ///< an id that occurs twice is left out
};

/// lamps_m: approximate positions [m] by id; all other lamps are intersected. Status: ok;
/// too_few_lamps: fewer than two images have a pose. Left out with a warning: images with fewer
/// than four lamps of known position, lamps observed once, and ids that occur twice in one image.
/// Throws std::invalid_argument for a camera index out of range or values that are not finite.
LIBOCC_API Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                             const std::map<int, Eigen::Vector3d>& lamps_m,
                                             const std::vector<SurveyImage>& images);

/// Uses the positions and sizes of a scene's lamps. Each image point, the centre of the lamp's
/// image, is corrected to the projection of the lamp's centre: the centre of a disc's image (an
/// ellipse) is not the image of the disc's centre.
LIBOCC_API Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                             const Scene& scene,
                                             const std::vector<SurveyImage>& images);

}  // namespace occ
