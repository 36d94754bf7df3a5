// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/scene_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace occ {
namespace {

namespace fs = std::filesystem;
using test::complaint;

const std::string scenes = std::string(LIBOCC_DATA) + "/scenes/";
const std::string fixtures = std::string(LIBOCC_DATA) + "/../tests/fixtures/";

void expect_same(const Camera& a, const Camera& b) {
  EXPECT_EQ(a.width(), b.width());
  EXPECT_EQ(a.height(), b.height());
  EXPECT_EQ(a.matrix(), b.matrix());
  EXPECT_EQ(a.distortion(), b.distortion());
}

void expect_same(const Sensor& a, const Sensor& b) {
  EXPECT_EQ(a.pixel_pitch_m, b.pixel_pitch_m);
  EXPECT_EQ(a.f_number, b.f_number);
  EXPECT_EQ(a.exposure_s, b.exposure_s);
  EXPECT_EQ(a.quantum_efficiency, b.quantum_efficiency);
  EXPECT_EQ(a.wavelength_m, b.wavelength_m);
  EXPECT_EQ(a.full_well_e, b.full_well_e);
  EXPECT_EQ(a.gain_dn_per_e, b.gain_dn_per_e);
  EXPECT_EQ(a.read_noise_e, b.read_noise_e);
  EXPECT_EQ(a.dark_current_e_per_s, b.dark_current_e_per_s);
  EXPECT_EQ(a.black_level_dn, b.black_level_dn);
  EXPECT_EQ(a.bit_depth, b.bit_depth);
  EXPECT_EQ(a.response, b.response);
  EXPECT_EQ(a.gamma, b.gamma);
  EXPECT_EQ(a.response_table, b.response_table);
  EXPECT_EQ(a.row_time_s, b.row_time_s);
  EXPECT_EQ(a.readout, b.readout);
  EXPECT_EQ(a.psf_sigma_px, b.psf_sigma_px);
}

void expect_same(const Lamp& a, const Lamp& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.shape, b.shape);
  EXPECT_EQ(a.centre_m, b.centre_m);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.radius_m, b.radius_m);
  EXPECT_EQ(a.size_m, b.size_m);
  EXPECT_EQ(a.x_axis, b.x_axis);
  EXPECT_EQ(a.exponent, b.exponent);
  EXPECT_EQ(a.corners_m, b.corners_m);
  EXPECT_EQ(a.power_w, b.power_w);
  EXPECT_EQ(a.power_sigma, b.power_sigma);
  EXPECT_EQ(a.half_power_rad, b.half_power_rad);
  EXPECT_EQ(a.frequency_hz, b.frequency_hz);
  EXPECT_EQ(a.duty, b.duty);
  EXPECT_EQ(a.waveform, b.waveform);
  EXPECT_EQ(a.phase, b.phase);
}

void expect_same(const Scene& a, const Scene& b) {
  expect_same(a.camera, b.camera);
  expect_same(a.sensor, b.sensor);
  ASSERT_EQ(a.lamps.size(), b.lamps.size());
  for (std::size_t i = 0; i < a.lamps.size(); ++i) {
    SCOPED_TRACE("lamp " + std::to_string(i));
    expect_same(a.lamps[i], b.lamps[i]);
  }
  ASSERT_EQ(a.room.has_value(), b.room.has_value());
  if (a.room) {
    EXPECT_EQ(a.room->size_m, b.room->size_m);
    EXPECT_EQ(a.room->wall_reflectance, b.room->wall_reflectance);
  }
  EXPECT_EQ(a.assumed, b.assumed);
}

