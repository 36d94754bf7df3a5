// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/decode_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libocc/codes/slot_code.hpp"
#include "tests/support/code_samples.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;
using test::Shutter;

struct Case {
  const char* name;
  Code code;
  Shutter shutter;
};

std::ostream& operator<<(std::ostream& to, const Case& shown) { return to << shown.name; }

/// A lamp of 100 rows for codes that are read along the rows, of one row for the others.
std::vector<Case> cases() {
  Case manchester{"manchester", {}, {}}, words{"words", {}, {}}, ufsook{"ufsook", {}, {}},
      s2psk{"s2psk", {}, {}}, csk{"csk", {}, {}};
  manchester.shutter.rows = 100;
  words.code.line = LineCode::code_4b6b;
  words.shutter.rows = 120;
  ufsook.code.kind = CodeKind::ufsook;
  ufsook.shutter.rows = 3;
  s2psk.code.kind = CodeKind::s2psk;
  s2psk.shutter.rows = 3;
  csk.code.kind = CodeKind::csk;
  csk.code.clock_hz = 2000;
  csk.shutter.rows = 60;
  return {manchester, words, ufsook, s2psk, csk};
}

class EveryCode : public testing::TestWithParam<Case> {
 protected:
  DecodedCode read(std::uint32_t id, const Shutter& shutter, std::uint64_t seed = 1,
                   const DecodeSamplesOptions& options = {}) const {
    const Code& code = GetParam().code;
    return decode_samples(shutter.of(encode_id(id, code), seed, code.kind == CodeKind::csk), code,
                          options);
  }
};

INSTANTIATE_TEST_SUITE_P(, EveryCode, testing::ValuesIn(cases()),
                         [](const auto& shown) { return shown.param.name; });

TEST_P(EveryCode, RoundTripsAtAnyPhase) {
  Random random(3);
  for (int trial = 0; trial < 5; ++trial) {
    const auto id = static_cast<std::uint32_t>(random.below(256));
    Shutter shutter = GetParam().shutter;
    shutter.begin_s = random.uniform(0, 2);
    shutter.sigma = 0.1;  // 20 dB
    const DecodedCode read_code = read(id, shutter, static_cast<std::uint64_t>(trial));
    EXPECT_TRUE(read_code.ok()) << to_string(read_code.status) << ": " << read_code.message
                                << " begin " << shutter.begin_s << " id " << id;
    EXPECT_EQ(read_code.id, id);
    EXPECT_GT(read_code.explained, 0.7);
  }
}

TEST_P(EveryCode, RoundTripsWithAClockError) {
  for (const double error : {-1e-4, 1e-4}) {
    Shutter shutter = GetParam().shutter;
    shutter.begin_s = 0.3;
    shutter.clock_error = error;
    shutter.sigma = 0.05;
    shutter.frames = 80;
    const DecodedCode read_code = read(201, shutter);
    EXPECT_EQ(read_code.id, 201u) << to_string(read_code.status) << ": " << read_code.message;
  }
}

TEST_P(EveryCode, FramesMayBeMissing) {
  Shutter shutter = GetParam().shutter;
  shutter.frames = 120;
  const Code& code = GetParam().code;
  std::vector<LightSample> some;
  for (const LightSample& s : shutter.of(encode_id(90, code), 1, code.kind == CodeKind::csk))
    if (s.frame % 5 != 2 && (s.frame < 40 || s.frame > 50)) some.push_back(s);
  const DecodedCode read_code = decode_samples(some, code);
  EXPECT_EQ(read_code.id, 90u) << to_string(read_code.status) << ": " << read_code.message;
}

TEST_P(EveryCode, TooFewFramesAreIncomplete) {
  Shutter shutter = GetParam().shutter;
  shutter.frames = GetParam().code.kind == CodeKind::c_ook ? 1 : 3;
  const DecodedCode read_code = read(90, shutter);
  EXPECT_FALSE(read_code.ok());
  EXPECT_FALSE(read_code.id);
}

TEST_P(EveryCode, SteadyLightAndNoiseContainNoCode) {
  const Code& code = GetParam().code;
  for (const double light : {0.0, 0.5, 1.0})
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      Random random(seed);
      std::vector<LightSample> samples = GetParam().shutter.of(encode_id(1, code));
      for (LightSample& s : samples) {
        s.value = light + 0.3 * random.normal();
        s.sigma = 0.3;
      }
      const DecodedCode read_code = decode_samples(samples, code);
      EXPECT_EQ(read_code.status, CodeStatus::no_signal) << light << read_code.message;
      EXPECT_FALSE(read_code.id);
    }
}

