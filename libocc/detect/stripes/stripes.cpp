// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/measure.hpp"
#include "libocc/detect/internal/stripe_window.hpp"
#include "libocc/detect/internal/striped_lamp.hpp"

namespace occ::internal::detect {
namespace {

/// Converts (line, pos) to (x, y).
Eigen::Vector2d to_xy(const Eigen::Vector2d& v, bool columns) {
  return columns ? v : Eigen::Vector2d(v[1], v[0]);
}
Eigen::Matrix2d to_xy(const Eigen::Matrix2d& m, bool columns) {
  Eigen::Matrix2d swapped;
  swapped << m(1, 1), m(1, 0), m(0, 1), m(0, 0);
  return columns ? m : swapped;
}

/// Sets ellipse, bounding box and cut_by_border. `spread`: matrix with the squared semi-axes as
/// eigenvalues.
void set_outline(const LinearImage& image, const Eigen::Matrix2d& spread, Blob& blob) {
  blob.ellipse = FittedConic{blob.centroid_px, spread.inverse()}.ellipse();
  const Eigen::Vector2d half = spread.diagonal().cwiseSqrt();
  const Eigen::Vector2d low = blob.centroid_px - half, high = blob.centroid_px + half;
  const int right = image.width() - 1, bottom = image.height() - 1;
  blob.cut_by_border = low.minCoeff() < 0 || high.x() > right || high.y() > bottom;
  blob.x0 = std::clamp(static_cast<int>(std::floor(low.x())), 0, right);
  blob.y0 = std::clamp(static_cast<int>(std::floor(low.y())), 0, bottom);
  blob.x1 = std::clamp(static_cast<int>(std::ceil(high.x())), 0, right);
  blob.y1 = std::clamp(static_cast<int>(std::ceil(high.y())), 0, bottom);
}

/// Converts a measured lamp to a blob. `columns`: its lines are image columns. `sum`: sum of the
/// lamp's components.
Blob striped_blob(const LinearImage& image, const DetectOptions& options, bool columns,
                  const StripedLamp& lamp, const Component& sum) {
  Blob blob;
  blob.striped = true;
  blob.centroid_px = to_xy(lamp.shape.centre, columns);
  blob.covariance_px2 = to_xy(lamp.shape.covariance, columns);
  if (lamp.blink.cycles_per_line > 0) {
    blob.frequency_hz = lamp.blink.cycles_per_line / options.sensor->row_time_s;
    blob.frequency_sigma_hz = lamp.blink.sigma / options.sensor->row_time_s;
  }
  blob.peak_dn = sum.peak_dn;
  blob.background_dn = sum.background_dn;
  blob.noise_dn = sum.noise_dn;
  blob.saturated = sum.saturated_px > 0;
  blob.flux_dn = lamp.signal;
  blob.area_px = static_cast<int>(std::lround(lamp.lit_px));
  blob.flux_sigma_dn = image.slope(sum.background_dn) * sum.noise_dn * std::sqrt(lamp.lit_px);
  const Eigen::Matrix2d metric = lamp.shape.shape.transpose() * lamp.shape.shape;
  set_outline(image, to_xy(Eigen::Matrix2d(metric.inverse()), columns), blob);
  if (!options.rims || lamp.shape.rim.empty()) return blob;
  for (const StripeRimPoint& p : lamp.shape.rim)
    blob.rim.push_back({to_xy(p.at, columns), to_xy(p.normal, columns), lamp.shape.rim_sigma_px});
  const double shift = lamp.shape.rim_shift_variance_px2;
  blob.rim_covariance_px2.diagonal().head<3>() << lamp.shape.rim_growth_variance_px2, shift, shift;
  return blob;
}

constexpr std::size_t max_candidates = 4096;  // brightest components examined; bounds the time
constexpr int max_rounds = 8;  // per cluster; each round removes the lamps that it finds

using Members = std::vector<std::size_t>;  ///< indices of components

struct StripedLamps {
  std::vector<Blob> blobs;
  std::vector<StripedShape> shapes;  ///< one per blob
  std::vector<bool> used;  ///< one per component: true if it belongs to a lamp or its halo
  double evidence = 0;     ///< sum over the lamps
};

/// Searches an image whose lines are known to be rows or columns.
class StripeSearch {
 public:
  StripeSearch(const LinearImage& image, const DetectOptions& options, bool columns,
               const std::vector<Component>& components)
      : image_(image), options_(options), columns_(columns), components_(components) {
    boxes_.reserve(components.size());
    for (const Component& c : components) boxes_.push_back(line_box(c, columns));
    found_.used.assign(components.size(), false);
  }

