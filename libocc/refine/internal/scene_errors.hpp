// SPDX-License-Identifier: Apache-2.0
// Errors of the scene that its author states: position, size and tilt of each lamp, parameters of
// the camera. They are unknowns of the refinement with priors: those of a lamp are eliminated with
// the lamp's observations, those of the camera with all observations (lamp_rim.hpp, problem.hpp).
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

/// Standard deviations of the errors of one lamp.
struct LampErrors {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< along the axes of the world
  double size = 0;                                       ///< relative
  double tilt_rad = 0;                                   ///< about each axis

  /// Error from independent ones of unit variance.
  LampError scaled(const LampError& unit) const;
};

/// Empty if the lamp is exact.
LIBOCC_API std::optional<LampErrors> errors_of(const Lamp& lamp, const Scene& scene);

/// True if all lamps are exact.
LIBOCC_API bool has_exact_map(const Scene& scene);

/// The lamp with an error.
LIBOCC_API LampInCam with_error(LampInCam lamp, const LampError& error,
                                const Rigid3& cam_from_world);

/// d (rotation of the lamp about its centre, shift of its centre), camera frame, / d independent
/// errors of unit variance. A lamp that is larger by the fraction e has the image of the lamp
/// shifted by -e times its centre. `size_error`: contained in `lamp`.
LIBOCC_API Eigen::Matrix<double, 6, 7> unit_motion(const LampErrors& errors, const LampInCam& lamp,
                                                   double size_error, const Rigid3& cam_from_world);

/// Errors of the camera's parameters as independent unknowns of unit variance.
class LIBOCC_API CameraErrors {
 public:
  CameraErrors() = default;
  explicit CameraErrors(const Camera& camera);

  Eigen::Index count() const { return root_.cols(); }  ///< 0 if the camera is exact
  /// Camera with the parameters changed by these errors.
  Camera camera(const Camera& stated, const Eigen::VectorXd& errors) const;
  /// d pixel / d errors (2 x count) at a point in the camera's frame; zero outside the domain.
  Eigen::Matrix2Xd by_errors(const Camera& camera, const Eigen::Vector3d& point) const;

 private:
  Eigen::MatrixXd root_;  // d parameters / d errors
};

/// Covariance [px^2] of the image of a lamp by the errors of the lamp.
LIBOCC_API Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Camera& camera,
                                                const std::optional<LampErrors>& errors);

/// Covariance [px^2] of the image of a lamp by the errors of the lamp and of the camera.
LIBOCC_API Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Scene& scene);

}  // namespace occ::internal::refine
