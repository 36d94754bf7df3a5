// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "libocc/codes/budget.hpp"
#include "libocc/codes/code_kinds.hpp"
#include "libocc/codes/crc.hpp"
#include "libocc/codes/line_code.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/random.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;

Bits bits_of_text(const std::string& text) {
  Bits bits;
  for (const char c : text) {
    const Bits byte = bits_of(static_cast<std::uint8_t>(c), 8);
    bits.insert(bits.end(), byte.begin(), byte.end());
  }
  return bits;
}

Bits with_checksum(Checksum kind, std::uint32_t id, int id_bits) {
  Bits bits = bits_of(id, id_bits);
  const Bits check = bits_of(checksum(kind, bits), checksum_bits(kind));
  bits.insert(bits.end(), check.begin(), check.end());
  return bits;
}

bool holds(Checksum kind, const Bits& bits) {
  const auto id_bits = static_cast<std::ptrdiff_t>(bits.size()) - checksum_bits(kind);
  return value_of(Bits(bits.begin() + id_bits, bits.end())) ==
         checksum(kind, Bits(bits.begin(), bits.begin() + id_bits));
}

std::vector<Code> all_codes() {
  Code manchester, words, ufsook, s2psk, csk;
  words.line = LineCode::code_4b6b;
  ufsook.kind = CodeKind::ufsook;
  s2psk.kind = CodeKind::s2psk;
  csk.kind = CodeKind::csk;
  return {manchester, words, ufsook, s2psk, csk};
}

TEST(Checksum, PublishedCheckValues) {
  EXPECT_EQ(checksum(Checksum::crc16, bits_of_text("123456789")), 0x29B1u);
  EXPECT_EQ(checksum(Checksum::crc8, bits_of_text("123456789")), 0xA1u);
}

TEST(Checksum, DetectsBurstsOddErrorsAndAllZeros) {
  Random random(1);
  for (const Checksum kind : {Checksum::crc8, Checksum::crc16}) {
    const int width = checksum_bits(kind);
    for (int trial = 0; trial < 300; ++trial) {
      const Bits sent = with_checksum(kind, static_cast<std::uint32_t>(random.below(256)), 8);
      Bits burst = sent;
      const int length = 1 + random.below(width);
      const int from = random.below(static_cast<int>(sent.size()) - length + 1);
      for (int i = from; i < from + length; ++i) {
        const bool end = i == from || i == from + length - 1;
        if (end || random.below(2)) burst[i] ^= 1;
      }
      EXPECT_TRUE(holds(kind, sent));
      EXPECT_FALSE(holds(kind, burst));
      std::set<int> odd;
      const std::size_t wrong = 2 * static_cast<std::size_t>(random.below(4)) + 1;
      while (odd.size() < wrong) odd.insert(random.below(static_cast<int>(sent.size())));
      Bits flipped = sent;
      for (const int i : odd) flipped[i] ^= 1;
      EXPECT_FALSE(holds(kind, flipped));
    }
    EXPECT_FALSE(holds(kind, Bits(static_cast<std::size_t>(8 + width), 0)));
  }
}

/// Largest number of equal chips in succession when the chips repeat continuously.
int longest_run(const Chips& chips) {
  const std::size_t n = chips.size();
  int longest = 0, run = 0;
  for (std::size_t i = 0; i < 2 * n; ++i) {
    run = i > 0 && chips[i % n] == chips[(i - 1) % n] ? run + 1 : 1;
    longest = std::max(longest, run);
  }
  return std::min(longest, static_cast<int>(n));
}

TEST(LineCode, WordsAreDistinctBalancedAndHaveShortRuns) {
  for (const LineCode code : {LineCode::manchester, LineCode::code_4b6b}) {
    const int max_run = code == LineCode::manchester ? 2 : 4;
    const auto words = 1u << bits_per_word(code);
    std::set<Chips> distinct;
    for (std::uint32_t a = 0; a < words; ++a) {
      distinct.insert(word_chips(code, a));
      for (std::uint32_t b = 0; b < words; ++b) {
        Chips chips = word_chips(code, a);
        const Chips second = word_chips(code, b);
        chips.insert(chips.end(), second.begin(), second.end());
        EXPECT_EQ(chips.size(), 2 * static_cast<std::size_t>(chips_per_word(code)));
        EXPECT_EQ(2 * std::count(chips.begin(), chips.end(), 1),
                  static_cast<std::ptrdiff_t>(chips.size()));
        EXPECT_LE(longest_run(chips), max_run);
      }
    }
    EXPECT_EQ(distinct.size(), words) << "a word is decoded uniquely";
    EXPECT_GT(longest_run(c_ook_preamble(code)), max_run) << "no data contain the preamble";
  }
}

