// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/photometry/internal/response_fit.hpp"

namespace occ::internal::photometry {
namespace {

constexpr int side = 5;  // of a patch [px]
constexpr int pixels = side * side;
constexpr int max_candidates = 20000;
constexpr double max_texture = 2;  // limit of a flat patch's variance over the noise variance
constexpr double clip_sigma = 4;   // margin to black and white of a pixel that is not clipped
constexpr int noise_groups = 24;
constexpr double four_pi_squared = 4 * pi * pi;

/// Statistics of the pixels of a patch.
struct PatchStatistics {
  double mean = 0;
  double variance = 0;  ///< about the mean
  double noise = 0;     ///< variance about a plane
  double lowest = 0, highest = 0;
};

struct Candidate {
  int x = 0, y = 0;                         // first pixel
  std::vector<PatchStatistics> statistics;  // one per image
  double light = 0;  // sum of the means, increases with the light even if clipped
};

/// Quantile of the estimated over the true noise variance of a flat patch: chi2 / 22 (Wilson,
/// Hilferty 1931).
struct Quantile {
  double fraction, expected;
};
constexpr Quantile low_decile{0.1, 0.638};  // rarely affected by patches with texture
constexpr Quantile median{0.5, 0.970};      // for flat patches

/// Noise variance of a pixel as a function of its level, from groups of patches of similar level.
class NoiseCurve {
 public:
  NoiseCurve(std::vector<std::pair<double, double>> level_and_noise, const Quantile& quantile)
      : quantile_(quantile) {
    std::sort(level_and_noise.begin(), level_and_noise.end());
    const auto size = static_cast<std::ptrdiff_t>(level_and_noise.size());
    const std::ptrdiff_t groups = std::min<std::ptrdiff_t>(noise_groups, size / 16 + 1);
    const auto first = level_and_noise.begin();
    for (std::ptrdiff_t g = 0; g < groups && size > 0; ++g)
      add_group({first + g * size / groups, first + (g + 1) * size / groups});
  }

  double at_level(double level) const {
    if (level_.empty()) return 0;
    const auto above = std::upper_bound(level_.begin(), level_.end(), level);
    if (above == level_.begin()) return noise_.front();
    if (above == level_.end()) return noise_.back();
    const auto i = static_cast<std::size_t>(above - level_.begin());
    const double fraction = (level - level_[i - 1]) / (level_[i] - level_[i - 1]);
    return noise_[i - 1] + fraction * (noise_[i] - noise_[i - 1]);
  }

 private:
  void add_group(std::vector<std::pair<double, double>> group) {
    double level = 0;
    for (const auto& [mean, noise] : group) level += mean / static_cast<double>(group.size());
    const auto middle = group.begin() + static_cast<std::ptrdiff_t>(
                                            quantile_.fraction * static_cast<double>(group.size()));
    std::nth_element(group.begin(), middle, group.end(),
                     [](const auto& a, const auto& b) { return a.second < b.second; });
    if (!level_.empty() && !(level > level_.back())) return;
    level_.push_back(level);
    noise_.push_back(middle->second / quantile_.expected);
  }

