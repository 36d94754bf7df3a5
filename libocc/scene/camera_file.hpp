// SPDX-License-Identifier: Apache-2.0
// Cameras as YAML files. Three formats: libocc's own (the `camera:` section of a scene file; every
// model), OpenCV's FileStorage as its calibration sample writes it, and ROS's camera_info (both:
// pinhole and fisheye). Reading tells them apart by their keys.
#pragma once

#include <string>

#include "libocc/camera/camera.hpp"

namespace occ {

enum class CameraFormat { libocc, opencv, ros };

/// Reads a camera from an OpenCV FileStorage YAML (`camera_matrix`, `distortion_coefficients`,
/// `image_width`, `image_height`, `fisheye_model`), a ROS camera_info YAML (the same keys with
/// `distortion_model` plumb_bob, rational_polynomial or equidistant), or the `camera:` section of a
/// scene file. Throws std::runtime_error "FILE:LINE: key `camera.fx_px`: must be ...".
LIBOCC_API Camera read_camera(const std::string& path);

/// Text that read_camera reads back to the same camera, to the last bit. `name` goes into ROS's
/// `camera_name`. Throws std::invalid_argument when the format has no such model.
LIBOCC_API std::string format_camera(const Camera& camera,
                                     CameraFormat format = CameraFormat::libocc,
                                     const std::string& name = "camera");

/// Writes whole or not at all. Throws std::runtime_error naming the file.
LIBOCC_API void write_camera(const std::string& path, const Camera& camera,
                             CameraFormat format = CameraFormat::libocc);

}  // namespace occ
