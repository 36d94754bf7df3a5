// SPDX-License-Identifier: Apache-2.0
// Any text is a scene or a std::runtime_error; a scene survives being written and read again.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "libocc/scene/scene_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  occ::Scene scene;
  try {
    scene = occ::parse_scene(std::string(reinterpret_cast<const char*>(data), size));
  } catch (const std::runtime_error&) {
    return 0;
  }
  const std::string once = occ::format_scene(scene);
  const std::string twice = occ::format_scene(occ::parse_scene(once, "what format_scene wrote"));
  if (once != twice) {
    std::fprintf(stderr, "first:\n%s\nthen:\n%s\n", once.c_str(), twice.c_str());
    std::abort();
  }
  return 0;
}
