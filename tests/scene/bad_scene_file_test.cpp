// SPDX-License-Identifier: Apache-2.0
// Errors in scene files are reported with file, line, key, rule and value.
#include <gtest/gtest.h>

#include <string>

#include "libocc/scene/scene_file.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace occ {
namespace {

std::string complaint_about(const std::string& text) {
  return test::complaint<std::runtime_error>([&] { parse_scene(text, "scene.yaml"); });
}

// A scene of one lamp with replaceable parts; lines: 1 schema, 2 camera, 3 sensor, 4 lamps, 5 lamp.
std::string scene_text(const std::string& lamp = "id: 0, centre_m: [0, 0, 3], radius_m: 0.1",
                       const std::string& sensor = "f_number: 2",
                       const std::string& camera = "width_px: 640, height_px: 480, fx_px: 500",
                       const std::string& rest = "") {
  return "schema: libocc-scene/1\ncamera: {" + camera + "}\nsensor: {" + sensor +
         "}\nlamps:\n  - {" + lamp + "}\n" + rest;
}
std::string lamp_complaint(const std::string& lamp) { return complaint_about(scene_text(lamp)); }
std::string sensor_complaint(const std::string& sensor) {
  return complaint_about(scene_text("id: 0, centre_m: [0, 0, 3], radius_m: 0.1", sensor));
}
std::string camera_complaint(const std::string& camera) {
  return complaint_about(
      scene_text("id: 0, centre_m: [0, 0, 3], radius_m: 0.1", "f_number: 2", camera));
}
std::string rest_complaint(const std::string& rest) {
  return complaint_about(scene_text("id: 0, centre_m: [0, 0, 3], radius_m: 0.1", "f_number: 2",
                                    "width_px: 640, height_px: 480, fx_px: 500", rest));
}

TEST(BadScene, TheTemplateIsValid) { EXPECT_EQ(complaint_about(scene_text()), ""); }

TEST(BadScene, ErrorsOfTheMap) {
  const std::string lamp = "id: 0, centre_m: [0, 0, 3], radius_m: 0.1, ";
  const std::string at = "scene.yaml:5: key `lamps[0].position_sigma_m`: must be ";
  EXPECT_EQ(lamp_complaint(lamp + "position_sigma_m: -0.1"),
            at + "zero or positive, got [-0.1, -0.1, -0.1]");
  EXPECT_EQ(lamp_complaint(lamp + "position_sigma_m: .nan"),
            at + "a finite number or a list of 3 finite numbers, got .nan");
  EXPECT_EQ(lamp_complaint(lamp + "position_sigma_m: [1, 2]"),
            at + "a list of 3 finite numbers, got a list of 2");
  EXPECT_NE(lamp_complaint(lamp + "position_sigma_m: 0").find("position_sigma_m must be positive"),
            std::string::npos);
  EXPECT_NE(rest_complaint("map_sigma_m: 0\n").find("`map_sigma_m`: must be positive"),
            std::string::npos);
  EXPECT_NE(rest_complaint("map_scale_sigma: -0.1\n").find("`map_scale_sigma`: must be zero or"),
            std::string::npos);
  EXPECT_NE(rest_complaint("map_scale_sigma: 1\n").find("below 1"), std::string::npos);
  EXPECT_NE(rest_complaint("map_sigma_m: [0.1, -1, 0]\n").find("`map_sigma_m`: must be zero or"),
            std::string::npos);
  const std::string shared = "scene.yaml:5: key `lamps[0].shared_errors_m`: must be ";
  EXPECT_EQ(lamp_complaint(lamp + "shared_errors_m: [1, 2, 3]"),
            shared + "a list of lists of 3 finite numbers, got 1 in it");
  EXPECT_EQ(lamp_complaint(lamp + "shared_errors_m: [[0, 0, .inf]]"),
            shared + "a list of lists of 3 finite numbers, got .inf in it");
  EXPECT_EQ(lamp_complaint(lamp + "shared_errors_m: [[0, 1]]"),
            shared + "a list of lists of 3 finite numbers, got a list of 2 in it");
  const std::string two =
      "id: 0, centre_m: [0, 0, 3], radius_m: 0.1, shared_errors_m: [[0, 0, 1]]}\n"
      "  - {id: 1, centre_m: [1, 0, 3], radius_m: 0.1, ";
  EXPECT_EQ(lamp_complaint(two + "shared_errors_m: [[0, 0, 1], [1, 0, 0]]"),
            "scene.yaml:1: lamp 1: shared_errors_m must be as long as that of lamp 0, 1, got 2 "
            "displacements");
  EXPECT_EQ(lamp_complaint(two + "position_sigma_m: 0"), "");
  EXPECT_NE(lamp_complaint(lamp + "tilt_sigma_deg: 0").find("tilt_sigma_deg"), std::string::npos);
  EXPECT_EQ(lamp_complaint(lamp + "tilt_sigma_deg: 2, size_sigma: 0.1, position_sigma_m: 0.1"), "");
}

TEST(BadScene, ErrorsOfTheCamera) {
  const std::string camera = "width_px: 640, height_px: 480, fx_px: 500, ";
  EXPECT_EQ(camera_complaint(camera + "parameter_sigmas: {fx_px: 3, k1: 0.02}"), "");
  EXPECT_NE(camera_complaint(camera + "parameter_sigmas: {k9: 1}").find("did you mean `k1`?"),
            std::string::npos);
  EXPECT_NE(camera_complaint(camera + "parameter_sigmas: {brightness: 1}")
                .find("known here: fx_px, f_px, fy_px, "),
            std::string::npos);
  EXPECT_NE(camera_complaint(camera + "parameter_sigmas: {f: 3}").find("parameter_sigmas.f`"),
            std::string::npos);
  EXPECT_NE(
      camera_complaint(camera + "parameter_sigmas: {fx_px: -3}").find("parameter_sigmas.fx_px"),
      std::string::npos);
  EXPECT_NE(camera_complaint(camera + "parameter_covariance: [1, 2]").find("5 x 5"),
            std::string::npos);
  EXPECT_NE(camera_complaint(camera + "parameter_covariance: [1], parameter_sigmas: {fx_px: 1}")
                .find("together"),
            std::string::npos);
}

TEST(BadScene, LampValues) {
  const std::string at = "scene.yaml:5: key `lamps[0].";
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: -0.1"),
            at + "radius_m`: must be positive, got -0.1");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: .nan"),
            at + "radius_m`: must be a finite number, got .nan");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1e999"),
            at + "radius_m`: must be a finite number, got 1e999");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 10 cm"),
            at + "radius_m`: must be a finite number, got 10 cm");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: "),
            at + "radius_m`: must be a finite number, got nothing");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: [1]"),
            at + "radius_m`: must be a finite number, got a list of 1");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, normal: [0, 0, 0]"),
            at + "normal`: must be a direction, not zero, got [0, 0, 0]");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, nan, 3], radius_m: 1"),
            at + "centre_m`: must be a list of 3 finite numbers, got nan in it");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 3], radius_m: 1"),
            at + "centre_m`: must be a list of 3 finite numbers, got a list of 2");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: 3, radius_m: 1"),
            at + "centre_m`: must be a list of 3 finite numbers, got 3");
  EXPECT_EQ(lamp_complaint("id: 0.5, centre_m: [0, 0, 3], radius_m: 1"),
            at + "id`: must be a whole number, got 0.5");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, name: [a]"),
            at + "name`: must be a text, got a list of 1");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, half_power_deg: 90"),
            at + "half_power_deg`: must be in (0, 90), got 90");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, frequency_hz: -5"),
            at + "frequency_hz`: must be positive, got -5");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], shape: sphere"),
            at + "shape`: must be one of disc, rectangle, point, lame, polygon, got sphere");
  EXPECT_EQ(lamp_complaint(
                "id: 0, centre_m: [0, 0, 3], shape: rectangle, size_m: [1, 1], x_axis: [0, 0, 2]"),
            at + "x_axis`: must be not parallel to the normal, got [0, 0, 2]");
}

