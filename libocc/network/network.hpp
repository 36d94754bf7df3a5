// SPDX-License-Identifier: Apache-2.0
// A photogrammetric network as data: cameras, where they stood, the points and rigid bodies that
// they saw, and whatever else is known. A point X of the world appears at
//
//     pixel = camera.project( cam_from_station * station_from_world * X )
//
// with `cam_from_station` the mount of a camera on a rig (one for all its images), or nothing. A
// body is a set of points of known shape, for example the corners of an AprilTag or a chessboard:
// X = world_from_body * (scale * corner). Starts need not be good (adjust.hpp); what is `fixed` is
// known without error. All lengths in the same unit (metres), at any place of the world.
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
  Camera camera;
  std::vector<std::string> free_parameters;  ///< names of those that are unknown
};

/// Where a camera or a rig stood. Several images may be taken from one station.
struct NetworkStation {
  std::string name;
  Rigid3 station_from_world;
  bool fixed = false;
};

struct NetworkMount {
  std::string name;
  Rigid3 cam_from_station;
  bool fixed = false;
};

struct NetworkImage {
  std::string name;
  int camera = 0, station = 0;
  int mount = -1;  ///< -1: the station is the camera itself
};

struct NetworkPoint {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  bool fixed = false;
};

struct NetworkBody {
  std::string name;
  Eigen::Matrix3Xd corners_m;  ///< in the body's frame
  Rigid3 world_from_body;
  double scale = 1;
  bool scale_free = false;  ///< its shape is known, its size is not
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
  bool used = true;  ///< false: a gross error, kept in the list to be named
};

struct DistanceObservation {
  Target from, to;
  double length_m = 1, sigma_m = 1e-3;
  bool used = true;
};

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

/// Of a station: covariance of its pose's left perturbation (geometry/rigid.hpp).
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

  /// Where a point or corner is. Throws std::invalid_argument when there is none such.
  LIBOCC_API Eigen::Vector3d position_m(const Target& target) const;
  LIBOCC_API Rigid3 cam_from_world(int image) const;
  /// Its name, a corner's with its number: "tag 7.2".
  LIBOCC_API std::string name_of(const Target& target) const;
  /// An image from a station of its own, with the same name; returns its index.
  LIBOCC_API int add_image(const std::string& name, int camera, const Rigid3& cam_from_world);
};

/// Throws std::invalid_argument that names what is wrong: an index without its thing, a name that
/// is no parameter of its camera, a sigma that is not positive, a number that is not finite, a
/// covariance that is not positive definite, a body without corners.
LIBOCC_API void check_network(const Network& network);

}  // namespace occ
