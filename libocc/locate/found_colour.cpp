// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/found_colour.hpp"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "libocc/scene/internal/lamp_colours.hpp"

namespace occ::internal::locate {
namespace {

bool is_clipped(const BlobColour& colour) {
  return std::any_of(colour.clipped.begin(), colour.clipped.end(), [](bool c) { return c; });
}

/// Flux times mean level, which is larger for lamps than for the coloured surfaces they light.
double brightness(const Blob& blob) { return blob.flux_dn * blob.flux_dn / blob.area_px; }

struct Group {
  Lamp like;  ///< a lamp of the colour of the brightest blob
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double brightness = 0;
};

}  // namespace

std::optional<Eigen::Vector3d> saturated_colour(const ImageView& image, DetectOptions options) {
  // White light from 2700 to 7000 K has ratios of red to blue within a factor of four.
  constexpr double min_saturation = 5;  // largest over smallest share
  constexpr double other_share = 0.1;   // of a primary colour
  if (image.channels < 3) return std::nullopt;
  options.rims = false;
  std::vector<Blob> coloured;
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::Vector3d primary = Eigen::Vector3d::Constant(other_share);
    primary[channel] = 1;
    options.colours = {primary};
    for (Blob& blob : detect(image, options)) {
      if (!blob.colour) continue;
      int strongest = 0;
      const double share = blob.colour->share.maxCoeff(&strongest);
      if (strongest == channel && share > min_saturation * blob.colour->share.minCoeff())
        coloured.push_back(std::move(blob));
    }
  }
  std::stable_sort(coloured.begin(), coloured.end(),
                   [](const Blob& a, const Blob& b) { return brightness(a) > brightness(b); });
  std::vector<Group> groups;
  for (const Blob& blob : coloured) {
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
      return !scene::contradicts_colour(g.like, blob);
    });
    if (group == groups.end()) {
      group = groups.emplace(groups.end());
      group->like.colour = blob.colour->share.cwiseMax(0);
    }
    // The share of a clipped channel is a lower bound.
    if (!is_clipped(*blob.colour)) group->sum += blob.area_px * blob.colour->share.cwiseMax(0);
    group->brightness += brightness(blob);
  }
  const auto best =
      std::max_element(groups.begin(), groups.end(),
                       [](const Group& a, const Group& b) { return a.brightness < b.brightness; });
  if (best == groups.end()) return std::nullopt;
  const Eigen::Vector3d colour = best->sum.isZero() ? best->like.colour : best->sum;
  return colour / colour.maxCoeff();
}

std::string text_of_found_colour(const Eigen::Vector3d& colour) {
  std::ostringstream text;
  text.precision(2);
  text << "the scene states no colours: lamps with red, green and blue of " << colour.transpose()
       << " in the image were taken for them";
  return text.str();
}

}  // namespace occ::internal::locate
