// SPDX-License-Identifier: Apache-2.0
// The whole path on images this project did not make: photographs of blinking lamps, and rooms
// rendered by an independent path tracer. They are not part of the project; without them these
// tests are skipped.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/rendered_rooms.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

namespace fs = std::filesystem;

struct Case {
  Scene scene;
  Image image;
  YAML::Node meta;
};

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
    lamp.centre_m = 0.01 * test::vector3(node["centre_cm"]);
    c.scene.lamps.push_back(lamp);
  }
  return c;
}

/// Truth beside the photograph whose file name starts with `prefix`; nothing when it is absent.
std::optional<fs::path> photograph(const std::string& prefix) {
  const std::vector<fs::path> found = test::truth_files("luxapose", prefix);
  if (found.empty()) return std::nullopt;
  return found.front();
}

TEST(Photographs, RigOfFiveBlinkingLamps) {
  const auto found = photograph("rig");
  if (!found) GTEST_SKIP() << "photographs are not here";
  const Case c = read_photograph(*found);
  const Result<Fix> fix = locate(c.image.view(), c.scene);
  EXPECT_EQ(fix.status, Status::ok) << fix.message;
  EXPECT_EQ(fix->lamps.size(), 5u);
  const double error =
      (fix->position_m - 0.01 * test::vector3(c.meta["camera_position_cm"])).norm();
  RecordProperty("error_m", std::to_string(error));
  std::printf("rig: error %.4f m, rms %.3f px, %.3f s\n", error, fix->rms_px,
              fix->timing_s.total_s);
  EXPECT_LT(error, 0.05) << fix->position_m.transpose();
  EXPECT_LT(fix->rms_px, 2.0);
}

TEST(Photographs, ChandelierOfFourBlinkingLamps) {
  const auto found = photograph("chandelier");
  if (!found) GTEST_SKIP() << "photographs are not here";
  const Case c = read_photograph(*found);
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
  const std::vector<fs::path> found = test::rendered_rooms("irregular6");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  std::vector<double> errors;
  for (const fs::path& path : found) {
    const test::RenderedRoom room = test::read_rendered_room(path);
    const Result<Fix> fix = locate(room.image.view(), room.scene);
    ASSERT_EQ(fix.status, Status::ok) << path.stem() << ": " << fix.message;
    for (const int id : room.whole_lamps)
      EXPECT_EQ(fix->lamps.count(id), 1u) << path.stem() << ", lamp " << id;
    errors.push_back((fix->position_m - room.position_m).norm());
    std::printf("%s: error %.3f mm, sigma %.3f mm, %.3f ms\n", path.stem().c_str(),
                1e3 * errors.back(), 1e3 * std::sqrt(fix->position_covariance_m2.trace()),
                1e3 * fix->timing_s.total_s);
  }
  for (const fs::path& path : test::rendered_rooms("square4")) {  // unsaturated frames too
    const test::RenderedRoom room = test::read_rendered_room(path);
    const Result<Fix> fix = locate(room.image.view(), room.scene);
    double least = 1e9;
    for (const Candidate& candidate : fix->candidates)
      least = std::min(least, (candidate.position_m - room.position_m).norm());
    errors.push_back(least);
    std::printf("%s: error %.3f mm\n", path.stem().c_str(), 1e3 * least);
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LE(errors[errors.size() / 2], 0.30e-3);
  EXPECT_LE(errors.back(), 1.0e-3);
}

TEST(RenderedRooms, SaturatedLampsStayWithinTwoMillimetres) {
  const std::vector<fs::path> found = test::rendered_rooms("sat_");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  double nees = 0;
  for (const fs::path& path : found) {
    const test::RenderedRoom room = test::read_rendered_room(path);
    const Result<Fix> fix = locate(room.image.view(), room.scene);
    ASSERT_EQ(fix.status, Status::ok) << path.stem() << ": " << fix.message;
    const Eigen::Vector3d slip = fix->position_m - room.position_m;
    const double error = slip.norm();
    nees += test::nees(slip, fix->position_covariance_m2);
    std::printf("%s: error %.3f mm, sigma %.3f mm\n", path.stem().c_str(), 1e3 * error,
                1e3 * std::sqrt(fix->position_covariance_m2.trace()));
    EXPECT_LE(error, 2e-3) << path.stem();
    for (const auto& [id, blob] : fix->lamps) EXPECT_TRUE(blob.saturated) << "lamp " << id;
  }
  const auto interval = test::chi2_interval(3.0 * static_cast<double>(found.size()));
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
}

TEST(RenderedRooms, TheSquareIsAmbiguousAndAHeadingPriorSettlesIt) {
  const std::vector<fs::path> found = test::rendered_rooms("square4");
  if (found.empty()) GTEST_SKIP() << "rendered rooms are not here";
  for (const fs::path& path : found) {
    const test::RenderedRoom room = test::read_rendered_room(path);
    const Result<Fix> without = locate(room.image.view(), room.scene);
    EXPECT_EQ(without.status, Status::ambiguous) << path.stem() << ": " << without.message;
    EXPECT_EQ(without->candidates.size(), 4u) << path.stem();

    LocateOptions options;
    options.prior.emplace();
    options.prior->heading_rad = heading_rad(room.cam_from_world);
    options.prior->heading_sigma_rad = 20 * pi / 180;
    const Result<Fix> with = locate(room.image.view(), room.scene, options);
    EXPECT_EQ(with.status, Status::ok) << path.stem() << ": " << with.message;
    EXPECT_LE((with->position_m - room.position_m).norm(), 1.0e-3) << path.stem();
  }
}

}  // namespace
}  // namespace occ