  /// Searches the brightest clusters of components, at most `max_clusters`.
  StripedLamps run(std::size_t max_clusters) {
    std::vector<Members> clusters = this->clusters(candidates());
    const auto flux = [&](const Members& members) {
      double sum = 0;
      for (const std::size_t i : members) sum += components_[i].grey.sum;
      return sum;
    };
    std::stable_sort(clusters.begin(), clusters.end(),
                     [&](const Members& a, const Members& b) { return flux(a) > flux(b); });
    if (clusters.size() > max_clusters) clusters.resize(max_clusters);
    for (Members& cluster : clusters) search_cluster(std::move(cluster));
    return std::move(found_);
  }

 private:
  /// The brightest components of at least four pixels' width, sorted by line.
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

  /// True if two components may be stripes of one lamp: similar length and brightness, one after
  /// the other at a suitable distance.
  bool may_be_one_lamp(std::size_t i, std::size_t j) const {
    const LineBox &a = boxes_[i], &b = boxes_[j];
    const int longer = std::max(a.length(), b.length()), shorter = std::min(a.length(), b.length());
    const double high_i = components_[i].peak_dn - components_[i].background_dn;
    const double high_j = components_[j].peak_dn - components_[j].background_dn;
    return longer <= 8 * shorter && std::min(high_i, high_j) > 0.2 * std::max(high_i, high_j) &&
           stacked(a, b);
  }

  /// Connected sets of components that may belong to one lamp (union-find).
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
        if (may_be_one_lamp(chosen[i], chosen[j])) parent[root(j)] = root(i);
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

  /// Detection and clipping level around some components, as linear signal; also their background.
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

  /// Finds the lamps of a cluster, the brightest first. After each round the remaining components
  /// are searched again.
  void search_cluster(Members members) {
    const auto used = [&](std::size_t i) { return found_.used[i]; };
    for (int round = 0; round < max_rounds; ++round) {
      members.erase(std::remove_if(members.begin(), members.end(), used), members.end());
      if (members.empty()) return;
      const LineBox box = box_of(members);
      if (box.lines() < 8 || box.length() < 4) return;
      double background_dn = 0;
      const LampLimits limits = this->limits(members, background_dn);
      const LineBox wide = box.grown(8 + box.lines() / 4, 8).cut_to(line_box(image_, columns_));
      const LampContext context{image_, columns_, background_dn, found_.shapes};
      const LineWindow window = context.window(wide, limited_stride(wide));
      const double peak = robust_peak(window, limits.lit);
      if (!(peak > 3 * limits.lit)) return;
      const std::vector<LineBox> cores = find_lamp_regions(window, 0.35 * peak);
      for (const LineBox& core : cores) {
        if (core.lines() < 6 || core.length() < 4) continue;
        const LampRegion region{core, extent(wide, core, cores)};
        const Blink coarse = coarse_blink(window, peak, region, limits);
        if (const auto lamp = measure_striped_lamp(context, region, coarse, limits))
          add(*lamp, core);
      }
      const auto done = [&](std::size_t i) {
        return std::any_of(cores.begin(), cores.end(),
                           [&](const LineBox& core) { return core.meets(boxes_[i]); });
      };
      const std::size_t before = members.size();
      members.erase(std::remove_if(members.begin(), members.end(), done), members.end());
      if (members.size() == before) return;
    }
  }

