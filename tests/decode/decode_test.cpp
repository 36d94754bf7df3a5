// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/decode.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "libocc/core/math.hpp"
#include "libocc/decode/lamp_rows.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;

/// Images of a camera that moves with constant velocity from a pose.
struct Sequence {
  std::vector<Image> images;
  std::vector<double> times_s;
  std::vector<Rigid3> poses;

  Sequence(const Scene& scene, const Rigid3& pose, int frames, const Vector6& velocity,
           double frame_rate_hz = 30) {
    Renderer renderer(scene);
    for (int f = 0; f < frames; ++f) {
      Rendered rendered;
      SimulateOptions options;
      options.frame = static_cast<std::uint32_t>(f);
      options.start_s = f / frame_rate_hz;
      options.velocity = velocity;
      poses.push_back(moved_pose(pose, velocity, options.start_s));
      renderer.render(poses.back(), options, rendered);
      images.push_back(std::move(rendered.image));
      times_s.push_back(options.start_s);
    }
  }

  std::vector<SequenceFrame> frames() const {
    std::vector<SequenceFrame> frames;
    for (std::size_t f = 0; f < images.size(); ++f)
      frames.push_back({images[f].view(), times_s[f]});
    return frames;
  }
};

Rigid3 looking_up(const Eigen::Vector3d& position, double heading_rad) {
  const Eigen::Matrix3d rotation =
      so3_exp(Eigen::Vector3d(0.05, -0.08, 0)) * so3_exp(Eigen::Vector3d(0, 0, heading_rad));
  return {rotation, -(rotation * position)};
}

std::string described(const std::vector<DecodedLamp>& lamps) {
  std::string text;
  for (const DecodedLamp& lamp : lamps)
    text += std::string(to_string(lamp.code.status)) + " " + lamp.code.message + " id " +
            (lamp.code.id ? std::to_string(*lamp.code.id) : "none") + " at " +
            std::to_string(lamp.blob.centroid_px.x()) + ", " +
            std::to_string(lamp.blob.centroid_px.y()) + " seen " + std::to_string(lamp.track.seen) +
            "\n";
  return text;
}

/// Expects that all lamps of the scene are identified, and that the pose from these is near the
/// truth.
void expect_located(const Scene& scene, const Sequence& seen, const DecodeOptions& options,
                    double within_m) {
  const auto decoded = decode_lamps(seen.frames(), scene.sensor, options);
  const auto blobs = identified_blobs(*decoded, scene, options.code);
  std::vector<Match> matches;
  for (int lamp = 0; lamp < static_cast<int>(scene.lamps.size()); ++lamp)
    for (int blob = 0; blob < static_cast<int>(blobs->size()); ++blob)
      if ((*blobs)[blob].lamp_id == scene.lamps[lamp].id) matches.push_back({lamp, blob});
  ASSERT_EQ(matches.size(), scene.lamps.size()) << described(*decoded) << blobs.message;
  const Rigid3& truth = seen.poses[decoded->front().frame];
  const auto refined = refine(truth, matches, *blobs, scene);
  const Eigen::Vector3d error =
      refined->cam_from_world.origin_in_source() - truth.origin_in_source();
  EXPECT_LT(error.norm(), within_m);
}

Scene ufsook_room() { return read_scene(std::string(LIBOCC_DATA) + "/scenes/ufsook_four.yaml"); }

DecodeOptions options_for(const Code& code, int join_frames = 0) {
  DecodeOptions options;
  options.code = code;
  options.join_frames = join_frames;
  return options;
}

/// Square of four large lamps in front of a camera of 1280 x 960 pixels with a row time of 20 us:
/// about 100 rows per lamp, 2 ms.
Scene room_with(const Code& code) {
  Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/coded_four.yaml");
  for (Lamp& lamp : scene.lamps) {
    lamp.set_code({code, 20 + 3 * lamp.id, 0});
    lamp.phase = 0.21 * lamp.id + 0.03;
  }
  return scene;
}

const Rigid3 below = looking_up({1.9, 2.1, 0.2}, 0.05);

