// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/colour_difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

// Sine of the angle between a colour and white from which on it is saturated. The difference has
// |w| times the noise of a channel: for a smaller sine more than twice that of grey. White light
// of an unknown white balance (ln of ratios +-0.3, Lamp::colour_sigma) has a sine of about 0.2.
constexpr double min_saturation = 0.35;
// Cosine between the differences of colours that are found in one pass. Its level is by up to this
// factor too low.
constexpr double alike_cosine = 0.95;
// Min light of the colour over white light. White light of an unknown white balance has up to 0.4.
constexpr double min_purity = 0.5;
// Light of all channels, of full scale, in a nearly white pixel: there a lamp of twice the light
// that clips its brightest channel is hardly purer than min_purity.
constexpr double white_share = 0.5;
// Walls reflect up to a twentieth of a lamp's light beside it; neighbouring lamps at 80 degrees
// have a fifth of the light of one that faces the camera.
constexpr double dim_share = 0.1;
// Peak of a component over the brightest peak. The radiance of a lamp does not depend on its
// distance, and blur dilutes it only if the lamp is smaller than a pixel, but reflections of its
// light by walls and floors have a few percent of it at most.
constexpr double faint_share = 0.03;
constexpr int resolved_px = 50;          // area of a lamp whose peak is not diluted by blur
constexpr std::size_t dim_cell_px = 16;  // the reach, 16 to 32 px, of a glow beside a lamp
constexpr double overlap = 0.03;         // added to shares before ratios, as for Lamp::colour
constexpr double top_level = 65535;
constexpr double min_common = 0.5;    // of the boxes of one region, in two passes: their thresholds
                                      // differ
constexpr int max_hole_px = 1 << 16;  // larger white areas are windows, not lamps
constexpr double coloured_share = 0.5;  // of the pixels around a hole, that it is filled

Eigen::Vector3d difference_of(const Eigen::Vector3d& share) { return share.array() - share.mean(); }

bool is_saturated(const Eigen::Vector3d& share) {
  return difference_of(share).norm() > min_saturation * share.norm();
}

double grey_of(const Eigen::Vector3d& colour) {
  return (colour[0] + 2 * colour[1] + colour[2]) / 4;
}

/// True if the boxes of two blobs share more than half of their union.
bool is_same_region(const Blob& a, const Blob& b) {
  const auto area = [](double x0, double y0, double x1, double y1) {
    return std::max(0.0, x1 - x0 + 1) * std::max(0.0, y1 - y0 + 1);
  };
  const double common =
      area(std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1));
  const double both = area(a.x0, a.y0, a.x1, a.y1) + area(b.x0, b.y0, b.x1, b.y1) - common;
  return common > min_common * both;
}

}  // namespace

std::vector<ColourGroup> group_colours(const std::vector<Eigen::Vector3d>& colours) {
  struct Sum {
    Eigen::Vector3d first, sum;
    bool saturated;
  };
  std::vector<Sum> sums;
  for (const Eigen::Vector3d& colour : colours) {
    const Eigen::Vector3d share = colour / colour.sum();
    const bool saturated = is_saturated(share);
    const auto alike = std::find_if(sums.begin(), sums.end(), [&](const Sum& s) {
      if (s.saturated != saturated) return false;
      return !saturated || difference_of(s.first).normalized().dot(
                               difference_of(share).normalized()) > alike_cosine;
    });
    if (alike == sums.end())
      sums.push_back({share, share, saturated});
    else
      alike->sum += share;
  }
  std::vector<ColourGroup> groups;
  for (const Sum& s : sums) groups.push_back({s.sum / s.sum.sum(), s.saturated});
  return groups;
}

double colour_distance(const Eigen::Vector3d& share, const Eigen::Vector3d& other) {
  const Eigen::Array3d ratio = (share.array() + overlap).log() - (other.array() + overlap).log();
  return ratio.maxCoeff() - ratio.minCoeff();
}

