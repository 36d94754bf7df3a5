// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <stdexcept>

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/yaml_lines.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/camera_file.hpp"
#include "libocc/scene/internal/camera_section.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

void write_line(const RotatingLine& line, Lines& lines) {
  lines.add("angle_per_px_rad", line.angle_per_px_rad);
  lines.add("c_px", line.c_px);
  lines.add("cy_px", line.cy_px);
  lines.add("tilt_x_rad", line.tilt_x_rad);
  lines.add("tilt_y_rad", line.tilt_y_rad);
  lines.add("eccentricity_m", line.eccentricity_m);
  lines.add("k1", line.k1);
  lines.add("k2", line.k2);
  lines.add("tumbling_rad", list_text(line.tumbling_rad));
}

std::vector<double> matrix_of(const Camera& c) {
  return {c.fx_px(), c.skew_px(), c.cx_px(), 0, c.fy_px(), c.cy_px(), 0, 0, 1};
}

void require_plane(const Camera& camera, const char* format) {
  const bool known = camera.is_pinhole() || camera.kind() == CameraKind::fisheye;
  require(known, "camera's model", name_of(camera.kind()),
          std::string("pinhole or fisheye in the format of ") + format);
}

// OpenCV and ROS files have at least five coefficients (a fisheye four); missing ones are zero.
std::vector<double> coefficients_of(const Camera& camera) {
  std::vector<double> all = camera.distortion();
  const std::size_t min_count = camera.is_pinhole() ? 5 : 4;
  if (all.size() < min_count) all.resize(min_count, 0);
  return all;
}

std::string opencv_matrix(const std::vector<double>& values, int rows, int cols) {
  std::string text = "!!opencv-matrix\n";
  Lines lines(text, "   ");
  lines.add("rows", rows);
  lines.add("cols", cols);
  lines.add("dt", std::string("d"));
  lines.add("data", list_text(values));
  text.pop_back();
  return text;
}

std::string opencv_text(const Camera& camera) {
  require_plane(camera, "OpenCV");
  const std::vector<double> k = coefficients_of(camera);
  std::string text = "%YAML:1.0\n---\n";
  Lines lines(text, "");
  lines.add("image_width", camera.width());
  lines.add("image_height", camera.height());
  if (!camera.is_pinhole()) lines.add("fisheye_model", 1);
  lines.add("camera_matrix", opencv_matrix(matrix_of(camera), 3, 3));
  lines.add("distortion_coefficients", opencv_matrix(k, static_cast<int>(k.size()), 1));
  return text;
}

void add_ros_matrix(const std::string& key, const std::vector<double>& values, int rows, int cols,
                    std::string& text) {
  text += key + ":\n";
  Lines lines(text, "  ");
  lines.add("rows", rows);
  lines.add("cols", cols);
  lines.add("data", list_text(values));
}

std::string ros_text(const Camera& camera, const std::string& name) {
  require_plane(camera, "ROS");
  const std::vector<double> k = coefficients_of(camera);
  require(!camera.is_pinhole() || k.size() <= 8, "camera's distortion", k.size(),
          "at most 8 coefficients in the format of ROS");
  const char* model = !camera.is_pinhole() ? "equidistant"
                      : k.size() <= 5      ? "plumb_bob"
                                           : "rational_polynomial";
  std::string text;
  Lines lines(text, "");
  lines.add("image_width", camera.width());
  lines.add("image_height", camera.height());
  lines.add("camera_name", quoted(name));
  add_ros_matrix("camera_matrix", matrix_of(camera), 3, 3, text);
  lines.add("distortion_model", std::string(model));
  add_ros_matrix("distortion_coefficients", k, 1, static_cast<int>(k.size()), text);
  add_ros_matrix("rectification_matrix", {1, 0, 0, 0, 1, 0, 0, 0, 1}, 3, 3, text);
  std::vector<double> projection = matrix_of(camera);
  for (const std::ptrdiff_t at : {3, 7, 11}) projection.insert(projection.begin() + at, 0.0);
  add_ros_matrix("projection_matrix", projection, 3, 4, text);
  return text;
}

void write_model(const Camera& camera, Lines& lines) {
  lines.add("model", std::string(name_of(camera.kind())));
  lines.add("width_px", camera.width());
  lines.add("height_px", camera.height());
  if (camera.kind() == CameraKind::equirectangular) {
    for (const CameraParameter& parameter : camera.parameters())
      lines.add(parameter.name, parameter.value);
    return;
  }
  if (std::isfinite(camera.period_px())) return write_line(camera.line(), lines);
  lines.add("fx_px", camera.fx_px());
  lines.add("fy_px", camera.fy_px());
  lines.add("cx_px", camera.cx_px());
  lines.add("cy_px", camera.cy_px());
  if (camera.kind() == CameraKind::double_sphere) {
    const std::vector<CameraParameter> all = camera.parameters();
    lines.add("xi", all[4].value);
    lines.add("alpha", all[5].value);
    return;
  }
  lines.add("skew_px", camera.skew_px());
  lines.add("distortion", list_text(camera.distortion()));
  for (const CameraParameter& constant : camera.constants())
    lines.add(constant.name, constant.value);
}

void write_errors(const Camera& camera, Lines& lines) {
  if (camera.is_exact()) return;
  const auto sigmas = camera.independent_sigmas();
  if (!sigmas) {
    const Eigen::MatrixXd covariance = camera.parameter_covariance();
    lines.add("parameter_covariance", list_text(covariance.reshaped()));
    return;
  }
  std::string text;
  for (const auto& [name, sigma] : *sigmas)
    text += (text.empty() ? "" : ", ") + name + ": " + text_of(sigma);
  lines.add("parameter_sigmas", "{" + text + "}");
}

}  // namespace

void internal::scene::write_camera_section(const Camera& camera, std::string& out) {
  out += "camera:\n";
  Lines lines(out, "  ");
  write_model(camera, lines);
  write_errors(camera, lines);
}

std::string format_camera(const Camera& camera, CameraFormat format, const std::string& name) {
  if (format == CameraFormat::opencv) return opencv_text(camera);
  if (format == CameraFormat::ros) return ros_text(camera, name);
  std::string text;
  write_camera_section(camera, text);
  return text;
}

void write_camera(const std::string& path, const Camera& camera, CameraFormat format) {
  const std::string text = format_camera(camera, format);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
