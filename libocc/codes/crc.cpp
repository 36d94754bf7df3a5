// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/crc.hpp"

#include "libocc/core/require.hpp"

namespace occ {

int checksum_bits(Checksum kind) { return kind == Checksum::crc8 ? 8 : 16; }

std::uint32_t checksum(Checksum kind, const Bits& bits) {
  const int width = checksum_bits(kind);
  const std::uint32_t polynomial = kind == Checksum::crc8 ? 0x07 : 0x1021;
  const std::uint32_t mask = (1u << width) - 1;
  std::uint32_t remainder = kind == Checksum::crc8 ? 0 : 0xFFFF;
  for (const std::uint8_t bit : bits) {
    const bool divides = ((remainder >> (width - 1)) & 1) != bit;
    remainder = (remainder << 1) & mask;
    if (divides) remainder ^= polynomial;
  }
  return kind == Checksum::crc8 ? remainder ^ 0x55 : remainder;
}

Bits bits_of(std::uint32_t value, int count) {
  require(count >= 0 && count <= 32, "count", count, "in [0, 32]");
  Bits bits;
  for (int i = count - 1; i >= 0; --i) bits.push_back(static_cast<std::uint8_t>((value >> i) & 1));
  return bits;
}

std::uint32_t value_of(const Bits& bits) {
  require(bits.size() <= 32, "bits", bits.size(), "32 at most");
  std::uint32_t value = 0;
  for (const std::uint8_t bit : bits) value = (value << 1) | (bit & 1u);
  return value;
}

}  // namespace occ
