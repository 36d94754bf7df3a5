// SPDX-License-Identifier: Apache-2.0
// The key `photometry` of a lamp in scene files.
#include <filesystem>

#include "libocc/radiometry/emission_profile.hpp"
#include "libocc/scene/scene_file.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace occ;

std::string scene_text(const std::string& lamp_keys) {
  return "schema: libocc-scene/1\n"
         "camera: {model: pinhole, width_px: 640, height_px: 480, fx_px: 500, fy_px: 500, "
         "cx_px: 320, cy_px: 240}\n"
         "lamps:\n"
         "  - {id: 3, centre_m: [0, 0, 2.5], " +
         lamp_keys + "}\n";
}

/// A folder with a file for each opening.
struct Room {
  Room() {
    add("disc.ies", "-0.17 -0.17 0");
    add("panel.ies", "0.3 1.2 0");
    add("oval.ies", "-0.2 -0.4 0");
    add("point.ies", "0 0 0");
    add("wall.ies", "-0.2 0 -0.2");
  }
  void add(const std::string& name, const std::string& opening) {
    folder.file(name, test::lm63_text(test::batwing, test::steps_deg(10, 90),
                                      test::steps_deg(30, 360), opening));
  }
  Lamp lamp(const std::string& keys) {
    return read_scene(folder.file("room.yaml", scene_text(keys))).lamps.at(0);
  }
  std::string error(const std::string& keys) {
    return test::complaint<std::runtime_error>([&] { lamp(keys); });
  }

  test::Folder folder;
};

TEST(PhotometryKey, TakesShapeAndSizeFromTheFile) {
  Room room;
  const Lamp disc = room.lamp("photometry: {file: disc.ies}");
  ASSERT_TRUE(disc.photometry);
  EXPECT_EQ(disc.shape, LampShape::disc);
  EXPECT_NEAR(disc.radius_m, 0.085, 1e-12);
  const Lamp panel = room.lamp("photometry: panel.ies, x_axis: [0, 1, 0]");
  EXPECT_EQ(panel.shape, LampShape::rectangle);
  EXPECT_TRUE(panel.size_m.isApprox(Eigen::Vector2d(1.2, 0.3)));
  EXPECT_EQ(panel.x_axis, Eigen::Vector3d::UnitY());
  const Lamp oval = room.lamp("photometry: oval.ies");
  EXPECT_EQ(oval.shape, LampShape::lame);
  EXPECT_EQ(oval.exponent, 2);
  EXPECT_TRUE(oval.size_m.isApprox(Eigen::Vector2d(0.4, 0.2)));
  EXPECT_EQ(room.lamp("photometry: point.ies").shape, LampShape::point);
}

TEST(PhotometryKey, ExplicitKeysOverrideTheFile) {
  Room room;
  EXPECT_EQ(room.lamp("photometry: panel.ies, radius_m: 0.1").shape, LampShape::disc);
  EXPECT_EQ(room.lamp("photometry: panel.ies, radius_m: 0.1").radius_m, 0.1);
  EXPECT_EQ(room.lamp("photometry: panel.ies, size_m: [1, 2]").size_m, Eigen::Vector2d(1, 2));
  EXPECT_NEAR(room.lamp("photometry: disc.ies, shape: disc").radius_m, 0.085, 1e-12);
  EXPECT_EQ(room.lamp("photometry: disc.ies, shape: point").shape, LampShape::point);
  EXPECT_EQ(room.lamp("photometry: wall.ies, shape: disc, radius_m: 0.2").radius_m, 0.2);
  EXPECT_TRUE(room.lamp("photometry: panel.ies, shape: rectangle")
                  .size_m.isApprox(Eigen::Vector2d(1.2, 0.3)));
  // x_axis is C = 0 of a disc's photometry.
  EXPECT_EQ(room.lamp("photometry: disc.ies, x_axis: [0, 1, 0]").x_axis, Eigen::Vector3d::UnitY());
}

TEST(PhotometryKey, ErrorsNameTheKeyAndTheFile) {
  Room room;
  const std::string yaml = (room.folder.path() / "room.yaml").string();
  const std::string missing = room.error("photometry: none.ies");
  EXPECT_EQ(missing.find(yaml + ":4: key `lamps[0].photometry`: "), 0u) << missing;
  EXPECT_NE(missing.find("none.ies: cannot be read"), std::string::npos) << missing;
  EXPECT_NE(
      room.error("photometry: disc.ies, half_power_deg: 60")
          .find("key `lamps[0].half_power_deg`: must not be given together with `photometry`"),
      std::string::npos);
  EXPECT_NE(room.error("photometry: panel.ies, shape: disc").find("radius_m"), std::string::npos);
  EXPECT_NE(room.error("photometry: wall.ies").find("faces sideways"), std::string::npos);
  EXPECT_NE(room.error("photometry: {name: disc.ies}").find("photometry.file"), std::string::npos);
  room.folder.file("bad.ies", "IESNA91\nTILT=NONE\n1 1 1 2 1 1 1 0 0 0\n1 1 1\n0 90\n0\n1 -1\n");
  EXPECT_NE(room.error("photometry: bad.ies").find("bad.ies:7: candela value 2 of plane 1"),
            std::string::npos);
}

TEST(PhotometryKey, SavingKeepsTheFile) {
  Room room;
  const std::string path =
      room.folder.file("room.yaml", scene_text("photometry: {file: disc.ies}, x_axis: [0, 1, 0]"));
  const Scene scene = read_scene(path);
  std::filesystem::create_directories(room.folder.path() / "copy");
  const std::string copy = (room.folder.path() / "copy" / "room.yaml").string();
  write_scene(copy, scene);
  const Scene read = read_scene(copy);
  EXPECT_EQ(read.lamps[0].x_axis, Eigen::Vector3d::UnitY());
  EXPECT_EQ(read.lamps[0].radius_m, scene.lamps[0].radius_m);
  ASSERT_TRUE(read.lamps[0].photometry);
  EXPECT_TRUE(std::filesystem::equivalent(read.lamps[0].photometry->distribution().file,
                                          room.folder.path() / "disc.ies"));
  EXPECT_EQ(format_scene(parse_scene(format_scene(scene))), format_scene(scene));
  EXPECT_EQ(format_scene(scene).find("half_power_deg"), std::string::npos);

  Scene unnamed = scene;
  unnamed.lamps[0].photometry = test::profile_of(test::batwing, 10, 30);
  EXPECT_NE(test::complaint([&] { format_scene(unnamed); }).find("lamp 3: photometry must be"),
            std::string::npos);
}

TEST(PhotometryKey, LampsOfOneFileShareTheProfile) {
  Room room;
  std::string text = scene_text("photometry: disc.ies");
  text += "  - {id: 4, centre_m: [1, 0, 2.5], photometry: disc.ies}\n";
  const Scene scene = read_scene(room.folder.file("room.yaml", text));
  EXPECT_EQ(scene.lamps[0].photometry, scene.lamps[1].photometry);
}

}  // namespace
