// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "libocc/core/internal/yaml_section.hpp"

namespace occ::internal::core {
namespace {

// Units at the end of keys.
const char* unit_name(const std::string& suffix) {
  static const std::map<std::string, const char*> names = {
      {"m", "metres"},  {"px", "pixels"}, {"deg", "degrees"}, {"w", "watts"},
      {"s", "seconds"}, {"hz", "hertz"},  {"e", "electrons"}, {"dn", "grey levels"}};
  const auto found = names.find(suffix);
  return found == names.end() ? nullptr : found->second;
}

bool is_foreign_unit(const std::string& suffix) {
  static const std::set<std::string> units = {
      "mm",  "cm",    "dm",     "um",  "nm",     "km",      "in",  "inch", "ft",
      "pix", "pixel", "pixels", "rad", "degree", "degrees", "mw",  "kw",   "watt",
      "lm",  "ms",    "us",     "ns",  "min",    "khz",     "mhz", "rpm"};
  return units.count(suffix) > 0;
}

struct Split {
  std::string stem, unit;
};

// "radius_mm" -> radius, mm; "gain_dn_per_e" has a compound unit and is not split.
Split split_unit(const std::string& key) {
  const std::size_t bar = key.rfind('_');
  if (bar == std::string::npos || key.find("_per_") != std::string::npos) return {key, ""};
  const std::string suffix = key.substr(bar + 1);
  if (!unit_name(suffix) && !is_foreign_unit(suffix)) return {key, ""};
  return {key.substr(0, bar), suffix};
}

// Levenshtein distance.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

}  // namespace

bool differ_in_unit(const std::string& unknown, const std::string& known) {
  const Split given = split_unit(unknown), meant = split_unit(known);
  return given.stem == meant.stem && given.unit != meant.unit && !meant.unit.empty();
}

std::string suggest_key(const std::string& unknown, const std::vector<std::string>& known) {
  const std::string word =
      unknown.substr(0, 64);  // bounds the time of the distance, which grows with both lengths
  std::string nearest, all;
  std::size_t min_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& key : known) {
    if (differ_in_unit(word, key))
      return "write `" + key + "`, in " + unit_name(split_unit(key).unit);
    const std::size_t distance = edits(word, key);
    if (distance < min_distance) {
      min_distance = distance;
      nearest = key;
    }
    all += (all.empty() ? "" : ", ") + key;
  }
  return nearest.empty() ? "known here: " + all : "did you mean `" + nearest + "`?";
}

}  // namespace occ::internal::core
