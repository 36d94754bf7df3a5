// SPDX-License-Identifier: Apache-2.0
// Checksums of an id: cyclic redundancy codes, most significant bit first.
//
//   crc8    x^8 + x^2 + x + 1 (0x07), register starts at 0, 0x55 added: ITU-T I.432.1
//   crc16   x^16 + x^12 + x^5 + 1 (0x1021), register starts at 0xFFFF: CRC-16/CCITT-FALSE, the
//           polynomial of ITU-T V.41
//
// Both detect every burst of errors up to their own length and every odd number of wrong bits
// (x + 1 divides both). Random bits pass with probability 2^-8 or 2^-16; bits that are all 0 never
// pass.
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Polynomials of the checksum; see the head of this file.
enum class Checksum {
  crc8,   ///< 8 bits: random bits pass with probability 1/256
  crc16,  ///< 16 bits: random bits pass with probability 1/65536
};

/// Bits, most significant first, each 0 or 1.
using Bits = std::vector<std::uint8_t>;

LIBOCC_API int checksum_bits(Checksum kind);  ///< 8 or 16

/// Checksum of any number of bits. Check values of the bytes "123456789": 0xA1 and 0x29B1.
LIBOCC_API std::uint32_t checksum(Checksum kind, const Bits& bits);

/// Returns the lowest `count` bits of a value, most significant first. Throws std::invalid_argument
/// unless 0 <= count <= 32.
LIBOCC_API Bits bits_of(std::uint32_t value, int count);

/// Returns the value of up to 32 bits; throws std::invalid_argument for more.
LIBOCC_API std::uint32_t value_of(const Bits& bits);

}  // namespace occ
