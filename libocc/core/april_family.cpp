// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/april_family.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <algorithm>

namespace occ::internal::core {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
  bool has_border;  // a black border around the bits
};

constexpr Family families[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy, true},
    {"tag36h10", tag36h10_create, tag36h10_destroy, true},
    {"tag25h9", tag25h9_create, tag25h9_destroy, true},
    {"tag16h5", tag16h5_create, tag16h5_destroy, true},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy, false},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy, false}};

}  // namespace

std::vector<std::string> april_family_names() {
  std::vector<std::string> names;
  for (const Family& family : families) names.emplace_back(family.name);
  return names;
}

std::vector<std::string> bordered_family_names() {
  std::vector<std::string> names;
  for (const Family& family : families)
    if (family.has_border) names.emplace_back(family.name);
  return names;
}

AprilFamily make_april_family(const std::string& name, int border_cells) {
  for (const Family& family : families) {
    if (name != family.name) continue;
    AprilFamily made(family.create(), family.destroy);
    // libapriltag places bits relative to the corner of the black square.
    const int wider = family.has_border ? std::max(0, border_cells - 1) : 0;
    made->width_at_border += 2 * wider;
    made->total_width += 2 * wider;
    for (std::uint32_t i = 0; i < made->nbits; ++i) {
      made->bit_x[i] += static_cast<std::uint32_t>(wider);
      made->bit_y[i] += static_cast<std::uint32_t>(wider);
    }
    return made;
  }
  return {nullptr, [](apriltag_family*) {}};
}

int april_family_size(const std::string& name) {
  const AprilFamily family = make_april_family(name);
  return family ? static_cast<int>(family->ncodes) : 0;
}

int april_family_width(const std::string& name, int border_cells) {
  const AprilFamily family = make_april_family(name, border_cells);
  return family ? family->width_at_border : 0;
}

}  // namespace occ::internal::core
