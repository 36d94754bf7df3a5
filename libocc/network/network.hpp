// SPDX-License-Identifier: Apache-2.0
// A photogrammetric network as data: cameras, stations, points, rigid bodies, and their
// observations. A point X of the world has the image
//
//     pixel = camera.project( cam_from_station * station_from_world * X )
//
// where `cam_from_station` is the mount of a camera on a rig (the same for all its images), or the
// identity. A body is a set of points of known shape, for example the corners of an AprilTag or a
// chessboard: X = world_from_body * (scale * corner). A point may be the centre of a flat outline,
// such as the rim of a lamp, whose orientation and size are unknown. Poses, positions and
// parameters are start values for adjust(), which may be rough. Elements that are `fixed` are
// error-free. All lengths have the same unit (metres); the world's origin is arbitrary.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// A camera model, shared by all images that were taken with it.
struct NetworkCamera {
  std::string name;  ///< label for messages
  /// Start values of the free parameters, known values of the others.
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  /// Names of the unknown parameters: those of Camera::parameters(), or f_px (see below).
  std::vector<std::string> free_parameters;
  /// Outward displacement of all outlines in its images, such as by a response that is not known,
  /// and its standard deviation about zero. It is unknown if there are outlines; sigma 0: known.
  double outline_growth_px = 0, outline_growth_sigma_px = 0;
};

/// Pose of a camera or a rig. Several images may share a station.
struct NetworkStation {
  std::string name;           ///< label for messages
  Rigid3 station_from_world;  ///< start value; the known pose if fixed
  bool fixed = false;         ///< true: the pose is error-free
};

/// Pose of a camera on its rig.
struct NetworkMount {
  std::string name;         ///< label for messages
  Rigid3 cam_from_station;  ///< start value; the known pose if fixed
  bool fixed = false;       ///< true: the pose is error-free
};

/// An image: a camera at a station.
struct NetworkImage {
  std::string name;             ///< label for messages
  int camera = 0, station = 0;  ///< indices into Network::cameras and Network::stations
  int mount = -1;               ///< -1: the station is the camera pose
};

/// Orientation and size of a flat outline about a point.
struct NetworkOutline {
  Eigen::Matrix3d world_from_outline = Eigen::Matrix3d::Identity();  ///< its z axis is the normal
  Eigen::Vector2d size_m = Eigen::Vector2d::Ones();  ///< along x and y; the radius if round
  /// A disc: both sizes are one unknown, and the rotation about its axis is none.
  bool is_round = false;
};

/// A point of the world.
struct NetworkPoint {
  std::string name;  ///< label for messages
  /// Start value; the known position if fixed.
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  bool fixed = false;  ///< true: the position is error-free
  /// Start values of an outline about the point, for OutlineObservation.
  std::optional<NetworkOutline> outline = {};
};

/// Points of known shape with an unknown pose, such as a tag.
struct NetworkBody {
  std::string name;            ///< label for messages
  Eigen::Matrix3Xd corners_m;  ///< 3 x n, in the body's frame
  Rigid3 world_from_body;      ///< start value; the known pose if fixed
  double scale = 1;            ///< factor on corners_m; start value if scale_free
  bool scale_free = false;     ///< only its shape is known, not its size
  bool fixed = false;          ///< true: pose and scale are error-free
};

/// A point of the network, or a corner of a body.
struct Target {
  int point = -1;  ///< index into Network::points; -1: a corner of a body
  /// Index into Network::bodies, and column of its corners_m; body is -1 for a point.
  int body = -1, corner = 0;

  /// Target for an index into Network::points.
  static Target of_point(int point) { return {point, -1, 0}; }
  /// Target for a corner of a body.
  static Target of_corner(int body, int corner) { return {-1, body, corner}; }
  /// True if both refer to the same point or corner.
  bool operator==(const Target& other) const {
    return point == other.point && body == other.body && corner == other.corner;
  }
};

/// Measured position of a target in an image.
struct ImageObservation {
  int image = 0;  ///< index into Network::images
  Target target;  ///< observed point or corner
  /// [px]; (0, 0) is the centre of the first pixel.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  /// Standard deviations in x and y, positive.
  Eigen::Vector2d sigma_px = Eigen::Vector2d::Constant(0.5);
  bool used = true;  ///< false: rejected; it stays in the list so that indices remain valid
};