TEST(LineCode, RejectsTooLargeWords) {
  EXPECT_NE(complaint([] { word_chips(LineCode::manchester, 2); }).find("below 2"),
            std::string::npos);
  EXPECT_NE(complaint([] { word_chips(LineCode::code_4b6b, 16); }).find("below 16"),
            std::string::npos);
}

TEST(Code, LightIsLitForAboutHalfThePeriodAndWithinRange) {
  for (const Code& code : all_codes())
    for (const std::uint32_t id : {0u, 85u, 255u}) {
      const Waveform wave = encode_id(id, code);
      double sum = 0;
      std::size_t count = 0;
      for (const auto& channel : wave.chips)
        for (const double light : channel) {
          EXPECT_TRUE(light >= 0 && light <= 1);
          sum += light;
          ++count;
        }
      const double wanted = code.kind == CodeKind::csk ? 11.0 / 12 / 3 : 0.5;
      const double off = code.kind == CodeKind::s2psk ? 0.02 : 1e-9;  // odd numbers of half periods
      EXPECT_NEAR(sum / static_cast<double>(count), wanted, off) << to_string(code.kind);
    }
}

TEST(Code, AllColoursHaveEqualPower) {
  Code code;
  code.kind = CodeKind::csk;
  const Waveform wave = encode_id(0b11100100, code);
  for (std::size_t i = 1; i < wave.chips[0].size(); ++i)
    EXPECT_NEAR(wave.chips[0][i] + wave.chips[1][i] + wave.chips[2][i], 1, 1e-12);
}

TEST(Ufsook, TonesAreThoseOfThePaperAtThirtyFramesPerSecond) {
  Code code;
  code.kind = CodeKind::ufsook;
  const UfsookTones tones = ufsook_tones(code);
  EXPECT_NEAR(tones.mark_hz, 120, 1e-9);
  EXPECT_NEAR(tones.space_hz, 105, 1e-9);
}

TEST(Ufsook, TonesAliasToSameAndOppositeAtAnyFrameRate) {
  for (const double fps : {10.0, 24.0, 25.0, 30.0, 50.0, 60.0, 240.0}) {
    Code code;
    code.kind = CodeKind::ufsook;
    code.frame_rate_hz = fps;
    const UfsookTones tones = ufsook_tones(code);
    const double per_frame = tones.mark_hz / fps;
    EXPECT_NEAR(per_frame, std::round(per_frame), 1e-9);
    EXPECT_NEAR(tones.mark_hz - tones.space_hz, fps / 2, 1e-9);
    EXPECT_GT(tones.space_hz, code.min_hz);
    EXPECT_LE(tones.space_hz, code.min_hz + fps);
  }
}

TEST(S2psk, FramesOfABitAreAQuarterPeriodApartAndTheReferenceIsContinuous) {
  for (const double fps : {10.0, 25.0, 30.0, 60.0}) {
    Code code;
    code.kind = CodeKind::s2psk;
    code.frame_rate_hz = fps;
    const double per_frame = s2psk_hz(code) / fps;
    EXPECT_NEAR(per_frame - std::floor(per_frame), 0.75, 1e-9);
    EXPECT_GT(s2psk_hz(code), code.min_hz);
    const Waveform wave = encode_id(77, code);
    const auto half = static_cast<std::size_t>(std::round(wave.chip_rate_hz / s2psk_hz(code) / 2));
    for (std::size_t i = 0; i < wave.chips[1].size(); ++i)
      EXPECT_EQ(wave.chips[1][i], (i / half) % 2 == 0 ? 1 : 0);
  }
}

