// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/yaml_section.hpp"
#include "libocc/core/math.hpp"
#include "libocc/scene/camera_file.hpp"
#include "libocc/scene/internal/camera_section.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

// The focal length in metres needs the pixel pitch, which belongs to the sensor.
double focal_length_px(YamlSection& camera, YamlSection& root) {
  double focal_length_m = 0, pixel_pitch_m = 0;
  camera.need("focal_length_m", focal_length_m);
  if (camera.has("fx_px") || camera.has("fy_px"))
    camera.fail_value("focal_length_m", "must not be given together with `fx_px` or `fy_px`");
  if (root.has("sensor")) root.section("sensor").read("pixel_pitch_m", pixel_pitch_m);
  if (!(pixel_pitch_m > 0))
    camera.fail("focal_length_m", "needs a positive `sensor.pixel_pitch_m`");
  if (!(focal_length_m > 0)) camera.fail_value("focal_length_m", "must be positive");
  return focal_length_m / pixel_pitch_m;
}

std::array<Word<CameraKind>, 8> kind_words() {
  std::array<Word<CameraKind>, 8> words{};
  std::size_t i = 0;
  for (const CameraKind kind :
       {CameraKind::pinhole, CameraKind::fisheye, CameraKind::double_sphere,
        CameraKind::brown_forward, CameraKind::brown_backward, CameraKind::equirectangular,
        CameraKind::rotating_line, CameraKind::rotating_line_first_order})
    words[i++] = {name_of(kind), kind};
  return words;
}

bool is_brown(CameraKind kind) {
  return kind == CameraKind::brown_forward || kind == CameraKind::brown_backward;
}

/// Names of all parameters that a camera of this model can have, and of the common focal length.
std::vector<std::string> parameter_names(const Camera& camera) {
  const Camera longest = camera.is_pinhole()
                             ? Camera::pinhole(1, 1, 1, 1, 0, 0, std::vector<double>(14))
                         : camera.kind() == CameraKind::fisheye
                             ? Camera::fisheye(1, 1, 1, 1, 0, 0, std::vector<double>(4))
                         : is_brown(camera.kind())
                             ? Camera::brown_backward(1, 1, 1, 1, 0, 0, std::vector<double>(7), 1)
                             : camera;
  std::vector<std::string> names;
  for (const CameraParameter& parameter : longest.parameters()) {
    names.push_back(parameter.name);
    if (parameter.name == "fx_px") names.emplace_back(common_focal_length);
  }
  return names;
}

/// The keys `parameter_sigmas` and `parameter_covariance`, which describe errors of the camera.
struct ErrorKeys {
  std::optional<YamlSection> sigmas;
  std::vector<double> covariance;
};

ErrorKeys read_errors(YamlSection& camera) {
  ErrorKeys keys;
  if (camera.has("parameter_sigmas")) keys.sigmas = camera.section("parameter_sigmas");
  if (camera.has("parameter_covariance")) camera.read("parameter_covariance", keys.covariance);
  if (keys.sigmas && !keys.covariance.empty())
    camera.fail("parameter_covariance", "must not be given together with `parameter_sigmas`");
  return keys;
}

Camera with_errors(const Camera& exact, ErrorKeys keys, const YamlSection& camera) {
  Camera made = exact;
  if (keys.sigmas) {
    std::map<std::string, double> sigmas;
    for (const std::string& name : parameter_names(exact)) {
      std::optional<double> sigma;
      keys.sigmas->read(name, sigma);
      if (sigma) sigmas[name] = *sigma;
    }
    keys.sigmas->reject_unknown();
    keys.sigmas->check([&] { made = exact.with_parameter_sigmas(sigmas); },
                       sigmas.empty() ? "" : sigmas.begin()->first);
  }
  if (keys.covariance.empty()) return made;
  const auto count = static_cast<Eigen::Index>(exact.parameters().size());
  if (static_cast<Eigen::Index>(keys.covariance.size()) != count * count)
    camera.fail_value("parameter_covariance", "must be a list of " + std::to_string(count) + " x " +
                                                  std::to_string(count) + " numbers, row by row");
  const Eigen::Map<const Eigen::MatrixXd> covariance(keys.covariance.data(), count, count);
  camera.check([&] { made = exact.with_parameter_covariance(covariance); }, "parameter_covariance");
  return made;
}

