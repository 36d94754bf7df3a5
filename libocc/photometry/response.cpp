// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/response.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <sstream>
#include <string>

#include "libocc/core/internal/image_levels.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/photometry/internal/response_fit.hpp"

namespace occ {

using namespace internal::photometry;
namespace {

using Eigen::Index;

constexpr std::size_t min_patches = 16;

void validate_images(const std::vector<ImageView>& images) {
  require(images.size() >= 2, "images", images.size(), "at least two");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string name = "images[" + std::to_string(i) + "]";
    const ImageView &image = images[i], &first = images[0];
    image.validate(name);
    require(
        image.width == first.width && image.height == first.height, name + "'s size",
        std::to_string(image.width) + " x " + std::to_string(image.height),
        "that of images[0], " + std::to_string(first.width) + " x " + std::to_string(first.height));
    require(image.channels == first.channels, name + "'s channels", image.channels,
            "as many as those of images[0], " + std::to_string(first.channels));
    require(image.type == first.type, name + "'s bits", image.type == PixelType::u8 ? 8 : 16,
            "those of images[0]");
  }
}

void validate_exposures(const std::vector<double>& exposures_s, std::size_t images) {
  require(exposures_s.size() == images, "exposures_s", exposures_s.size(),
          "one for each of " + std::to_string(images) + " images");
  for (std::size_t i = 0; i < exposures_s.size(); ++i)
    require(exposures_s[i] > 0 && std::isfinite(exposures_s[i]),
            "exposures_s[" + std::to_string(i) + "]", exposures_s[i], "positive");
}

void validate_depth(const std::vector<ImageView>& images, double full_scale_dn) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ImageView& image = images[i];
    if (image.type == PixelType::u8) continue;
    const int highest = internal::core::highest_level(image);
    require(highest <= full_scale_dn, "images[" + std::to_string(i) + "]'s brightest pixel",
            highest,
            "at most " + std::to_string(static_cast<int>(full_scale_dn)) + " by its bit_depth");
  }
}

int depth_of(const ImageView& image, const ResponseOptions& options) {
  if (image.type == PixelType::u16) {
    require(options.bit_depth != 0, "bit_depth", "0", "given for 16-bit images");
    return options.bit_depth;
  }
  require(options.bit_depth == 0 || options.bit_depth == 8, "bit_depth", options.bit_depth,
          "8 for 8-bit images");
  return 8;
}

/// Message for the first gap between the level ranges of the patches; empty without a gap. Each
/// patch links the levels that it has in different images.
std::string find_gap(const std::vector<FlatPatch>& patches) {
  std::vector<std::pair<double, double>> ranges;
  for (const FlatPatch& patch : patches) {
    const auto by_level = [](const auto& a, const auto& b) { return a.level_dn < b.level_dn; };
    const auto [low, high] =
        std::minmax_element(patch.levels.begin(), patch.levels.end(), by_level);
    ranges.emplace_back(low->level_dn, high->level_dn);
  }
  std::sort(ranges.begin(), ranges.end());
  double reached = ranges.front().second;
  for (const auto& [low, high] : ranges) {
    if (low > reached + 1) {
      std::ostringstream text;
      text << "no patch links the levels below " << std::lround(reached) << " to those above "
           << std::lround(low) << ": add intermediate exposure times";
      return text.str();
    }
    reached = std::max(reached, high);
  }
  return "";
}

/// Ranks 0 to 1 of values; ties get different ranks, which matters little for many values.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> rank(values.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    rank[order[i]] = static_cast<double>(i) / static_cast<double>(order.size() - 1);
  return rank;
}

