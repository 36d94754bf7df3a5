// SPDX-License-Identifier: Apache-2.0
// Vector instruction sets of vectorised loops. All give the same bits: the operations on each
// element are the same, sums have a fixed order, and the compiler does not fuse multiplications and
// additions.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

/// Instruction sets, narrowest first.
enum class Simd {
  baseline,  ///< available on every processor of the architecture: SSE2 on x86-64
  avx2,      ///< 256-bit vectors
  avx512,    ///< 512-bit vectors: F, BW, DQ and VL
};

/// Widest instruction set of this processor.
LIBOCC_API Simd widest_simd();

}  // namespace occ
