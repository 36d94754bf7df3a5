// SPDX-License-Identifier: Apache-2.0
// The whole path on images this project did not make: photographs of blinking lamps, and rooms
// rendered by an independent path tracer. They are not part of the project; without them these
// tests are skipped.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/position/locate.hpp"

namespace occ {
namespace {

namespace fs = std::filesystem;

struct Case {
  Scene scene;
  Image image;
  YAML::Node meta;
};

Eigen::Vector3d vector3(const YAML::Node& node) {
  return {node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
}

Case read_photograph(const fs::path& json) {
  Case c;
  c.meta = YAML::LoadFile(json.string());
  c.image = read_image((json.parent_path() / c.meta["image"].as<std::string>()).string());
  const double f = c.meta["focal_length_px"].as<double>();
  c.scene.camera = Camera::pinhole(c.image.width, c.image.height, f, f, 0.5 * (c.image.width - 1),
                                   0.5 * (c.image.height - 1));
  c.scene.sensor.row_time_s = 1 / c.meta["row_rate_hz"].as<double>();
  c.scene.sensor.exposure_s = c.meta["exposure_s"].as<double>();
  c.scene.sensor.readout = Readout::unknown;
  c.scene.sensor.response = Response::srgb;
  for (const YAML::Node& node : c.meta["lamps"]) {
    Lamp lamp;
    lamp.id = node["frequency_hz"].as<int>();
    lamp.frequency_hz = node["frequency_hz"].as<double>();
    lamp.shape = LampShape::point;
    lamp.centre_m = 0.01 * vector3(node["centre_cm"]);
    c.scene.lamps.push_back(lamp);
  }
  return c;
}

Case read_rendered(const fs::path& json) {
  Case c;
  c.meta = YAML::LoadFile(json.string());
  c.image = read_image((json.parent_path() / c.meta["image"].as<std::string>()).string());
  c.scene.camera = Camera::pinhole(c.meta["width"].as<int>(), c.meta["height"].as<int>(),
                                   c.meta["fx_px"].as<double>(), c.meta["fy_px"].as<double>(),
                                   c.meta["cx_px"].as<double>(), c.meta["cy_px"].as<double>());
  c.scene.sensor.psf_sigma_px = c.meta["psf_sigma_px"].as<double>();
  c.scene.sensor.gain_dn_per_e = 1 / c.meta["electrons_per_dn"].as<double>();
  c.scene.sensor.read_noise_e = c.meta["read_noise_e"].as<double>();
  c.scene.sensor.black_level_dn = c.meta["black_level_dn"].as<double>();
  for (const YAML::Node& node : c.meta["lamps"]) {
    Lamp lamp;
    lamp.id = node["id"].as<int>();
    lamp.centre_m = vector3(node["centre_m"]);
    lamp.centre_m.z() -= 0.001;  // the emitting face hangs 1 mm below the listed height
    lamp.radius_m = node["radius_m"].as<double>();
    lamp.normal = vector3(node["normal"]);
    lamp.half_power_rad = node["half_power_deg"].as<double>() * M_PI / 180;
    c.scene.lamps.push_back(lamp);
  }
  return c;
}

std::vector<fs::path> files(const std::string& folder, const std::string& prefix) {
  std::vector<fs::path> found;
  const fs::path root = fs::path(LIBOCC_EXTRA_DATA) / folder;
  if (!fs::exists(root)) return found;
  for (const auto& entry : fs::directory_iterator(root)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(prefix, 0) == 0 && entry.path().extension() == ".json")
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

Rigid3 true_pose(const YAML::Node& meta) {
  Rigid3 pose;
  for (int row = 0; row < 3; ++row)
    pose.rotation.row(row) = vector3(meta["cam_from_world_rotation"][row]).transpose();
  pose.translation = vector3(meta["cam_from_world_translation_m"]);
  return pose;
}

double error_m(const Eigen::Vector3d& position_m, const YAML::Node& meta) {
  return (position_m - vector3(meta["camera_position_m"])).norm();
}

TEST(Photographs, RigOfFiveBlinkingLamps) {
  const std::vector<fs::path> found = files("luxapose", "rig");
  if (found.empty()) GTEST_SKIP() << "photographs are not here";
  const Case c = read_photograph(found.front());
  const Result<Fix> fix = locate(c.image.view(), c.scene);
  EXPECT_EQ(fix.status, Status::ok) << fix.message;
  EXPECT_EQ(fix->lamps.size(), 5u);
  const double error = (fix->position_m - 0.01 * vector3(c.meta["camera_position_cm"])).norm();
  RecordProperty("error_m", std::to_string(error));
  std::printf("rig: error %.4f m, rms %.3f px, %.3f s\n", error, fix->rms_px,
              fix->timing_s.total_s);
  EXPECT_LT(error, 0.05) << fix->position_m.transpose();
  EXPECT_LT(fix->rms_px, 2.0);
}

TEST(Photographs, ChandelierOfFourBlinkingLamps) {
  const std::vector<fs::path> found = files("luxapose", "chandelier");
  if (found.empty()) GTEST_SKIP() << "photographs are not here";
  const Case c = read_photograph(found.front());
  const Result<Fix> fix = locate(c.image.view(), c.scene);
  EXPECT_EQ(fix.status, Status::ok) << fix.message;
  EXPECT_EQ(fix->lamps.size(), 4u);
  const double below = -fix->position_m.z();
  std::printf("chandelier: %.4f m below, rms %.3f px, %.3f s\n", below, fix->rms_px,
              fix->timing_s.total_s);
  EXPECT_NEAR(below, 0.01 * c.meta["distance_below_cm"].as<double>(), 0.35)
      << fix->position_m.transpose();
  EXPECT_LT(fix->rms_px, 2.0);
}

TEST(RenderedRooms, IrregularLampsAreNamedWithoutCodes) {
  const std::vector<fs::path> found = files("rendered", "irregular6");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  std::vector<double> errors;
  for (const fs::path& path : found) {
    const Case c = read_rendered(path);
    const Result<Fix> fix = locate(c.image.view(), c.scene);
    ASSERT_EQ(fix.status, Status::ok) << path.stem() << ": " << fix.message;
    for (const YAML::Node& id : c.meta["visible_lamps"])
      EXPECT_EQ(fix->lamps.count(id.as<int>()), 1u) << path.stem() << ", lamp " << id;
    errors.push_back(error_m(fix->position_m, c.meta));
    std::printf("%s: error %.3f mm, sigma %.3f mm, %.3f ms\n", path.stem().c_str(),
                1e3 * errors.back(), 1e3 * std::sqrt(fix->position_covariance_m2.trace()),
                1e3 * fix->timing_s.total_s);
  }
  for (const fs::path& path : files("rendered", "square4")) {  // unsaturated frames too
    const Case c = read_rendered(path);
    const Result<Fix> fix = locate(c.image.view(), c.scene);
    double least = 1e9;
    for (const Candidate& candidate : fix->candidates)
      least = std::min(least, error_m(candidate.position_m, c.meta));
    errors.push_back(least);
    std::printf("%s: error %.3f mm\n", path.stem().c_str(), 1e3 * least);
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LE(errors[errors.size() / 2], 0.30e-3);
  EXPECT_LE(errors.back(), 1.0e-3);
}

TEST(RenderedRooms, SaturatedLampsStayWithinTwoMillimetres) {
  const std::vector<fs::path> found = files("rendered", "sat_");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  for (const fs::path& path : found) {
    const Case c = read_rendered(path);
    const Result<Fix> fix = locate(c.image.view(), c.scene);
    ASSERT_EQ(fix.status, Status::ok) << path.stem() << ": " << fix.message;
    const double error = error_m(fix->position_m, c.meta);
    std::printf("%s: error %.3f mm, sigma %.3f mm\n", path.stem().c_str(), 1e3 * error,
                1e3 * std::sqrt(fix->position_covariance_m2.trace()));
    EXPECT_LE(error, 2e-3) << path.stem();
    for (const auto& [id, blob] : fix->lamps) EXPECT_TRUE(blob.saturated) << "lamp " << id;
  }
}

TEST(RenderedRooms, TheSquareIsAmbiguousAndAHeadingPriorSettlesIt) {
  const std::vector<fs::path> found = files("rendered", "square4");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  for (const fs::path& path : found) {
    const Case c = read_rendered(path);
    const Result<Fix> without = locate(c.image.view(), c.scene);
    EXPECT_EQ(without.status, Status::ambiguous) << path.stem() << ": " << without.message;
    EXPECT_EQ(without->candidates.size(), 4u) << path.stem();

    LocateOptions options;
    options.prior.emplace();
    options.prior->heading_rad = heading_rad(true_pose(c.meta));
    options.prior->heading_sigma_rad = 20 * M_PI / 180;
    const Result<Fix> with = locate(c.image.view(), c.scene, options);
    EXPECT_EQ(with.status, Status::ok) << path.stem() << ": " << with.message;
    EXPECT_LE(error_m(with->position_m, c.meta), 1.0e-3) << path.stem();
  }
}

}  // namespace
}  // namespace occ
