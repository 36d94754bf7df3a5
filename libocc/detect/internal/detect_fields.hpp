// SPDX-License-Identifier: Apache-2.0
// The fields of DetectOptions (core/internal/fields.hpp).
#pragma once

#include "libocc/core/internal/fields.hpp"
#include "libocc/detect/detect.hpp"

namespace occ::internal::detect {

// detect() in Python finds bright blobs only: `dark` is no keyword option.
inline constexpr auto detect_fields = core::fields_of<DetectOptions>(
    core::field("threshold_sigma", &DetectOptions::threshold_sigma, "", core::Positive{},
                "threshold above the local background, in standard deviations of the noise"),
    core::field("threshold_dn", &DetectOptions::threshold_dn, "grey levels", core::NotNegative{},
                "absolute threshold instead of threshold_sigma"),
    core::field("min_area_px", &DetectOptions::min_area_px, "px", core::AtLeast{1},
                "smaller blobs are dropped"),
    core::field("max_blobs", &DetectOptions::max_blobs, "", core::AtLeast{1},
                "the brightest blobs are kept"),
    core::field("dark", &DetectOptions::dark, "", core::ByHand{},
                "detect regions darker than their surroundings"),
    core::field("rims", &DetectOptions::rims, "", core::Unrestricted{},
                "measure the sub-pixel rims of discs"),
    core::field("polygons", &DetectOptions::polygons, "", core::Unrestricted{},
                "with rims: also measure those of lamps with straight sides"),
    core::field("discs", &DetectOptions::discs, "", core::Unrestricted{},
                "lamps may be discs: of one that is hidden in part, the visible rim is measured"),
    core::field("free_forms", &DetectOptions::free_forms, "", core::Unrestricted{},
                "with rims: also measure those of lamps of any other shape"),
    core::field("hollows", &DetectOptions::hollows, "", core::Unrestricted{},
                "with free_forms: an outline with a hollow, as of an L, is that of one lamp"),
    core::field("patterned", &DetectOptions::patterned, "", core::Unrestricted{},
                "join the bright parts of lamps such as pairs of tubes, louvred panels and frames"),
    core::field(
        "sensor", &DetectOptions::sensor, "", core::Unrestricted{},
        "Sensor: noise model, full scale, response, row time; None: the noise is estimated"),
    core::field("stripes", &DetectOptions::stripes, "", core::Unrestricted{},
                "join rolling-shutter stripes and measure frequencies; None: if the sensor has a "
                "row time"),
    core::field("colours", &DetectOptions::colours, "", core::Unrestricted{},
                "colours of the lamps (red, green, blue) in a colour image; saturated ones are "
                "searched in a colour difference, where white lights vanish; empty: grey"),
    core::field("max_frequency_hz", &DetectOptions::max_frequency_hz, "Hz", core::Positive{},
                "highest frequency measured from stripes"));

}  // namespace occ::internal::detect
