// SPDX-License-Identifier: Apache-2.0
// Internal: sub-pixel measurements of one component: the rim of a disc, or the centre of a spot.
//
// Rim. Where the outline runs within 45 degrees of the rows, each column gives one rim point,
// elsewhere each row does. No pixel contributes to many points, which keeps them independent. The
// signal along such a line is compared with a plateau that ends in a Gaussian edge. The shift of
// the edge is the least-squares solution weighted with the edge's derivative. The weight is even
// and the residual of a wrong blur is odd about the edge. The shift is therefore unbiased for any
// symmetric blur, and close to the minimum variance for the right one.
//
// Spot (too small to have a rim, or any shape symmetric under a rotation by 180 degrees). The model
// is a Gaussian with the spot's own second moments; the centre is the weighted least-squares
// solution of its shift. It is unbiased for any such shape, and reaches the Cramer-Rao bound for a
// Gaussian.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"
#include "libocc/detect/internal/polygon.hpp"

namespace occ::internal::detect {

/// A pixel of this share of full scale counts as clipped.
inline constexpr double clipped_share = 0.97;

/// Response of the points of an over-exposed rim to the lamp's light, see
/// Blob::rim_light_response_px.
struct RimLightResponse {
  double response_px = 0, depth_px = 0;

  /// Moves of the points by a relative gradient of 1 per pixel in x and y.
  std::vector<Eigen::Vector2d> moves(const std::vector<RimPoint>& points,
                                     const Eigen::Vector2d& centre_px) const {
    std::vector<Eigen::Vector2d> out;
    for (const RimPoint& point : points)
      out.push_back(response_px * (point.px - depth_px * point.normal - centre_px));
    return out;
  }
};

struct Rim {
  std::vector<RimPoint> points;
  EllipseFit fit;
  RimErrorCovariance common_covariance_px2 =
      RimErrorCovariance::Zero();                                ///< see Blob::rim_covariance_px2
  Eigen::Matrix2d light_response_px2 = Eigen::Matrix2d::Zero();  ///< see Blob::light_response_px2
  RimLightResponse point_response;                               ///< over-exposed rims only
  double blur_px = 0;   ///< sigma of the edge, pixel box included; 0 when saturated
  bool merged = false;  ///< the outline is not one ellipse; `points` is empty then
};

/// Empty when the blob has no plateau with a rim around it. `blur_px`: initial value of the blur.
std::optional<Rim> measure_rim(const Patch& patch, const Component& component, double blur_px);

/// Measures a disc that is clipped at full scale: the rim at half of full scale, which lies outside
/// the true rim by nearly the same distance all around.
std::optional<Rim> measure_saturated_rim(const Patch& patch, const Component& component);

/// Measures the outer rim of a ring that is so narrow that its level is not known: where the signal
/// falls to `level`, half of its peak. How far outside the true rim that is remains as a common
/// error. `outline`: the ellipse of the crossings of that level.
std::optional<Rim> measure_narrow_ring(const Patch& patch, const FittedConic& outline,
                                       double level);

/// Measures a disc of which something in front hides less than half of the rim: the ellipse through
/// the part of the outline that is visible. Empty if the outline is no such ellipse, or if the
/// border of the image cuts the blob. `blur_px`: initial value of the blur. `clipped`: as for
/// measure_saturated_rim().
std::optional<Rim> measure_rim_in_part(const Patch& patch, const Component& component,
                                       double blur_px, bool clipped);

/// Rim of a lamp with straight sides.
struct PolygonRim {
  Polygon polygon;
  std::vector<RimPoint> points;
  Eigen::Matrix2d centre_covariance_px2 =
      Eigen::Matrix2d::Zero();  ///< covariance of the polygon's centroid
  RimErrorCovariance common_covariance_px2 = RimErrorCovariance::Zero();
  Eigen::Matrix2d light_response_px2 = Eigen::Matrix2d::Zero();
  RimLightResponse point_response;
  bool is_whole = true;  ///< false: a side may lie farther outside by a part of the lamp's size
};

/// Measures a lamp with straight sides. Empty when its outline is no such polygon or when it has no
/// plateau. `blur_px`: initial value of the blur.
std::optional<PolygonRim> measure_polygon(const Patch& patch, const Component& component,
                                          double blur_px);

/// Measures a lamp with straight sides that is clipped at full scale, see measure_saturated_rim().
std::optional<PolygonRim> measure_saturated_polygon(const Patch& patch, const Component& component);

/// Rim of a lamp of any other shape, see free_outline.hpp.
struct FreeRim {
  std::vector<RimPoint> points;                                     ///< away from corners
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();              ///< centroid of the area
  Eigen::Matrix2d centre_covariance_px2 = Eigen::Matrix2d::Zero();  ///< its covariance
  Eigen::Matrix2d second_moments_px2 = Eigen::Matrix2d::Zero();     ///< central ones of the area
  RimErrorCovariance common_covariance_px2 = RimErrorCovariance::Zero();
  Eigen::Matrix2d light_response_px2 = Eigen::Matrix2d::Zero();
  RimLightResponse point_response;
  bool is_convex = true;  ///< false: the blob may be that of several lamps, or of one with hollows
};

/// Measures the outline of a lamp of any shape. Empty when it has no plateau, or too few places
/// with a measurable edge. `blur_px`: initial value of the blur.
std::optional<FreeRim> measure_free_rim(const Patch& patch, const Component& component,
                                        double blur_px);

/// Measures such a lamp that is clipped at full scale, see measure_saturated_rim().
std::optional<FreeRim> measure_saturated_free_rim(const Patch& patch, const Component& component);

/// Sets the normals to those of the ellipse through the points. Those of the pass before differ by
/// its step, which correlates with the noise of the points.
void align_normals(Rim& rim);

/// Inflates the points' sigmas to the observed scatter, which includes deviations of the lamp and
/// the lens from the model.
void inflate_sigmas(Rim& rim);

struct Spot {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d second_moments_px2 =
      Eigen::Matrix2d::Zero();  ///< second central moments of the light, pixel box included
  /// Shift of the centre per relative gradient of brightness over the observed (blurred) light; for
  /// a gradient over the unblurred light it is smaller by the variance of the blur.
  Eigen::Matrix2d gradient_response_px2 = Eigen::Matrix2d::Zero();
};

/// Initial values: a centre accurate to about a pixel and approximate second moments. The second
/// moments stay at least `min_variance_px2` in every direction: otherwise noise could make a faint
/// spot sharper than the lens allows, with too small a covariance. Empty when the light does not
/// look like a spot.
std::optional<Spot> measure_spot(const Patch& patch, const Eigen::Vector2d& centre_px,
                                 const Eigen::Matrix2d& second_moments_px2,
                                 double min_variance_px2);

}  // namespace occ::internal::detect
