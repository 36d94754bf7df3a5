// SPDX-License-Identifier: Apache-2.0
// Keyword options that several functions share.
#pragma once

#include "fields.hpp"
#include "libocc/detect/internal/detect_fields.hpp"
#include "libocc/identify/internal/identify_fields.hpp"
#include "libocc/refine/internal/refine_fields.hpp"

namespace occ::python {

inline auto detect_fields() { return options_of(internal::detect::detect_fields); }

/// model_sigma_px is renamed, because locate() also has the refinement's option of that name.
inline auto identify_fields() {
  return renamed(options_of(internal::identify::identify_fields), "model_sigma_px",
                 "gate_model_sigma_px");
}

/// Options of the functions that return a verdict of identification. locate() has its own max_risk.
inline auto identify_verdict_fields() {
  return std::tuple_cat(identify_fields(),
                        std::make_tuple(field("max_risk", &IdentifyOptions::max_risk,
                                              "status ok if the pose is wrong with at most this "
                                              "probability")));
}

inline auto refine_fields() { return options_of(internal::refine::refine_fields); }

}  // namespace occ::python