  Quantile quantile_;
  std::vector<double> level_, noise_;
};

template <typename T>
PatchStatistics statistics_of(const ImageView& image, int channel, int x0, int y0) {
  double sum = 0, squares = 0, along_x = 0, along_y = 0;
  PatchStatistics s;
  s.lowest = 65536;
  for (int y = 0; y < side; ++y) {
    const auto* bytes = static_cast<const unsigned char*>(image.data) +
                        static_cast<std::size_t>(y0 + y) * image.row_bytes;
    const T* row = reinterpret_cast<const T*>(bytes) +
                   static_cast<std::ptrdiff_t>(x0) * image.channels + channel;
    for (int x = 0; x < side; ++x) {
      const double value = row[x * image.channels];
      sum += value;
      squares += value * value;
      along_x += value * (x - side / 2);
      along_y += value * (y - side / 2);
      s.lowest = std::min(s.lowest, value);
      s.highest = std::max(s.highest, value);
    }
  }
  constexpr double second_moment = 2.0 * pixels;  // sum over the patch of (x - side / 2)^2
  s.mean = sum / pixels;
  const double total = std::max(0.0, squares - sum * s.mean);
  const double plane = (along_x * along_x + along_y * along_y) / second_moment;
  s.variance = total / (pixels - 1);
  s.noise = std::max(0.0, total - plane) / (pixels - 3);
  return s;
}

std::vector<Candidate> candidates_in(const std::vector<ImageView>& images, int channel) {
  const ImageView& first = images.front();
  const double area = static_cast<double>(first.width) * first.height;
  const int step = std::max(side, static_cast<int>(std::ceil(std::sqrt(area / max_candidates))));
  std::vector<Candidate> found;
  for (int y = 0; y + side <= first.height; y += step)
    for (int x = 0; x + side <= first.width; x += step) {
      Candidate candidate{x, y, {}, 0};
      for (const ImageView& image : images) {
        candidate.statistics.push_back(image.type == PixelType::u8
                                           ? statistics_of<std::uint8_t>(image, channel, x, y)
                                           : statistics_of<std::uint16_t>(image, channel, x, y));
        candidate.light += candidate.statistics.back().mean;
      }
      found.push_back(std::move(candidate));
    }
  return found;
}

/// Level at which pixels are clipped: full scale, or the level of the full well if below.
double white_of(const std::vector<Candidate>& candidates, const LevelRange& range) {
  double highest = 0;
  for (const Candidate& candidate : candidates)
    for (const PatchStatistics& s : candidate.statistics) highest = std::max(highest, s.mean);
  return std::min(highest, range.full_scale_dn);
}

/// Variance of the rounding error of a constant signal. Noise dithers the error: its amplitude is
/// multiplied by exp(-2 pi^2 sigma^2).
double rounding_dn2(double noise_dn2) { return std::exp(-four_pi_squared * noise_dn2) / 12; }

bool clipped(const PatchStatistics& s, double pixel_dn2, const LevelRange& range) {
  const double margin_dn = 1 + clip_sigma * std::sqrt(pixel_dn2);
  return s.lowest <= range.black_dn || s.mean - margin_dn <= range.black_dn ||
         s.highest >= range.full_scale_dn || s.mean + margin_dn >= range.full_scale_dn;
}

bool flat(const PatchStatistics& s, double pixel_dn2) {
  return s.variance <= max_texture * std::max(pixel_dn2, 1.0 / 12);
}

/// Noise curve from the flat patches; a first curve from all patches decides which are flat.
NoiseCurve noise_of(const std::vector<Candidate>& candidates, const LevelRange& range) {
  std::vector<std::pair<double, double>> all, flat_ones;
  for (const Candidate& candidate : candidates)
    for (const PatchStatistics& s : candidate.statistics)
      if (!clipped(s, 0, range)) all.emplace_back(s.mean, s.noise);
  const NoiseCurve first(std::move(all), low_decile);
  for (const Candidate& candidate : candidates)
    for (const PatchStatistics& s : candidate.statistics)
      if (const double noise = first.at_level(s.mean); !clipped(s, noise, range) && flat(s, noise))
        flat_ones.emplace_back(s.mean, s.noise);
  return NoiseCurve(std::move(flat_ones), median);
}

/// Patch with the levels of the images that do not clip it; nothing if one of them has texture.
std::optional<FlatPatch> patch_of(const Candidate& candidate, const NoiseCurve& noise,
                                  const LevelRange& range) {
  FlatPatch patch;
  patch.x = candidate.x + side / 2;
  patch.y = candidate.y + side / 2;
  for (std::size_t j = 0; j < candidate.statistics.size(); ++j) {
    const PatchStatistics& s = candidate.statistics[j];
    const double pixel_dn2 = noise.at_level(s.mean);
    if (clipped(s, pixel_dn2, range)) continue;
    if (!flat(s, pixel_dn2)) return std::nullopt;
    const double unrounded_dn2 = std::max(0.0, pixel_dn2 - 1.0 / 12);
    patch.levels.push_back({static_cast<int>(j), s.mean,
                            pixel_dn2 / pixels + rounding_dn2(unrounded_dn2), unrounded_dn2});
  }
  if (patch.levels.size() < 2) return std::nullopt;
  return patch;
}

/// Selects patches evenly from 64 classes of brightness and, within a class, from 16 image tiles.
std::vector<FlatPatch> select_evenly(std::vector<std::pair<double, FlatPatch>>&& patches,
                                     const ImageView& image, int count) {
  constexpr std::size_t steps = 64, tiles = 4;
  const auto by_light = [](const auto& a, const auto& b) { return a.first < b.first; };
  const auto [darkest, brightest] = std::minmax_element(patches.begin(), patches.end(), by_light);
  const double low = darkest->first, width = std::max(brightest->first - low, 1e-9);
  std::vector<std::array<std::vector<std::size_t>, tiles * tiles>> bins(steps);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const FlatPatch& p = patches[i].second;
    const auto step = static_cast<std::size_t>(steps * (patches[i].first - low) / width);
    const auto column = static_cast<std::size_t>(tiles * p.x / image.width);
    const auto row = static_cast<std::size_t>(tiles * p.y / image.height);
    bins[std::min(step, steps - 1)][tiles * row + column].push_back(i);
  }
  std::vector<FlatPatch> chosen;
  for (std::size_t round = 0;; ++round) {  // one patch of each tile of each class
    bool any = false;
    for (const auto& bin : bins)
      for (const auto& tile : bin) {
        if (round >= tile.size()) continue;
        if (static_cast<int>(chosen.size()) == count) return chosen;
        chosen.push_back(std::move(patches[tile[round]].second));
        any = true;
      }
    if (!any) return chosen;
  }
}

}  // namespace

std::vector<FlatPatch> flat_patches(const std::vector<ImageView>& images, int channel,
                                    const LevelRange& range, int count) {
  const std::vector<Candidate> candidates = candidates_in(images, channel);
  const LevelRange unclipped{range.black_dn, white_of(candidates, range)};
  const NoiseCurve noise = noise_of(candidates, unclipped);
  std::vector<std::pair<double, FlatPatch>> patches;
  for (const Candidate& candidate : candidates)
    if (auto patch = patch_of(candidate, noise, unclipped))
      patches.emplace_back(candidate.light, std::move(*patch));
  if (patches.empty()) return {};
  return select_evenly(std::move(patches), images.front(), count);
}

}  // namespace occ::internal::photometry
