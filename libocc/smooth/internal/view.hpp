// SPDX-License-Identifier: Apache-2.0
// Sightings of one frame with the errors that are stated for it. At each pose the errors take their
// most likely values, so that the frame's cost is
//     min_e  sum_i rho(|r_i(pose, e)|^2) + |e|^2 / 2.
// The errors of the points concern one sighting each; those of camera, mount and clock concern all.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/common_errors.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ::internal::smooth {

/// Stated errors of a frame, as multiples of their standard deviations.
struct ViewErrors {
  std::vector<Eigen::Matrix3d> point_roots;  ///< S^T S: covariance of each point; empty: all exact
  Eigen::MatrixXd camera_root;               ///< R R^T: covariance of the camera's parameters
  Vector6 mount_sigmas = Vector6::Zero();
  double clock_sigma_s = 0;
  std::vector<int> shared_numbers;  ///< camera, mount, clock
  std::vector<int> point_numbers;   ///< three of each sighting

  bool empty() const { return shared_numbers.empty() && point_numbers.empty(); }
};

struct View {
  SmootherFrame frame;
  std::vector<Eigen::Matrix2d> root;  ///< L^-1 of each sighting's covariance L L^T
  std::vector<bool> aside;            ///< outside the camera's domain at the current pose
  Matrix6 d_body;                     ///< adjoint(cam_from_body)
  ViewErrors errors;
  Vector6 velocity = Vector6::Zero();  ///< for the clock, body_from_world [rad/s, m/s]
  /// R^T R: covariance of the velocity. The shift by a late clock in an unknown velocity is an
  /// error of this frame alone.
  Matrix6 velocity_root = Matrix6::Zero();
  std::vector<Eigen::Matrix<double, 2, Eigen::Dynamic>>
      by_camera;  ///< d residual / d (errors of the camera), at a pose

  View(const SmootherFrame& seen, const SmootherOptions& options, ErrorNumbers& numbers);

  /// Marks the sightings outside the domain at this pose as aside, and linearises the others in the
  /// camera's parameters; returns true if any mark changed.
  bool set_aside(const Rigid3& body_from_world);
};

/// Residual of a sighting in sigmas, all values exact; empty outside the camera's domain.
std::optional<Eigen::Vector2d> sighting_residual(const View& view, std::size_t i,
                                                 const Rigid3& body_from_world,
                                                 Eigen::Matrix<double, 2, 6>* d_body = nullptr);

/// Cost of a view whose errors are not all exact.
struct ViewFit {
  double cost = 0;  ///< infinite if a sighting that is not aside is outside the domain
  std::vector<std::optional<Eigen::Vector2d>> residuals;  ///< in sigmas; empty if aside
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
};
ViewFit fitted_errors(const View& view, const Rigid3& body_from_world, double corner);
CommonErrors<6> common_errors_of(const View& view, const Rigid3& body_from_world, double corner);

/// Residual of each sighting in sigmas with the most likely errors; empty outside the domain.
std::vector<std::optional<Eigen::Vector2d>> residuals_of(const View& view,
                                                         const Rigid3& body_from_world,
                                                         double corner);

}  // namespace occ::internal::smooth
