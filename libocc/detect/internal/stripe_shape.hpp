// SPDX-License-Identifier: Apache-2.0
// Internal: centre and shape of a lamp of which only the lit stripes are visible. A plain centroid
// follows the phase of the stripes by several pixels. Three models avoid this bias:
//
//   disc      the two ends of every lit line lie on the rim; an ellipse is fitted to them
//   outline   lamps of any other shape with sharp edges: centroid of the area between the ends
//   gaussian  lamps without sharp edges: log(signal) = quadratic(line, pos) + periodic(line),
//   linear
//             in all unknowns. In the logarithm all contours have the same weight, so a hot spot
//             off the centre has little influence.
//
// Vectors are (line, pos).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

/// Lit part of one line.
struct Chord {
  int line;
  double pos0, pos1;  ///< positions where the signal crosses a fraction of the line's plateau
  double softness;    ///< distance from 1/4 to 3/4 of the plateau, mean of both ends, over half the
                      ///< chord
};

struct StripeRimPoint {
  Eigen::Vector2d at, normal;
};

/// Ellipse |shape (p - centre)| = 1.
struct StripedShape {
  enum class Kind { disc, outline, gaussian };
  Kind kind = Kind::gaussian;
  Eigen::Vector2d centre;
  Eigen::Matrix2d covariance;
  Eigen::Matrix2d shape;
  double log_range = 0;  ///< gaussian: log of the peak over the signal on the ellipse; else 0
  std::vector<StripeRimPoint> rim;  ///< disc only
  double rim_sigma_px = 0;          ///< sigma of each point, inflated for correlated neighbours
  double rim_growth_variance_px2 = 0, rim_shift_variance_px2 = 0;  ///< common to all points
};

/// Chords at a low, a middle and a high fraction of the plateau.
struct SharpChords {
  std::vector<Chord> low, half, high;
};

/// Returns the chords of a lamp with sharp edges; empty when its ends are soft or fewer than five.
/// `peak`: signal of the brightest pixels. `clipped`: the pixels are saturated, which makes soft
/// ends look sharper than they are.
std::optional<SharpChords> sharp_chords(const LineWindow& window, const LineBox& core, double peak,
                                        bool clipped);

/// Fits an ellipse to the ends of the chords; empty when they do not lie on one.
std::optional<StripedShape> fit_disc(const SharpChords& chords);

/// Any other sharp outline, with straight lines across the gaps. The accuracy is a fraction of the
/// gaps, which may hide its first and last line.
StripedShape fit_outline(const std::vector<Chord>& chords);

struct GaussianOptions {
  double floor = 0;    ///< only signals above this level are used
  double clipped = 0;  ///< signals at or above this level are not used
  const Blink* blink = nullptr;
};

/// Fits a Gaussian profile with periodic modulation; empty when the signal does not fall off on all
/// sides.
std::optional<StripedShape> fit_gaussian(const LineWindow& window, const GaussianOptions& options);

}  // namespace occ::internal::detect
