// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/internal/flat_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "libocc/core/math.hpp"

namespace occ::internal::photometry {
namespace {

constexpr int side = 5;  // of a place [px]
constexpr int pixels = side * side;
constexpr int max_candidates = 20000;
constexpr double textured = 2;    // times the noise variance: not flat
constexpr double clip_sigma = 4;  // pixels further than this from black and white are not clipped
constexpr int noise_groups = 24;
constexpr double four_pi_squared = 4 * pi * pi;

struct Spread {
  double mean = 0;
  double variance = 0;  ///< of the pixels about their mean
  double noise = 0;     ///< about a plane
  double lowest = 0, highest = 0;
};

struct Candidate {
  int x = 0, y = 0;             // first pixel
  std::vector<Spread> spreads;  // of each image
  double light = 0;             // sum of the means: rises with the light, clipped or not
};

/// A quantile of chi2 / 22, the noise that a flat place shows over what there is: by Wilson and
/// Hilferty.
struct Quantile {
  double part, of_chance;
};
constexpr Quantile low_decile{0.1, 0.638};  // which places with texture do not reach
constexpr Quantile median{0.5, 0.970};      // of flat places

/// The noise variance of a pixel by its level, from groups of places of like level.
class NoiseCurve {
 public:
  NoiseCurve(std::vector<std::pair<double, double>> level_and_noise, const Quantile& quantile)
      : quantile_(quantile) {
    auto& seen = level_and_noise;
    std::sort(seen.begin(), seen.end());
    const std::size_t groups = std::min<std::size_t>(noise_groups, seen.size() / 16 + 1);
    for (std::size_t g = 0; g < groups && !seen.empty(); ++g)
      add_group({seen.begin() + at(g * seen.size() / groups),
                 seen.begin() + at((g + 1) * seen.size() / groups)});
  }

  double at_level(double level) const {
    if (level_.empty()) return 0;
    const auto above = std::upper_bound(level_.begin(), level_.end(), level);
    if (above == level_.begin()) return noise_.front();
    if (above == level_.end()) return noise_.back();
    const auto i = static_cast<std::size_t>(above - level_.begin());
    const double part = (level - level_[i - 1]) / (level_[i] - level_[i - 1]);
    return noise_[i - 1] + part * (noise_[i] - noise_[i - 1]);
  }

