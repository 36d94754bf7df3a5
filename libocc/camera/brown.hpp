// SPDX-License-Identifier: Apache-2.0
// Brown's lens distortion in the forms of photogrammetric programs: a polynomial B with balanced
// radial, decentring, and affine terms. With r^2 = x^2 + y^2 and r0, the radius without radial
// correction,
//
//   g    = a1 (r^2 - r0^2) + a2 (r^4 - r0^4) + a3 (r^6 - r0^6)
//   B(x) = x (1 + g) + b1 (r^2 + 2 x^2) + 2 b2 x y + c1 x + c2 y
//   B(y) = y (1 + g) + 2 b1 x y + b2 (r^2 + 2 y^2)
//
// Coordinates x, y are in units of `unit_px` pixels: with the pixels per millimetre, coefficients
// are those of image coordinates in millimetres. With the camera matrix K and s = fx_px / unit_px,
// s K^-1 (u, v) is the measured and s (X / Z, Y / Z) the ideal point. Two forms exist:
//
//   brown_forward    measured = B(ideal): AICON, JAICOV. Pixels have a closed form.
//   brown_backward   ideal = B(measured): Brown, PhotoModeler, DBAT. Rays have a closed form.
//
// The inverse follows by Newton's method; its derivatives by the theorem of implicit functions.
//
// Domain: Z > 0; r below the first radius where r (1 + g) stops growing, and a positive determinant
// of dB / d(x, y).
// Sources: Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971, eqs
// 18-19; r0, c1 and c2: Luhmann, Robson, Kyle, Boehm, "Close-Range Photogrammetry and 3D Imaging",
// 3rd ed., 2019, section 3.3.3.
#pragma once

#include <array>

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Model of a lens; `Camera::brown_forward` and `Camera::brown_backward` create one.
class LIBOCC_API BrownModel final : public CameraModel {
 public:
  /// `kind`: brown_forward or brown_backward. `distortion`: empty, or a1 a2 a3 b1 b2 c1 c2. Throws
  /// std::invalid_argument for another number, for unit_px that is not positive, for a negative r0,
  /// and for coefficients that leave no domain.
  BrownModel(CameraKind kind, int width, int height, const CameraMatrix& matrix,
             const std::vector<double>& distortion, double unit_px, double r0);
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return 5 + static_cast<int>(distortion_.size()); }
  std::vector<CameraParameter> constants() const override;
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  double max_angle_rad() const override;
  double depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const override;
  Pointer without_distortion() const override;

 private:
  using Coefficients = Eigen::Matrix<double, 2, 7>;
  bool is_forward() const { return kind_ == CameraKind::brown_forward; }
  /// B and dB / d(x, y) (may be null), for coordinates on the plane z = 1.
  Eigen::Vector2d polynomial(const Eigen::Vector2d& p, Eigen::Matrix2d* jacobian) const;
  /// dB / d(distortion), for coordinates on the plane z = 1.
  Coefficients by_coefficients(const Eigen::Vector2d& p) const;
  /// Point p of the domain with B(p) = value, or nothing; `jacobian`: of B at p.
  std::optional<Eigen::Vector2d> inverse(const Eigen::Vector2d& value,
                                         Eigen::Matrix2d& jacobian) const;
  bool inside(const Eigen::Vector2d& p, const Eigen::Matrix2d& jacobian) const;
  double radial(double r) const;        // r (1 + g)
  double radial_slope(double r) const;  // d radial / d r

  double unit_px_, r0_;
  // Coefficients for coordinates on the plane z = 1: a1 s^2, a2 s^4, a3 s^6, b1 s, b2 s, c1, c2.
  std::array<double, 7> k_{};
  double centre_;      // 1 + g at r = 0
  double max_radius_;  // on the plane z = 1
};

}  // namespace occ
