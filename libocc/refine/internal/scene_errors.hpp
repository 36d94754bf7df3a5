// SPDX-License-Identifier: Apache-2.0
// Errors of the scene that its author states: position, size and tilt of each lamp, parameters of
// the camera, errors of the map that lamps share. They are unknowns of the refinement with priors:
// those of a lamp are eliminated with the lamp's observations, shared ones with all observations
// (lamp_rim.hpp, problem.hpp).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Errors of a lamp: rotation about its centre, shift of its centre (both in the frame of the
/// world), relative size.
using LampError = Eigen::Matrix<double, 7, 1>;

/// Standard deviations of the errors that concern one lamp alone.
struct LampErrors {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< along the axes of the world
  double size = 0;                                       ///< relative
  double tilt_rad = 0;                                   ///< about each axis

  /// Error from independent ones of unit variance.
  LampError scaled(const LampError& unit) const;
};

/// Empty if the lamp has no errors of its own.
LIBOCC_API std::optional<LampErrors> errors_of(const Lamp& lamp, const Scene& scene);

/// True if all lamps are exact.
LIBOCC_API bool has_exact_map(const Scene& scene);

/// True if the parameters of the camera have errors, or if lamps share errors.
LIBOCC_API bool has_shared_errors(const Scene& scene);

/// True if camera and map are exact.
LIBOCC_API bool is_exact(const Scene& scene);

/// The lamp with an error.
LIBOCC_API LampInCam with_error(LampInCam lamp, const LampError& error,
                                const Rigid3& cam_from_world);

/// d (rotation of the lamp about its centre, shift of its centre), camera frame, / d independent
/// errors of unit variance. A lamp that is larger by the fraction e has the image of the lamp
/// shifted by -e times its centre. `size_error`: contained in `lamp`.
LIBOCC_API Eigen::Matrix<double, 6, 7> unit_motion(const LampErrors& errors, const LampInCam& lamp,
                                                   double size_error, const Rigid3& cam_from_world);

/// Errors that all lamps share, as independent unknowns of unit variance: those of the camera's
/// parameters, then Lamp::shared_errors_m, then that of the map's scale.
class LIBOCC_API SharedErrors {
 public:
  SharedErrors() = default;
  explicit SharedErrors(const Scene& scene);

  Eigen::Index count() const { return root_.cols() + map_count_; }
  Eigen::Index camera_count() const { return root_.cols(); }
  /// Gives the scene, a copy of the stated one, the camera and the lamps with these errors. Throws
  /// std::invalid_argument if that is no camera.
  void apply(const Scene& stated, const Eigen::VectorXd& errors, Scene& scene) const;

  /// d pixel / d errors of the camera at a point in its frame; zero outside the domain.
  Eigen::Matrix2Xd by_camera(const Camera& camera, const Eigen::Vector3d& point) const;
  /// d position of the lamp, camera frame, / d errors of the map. A lamp that is larger by the
  /// fraction e has the image of the lamp shifted by -e times its centre: an error of the scale,
  /// which is in the sizes as well, shifts all lamps alike.
  Eigen::Matrix3Xd motion(const Lamp& lamp, const Rigid3& cam_from_world) const;
  /// d pixel of the lamp / d errors (2 x count), with d pixel / d shift of the lamp in the frame of
  /// the camera; zero outside the domain.
  Eigen::Matrix2Xd by_errors(const Camera& camera, const Lamp& lamp, const Rigid3& cam_from_world,
                             const Eigen::Matrix<double, 2, 3>& by_shift) const;

 private:
  Eigen::MatrixXd root_;  // d parameters / d errors
  Eigen::Index map_count_ = 0;
  double scale_sigma_ = 0;                              // if positive, the last error of the map
  Eigen::Vector3d middle_m_ = Eigen::Vector3d::Zero();  // fixed under errors of the scale
};

/// Covariance [px^2] of the image of a lamp by its own errors.
LIBOCC_API Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Camera& camera,
                                                const std::optional<LampErrors>& errors);

/// Covariance [px^2] of the image of a lamp by its own errors and the shared ones.
LIBOCC_API Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Scene& scene);

}  // namespace occ::internal::refine
