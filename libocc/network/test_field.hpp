// SPDX-License-Identifier: Apache-2.0
// Simulated test field for network design: targets on the walls and the ceiling of a room, stations
// in it, and a camera. It yields a noisy network, its exact version, and the expected precision
// before any image is taken (precision() of the exact network). Use it to choose the number of
// stations and targets, and the source of the scale.
//
// One station is in the middle of the room; the others are on an ellipse around it with semi-axes
// `station_ring` times the room's half sides. Their heights alternate by `station_height_step_m`.
// Headings are random, and each station is tilted at random, which self-calibration requires.
// Targets are uniformly distributed over the surfaces. A target is observed if it is in view and at
// least 0.5 m away.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/network.hpp"

namespace occ {

/// Design of a test field; the default reproduces a published precision table.
struct TestFieldDesign {
  Eigen::Vector3d room_m{16, 12, 4};       ///< length, width and height; a corner is at the origin
  int stations = 5;                        ///< number of stations, one in the middle of the room
  double station_height_m = 1.7;           ///< mean height above the floor
  double station_height_step_m = 1;        ///< difference between neighbouring stations
  Eigen::Vector2d station_ring{0.7, 0.7};  ///< semi-axes over half sides of the room, 0 to 1
  double station_tilt_rad = 0.075;  ///< 0: the camera constant and the heights are inseparable
  int targets = 500;                ///< number of points
  double lowest_target_m = 0.2;     ///< lower limit of targets above the floor
  bool ceiling = true;              ///< targets on the ceiling, too
  int tags = 0;                     ///< number of additional AprilTags, on the walls
  double tag_side_m = 0.15;         ///< side of a tag's black square
  /// Camera of all images, true values.
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  std::vector<std::string> free_parameters;  ///< names of the unknown parameters
  Eigen::Vector2d sigma_px{0.5, 0.5};        ///< noise of the image points in x and y
  /// Standard deviation of the start values: points, stations, bodies; rotations 0.2 rad/m of it.
  double start_error_m = 0.05;
  std::uint64_t seed = 1;  ///< equal seeds give equal fields

  LIBOCC_API void validate() const;  ///< throws std::invalid_argument naming field and value
};

/// Panorama camera of the published precision table that the default design reproduces: 35 mm lens,
/// 10 200 pixels of 8 um, columns of 0.2 mrad.
LIBOCC_API Camera paper_panorama_camera();
/// Its nine additional parameters: all except e_z and the tumbling.
LIBOCC_API std::vector<std::string> paper_additional_parameters();

/// A simulated network with its truth.
struct TestField {
  Network network;  ///< noisy pixels and start values; camera as in the design
  Network truth;    ///< network without errors
};

/// Throws std::invalid_argument for an invalid design.
LIBOCC_API TestField simulate_test_field(const TestFieldDesign& design);

/// Source of a network's scale.
struct ScaleSource {
  std::string name;                                 ///< label of the result
  int bars = 0;                                     ///< number of scale bars
  double bar_m = 2, bar_sigma_m = 2e-5;             ///< each with two targets of its own, mid-room
  int distances = 0;                                ///< number of measured distances
  double distance_m = 10, distance_sigma_m = 2e-4;  ///< between targets about this far apart
  int tags = 0;                                     ///< number of AprilTags of known size
  double tag_side_m = 0.15;                         ///< side of a tag's black square
};

/// Precision with one source of scale.
struct ScalePrediction {
  std::string name;            ///< label of the source
  double scale_sigma = 0;      ///< relative
  double point_sigma_m = 0;    ///< root mean square of the points' 3D standard deviation
  double at_10_m_sigma_m = 0;  ///< sigma of the distance between two targets about 10 m apart
};

/// Predicts the precision of the same field with each source. Status: that of precision().
LIBOCC_API Result<std::vector<ScalePrediction>> compare_scale(
    const TestFieldDesign& design, const std::vector<ScaleSource>& sources);

}  // namespace occ
