// SPDX-License-Identifier: Apache-2.0
// Internal: the colour that lamps may have whose scene states none.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "libocc/core/image.hpp"
#include "libocc/detect/detect.hpp"

namespace occ::internal::locate {

/// Saturated colour of the brightest lights in an image that have one: red, green and blue over the
/// largest of them. Empty for a grey image, and if all lights are as white as lamps and daylight
/// are. It is searched in the differences of the channels, so that white lights may overlap the
/// coloured ones. `options`: with a sensor.
std::optional<Eigen::Vector3d> saturated_colour(const ImageView& image, DetectOptions options);

/// Sentence for the message of a fix.
std::string text_of_found_colour(const Eigen::Vector3d& colour);

}  // namespace occ::internal::locate
