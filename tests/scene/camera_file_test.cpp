// SPDX-License-Identifier: Apache-2.0
// Round trips of cameras of every model through text.
#include "libocc/scene/camera_file.hpp"

#include "libocc/camera/rotating_line.hpp"
#include "libocc/scene/scene_file.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace occ {
namespace {

Camera line_camera() {
  RotatingLine line;
  line.width = 3000;
  line.height = 700;
  line.angle_per_px_rad = 2.0951e-3;
  line.c_px = 480.3;
  line.cy_px = 350.2;
  line.tilt_x_rad = 0.01;
  line.tilt_y_rad = -0.02;
  line.eccentricity_m = {0.01, -0.02, 0.005};
  line.k1 = 0.1;
  line.k2 = 1.0 / 3;
  line.tumbling_rad = {1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 6e-4};
  return Camera::rotating_line(line);
}

void expect_equal(const Camera& a, const Camera& b) {
  EXPECT_EQ(a.kind(), b.kind());
  EXPECT_EQ(a.width(), b.width());
  EXPECT_EQ(a.height(), b.height());
  const auto pa = a.parameters(), pb = b.parameters();
  ASSERT_EQ(pa.size(), pb.size());
  for (std::size_t i = 0; i < pa.size(); ++i) {
    EXPECT_EQ(pa[i].name, pb[i].name);
    EXPECT_EQ(pa[i].value, pb[i].value) << pa[i].name;
  }
  ASSERT_EQ(a.constants().size(), b.constants().size());
  for (std::size_t i = 0; i < a.constants().size(); ++i)
    EXPECT_EQ(a.constants()[i].value, b.constants()[i].value) << a.constants()[i].name;
}

const std::vector<Camera>& every_model() {
  static const std::vector<Camera> all{
      Camera::pinhole(640, 480, 1.0 / 3e-3, 401, 320.1, 239.7, {0.1, 0.2, 0.3, 0.4, 0.5}, 0.25),
      Camera::fisheye(640, 480, 300, 301, 320.1, 239.7, {0.01, 0.02, 0.03, 0.04}, 0.5),
      Camera::double_sphere(640, 480, 300, 301, 320.1, 239.7, -0.2, 0.55),
      line_camera(),
      Camera::brown_forward(640, 480, 300, 301, 320.1, 239.7, {1e-3, 2e-5, 0, 1e-5, 0, 0, 1e-4}, 80,
                            0.9, 0.3),
      Camera::brown_backward(640, 480, 300, 301, 320.1, 239.7, {}, 80),
      Camera::equirectangular(2000, 900, 0.003, 310, 998, 450),
      Camera::rotating_line_first_order([] {
        RotatingLine line = line_camera().line();
        line.tumbling_rad = {};
        return line;
      }())};
  return all;
}

TEST(CameraText, EveryModelReadsBackToTheLastBit) {
  const test::Folder folder;
  for (const Camera& camera : every_model()) {
    const std::string path = folder.file("camera.yaml", "");
    write_camera(path, camera);
    expect_equal(read_camera(path), camera);
    Scene scene = test::irregular_room();
    scene.camera = camera;
    expect_equal(parse_scene(format_scene(scene)).camera, camera);
  }
}

TEST(CameraText, OpenCvAndRosSupportPinholesAndFisheyes) {
  const test::Folder folder;
  for (const CameraFormat format : {CameraFormat::opencv, CameraFormat::ros}) {
    const std::string path = folder.file("camera.yaml", "");
    for (const Camera& camera : {every_model()[0], every_model()[1]}) {
      write_camera(path, camera, format);
      expect_equal(read_camera(path), camera);
    }
    for (std::size_t i = 2; i < every_model().size(); ++i)
      EXPECT_NE(test::complaint([&] {
                  write_camera(path, every_model()[i], format);
                }).find("pinhole or fisheye"),
                std::string::npos);
    expect_equal(read_camera(path), every_model()[1]);  // the previous file is unchanged
  }
}

TEST(CameraText, OpenCvReadsAPinholeWithoutDistortion) {
  const Camera camera = Camera::pinhole(640, 480, 400, 400, 320, 240);
  const std::string text = format_camera(camera, CameraFormat::opencv);
  EXPECT_EQ(text.rfind("%YAML:1.0\n---\n", 0), 0u);
  EXPECT_NE(text.find("!!opencv-matrix"), std::string::npos);
  EXPECT_NE(text.find("[0, 0, 0, 0, 0]"), std::string::npos);
}

std::string scene_naming(const std::string& camera_file) {
  return "schema: libocc-scene/1\ncamera: {file: " + camera_file + "}\nlamps: []\n";
}

TEST(SceneWithCameraFile, ReadsEveryFormatThatIsWritten) {
  const test::Folder folder;
  const std::string path = folder.file("camera.yaml", "");
  const std::string scene = folder.file("scene.yaml", scene_naming("camera.yaml"));
  for (const Camera& camera : every_model()) {
    write_camera(path, camera);
    expect_equal(read_scene(scene).camera, camera);
    expect_equal(read_camera(scene), camera);
  }
  for (const CameraFormat format : {CameraFormat::opencv, CameraFormat::ros})
    for (const Camera& camera : {every_model()[0], every_model()[1]}) {
      write_camera(path, camera, format);
      expect_equal(read_scene(scene).camera, camera);
    }
}

TEST(SceneWithCameraFile, ReadsTheCameraOfAnotherScene) {
  const test::Folder folder;
  Scene other = test::irregular_room();
  other.camera = every_model()[0];
  write_scene(folder.file("other.yaml", ""), other);
  const std::string scene = folder.file("scene.yaml", scene_naming("other.yaml"));
  expect_equal(read_scene(scene).camera, other.camera);
  // The pixel pitch that converts a focal length is that of the other scene.
  folder.file("other.yaml",
              "schema: libocc-scene/1\n"
              "camera: {width_px: 640, height_px: 480, focal_length_m: 0.002}\n"
              "sensor: {pixel_pitch_m: 4.0e-6}\nlamps: []\n");
  EXPECT_DOUBLE_EQ(read_scene(scene).camera.fx_px(), 500);
}

TEST(SceneWithCameraFile, NamesTheWrongKeyOfTheCameraFile) {
  const test::Folder folder;
  const std::string scene = folder.file("scene.yaml", scene_naming("camera.yaml"));
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"camera: {file: camera.yaml}\n",
       ":1: key `camera.file`: must not name a further file, got camera.yaml"},
      {"camera: {width_px: 9, height_px: 9, fx: 9}\n", ":1: key `camera.fx"},
      {"camera: {width_px: 9, height_px: 9, fx_px: -9}\n",
       ":1: key `camera.fx_px`: must be positive and finite, got -9"},
      {"sigma0: 0.7\n", ":1: key `camera`: is missing; a camera file has a section `camera`"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string path = folder.file("camera.yaml", text);
    const std::string found = test::complaint<std::runtime_error>([&] { read_scene(scene); });
    EXPECT_EQ(found.find(scene + ":2: key `camera.file`: " + path + expected), 0u) << found;
  }
}

