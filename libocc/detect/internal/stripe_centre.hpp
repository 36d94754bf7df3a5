// SPDX-License-Identifier: Apache-2.0
// Internal: the centre of a lamp of which only the lit stripes are seen. A plain centroid follows
// the phase of the stripes by several pixels. These do not:
//   disc: the two ends of every lit line lie on the rim; an ellipse through them.
//   outline: the area between those ends, for lamps of any other shape with sharp edges.
//   glow: log(signal) = quadratic(line, pos) + periodic(line), linear in all unknowns. Over the log
//         every contour weighs the same, so a hot spot off the centre of the glow pulls little.
// Vectors here are (line, pos).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_chords.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

struct StripeRimPoint {
  Eigen::Vector2d at, normal;
};

/// |shape (p - centre)| = 1 on the outline.
struct StripedShape {
  enum class Kind { disc, outline, glow };
  Kind kind = Kind::glow;
  Eigen::Vector2d centre;
  Eigen::Matrix2d covariance;
  Eigen::Matrix2d shape;
  double log_range = 0;  ///< of a glow: log of its peak over the signal on the outline; else 0
  std::vector<StripeRimPoint> rim;  ///< of a disc
  double rim_sigma_px = 0;          ///< of each point, correlation between neighbours included
  double rim_growth_variance_px2 = 0, rim_shift_variance_px2 = 0;  ///< common to all points
};

/// Chords at a low, a middle and a high fraction of the plateau.
struct SharpChords {
  std::vector<Chord> low, half, high;
};

/// Empty when the body has no sharp ends, or too few. Clipping makes even a glow's ends look
/// sharper than they are.
std::optional<SharpChords> sharp_chords(const LineWindow& window, const LineBox& body, double peak,
                                        bool clipped);

/// Empty when the ends do not lie on an ellipse.
std::optional<StripedShape> fit_disc(const SharpChords& chords);

/// Any other sharp outline, closed by straight lines over the gaps: good to a part of the gaps that
/// may hide its first and last line.
StripedShape fit_outline(const std::vector<Chord>& chords);

struct GlowOptions {
  double floor = 0;    ///< smallest signal used
  double clipped = 0;  ///< signal from here on is not used
  const Blink* blink = nullptr;
};

/// Empty when the signal does not fall off on all sides.
std::optional<StripedShape> fit_glow(const LineWindow& window, const GlowOptions& options);

}  // namespace occ::internal::detect