TEST(DecodeLamps, FourLampsByUfsookAtThirtyFrames) {
  const Scene scene = ufsook_room();
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 40, Vector6::Zero());
  expect_located(scene, seen, options_for(scene.lamps[0].code->code), 0.01);
}

TEST(SlowDecodeLamps, UfsookUnderAMovingCamera) {
  const Scene scene = ufsook_room();
  Vector6 velocity;
  velocity << 0, 0, 0.1, 0.1, 0.1, 0;
  const Sequence seen(scene, looking_up({1.9, 2.1, 0.3}, 0.1), 45, velocity);
  expect_located(scene, seen, options_for(scene.lamps[0].code->code, 15), 0.03);
}

TEST(DecodeLamps, UfsookUnderAGlobalShutter) {
  Scene scene = ufsook_room();
  scene.sensor.row_time_s = 0;
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 40, Vector6::Zero());
  expect_located(scene, seen, options_for(scene.lamps[0].code->code), 0.01);
}

TEST(DecodeLamps, CameraOokByRows) {
  for (const LineCode line : {LineCode::manchester, LineCode::code_4b6b}) {
    Code code;
    code.line = line;
    code.clock_hz = line == LineCode::manchester ? 10000 : 12500;
    const Scene scene = room_with(code);
    expect_located(scene, Sequence(scene, below, 30, Vector6::Zero()), options_for(code), 0.01);
  }
}

// The ceiling reflects lamps at mains frequency: its light changes from line to line.
TEST(LampLines, AreFreeOfFlickeringAmbientLight) {
  constexpr int size = 300, half = 40, centre = 150;
  constexpr double lamp_dn = 60, ambient_dn = 40, depth = 0.5, flicker_hz = 100;
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    Sensor sensor;
    sensor.row_time_s = 3e-5;
    sensor.readout = readout;
    Image image{size, size, 1, PixelType::u8, std::vector<std::uint8_t>(size * size), {}};
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        const int line = readout == Readout::rows ? y : x;
        const bool lit = std::abs(x - centre) <= half && std::abs(y - centre) <= half;
        const double flicker = std::sin(2 * pi * flicker_hz * line * sensor.row_time_s);
        image.u8[static_cast<std::size_t>(y * size + x)] = static_cast<std::uint8_t>(std::lround(
            sensor.black_level_dn + ambient_dn * (1 + depth * flicker) + lit * lamp_dn));
      }
    const LampWindow window{{centre, centre}, half + 3, half + 3};
    for (const LineLight& light : lamp_lines(image.view(), sensor, 0, window)) {
      if (std::abs(light.line) > half) continue;
      EXPECT_NEAR(light.value_dn, (2 * half + 1) * lamp_dn, 0.02 * (2 * half + 1) * lamp_dn)
          << light.line;
    }
  }
}

TEST(SlowDecodeLamps, CameraOokWithColumnReadout) {
  Scene scene = room_with({});
  scene.sensor.readout = Readout::columns;
  expect_located(scene, Sequence(scene, below, 30, Vector6::Zero()), options_for({}), 0.01);
}

TEST(SlowDecodeLamps, CameraOokUnderAMovingCamera) {
  const Scene scene = room_with({});
  Vector6 velocity;
  velocity << 0, 0, 0.1, 0.1, 0.05, 0;
  expect_located(scene, Sequence(scene, below, 30, velocity), options_for({}, 15), 0.03);
}

TEST(SlowDecodeLamps, PartlyOccludedLampsAreDecoded) {
  const Code code;
  Scene scene = room_with(code);
  for (const Lamp& lamp : scene.lamps) {  // a third of its face is occluded from one side
    Box box;
    box.min_m = lamp.centre_m + Eigen::Vector3d(0.05, -0.3, -0.06);
    box.max_m = lamp.centre_m + Eigen::Vector3d(0.4, 0.3, -0.02);
    scene.boxes.push_back(box);
  }
  const Sequence seen(scene, below, 30, Vector6::Zero());
  const auto decoded = decode_lamps(seen.frames(), scene.sensor, options_for(code));
  const auto blobs = identified_blobs(*decoded, scene, code);
  std::set<int> names;
  for (const Blob& blob : *blobs) names.insert(blob.lamp_id.value_or(-1));
  EXPECT_EQ(names, (std::set<int>{0, 1, 2, 3})) << described(*decoded);
}

