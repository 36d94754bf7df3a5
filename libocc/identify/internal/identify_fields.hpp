// SPDX-License-Identifier: Apache-2.0
// The fields of IdentifyOptions (core/internal/fields.hpp).
#pragma once

#include "libocc/core/internal/fields.hpp"
#include "libocc/identify/identify.hpp"

namespace occ::internal::identify {

inline constexpr auto identify_fields = core::fields_of<IdentifyOptions>(
    core::field("prior", &IdentifyOptions::prior, "", core::ByHand{}, "Prior of the pose"),
    core::field("method", &IdentifyOptions::method, "", core::Unrestricted{},
                "search method for poses, an IdentifyMethod"),
    core::field("seed", &IdentifyOptions::seed, "", core::Unrestricted{},
                "seed of the random assignments of ransac"),
    core::field("index", &IdentifyOptions::index, "", core::Unrestricted{},
                "LampIndex of the scene, for hashing; None: it is built at each call"),
    core::field("use_frequency", &IdentifyOptions::use_frequency, "", core::Unrestricted{},
                "assign lamps by their blink frequency where it is known"),
    core::field("frequency_gate_sigma", &IdentifyOptions::frequency_gate_sigma, "",
                core::NotNegativeOrInfinite{},
                "gate between a blob's frequency and a lamp's, in standard deviations"),
    core::field("frequency_tolerance", &IdentifyOptions::frequency_tolerance, "",
                core::NotNegativeOrInfinite{}, "relative error of lamp and row clocks"),
    core::field("gate_sigma", &IdentifyOptions::gate_sigma, "", core::Positive{},
                "gate between a projected lamp and a blob, in standard deviations"),
    core::field("model_sigma_px", &IdentifyOptions::model_sigma_px, "px", core::NotNegative{},
                "error of camera and map, added to every gate"),
    core::field("miss_penalty", &IdentifyOptions::miss_penalty, "", core::NotNegativeOrInfinite{},
                "chi-square for a lamp that should be visible but has no blob"),
    core::field("use_brightness", &IdentifyOptions::use_brightness, "", core::Unrestricted{},
                "rank poses, and reject reflections, by brightness and size"),
    core::field("light_sigma", &IdentifyOptions::light_sigma, "", core::NotNegative{},
                "relative error of a predicted flux in addition to the lamp's power_sigma"),
    core::field("max_hypotheses", &IdentifyOptions::max_hypotheses, "", core::Positive{},
                "maximum number of poses tried"),
    core::field("max_time_s", &IdentifyOptions::max_time_s, "s", core::PositiveOrInfinite{},
                "maximum time of the search; the result then depends on the machine's speed"),
    core::field("max_risk", &IdentifyOptions::max_risk, "", core::ByHand{},
                "status ok if the pose is wrong with at most this probability"));

}  // namespace occ::internal::identify