/// Measured outline of a point, without the place of its centre, linearised. With the rotation R
/// from the outline's to the camera's frame, the centre t in the camera's frame [m], the sizes a
/// and b [m], s = sqrt(a b), the growth g [px], the camera's parameters c, and the index 0 for the
/// values of the reference, the unknowns are
///
///     u = (log(R R0^T), t s0 / s - t0, ln(a / b) - ln(a0 / b0), g),  v = c - c0,
///
/// and rows u + by_camera v + constant has zero mean and unit covariance. The observed centre, such
/// as that of an ellipse, is displaced by centre_rows u from the projection of the point. R R0^T is
/// the smallest rotation between the normals for a round outline. The network's scale has no
/// influence. Outlines of fixed points are not used.
struct OutlineObservation {
  /// Index into Network::observations of the centre of the outline. The outline is used while that
  /// is, and has its robust weight.
  int observation = 0;
  Rigid3 cam_from_outline;                           ///< reference: R0 and t0
  Eigen::Vector2d size_m = Eigen::Vector2d::Ones();  ///< reference: a0 and b0
  Eigen::Matrix<double, Eigen::Dynamic, 8> rows;     ///< n x 8
  Eigen::Matrix<double, 2, 8> centre_rows = Eigen::Matrix<double, 2, 8>::Zero();  ///< [px]
  Eigen::MatrixXd by_camera;  ///< n x number of Camera::parameters(); empty if none of them is free
  Eigen::VectorXd camera_parameters;  ///< reference: c0; empty as by_camera
  Eigen::VectorXd constant;           ///< n
};

/// Measured distance of two targets, for example a scale bar.
struct DistanceObservation {
  Target from, to;                      ///< both ends
  double length_m = 1, sigma_m = 1e-3;  ///< distance and its standard deviation
  bool used = true;                     ///< false: rejected
};

/// Target with known coordinates.
struct ControlPoint {
  Target target;                                                ///< a point or a corner
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();         ///< known position in the world
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< positive definite
  bool used = true;                                             ///< false: rejected
};

/// Known value of a free camera parameter.
struct ParameterPrior {
  int camera = 0;               ///< index into Network::cameras
  std::string parameter;        ///< name in Camera::parameters()
  double value = 0, sigma = 1;  ///< value and standard deviation, in the parameter's unit
};

/// Known pose of a station, with the covariance of its left perturbation (geometry/rigid.hpp).
struct PosePrior {
  int station = 0;                           ///< index into Network::stations
  Rigid3 station_from_world;                 ///< known pose
  Matrix6 covariance = Matrix6::Identity();  ///< positive definite
};

/// Elements and observations; elements refer to one another by index.
struct Network {
  std::vector<NetworkCamera> cameras;            ///< camera models
  std::vector<NetworkStation> stations;          ///< poses of cameras or rigs
  std::vector<NetworkMount> mounts;              ///< poses of cameras on rigs; empty without rigs
  std::vector<NetworkImage> images;              ///< camera and station of each image
  std::vector<NetworkPoint> points;              ///< single points
  std::vector<NetworkBody> bodies;               ///< rigid groups of points
  std::vector<ImageObservation> observations;    ///< image points
  std::vector<OutlineObservation> outlines;      ///< outlines about image points
  std::vector<DistanceObservation> distances;    ///< measured distances
  std::vector<ControlPoint> control;             ///< points with known coordinates
  std::vector<ParameterPrior> parameter_priors;  ///< known camera parameters
  std::vector<PosePrior> pose_priors;            ///< known station poses

  /// Position of a point or corner. Throws std::invalid_argument for an invalid target.
  LIBOCC_API Eigen::Vector3d position_m(const Target& target) const;
  /// Pose of an image's camera: mount times station. Throws std::invalid_argument for an unknown
  /// image.
  LIBOCC_API Rigid3 cam_from_world(int image) const;
  /// Name of a point, or of a body with the corner's number: "tag 7.2".
  LIBOCC_API std::string name_of(const Target& target) const;
  /// Adds an image and a station of its own with the same name; returns the image's index.
  LIBOCC_API int add_image(const std::string& name, int camera, const Rigid3& cam_from_world);
};

/// Name, unit and value of a free parameter: one of Camera::parameters(), or f_px
/// (common_focal_length, which excludes fx_px and fy_px) for cameras with these. Throws
/// std::invalid_argument for another name.
LIBOCC_API CameraParameter free_parameter(const Camera& camera, const std::string& name);

/// Camera with another value of a free parameter; f_px keeps the ratio of fx_px and fy_px. Throws
/// std::invalid_argument for another name, and for values that are not allowed.
LIBOCC_API Camera with_free_parameter(const Camera& camera, const std::string& name, double value);

/// Derivatives of Camera::parameters() (rows) by free parameters (columns): unit vectors; f_px has
/// 1 for fx_px and fy_px / fx_px for fy_px. With the covariance C of the free parameters, D C D^T
/// is Camera::parameter_covariance(). Throws as free_parameter().
LIBOCC_API Eigen::MatrixXd free_parameter_directions(const Camera& camera,
                                                     const std::vector<std::string>& names);

/// Throws std::invalid_argument naming the element: an index out of range, a name that is not a
/// parameter of its camera, a sigma that is not positive, a number that is not finite, a covariance
/// that is not positive definite, a body without corners, an observed outline of a point without
/// one.
LIBOCC_API void check_network(const Network& network);

}  // namespace occ
