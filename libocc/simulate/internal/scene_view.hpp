// SPDX-License-Identifier: Apache-2.0
// Describes a scene seen from a pose for the bounds of effects: position, size, brightness and
// smoothness of each lamp's image.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::internal::simulate {

struct LampView {
  const Lamp* lamp = nullptr;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();        ///< projection of the lamp's centre
  Eigen::Vector2d image_centre_px = Eigen::Vector2d::Zero();  ///< centre of the lamp's image
  std::vector<Eigen::Vector2d> rim_px;                        ///< empty for a point lamp
  double radius_px = 0;   ///< radius of the circle about image_centre_px that contains the image
  double electrons = 0;   ///< electrons of the whole image while the lamp is lit
  double full_e = 0;      ///< upper limit of a pixel inside an extended lamp's image, without blur
  double peak_e = 0;      ///< upper limit of any pixel, with blur
  double distance_m = 0;  ///< distance of the lamp's centre from the camera
};

struct SceneView {
  const Scene& scene;
  const Rigid3& cam_from_world;
  const SimulateOptions& options;
  std::vector<LampView> lamps;  ///< lamps that can be rendered and reach the sensor

  /// Largest irradiance of the room's surfaces; cached by the first bound that needs it.
  mutable std::optional<double> max_wall_w_m2 = {};

  /// Change in grey levels caused by a change in electrons, where the response is steepest.
  double grey_levels(double electrons) const;
};

SceneView make_view(const Scene& scene, const Rigid3& cam_from_world,
                    const SimulateOptions& options);

/// Gaussian part of the lens's blur [px]; 0 when the scene leaves the PSF out.
double blur_sigma_px(const SceneView& view);
/// Radius of the defocus disc of a lamp [px].
double blur_radius_px(const LampView& seen, const SceneView& view);
/// Standard deviation of the Gaussian and the defocus disc together, along one axis [px].
double blur_width_px(const LampView& seen, const SceneView& view);

/// True if the lamp is rendered as a point.
bool is_point(const LampView& seen, const SceneView& view);

/// Transmission of the lens at a pixel; 1 when the scene leaves vignetting out.
double seen_transmission(const SceneView& view, const Eigen::Vector2d& px);

/// Largest distance between the centroid of a lamp's pixels and the centroid of its light [px].
/// For light with the spectrum S(k) = integral of light exp(-2 pi i k x) along an axis, box pixels
/// shift the centroid by at most
///     sum over k >= 1 of |S(k)| / (pi k).
/// The light of a convex lamp of width w, blurred by sigma, has
///     |S(k)| <= min(1, 2 / (pi k w)) exp(-2 (pi k sigma)^2).
/// The shift of a sharp point is up to half a pixel.
double sampling_shift_px(const LampView& seen, double sigma_px, bool as_point);
double sampling_shift_px(const LampView& seen, const SceneView& view);

/// Largest change of a pixel [electrons] when the lamp's image moves by `moved_px`. A convex rim
/// that moves by d sweeps at most sqrt(2) d of a pixel's area. The slope of an image blurred by
/// sigma is at most E / (sqrt(2 pi) sigma), and F / (2 pi sqrt(e) sigma^3) for a point.
double change_by_shift_e(const LampView& seen, const SceneView& view, double moved_px);

/// Largest change of a pixel [electrons] when the image is spread along a line of length
/// `length_px` about its position: length^2 / 24 times the largest second derivative. This
/// derivative is 2 E / (sqrt(2 pi e) sigma^2) for a lamp so thin that both flanks add (twice the
/// value of a straight edge), and F / (2 pi sigma^4) for a point.
double change_by_spread_e(const LampView& seen, const SceneView& view, double length_px);

}  // namespace occ::internal::simulate
