// SPDX-License-Identifier: Apache-2.0
// A photogrammetric network as data: cameras, stations, points, rigid bodies, and their
// observations. A point X of the world has the image
//
//     pixel = camera.project( cam_from_station * station_from_world * X )
//
// where `cam_from_station` is the mount of a camera on a rig (the same for all its images), or the
// identity. A body is a set of points of known shape, for example the corners of an AprilTag or a
// chessboard: X = world_from_body * (scale * corner). Poses, positions and parameters are start
// values for adjust(), which may be rough. Elements that are `fixed` are error-free. All lengths
// have the same unit (metres); the world's origin is arbitrary.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

struct NetworkCamera {
  std::string name;
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  std::vector<std::string> free_parameters;  ///< names of the unknown parameters
};

/// Pose of a camera or a rig. Several images may share a station.
struct NetworkStation {
  std::string name;
  Rigid3 station_from_world;
  bool fixed = false;
};

/// Pose of a camera on its rig.
struct NetworkMount {
  std::string name;
  Rigid3 cam_from_station;
  bool fixed = false;
};

struct NetworkImage {
  std::string name;
  int camera = 0, station = 0;
  int mount = -1;  ///< -1: the station is the camera pose
};

struct NetworkPoint {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  bool fixed = false;
};

struct NetworkBody {
  std::string name;
  Eigen::Matrix3Xd corners_m;  ///< 3 x n, in the body's frame
  Rigid3 world_from_body;
  double scale = 1;
  bool scale_free = false;  ///< only its shape is known, not its size
  bool fixed = false;
};

/// A point of the network, or a corner of a body.
struct Target {
  int point = -1;
  int body = -1, corner = 0;

  static Target of_point(int point) { return {point, -1, 0}; }
  static Target of_corner(int body, int corner) { return {-1, body, corner}; }
  bool operator==(const Target& other) const {
    return point == other.point && body == other.body && corner == other.corner;
  }
};

struct ImageObservation {
  int image = 0;
  Target target;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector2d sigma_px = Eigen::Vector2d::Constant(0.5);
  bool used = true;  ///< false: rejected; it stays in the list so that indices remain valid
};

/// Measured distance of two targets, for example a scale bar.
struct DistanceObservation {
  Target from, to;
  double length_m = 1, sigma_m = 1e-3;
  bool used = true;
};

/// Target with known coordinates.
struct ControlPoint {
  Target target;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
};

struct ParameterPrior {
  int camera = 0;
  std::string parameter;
  double value = 0, sigma = 1;
};

/// Known pose of a station, with the covariance of its left perturbation (geometry/rigid.hpp).
struct PosePrior {
  int station = 0;
  Rigid3 station_from_world;
  Matrix6 covariance = Matrix6::Identity();
};

struct Network {
  std::vector<NetworkCamera> cameras;
  std::vector<NetworkStation> stations;
  std::vector<NetworkMount> mounts;
  std::vector<NetworkImage> images;
  std::vector<NetworkPoint> points;
  std::vector<NetworkBody> bodies;
  std::vector<ImageObservation> observations;
  std::vector<DistanceObservation> distances;
  std::vector<ControlPoint> control;
  std::vector<ParameterPrior> parameter_priors;
  std::vector<PosePrior> pose_priors;

  /// Position of a point or corner. Throws std::invalid_argument for an invalid target.
  LIBOCC_API Eigen::Vector3d position_m(const Target& target) const;
  LIBOCC_API Rigid3 cam_from_world(int image) const;
  /// Name of a point, or of a body with the corner's number: "tag 7.2".
  LIBOCC_API std::string name_of(const Target& target) const;
  /// Adds an image and a station of its own with the same name; returns the image's index.
  LIBOCC_API int add_image(const std::string& name, int camera, const Rigid3& cam_from_world);
};

/// Throws std::invalid_argument naming the element: an index out of range, a name that is not a
/// parameter of its camera, a sigma that is not positive, a number that is not finite, a covariance
/// that is not positive definite, a body without corners.
LIBOCC_API void check_network(const Network& network);

}  // namespace occ
