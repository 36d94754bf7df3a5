// SPDX-License-Identifier: Apache-2.0
// Codes of lamps in scenes and their files.
#include <gtest/gtest.h>

#include <string>

#include "libocc/scene/scene_file.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;

Scene with_lamps(const std::string& lamps) {
  return parse_scene(
      "schema: libocc-scene/1\ncamera: {width_px: 640, height_px: 480, fx_px: 400}\nlamps:\n" +
      lamps);
}

std::string lamp(int id, const std::string& more) {
  return "  - {id: " + std::to_string(id) + ", centre_m: [" + std::to_string(id) +
         ", 0, 3], radius_m: 0.1, " + more + "}\n";
}

std::string file_complaint(const std::string& lamps) {
  return complaint<std::runtime_error>([&] { with_lamps(lamps); });
}

TEST(LampCode, TheReaderSetsTheWaveform) {
  const Scene scene = with_lamps(lamp(17, "code: {kind: c_ook, clock_hz: 4000, line: 4b6b}"));
  const Lamp& read = scene.lamps[0];
  Code code;
  code.clock_hz = 4000;
  code.line = LineCode::code_4b6b;
  const Waveform wave = encode_id(17, code);
  EXPECT_EQ(read.waveform, wave.chips[0]);
  EXPECT_EQ(read.frequency_hz, wave.frequency_hz());
  EXPECT_EQ(read.code, (LampCode{code, 17, 0}));
}

TEST(LampCode, FilesReadBackEqual) {
  const Scene scene = with_lamps(lamp(1, "code: {kind: ufsook, id: 90, frame_rate_hz: 25}") +
                                 lamp(2, "code: {kind: s2psk, id: 3, channel: 1}") +
                                 lamp(3, "code: {kind: csk, clock_hz: 2000, channel: 2}") +
                                 lamp(4, "code: {kind: c_ook, checksum: crc16, repeats: 2}") +
                                 lamp(5, "frequency_hz: 1000"));
  const std::string text = format_scene(scene);
  EXPECT_EQ(text.find("waveform"), std::string::npos) << "the code implies it";
  const Scene again = parse_scene(text);
  EXPECT_EQ(format_scene(again), text);
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    EXPECT_EQ(again.lamps[i].code, scene.lamps[i].code);
    EXPECT_EQ(again.lamps[i].waveform, scene.lamps[i].waveform);
    EXPECT_EQ(again.lamps[i].frequency_hz, scene.lamps[i].frequency_hz);
  }
}

TEST(LampCode, AnOwnWaveformIsKept) {
  Scene scene = with_lamps(lamp(1, "code: {kind: ufsook}"));
  scene.lamps[0].waveform = {0.5, 1};
  EXPECT_EQ(parse_scene(format_scene(scene)).lamps[0].waveform, scene.lamps[0].waveform);
}

TEST(LampCode, ValidateSetsTheWaveformOfACode) {
  Lamp made = test::disc_lamp(7, {0, 0, 3});
  made.code = LampCode{{}, 7, 0};
  made.validate();
  EXPECT_EQ(made.waveform, encode_id(7, {}).chips[0]);
  made.code->id = 300;
  made.waveform.clear();
  EXPECT_NE(complaint([&] { made.validate(); }).find("id must be below 256"), std::string::npos);
}

TEST(LampCode, BadKeysAreNamed) {
  EXPECT_NE(file_complaint(lamp(1, "code: {kind: ufsok}")).find("ufsook"), std::string::npos);
  EXPECT_NE(file_complaint(lamp(1, "code: {id: 3}")).find("kind"), std::string::npos);
  EXPECT_NE(file_complaint(lamp(300, "code: {kind: ufsook}")).find("below 256"), std::string::npos);
  EXPECT_NE(file_complaint(lamp(1, "code: {kind: ufsook, channel: 1}")).find("channel"),
            std::string::npos);
  EXPECT_NE(file_complaint(lamp(1, "code: {kind: ufsook, clock: 1}")).find("clock_hz"),
            std::string::npos);
  EXPECT_NE(
      file_complaint(lamp(1, "code: {kind: ufsook}, frequency_hz: 5")).find("together with `code`"),
      std::string::npos);
  EXPECT_NE(file_complaint(lamp(1, "code: {kind: ufsook, id: 9}") +
                           lamp(2, "code: {kind: ufsook, id: 9}"))
                .find("lamp 1 has the same id"),
            std::string::npos);
}

}  // namespace
}  // namespace occ