TEST(BadScene, LampKeys) {
  const std::string at = "scene.yaml:5: key `lamps[0].";
  EXPECT_EQ(lamp_complaint("centre_m: [0, 0, 3], radius_m: 1"), at + "id`: is missing");
  EXPECT_EQ(lamp_complaint("id: 0, radius_m: 1"), at + "centre_m`: is missing");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3]"), at + "radius_m`: is missing");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], shape: rectangle"),
            at + "size_m`: is missing");
  EXPECT_EQ(lamp_complaint("id: 0, id: 1, centre_m: [0, 0, 3], radius_m: 1"),
            at + "id`: is given twice, first in line 5");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, nromal: [0, 0, 1]"),
            at + "nromal`: is not known, got a list of 3; did you mean `normal`?");
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], shape: point, radius_m: 1")
                .find(at + "radius_m`: is not known, got 1; "),
            0u);
  EXPECT_NE(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, colour_temperature: 3000")
                .find("got 3000; known here: id, name, shape, centre_m, "),
            std::string::npos);
}

TEST(BadScene, WrongUnitsAreReportedWithTheRightOne) {
  const auto ending = [](const std::string& text, const std::string& end) {
    EXPECT_EQ(text.rfind(end), text.size() - end.size()) << text;
  };
  ending(
      lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, half_power_rad: 1.2"),
      "key `lamps[0].half_power_rad`: is not known, got 1.2; write `half_power_deg`, in degrees");
  ending(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_m: 1, frequency_khz: 2"),
         "is not known, got 2; write `frequency_hz`, in hertz");
  ending(sensor_complaint("exposure_ms: 0.02"), "got 0.02; write `exposure_s`, in seconds");
  ending(sensor_complaint("exposure: 0.02"), "got 0.02; write `exposure_s`, in seconds");
  ending(sensor_complaint("pixel_pitch_um: 7.1"), "got 7.1; write `pixel_pitch_m`, in metres");
  ending(rest_complaint("room: {size_cm: [400, 400, 300]}\n"),
         "got a list of 3; write `size_m`, in metres");
}