TEST_P(EveryCode, InvalidSamplesAreRejected) {
  const Code& code = GetParam().code;
  EXPECT_EQ(decode_samples({}, code).status, CodeStatus::no_signal);
  const LightSample good{0, 1e-5, 0.5, 0.1, 0, 0};
  LightSample bad = good;
  bad.sigma = 0;
  EXPECT_NE(complaint([&] { decode_samples({good, bad}, code); }).find("sigma"), std::string::npos);
  bad = good;
  bad.value = std::nan("");
  EXPECT_NE(complaint([&] { decode_samples({bad}, code); }).find("value"), std::string::npos);
  bad = good;
  bad.channel = 3;
  EXPECT_NE(complaint([&] { decode_samples({bad}, code); }).find("channel"), std::string::npos);
  DecodeSamplesOptions options;
  options.max_clock_error = -1;
  EXPECT_NE(complaint([&] { decode_samples({good}, code, options); }).find("max_clock_error"),
            std::string::npos);
}

TEST(ColourShift, EstimatesTheCrosstalkOfTheChannels) {
  Code code;
  code.kind = CodeKind::csk;
  code.clock_hz = 2000;
  Eigen::Matrix3d crosstalk;
  crosstalk << 0.9, 0.3, 0.05, 0.2, 0.8, 0.25, 0.02, 0.35, 0.7;
  const Waveform sent = encode_id(0b00011011, code);
  Waveform got = sent;
  for (std::size_t i = 0; i < sent.chips[0].size(); ++i) {
    const Eigen::Vector3d light(sent.chips[0][i], sent.chips[1][i], sent.chips[2][i]);
    for (Eigen::Index c = 0; c < 3; ++c) got.chips[c][i] = crosstalk.row(c).dot(light);
  }
  Shutter shutter;
  shutter.begin_s = 0.0123;
  shutter.sigma = 0.1;
  const DecodedCode read_code = decode_samples(shutter.of(got, 1, true), code);
  EXPECT_EQ(read_code.id, 0b00011011u) << to_string(read_code.status) << read_code.message;
}

TEST(CameraOok, ExactTimesAllowSmallLamps) {
  Shutter shutter;
  shutter.rows = 20;  // four chips of 18
  shutter.begin_s = 0.0371;
  shutter.clock_error = 5e-5;
  shutter.sigma = 0.1;
  const Code code;
  const auto samples = shutter.of(encode_id(114, code));
  DecodeSamplesOptions options;
  EXPECT_FALSE(decode_samples(samples, code, options).ok());
  options.exact_times = true;
  const DecodedCode read_code = decode_samples(samples, code, options);
  EXPECT_EQ(read_code.id, 114u) << read_code.message;
  EXPECT_NEAR(read_code.clock_error, 5e-5, 3e-5);
}

TEST(CameraOok, OneWrongBitFailsTheChecksumAndGivesNoId) {
  Code code;
  const SlotCode slots = slot_code(code);
  Bits bits = payload_bits(17, code);
  bits[5] ^= 1;
  Shutter shutter;
  shutter.rows = 100;
  const DecodedCode read_code =
      decode_samples(shutter.of(slots.waveform(symbols_of(bits, 1))), code);
  EXPECT_EQ(read_code.status, CodeStatus::checksum_failed);
  EXPECT_FALSE(read_code.id);
  EXPECT_EQ(read_code.bits, bits);
}

TEST(Ufsook, AnOverExposedDelimiterGivesNoWrongId) {
  // The delimiter has half the light of a lit lamp; over-exposed, both look alike, and the code may
  // be read with another beginning.
  Code code;
  code.kind = CodeKind::ufsook;
  int right = 0, wrong = 0;
  // Id 10 with another beginning is id 49, checksum included.
  constexpr std::uint32_t id = 10;
  for (std::uint64_t trial = 0; trial < 100; ++trial) {
    Random random(5, trial);
    Shutter shutter;
    shutter.rows = 29;
    shutter.frames = 100;
    shutter.begin_s = random.uniform(0, 2);
    shutter.sigma = 0.02;
    std::vector<LightSample> samples = shutter.of(encode_id(id, code), trial);
    std::vector<double> gain(100);  // of a moving lamp in each frame
    for (double& one : gain) one = 1 + 0.15 * random.normal();
    for (LightSample& sample : samples) {
      sample.value = gain[static_cast<std::size_t>(sample.frame)] * std::min(1.0, 3 * sample.value);
      sample.sigma = 0.05;
    }
    const DecodedCode read_code = decode_samples(samples, code);
    right += read_code.id == id ? 1 : 0;
    wrong += read_code.ok() && read_code.id != id ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0) << right << " right";
  EXPECT_GE(right, 10);
}