/// Message for two images that show different scenes; empty if there are none. A rising response
/// keeps the order of the patches' levels, whatever the exposure times are: Spearman's rank
/// correlation ("The proof and measurement of association between two things", American Journal of
/// Psychology 15, 1904) is near 1. The limit allows for a scene that moved in part.
std::string find_other_scene(const std::vector<FlatPatch>& patches, std::size_t images) {
  constexpr double min_correlation = 0.7, min_spread_sigma = 20;
  for (std::size_t a = 0; a < images; ++a)
    for (std::size_t b = a + 1; b < images; ++b) {
      std::vector<double> first, second;
      double noise_dn = 0;
      for (const FlatPatch& patch : patches) {
        const PatchLevel *in_a = nullptr, *in_b = nullptr;
        for (const PatchLevel& level : patch.levels) {
          if (level.exposure == static_cast<int>(a)) in_a = &level;
          if (level.exposure == static_cast<int>(b)) in_b = &level;
        }
        if (!in_a || !in_b) continue;
        first.push_back(in_a->level_dn);
        second.push_back(in_b->level_dn);
        noise_dn = std::max({noise_dn, std::sqrt(in_a->pixel_dn2), std::sqrt(in_b->pixel_dn2)});
      }
      if (first.size() < min_patches) continue;
      const auto spread = [](const std::vector<double>& levels) {
        return quantile(levels, 0.9) - quantile(levels, 0.1);
      };
      // Noise determines the order of equal levels.
      if (std::min(spread(first), spread(second)) < min_spread_sigma * std::max(noise_dn, 0.1))
        continue;
      const std::vector<double> x = ranks(first), y = ranks(second);
      double squares = 0, variance = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        squares += (x[i] - y[i]) * (x[i] - y[i]);
        variance += (x[i] - 0.5) * (x[i] - 0.5);
      }
      const double correlation = 1 - squares / (2 * variance);
      if (correlation > min_correlation) continue;
      std::ostringstream text;
      text.precision(2);
      text << "images " << a << " and " << b << " show different scenes: the order of their "
           << "brightness agrees by " << correlation << " only (1 for one scene)";
      return text.str();
    }
  return "";
}

/// Weighted isotonic regression by pooling adjacent violators (Kruskal, Psychometrika 29, 1964);
/// returns the number of changed levels.
int project_to_rising(Eigen::VectorXd& g, const Eigen::VectorXd& sigma) {
  struct Block {
    double sum, weight;
    Index count;
  };
  std::vector<Block> blocks;
  for (Index k = 0; k < g.size(); ++k) {
    const double weight = 1 / (sigma[k] * sigma[k] + 1e-12);
    blocks.push_back({weight * g[k], weight, 1});
    while (blocks.size() > 1) {
      const Block last = blocks.back(), before = blocks[blocks.size() - 2];
      if (before.sum * last.weight <= last.sum * before.weight) break;
      blocks.pop_back();
      blocks.back() = {before.sum + last.sum, before.weight + last.weight,
                       before.count + last.count};
    }
  }
  int moved = 0;
  Index k = 0;
  for (const Block& block : blocks) {
    if (block.count > 1) {
      g.segment(k, block.count).setConstant(block.sum / block.weight);
      moved += static_cast<int>(block.count);
    }
    k += block.count;
  }
  return moved;
}

void set_range(const std::vector<FlatPatch>& patches, ChannelResponse& response) {
  response.lowest_dn = response.full_scale_dn;
  response.highest_dn = 0;
  for (const FlatPatch& patch : patches)
    for (const auto& p : patch.levels) {
      response.lowest_dn = std::min(response.lowest_dn, p.level_dn);
      response.highest_dn = std::max(response.highest_dn, p.level_dn);
    }
}

/// Response of one channel; the status and message as recover_response().
Result<ChannelResponse> channel_response(const std::vector<ImageView>& images, int channel,
                                         const std::vector<double>& exposures_s,
                                         const LevelRange& range, const ResponseOptions& options) {
  Result<ChannelResponse> result;
  ChannelResponse& response = result.value;
  response.black_level_dn = range.black_dn;
  response.full_scale_dn = range.full_scale_dn;
  response.level_dn = curve_levels(range);
  const std::vector<FlatPatch> patches = flat_patches(images, channel, range, options.max_patches);
  const auto failed = [&](Status status, const std::string& message) {
    result.status = status;
    result.message = message;
    return result;
  };
  if (patches.size() < min_patches)
    return failed(Status::degenerate,
                  "only " + std::to_string(patches.size()) +
                      " patches are flat and neither black nor clipped in two images");
  if (const std::string other = find_other_scene(patches, images.size()); !other.empty())
    return failed(Status::degenerate, other);
  std::set<double> used;
  for (const FlatPatch& patch : patches)
    for (const auto& p : patch.levels) used.insert(exposures_s[p.exposure]);
  if (used.size() < (options.method == ResponseMethod::levels ? 3 : 2))
    return failed(Status::degenerate, "only " + std::to_string(used.size()) +
                                          " different exposure times have patches that are neither "
                                          "black nor clipped");
  if (const std::string gap = find_gap(patches); !gap.empty())
    return failed(Status::degenerate, gap);

  set_range(patches, response);
  const PatchSeries series{patches, exposures_s};
  const bool found = options.method == ResponseMethod::levels
                         ? fit_levels(series, options.smoothness, response)
                         : fit_basis(series, options.basis_functions, response);
  if (!found)
    return failed(Status::not_converged, options.method == ResponseMethod::levels
                                             ? "the fit of the curve does not converge"
                                             : "no rising curve of the basis fits");
  response.projected += project_to_rising(response.log_exposure, response.sigma());
  if (response.variance_factor > 1) {
    std::ostringstream text;
    text.precision(3);
    text << "residuals are " << std::sqrt(response.variance_factor)
         << " times their expected size: wrong exposure times, a scene that moved, or no curve of "
            "this "
            "kind";
    result.message = text.str();
  }
  return result;
}

}  // namespace

