// SPDX-License-Identifier: Apache-2.0
// Whether a camera can read a code at all, before anyone tries. A rolling shutter exposes the rows
// of a lamp's image one after the other, so that an image holds
//
//   chips in view = rows x row time x clock,
//
// and an exposure longer than a chip mixes it with the next ones. Frames see all of a packet only
// if they do not always fall on the same parts of it.
#pragma once

#include <string>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

struct CodeBudget {
  double chips_in_view = 0;   ///< of one image of the lamp
  double chips_needed = 0;    ///< of one image: a sub-packet (c_ook), a symbol, none
  double exposure_chips = 0;  ///< length of the exposure; ufsook, s2psk: in half periods
  double row_chips = 0;       ///< from row to row
  double period_s = 0;        ///< of the whole packet
  double frames_needed = 0;   ///< about, to see all of it at the code's frame_rate_hz
  bool fits = false;
  std::string message;  ///< why not, with the numbers; empty when it fits
};

/// `rows`: height of the lamp's image along the readout [px]; row_time_s 0: global shutter.
/// `exact_times`: see DecodeSamplesOptions; a chip in view is enough then. Throws
/// std::invalid_argument for negative or non-finite numbers.
LIBOCC_API CodeBudget code_budget(const Code& code, double rows, double row_time_s,
                                  double exposure_s, bool exact_times = false);

}  // namespace occ
