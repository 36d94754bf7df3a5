// SPDX-License-Identifier: Apache-2.0
// How a lamp says its id by blinking: the kinds of codes, and the light that says it.
//
//   c_ook   camera on-off keying for a rolling shutter (IEEE 802.15.7-2018, C-OOK): short
//           sub-packets of preamble, sequence number and four bits, Manchester or 4B6B coded, each
//           repeated so often that an image of the lamp holds one whole (codes/c_ook.hpp)
//   ufsook  undersampled frequency shift on-off keying (Roberts, "Undersampled frequency shift ON-
//           OFF keying (UFSOOK) for camera communications (CamCom)", WOCC 2013): two frames a bit
//           at any lamp size (codes/ufsook.hpp)
//   s2psk   spatial two-phase shift keying (IEEE 802.15.7-2018): a reference lamp and one that is
//           in phase or in antiphase with it (codes/s2psk.hpp)
//   csk     colour-shift keying with four colours of one power (after IEEE 802.15.7-2011, clause
//           12), for a sensor with colour filters (codes/csk.hpp)
//
// All repeat id and checksum without end.
#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "libocc/codes/crc.hpp"
#include "libocc/codes/line_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

enum class CodeKind { c_ook, ufsook, s2psk, csk };

struct LIBOCC_API Code {
  CodeKind kind = CodeKind::c_ook;
  int id_bits = 8;  ///< with the checksum's a multiple of 4
  Checksum checksum = Checksum::crc8;
  double clock_hz = 10000;               ///< c_ook: chips a second; csk: symbols
  LineCode line = LineCode::manchester;  ///< c_ook
  int repeats = 4;                       ///< c_ook: of a sub-packet before the next one
  double frame_rate_hz = 30;             ///< of the camera; ufsook, s2psk are made for it
  double min_hz = 100;                   ///< ufsook, s2psk: blinks faster than this

  void validate() const;  ///< throws std::invalid_argument naming the field and its value

  friend bool operator==(const Code& a, const Code& b) {
    const auto fields = [](const Code& c) {
      return std::tie(c.kind, c.id_bits, c.checksum, c.clock_hz, c.line, c.repeats, c.frame_rate_hz,
                      c.min_hz);
    };
    return fields(a) == fields(b);
  }
};

LIBOCC_API const char* to_string(CodeKind kind);

/// Light of each channel over its greatest, in equal parts of one period, repeated without end.
/// Channels: s2psk: the lamp itself and its reference; csk: red, green, blue.
struct LIBOCC_API Waveform {
  std::vector<std::vector<double>> chips;
  double chip_rate_hz = 0;

  double frequency_hz() const;  ///< of the whole period
};

/// The light of a lamp that says `id`. Throws std::invalid_argument when the code does not validate
/// or the id has more than id_bits.
LIBOCC_API Waveform encode_id(std::uint32_t id, const Code& code);

/// Id and checksum: what is sent.
LIBOCC_API Bits payload_bits(std::uint32_t id, const Code& code);

}  // namespace occ
