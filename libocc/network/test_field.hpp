// SPDX-License-Identifier: Apache-2.0
// A test field that exists on paper only: targets on the walls and the ceiling of a room, stations
// in it, a camera. From it a network with noise, its truth, and what precision to expect before any
// picture is taken (precision.hpp of the truth). Use it to decide how many stations and targets are
// enough, and what the scale shall come from.
//
// Stations: one near the middle, the others around it on an ellipse of `station_ring` of the room's
// half sides, at heights that alternate by `station_height_step_m`, each turned and tilted a little
// (self-calibration wants that). Targets are drawn evenly over the surfaces; one is seen where the
// camera shows it, at least 0.5 m away.
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

struct TestFieldDesign {
  Eigen::Vector3d room_m{16, 12, 4};
  int stations = 5;
  double station_height_m = 1.7;
  double station_height_step_m = 1;
  Eigen::Vector2d station_ring{0.7, 0.7};
  double station_tilt_rad = 0.075;  ///< without it the camera constant and heights are one
  int targets = 500;                ///< points
  double lowest_target_m = 0.2;
  bool ceiling = true;
  int tags = 0;  ///< AprilTags besides, on the walls
  double tag_side_m = 0.15;
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  std::vector<std::string> free_parameters;
  Eigen::Vector2d sigma_px{0.5, 0.5};
  double start_error_m =
      0.05;  ///< of the network's starts: points, stations; 0.01 rad for each 0.05
  std::uint64_t seed = 1;

  LIBOCC_API void validate() const;
};

/// The panorama camera of the table that the default design reproduces: 35 mm lens, 10 200 pixels
/// of 8 um, columns of 0.2 mrad.
LIBOCC_API Camera paper_panorama_camera();
/// Its nine additional parameters: all but ez and the tumbling.
LIBOCC_API std::vector<std::string> paper_additional_parameters();

struct TestField {
  Network network;  ///< noisy pixels, starts that are off, the camera as in the design
  Network truth;    ///< the same without any error
};

/// Throws std::invalid_argument for a design that makes no sense.
LIBOCC_API TestField simulate_test_field(const TestFieldDesign& design);

/// The truth with other noise: a run of a Monte Carlo experiment.
LIBOCC_API Network noisy_network(const Network& truth, std::uint64_t seed, double start_error_m);

/// What could give a network its scale.
struct ScaleSource {
  std::string name;
  int bars = 0;
  double bar_m = 2, bar_sigma_m = 2e-5;  ///< each between two targets of its own, mid-field
  int distances = 0;
  double distance_m = 10, distance_sigma_m = 2e-4;  ///< between targets as far apart as that
  int tags = 0;
  double tag_side_m = 0.15;
};

struct ScalePrediction {
  std::string name;
  double scale_sigma = 0;    ///< relative
  double point_sigma_m = 0;  ///< root mean square of the points' 3D sigma
  double at_10_m_sigma_m =
      0;  ///< of the distance of the two targets whose distance is nearest 10 m
};

/// "Which scale bar is enough?": the same field with each source.
LIBOCC_API Result<std::vector<ScalePrediction>> compare_scale(
    const TestFieldDesign& design, const std::vector<ScaleSource>& sources);

}  // namespace occ