TEST(SlowDecodeLamps, PairsByS2psk) {
  Code code;
  code.kind = CodeKind::s2psk;
  Scene scene = ufsook_room();
  const std::size_t pairs = scene.lamps.size() / 2;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {  // data lamps 0 and 1, references 2 and 3
    Lamp& lamp = scene.lamps[i];
    const std::size_t pair = i % pairs;
    lamp.centre_m = {pair == 0 ? 1.2 : 2.8, i < pairs ? 1.9 : 2.3, 3};
    lamp.set_code({code, 100 + static_cast<int>(pair), i < pairs ? 0 : 1});
    lamp.phase = pair == 0 ? 0.31 : 0.77;
  }
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 40, Vector6::Zero());
  const auto decoded = decode_lamps(seen.frames(), scene.sensor, options_for(code));
  const auto blobs = identified_blobs(*decoded, scene, code);
  std::multiset<int> names;
  for (const Blob& blob : *blobs) names.insert(blob.lamp_id.value_or(-1));
  EXPECT_EQ(names, (std::multiset<int>{-1, -1, scene.lamps[0].id, scene.lamps[1].id}))
      << described(*decoded);
}

TEST(SlowDecodeLamps, ColoursByCsk) {
  Code code;
  code.kind = CodeKind::csk;
  code.clock_hz = 2000;
  Scene map = room_with({});
  Scene scene = map;
  scene.sensor.mosaic = Mosaic::rggb;
  scene.lamps.clear();
  for (const Lamp& lamp : map.lamps)
    for (int emitter = 0; emitter < 3; ++emitter) {
      Lamp part = lamp;
      part.id = 10 * lamp.id + emitter;
      part.set_code({code, 30 + lamp.id, emitter});
      part.colour = Eigen::Vector3d::Constant(0.15);  // light that passes the other filters
      part.colour[emitter] = 1;
      scene.lamps.push_back(part);
    }
  const Sequence seen(scene, below, 60, Vector6::Zero());
  const auto decoded = decode_lamps(seen.frames(), scene.sensor, options_for(code));
  std::set<int> ids;
  for (const DecodedLamp& lamp : *decoded)
    if (lamp.code.id) ids.insert(static_cast<int>(*lamp.code.id));
  EXPECT_EQ(ids, (std::set<int>{30, 31, 32, 33})) << described(*decoded);
}

TEST(DecodeLamps, BadSequences) {
  const Scene scene = ufsook_room();
  const DecodeOptions options = options_for(scene.lamps[0].code->code);
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 3, Vector6::Zero());
  std::vector<SequenceFrame> frames = seen.frames();
  const auto complaint_of = [&](const DecodeOptions& with) {
    return complaint([&] { decode_lamps(frames, scene.sensor, with); });
  };
  std::swap(frames[1].time_s, frames[2].time_s);
  EXPECT_NE(complaint_of(options).find("times_s[2] must be after the frame before it"),
            std::string::npos);
  frames[2].time_s = frames[1].time_s;  // repeated
  EXPECT_NE(complaint_of(options).find("times_s[2]"), std::string::npos);
  frames = seen.frames();
  frames[1].image.width -= 8;
  EXPECT_NE(complaint_of(options).find("frames[1] must be like the first"), std::string::npos);
  frames.clear();
  EXPECT_NE(complaint_of(options).find("frames"), std::string::npos);
  frames = seen.frames();
  DecodeOptions wrong = options;
  wrong.join_frames = -1;
  EXPECT_NE(complaint_of(wrong).find("join_frames"), std::string::npos);
  wrong = options;
  wrong.code.kind = CodeKind::csk;
  EXPECT_NE(complaint_of(wrong).find("mosaic"), std::string::npos);
}

