// SPDX-License-Identifier: Apache-2.0
// Which vector instructions hot loops may use. All give the same bits: elements are computed alike,
// sums are taken in a fixed order, and nothing is fused that the code does not fuse.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

enum class Simd {
  baseline,  ///< what every processor of the architecture has: SSE2 on x86-64
  avx2,
  avx512,  ///< F, BW, DQ and VL
};

/// The widest that this processor has.
LIBOCC_API Simd widest_simd();

}  // namespace occ
