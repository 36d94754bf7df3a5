// SPDX-License-Identifier: Apache-2.0
// What one image leaves to the next of the same scene: tables that take long to make, and memory.
#pragma once

#include <map>

#include "libocc/core/simd.hpp"
#include "libocc/formation/pixel_psf.hpp"

namespace occ {

class Storage {
 public:
  explicit Storage(Simd simd) : simd_(simd) {}

  Simd simd() const { return simd_; }

  /// Made when it is first asked for; the reference stays valid.
  const PixelPsf& psf(double sigma_px) {
    return psfs_.try_emplace(sigma_px, sigma_px).first->second;
  }

 private:
  Simd simd_;
  std::map<double, PixelPsf> psfs_;
};

}  // namespace occ
