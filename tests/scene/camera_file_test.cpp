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
}

const std::vector<Camera>& every_model() {
  static const std::vector<Camera> all{
      Camera::pinhole(640, 480, 1.0 / 3e-3, 401, 320.1, 239.7, {0.1, 0.2, 0.3, 0.4, 0.5}, 0.25),
      Camera::fisheye(640, 480, 300, 301, 320.1, 239.7, {0.01, 0.02, 0.03, 0.04}, 0.5),
      Camera::double_sphere(640, 480, 300, 301, 320.1, 239.7, -0.2, 0.55), line_camera(),
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

}  // namespace
}  // namespace occ
