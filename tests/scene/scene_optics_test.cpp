// SPDX-License-Identifier: Apache-2.0
// Scene files with Lame curves, waveforms and lens parameters.
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"
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

TEST(SceneOptics, APolygonIsReadAndWritten) {
  const std::string text =
      "shape: polygon, corners_m: [[0, 0.2], [0.4, 0.2], [0.4, 0], [0, 0]], x_axis: [0, 2, 0]";
  const Scene scene = parse_scene(scene_text(text));
  const Lamp& lamp = scene.lamps[0];
  EXPECT_EQ(lamp.shape, LampShape::polygon);
  // Counter-clockwise about the centroid, to which the centre moved: x_axis is +y of the world, and
  // its lit side, below, is seen with y of the lamp towards +x.
  ASSERT_EQ(lamp.corners_m.size(), 4u);
  EXPECT_LT((lamp.corners_m[0] - Eigen::Vector2d(-0.2, -0.1)).norm(), 1e-12);
  EXPECT_LT((lamp.corners_m[1] - Eigen::Vector2d(0.2, -0.1)).norm(), 1e-12);
  EXPECT_LT((lamp.centre_m - Eigen::Vector3d(0.1, 0.2, 3)).norm(), 1e-12);
  EXPECT_NEAR(lamp.area_m2(), 0.08, 1e-15);
  EXPECT_NEAR(lamp.reach_m(), std::hypot(0.2, 0.1), 1e-15);
  EXPECT_EQ(format_scene(parse_scene(format_scene(scene))), format_scene(scene));
  EXPECT_TRUE(scene.has_straight_sides());
}

TEST(SceneOptics, ErrorsOfAPolygonAreReported) {
  const std::string at = "s.yaml:4: key `lamps[0].corners_m`: ";
  const auto about = [&](const std::string& corners) {
    return complaint_about("shape: polygon, corners_m: " + corners);
  };
  EXPECT_EQ(complaint_about("shape: polygon"), at + "is missing");
  EXPECT_EQ(about("[[0, 0], [1, 0]]"), at + "must be at least three corners, got 2 corners");
  EXPECT_EQ(about("[[0, 0], [1, 0, 0], [1, 1]]"),
            at + "must be a list of lists of 2 finite numbers, got a list of 3 in it");
  const std::string rule =
      at + "must be the corners of a polygon that does not cross or touch itself";
  EXPECT_EQ(about("[[0, 0], [1, 1], [1, 0], [0, 1]]"), rule + ", got sides 1-2 and 3-4 that meet");
  EXPECT_EQ(about("[[0, 0], [2, 0], [2, 1], [1, 0], [0, 1]]"),
            rule + ", got sides 1-2 and 3-4 that meet");
  EXPECT_EQ(about("[[0, 0], [0, 0], [1, 0], [0, 1]]"), rule + ", got a side 1-2 of no length");
  EXPECT_EQ(about("[[0, 0], [1, 0], [2, 0]]"),
            rule + ", got a side 3-1 that runs back along side 2-3");
  EXPECT_EQ(complaint_about("radius_m: 1, corners_m: [[0, 0], [1, 0], [0, 1]]")
                .find("s.yaml:4: key `lamps[0].corners_m`: is not known"),
            0u);
}

TEST(SceneOptics, TrianglesOfAPolygonCoverIt) {
  Lamp lamp;
  EXPECT_TRUE(lamp.face_triangles().empty());
  lamp.shape = LampShape::polygon;
  Random random(3);
  for (int n = 0; n < 200; ++n) {
    lamp.corners_m.clear();
    const int count = 3 + static_cast<int>(random.below(9));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * pi * (i + random.uniform(0, 0.9)) / count;
      const double radius = random.uniform(0.05, 1);
      lamp.corners_m.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    lamp.validate();
    const auto triangles = lamp.face_triangles();
    ASSERT_EQ(triangles.size(), lamp.corners_m.size() - 2);
    double area_m2 = 0;
    for (const auto& [i, j, k] : triangles) {
      const auto at = [&](int c) { return lamp.corners_m[static_cast<std::size_t>(c)]; };
      const Eigen::Vector2d a = at(j) - at(i), b = at(k) - at(i);
      const double twice = a.x() * b.y() - a.y() * b.x();
      EXPECT_GT(twice, 0);
      area_m2 += twice / 2;
      const Eigen::Vector2d middle = (at(i) + at(j) + at(k)) / 3;
      EXPECT_TRUE(internal::scene::contains(lamp.corners_m, middle));
    }
    EXPECT_NEAR(area_m2, lamp.area_m2(), 1e-12);
  }
  EXPECT_FALSE(internal::scene::contains(lamp.corners_m, {2, 0}));
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
