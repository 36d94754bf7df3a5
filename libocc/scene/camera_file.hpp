// SPDX-License-Identifier: Apache-2.0
// Cameras as YAML files, in three formats: libocc's own (the `camera:` section of a scene file; all
// models), OpenCV's FileStorage as its calibration sample writes it, and ROS's camera_info (both:
// pinhole and fisheye). The reader recognises the format by its keys.
#pragma once

#include <string>

#include "libocc/camera/camera.hpp"

namespace occ {

/// File formats of cameras.
enum class CameraFormat {
  libocc,  ///< `camera:` section of a scene file
  opencv,  ///< FileStorage of OpenCV's calibration sample
  ros,     ///< camera_info of ROS
};

/// Reads a camera from an OpenCV FileStorage YAML (`camera_matrix`, `distortion_coefficients`,
/// `image_width`, `image_height`, `fisheye_model`), a ROS camera_info YAML (the same keys with
/// `distortion_model` plumb_bob, rational_polynomial or equidistant), or the `camera:` section of a
/// scene file. Throws std::runtime_error "FILE:LINE: key `camera.fx_px`: must be ...".
LIBOCC_API Camera read_camera(const std::string& path);

/// Text that read_camera reads back to the same camera, to the last bit. `name` is ROS's
/// `camera_name`. Throws std::invalid_argument when the format does not support the model.
LIBOCC_API std::string format_camera(const Camera& camera,
                                     CameraFormat format = CameraFormat::libocc,
                                     const std::string& name = "camera");

/// Writes the file completely or leaves it unchanged. Throws std::runtime_error naming the file.
LIBOCC_API void write_camera(const std::string& path, const Camera& camera,
                             CameraFormat format = CameraFormat::libocc);

}  // namespace occ
