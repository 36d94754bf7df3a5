// SPDX-License-Identifier: Apache-2.0
// The sample images are what the renderer makes of their scenes today: after a change of either,
// run tools/make_samples.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "libocc/core/image_file.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/simulate.hpp"

namespace {

using namespace occ;
namespace fs = std::filesystem;

const fs::path data = LIBOCC_DATA;

Rigid3 pose_of(const YAML::Node& rows) {
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix(row, column) = rows[row][column].as<double>();
  return Rigid3::from_matrix(matrix);
}

TEST(Samples, AreWhatTheirScenesAndTruthSay) {
  int found = 0;
  for (const auto& entry : fs::directory_iterator(data / "images")) {
    if (entry.path().extension() != ".json") continue;
    ++found;
    const std::string name = entry.path().stem().string();
    const YAML::Node truth = YAML::LoadFile(entry.path().string());
    const Scene scene =
        read_scene((data / "scenes" / (truth["scene"].as<std::string>() + ".yaml")).string());
    SimulateOptions options;
    options.seed = truth["seed"].as<std::uint64_t>();
    const Rendered rendered = simulate(scene, pose_of(truth["cam_from_world"]), options);
    const fs::path file = fs::path(entry.path()).replace_extension(".png");
    const Image image = read_image(file.string());
    ASSERT_EQ(image.u8.size(), rendered.image.u8.size()) << name;
    int different = 0;
    for (std::size_t i = 0; i < image.u8.size(); ++i)
      different += image.u8[i] != rendered.image.u8[i];
    EXPECT_LE(different, 10) << name;  // another libm may round a pixel the other way
    ASSERT_EQ(truth["lamps"].size(), rendered.lamps.size()) << name;
    for (std::size_t i = 0; i < rendered.lamps.size(); ++i) {
      const YAML::Node& lamp = truth["lamps"][i];
      EXPECT_EQ(lamp["whole"].as<bool>(), rendered.lamps[i].whole) << name;
      EXPECT_NEAR(lamp["image_centre_px"][0].as<double>(), rendered.lamps[i].image_centre_px.x(),
                  1e-9)
          << name;
    }
    EXPECT_LT(fs::file_size(file), 300000u) << name;
  }
  EXPECT_EQ(found, 5);
}

}  // namespace
