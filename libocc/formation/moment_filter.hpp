// SPDX-License-Identifier: Apache-2.0
// First moments of coverage (formation/coverage.hpp) from coverage itself. With K the PSF blurred
// by the pixel's box, a moment is the shape convolved with -x K(x), whose transform is that of K
// times
//     i T(k),   T = -(ln K)' = sigma^2 k + 1/k - cot(k/2)/2,
// so it follows from coverage by an odd filter with T as its response:
//     m_x(x, y) = sum over j of taps[j - 1] (c(x + j, y) - c(x - j, y)).
// The taps are fitted to T by least squares with the spectrum of a straight rim as weight. The
// pixels must resolve the PSF: measured maximum errors over the largest moment are 7e-4 at a sigma
// of 1.4 px, 5e-5 at 2 px, and 1e-5 from 3 px on. The resulting error of an image is this times the
// relative change of the brightness over the width of the PSF.
#pragma once

#include <array>

#include "libocc/core/abi.hpp"

namespace occ {

class LIBOCC_API MomentFilter {
 public:
  /// True if the pixels resolve the PSF; otherwise moments must be painted.
  static bool resolves(double psf_sigma_px) { return psf_sigma_px >= 1.4; }

  explicit MomentFilter(double psf_sigma_px);

  const std::array<double, 4>& taps() const { return taps_; }

 private:
  std::array<double, 4> taps_{};
};

}  // namespace occ
