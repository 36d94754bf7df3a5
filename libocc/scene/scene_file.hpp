// SPDX-License-Identifier: Apache-2.0
// Scenes as YAML files. The name of a key ends with its unit (`radius_m`, `half_power_deg`). An
// unknown key, a missing key, a wrong type or a value out of range is an error that names file,
// line, key and value. data/scenes/README.md documents the keys.
#pragma once

#include <optional>
#include <string>

#include "libocc/scene/camera_file.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Version of the scene schema that this library writes; it reads this version and earlier ones.
inline constexpr int scene_schema_version = 1;

/// Reads a scene. Its `camera:` section may instead name a file of libocc, OpenCV or ROS with the
/// camera (`camera: {file: camera.yaml}`, relative to the scene's folder). Throws
/// std::runtime_error "FILE:LINE: key `lamps[2].radius_m`: must be positive, got -0.1".
/// `camera`, if given, replaces this section, which the file then need not have.
LIBOCC_API Scene read_scene(const std::string& path,
                            const std::optional<Camera>& camera = std::nullopt);

/// Reads a scene from text; messages use `name` in place of a file name.
LIBOCC_API Scene parse_scene(const std::string& text, const std::string& name = "<text>");

/// Text that parse_scene reads back to an equal scene. Files of photometry have absolute paths.
/// Throws std::invalid_argument for a lamp whose photometry is not from a file.
LIBOCC_API std::string format_scene(const Scene& scene);

/// Writes the file completely or leaves it unchanged. Files of photometry are named relative to its
/// folder. Throws std::runtime_error naming the file.
LIBOCC_API void write_scene(const std::string& path, const Scene& scene);

}  // namespace occ
