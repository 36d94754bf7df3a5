// SPDX-License-Identifier: Apache-2.0
// Scene files with Lame curves, waveforms and lens parameters.
#include <cmath>

#include "libocc/scene/scene_file.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

std::string scene_text(const std::string& lamp, const std::string& rest = "") {
  return "schema: libocc-scene/1\ncamera: {width_px: 640, height_px: 480, fx_px: 500}\n"
         "lamps:\n  - {id: 0, centre_m: [0, 0, 3], " +
         lamp + "}\n" + rest;
}
std::string complaint_about(const std::string& lamp, const std::string& rest = "") {
  return complaint<std::runtime_error>([&] { parse_scene(scene_text(lamp, rest), "s.yaml"); });
}

TEST(SceneOptics, ALameCurveIsReadAndWritten) {
  const Scene scene =
      parse_scene(scene_text("shape: lame, size_m: [0.6, 0.3], x_axis: [0, 2, 0], exponent: 2.5"));
  const Lamp& lamp = scene.lamps[0];
  EXPECT_EQ(lamp.shape, LampShape::lame);
  EXPECT_EQ(lamp.size_m, Eigen::Vector2d(0.6, 0.3));
  EXPECT_EQ(lamp.x_axis, Eigen::Vector3d::UnitY());
  EXPECT_EQ(lamp.exponent, 2.5);
  EXPECT_EQ(format_scene(parse_scene(format_scene(scene))), format_scene(scene));
  EXPECT_EQ(parse_scene(format_scene(scene)).lamps[0].exponent, 2.5);
}

TEST(SceneOptics, ErrorsOfALameCurveAreReported) {
  const std::string at = "s.yaml:4: key `lamps[0].";
  const std::string lame = "shape: lame, size_m: [0.6, 0.3], ";
  EXPECT_EQ(complaint_about("shape: lame, exponent: 2"), at + "size_m`: is missing");
  EXPECT_EQ(complaint_about("shape: lame, size_m: [1, 1]"), at + "exponent`: is missing");
  EXPECT_EQ(complaint_about(lame + "exponent: 0.9"),
            at + "exponent`: must be in [1, 100], got 0.9");
  EXPECT_EQ(complaint_about(lame + "exponent: 101"),
            at + "exponent`: must be in [1, 100], got 101");
  EXPECT_EQ(complaint_about("shape: lame, size_m: [1, -1], exponent: 2"),
            at + "size_m`: must be two positive lengths, got [1, -1]");
  EXPECT_EQ(complaint_about(lame + "exponent: 2, x_axis: [0, 0, 1]"),
            at + "x_axis`: must be not parallel to the normal, got [0, 0, 1]");
  EXPECT_EQ(complaint_about(lame + "exponent: 2, radius_m: 1").find(at + "radius_m`: is not known"),
            0u);
  EXPECT_EQ(complaint_about("radius_m: 1, exponent: 2").find(at + "exponent`: is not known"), 0u);
}

TEST(SceneOptics, WaveformsAreReadAndTheirErrorsReported) {
  const Scene scene = parse_scene(
      scene_text("radius_m: 0.1, frequency_hz: 500, waveform: [1, 0, 0.5], phase: -0.25"));
  EXPECT_EQ(scene.lamps[0].waveform, (std::vector<double>{1, 0, 0.5}));
  EXPECT_EQ(scene.lamps[0].phase, -0.25);
  EXPECT_EQ(parse_scene(format_scene(scene)).lamps[0].waveform, scene.lamps[0].waveform);
  const std::string at = "s.yaml:4: key `lamps[0].";
  EXPECT_EQ(complaint_about("radius_m: 1, waveform: [1, 0]"),
            "s.yaml:4: key `lamps[0]`: lamp 0: frequency_hz must be given together with "
            "`waveform`, got none");
  const std::string coded = "radius_m: 1, frequency_hz: 500, waveform: ";
  EXPECT_EQ(complaint_about(coded + "[1, 1.5]"),
            at + "waveform`: must be a list of levels in [0, 1], got 1.5");
  EXPECT_EQ(complaint_about(coded + "[0, 0]"),
            at + "waveform`: must be above zero in a part of the period, got 0");
}

TEST(SceneOptics, TheLensIsReadAndWritten) {
  const std::string disc = "radius_m: 0.1";
  EXPECT_FALSE(parse_scene(scene_text(disc)).lens.focus_distance_m);
  const Scene scene = parse_scene(scene_text(
      disc, "lens: {diffraction: true, focus_distance_m: 1.5, vignetting: [-0.3, 0.05]}\n"));
  for (const Scene& s : {scene, parse_scene(format_scene(scene))}) {
    EXPECT_TRUE(s.lens.diffraction);
    EXPECT_EQ(s.lens.focus_distance_m, 1.5);
    EXPECT_EQ(s.lens.vignetting, (std::vector<double>{-0.3, 0.05}));
  }
}

TEST(SceneOptics, ErrorsOfTheLensAreReported) {
  const std::string disc = "radius_m: 0.1";
  EXPECT_EQ(complaint_about(disc, "lens: {focus_distance_m: 0}\n"),
            "s.yaml:5: key `lens.focus_distance_m`: must be positive, got 0");
  EXPECT_EQ(complaint_about(disc, "lens: {diffraction: maybe}\n"),
            "s.yaml:5: key `lens.diffraction`: must be one of false, true, got maybe");
  for (const char* coefficients : {"[-1.2]", "[0.1]", "[0, -1]"})
    EXPECT_NE(complaint_about(disc, std::string("lens: {vignetting: ") + coefficients + "}\n")
                  .find("vignetting`: must be a transmission in (0, 1] over the whole image"),
              std::string::npos)
        << coefficients;
  EXPECT_NE(complaint_about(disc, "lens: {focus: 2}\n").find("`lens.focus`: is not known"),
            std::string::npos);
}

}  // namespace
