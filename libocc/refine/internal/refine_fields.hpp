// SPDX-License-Identifier: Apache-2.0
// The fields of RefineOptions (core/internal/fields.hpp).
#pragma once

#include "libocc/core/internal/fields.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

inline constexpr auto refine_fields = core::fields_of<RefineOptions>(
    core::field("rung", &RefineOptions::rung, "", core::Unrestricted{},
                "observations that the pose is fitted to, a Rung"),
    core::field("flux", &RefineOptions::flux, "", core::Unrestricted{},
                "use of the lamps' brightness, a FluxModel"),
    core::field("prior", &RefineOptions::prior, "", core::ByHand{}, "Prior, added as observations"),
    core::field("model_sigma_px", &RefineOptions::model_sigma_px, "px", core::NotNegative{},
                "error of camera and map per lamp"),
    core::field("huber_sigma", &RefineOptions::huber_sigma, "", core::PositiveOrInfinite{},
                "corner of Huber's loss: beyond this many standard deviations the loss is linear"),
    core::field("outlines_grow", &RefineOptions::outlines_grow, "", core::Unrestricted{},
                "outlines of all lamps may be larger by one unknown number of pixels, as those of "
                "saturated lamps always are"),
    core::field("max_iterations", &RefineOptions::max_iterations, "", core::Positive{},
                "maximum number of steps"),
    core::field("tolerance_px", &RefineOptions::tolerance_px, "px", core::PositiveOrInfinite{},
                "converged when a step moves no lamp further than this"));

}  // namespace occ::internal::refine
