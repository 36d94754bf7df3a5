// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

// The thresholds below separate lamps close to the camera from lit walls and from halos.
constexpr double dark_share = 0.1;    // at least this part of the meshes is background
constexpr float bright_sigmas = 8;    // a region exceeds the dark level by so many noise sigmas
constexpr float region_share = 0.5f;  // min light of a region's meshes, of its brightest mesh
constexpr float whole_noise = 0.1f;   // max noise over light of a mesh entirely inside a region
constexpr float spot_share = 0.1f;    // brighter spots exceed the region by this part of its light
constexpr float spot_sigmas = 6;      // and by so many sigmas of its noise
constexpr int spot_step_px = 2;       // distance between the pixels tested
constexpr int min_spot_samples = 12;  // fewer are hot pixels
constexpr float sharp_share = 0.4f;   // min drop across a sharp edge, part of the region's light
constexpr float brighter_share = 1.5f;  // a larger drop is the edge of a brighter object
constexpr float sharp_sigmas = 3;       // the drop also exceeds so many sigmas of the pixels' noise
constexpr int edge_px = 16, side_px = 8;  // max width of an edge; pixels averaged on each side

// Standard deviation over mean absolute difference of neighbours for normal noise, sqrt(pi) / 2.
constexpr float change_sigmas = 0.886f;

using Mask = std::vector<char>;

