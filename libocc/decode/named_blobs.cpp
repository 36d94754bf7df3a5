// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <string>
#include <utility>

#include "libocc/core/require.hpp"
#include "libocc/decode/decode.hpp"

namespace occ {
namespace {

/// Whether a light lies at another's, as pieces do into which noise breaks a lamp.
bool at_same_place(const Blob& a, const Blob& b) {
  const double reach_x = 0.75 * (a.x1 - a.x0 + b.x1 - b.x0) + 2;
  const double reach_y = 0.75 * (a.y1 - a.y0 + b.y1 - b.y0) + 2;
  const Eigen::Vector2d apart = (a.centroid_px - b.centroid_px).cwiseAbs();
  return apart.x() <= reach_x && apart.y() <= reach_y;
}

/// What a light is among those that say the same.
enum class Standing {
  main,   ///< alone, or the brightest of its pieces
  piece,  ///< of a brighter one
  rival,  ///< another elsewhere says the same
};
Standing standing_of(const DecodedLamp& lamp, const std::vector<DecodedLamp>& lamps) {
  Standing standing = Standing::main;
  for (const DecodedLamp& other : lamps) {
    if (&other == &lamp || other.code.id != lamp.code.id) continue;
    if (!at_same_place(lamp.blob, other.blob)) return Standing::rival;
    const auto order = [](const DecodedLamp& l) { return std::pair(l.blob.flux_dn, &l); };
    if (order(other) > order(lamp)) standing = Standing::piece;
  }
  return standing;
}

}  // namespace

Result<std::vector<Blob>> named_blobs(const std::vector<DecodedLamp>& lamps, const Scene& map,
                                      const Code& code) {
  std::map<int, int> lamp_of_id;
  for (const Lamp& lamp : map.lamps) {
    if (!lamp.code || lamp.code->code.kind != code.kind || lamp.code->channel != 0) continue;
    const bool is_new = lamp_of_id.emplace(lamp.code->id, lamp.id).second;
    require(is_new, "map: code id", lamp.code->id, "of one lamp only");
  }
  Result<std::vector<Blob>> out;
  std::string unknown, twice;
  for (const DecodedLamp& lamp : lamps) {
    Blob& blob = out.value.emplace_back(lamp.blob);
    if (!lamp.code.id) continue;
    const int id = static_cast<int>(*lamp.code.id);
    const auto named = lamp_of_id.find(id);
    if (named == lamp_of_id.end())
      unknown += " " + std::to_string(id);
    else if (const auto said = standing_of(lamp, lamps); said == Standing::rival)
      twice += " " + std::to_string(id);
    else if (said == Standing::main)
      blob.lamp_id = named->second;
  }
  if (lamps.empty()) out.status = Status::no_lamps;
  if (!unknown.empty()) out.message += "not in the map:" + unknown + ". ";
  if (!twice.empty()) out.message += "read from several lights, none of them named:" + twice + ". ";
  return out;
}

}  // namespace occ