// The error names the wrong unit, not the missing required key.
TEST(BadScene, WrongUnitInPlaceOfARequiredKey) {
  EXPECT_EQ(lamp_complaint("id: 0, centre_m: [0, 0, 3], radius_mm: 85"),
            "scene.yaml:5: key `lamps[0].radius_mm`: is not known, got 85; write `radius_m`, in "
            "metres");
  EXPECT_EQ(lamp_complaint("id: 0, centre_cm: [0, 0, 300], radius_m: 1"),
            "scene.yaml:5: key `lamps[0].centre_cm`: is not known, got a list of 3; write "
            "`centre_m`, in metres");
}

TEST(BadScene, SensorAndCamera) {
  EXPECT_EQ(sensor_complaint("bit_depth: 20"),
            "scene.yaml:3: key `sensor.bit_depth`: must be in [8, 16], got 20");
  EXPECT_EQ(sensor_complaint("response_table: [0, 0.5, 0.5, 1]"),
            "scene.yaml:3: key `sensor.response_table`: must be greater than the entry before it, "
            "got 0.5");
  EXPECT_EQ(sensor_complaint("response: table"),
            "scene.yaml:3: key `sensor`: sensor.response_table must be a list of at least two "
            "values, got 0");
  EXPECT_EQ(sensor_complaint("readout: left"),
            "scene.yaml:3: key `sensor.readout`: must be one of rows, columns, unknown, got left");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480"),
            "scene.yaml:2: key `camera.fx_px`: is missing");
  EXPECT_EQ(camera_complaint("width_px: -1, height_px: 480, fx_px: 500"),
            "scene.yaml:2: key `camera.width_px`: must be positive, got -1");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480, fx_px: 0"),
            "scene.yaml:2: key `camera.fx_px`: must be positive and finite, got 0");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480, fx_px: 500, distortion: [1, 2]"),
            "scene.yaml:2: key `camera.distortion`: must be 0, 4, 5, 8, 12 or 14, got 2");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480, fx_px: 500, model: fish"),
            "scene.yaml:2: key `camera.model`: must be one of pinhole, fisheye, double_sphere, "
            "brown_forward, brown_backward, equirectangular, rotating_line, "
            "rotating_line_first_order, got fish");
  EXPECT_EQ(camera_complaint("model: brown_backward, width_px: 640, height_px: 480, fx_px: 500"),
            "scene.yaml:2: key `camera.unit_px`: is missing");
  EXPECT_EQ(camera_complaint("model: brown_forward, width_px: 640, height_px: 480, fx_px: 500, "
                             "unit_px: 100, distortion: [1, 2]"),
            "scene.yaml:2: key `camera.distortion`: must be 0 or 7, got 2");
  EXPECT_EQ(camera_complaint("model: equirectangular, width_px: 640, height_px: 480, fx_px: 500"),
            "scene.yaml:2: key `camera.fx_px`: is not known, got 500; did you mean `fy_px`?");
  EXPECT_EQ(
      camera_complaint("model: double_sphere, width_px: 640, height_px: 480, fx_px: 500, xi: 0"),
      "scene.yaml:2: key `camera.alpha`: is missing");
  EXPECT_EQ(camera_complaint("model: rotating_line, width_px: 640, height_px: 480, fx_px: 500"),
            "scene.yaml:2: key `camera.c_px`: is missing");
  EXPECT_EQ(camera_complaint("model: rotating_line, width_px: 640, height_px: 480, c_px: 0"),
            "scene.yaml:2: key `camera.c_px`: must be positive and finite, got 0");
  EXPECT_EQ(camera_complaint("model: fisheye, width_px: 640, height_px: 480, fx_px: 500, xi: 0.5"),
            "scene.yaml:2: key `camera.xi`: is not known, got 0.5; known here: model, width_px, "
            "height_px, fx_px, fy_px, cx_px, cy_px, skew_px, distortion");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480, focal_length_m: 0.003"),
            "scene.yaml:2: key `camera.focal_length_m`: needs a positive `sensor.pixel_pitch_m`");
  EXPECT_EQ(camera_complaint("width_px: 640, height_px: 480, fx_px: 500, focal_length_m: 0.003"),
            "scene.yaml:2: key `camera.focal_length_m`: must not be given together with `fx_px` or "
            "`fy_px`, got "
            "0.003");
  EXPECT_EQ(camera_complaint("file: a.yaml, width_px: 640"),
            "scene.yaml:2: key `camera.width_px`: is not known, got 640; known here: file");
}