constexpr std::array<std::pair<int, int>, 4> directions = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// Quantile of the values; reorders them.
float ranked(std::vector<float>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class BrightRegions {
 public:
  BrightRegions(const ImageView& image, double min_noise_dn, Meshes& meshes)
      : image_(image),
        meshes_(meshes),
        min_noise_(static_cast<float>(min_noise_dn)),
        covered_(meshes.count()),
        visited_(meshes.count()) {
    std::vector<float> levels = meshes.level;
    dark_ = ranked(levels, dark_share);
    std::vector<float> noises;
    for (std::size_t i = 0; i < meshes.count(); ++i)
      if (meshes.level[i] <= dark_) noises.push_back(meshes.noise[i]);
    bright_ = dark_ + bright_sigmas * std::max(min_noise_, ranked(noises, 0.5));
  }

  void fill() {
    for (std::size_t seed = brightest(); seed < meshes_.count(); seed = brightest()) {
      const std::vector<std::size_t> region = flood(seed);
      if (!has_sharp_outline(region) || has_brighter_spots(region)) continue;
      for (const std::size_t i : region) covered_[i] = 1;
      found_ = true;
    }
    if (!found_) return;
    const Mask wider = widened();
    fill_in(std::find(wider.begin(), wider.end(), 0) != wider.end() ? wider : covered_);
  }

 private:
  int column(std::size_t i) const { return static_cast<int>(i) % meshes_.columns; }
  int row(std::size_t i) const { return static_cast<int>(i) / meshes_.columns; }
  bool has(int column, int row) const {
    return column >= 0 && row >= 0 && column < meshes_.columns && row < meshes_.rows;
  }
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row * meshes_.columns + column);
  }
  float light(std::size_t i) const { return meshes_.level[i] - dark_; }

  /// Brightest mesh not visited yet that exceeds the threshold; count() when there is none.
  std::size_t brightest() const {
    std::size_t best = meshes_.count();
    for (std::size_t i = 0; i < meshes_.count(); ++i) {
      if (visited_[i] || !(meshes_.level[i] > bright_)) continue;
      if (best == meshes_.count() || meshes_.level[i] > meshes_.level[best]) best = i;
    }
    return best;
  }

  /// Connected meshes (4 neighbours) with at least region_share of the seed's light.
  std::vector<std::size_t> flood(std::size_t seed) {
    const float min_light = region_share * light(seed);
    std::vector<std::size_t> region = {seed};
    visited_[seed] = 1;
    for (std::size_t k = 0; k < region.size(); ++k) {
      for (const auto& [dx, dy] : directions) {
        const int x = column(region[k]) + dx, y = row(region[k]) + dy;
        if (!has(x, y) || visited_[at(x, y)] || !(light(at(x, y)) > min_light)) continue;
        visited_[at(x, y)] = 1;
        region.push_back(at(x, y));
      }
    }
    return region;
  }

  /// True if the light drops sharply on most of the mesh borders around the region.
  bool has_sharp_outline(const std::vector<std::size_t>& region) const {
    Mask inside(meshes_.count());
    for (const std::size_t i : region) inside[i] = 1;
    int borders = 0, sharp = 0;
    for (const std::size_t i : region) {
      for (const auto& [dx, dy] : directions) {
        if (!has(column(i) + dx, row(i) + dy) || inside[at(column(i) + dx, row(i) + dy)]) continue;
        ++borders;
        const float drop = steepest_drop(i, dx, dy) / light(i);
        sharp += drop > sharp_share && drop < brighter_share;
      }
    }
    return 2 * sharp > borders;
  }

  /// Largest drop of light across the width of an edge, from the middle of a mesh in one direction;
  /// 0 when noise can explain it.
  float steepest_drop(std::size_t mesh, int dx, int dy) const {
    const int x0 = middle(column(mesh), image_.width), y0 = middle(row(mesh), image_.height);
    const int room = dx > 0   ? image_.width - 1 - x0
                     : dx < 0 ? x0
                     : dy > 0 ? image_.height - 1 - y0
                              : y0;
    const int length = std::min(room, 5 * meshes_.size_px / 2) + 1;
    std::vector<float> sums = {0};
    float before = 0, changes = 0;
    visit_pixels(image_, [&](const auto& pixels) {
      using P = std::decay_t<decltype(pixels)>;
      for (int k = 0; k < length; ++k) {
        const float level = static_cast<float>(P::level(pixels.row(y0 + k * dy), x0 + k * dx)) /
                            static_cast<float>(P::scale);
        sums.push_back(sums.back() + level);
        if (k > 0) changes += std::abs(level - before);
        before = level;
      }
    });
    const auto mean = [&](int from) {
      const auto i = static_cast<std::size_t>(from);
      return (sums[i + side_px] - sums[i]) / side_px;
    };
    float drop = 0;
    for (int k = 0; k + 2 * side_px + edge_px <= length; ++k)
      drop = std::max(drop, mean(k) - mean(k + side_px + edge_px));
    const float noise = change_sigmas * changes / static_cast<float>(length);
    return drop > sharp_sigmas * noise ? drop : 0;
  }

  int middle(int mesh, int pixels) const {
    return std::min(mesh * meshes_.size_px + meshes_.size_px / 2, pixels - 1);
  }

  /// True if pixels inside the region are brighter than the region: lamps in front of a bright
  /// wall.
  bool has_brighter_spots(const std::vector<std::size_t>& region) const {
    std::vector<std::size_t> whole;
    std::vector<float> noises;
    for (const std::size_t i : region) {
      if (meshes_.noise[i] > std::max(whole_noise * light(i), min_noise_)) continue;
      whole.push_back(i);
      noises.push_back(meshes_.noise[i]);
    }
    const float noise = whole.empty() ? 0 : std::max(min_noise_, ranked(noises, 0.5));
    int samples = 0;
    for (const std::size_t i : whole) {
      const float limit = meshes_.level[i] + spot_share * light(i) + spot_sigmas * noise;
      samples += samples_above(limit, i);
      if (samples >= min_spot_samples) return true;
    }
    return false;
  }

  int samples_above(float limit_dn, std::size_t mesh) const {
    const int x0 = column(mesh) * meshes_.size_px, y0 = row(mesh) * meshes_.size_px;
    const int x1 = std::min(x0 + meshes_.size_px, image_.width);
    const int y1 = std::min(y0 + meshes_.size_px, image_.height);
    int samples = 0;
    visit_pixels(image_, [&](const auto& pixels) {
      using P = std::decay_t<decltype(pixels)>;
      for (int y = y0; y < y1; y += spot_step_px) {
        const auto* line = pixels.row(y);
        for (int x = x0; x < x1; x += spot_step_px)
          samples +=
              static_cast<float>(P::level(line, x)) > limit_dn * static_cast<float>(P::scale);
      }
    });
    return samples;
  }

  /// The covered meshes and their neighbours, which the regions may extend into.
  Mask widened() const {
    Mask wider = covered_;
    for (std::size_t i = 0; i < meshes_.count(); ++i) {
      if (!covered_[i]) continue;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (has(column(i) + dx, row(i) + dy)) wider[at(column(i) + dx, row(i) + dy)] = 1;
    }
    return wider;
  }

  /// Replaces the unknown meshes from outside inwards by the mean of their known neighbours.
  void fill_in(Mask unknown) {
    for (bool filled = true; filled;) {
      filled = false;
      const Mask before = unknown;
      for (std::size_t i = 0; i < meshes_.count(); ++i) {
        if (!before[i]) continue;
        float level = 0, noise = 0, count = 0;
        for (const auto& [dx, dy] : directions) {
          if (!has(column(i) + dx, row(i) + dy)) continue;
          const std::size_t j = at(column(i) + dx, row(i) + dy);
          if (before[j]) continue;
          level += meshes_.level[j];
          noise += meshes_.noise[j];
          ++count;
        }
        if (count == 0) continue;
        meshes_.level[i] = level / count;
        meshes_.noise[i] = noise / count;
        unknown[i] = 0;
        filled = true;
      }
    }
  }

  const ImageView& image_;
  Meshes& meshes_;
  const float min_noise_;
  Mask covered_, visited_;
  float dark_ = 0, bright_ = 0;  // grey level of the background; min level of a region
  bool found_ = false;
};

}  // namespace

void fill_bright_regions(const ImageView& image, double min_noise_dn, Meshes& meshes) {
  BrightRegions(image, min_noise_dn, meshes).fill();
}

}  // namespace occ::internal::detect
