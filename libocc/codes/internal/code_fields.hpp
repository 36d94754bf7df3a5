// SPDX-License-Identifier: Apache-2.0
// The fields of Code and the names of its enumerators (core/internal/fields.hpp).
#pragma once

#include <array>

#include "libocc/codes/code.hpp"
#include "libocc/core/internal/fields.hpp"

namespace occ::internal::codes {

inline constexpr std::array<core::Word<CodeKind>, 4> code_kind_words{{{"c_ook", CodeKind::c_ook},
                                                                      {"ufsook", CodeKind::ufsook},
                                                                      {"s2psk", CodeKind::s2psk},
                                                                      {"csk", CodeKind::csk}}};

inline constexpr std::array<core::Word<LineCode>, 2> line_code_words{
    {{"manchester", LineCode::manchester}, {"4b6b", LineCode::code_4b6b}}};

inline constexpr std::array<core::Word<Checksum>, 2> checksum_words{
    {{"crc8", Checksum::crc8}, {"crc16", Checksum::crc16}}};

inline constexpr auto code_fields = core::fields_of<Code>(
    core::field("kind", &Code::kind, "", core::one_of(code_kind_words),
                "`c_ook`, `ufsook`, `s2psk` or `csk`")
        .needed(),
    core::field("id_bits", &Code::id_bits, "", core::Interval{'[', 1, 16, ']'},
                "bits of the id; with the checksum's a multiple of 4"),
    core::field("checksum", &Code::checksum, "", core::one_of(checksum_words), "`crc8` or `crc16`"),
    core::field("clock_hz", &Code::clock_hz, "Hz", core::Positive{},
                "chips per second of `c_ook`, symbols per second of `csk`"),
    core::field("line", &Code::line, "", core::one_of(line_code_words),
                "line code of `c_ook`: `manchester` or `4b6b`"),
    core::field("repeats", &Code::repeats, "", core::Interval{'[', 1, 64, ']'},
                "repetitions of a sub-packet of `c_ook` before the next one"),
    core::field("frame_rate_hz", &Code::frame_rate_hz, "Hz", core::Positive{},
                "frame rate of the camera that `ufsook` and `s2psk` are designed for"),
    core::field("min_hz", &Code::min_hz, "Hz", core::Positive{},
                "`ufsook` and `s2psk` blink faster than this"));

}  // namespace occ::internal::codes