 private:
  static std::ptrdiff_t at(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  void add_group(std::vector<std::pair<double, double>> group) {
    double level = 0;
    for (const auto& [mean, noise] : group) level += mean / static_cast<double>(group.size());
    const auto middle = group.begin() + static_cast<std::ptrdiff_t>(
                                            quantile_.part * static_cast<double>(group.size()));
    std::nth_element(group.begin(), middle, group.end(),
                     [](const auto& a, const auto& b) { return a.second < b.second; });
    if (!level_.empty() && !(level > level_.back())) return;
    level_.push_back(level);
    noise_.push_back(middle->second / quantile_.of_chance);
  }

  Quantile quantile_;
  std::vector<double> level_, noise_;
};

template <typename T>
Spread spread_of(const ImageView& image, int channel, int x0, int y0) {
  double sum = 0, squares = 0, along_x = 0, along_y = 0;
  Spread spread;
  spread.lowest = 65536;
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
      spread.lowest = std::min(spread.lowest, value);
      spread.highest = std::max(spread.highest, value);
    }
  }
  constexpr double second_moment = 2.0 * pixels;  // sum over the place of (x - side / 2)^2
  spread.mean = sum / pixels;
  const double total = std::max(0.0, squares - sum * spread.mean);
  const double plane = (along_x * along_x + along_y * along_y) / second_moment;
  spread.variance = total / (pixels - 1);
  spread.noise = std::max(0.0, total - plane) / (pixels - 3);
  return spread;
}

std::vector<Candidate> candidates_of(const std::vector<ImageView>& images, int channel) {
  const ImageView& first = images.front();
  const double area = static_cast<double>(first.width) * first.height;
  const int step = std::max(side, static_cast<int>(std::ceil(std::sqrt(area / max_candidates))));
  std::vector<Candidate> found;
  for (int y = 0; y + side <= first.height; y += step)
    for (int x = 0; x + side <= first.width; x += step) {
      Candidate candidate{x, y, {}, 0};
      for (const ImageView& image : images) {
        candidate.spreads.push_back(image.type == PixelType::u8
                                        ? spread_of<std::uint8_t>(image, channel, x, y)
                                        : spread_of<std::uint16_t>(image, channel, x, y));
        candidate.light += candidate.spreads.back().mean;
      }
      found.push_back(std::move(candidate));
    }
  return found;
}

/// Where pixels are clipped: full scale, or the full well's level when nothing is brighter.
double white_of(const std::vector<Candidate>& candidates, const LevelRange& range) {
  double highest = 0;
  for (const Candidate& candidate : candidates)
    for (const Spread& s : candidate.spreads) highest = std::max(highest, s.mean);
  return std::min(highest, range.full_scale_dn);
}

/// Rounding of a constant is a constant error up to half a level, which noise dithers away: what is
/// left of it is exp(-2 pi^2 sigma^2) of the amplitude.
double rounding_dn2(double noise_dn2) { return std::exp(-four_pi_squared * noise_dn2) / 12; }

bool clipped(const Spread& s, double pixel_dn2, const LevelRange& seen) {
  const double margin_dn = 1 + clip_sigma * std::sqrt(pixel_dn2);
  return s.lowest <= seen.black_dn || s.mean - margin_dn <= seen.black_dn ||
         s.highest >= seen.full_scale_dn || s.mean + margin_dn >= seen.full_scale_dn;
}

bool flat(const Spread& s, double pixel_dn2) {
  return s.variance <= textured * std::max(pixel_dn2, 1.0 / 12);
}

/// From places that are flat by a first look at the noise of all.
NoiseCurve noise_of(const std::vector<Candidate>& candidates, const LevelRange& seen) {
  std::vector<std::pair<double, double>> all, flat_ones;
  for (const Candidate& candidate : candidates)
    for (const Spread& s : candidate.spreads)
      if (!clipped(s, 0, seen)) all.emplace_back(s.mean, s.noise);
  const NoiseCurve first(std::move(all), low_decile);
  for (const Candidate& candidate : candidates)
    for (const Spread& s : candidate.spreads)
      if (const double noise = first.at_level(s.mean); !clipped(s, noise, seen) && flat(s, noise))
        flat_ones.emplace_back(s.mean, s.noise);
  return NoiseCurve(std::move(flat_ones), median);
}

/// The place as the images show it that do not clip it; none when it is not flat in one of them.
std::optional<FlatPlace> place_of(const Candidate& candidate, const NoiseCurve& noise,
                                  const LevelRange& seen) {
  FlatPlace place;
  place.x = candidate.x + side / 2;
  place.y = candidate.y + side / 2;
  for (std::size_t j = 0; j < candidate.spreads.size(); ++j) {
    const Spread& s = candidate.spreads[j];
    const double pixel_dn2 = noise.at_level(s.mean);
    if (clipped(s, pixel_dn2, seen)) continue;
    if (!flat(s, pixel_dn2)) return std::nullopt;
    const double unrounded_dn2 = std::max(0.0, pixel_dn2 - 1.0 / 12);
    place.levels.push_back({static_cast<int>(j), s.mean,
                            pixel_dn2 / pixels + rounding_dn2(unrounded_dn2), unrounded_dn2});
  }
  if (place.levels.size() < 2) return std::nullopt;
  return place;
}

/// Of each of 64 equal steps of light some, of these of each sixteenth of the image some.
std::vector<FlatPlace> spread_out(std::vector<std::pair<double, FlatPlace>>&& places,
                                  const ImageView& image, int count) {
  constexpr std::size_t steps = 64, tiles = 4;
  const auto by_light = [](const auto& a, const auto& b) { return a.first < b.first; };
  const auto [least, most] = std::minmax_element(places.begin(), places.end(), by_light);
  const double low = least->first, width = std::max(most->first - low, 1e-9);
  std::vector<std::array<std::vector<std::size_t>, tiles * tiles>> bins(steps);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const FlatPlace& p = places[i].second;
    const auto step = static_cast<std::size_t>(steps * (places[i].first - low) / width);
    const auto column = static_cast<std::size_t>(tiles * p.x / image.width);
    const auto row = static_cast<std::size_t>(tiles * p.y / image.height);
    bins[std::min(step, steps - 1)][tiles * row + column].push_back(i);
  }
  std::vector<FlatPlace> chosen;
  for (std::size_t turn = 0;; ++turn) {  // the turn-th of every tile of every step
    bool any = false;
    for (const auto& bin : bins)
      for (const auto& tile : bin) {
        if (turn >= tile.size()) continue;
        if (static_cast<int>(chosen.size()) == count) return chosen;
        chosen.push_back(std::move(places[tile[turn]].second));
        any = true;
      }
    if (!any) return chosen;
  }
}

}  // namespace

std::vector<FlatPlace> flat_places(const std::vector<ImageView>& images, int channel,
                                   const LevelRange& range, int count) {
  const std::vector<Candidate> candidates = candidates_of(images, channel);
  const LevelRange seen{range.black_dn, white_of(candidates, range)};
  const NoiseCurve noise = noise_of(candidates, seen);
  std::vector<std::pair<double, FlatPlace>> places;
  for (const Candidate& candidate : candidates)
    if (auto place = place_of(candidate, noise, seen))
      places.emplace_back(candidate.light, std::move(*place));
  if (places.empty()) return {};
  return spread_out(std::move(places), images.front(), count);
}

}  // namespace occ::internal::photometry