  /// The part of a window around a core that its light may reach, up to half the way to other
  /// cores.
  static LineBox extent(const LineBox& all, const LineBox& core,
                        const std::vector<LineBox>& cores) {
    const int size = 3 * std::max(core.lines(), core.length()) / 2;
    LineBox box =
        core.grown(8 + std::min(size, 4 * core.lines()), 8 + std::min(size, 4 * core.length()))
            .cut_to(all);
    for (const LineBox& other : cores) {
      if (other.line0 > core.line1)
        box.line1 = std::min(box.line1, (core.line1 + other.line0) / 2);
      else if (other.line1 < core.line0)
        box.line0 = std::max(box.line0, (core.line0 + other.line1 + 1) / 2);
      else if (other.pos0 > core.pos1)
        box.pos1 = std::min(box.pos1, (core.pos1 + other.pos0) / 2);
      else if (other.pos1 < core.pos0)
        box.pos0 = std::max(box.pos0, (core.pos0 + other.pos1 + 1) / 2);
    }
    return box;
  }

  void add(const StripedLamp& lamp, const LineBox& core) {
    found_.blobs.push_back(
        striped_blob(image_, options_, columns_, lamp, claim_components(lamp, core)));
    found_.shapes.push_back(lamp.shape);
    found_.evidence += lamp.evidence;
  }

  /// Marks the components of a lamp and of the halo around it as used; returns the sum of those of
  /// the lamp itself.
  Component claim_components(const StripedLamp& lamp, const LineBox& core) {
    const double f = lamp.blink.cycles_per_line;
    const int period = f > 0 ? static_cast<int>(std::ceil(1 / f)) : core.lines() / 2;
    const LineBox around = core.grown(period, core.length() / 4);
    Component sum;
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      if (found_.used[i]) continue;
      const LineBox& box = boxes_[i];
      const LineBox common = box.cut_to(core);
      const double shared = common.meets(core) ? common.area() : 0;
      const bool part = 2 * shared >= std::min(box.area(), core.area());
      if (part) sum += components_[i];
      const Eigen::Vector2d middle(0.5 * (box.line0 + box.line1), 0.5 * (box.pos0 + box.pos1));
      const bool near = around.holds(middle[0], middle[1]) ||
                        (lamp.shape.shape * (middle - lamp.shape.centre)).norm() < 1.3;
      found_.used[i] = part || near;
    }
    return sum;
  }

  const LinearImage& image_;
  const DetectOptions& options_;
  bool columns_;
  const std::vector<Component>& components_;
  std::vector<LineBox> boxes_;
  StripedLamps found_;
};

/// Removes reflections. Walls and ceilings near a lamp blink with it: a blob with the frequency of
/// another blob that is ten times as bright is its reflection.
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

bool stripes_enabled(const DetectOptions& options) {
  return options.sensor && options.sensor->row_time_s > 0 && options.stripes.value_or(true);
}

std::vector<Blob> take_striped_lamps(const LinearImage& image, const DetectOptions& options,
                                     std::vector<Component>& components) {
  const auto search = [&](bool columns, std::size_t max_clusters) {
    return StripeSearch(image, options, columns, components).run(max_clusters);
  };
  bool columns = options.sensor->readout == Readout::columns;
  if (options.sensor->readout == Readout::unknown) {
    constexpr std::size_t compared_clusters = 16;  // enough to compare both readout directions
    columns = search(true, compared_clusters).evidence > search(false, compared_clusters).evidence;
  }
  StripedLamps found = search(columns, components.size());
  drop_reflections(found.blobs);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < components.size(); ++i)
    if (!found.used[i]) components[kept++] = components[i];
  components.resize(kept);
  return std::move(found.blobs);
}

}  // namespace occ::internal::detect