/// Bit error rate for a known phase, for a code whose nearest symbols differ by `distance`:
/// amplitude of the light times the square root of the number of samples that differ.
struct ErrorRate {
  double measured = 0, expected = 0;
  int bits = 0;
};
ErrorRate error_rate(const Code& code, const Shutter& shutter, double distance, int trials) {
  Random random(11);
  DecodeSamplesOptions options;
  options.period_start_s = -shutter.begin_s;
  ErrorRate rate;
  int wrong = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto id = static_cast<std::uint32_t>(random.below(256));
    const auto samples = shutter.of(encode_id(id, code), static_cast<std::uint64_t>(trial));
    const DecodedCode read_code = decode_samples(samples, code, options);
    const Bits sent = payload_bits(id, code);
    for (std::size_t i = 0; i < sent.size(); ++i) wrong += sent[i] != read_code.bits[i];
    rate.bits += static_cast<int>(sent.size());
  }
  rate.measured = wrong / static_cast<double>(rate.bits);
  rate.expected = 0.5 * std::erfc(distance / (2 * shutter.sigma) / std::sqrt(2.0));
  return rate;
}

TEST(SlowErrorRate, UfsookHasOneDifferingSamplePerBit) {
  Code code;
  code.kind = CodeKind::ufsook;
  Shutter shutter;
  shutter.rows = 1;
  shutter.frames = 34;
  shutter.begin_s = 2e-3;  // between the edges of both tones
  for (const double sigma : {0.3, 0.45, 0.7}) {
    shutter.sigma = sigma;
    const ErrorRate rate = error_rate(code, shutter, 1, 600);
    const double sigma_of_rate = std::sqrt(rate.expected / rate.bits);
    EXPECT_NEAR(rate.measured, rate.expected, 4 * sigma_of_rate + 0.12 * rate.expected) << sigma;
  }
}

TEST(SlowErrorRate, ManchesterUsesAllItsSamples) {
  Code code;
  code.repeats = 1;  // 72 chips of 100 us, each observed once in a frame of 1000 rows, ...
  Shutter shutter;
  shutter.row_time_s = 1e-4;
  shutter.exposure_s = 1e-4;
  shutter.rows = 72;
  shutter.frames = 1;
  for (const double sigma : {0.5, 0.7, 1.0}) {
    shutter.sigma = sigma;
    const ErrorRate rate = error_rate(code, shutter, std::sqrt(2.0), 1500);
    const double sigma_of_rate = std::sqrt(rate.expected / rate.bits);
    EXPECT_NEAR(rate.measured, rate.expected, 4 * sigma_of_rate + 0.12 * rate.expected) << sigma;
  }
}

TEST(SlowFalseAccepts, WrongIdsAreRarerThanTheChecksumAllows) {
  // Random chips at the clock of the code, and the code itself with noise that causes bit errors.
  for (const Case& test : cases()) {
    int accepted = 0, wrong = 0;
    constexpr int trials = 60;
    for (int trial = 0; trial < trials; ++trial) {
      Random random(static_cast<std::uint64_t>(trial), 7);
      const auto id = static_cast<std::uint32_t>(random.below(256));
      Waveform wave = encode_id(id, test.code);
      Shutter shutter = test.shutter;
      shutter.frames = 36;
      shutter.begin_s = random.uniform(0, 2);
      shutter.sigma = random.uniform(0.3, 4);
      const bool garbled = trial % 2 == 0;
      if (garbled)
        for (auto& channel : wave.chips)
          for (double& chip : channel) chip = random.below(2);
      DecodeSamplesOptions options;
      options.max_clock_error = 2e-5;
      const DecodedCode read_code = decode_samples(
          shutter.of(wave, static_cast<std::uint64_t>(trial), test.code.kind == CodeKind::csk),
          test.code, options);
      accepted += read_code.ok();
      wrong += read_code.ok() && (garbled || read_code.id != id);
    }
    EXPECT_EQ(wrong, 0) << test.name << ", of " << accepted << " accepted";
  }
}

}  // namespace
}  // namespace occ
