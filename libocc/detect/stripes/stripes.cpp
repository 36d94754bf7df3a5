// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "libocc/detect/internal/stripe_bodies.hpp"
#include "libocc/detect/internal/stripe_window.hpp"
#include "libocc/detect/internal/striped_blob.hpp"
#include "libocc/detect/internal/striped_lamp.hpp"

namespace occ::internal::detect {
namespace {

constexpr std::size_t max_candidates =
    4096;                      // components looked at, the brightest: bounds the time
constexpr int max_rounds = 8;  // of one cluster, each taking a body out

using Members = std::vector<std::size_t>;  ///< indices of components

struct Found {
  std::vector<Blob> blobs;
  std::vector<StripedShape> shapes;  ///< of the blobs
  std::vector<bool> taken;           ///< of the components
  double evidence = 0;
};

/// Reads an image whose lines are known to be rows or columns.
class Reader {
 public:
  Reader(const LinearImage& image, const DetectOptions& options, bool columns,
         const std::vector<Component>& components)
      : image_(image), options_(options), columns_(columns), components_(components) {
    boxes_.reserve(components.size());
    for (const Component& c : components) boxes_.push_back(line_box(c, columns));
    found_.taken.assign(components.size(), false);
  }

  /// Of at most so many groups of components, the brightest.
  Found read(std::size_t max_groups) {
    std::vector<Members> clusters = this->clusters(candidates());
    const auto flux = [&](const Members& members) {
      double sum = 0;
      for (const std::size_t i : members) sum += components_[i].grey.sum;
      return sum;
    };
    std::stable_sort(clusters.begin(), clusters.end(),
                     [&](const Members& a, const Members& b) { return flux(a) > flux(b); });
    if (clusters.size() > max_groups) clusters.resize(max_groups);
    for (Members& cluster : clusters) read_cluster(std::move(cluster));
    return std::move(found_);
  }

 private:
  /// The brightest components of a useful size, by line.
  Members candidates() const {
    Members chosen;
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (boxes_[i].length() >= 4) chosen.push_back(i);
    const auto flux = [&](std::size_t i) { return components_[i].grey.sum; };
    if (chosen.size() > max_candidates) {
      std::nth_element(chosen.begin(), chosen.begin() + max_candidates, chosen.end(),
                       [&](std::size_t a, std::size_t b) {
                         return std::pair(-flux(a), a) < std::pair(-flux(b), b);
                       });
      chosen.resize(max_candidates);
    }
    std::sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(boxes_[a].line0, a) < std::pair(boxes_[b].line0, b);
    });
    return chosen;
  }

  /// Whether two components may be stripes of one lamp: alike in length and height, one behind the
  /// other at a distance that fits.
  bool may_be_one(std::size_t i, std::size_t j) const {
    const LineBox &a = boxes_[i], &b = boxes_[j];
    const int longer = std::max(a.length(), b.length()), shorter = std::min(a.length(), b.length());
    const double high_i = components_[i].peak_dn - components_[i].background_dn;
    const double high_j = components_[j].peak_dn - components_[j].background_dn;
    return longer <= 8 * shorter && std::min(high_i, high_j) > 0.2 * std::max(high_i, high_j) &&
           stacked(a, b);
  }

