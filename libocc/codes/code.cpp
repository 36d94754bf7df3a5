// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/code.hpp"

#include "libocc/codes/internal/code_fields.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::codes;

const char* to_string(CodeKind kind) {
  for (const Word<CodeKind>& word : code_kind_words)
    if (word.value == kind) return word.text;
  return "unknown";
}

void Code::validate() const {
  check_fields(*this, code_fields, "");
  require(
      (id_bits + checksum_bits(checksum)) % 4 == 0, "id_bits", id_bits,
      "a multiple of 4 together with the checksum's " + std::to_string(checksum_bits(checksum)));
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