Camera read_line(YamlSection& camera, CameraKind kind, int width, int height) {
  RotatingLine line;
  line.width = width;
  line.height = height;
  line.cy_px = (height - 1) / 2.0;
  camera.read("angle_per_px_rad", line.angle_per_px_rad);
  camera.need("c_px", line.c_px);
  camera.read("cy_px", line.cy_px);
  camera.read("tilt_x_rad", line.tilt_x_rad);
  camera.read("tilt_y_rad", line.tilt_y_rad);
  camera.read("eccentricity_m", line.eccentricity_m);
  camera.read("k1", line.k1);
  camera.read("k2", line.k2);
  std::vector<double> tumbling(line.tumbling_rad.size(), 0.0);
  camera.read("tumbling_rad", tumbling);
  if (tumbling.size() != line.tumbling_rad.size())
    camera.fail_value("tumbling_rad", "must be a list of 6 numbers");
  std::copy(tumbling.begin(), tumbling.end(), line.tumbling_rad.begin());
  const ErrorKeys errors = read_errors(camera);
  camera.reject_unknown();
  std::optional<Camera> made;
  camera.check([&] {
    made = kind == CameraKind::rotating_line ? Camera::rotating_line(line)
                                             : Camera::rotating_line_first_order(line);
  });
  return with_errors(*made, errors, camera);
}

Camera read_equirectangular(YamlSection& camera, int width, int height) {
  double angle_per_px_rad = 2 * pi / width;
  camera.read("angle_per_px_rad", angle_per_px_rad);
  double fy_px = 1 / angle_per_px_rad;
  double cx_px = (width - 1) / 2.0, cy_px = (height - 1) / 2.0;
  camera.read("fy_px", fy_px);
  camera.read("cx_px", cx_px);
  camera.read("cy_px", cy_px);
  const ErrorKeys errors = read_errors(camera);
  camera.reject_unknown();
  std::optional<Camera> made;
  camera.check([&] {
    made = Camera::equirectangular(width, height, angle_per_px_rad, fy_px, cx_px, cy_px);
  });
  return with_errors(*made, errors, camera);
}

Camera read_plane(YamlSection& camera, YamlSection& root, CameraKind kind, int width, int height) {
  double fx_px = 0, fy_px = 0, skew_px = 0, xi = 0, alpha = 0, unit_px = 0, r0 = 0;
  std::vector<double> distortion;
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
  if (kind == CameraKind::double_sphere) {
    camera.need("xi", xi);
    camera.need("alpha", alpha);
  } else {
    camera.read("skew_px", skew_px);
    camera.read("distortion", distortion);
  }
  if (is_brown(kind)) {
    camera.need("unit_px", unit_px);
    camera.read("r0", r0);
  }
  const ErrorKeys errors = read_errors(camera);
  camera.reject_unknown();
  std::optional<Camera> made;
  camera.check([&] {
    if (kind == CameraKind::double_sphere)
      made = Camera::double_sphere(width, height, fx_px, fy_px, cx_px, cy_px, xi, alpha);
    else if (kind == CameraKind::brown_forward)
      made = Camera::brown_forward(width, height, fx_px, fy_px, cx_px, cy_px, distortion, unit_px,
                                   r0, skew_px);
    else if (kind == CameraKind::brown_backward)
      made = Camera::brown_backward(width, height, fx_px, fy_px, cx_px, cy_px, distortion, unit_px,
                                    r0, skew_px);
    else if (kind == CameraKind::fisheye)
      made = Camera::fisheye(width, height, fx_px, fy_px, cx_px, cy_px, distortion, skew_px);
    else
      made = Camera::pinhole(width, height, fx_px, fy_px, cx_px, cy_px, distortion, skew_px);
  });
  return with_errors(*made, errors, camera);
}