Sensor random_sensor(Random& random) {
  Sensor sensor;
  for (double* value :
       {&sensor.pixel_pitch_m, &sensor.f_number, &sensor.exposure_s, &sensor.wavelength_m,
        &sensor.full_well_e, &sensor.gain_dn_per_e, &sensor.read_noise_e,
        &sensor.dark_current_e_per_s, &sensor.gamma, &sensor.row_time_s, &sensor.psf_sigma_px})
    *value = std::exp(random.uniform(-15, 10));
  sensor.quantum_efficiency = random.uniform(0.01, 1);
  sensor.black_level_dn = random.uniform(0, 200);
  sensor.bit_depth = 8 + random.below(9);
  sensor.response = static_cast<Response>(random.below(4));
  sensor.response_table = {0, random.uniform(0.1, 0.5), random.uniform(0.5, 0.9), 1};
  sensor.readout = static_cast<Readout>(random.below(3));
  return sensor;
}

Lamp random_lamp(Random& random, int id) {
  Lamp lamp;
  lamp.id = id;
  lamp.shape = static_cast<LampShape>(id % 5);
  lamp.centre_m = 10 * test::random_vector(random);
  lamp.normal = test::random_vector(random);
  if (lamp.shape == LampShape::disc) lamp.radius_m = random.uniform(0.01, 1);
  if (lamp.shape == LampShape::lame) lamp.exponent = std::exp(random.uniform(0, 4.6));
  if (lamp.shape == LampShape::rectangle || lamp.shape == LampShape::lame) {
    lamp.size_m = {random.uniform(0.01, 1), random.uniform(0.01, 1)};
    lamp.x_axis = test::random_vector(random);
  }
  if (lamp.shape == LampShape::polygon) {
    lamp.x_axis = test::random_vector(random);
    for (int i = 0; i < 5; ++i) {  // a star, seen from one point in it
      const double angle = 2 * pi * (i + random.uniform(0, 0.8)) / 5;
      const double radius = random.uniform(0.1, 1);
      lamp.corners_m.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    lamp.validate();  // moves centre_m, which decides on the room
  }
  lamp.power_w = std::exp(random.uniform(-10, 10));
  lamp.power_sigma = random.uniform();
  lamp.half_power_rad = random.uniform(1e-3, 1.57);
  if (id % 2) lamp.frequency_hz = random.uniform(100, 10000);
  lamp.duty = random.uniform(0.01, 1);
  if (id % 2 && id % 3) lamp.waveform = {random.uniform(), 0, 1, random.uniform()};
  lamp.phase = random.normal();
  return lamp;
}

TEST(SceneFile, RoundTripIsExact) {
  const std::vector<std::string> names = {"",
                                          "hall, left: \"A\" # no comment",
                                          "K\xc3\xbc"
                                          "che\n\t\\",
                                          "null",
                                          "7",
                                          "- x",
                                          "\x01\x7f",
                                          "{a: b}",
                                          "~"};
  const std::vector<std::size_t> coefficients = {0, 4, 5, 8, 12, 14};
  Random random(1);
  for (int i = 0; i < 24; ++i) {
    Scene scene;
    std::vector<double> distortion(coefficients[static_cast<std::size_t>(i) % coefficients.size()]);
    for (double& k : distortion) k = 0.01 * random.normal();
    scene.camera = Camera::pinhole(1 + random.below(5000), 1 + random.below(5000),
                                   random.uniform(1, 9999), random.uniform(1, 9999),
                                   random.normal(), random.normal(), distortion, random.normal());
    scene.sensor = random_sensor(random);
    for (int id = 0; id < i; ++id) {
      scene.lamps.push_back(random_lamp(random, id));
      scene.lamps.back().name = names[static_cast<std::size_t>(id) % names.size()];
    }
    if (i % 2) {
      const Eigen::Vector3d size_m = Eigen::Vector3d::Constant(random.uniform(1, 9));
      scene.room = Room{size_m, random.uniform()};
      for (Lamp& lamp : scene.lamps)  // not behind its walls
        lamp.centre_m = lamp.centre_m.cwiseAbs().cwiseMin(size_m);
    }
    if (i % 3) scene.assumed = names;
    scene.validate();
    const std::string text = format_scene(scene);
    expect_same(parse_scene(text), scene);
    EXPECT_EQ(format_scene(parse_scene(text)), text);
    if (HasFailure()) FAIL() << "scene " << i << ":\n" << text;
  }
}

TEST(SceneFile, WritesPlainNumbers) {
  Scene scene = test::irregular_room();
  scene.lamps.front().half_power_rad = 70 * pi / 180;
  const std::string text = format_scene(scene);
  for (const char* line : {"half_power_deg: 70\n", "half_power_deg: 60\n", "fx_px: 422.5\n",
                           "pixel_pitch_m: 7.1e-06\n", "centre_m: [0.9, 1, 3]\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
}

TEST(SceneFile, WritesCompleteFiles) {
  const test::Folder folder;
  Scene scene = test::square_room();
  scene.validate();
  const std::string path = (folder.path() / "room.yaml").string();
  write_scene(path, scene);
  expect_same(read_scene(path), scene);
  scene.lamps.pop_back();
  write_scene(path, scene);
  expect_same(read_scene(path), scene);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "a file was left over";

  Scene bad = scene;
  bad.lamps[0].radius_m = -1;
  EXPECT_THROW(write_scene(path, bad), std::invalid_argument);
  expect_same(read_scene(path), scene);
  const std::string nowhere = (folder.path() / "absent" / "room.yaml").string();
  EXPECT_NE(complaint<std::runtime_error>([&] { write_scene(nowhere, scene); }).find(nowhere),
            std::string::npos);
}

TEST(SceneFile, EveryShippedSceneLoads) {
  int count = 0;
  for (const auto& file : fs::directory_iterator(scenes)) {
    if (file.path().extension() != ".yaml") continue;
    ++count;
    Scene scene;
    EXPECT_NO_THROW(scene = read_scene(file.path().string()));
    EXPECT_FALSE(scene.lamps.empty()) << file.path();
    expect_same(parse_scene(format_scene(scene)), scene);
  }
  EXPECT_EQ(count, 11);
}

TEST(SceneFile, ShippedRoomsAreTheTestsRooms) {
  Scene six = test::irregular_room(), four = test::square_room();
  six.validate();
  four.validate();
  expect_same(read_scene(scenes + "irregular_six.yaml"), six);
  expect_same(read_scene(scenes + "square_four.yaml"), four);
}

TEST(SceneFile, KookminSceneHasTheStatedGeometry) {
  const Scene one = read_scene(scenes + "kookmin_one_lamp.yaml");
  EXPECT_DOUBLE_EQ(one.camera.fx_px(), 1.4e-3 / 7.1e-6);
  EXPECT_EQ(one.camera.fx_px(), one.camera.fy_px());
  ASSERT_EQ(one.lamps.size(), 1u);
  EXPECT_NEAR(one.lamps[0].order(), 0.64606, 5e-6);
  EXPECT_EQ(one.lamps[0].radius_m, 0.085);
  EXPECT_FALSE(one.assumed.empty());
  // Image diameter of the lamp from 1.5 m below, and field of view, as stated for the set-up.
  EXPECT_NEAR(one.camera.fx_px() * 0.17 / 1.5, 22.3, 0.05);
  EXPECT_NEAR(2 * std::atan(320 / one.camera.fx_px()) * 180 / 3.14159265, 116.7, 0.05);
  EXPECT_EQ(read_scene(scenes + "kookmin_four_lamps.yaml").lamps.size(), 4u);
}

TEST(SceneFile, MissingKeysHaveTheDefaults) {
  const Scene scene = parse_scene(
      "schema: libocc-scene/1\n"
      "camera: {width_px: 640, height_px: 480, fx_px: 500}\n"
      "lamps: [{id: 3, centre_m: [1, 2, 3], radius_m: 0.1}]\n");
  Scene expected;
  expected.camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  expected.lamps = {test::disc_lamp(3, {1, 2, 3}, 0.1)};
  expected.lamps[0].power_w = 1;
  expected.validate();
  expect_same(scene, expected);
}

TEST(SceneFile, YamlVariantsAreAccepted) {
  const Scene scene = parse_scene(
      "# comment\r\n---\r\nschema: 'libocc-scene/1'\r\n"
      "camera: {width_px: 640, height_px: 480, focal_length_m: +3.e-3}\r\n"
      "sensor: &s {pixel_pitch_m: 1E-5}\r\n"
      "lamps:\r\n- id: 0\r\n  shape: rectangle\r\n  centre_m: &c [0, 0, 3]\r\n  size_m: [.6, "
      "0.3]\r\n"
      "- {id: 1, shape: point, centre_m: *c, half_power_deg: 45}\r\n");
  EXPECT_NEAR(scene.camera.fx_px(), 300, 1e-10);
  EXPECT_EQ(scene.lamps[1].centre_m, Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(scene.lamps[0].size_m, Eigen::Vector2d(0.6, 0.3));
  EXPECT_NEAR(scene.lamps[1].order(), 2, 1e-14);
}

TEST(CameraFile, ReadsOpenCv) {
  const Camera camera = read_camera(fixtures + "opencv_camera.yaml");
  expect_same(camera, Camera::pinhole(1280, 960, 845.12345678901234, 844.98765432109876, 639.5,
                                      479.5, {-0.12, 0.03, 0.001, -0.0005, 0}));
}

TEST(CameraFile, ReadsRos) {
  expect_same(
      read_camera(fixtures + "ros_camera.yaml"),
      Camera::pinhole(640, 480, 422.5, 423.5, 319.5, 239.5, {-0.2, 0.05, 0.001, -0.002, 0}));
  expect_same(read_camera(fixtures + "ros_rational_camera.yaml"),
              Camera::pinhole(640, 480, 422.5, 423.5, 319.5, 239.5,
                              {0.4, -0.1, 0.001, -0.002, 0.01, 0.7, -0.05, 0.02}));
}

TEST(CameraFile, ReadsTheCameraOfAScene) {
  expect_same(read_camera(scenes + "irregular_six.yaml"), test::irregular_room().camera);
  const Camera camera = read_camera(fixtures + "opencv_camera.yaml");
  expect_same(read_scene(fixtures + "scene_with_camera_file.yaml").camera, camera);
  expect_same(read_camera(fixtures + "scene_with_camera_file.yaml"), camera);
}

TEST(CameraFile, RejectsUnsupportedCameras) {
  const test::Folder folder;
  const std::string matrix =
      "camera_matrix: {rows: 3, cols: 3, data: [9, 0, 4, 0, 9, 4, 0, 0, 1]}\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {":1: key `image_height`: is missing", "image_width: 10\n"},
      {":1: key `camera_matrix`: is missing", "image_width: 10\nimage_height: 10\n"},
      {":1: key `image_width`: must be positive, got 0",
       "image_width: 0\nimage_height: 10\n" + matrix},
      {":3: key `camera_matrix`: must be 3 x 3",
       "image_width: 9\nimage_height: 9\n"
       "camera_matrix: {rows: 3, cols: 3, data: [9, 0, 4, 0, 9, 4, 0, 0, 2]}\n"},
      {":3: key `camera_matrix.data`: must be a list of rows x cols = 3 x 3 numbers, got a list of "
       "1",
       "image_width: 9\nimage_height: 9\ncamera_matrix: {rows: 3, cols: 3, data: [9]}\n"},
      {":3: key `camera_matrix`: fx_px must be positive and finite, got -9",
       "image_width: 9\nimage_height: 9\n"
       "camera_matrix: {rows: 3, cols: 3, data: [-9, 0, 4, 0, 9, 4, 0, 0, 1]}\n"},
      {":4: key `distortion_coefficients`: must be 0, 4, 5, 8, 12 or 14, got 3",
       "image_width: 9\nimage_height: 9\n" + matrix +
           "distortion_coefficients: {rows: 1, cols: 3, data: [0, 0, 0]}\n"},
      {":4: key `distortion_model`: plumb_bob has 5 coefficients, got 8",
       "image_width: 9\nimage_height: 9\n" + matrix +
           "distortion_model: plumb_bob\n"
           "distortion_coefficients: {rows: 1, cols: 8, data: [0, 0, 0, 0, 0, 0, 0, 0]}\n"},
      {":4: key `distortion_model`: must be plumb_bob, rational_polynomial or equidistant, got "
       "thin",
       "image_width: 9\nimage_height: 9\n" + matrix + "distortion_model: thin\n"},
      {":4: key `fisheye_model`: must be 0 or 1, got 2",
       "image_width: 9\nimage_height: 9\n" + matrix + "fisheye_model: 2\n"},
      {":5: key `distortion_coefficients`: a fisheye has 4 coefficients, got 5",
       "image_width: 9\nimage_height: 9\n" + matrix +
           "fisheye_model: 1\n"
           "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"},
  };
  for (const auto& [expected, text] : cases) {
    const std::string path = folder.file("camera.yaml", text);
    EXPECT_EQ(complaint<std::runtime_error>([&] { read_camera(path); }).find(path + expected), 0u)
        << expected << "\n"
        << complaint<std::runtime_error>([&] { read_camera(path); });
  }
}

TEST(CameraFile, NamedByASceneMustBeACalibration) {
  const test::Folder folder;
  const std::string scene =
      folder.file("scene.yaml", "schema: libocc-scene/1\ncamera: {file: scene.yaml}\nlamps: []\n");
  EXPECT_EQ(complaint<std::runtime_error>([&] {
              read_scene(scene);
            }).find(scene + ":2: key `camera.file`: " + scene),
            0u);
  const std::string absent = folder.file(
      "absent.yaml", "schema: libocc-scene/1\ncamera: {file: not_there.yaml}\nlamps: []\n");
  EXPECT_NE(complaint<std::runtime_error>([&] {
              read_scene(absent);
            }).find("not_there.yaml: cannot be read"),
            std::string::npos);
}

TEST(SceneFile, ErrorsOfMapAndCameraSurvive) {
  Scene scene = read_scene(scenes + "irregular_six.yaml");
  scene.map_sigma_m = Eigen::Vector3d(0.01, 0.01, 0.002);
  scene.map_scale_sigma = 0.003;
  scene.lamps[1].position_sigma_m = PerAxis(0.05);
  scene.lamps[1].shared_errors_m = {{0.001, 0, -0.002}, {0, 0.003, 0}};
  scene.lamps[2].size_sigma = 0.02;
  scene.lamps[3].tilt_sigma_rad = 0.03;
  scene.camera = scene.camera.with_parameter_sigmas({{"fx_px", 3.3}, {"k1", 0.02}});
  const std::string text = format_scene(scene);
  const Scene back = parse_scene(text);
  EXPECT_EQ(format_scene(back), text);
  EXPECT_EQ(*back.map_sigma_m, *scene.map_sigma_m);
  EXPECT_EQ(back.map_scale_sigma, scene.map_scale_sigma);
  EXPECT_EQ(*back.lamps[1].position_sigma_m, *scene.lamps[1].position_sigma_m);
  EXPECT_FALSE(back.lamps[0].position_sigma_m);
  EXPECT_EQ(back.lamps[1].shared_errors_m, scene.lamps[1].shared_errors_m);
  EXPECT_TRUE(back.lamps[0].shared_errors_m.empty());
  EXPECT_EQ(back.lamps[2].size_sigma, 0.02);
  EXPECT_NEAR(*back.lamps[3].tilt_sigma_rad, 0.03, 1e-15);
  EXPECT_EQ(back.camera.parameter_covariance(), scene.camera.parameter_covariance());
  Eigen::MatrixXd covariance = scene.camera.parameter_covariance();
  covariance(0, 1) = covariance(1, 0) = 0;
  covariance(0, 2) = covariance(2, 0) = 1.1;
  covariance(2, 2) = 4;
  scene.camera = scene.camera.with_parameter_covariance(covariance);
  EXPECT_EQ(parse_scene(format_scene(scene)).camera.parameter_covariance(), covariance);
}

}  // namespace
}  // namespace occ