TEST(BadScene, RoomEffectsAndOtherParts) {
  EXPECT_EQ(rest_complaint("room: {size_m: [4, 4, -3]}\n"),
            "scene.yaml:6: key `room.size_m`: must be three positive lengths, got [4, 4, -3]");
  EXPECT_EQ(rest_complaint("room: {wall_reflectance: 1}\n"),
            "scene.yaml:6: key `room.wall_reflectance`: must be in [0, 1), got 1");
  EXPECT_EQ(rest_complaint("room:\n"),
            "scene.yaml:6: key `room`: must be a mapping of keys, got nothing");
  EXPECT_EQ(rest_complaint("  - {id: 0, centre_m: [0, 0, 3], radius_m: 0.1}\n"),
            "scene.yaml:6: key `lamps[1].id`: must be unique, lamps[0] has the same, got 0");
  EXPECT_EQ(rest_complaint("  - 7\n"),
            "scene.yaml:6: key `lamps[1]`: must be a mapping of keys, got 7");
  EXPECT_EQ(rest_complaint("assumed: all\n"),
            "scene.yaml:6: key `assumed`: must be a list of texts, got all");
  EXPECT_EQ(rest_complaint("lamp: []\n"),
            "scene.yaml:6: key `lamp`: is not known, got a list of 0; did you mean `lamps`?");
}

