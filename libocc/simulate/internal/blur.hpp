// SPDX-License-Identifier: Apache-2.0
// How smooth a lamp's image is, for bounds on what moving or spreading it changes.
#pragma once

#include "libocc/simulate/internal/view.hpp"

namespace occ::internal::simulate {

/// Gaussian part of the lens's blur [px]; 0 when the scene leaves the PSF out.
double blur_sigma_px(const SceneView& view);
/// Radius of the disc by which the lamp is out of focus [px].
double blur_radius_px(const LampView& seen, const SceneView& view);
/// Standard deviation of both along one axis.
double blur_width_px(const LampView& seen, const SceneView& view);

/// Whether the lamp is rendered as a point.
bool is_point(const LampView& seen, const SceneView& view);

/// How far the centroid of a lamp's pixels is from that of its light, at most: pixels of a box see
/// of light of the spectrum S(k) = integral of light exp(-2 pi i k x) along an axis
///     sum over k >= 1 of |S(k)| / (pi k),
/// and the light of a convex lamp of width w that is blurred by sigma has |S(k)| <= min(1, 2 / (pi
/// k w)) exp(-2 (pi k sigma)^2): half a pixel for a sharp point.
double sampling_shift_px(const LampView& seen, double sigma_px, bool as_point);
double sampling_shift_px(const LampView& seen, const SceneView& view);

/// Electrons by which a pixel changes at most when the lamp's image moves by `moved_px`. A convex
/// rim that moves by d sweeps at most sqrt(2) d of a pixel, and the slope of an image blurred by
/// sigma is at most E / (sqrt(2 pi) sigma); a point's is F / (2 pi sqrt(e) sigma^3).
double change_by_shift_e(const LampView& seen, const SceneView& view, double moved_px);

/// The same when it is spread along a line of length `length_px` about where it was:
/// length^2 / 24 times its largest second derivative. That is 2 E / (sqrt(2 pi e) sigma^2) for a
/// lamp so thin that both flanks add, twice that of a straight edge; F / (2 pi sigma^4) for a
/// point.
double change_by_spread_e(const LampView& seen, const SceneView& view, double length_px);

}  // namespace occ::internal::simulate