Camera read_inline(YamlSection& camera, YamlSection& root) {
  CameraKind kind = CameraKind::pinhole;
  int width = 0, height = 0;
  camera.read("model", kind, kind_words());
  camera.need("width_px", width);
  camera.need("height_px", height);
  if (kind == CameraKind::equirectangular) return read_equirectangular(camera, width, height);
  const bool is_rotating_line =
      kind == CameraKind::rotating_line || kind == CameraKind::rotating_line_first_order;
  return is_rotating_line ? read_line(camera, kind, width, height)
                          : read_plane(camera, root, kind, width, height);
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

// ROS's distortion models correspond to coefficient sets of OpenCV:
// sensor_msgs/distortion_models.h.
bool reads_as_fisheye(YamlSection& file, std::size_t coefficients) {
  std::string model;
  int fisheye = 0;
  file.read("distortion_model", model);
  file.read("fisheye_model", fisheye);
  if (model == "plumb_bob" && coefficients != 0 && coefficients != 4 && coefficients != 5)
    file.fail("distortion_model",
              "plumb_bob has 5 coefficients, got " + std::to_string(coefficients));
  if (!model.empty() && model != "plumb_bob" && model != "rational_polynomial" &&
      model != "equidistant")
    file.fail_value("distortion_model", "must be plumb_bob, rational_polynomial or equidistant");
  if (fisheye != 0 && fisheye != 1) file.fail_value("fisheye_model", "must be 0 or 1");
  const bool is_fisheye = fisheye == 1 || model == "equidistant";
  if (is_fisheye && coefficients > 4)
    file.fail("distortion_coefficients",
              "a fisheye has 4 coefficients, got " + std::to_string(coefficients));
  return is_fisheye;
}

Camera read_calibration(YamlSection& file) {
  int width = 0, height = 0;
  if (!file.has("image_width") && !file.has("camera_matrix"))
    file.fail("camera",
              "is missing; a camera file has a section `camera` (libocc) or "
              "`image_width`, `image_height` and `camera_matrix` (OpenCV, ROS)");
  file.need("image_width", width);
  file.need("image_height", height);
  const std::vector<double> k = read_matrix(file, "camera_matrix");
  const bool is_camera_matrix =
      k.size() == 9 && k[3] == 0 && k[6] == 0 && k[7] == 0 && std::abs(k[8] - 1) < 1e-12;
  if (!is_camera_matrix) file.fail("camera_matrix", "must be 3 x 3: fx skew cx, 0 fy cy, 0 0 1");
  std::vector<double> distortion;
  if (file.has("distortion_coefficients"))
    distortion = read_matrix(file, "distortion_coefficients");
  const auto factory =
      reads_as_fisheye(file, distortion.size()) ? &Camera::fisheye : &Camera::pinhole;
  std::optional<Camera> made;
  const auto make = [&] {
    made = factory(width, height, k[0], k[4], k[2], k[5], distortion, k[1]);
  };
  file.check(make, "camera_matrix");
  return *made;
}

// Reads the camera file that a scene names, in any of the three formats.
Camera read_named_file(const std::string& path) {
  const auto node = read_yaml(path);
  YamlSection file(node, node->line, path, "");
  if (!file.has("camera")) return read_calibration(file);
  YamlSection camera = file.section("camera");
  if (camera.has("file")) camera.fail_value("file", "must not name a further file");
  return read_inline(camera, file);
}

}  // namespace

Camera internal::scene::read_camera_section(YamlSection& root) {
  YamlSection camera = root.section("camera");
  if (!camera.has("file")) return read_inline(camera, root);
  std::string name;
  camera.read("file", name);
  const ErrorKeys errors = read_errors(camera);
  camera.reject_unknown();
  const std::filesystem::path path = std::filesystem::path(root.file()).parent_path() / name;
  std::optional<Camera> named;
  try {
    named = read_named_file(path.string());
  } catch (const std::runtime_error& error) {
    camera.fail("file", error.what());
  }
  return with_errors(*named, errors, camera);
}

Camera read_camera(const std::string& path) {
  const auto node = read_yaml(path);
  YamlSection file(node, node->line, path, "");
  return file.has("camera") ? read_camera_section(file) : read_calibration(file);
}

}  // namespace occ