void ResponseOptions::validate() const {
  require(black_level_dn >= 0 && std::isfinite(black_level_dn), "black_level_dn", black_level_dn,
          "zero or positive");
  require(bit_depth == 0 || (bit_depth >= 8 && bit_depth <= 16), "bit_depth", bit_depth,
          "in [8, 16]");
  require(smoothness >= 1 && std::isfinite(smoothness), "smoothness", smoothness, "at least 1");
  require(basis_functions >= 1 && basis_functions <= 8, "basis_functions", basis_functions,
          "between 1 and 8");
  require(max_patches >= static_cast<int>(min_patches), "max_patches", max_patches, "at least 16");
}

Eigen::VectorXd ChannelResponse::sigma() const { return covariance.diagonal().cwiseSqrt(); }

std::vector<double> ChannelResponse::table(int samples) const {
  require(samples >= 2 && samples <= 65536, "samples", samples, "between 2 and 65536");
  require(log_exposure.size() >= 2 && log_exposure.size() == level_dn.size(), "log_exposure",
          log_exposure.size(), "a curve at every level");
  const Index n = level_dn.size();
  const double range_dn = full_scale_dn - black_level_dn;
  std::vector<double> linear{0}, stored{0};
  for (Index k = 0; k < n; ++k) {
    const double x = std::exp(log_exposure[k] - log_exposure[n - 1]);
    if (!(x > linear.back()))
      linear.pop_back(), stored.pop_back();  // equal values: keep the upper end
    linear.push_back(x);
    stored.push_back((level_dn[k] - black_level_dn) / range_dn);
  }
  linear.front() = stored.front() = 0;
  std::vector<double> values(static_cast<std::size_t>(samples));
  std::size_t k = 1;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) / static_cast<double>(samples - 1);
    while (k + 1 < linear.size() && linear[k] < x) ++k;
    const double part = (x - linear[k - 1]) / (linear[k] - linear[k - 1]);
    values[i] = stored[k - 1] + part * (stored[k] - stored[k - 1]);
  }
  values.back() = 1;
  return values;
}

Result<RecoveredResponse> recover_response(const std::vector<ImageView>& images,
                                           const std::vector<double>& exposures_s,
                                           const ResponseOptions& options) {
  options.validate();
  validate_images(images);
  validate_exposures(exposures_s, images.size());
  const LevelRange range{options.black_level_dn,
                         static_cast<double>((1 << depth_of(images[0], options)) - 1)};
  require(range.black_dn < range.full_scale_dn - 16, "black_level_dn", range.black_dn,
          "well below full scale");
  validate_depth(images, range.full_scale_dn);

  Result<RecoveredResponse> result;
  const int channels = std::min(images[0].channels, 3);
  for (int channel = 0; channel < channels; ++channel) {
    Result<ChannelResponse> channel_result =
        channel_response(images, channel, exposures_s, range, options);
    if (!channel_result.message.empty()) {
      const std::string prefix = channels > 1 ? "channel " + std::to_string(channel) + ": " : "";
      result.message += (result.message.empty() ? "" : "; ") + prefix + channel_result.message;
    }
    if (!channel_result.ok()) {
      result.status = channel_result.status;
      return result;
    }
    result.value.channels.push_back(std::move(channel_result.value));
  }
  return result;
}

Sensor with_response(Sensor sensor, const RecoveredResponse& response, int samples) {
  const std::vector<ChannelResponse>& channels = response.channels;
  require(channels.size() == 1 || channels.size() == 3, "response.channels", channels.size(),
          "one, or three");
  const ChannelResponse& first = channels.front();
  sensor.black_level_dn = first.black_level_dn;
  sensor.bit_depth = static_cast<int>(std::lround(std::log2(first.full_scale_dn + 1)));
  if (channels.size() == 1) {
    sensor.response = Response::table;
    sensor.response_table = first.table(samples);
    return sensor;
  }
  require(sensor.mosaic != Mosaic::none, "sensor.mosaic", "none",
          "given for a response of three channels");
  sensor.channels.resize(3);
  for (std::size_t colour = 0; colour < 3; ++colour) {
    sensor.channels[colour].response = Response::table;
    sensor.channels[colour].response_table = channels[colour].table(samples);
  }
  return sensor;
}

}  // namespace occ
