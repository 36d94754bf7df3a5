// SPDX-License-Identifier: Apache-2.0
// The words that scene files use, shared by reader and writer.
#pragma once

#include "libocc/scene/internal/yaml_section.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

inline constexpr char schema_prefix[] = "libocc-scene/";

inline YamlSection::Words<LampShape> shape_words() {
  return {{"disc", LampShape::disc},
          {"rectangle", LampShape::rectangle},
          {"point", LampShape::point},
          {"lame", LampShape::lame}};
}

inline YamlSection::Words<Response> response_words() {
  return {{"linear", Response::linear},
          {"gamma", Response::gamma},
          {"srgb", Response::srgb},
          {"table", Response::table}};
}

inline YamlSection::Words<Mosaic> mosaic_words() {
  return {{"none", Mosaic::none},
          {"rggb", Mosaic::rggb},
          {"grbg", Mosaic::grbg},
          {"gbrg", Mosaic::gbrg},
          {"bggr", Mosaic::bggr}};
}

/// Tools that write YAML make `true` of `on`.
inline YamlSection::Words<Use> use_words() {
  return {{"on", Use::on},
          {"off", Use::off},
          {"auto", Use::automatic},
          {"true", Use::on},
          {"false", Use::off}};
}

inline YamlSection::Words<Readout> readout_words() {
  return {{"rows", Readout::rows}, {"columns", Readout::columns}, {"unknown", Readout::unknown}};
}

}  // namespace occ