std::vector<Blob> without_duplicates(std::vector<PassBlobs> passes) {
  struct Found {
    Blob* blob;
    std::size_t pass;
    double distance;
    bool kept = true;
  };
  std::vector<Found> all;
  for (std::size_t i = 0; i < passes.size(); ++i)
    for (Blob& blob : passes[i].blobs)
      all.push_back({&blob, i,
                     blob.colour ? colour_distance(blob.colour->share, passes[i].share)
                                 : std::numeric_limits<double>::infinity()});
  if (passes.size() > 1) {
    std::stable_sort(all.begin(), all.end(),
                     [](const Found& a, const Found& b) { return a.blob->x0 < b.blob->x0; });
    for (std::size_t i = 0; i < all.size(); ++i)
      for (std::size_t j = i + 1; j < all.size() && all[j].blob->x0 <= all[i].blob->x1; ++j) {
        Found &a = all[i], &b = all[j];
        if (a.pass == b.pass || !is_same_region(*a.blob, *b.blob)) continue;
        const bool a_is_closer = std::tuple(a.distance, a.pass) < std::tuple(b.distance, b.pass);
        (a_is_closer ? b : a).kept = false;
      }
  }
  std::vector<Blob> blobs;
  for (const Found& found : all)
    if (found.kept) blobs.push_back(std::move(*found.blob));
  return blobs;
}

ColourDifference::ColourDifference(const ImageView& image, const LinearImage& linear,
                                   const Eigen::Vector3d& share, const Sensor* sensor)
    : original_(image), clipped_from_dn_(linear.full_scale_dn()) {
  const Eigen::Vector3d difference = difference_of(share);
  const double grey = grey_of(share);
  const Eigen::Vector3d weights = difference * (grey / difference.squaredNorm());
  const double full_scale_dn = linear.linear_dn(clipped_from_dn_);
  scale_ = top_level / (weights.cwiseMax(0.0).sum() * full_scale_dn);
  const double black_dn = sensor ? sensor->black_level_dn : 0;
  min_noise_ = Background::floor_dn * weights.norm() * linear.slope(black_dn) * scale_;

  for (Image* out : {&image_, &pure_}) {
    out->width = image.width;
    out->height = image.height;
    out->type = PixelType::u16;
    out->u16.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  }
  // S = D (1 + min_purity m) - min_purity g mean(L), with g and m of the colour with this scale.
  const Eigen::Vector3d pure = (1 + min_purity * share.mean() / share.maxCoeff()) * weights -
                               Eigen::Vector3d::Constant(min_purity * grey / share.maxCoeff() / 3);
  purity_ = pure;
  project(scale_ * weights, scale_ * pure, linear);
  // A lamp of this colour is clipped in its brightest channel first.
  const double full_scale = scale_ * full_scale_dn * grey / share.maxCoeff();
  fill_clipped(static_cast<std::uint16_t>(full_scale));
  remove_dim_surroundings();
  if (!sensor) return;
  // Shot noise g L_k of each channel with weights w_k, for light of the colour; read noise |w|.
  sensor_ = *sensor;
  const double shot = weights.cwiseProduct(weights).dot(share) / weights.dot(share);
  sensor_->gain_dn_per_e = scale_ * sensor->gain_dn_per_e * shot;
  sensor_->read_noise_e =
      std::hypot(sensor->read_noise_e * weights.norm() / shot, min_noise_ / sensor_->gain_dn_per_e);
  sensor_->black_level_dn = 0;
  sensor_->bit_depth = 16;
  sensor_->response = Response::linear;
  sensor_->full_well_e = std::min(full_scale, top_level) / sensor_->gain_dn_per_e;
}

