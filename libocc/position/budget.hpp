// SPDX-License-Identifier: Apache-2.0
// Internal: from what locate() has identified and was asked for to the rung that it takes.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <functional>
#include <vector>

#include "libocc/position/locate.hpp"
#include "libocc/position/rung_choice.hpp"

namespace occ {

/// What is left to do once lamps have names.
struct RefinementAhead {
  const std::vector<Hypothesis>& hypotheses;  ///< at least one
  const std::vector<Blob>& blobs;
  const Scene& scene;
  const LocateOptions& options;  ///< its prior is in its parts
  const ImageView* image;        ///< may be null
};

/// `elapsed_s`: since locate() was called, whenever asked.
RungChoice rung_for(const RefinementAhead& ahead, const std::function<double()>& elapsed_s);

}  // namespace occ
