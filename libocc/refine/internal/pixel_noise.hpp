// SPDX-License-Identifier: Apache-2.0
// Noise model of a pixel with mean signal mu [electrons]. The measured signal is
//     x = linear_dn(stored grey level) / K,      var(x) = mu + sigma_read^2 + q
// (EMVA 1288, release 4.0, eq (11)); q is the variance of rounding, 1/12 of a squared grey level.
// The model gives the mean of x, its derivative by mu, and its variance.
// Near black and white the moments are those of a clipped normal variable: the use of a saturated
// pixel does not depend on its random value, and its weight vanishes. If the noise is below a grey
// level, rounding is not independent noise; the exact moments of a rounded normal variable are used
// instead (Widrow & Kollar, Quantization Noise, 2008, section 4.3).
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::refine {

struct PixelMoments {
  double mean = 0;
  double slope = 0;         ///< d mean / d mu
  double variance = 0;      ///< [electrons^2]
  bool informative = true;  ///< false: saturated for all mu nearby, carries no information
};

class LIBOCC_API PixelNoise {
 public:
  explicit PixelNoise(const Sensor& sensor);

  PixelMoments at(double mean_e) const {
    const double shot = mean_e > 0 ? mean_e : 0;
    if (mean_e > plain_from_e_ && mean_e < plain_until_e_ && quantisation_.empty()) {
      return {mean_e, 1, read_variance_ + shot + rounding_variance_, true};
    }
    return carefully(mean_e, shot);
  }

  double dark_e() const { return dark_e_; }   ///< mean of a pixel without any light
  double white_e() const { return high_e_; }  ///< upper limit of the signal

 private:
  PixelMoments carefully(double mean_e, double shot) const;
  void clip(double deviation, PixelMoments& moments) const;
  void tabulate_rounding(double until_e);
  PixelMoments rounded(double steps) const;
  double rounding_variance(double mean_e) const;

  double read_variance_, gain_, black_dn_, dark_e_;
  double low_e_ = 0, high_e_ = 0;  // range of the grey levels
  bool full_well_first_ = false;   // electrons are clipped before the read noise
  double plain_from_e_ = 0, plain_until_e_ = 0;
  double rounding_variance_ = 0;       // of a linear response
  std::vector<PixelMoments> rounded_;  // of faint pixels, at even steps of the signal from black
  std::vector<double> quantisation_;   // nonlinear response: at even steps of the signal to white
};

}  // namespace occ::internal::refine
