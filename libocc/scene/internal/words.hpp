// SPDX-License-Identifier: Apache-2.0
// The words that scene files use, shared by reader and writer.
#pragma once

#include "libocc/scene/internal/yaml_section.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::scene {

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

inline YamlSection::Words<CodeKind> code_kind_words() {
  return {{"c_ook", CodeKind::c_ook},
          {"ufsook", CodeKind::ufsook},
          {"s2psk", CodeKind::s2psk},
          {"csk", CodeKind::csk}};
}

inline YamlSection::Words<LineCode> line_code_words() {
  return {{"manchester", LineCode::manchester}, {"4b6b", LineCode::code_4b6b}};
}

inline YamlSection::Words<Checksum> checksum_words() {
  return {{"crc8", Checksum::crc8}, {"crc16", Checksum::crc16}};
}

}  // namespace occ::internal::scene