TEST(CameraOok, SubPacketIsPartOfThePeriod) {
  for (const LineCode line : {LineCode::manchester, LineCode::code_4b6b}) {
    Code code;
    code.line = line;
    const SlotCode whole = c_ook_slots(code), part = c_ook_sub_packet_slots(code);
    EXPECT_EQ(part.chips, c_ook_sub_packet_chips(code));
    EXPECT_EQ(whole.chips, part.chips * c_ook_sub_packets(code) * code.repeats);
    const Bits payload = payload_bits(173, code);
    Bits bits = bits_of(2, c_ook_sequence_bits(code));
    bits.insert(bits.end(), payload.begin() + 8, payload.begin() + 12);
    const Waveform expected = part.waveform(symbols_of(bits, part.bits_per_symbol));
    const Waveform sent = encode_id(173, code);
    const auto from = sent.chips[0].begin() + 2 * code.repeats * part.chips;
    EXPECT_TRUE(std::equal(expected.chips[0].begin(), expected.chips[0].end(), from));
  }
}

TEST(Code, RejectsInvalidCodesAndIds) {
  Code code;
  EXPECT_NE(complaint([&] { encode_id(256, code); }).find("id must be below 256"),
            std::string::npos);
  code.id_bits = 7;
  EXPECT_NE(complaint([&] { encode_id(1, code); }).find("id_bits"), std::string::npos);
  code = {};
  code.clock_hz = 0;
  EXPECT_NE(complaint([&] { encode_id(1, code); }).find("clock_hz"), std::string::npos);
  code = {};
  code.frame_rate_hz = std::nan("");
  EXPECT_NE(complaint([&] { encode_id(1, code); }).find("frame_rate_hz"), std::string::npos);
  code = {};
  code.repeats = 0;
  EXPECT_NE(complaint([&] { encode_id(1, code); }).find("repeats"), std::string::npos);
}

TEST(Budget, CountsChipsAndReportsTheReason) {
  Code code;  // 18 chips at 10 kHz: 1.8 ms, 90 rows of 20 us
  const CodeBudget fits = code_budget(code, 100, 2e-5, 2e-5);
  EXPECT_TRUE(fits.fits) << fits.message;
  EXPECT_NEAR(fits.chips_in_view, 20, 1e-9);
  EXPECT_NEAR(fits.chips_needed, 18, 1e-9);
  const CodeBudget small = code_budget(code, 60, 2e-5, 2e-5);
  EXPECT_FALSE(small.fits);
  EXPECT_EQ(small.message, "the lamp's image holds 12 chips, c_ook needs 18");
  EXPECT_NE(code_budget(code, 100, 2e-5, 3e-4).message.find("exposure is 3 of the chips"),
            std::string::npos);
  EXPECT_NE(code_budget(code, 1000, 1e-4, 2e-5).message.find("rows are 1 chips apart"),
            std::string::npos);
  EXPECT_FALSE(code_budget(code, 100, 0, 2e-5).fits) << "a global shutter holds no chips";
  EXPECT_TRUE(code_budget(code, 20, 2e-5, 2e-5, true).fits) << "joined by exact times";
  code.kind = CodeKind::ufsook;
  EXPECT_EQ(code_budget(code, 1, 0, 1e-4).frames_needed, 34);
  EXPECT_TRUE(code_budget(code, 1, 0, 1e-4).fits) << "the size of the lamp is irrelevant";
  EXPECT_FALSE(code_budget(code, 1, 0, 5e-3).fits);
  EXPECT_NE(complaint([&] { code_budget(code, -1, 0, 1e-4); }).find("rows"), std::string::npos);
}

TEST(Budget, DetectsFramesSynchronousWithPackets) {
  Code code;
  EXPECT_LT(code_budget(code, 100, 2e-5, 2e-5).frames_needed, 20);
  code.clock_hz = 288 * 30;  // one packet per frame: always the same sub-packet
  EXPECT_NE(code_budget(code, 120, 2e-5, 2e-5).message.find("always fall on the same parts"),
            std::string::npos);
  code.clock_hz = 288 * 30 * 2 / 3.0;  // three different phases
  EXPECT_FALSE(code_budget(code, 200, 2e-5, 2e-5).fits);
}

}  // namespace
}  // namespace occ