TEST(DecodeLamps, DarkImagesAndCodesThatDoNotFit) {
  Scene scene = ufsook_room();
  DecodeOptions options = options_for(scene.lamps[0].code->code);
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 5, Vector6::Zero());
  options.code = Code{};  // 18 chips at 10 kHz in lamps of 25 rows of 30 us
  const auto small = decode_lamps(seen.frames(), scene.sensor, options);
  ASSERT_FALSE(small->empty());
  for (const DecodedLamp& lamp : *small) {
    EXPECT_EQ(lamp.code.status, CodeStatus::no_signal);
    EXPECT_NE(lamp.code.message.find("not tried: the exposure is 2"), std::string::npos)
        << lamp.code.message;
  }
  scene.lamps.clear();
  const Sequence dark(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 5, Vector6::Zero());
  const auto none = decode_lamps(dark.frames(), scene.sensor, options);
  EXPECT_EQ(none.status, Status::no_lamps);
  EXPECT_EQ(identified_blobs(*none, scene, options.code).status, Status::no_lamps);
}

TEST(DecodeLamps, AStarrySkyTakesBoundedTime) {
  Random random(9);
  std::vector<Image> skies(4);
  for (Image& sky : skies) {
    sky.width = 640;
    sky.height = 480;
    sky.u8.assign(640 * 480, 2);
    for (int star = 0; star < 3000; ++star) {
      const int at = random.below(640 * 478 - 2);
      for (const int pixel : {at, at + 1, at + 640, at + 641}) sky.u8[pixel] = 200;
    }
  }
  std::vector<SequenceFrame> frames;
  for (std::size_t f = 0; f < skies.size(); ++f)
    frames.push_back({skies[f].view(), static_cast<double>(f) / 30});
  const Scene scene = ufsook_room();
  DecodeOptions options = options_for(scene.lamps[0].code->code, 1);
  options.min_seen = 1;
  const auto decoded = decode_lamps(frames, scene.sensor, options);
  EXPECT_LE(decoded->size(), 64u);
  for (const DecodedLamp& lamp : *decoded) EXPECT_FALSE(lamp.code.id);
}

TEST(IdentifiedBlobs, NeedAUniqueIdThatTheMapContains) {
  const Scene scene = ufsook_room();
  const Code code = scene.lamps[0].code->code;
  std::vector<DecodedLamp> lamps(4);
  const std::array<std::uint32_t, 4> said{1, 2, 2, 99};
  for (std::size_t i = 0; i < 4; ++i) {
    lamps[i].code.id = said[i];
    lamps[i].blob.centroid_px = {100.0 * static_cast<double>(i), 50};
  }
  const auto blobs = identified_blobs(lamps, scene, code);
  EXPECT_EQ((*blobs)[0].lamp_id, 1);
  EXPECT_EQ((*blobs)[1].lamp_id, std::nullopt);
  EXPECT_EQ((*blobs)[2].lamp_id, std::nullopt);
  EXPECT_EQ((*blobs)[3].lamp_id, std::nullopt);
  EXPECT_NE(blobs.message.find("not in the map: 99"), std::string::npos);
  EXPECT_NE(blobs.message.find("not assigned to any lamp: 2"), std::string::npos);
  lamps[2].blob.centroid_px =
      lamps[1].blob.centroid_px + Eigen::Vector2d(1, -1);  // part of the same lamp
  lamps[2].blob.flux_dn = 10;
  const auto pieces = identified_blobs(lamps, scene, code);
  EXPECT_EQ((*pieces)[1].lamp_id, std::nullopt);
  EXPECT_EQ((*pieces)[2].lamp_id, 2) << "the brightest";
  Scene twice = scene;
  twice.lamps[1].set_code({code, 1, 0});
  EXPECT_NE(complaint([&] { identified_blobs(lamps, twice, code); }).find("of one lamp only"),
            std::string::npos);
  EXPECT_NE(complaint([&] { twice.validate(); }).find("lamp 1 has the same id"), std::string::npos);
}

}  // namespace
}  // namespace occ
