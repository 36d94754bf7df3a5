// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/blob_colour.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

constexpr double min_signal_share = 0.5;  // of the peak, in a pixel that counts: the edge is mixed
                                          // with the background and blurred in chroma
constexpr double min_signal_sigmas = 3;   // and in sigmas of the background's noise
constexpr int max_side = 48;         // pixels along a side that are read; larger blobs are sampled
constexpr int ring_px = 3;           // distance of the background pixels from the box; the light
                                     // of the lamp's blurred edge ends there
constexpr double edge_error = 0.05;  // of a share from the edge alone (demosaicing, sharpening)
constexpr double independence = 0.25;  // share of independent pixels: demosaicing and the coarser
                                       // chroma of compressed images join 2 x 2 pixels
constexpr double background_steps = 0.3;  // error of the background, in quantisation steps: the
                                          // standard deviation of a uniform distribution

/// Sums over the pixels of one pattern of clipped channels.
struct ChannelSums {
  int pixels = 0;
  Eigen::Vector3d light = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 3> squares = Eigen::Matrix3d::Zero();  // sum of light * light^T

  void add(const Eigen::Vector3d& pixel) {
    ++pixels;
    light += pixel;
    squares += pixel * pixel.transpose();
  }
};

double median_level(std::vector<int>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Stored levels of the channels around the box, as medians; empty if the image ends there.
template <typename P>
std::optional<Eigen::Vector3d> surroundings(const P& pixels, const Component& c) {
  std::array<std::vector<int>, 3> values;
  const int left = c.x0 - ring_px, right = c.x1 + ring_px;
  const int top = c.y0 - ring_px, bottom = c.y1 + ring_px;
  const auto add = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= pixels.width() || y >= pixels.height()) return;
    const typename P::Value* p = pixels.row(y) + static_cast<std::ptrdiff_t>(x) * P::channels;
    for (std::size_t k = 0; k < 3; ++k) values[k].push_back(p[k]);
  };
  const int across = std::max(1, (right - left) / max_side);
  const int down = std::max(1, (bottom - top) / max_side);
  for (int x = left; x <= right; x += across) add(x, top), add(x, bottom);
  for (int y = top + 1; y < bottom; y += down) add(left, y), add(right, y);
  if (values[0].empty()) return std::nullopt;
  return Eigen::Vector3d(median_level(values[0]), median_level(values[1]), median_level(values[2]));
}

/// Shares and their standard deviations. With the light L of a pixel and its total T = 1 . L, the
/// error of share s is sum (L - s T) / sum T. Its variance follows from the scatter of L - s T.
BlobColour colour_of(const ChannelSums& sums, double background_error_dn) {
  BlobColour colour;
  const double total = sums.light.sum();
  colour.share = sums.light / total;
  const double n = sums.pixels;
  const double correction = n > 1 ? n / (n - 1) : 1;
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d row = Eigen::Vector3d::Constant(-colour.share[k]);
    row[k] += 1;
    const double scatter = std::max(0.0, row.dot(sums.squares * row)) * correction / independence;
    colour.sigma[k] = std::sqrt(scatter + square(n * background_error_dn * row.norm())) / total;
  }
  colour.share = colour.share.cwiseMax(0.0);
  colour.share /= colour.share.sum();
  return colour;
}

}  // namespace

std::optional<BlobColour> measure_colour(const ImageView& image, const LinearImage& linear,
                                         const Component& component, const Patch& patch) {
  const int x0 = component.x0, y0 = component.y0, x1 = component.x1, y1 = component.y1;
  if (!patch.contains(x0, y0) || !patch.contains(x1, y1)) return std::nullopt;
  const int step_x = (x1 - x0) / max_side + 1, step_y = (y1 - y0) / max_side + 1;
  const auto for_each_pixel = [&](auto&& f) {
    for (int y = y0; y <= y1; y += step_y)
      for (int x = x0; x <= x1; x += step_x) f(x, y, *patch.at(x, y));
  };
  double peak = 0;
  for_each_pixel([&](int, int, double signal) { peak = std::max(peak, signal); });
  const double limit =
      std::max(min_signal_share * peak, min_signal_sigmas * std::sqrt(patch.noise().floor));
  const double full_scale_dn = linear.full_scale_dn();
  return visit_pixels(image, [&](const auto& pixels) -> std::optional<BlobColour> {
    using P = std::decay_t<decltype(pixels)>;
    if constexpr (P::channels < 3) {
      return std::nullopt;
    } else {
      const auto background = surroundings(pixels, component);
      if (!background) return std::nullopt;
      const Eigen::Vector3d below =
          background->unaryExpr([&](double stored_dn) { return linear.linear_dn(stored_dn); });
      std::array<ChannelSums, 8> by_pattern;  // the bits are the clipped channels
      for_each_pixel([&](int x, int y, double signal) {
        if (!(signal >= limit)) return;
        const auto* p = pixels.row(y) + static_cast<std::ptrdiff_t>(x) * P::channels;
        Eigen::Vector3d light;
        std::size_t pattern = 0;
        for (int k = 0; k < 3; ++k) {
          light[k] = linear.linear_dn(p[k]) - below[k];
          pattern |= static_cast<std::size_t>(p[k] >= full_scale_dn) << k;
        }
        by_pattern[pattern].add(light);
      });
      // The pixels of one pattern have the same bounds. Pixels clipped in all channels have no
      // colour; those at the edge then have some.
      constexpr std::size_t white = 7;
      std::size_t used = 0;
      for (std::size_t i = 1; i < by_pattern.size(); ++i)
        if (by_pattern[i].pixels > by_pattern[used].pixels) used = i;
      const bool at_edge = used == white && by_pattern[0].pixels > 0;
      if (at_edge) used = 0;
      const ChannelSums& sums = by_pattern[used];
      if (!(sums.light.sum() > 0)) return std::nullopt;
      BlobColour colour =
          colour_of(sums, background_steps * linear.slope(std::max(0.0, background->maxCoeff())));
      if (at_edge) colour.sigma.array() += edge_error;
      for (std::size_t k = 0; k < 3; ++k) colour.clipped[k] = (used >> k & 1) != 0;
      return colour;
    }
  });
}

}  // namespace occ::internal::detect
