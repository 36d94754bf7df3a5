// SPDX-License-Identifier: Apache-2.0
// Computes whether a camera can read a code. A rolling shutter exposes the rows of a lamp's image
// one after the other, so that one image contains
//
//   chips in view = rows x row time x clock.
//
// An exposure longer than a chip mixes it with the next ones. Frames cover a whole packet only if
// their phase relative to the packet varies.
#pragma once

#include <string>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Requirements of a code, compared with what one camera offers.
struct CodeBudget {
  double chips_in_view = 0;   ///< chips in one image of the lamp
  double chips_needed = 0;    ///< chips required in one image; c_ook: a sub-packet; csk: a symbol;
                              ///< ufsook, s2psk: 0
  double exposure_chips = 0;  ///< length of the exposure [chips; ufsook, s2psk: half periods]
  double row_chips = 0;       ///< time from row to row [chips]
  double period_s = 0;        ///< duration of the whole packet
  double frames_needed = 0;   ///< approximate number of frames for the whole packet
  bool fits = false;          ///< true: the camera can read the code
  std::string message;        ///< reason with numbers if it cannot; else empty
};

/// `rows`: height of the lamp's image along the readout [px]. `row_time_s`: 0 for a global shutter.
/// `exact_times`: see DecodeSamplesOptions; one chip in view is then sufficient. Throws
/// std::invalid_argument for negative or non-finite numbers.
LIBOCC_API CodeBudget code_budget(const Code& code, double rows, double row_time_s,
                                  double exposure_s, bool exact_times = false);

}  // namespace occ
