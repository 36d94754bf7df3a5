// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/bright_bodies.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

constexpr double dark_share = 0.1;        // of the meshes: at least so many see no body
constexpr float bright_sigmas = 8;        // of the dark meshes' noise
constexpr float body_share = 0.5f;        // of the brightest mesh's light
constexpr float whole_noise = 0.1f;       // over the light, of a mesh that is all body
constexpr float shining_share = 0.1f;     // of the body's light, on top of it
constexpr float shining_sigmas = 6;       // of its noise, too
constexpr int shining_step_px = 2;        // pixels are looked at so far apart
constexpr int shining_samples = 12;       // fewer are hot pixels
constexpr float sharp_share = 0.4f;       // of the body's light, lost across its edge
constexpr float brighter_share = 1.5f;    // more is lost behind something that is brighter
constexpr float sharp_sigmas = 3;         // of the pixels' noise there, too
constexpr int edge_px = 16, side_px = 8;  // width of an edge at most; pixels averaged beside it

constexpr float change_sigmas = 0.886f;  // standard deviation over the mean change, of normal noise

using Mask = std::vector<char>;

constexpr std::array<std::pair<int, int>, 4> directions = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// The value that a share of all is below; reorders them.
float ranked(std::vector<float>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

class Bodies {
 public:
  Bodies(const ImageView& image, double min_noise_dn, Meshes& meshes)
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
      const std::vector<std::size_t> body = flood(seed);
      if (!has_sharp_outline(body) || has_light_of_its_own(body)) continue;
      for (const std::size_t i : body) covered_[i] = 1;
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

  /// Of the bright meshes not visited yet; count() when there is none.
  std::size_t brightest() const {
    std::size_t best = meshes_.count();
    for (std::size_t i = 0; i < meshes_.count(); ++i) {
      if (visited_[i] || !(meshes_.level[i] > bright_)) continue;
      if (best == meshes_.count() || meshes_.level[i] > meshes_.level[best]) best = i;
    }
    return best;
  }

  std::vector<std::size_t> flood(std::size_t seed) {
    const float least = body_share * light(seed);
    std::vector<std::size_t> body = {seed};
    visited_[seed] = 1;
    for (std::size_t k = 0; k < body.size(); ++k) {
      for (const auto& [dx, dy] : directions) {
        const int x = column(body[k]) + dx, y = row(body[k]) + dy;
        if (!has(x, y) || visited_[at(x, y)] || !(light(at(x, y)) > least)) continue;
        visited_[at(x, y)] = 1;
        body.push_back(at(x, y));
      }
    }
    return body;
  }

  /// Whether most ways out of the body lead across an edge.
  bool has_sharp_outline(const std::vector<std::size_t>& body) const {
    Mask inside(meshes_.count());
    for (const std::size_t i : body) inside[i] = 1;
    int ways = 0, sharp = 0;
    for (const std::size_t i : body) {
      for (const auto& [dx, dy] : directions) {
        if (!has(column(i) + dx, row(i) + dy) || inside[at(column(i) + dx, row(i) + dy)]) continue;
        ++ways;
        const float fall = steepest_fall(i, dx, dy) / light(i);
        sharp += fall > sharp_share && fall < brighter_share;
      }
    }
    return 2 * sharp > ways;
  }

  /// Largest loss of light across the width of an edge, from a mesh's middle outwards; 0 when noise
  /// may make it.
  float steepest_fall(std::size_t mesh, int dx, int dy) const {
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
    float most = 0;
    for (int k = 0; k + 2 * side_px + edge_px <= length; ++k)
      most = std::max(most, mean(k) - mean(k + side_px + edge_px));
    const float noise = change_sigmas * changes / static_cast<float>(length);
    return most > sharp_sigmas * noise ? most : 0;
  }

  int middle(int mesh, int pixels) const {
    return std::min(mesh * meshes_.size_px + meshes_.size_px / 2, pixels - 1);
  }

  /// Lamps in front of a bright wall, which is no body then.
  bool has_light_of_its_own(const std::vector<std::size_t>& body) const {
    std::vector<std::size_t> whole;
    std::vector<float> noises;
    for (const std::size_t i : body) {
      if (meshes_.noise[i] > std::max(whole_noise * light(i), min_noise_)) continue;
      whole.push_back(i);
      noises.push_back(meshes_.noise[i]);
    }
    const float noise = whole.empty() ? 0 : std::max(min_noise_, ranked(noises, 0.5));
    int samples = 0;
    for (const std::size_t i : whole) {
      const float limit = meshes_.level[i] + shining_share * light(i) + shining_sigmas * noise;
      samples += samples_above(limit, i);
      if (samples >= shining_samples) return true;
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
      for (int y = y0; y < y1; y += shining_step_px) {
        const auto* line = pixels.row(y);
        for (int x = x0; x < x1; x += shining_step_px)
          samples +=
              static_cast<float>(P::level(line, x)) > limit_dn * static_cast<float>(P::scale);
      }
    });
    return samples;
  }

  /// With the meshes beside them, which the bodies may reach into.
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

  /// From outside inwards, each from the mean of those beside it.
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
  float dark_ = 0, bright_ = 0;  // grey level of the background; of what may be a body
  bool found_ = false;
};

}  // namespace

void fill_bright_bodies(const ImageView& image, double min_noise_dn, Meshes& meshes) {
  Bodies(image, min_noise_dn, meshes).fill();
}

}  // namespace occ::internal::detect
