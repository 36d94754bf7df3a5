// SPDX-License-Identifier: Apache-2.0
// Internal: an image of colour differences, in which lamps of one saturated colour are bright and
// white light is dark.
//
// With L the linear light of a pixel's channels [DN] and c the lamps' colour,
//     D = max(0, w . L),   w = g (c - m) / |c - m|^2,   m = mean(c),   g = (c_0 + 2 c_1 + c_2) / 4.
// White light L = (l, l, l) gives 0; a lamp L = l c gives g l, its grey level. Blobs are measured
// in this image.
//
// Tinted walls and lights of another white balance have some of the colour, too. Components are
// therefore searched in a second image. With L = a c + b (1, 1, 1) + rest, D = g a, it is
//     S = max(0, D - min_purity g b),   b = mean(L) - a m,
// which is positive if the colour exceeds a part of the white light of the pixel. The light of a
// lamp alone has S = D. The edge of a lamp in front of a white one is displaced in S, but not in D.
//
// In S, pixels far dimmer than the brightest one nearby are set to 0: in linear light, a lamp's
// reflection on a wall would otherwise join it with others.
//
// A lamp that is clipped in all channels looks white. Nearly white pixels that light of the colour
// surrounds get the level at which a lamp of this colour begins to be clipped.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

/// Lamps that are searched in one pass.
struct ColourGroup {
  Eigen::Vector3d share;   ///< mean of the lamps' channel shares; sum 1
  bool saturated = false;  ///< far enough from white for a colour difference
};

/// Groups colours that are alike; unsaturated colours form one group. Each colour has a positive
/// sum and no negative channel.
std::vector<ColourGroup> group_colours(const std::vector<Eigen::Vector3d>& colours);

/// Distance of two colours: largest difference of ln of a channel ratio.
double colour_distance(const Eigen::Vector3d& share, const Eigen::Vector3d& other);

/// Blobs of one pass.
struct PassBlobs {
  Eigen::Vector3d share;  ///< mean of the pass's lamps
  std::vector<Blob> blobs;
};

/// Joins the blobs of all passes. Two passes found the same region if its boxes agree; the blob
/// whose colour is closer to that of its pass remains.
std::vector<Blob> without_duplicates(std::vector<PassBlobs> passes);

class ColourDifference {
 public:
  /// `linear` is of the same image, which has three or four channels. `sensor` may be null.
  ColourDifference(const ImageView& image, const LinearImage& linear, const Eigen::Vector3d& share,
                   const Sensor* sensor);

  ImageView view() const { return image_.view(); }        ///< D, 16 bits
  ImageView search_view() const { return pure_.view(); }  ///< S, 16 bits
  double levels_per_dn() const { return scale_; }         ///< levels of D and S per linear DN
  double min_noise() const {
    return min_noise_;
  }  ///< noise of dark pixels by quantisation [levels]
  /// Noise model and full scale of view(); the rest is the given sensor's.
  const std::optional<Sensor>& sensor() const { return sensor_; }

  /// True if the blob's light above its surroundings has the colour, or no colour because all
  /// channels are clipped. False for the coloured edges of other lights.
  bool has_colour(const Blob& blob) const;

  /// Removes components of S that are faint, as reflections of lamps are, or within the noise of D
  /// around them. Replaces values: saturated pixels by those of the given image, background and
  /// noise by those of D around the component.
  void describe(const ThresholdRule& rule, std::vector<Component>& components) const;

 private:
  void project(const Eigen::Vector3d& weights, const Eigen::Vector3d& pure_weights,
               const LinearImage& linear);
  void fill_clipped(std::uint16_t level);
  void remove_dim_surroundings();
  void measure_background(Component& component) const;

  Eigen::Vector3d purity_;  ///< weights of the shares of a colour in S
  ImageView original_;
  double clipped_from_dn_;
  Image image_, pure_;
  double scale_ = 1, min_noise_ = 0;
  std::optional<Sensor> sensor_;
  std::vector<std::size_t> white_;  ///< indices of nearly white pixels
};

}  // namespace occ::internal::detect
