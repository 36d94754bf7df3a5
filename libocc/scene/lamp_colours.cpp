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

bool ColourTest::contradicts_all(const Blob& blob) const {
  return is_active() && std::all_of(kinds_.begin(), kinds_.end(), [&](const Lamp& lamp) {
           return contradicts_colour(lamp, blob);
         });
}

}  // namespace occ::internal::scene
