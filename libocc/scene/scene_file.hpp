// SPDX-License-Identifier: Apache-2.0
// Scenes as YAML files. Keys carry their unit (`radius_m`, `half_power_deg`); an
// unknown key, a missing one, a wrong type or a value out of range is an error that names file,
// line, key and value. The schema is in data/scenes/README.md.
#pragma once

#include <string>

#include "libocc/scene/camera_file.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Version of the scene schema this library writes; it reads this and earlier ones.
inline constexpr int scene_schema_version = 1;

/// Reads a scene. Its `camera:` section may instead name an OpenCV or ROS camera file
/// (`camera: {file: camera.yaml}`, relative to the scene's folder). Throws std::runtime_error
/// "FILE:LINE: key `lamps[2].radius_m`: must be positive, got -0.1".
LIBOCC_API Scene read_scene(const std::string& path);

/// The same from text; `name` stands for the file in messages.
LIBOCC_API Scene parse_scene(const std::string& text, const std::string& name = "<text>");

/// Text that parse_scene reads back to an equal scene.
LIBOCC_API std::string format_scene(const Scene& scene);

/// Writes whole or not at all. Throws std::runtime_error naming the file.
LIBOCC_API void write_scene(const std::string& path, const Scene& scene);

}  // namespace occ