TEST(SceneWithCameraFile, AGivenCameraReplacesTheSection) {
  const std::string lamps = "lamps: [{id: 0, centre_m: [0, 0, 3], radius_m: 0.1}]\n";
  const Camera camera =
      Camera::pinhole(100, 80, 90, 90, 50, 40).with_parameter_sigmas({{"f_px", 2}});
  for (const std::string section :
       {"", "camera: {width_px: 9, height_px: 9, fx_px: 9}\n", "camera: {file: absent.yaml}\n"}) {
    const test::Folder folder;
    const Scene scene =
        read_scene(folder.file("scene.yaml", "schema: libocc-scene/1\n" + section + lamps), camera);
    EXPECT_EQ(scene.camera.width(), 100);
    EXPECT_EQ(scene.camera.parameter_covariance(), camera.parameter_covariance());
    EXPECT_EQ(scene.lamps.size(), 1U);
  }
}

TEST(SceneWithCameraFile, ACommonErrorOfTheFocalLengthsIsReadAndSurvives) {
  const Scene scene = parse_scene(
      "schema: libocc-scene/1\n"
      "camera: {width_px: 9, height_px: 9, fx_px: 20, fy_px: 10, parameter_sigmas: {f_px: 2}}\n"
      "lamps: []\n");
  const Eigen::MatrixXd covariance = scene.camera.parameter_covariance();
  EXPECT_EQ(covariance(0, 0), 4);
  EXPECT_EQ(covariance(0, 1), 2);
  EXPECT_EQ(covariance(1, 1), 1);
  EXPECT_EQ(parse_scene(format_scene(scene)).camera.parameter_covariance(),
            scene.camera.parameter_covariance());
}

}  // namespace
}  // namespace occ