  std::vector<Members> clusters(const Members& chosen) const {
    std::vector<std::size_t> parent(chosen.size());
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto root = [&](std::size_t i) {
      while (parent[i] != i) i = parent[i] = parent[parent[i]];
      return i;
    };
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const LineBox& box = boxes_[chosen[i]];
      const int reach = box.line1 + 4 * box.length() + 1;  // a partner is at most 8 times as long
      for (std::size_t j = i + 1; j < chosen.size() && boxes_[chosen[j]].line0 <= reach; ++j)
        if (may_be_one(chosen[i], chosen[j])) parent[root(j)] = root(i);
    }
    std::vector<Members> out(chosen.size());
    for (std::size_t i = 0; i < chosen.size(); ++i) out[root(i)].push_back(chosen[i]);
    out.erase(std::remove_if(out.begin(), out.end(), [](const Members& m) { return m.empty(); }),
              out.end());
    return out;
  }

  LineBox box_of(const Members& members) const {
    LineBox box = boxes_[members.front()];
    for (const std::size_t i : members) box += boxes_[i];
    return box;
  }

  /// Background, noise and clipping level in terms of the linear signal around some components.
  LampLimits limits(const Members& members, double& background_dn) const {
    Component sum;
    for (const std::size_t i : members) sum += components_[i];
    background_dn = sum.background_dn;
    const double above = options_.threshold_dn
                             ? std::max(*options_.threshold_dn - background_dn, 1.0)
                             : std::max(options_.threshold_sigma * sum.noise_dn, 1.0);
    LampLimits limits;
    const double dark = image_.linear_dn(background_dn);
    limits.lit = image_.linear_dn(background_dn + above) - dark;
    limits.clipped = 0.95 * image_.linear_dn(image_.full_scale_dn()) - dark;
    const Sensor& sensor = *options_.sensor;
    const double highest_hz =
        std::min(options_.max_frequency_hz, sensor.exposure_s > 0 ? 1 / sensor.exposure_s : 1e300);
    limits.max_cycles_per_line = std::min(0.5, highest_hz * sensor.row_time_s);
    return limits;
  }

  /// Bodies of a cluster, brightest first: after each lamp what is left is looked at again.
  void read_cluster(Members members) {
    const auto taken = [&](std::size_t i) { return found_.taken[i]; };
    for (int round = 0; round < max_rounds; ++round) {
      members.erase(std::remove_if(members.begin(), members.end(), taken), members.end());
      if (members.empty()) return;
      const LineBox box = box_of(members);
      if (box.lines() < 8 || box.length() < 4) return;
      double background_dn = 0;
      const LampLimits limits = this->limits(members, background_dn);
      const LineBox wide = box.grown(8 + box.lines() / 4, 8).cut_to(line_box(image_, columns_));
      const Surroundings around{image_, columns_, background_dn, found_.shapes};
      const LineWindow window = around.window(wide, modest_stride(wide));
      const double peak = robust_peak(window, limits.lit);
      if (!(peak > 3 * limits.lit)) return;
      const std::vector<LineBox> bodies = find_bodies(window, 0.35 * peak);
      for (const LineBox& body : bodies) {
        if (body.lines() < 6 || body.length() < 4) continue;
        const BodyPlace place{body, territory(wide, body, bodies)};
        const Blink coarse = coarse_blink(window, peak, place, limits);
        if (const auto lamp = measure_striped_lamp(around, place, coarse, limits)) add(*lamp, body);
      }
      const auto done = [&](std::size_t i) {
        return std::any_of(bodies.begin(), bodies.end(),
                           [&](const LineBox& body) { return body.meets(boxes_[i]); });
      };
      const std::size_t before = members.size();
      members.erase(std::remove_if(members.begin(), members.end(), done), members.end());
      if (members.size() == before) return;
    }
  }

  /// The part of a window that belongs to a body: what its glow may reach, up to half the way to
  /// other bodies.
  static LineBox territory(const LineBox& all, const LineBox& body,
                           const std::vector<LineBox>& bodies) {
    const int size = 3 * std::max(body.lines(), body.length()) / 2;
    LineBox box =
        body.grown(8 + std::min(size, 4 * body.lines()), 8 + std::min(size, 4 * body.length()))
            .cut_to(all);
    for (const LineBox& other : bodies) {
      if (other.line0 > body.line1)
        box.line1 = std::min(box.line1, (body.line1 + other.line0) / 2);
      else if (other.line1 < body.line0)
        box.line0 = std::max(box.line0, (body.line0 + other.line1 + 1) / 2);
      else if (other.pos0 > body.pos1)
        box.pos1 = std::min(box.pos1, (body.pos1 + other.pos0) / 2);
      else if (other.pos1 < body.pos0)
        box.pos0 = std::max(box.pos0, (body.pos0 + other.pos1 + 1) / 2);
    }
    return box;
  }

  void add(const StripedLamp& lamp, const LineBox& body) {
    found_.blobs.push_back(striped_blob(image_, options_, columns_, lamp, take_parts(lamp, body)));
    found_.shapes.push_back(lamp.shape);
    found_.evidence += lamp.evidence;
  }

  /// Takes the components of a lamp and of the halo around it; the sum of the lamp's own.
  Component take_parts(const StripedLamp& lamp, const LineBox& body) {
    const double f = lamp.blink.cycles_per_line;
    const int period = f > 0 ? static_cast<int>(std::ceil(1 / f)) : body.lines() / 2;
    const LineBox around = body.grown(period, body.length() / 4);
    Component sum;
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      if (found_.taken[i]) continue;
      const LineBox& box = boxes_[i];
      const LineBox common = box.cut_to(body);
      const double shared = common.meets(body) ? common.area() : 0;
      const bool part = 2 * shared >= std::min(box.area(), body.area());
      if (part) sum += components_[i];
      const Eigen::Vector2d middle(0.5 * (box.line0 + box.line1), 0.5 * (box.pos0 + box.pos1));
      const bool near = around.holds(middle[0], middle[1]) ||
                        (lamp.shape.shape * (middle - lamp.shape.centre)).norm() < 1.3;
      found_.taken[i] = part || near;
    }
    return sum;
  }

  const LinearImage& image_;
  const DetectOptions& options_;
  bool columns_;
  const std::vector<Component>& components_;
  std::vector<LineBox> boxes_;
  Found found_;
};

/// Walls and ceilings near a lamp blink with it: a blob with the frequency of one ten times as
/// bright is its reflection.
void drop_reflections(std::vector<Blob>& blobs) {
  const std::vector<Blob> all = blobs;
  const auto reflects = [&](const Blob& blob) {
    return std::any_of(all.begin(), all.end(), [&](const Blob& lamp) {
      if (!blob.frequency_hz || !lamp.frequency_hz || lamp.flux_dn < 10 * blob.flux_dn)
        return false;
      const double sigma = std::hypot(blob.frequency_sigma_hz, lamp.frequency_sigma_hz);
      return std::abs(*blob.frequency_hz - *lamp.frequency_hz) <
             3 * sigma + 0.01 * *lamp.frequency_hz;
    });
  };
  blobs.erase(std::remove_if(blobs.begin(), blobs.end(), reflects), blobs.end());
}

}  // namespace

bool reads_stripes(const DetectOptions& options) {
  return options.sensor && options.sensor->row_time_s > 0 && options.stripes.value_or(true);
}

std::vector<Blob> take_striped_lamps(const LinearImage& image, const DetectOptions& options,
                                     std::vector<Component>& components) {
  const auto read = [&](bool columns, std::size_t max_groups) {
    return Reader(image, options, columns, components).read(max_groups);
  };
  bool columns = options.sensor->readout == Readout::columns;
  if (options.sensor->readout == Readout::unknown) {
    constexpr std::size_t voters = 16;
    columns = read(true, voters).evidence > read(false, voters).evidence;
  }
  Found found = read(columns, components.size());
  drop_reflections(found.blobs);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < components.size(); ++i)
    if (!found.taken[i]) components[kept++] = components[i];
  components.resize(kept);
  return std::move(found.blobs);
}

}  // namespace occ::internal::detect
