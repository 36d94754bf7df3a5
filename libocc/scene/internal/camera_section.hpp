// SPDX-License-Identifier: Apache-2.0
// The `camera:` section of a scene file.
#pragma once

#include <string>

#include "libocc/camera/camera.hpp"
#include "libocc/core/internal/yaml_section.hpp"

namespace occ::internal::scene {

/// Reads the `camera:` section of a scene file, or the calibration file that it names.
Camera read_camera_section(core::YamlSection& root);

/// Appends the section that read_camera_section reads back to the same camera.
void write_camera_section(const Camera& camera, std::string& out);

}  // namespace occ::internal::scene
