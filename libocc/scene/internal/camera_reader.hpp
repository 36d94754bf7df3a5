// SPDX-License-Identifier: Apache-2.0
// Cameras from and to the `camera:` section of a scene file and from calibration files.
#pragma once

#include "libocc/camera/camera.hpp"
#include "libocc/scene/internal/yaml_section.hpp"

namespace occ::internal::scene {

/// The `camera:` section of a scene file's root, or the calibration file that it names.
Camera read_camera_section(YamlSection& root);

/// Appends the section that is read back to the same camera.
void write_camera_section(const Camera& camera, std::string& out);

}  // namespace occ::internal::scene