void ColourDifference::project(const Eigen::Vector3d& weights, const Eigen::Vector3d& pure_weights,
                               const LinearImage& linear) {
  struct Entry {
    float level, pure;
  };
  const int levels = original_.type == PixelType::u8 ? 256 : 65536;
  std::array<std::vector<Entry>, 3> tables;
  for (auto& table : tables) table.resize(static_cast<std::size_t>(levels));
  const double white_dn = white_share * linear.linear_dn(clipped_from_dn_);
  int white_from = levels;
  for (int i = levels - 1; i >= 0; --i) {
    const double light = linear.linear_dn(std::min<double>(i, clipped_from_dn_));
    if (light >= white_dn) white_from = i;
    for (int k = 0; k < 3; ++k)
      tables[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] = {
          static_cast<float>(weights[k] * light), static_cast<float>(pure_weights[k] * light)};
  }
  const auto to_level = [](float value) {
    return static_cast<std::uint16_t>(std::clamp(value + 0.5f, 0.0f, 65535.0f));
  };
  visit_pixels(original_, [&](const auto& pixels) {
    using P = std::decay_t<decltype(pixels)>;
    if constexpr (P::channels >= 3) {
      std::size_t i = 0;
      for (int y = 0; y < pixels.height(); ++y) {
        const auto* p = pixels.row(y);
        for (int x = 0; x < pixels.width(); ++x, p += P::channels, ++i) {
          const Entry &first = tables[0][p[0]], &second = tables[1][p[1]], &third = tables[2][p[2]];
          image_.u16[i] = to_level(first.level + second.level + third.level);
          pure_.u16[i] = to_level(first.pure + second.pure + third.pure);
          if (std::min(p[0], std::min(p[1], p[2])) >= white_from) white_.push_back(i);
        }
      }
    }
  });
}

/// Fills white regions that light of the colour surrounds.
void ColourDifference::fill_clipped(std::uint16_t level) {
  if (white_.empty()) return;
  const auto width = static_cast<std::size_t>(image_.width);
  enum : char { other, white, visited };
  std::vector<char> kind(image_.u16.size(), other);
  for (const std::size_t i : white_) kind[i] = white;
  std::vector<std::size_t> region;
  for (const std::size_t seed : white_) {
    if (kind[seed] != white) continue;
    region.assign(1, seed);
    kind[seed] = visited;
    int around = 0, coloured = 0;
    for (std::size_t k = 0; k < region.size(); ++k) {
      const std::size_t x = region[k] % width, y = region[k] / width;
      const auto look = [&](std::size_t i) {
        if (kind[i] == white) {
          kind[i] = visited;
          region.push_back(i);
        } else if (kind[i] == other) {
          ++around;
          coloured += pure_.u16[i] > level / 4;
        }
      };
      if (x > 0) look(region[k] - 1);
      if (x + 1 < width) look(region[k] + 1);
      if (y > 0) look(region[k] - width);
      if (y + 1 < static_cast<std::size_t>(image_.height)) look(region[k] + width);
    }
    if (region.size() > max_hole_px || !(coloured > coloured_share * around)) continue;
    for (const std::size_t i : region) image_.u16[i] = pure_.u16[i] = level;
  }
}

/// Sets pixels of S to 0 that are dimmer than a share of the brightest pixel in their cell and the
/// cells around it.
void ColourDifference::remove_dim_surroundings() {
  const auto width = static_cast<std::size_t>(pure_.width);
  const auto height = static_cast<std::size_t>(pure_.height);
  const std::size_t columns = (width + dim_cell_px - 1) / dim_cell_px;
  const std::size_t rows = (height + dim_cell_px - 1) / dim_cell_px;
  std::vector<std::uint16_t> brightest(columns * rows);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t c = 0; c < columns; ++c) {
      const auto* row = pure_.u16.data() + y * width;
      const std::uint16_t most =
          *std::max_element(row + c * dim_cell_px, row + std::min(width, (c + 1) * dim_cell_px));
      std::uint16_t& cell = brightest[y / dim_cell_px * columns + c];
      cell = std::max(cell, most);
    }
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c) {
      std::uint16_t most = 0;
      for (std::size_t v = r > 0 ? r - 1 : 0; v <= std::min(rows - 1, r + 1); ++v)
        for (std::size_t u = c > 0 ? c - 1 : 0; u <= std::min(columns - 1, c + 1); ++u)
          most = std::max(most, brightest[v * columns + u]);
      const auto limit = static_cast<std::uint16_t>(dim_share * most);
      if (limit == 0) continue;
      for (std::size_t y = r * dim_cell_px; y < std::min(height, (r + 1) * dim_cell_px); ++y)
        for (std::size_t x = c * dim_cell_px; x < std::min(width, (c + 1) * dim_cell_px); ++x)
          if (std::uint16_t& value = pure_.u16[y * width + x]; value < limit) value = 0;
    }
}