TEST(BadScene, Schema) {
  EXPECT_EQ(complaint_about("schema: libocc-scene/2\n"),
            "scene.yaml:1: key `schema`: is newer than this library, which reads up to "
            "libocc-scene/1, got libocc-scene/2");
  for (const char* schema : {"libocc-scene/0", "libocc-scene/", "libocc-scene/1x", "1", "[1]",
                             "libocc-scene/99999999999"})
    EXPECT_EQ(complaint_about(std::string("schema: ") + schema + "\n")
                  .find("scene.yaml:1: key `schema`: must be "),
              0u)
        << schema;
  EXPECT_EQ(complaint_about("camera: {}\n"), "scene.yaml:1: key `schema`: is missing");
  EXPECT_EQ(complaint_about("schema: libocc-scene/1\n"), "scene.yaml:1: key `camera`: is missing");
  EXPECT_EQ(
      complaint_about("schema: libocc-scene/1\ncamera: {width_px: 9, height_px: 9, fx_px: 9}"),
      "scene.yaml:1: key `lamps`: is missing");
}

TEST(BadScene, Files) {
  const test::Folder folder;
  const auto of_file = [](const std::string& path) {
    return test::complaint<std::runtime_error>([&] { read_scene(path); });
  };
  const std::string empty = folder.file("empty.yaml", "");
  EXPECT_EQ(of_file(empty), empty + ":1: the file is empty");
  const std::string comment = folder.file("comment.yaml", "# nothing\n");
  EXPECT_EQ(of_file(comment), comment + ":1: the file is empty");
  const std::string binary = folder.file("binary.yaml", std::string("\x89PNG\r\n\x1a\n\0\0", 10));
  EXPECT_EQ(of_file(binary), binary + ":2: not a text file");
  const std::string absent = (folder.path() / "absent.yaml").string();
  EXPECT_EQ(of_file(absent), absent + ": cannot be read: no such file");
  EXPECT_EQ(of_file(folder.path().string()),
            folder.path().string() + ": cannot be read: not a file but a folder");
  const std::string large = folder.file("large.yaml", std::string(5 << 20, ' '));
  EXPECT_EQ(of_file(large), large + ": larger than a scene or camera file can be");
}

TEST(BadScene, NotYaml) {
  EXPECT_EQ(complaint_about("schema: [1\nlamps: }\n").find("scene.yaml:2: not YAML: "), 0u)
      << complaint_about("schema: [1\nlamps: }\n");
  EXPECT_EQ(complaint_about("just words"),
            "scene.yaml:1: must consist of `key: value` lines, got just words");
  EXPECT_EQ(complaint_about("a: *b\n").find("scene.yaml:1: not YAML: "), 0u);
  EXPECT_EQ(complaint_about("a: &b [*b]\n"), "scene.yaml:1: an alias inside its own anchor");
  EXPECT_EQ(complaint_about("[a]: 1\n"), "scene.yaml:1: a key must be a word");
  EXPECT_EQ(complaint_about(scene_text() + "---\na: 1\n"),
            "scene.yaml:1: more than one YAML document in a file");
}

TEST(BadScene, YamlBombsAreRejected) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 60; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int j = 0; j < 10; ++j) bomb += (j ? ", " : "") + before;
    bomb += "]\n";
  }
  EXPECT_EQ(complaint_about(bomb), "scene.yaml:1: key `schema`: is missing");
  for (const char* open : {"[", "{a: ", "- ", "? "}) {
    std::string deep;
    for (int i = 0; i < 20000; ++i) deep += open;
    EXPECT_EQ(complaint_about("a: " + deep).find("scene.yaml:1: "), 0u) << open;
    EXPECT_EQ(complaint_about(deep).find("scene.yaml:1: "), 0u) << open;
  }
}

}  // namespace
}  // namespace occ
