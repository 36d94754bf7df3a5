// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/rung_costs.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::core;
namespace {

constexpr char schema[] = "libocc-costs/1";
constexpr int window_margin_px = 4;  // that the direct rung sees around a blob

using RungMember = std::pair<const char*, RungCost RungCosts::*>;
constexpr std::array<RungMember, 4> rungs{{{"points", &RungCosts::points},
                                           {"centres", &RungCosts::centres},
                                           {"rims", &RungCosts::rims},
                                           {"direct", &RungCosts::direct}}};

using CostMember = std::pair<const char*, double RungCost::*>;
constexpr std::array<CostMember, 4> terms{{{"fixed_s", &RungCost::fixed_s},
                                           {"per_lamp_s", &RungCost::per_lamp_s},
                                           {"per_rim_point_s", &RungCost::per_rim_point_s},
                                           {"per_pixel_s", &RungCost::per_pixel_s}}};

class CostFile {
 public:
  explicit CostFile(std::string name) : name_(std::move(name)) {}

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& reason) const {
    const std::string line = mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
    throw std::runtime_error(name_ + line + ": " + reason);
  }

  template <typename Known>
  void check_keys(const YAML::Node& node, const std::string& of, const Known& known) const {
    if (!node.IsMap()) fail(node.Mark(), (of.empty() ? "the file" : of) + " must be a mapping");
    for (const auto& entry : node) {
      const std::string key = entry.first.Scalar();
      bool found = of.empty() && key == "schema";
      for (const auto& member : known) found = found || key == member.first;
      if (!found) fail(entry.first.Mark(), "unknown key `" + path(of, key) + "`");
    }
  }

  double number(const YAML::Node& parent, const std::string& of, const char* key) const {
    const YAML::Node node = parent[key];
    if (!node) fail(parent.Mark(), "key `" + path(of, key) + "` is missing");
    double value = 0;
    const bool is_number = node.IsScalar() && YAML::convert<double>::decode(node, value);
    if (is_number && value >= 0 && std::isfinite(value)) return value;
    fail(node.Mark(), "key `" + path(of, key) + "`: must be zero or positive" +
                          (node.IsScalar() ? ", got " + node.Scalar() : ""));
  }

 private:
  static std::string path(const std::string& of, const std::string& key) {
    return of.empty() ? key : of + "." + key;
  }

  std::string name_;
};

}  // namespace

RungWork work_of(const std::vector<Match>& matches, const std::vector<Blob>& blobs) {
  RungWork work;
  for (const Match& match : matches) {
    const Blob& blob = blobs[match.blob];
    ++work.lamps;
    work.rim_points += static_cast<int>(blob.rim.size());
    work.pixels += (blob.x1 - blob.x0 + 1 + 2 * window_margin_px) *
                   (blob.y1 - blob.y0 + 1 + 2 * window_margin_px);
  }
  return work;
}

double RungCost::predicted_s(const RungWork& work) const {
  return fixed_s + per_lamp_s * work.lamps + per_rim_point_s * work.rim_points +
         per_pixel_s * work.pixels;
}

bool RungCost::operator==(const RungCost& other) const {
  return std::all_of(terms.begin(), terms.end(), [&](const CostMember& term) {
    return this->*term.second == other.*term.second;
  });
}

bool RungCosts::operator==(const RungCosts& other) const {
  return std::all_of(rungs.begin(), rungs.end(), [&](const RungMember& rung) {
    return this->*rung.second == other.*rung.second;
  });
}

const RungCost& RungCosts::of(Rung rung) const {
  return this->*rungs[static_cast<std::size_t>(rung)].second;
}

void RungCosts::validate() const {
  for (const auto& [rung, cost] : rungs) {
    for (const auto& [term, seconds] : terms) {
      const double value = this->*cost.*seconds;
      require(value >= 0 && std::isfinite(value), std::string("costs.") + rung + "." + term, value,
              "zero or positive");
    }
  }
}

RungCosts parse_rung_costs(const std::string& text, const std::string& name) {
  const CostFile file(name);
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    file.fail(error.mark, error.msg);
  }
  file.check_keys(root, "", rungs);
  const YAML::Node version = root["schema"];
  if (!version || !version.IsScalar() || version.Scalar() != schema) {
    file.fail(version ? version.Mark() : root.Mark(),
              std::string("key `schema`: must be ") + schema);
  }
  RungCosts costs;
  for (const auto& [rung, cost] : rungs) {
    const YAML::Node node = root[rung];
    if (!node) file.fail(root.Mark(), std::string("key `") + rung + "` is missing");
    file.check_keys(node, rung, terms);
    for (const auto& [term, seconds] : terms) {
      costs.*cost.*seconds = file.number(node, rung, term);
    }
  }
  return costs;
}

RungCosts read_rung_costs(const std::string& path) {
  return parse_rung_costs(read_file(path), path);
}

std::string format_rung_costs(const RungCosts& costs) {
  std::ostringstream text;
  text.precision(17);
  text << "# Time of refining one pose by each rung [s]; measured by `libocc ladder --costs`.\n"
       << "schema: " << schema << "\n";
  for (const auto& [rung, cost] : rungs) {
    text << rung << ":\n";
    for (const auto& [term, seconds] : terms) {
      text << "  " << term << ": " << costs.*cost.*seconds << "\n";
    }
  }
  return text.str();
}

void write_rung_costs(const std::string& path, const RungCosts& costs) {
  costs.validate();
  const std::string text = format_rung_costs(costs);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
