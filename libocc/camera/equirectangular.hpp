// SPDX-License-Identifier: Apache-2.0
// Equirectangular panorama: columns are longitudes, rows are latitudes,
//
//   theta = atan2(X, Z),  phi = atan2(Y, hypot(X, Z))
//   u = cx_px + theta / angle_per_px_rad,  v = cy_px + fy_px phi
//
// with x right, y down and z forward, as for a camera with a lens: z has the middle column of a
// full panorama. The image repeats after period_px = 2 pi / angle_per_px_rad columns; columns are
// counted from the seam, by default the left edge of the first pixel.
//
// Domain: all directions except the poles, where the longitude is undefined; rows within a quarter
// of a turn of the horizon.
// Source: Snyder, "Map projections: a working manual", USGS Professional Paper 1395, 1987, section
// 12, eqs 12-1 and 12-2, with the standard parallel at the equator.
#pragma once

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Model of a full panorama; `Camera::equirectangular` creates one.
class LIBOCC_API EquirectangularModel final : public CameraModel {
 public:
  /// `seam`: first column [px]. Throws std::invalid_argument unless angle_per_px_rad is in
  /// (0, pi/2), fy_px positive and every number finite.
  EquirectangularModel(int width, int height, double angle_per_px_rad, double fy_px, double cx_px,
                       double cy_px, double seam);
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return 4; }
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  double max_angle_rad() const override;
  Pointer with_seam_at(double column) const override;

 private:
  double angle_per_px_rad_, seam_;
};

}  // namespace occ
