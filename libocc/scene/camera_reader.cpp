// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/camera_reader.hpp"

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "libocc/scene/scene_file.hpp"

namespace occ {
namespace {

// The focal length in metres needs the pixel pitch, which belongs to the sensor.
double focal_length_px(YamlSection& camera, YamlSection& root) {
  double focal_length_m = 0, pixel_pitch_m = 0;
  camera.need("focal_length_m", focal_length_m);
  if (camera.has("fx_px") || camera.has("fy_px"))
    camera.fail_value("focal_length_m", "must be absent beside `fx_px` or `fy_px`");
  if (root.has("sensor")) root.section("sensor").read("pixel_pitch_m", pixel_pitch_m);
  if (!(pixel_pitch_m > 0))
    camera.fail("focal_length_m", "needs a positive `sensor.pixel_pitch_m`");
  if (!(focal_length_m > 0)) camera.fail_value("focal_length_m", "must be positive");
  return focal_length_m / pixel_pitch_m;
}

Camera read_inline(YamlSection& camera, YamlSection& root) {
  enum class Model { pinhole } model = Model::pinhole;
  int width = 0, height = 0;
  double fx_px = 0, fy_px = 0, skew_px = 0;
  std::vector<double> distortion;
  camera.read("model", model, YamlSection::Words<Model>{{"pinhole", Model::pinhole}});
  camera.need("width_px", width);
  camera.need("height_px", height);
  if (camera.has("focal_length_m")) {
    fx_px = fy_px = focal_length_px(camera, root);
  } else {
    camera.need("fx_px", fx_px);
    fy_px = fx_px;
    camera.read("fy_px", fy_px);
  }
  double cx_px = (width - 1) / 2.0, cy_px = (height - 1) / 2.0;
  camera.read("cx_px", cx_px);
  camera.read("cy_px", cy_px);
  camera.read("skew_px", skew_px);
  camera.read("distortion", distortion);
  camera.refuse_unknown();
  Camera made;
  camera.check([&] {
    made = Camera::pinhole(width, height, fx_px, fy_px, cx_px, cy_px, distortion, skew_px);
  });
  return made;
}

// `rows`, `cols` and `data` of an OpenCV or ROS matrix, row by row.
std::vector<double> read_matrix(YamlSection& file, const std::string& key) {
  YamlSection matrix = file.section(key);
  int rows = 0, cols = 0;
  std::vector<double> data;
  matrix.need("rows", rows);
  matrix.need("cols", cols);
  matrix.need("data", data);
  if (rows < 0 || cols < 0 || static_cast<double>(data.size()) != static_cast<double>(rows) * cols)
    matrix.fail_value("data", "must be a list of rows x cols = " + std::to_string(rows) + " x " +
                                  std::to_string(cols) + " numbers");
  return data;
}

// Which of OpenCV's coefficient sets each ROS model stands for: sensor_msgs/distortion_models.h.
void refuse_other_lens(YamlSection& file, std::size_t coefficients) {
  std::string model;
  file.read("distortion_model", model);
  if (model == "plumb_bob" && coefficients != 0 && coefficients != 4 && coefficients != 5)
    file.fail("distortion_model",
              "plumb_bob has 5 coefficients, got " + std::to_string(coefficients));
  if (!model.empty() && model != "plumb_bob" && model != "rational_polynomial")
    file.fail_value("distortion_model", "must be plumb_bob or rational_polynomial");
  int fisheye = 0;
  file.read("fisheye_model", fisheye);
  if (fisheye != 0) file.fail_value("fisheye_model", "must be 0: fisheye lenses are not supported");
}

Camera read_calibration(YamlSection& file) {
  int width = 0, height = 0;
  file.need("image_width", width);
  file.need("image_height", height);
  const std::vector<double> k = read_matrix(file, "camera_matrix");
  const bool is_camera_matrix =
      k.size() == 9 && k[3] == 0 && k[6] == 0 && k[7] == 0 && std::abs(k[8] - 1) < 1e-12;
  if (!is_camera_matrix) file.fail("camera_matrix", "must be 3 x 3: fx skew cx, 0 fy cy, 0 0 1");
  std::vector<double> distortion;
  if (file.has("distortion_coefficients"))
    distortion = read_matrix(file, "distortion_coefficients");
  refuse_other_lens(file, distortion.size());
  Camera made;
  const auto make = [&] {
    made = Camera::pinhole(width, height, k[0], k[4], k[2], k[5], distortion, k[1]);
  };
  file.check(make, "camera_matrix");
  return made;
}

}  // namespace

Camera read_camera_section(YamlSection& root) {
  YamlSection camera = root.section("camera");
  if (!camera.has("file")) return read_inline(camera, root);
  std::string name;
  camera.read("file", name);
  camera.refuse_unknown();
  const std::filesystem::path path = std::filesystem::path(root.file()).parent_path() / name;
  try {
    const auto node = read_yaml(path.string());
    YamlSection file(node, node->line, path.string(), "");
    if (file.has("camera"))
      file.fail("camera", "must be in a calibration file of its own, not in another scene file");
    return read_calibration(file);
  } catch (const std::runtime_error& error) {
    camera.fail("file", error.what());
  }
}

Camera read_camera(const std::string& path) {
  const auto node = read_yaml(path);
  YamlSection file(node, node->line, path, "");
  return file.has("camera") ? read_camera_section(file) : read_calibration(file);
}

}  // namespace occ