/// Median and deviation of D on a frame around the box.
void ColourDifference::measure_background(Component& component) const {
  constexpr int frame_px = 3;        // distance from the box, beyond the blurred edge
  constexpr double normal = 1.4826;  // standard deviation over the median deviation
  constexpr std::size_t min_pixels = 8;
  const int left = component.x0 - frame_px, right = component.x1 + frame_px;
  const int top = component.y0 - frame_px, bottom = component.y1 + frame_px;
  std::vector<double> levels;
  const auto add = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return;
    levels.push_back(
        image_.u16[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                   static_cast<std::size_t>(x)]);
  };
  for (int x = left; x <= right; ++x) add(x, top), add(x, bottom);
  for (int y = top + 1; y < bottom; ++y) add(left, y), add(right, y);
  if (levels.size() < min_pixels) return;
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
  std::nth_element(levels.begin(), middle, levels.end());
  const double median_level = *middle;
  for (double& level : levels) level = std::abs(level - median_level);
  std::nth_element(levels.begin(), middle, levels.end());
  component.background_dn = median_level;
  component.noise_dn = std::max(component.noise_dn, normal * *middle);
}

bool ColourDifference::has_colour(const Blob& blob) const {
  constexpr double min_sigmas = 2;  // more would reject small lamps
  if (!blob.colour) return false;
  const auto& clipped = blob.colour->clipped;
  if (std::all_of(clipped.begin(), clipped.end(), [](bool is) { return is; })) return true;
  return purity_.dot(blob.colour->share) >
         min_sigmas * purity_.cwiseProduct(blob.colour->sigma).norm();
}

void ColourDifference::describe(const ThresholdRule& rule,
                                std::vector<Component>& components) const {
  double brightest = 0;
  for (const Component& c : components)
    if (c.area_px >= resolved_px) brightest = std::max(brightest, c.peak_dn);
  components.erase(
      std::remove_if(components.begin(), components.end(),
                     [&](const Component& c) { return c.peak_dn < faint_share * brightest; }),
      components.end());
  visit_pixels(original_, [&](const auto& pixels) {
    using P = std::decay_t<decltype(pixels)>;
    for (Component& c : components) {
      const double threshold = rule.level_dn.value_or(c.background_dn + rule.sigma * c.noise_dn);
      c.saturated_px = 0;
      for (int y = c.y0; y <= c.y1; ++y) {
        const auto* row = pixels.row(y);
        const std::uint16_t* level = image_.u16.data() + static_cast<std::size_t>(y) *
                                                             static_cast<std::size_t>(image_.width);
        for (int x = c.x0; x <= c.x1; ++x)
          c.saturated_px += level[x] > threshold && P::brightest(row, x) >= clipped_from_dn_;
      }
      measure_background(c);
    }
    components.erase(std::remove_if(components.begin(), components.end(),
                                    [&](const Component& c) {
                                      return c.peak_dn < c.background_dn + rule.sigma * c.noise_dn;
                                    }),
                     components.end());
  });
}

}  // namespace occ::internal::detect
