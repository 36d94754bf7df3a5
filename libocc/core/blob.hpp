// SPDX-License-Identifier: Apache-2.0
// Measurements of one lamp in one image. Written by detection, read by identification and
// refinement. Units: pixels and grey levels; pixel (0, 0) is the centre of the first pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// A point of a lamp's rim, measured along the rim's normal only.
struct RimPoint {
  Eigen::Vector2d px;      ///< on the rim
  Eigen::Vector2d normal;  ///< unit, pointing out of the lamp
  double sigma_px = 0;     ///< standard deviation along the normal; independent between points
};

/// Ellipse of a disc's image.
struct Ellipse {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< in the image
  double semi_major_px = 0;                             ///< half of the longest diameter
  double semi_minor_px = 0;                             ///< half of the shortest diameter
  double angle_rad = 0;  ///< direction of the major axis, from +x towards +y, in (-pi/2, pi/2]
};

/// Growth, shift in x and y, stretch along x and along the diagonal; see Blob::rim_covariance_px2.
using RimErrorCovariance = Eigen::Matrix<double, 5, 5>;

/// Colour of a blob: the shares of the red, green and blue channel in its linear light above the
/// background, from its bright pixels. If most of these are clipped, `clipped` marks the channels
/// at full scale.
struct BlobColour {
  Eigen::Vector3d share = Eigen::Vector3d::Constant(1.0 / 3);  ///< in [0, 1]; the sum is 1
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();             ///< standard deviation of each share
  /// The ratio of a clipped channel to another one is a lower bound. That of two clipped channels
  /// is unknown.
  std::array<bool, 3> clipped{};
};

/// One bright region. Uncertainties follow from the noise of the image.
struct Blob {
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();     ///< best centre: rim fit, area
                                                             ///< of a polygon, PSF or moments
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();  ///< covariance of the centroid
  /// Shift of centroid and rim from the middle of the lamp's image per relative gradient of its
  /// brightness [px per 1/px]. Its causes: the light was assumed uniform, the centroid is weighted
  /// by light, or a saturated rim has grown more on its brighter side. Zero if the gradient was
  /// measured.
  Eigen::Matrix2d light_response_px2 = Eigen::Matrix2d::Zero();
  /// Outward displacement of the points of an over-exposed rim per ln of the lamp's brightness
  /// rim_light_depth_px inside the rim. Zero for other rims.
  double rim_light_response_px = 0;
  double rim_light_depth_px = 0;       ///< distance from such a rim of the light that moves it
  double flux_dn = 0;                  ///< sum of grey levels above the background
  double flux_sigma_dn = 0;            ///< its standard deviation
  double peak_dn = 0;                  ///< brightest pixel, background included
  double background_dn = 0;            ///< local background
  double noise_dn = 0;                 ///< standard deviation of one background pixel
  int area_px = 0;                     ///< pixels above the threshold
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< bounding box, both ends included
  Ellipse ellipse;                     ///< fitted to the rim, or from second moments without a rim
  std::vector<RimPoint> rim;           ///< sub-pixel rim; empty for small spots
  /// Covariance of the errors common to all rim points. For a normal n they move a point along it
  /// by the first error (growth), n_x and n_y times the next two (shift), and n_x^2 - n_y^2 and
  /// 2 n_x n_y times the last two (stretch).
  RimErrorCovariance rim_covariance_px2 = RimErrorCovariance::Zero();

  /// Corners of a lamp with straight sides, clockwise in the image: intersections of the sides that
  /// were fitted to the rim. Empty for other shapes.
  std::vector<Eigen::Vector2d> corners_px;

  /// True: the rim is neither that of an ellipse nor of a convex polygon, but an outline of another
  /// shape, without its corners.
  bool free_form = false;

  bool saturated = false;  ///< pixels at full scale: the rim has grown, the flux is a lower bound
  bool merged = false;     ///< its shape is that of several lamps
  bool cut_by_border = false;  ///< touches the image border: centroid and flux of the visible part
  /// Something in front hides a part: the rim is the visible part, and the flux is a lower bound.
  /// The centroid of a disc is that of the ellipse through the rim. Of a lamp with straight sides,
  /// corners_px and centroid are those of the visible part; the covariance contains the rest.
  bool hidden_in_part = false;
  bool patterned = false;  ///< several bright parts with gaps, or one with gaps, such as the cells
                           ///< of a louvre: only the centre of their common outline is known
  bool striped = false;    ///< rolling-shutter stripes joined into one blob

  std::optional<double> frequency_hz;  ///< blink frequency read from the stripes
  /// Standard deviation of frequency_hz; infinite without it.
  double frequency_sigma_hz = std::numeric_limits<double>::infinity();
  std::optional<int> lamp_id;  ///< decoded from its blink code (decode/decode.hpp)
  /// Only in an image with colour channels; empty for stripes.
  std::optional<BlobColour> colour;

  /// True if a part of the lamp's light is missing from flux_dn.
  bool flux_is_lower_bound() const {
    return saturated || cut_by_border || hidden_in_part || striped;
  }

  /// True if a part of a lamp with straight sides is hidden. Its rim has points of visible sides
  /// only; other sides and corners are not those of the lamp.
  bool has_hidden_sides() const { return hidden_in_part && !corners_px.empty(); }

  /// True if the rim is that of an ellipse, which `ellipse` describes.
  bool has_elliptical_rim() const { return !rim.empty() && corners_px.empty() && !free_form; }
};

}  // namespace occ
