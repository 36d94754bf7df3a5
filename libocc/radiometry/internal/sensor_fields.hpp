// SPDX-License-Identifier: Apache-2.0
// The fields of Sensor and Channel, and the names of their enumerators (core/internal/fields.hpp).
#pragma once

#include <array>

#include "libocc/core/internal/fields.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::radiometry {

inline constexpr std::array<core::Word<Response>, 5> response_words{
    {{"automatic", Response::automatic},
     {"linear", Response::linear},
     {"gamma", Response::gamma},
     {"srgb", Response::srgb},
     {"table", Response::table}}};

inline constexpr std::array<core::Word<Mosaic>, 5> mosaic_words{{{"none", Mosaic::none},
                                                                 {"rggb", Mosaic::rggb},
                                                                 {"grbg", Mosaic::grbg},
                                                                 {"gbrg", Mosaic::gbrg},
                                                                 {"bggr", Mosaic::bggr}}};

inline constexpr std::array<core::Word<Readout>, 3> readout_words{
    {{"rows", Readout::rows}, {"columns", Readout::columns}, {"unknown", Readout::unknown}}};

// The rules of a response table concern all its entries: Sensor::validate().
inline constexpr auto channel_fields = core::fields_of<Channel>(
    core::field("efficiency", &Channel::efficiency, "", core::NotNegative{},
                "factor on `quantum_efficiency`"),
    core::field("response", &Channel::response, "", core::one_of(response_words),
                "`linear`, `gamma`, `srgb` or `table`"),
    core::field("gamma", &Channel::gamma, "", core::Positive{},
                "stored = linear^(1/gamma), for the response `gamma`"),
    core::field("response_table", &Channel::response_table, "", core::Unrestricted{},
                "stored values at evenly spaced linear ones, strictly rising from 0 to 1, for the "
                "response `table`; `libocc response` measures it"));

// `channels` is a nested mapping in files: scene_reader.cpp and scene_writer.cpp.
inline constexpr auto sensor_fields = core::fields_of<Sensor>(
    core::field("pixel_pitch_m", &Sensor::pixel_pitch_m, "m", core::Positive{},
                "distance between the centres of two pixels"),
    core::field("f_number", &Sensor::f_number, "", core::Positive{},
                "focal length over the diameter of the aperture"),
    core::field("exposure_s", &Sensor::exposure_s, "s", core::Positive{}, "exposure time"),
    core::field("quantum_efficiency", &Sensor::quantum_efficiency, "",
                core::Interval{'(', 0, 1, ']'}, "electrons per photon"),
    core::field("wavelength_m", &Sensor::wavelength_m, "m", core::Positive{},
                "wavelength at which the quantum efficiency holds"),
    core::field("full_well_e", &Sensor::full_well_e, "electrons", core::Positive{},
                "largest charge of a pixel"),
    core::field("gain_dn_per_e", &Sensor::gain_dn_per_e, "grey levels per electron",
                core::Positive{}, "gain of the linear signal"),
    core::field("read_noise_e", &Sensor::read_noise_e, "electrons", core::NotNegative{},
                "standard deviation of the read noise"),
    core::field("dark_current_e_per_s", &Sensor::dark_current_e_per_s, "electrons/s",
                core::NotNegative{}, "dark current"),
    core::field("black_level_dn", &Sensor::black_level_dn, "grey levels", core::Unrestricted{},
                "grey level without light, at least 0 and below full scale"),
    core::field("bit_depth", &Sensor::bit_depth, "", core::Interval{'[', 8, 16, ']'},
                "bits of a grey level; more than 8 give 16-bit images"),
    core::field(
        "response", &Sensor::response, "", core::one_of(response_words),
        "`linear`, `gamma`, `srgb`, `table`, or `automatic`: sRGB for 8-bit images with three "
        "colours, else linear"),
    core::field("gamma", &Sensor::gamma, "", core::Positive{},
                "stored = linear^(1/gamma), for the response `gamma`"),
    core::field("response_table", &Sensor::response_table, "", core::Unrestricted{},
                "stored values at evenly spaced linear ones, strictly rising from 0 to 1, for the "
                "response `table`; `libocc response` measures it"),
    core::field("row_time_s", &Sensor::row_time_s, "s", core::NotNegative{},
                "time from one row to the next; 0: global shutter"),
    core::field("readout", &Sensor::readout, "", core::one_of(readout_words),
                "pixels that a rolling shutter exposes together: `rows`, `columns` (a rotated "
                "image) or `unknown`"),
    core::field("psf_sigma_px", &Sensor::psf_sigma_px, "px", core::Positive{},
                "standard deviation of the lens's Gaussian blur"),
    core::field("gain_sigma", &Sensor::gain_sigma, "", core::Interval{'[', 0, 0.3, ']'},
                "relative standard deviation of the pixels' gains (PRNU)"),
    core::field("gain_seed", &Sensor::gain_seed, "", core::NotNegative{},
                "sensors of one seed have the same pixel gains"),
    core::field("blooming", &Sensor::blooming, "", core::Interval{'[', 0, 1, ']'},
                "part of the charge beyond the full well that spills up and down its column"),
    core::field("mosaic", &Sensor::mosaic, "", core::one_of(mosaic_words),
                "colour filters: `none`, `rggb`, `grbg`, `gbrg` or `bggr`"),
    core::field("channels", &Sensor::channels, "", core::ByHand{},
                "for a mosaic, the channels red, green and blue; empty: all have the sensor's "
                "values"));

}  // namespace occ::internal::radiometry
