// SPDX-License-Identifier: Apache-2.0
// From AprilTags in images, and nothing else known but their size and about what camera it was, to
// a network that can be adjusted: where the cameras stood and where the tags hang, in the frame of
// the first camera.
//
// 1. Each tag alone gives the camera's pose from it, or two (resection.hpp).
// 2. Two images that share many tags: each shared tag gives a relative pose; the one that brings
//    most of the others to where they were seen is it.
// 3. The tags that they share hang where that fits best; then the image that sees most of the tags
//    hung so far comes next, by resection, and hangs more, until none is left.
// 4. All images and all tags are fitted to one another twice more.
//
// Once it is adjusted, corners measured again with the camera found (side_bends.hpp), and the same
// from the start, are twice as good.
//
// A tag whose size fits those of the others by no means gets a size of its own (`scale_free`).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/network/network.hpp"

namespace occ {

struct TagImage {
  std::string name;
  int camera = 0;
  std::vector<AprilTag> tags;
};

struct LIBOCC_API StartOptions {
  double tag_size_m = 0;                ///< side of the black square
  std::map<int, double> other_sizes_m;  ///< of those tags (by id) that have another
  double size_tolerance = 0.1;          ///< a tag more than this part off the others is wrong
  std::vector<int> free_sizes;          ///< ids of tags whose size is only about known

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct WrongSize {
  int tag = 0;
  double size_m = 0;  ///< as the others' sizes have it
};

struct NetworkStart {
  Network network;  ///< images and targets of the largest block only
  /// Names of images that are bound together by what they share, largest block first.
  std::vector<std::vector<std::string>> blocks;
  std::vector<WrongSize> wrong_sizes;
  std::vector<std::string> warnings;  ///< what was left out and why
};

/// Bodies are named "tag 7". Status: ok; too_few_lamps: fewer than two images, or none that share a
/// tag; degenerate: the images fall into blocks that share nothing (the message names them; the
/// largest is in the value) or images have no pose. Tags that only one image sees are left out. An
/// id seen twice in an image is left out of it, unless the image repeats itself and it is the same
/// tag. Throws std::invalid_argument for a bad camera index or options.
LIBOCC_API Result<NetworkStart> start_network(const std::vector<NetworkCamera>& cameras,
                                              const std::vector<TagImage>& images,
                                              const StartOptions& options);

}  // namespace occ
