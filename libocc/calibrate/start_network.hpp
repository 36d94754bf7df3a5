// SPDX-License-Identifier: Apache-2.0
// Start values of a network from AprilTags in images: poses of the images and of the tags, in the
// frame of the first image. Given are the tags' size and an approximate camera.
//
// 1. Each tag in each image yields one or two pose hypotheses (resection.hpp).
// 2. A pair of images with many common tags: each common tag yields hypotheses of the relative
// pose.
//    The hypothesis that fits the other common tags best is chosen.
// 3. The tags of this pair are placed. Repeatedly, the image with most placed tags gets its pose by
//    resection, and its tags are placed, until no image is left.
// 4. All images and all tags are fitted alternately, twice.
//
// After the adjustment, corners that are measured again with the calibrated camera (side_bends in
// resection.hpp), followed by a second adjustment, are twice as accurate.
//
// A tag whose size contradicts those of the other tags gets a free scale (`scale_free`).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/network/network.hpp"

namespace occ {

/// Detected tags of one image.
struct TagImage {
  std::string name;            ///< label, used in warnings and in `blocks`
  int camera = 0;              ///< index into the list of cameras
  std::vector<AprilTag> tags;  ///< result of detect_april_tags()
};

/// Options of start_network(); `tag_size_m` must be set.
struct LIBOCC_API StartOptions {
  double tag_size_m = 0;                ///< side of the black square [m]
  std::map<int, double> other_sizes_m;  ///< sizes of tags (by id) that differ from it
  double size_tolerance = 0.1;  ///< relative; a tag that deviates more from the others is wrong
  std::vector<int> free_sizes;  ///< ids of tags whose size is only approximate

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A tag whose size contradicts the other tags.
struct WrongSize {
  int tag = 0;        ///< id of the tag
  double size_m = 0;  ///< estimated with the other tags' sizes
};

/// Start values for adjust(), with notes on what was left out.
struct NetworkStart {
  Network network;  ///< images and targets of the largest block only
  /// Names of the images of each connected block (common tags), largest block first.
  std::vector<std::vector<std::string>> blocks;
  std::vector<WrongSize> wrong_sizes;  ///< tags that got a free scale
  std::vector<std::string> warnings;   ///< elements that were left out, with the reason
};

/// Bodies are named "tag 7". Status: ok; too_few_lamps: fewer than two images, or no two images
/// with a common tag; degenerate: blocks of images without a common tag (the message names them;
/// the value has the largest) or images without a pose. Tags that only one image observes are left
/// out. An id that occurs twice in an image is left out of it, unless a panorama that overlaps
/// itself shows the same tag again. Throws std::invalid_argument for a camera index out of range or
/// invalid options.
LIBOCC_API Result<NetworkStart> start_network(const std::vector<NetworkCamera>& cameras,
                                              const std::vector<TagImage>& images,
                                              const StartOptions& options);

}  // namespace occ
