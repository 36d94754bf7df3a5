// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/lamp_colours.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"

namespace occ::internal::scene {
namespace {

constexpr double max_sigmas = 4;
// Added to every share before ratios are formed. The filters of a sensor overlap, and the colour
// matrix of a camera subtracts the overlap, so that small shares are uncertain by a few percent.
constexpr double overlap = 0.03;

bool has_equal_channels(const Lamp& lamp) {
  return lamp.colour.minCoeff() == lamp.colour.maxCoeff();
}

}  // namespace

bool states_colours(const std::vector<Lamp>& lamps) {
  return !std::all_of(lamps.begin(), lamps.end(), has_equal_channels);
}

std::vector<Eigen::Vector3d> stated_colours(const std::vector<Lamp>& lamps) {
  std::vector<Eigen::Vector3d> colours;
  if (!states_colours(lamps)) return colours;
  for (const Lamp& lamp : lamps)
    if (std::find(colours.begin(), colours.end(), lamp.colour) == colours.end())
      colours.push_back(lamp.colour);
  return colours;
}

bool contradicts_colour(const Lamp& lamp, const Blob& blob) {
  if (!blob.colour) return false;
  const Eigen::Array3d stated = (lamp.colour / lamp.colour.sum()).array() + overlap;
  const Eigen::Array3d seen = blob.colour->share.array() + overlap;
  const Eigen::Array3d sigma = blob.colour->sigma.array() / seen;
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < j; ++k) {
      const bool is_low_bound = blob.colour->clipped[static_cast<std::size_t>(j)];
      const bool is_high_bound = blob.colour->clipped[static_cast<std::size_t>(k)];
      double off = std::log(seen[j] / seen[k]) - std::log(stated[j] / stated[k]);
      if (is_low_bound) off = std::max(off, 0.0);
      if (is_high_bound) off = std::min(off, 0.0);
      const double variance = square(lamp.colour_sigma) + square(sigma[j]) + square(sigma[k]);
      if (square(off) > square(max_sigmas) * variance) return true;
    }
  return false;
}

double log_colour_ratio(const Lamp& lamp, const Blob& blob) {
  // Some false lights in a picture are reflections of lamps, or screens of their colour. Most are
  // lamps, windows and walls from 2700 to 7000 K, whose ln of red over blue varies by +-0.5.
  constexpr double like_lamp = 0.1, white = 0.6, any = 0.3;
  constexpr double white_sigma = 0.5;
  constexpr double range = 6;  // of ln of a ratio: that of shares above `overlap`
  if (!blob.colour) return 0;
  const auto& clipped = blob.colour->clipped;
  if (std::any_of(clipped.begin(), clipped.end(), [](bool is) { return is; })) return 0;
  const Eigen::Array3d stated = (lamp.colour / lamp.colour.sum()).array() + overlap;
  const Eigen::Array3d seen = blob.colour->share.array() + overlap;
  const Eigen::Array3d variance = (blob.colour->sigma.array() / seen).square();
  // The ratios to green of red and blue share the error of green.
  const auto density = [&](const Eigen::Array3d& mean, double ratio_sigma) {
    const Eigen::Array3d ln = (seen / mean).log();
    const Eigen::Array3d v = variance + 0.5 * square(ratio_sigma);
    const double x = ln[0] - ln[1], y = ln[2] - ln[1];
    const double xx = v[0] + v[1], yy = v[2] + v[1], xy = v[1];
    const double determinant = xx * yy - xy * xy;
    const double chi2 = (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant;
    return std::exp(-0.5 * chi2) / (2 * pi * std::sqrt(determinant));
  };
  const double of_lamp = density(stated, lamp.colour_sigma);
  const double of_white = density(Eigen::Array3d::Constant(1.0 / 3 + overlap), white_sigma);
  const double of_light = like_lamp * of_lamp + white * of_white + any / square(range);
  return std::log(std::max(of_lamp / of_light, 1e-300));
}

std::string colours_not_compared(const std::vector<Lamp>& lamps, const std::vector<Blob>& blobs) {
  const bool any = std::any_of(blobs.begin(), blobs.end(),
                               [](const Blob& blob) { return blob.colour.has_value(); });
  if (any || blobs.empty() || !states_colours(lamps)) return "";
  return "the colours of the lamps were not compared, because the blobs have none: they are "
         "measured in images of three or four channels";
}

ColourTest::ColourTest(const std::vector<Lamp>& lamps) {
  if (!states_colours(lamps)) return;
  for (const Lamp& lamp : lamps) {
    const auto known = std::find_if(kinds_.begin(), kinds_.end(), [&](const Lamp& other) {
      return other.colour == lamp.colour && other.colour_sigma == lamp.colour_sigma;
    });
    kind_of_.push_back(static_cast<int>(known - kinds_.begin()));
    if (known != kinds_.end()) continue;
    Lamp kind;
    kind.colour = lamp.colour;
    kind.colour_sigma = lamp.colour_sigma;
    kinds_.push_back(kind);
  }
}

bool ColourTest::contradicts(int lamp, const Blob& blob) const {
  if (!is_active()) return false;
  const int kind = kind_of_[static_cast<std::size_t>(lamp)];
  return contradicts_colour(kinds_[static_cast<std::size_t>(kind)], blob);
}

double ColourTest::log_ratio(int lamp, const Blob& blob) const {
  if (!is_active()) return 0;
  const int kind = kind_of_[static_cast<std::size_t>(lamp)];
  return log_colour_ratio(kinds_[static_cast<std::size_t>(kind)], blob);
}

bool ColourTest::contradicts_all(const Blob& blob) const {
  return is_active() && std::all_of(kinds_.begin(), kinds_.end(), [&](const Lamp& lamp) {
           return contradicts_colour(lamp, blob);
         });
}

}  // namespace occ::internal::scene
