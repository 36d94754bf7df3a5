// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/code.hpp"

#include <array>
#include <cmath>

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

void require_positive(double value, const char* field) {
  require(value > 0 && std::isfinite(value), field, value, "positive");
}

}  // namespace

const char* to_string(CodeKind kind) {
  constexpr std::array<const char*, 4> names{"c_ook", "ufsook", "s2psk", "csk"};
  return names[static_cast<std::size_t>(kind)];
}

void Code::validate() const {
  require(id_bits >= 1 && id_bits <= 16, "id_bits", id_bits, "in [1, 16]");
  require(
      (id_bits + checksum_bits(checksum)) % 4 == 0, "id_bits", id_bits,
      "a multiple of 4 together with the checksum's " + std::to_string(checksum_bits(checksum)));
  require_positive(clock_hz, "clock_hz");
  require(repeats >= 1 && repeats <= 64, "repeats", repeats, "in [1, 64]");
  require_positive(frame_rate_hz, "frame_rate_hz");
  require_positive(min_hz, "min_hz");
  require(min_hz < 20 * frame_rate_hz, "min_hz", min_hz, "below 20 times frame_rate_hz");
}

double Waveform::frequency_hz() const {
  return chip_rate_hz / static_cast<double>(chips.front().size());
}

Bits payload_bits(std::uint32_t id, const Code& code) {
  code.validate();
  require(id < 1u << code.id_bits, "id", id,
          "below " + std::to_string(1u << code.id_bits) + " (id_bits " +
              std::to_string(code.id_bits) + ")");
  Bits bits = bits_of(id, code.id_bits);
  const Bits check = bits_of(checksum(code.checksum, bits), checksum_bits(code.checksum));
  bits.insert(bits.end(), check.begin(), check.end());
  return bits;
}

Waveform encode_id(std::uint32_t id, const Code& code) {
  const SlotCode slots = slot_code(code);
  return slots.waveform(symbols_of(payload_bits(id, code), slots.bits_per_symbol));
}

}  // namespace occ
