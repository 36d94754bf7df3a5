// SPDX-License-Identifier: Apache-2.0
// Finds lamps in an image.
//
// One pass over the image joins runs of pixels above a local threshold (background plus a multiple
// of the noise) to connected components and sums their grey-level moments. Each component is then
// measured with sub-pixel accuracy: the rim of a disc, the centre of a spot, or the blink frequency
// of a lamp that a rolling shutter shows as stripes. The defaults need no tuning.
//
// A lamp of a saturated colour c is found in a difference of the channels of linear light, w . L
// with w ~ c - mean(c). White light does not change it, since w . (1, 1, 1) = 0. The response of
// the channels is the sensor's: 8-bit images are sRGB unless Sensor::response says otherwise.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ {

/// Options of detect(); the defaults suit lamps on a dark background.
struct LIBOCC_API DetectOptions {
  double threshold_sigma = 5;          ///< threshold above the local background, in sigmas of the
                                       ///< noise; 5: about one false pixel in 3e6
  std::optional<double> threshold_dn;  ///< absolute threshold instead of the noise-based one
  int min_area_px = 4;                 ///< smaller components are noise or hot pixels
  int max_blobs = 4096;  ///< only the brightest are kept, which bounds the time on a starry image
  bool dark = false;  ///< detect regions darker than their surroundings, e.g. printed discs; grey
                      ///< levels are then measured down from white; allowed without a sensor only
  bool rims = true;   ///< measure sub-pixel rims of discs (takes most of the time)
  bool polygons = true;  ///< with `rims`: also those of lamps with straight sides. Without, such
                         ///< lamps count as merged discs
  bool discs = true;  ///< lamps may be discs: with `rims`, one that is hidden in part is measured
                      ///< by its visible rim, or else its centre is uncertain accordingly
  /// With `rims`: also measure outlines of any other shape (Blob::free_form), such as Lame curves.
  /// The blob of several lamps that touch may have one, too, so locate() does so only for scenes
  /// with lamps of such shapes. Without, they are known by their centres.
  bool free_forms = false;
  /// With `free_forms`: an outline with a hollow, as of an L, is that of one lamp, not of several
  /// that touch (Blob::merged).
  bool hollows = false;
  /// Join the bright parts of lamps such as pairs of tubes, louvred panels and frames of light
  /// (Blob::patterned). Separate lamps whose gaps are below a fifth of their length are joined as
  /// well, so locate() tries it only if a scene with straight sides is not located without.
  bool patterned = false;
  /// Sensor, when known: noise model (gain, read noise, black level), full scale, response, PSF,
  /// row time and readout direction. Without it, noise is estimated from the image and stripes are
  /// not joined.
  std::optional<Sensor> sensor;
  /// Join rolling-shutter stripes and measure frequencies; needs sensor->row_time_s > 0. Default:
  /// true if the row time is positive.
  std::optional<bool> stripes;
  /// Colours of the lamps to be found in an image of three or four channels: response of red, green
  /// and blue (any positive scale). A saturated colour is searched in a colour difference, where
  /// white lights and grey walls vanish even if they touch the lamp; levels are then those of
  /// linear light, scaled as for a lamp of this colour in grey. Other colours, and an empty list,
  /// are searched in grey. Ignored for a grey image. locate() sets it from the scene.
  std::vector<Eigen::Vector3d> colours;
  double max_frequency_hz = 20000;  ///< highest frequency searched; also limited to the first null
                                    ///< of the exposure, 1 / exposure_s

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Returns the blobs by decreasing flux; an empty list is not an error. Throws
/// std::invalid_argument for an invalid view or option. Time: about 0.1 ms for a 1280 x 960 image
/// with 20 spots.
LIBOCC_API std::vector<Blob> detect(const ImageView& image, const DetectOptions& options = {});

}  // namespace occ
