// SPDX-License-Identifier: Apache-2.0
// Codes by which a lamp transmits its id (visible light communication), and their waveforms.
//
//   c_ook   camera on-off keying for a rolling shutter (IEEE 802.15.7-2018, C-OOK): short
//           sub-packets of preamble, sequence number and four bits, Manchester or 4B6B coded, each
//           repeated so often that an image of the lamp contains a complete one
//   ufsook  undersampled frequency shift on-off keying (Roberts, "Undersampled frequency shift ON-
//           OFF keying (UFSOOK) for camera communications (CamCom)", WOCC 2013): two frames a bit
//           at any lamp size
//   s2psk   spatial two-phase shift keying (IEEE 802.15.7-2018): a reference lamp, and a second
//           lamp that is in phase or in antiphase with it
//   csk     colour-shift keying with four colours of equal power (after IEEE 802.15.7-2011, clause
//           12), for a sensor with colour filters
//
// All codes repeat id and checksum continuously. Details: codes/code_kinds.hpp.
//
// A new code needs: an enumerator here; its word for files (internal/code_fields.hpp); its slots
// (code_kinds.hpp) and a case in slot_code.cpp; its requirements on the camera (budget.cpp); its
// options (cli/commands/decode.py, LONG_CODES in coded_positioner.py); and, if it is transmitted in
// pieces or by several lamps or colours, a branch in decode_samples.cpp or decode/decode.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "libocc/codes/crc.hpp"
#include "libocc/codes/line_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Modulation methods; the head of this file describes them.
enum class CodeKind {
  c_ook,   ///< camera on-off keying, for rolling shutters
  ufsook,  ///< undersampled frequency shift on-off keying, for any shutter
  s2psk,   ///< phase of a lamp relative to a reference lamp beside it
  csk,     ///< colours, for sensors with colour filters
};

/// A code with its parameters. Lamp and decoder need equal values.
struct LIBOCC_API Code {
  CodeKind kind = CodeKind::c_ook;  ///< modulation
  int id_bits = 8;                  ///< 1 to 16; id_bits plus checksum bits must be a multiple of 4
  Checksum checksum = Checksum::crc8;    ///< appended to the id; see codes/crc.hpp
  double clock_hz = 10000;               ///< c_ook: chips per second; csk: symbols per second
  LineCode line = LineCode::manchester;  ///< c_ook only
  int repeats = 4;                       ///< c_ook: how many times each sub-packet is sent, 1 to 64
  double frame_rate_hz = 30;  ///< frame rate of the camera; ufsook and s2psk depend on it
  double min_hz = 100;        ///< ufsook, s2psk: lower limit of the blink frequencies (flicker)

  void validate() const;  ///< throws std::invalid_argument naming the field and its value

  friend bool operator==(const Code& a, const Code& b) {
    const auto fields = [](const Code& c) {
      return std::tie(c.kind, c.id_bits, c.checksum, c.clock_hz, c.line, c.repeats, c.frame_rate_hz,
                      c.min_hz);
    };
    return fields(a) == fields(b);
  }
};

/// The enumerator's name, e.g. "c_ook".
LIBOCC_API const char* to_string(CodeKind kind);

/// Light of each channel, relative to its maximum, in equal time steps (chips) of one period.
/// Channels: s2psk: the lamp itself and its reference; csk: red, green, blue; else one.
struct LIBOCC_API Waveform {
  std::vector<std::vector<double>> chips;  ///< [channel][chip], each in 0 to 1
  double chip_rate_hz = 0;                 ///< chips per second

  double frequency_hz() const;  ///< repetition rate of the whole period
};

/// Waveform of a lamp that transmits `id`. Throws std::invalid_argument for an invalid code or an
/// id of more than id_bits.
LIBOCC_API Waveform encode_id(std::uint32_t id, const Code& code);

/// Bits that are transmitted: id and checksum.
LIBOCC_API Bits payload_bits(std::uint32_t id, const Code& code);

}  // namespace occ
