// SPDX-License-Identifier: Apache-2.0
// Which lamps say what: from the frames of a sequence to tracks, samples of light, and ids. A lamp
// is looked for in the brightest of several frames, as in any one it may be dark or show stripes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/codes/budget.hpp"
#include "libocc/codes/code.hpp"
#include "libocc/codes/decode_samples.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/decode/track_blobs.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct SequenceFrame {
  ImageView image;
  double time_s = 0;  ///< when its first line began its exposure
};

struct LIBOCC_API DecodeOptions {
  Code code;
  /// Lamps are looked for in the brightest of so many frames about each; 0: of all frames, for a
  /// camera that stands still.
  int join_frames = 15;
  int min_seen = 2;      ///< frames in which a lamp must show a blob
  int max_lamps = 64;    ///< the brightest of each frame, the most seen of all: bounded time
  DetectOptions detect;  ///< its sensor is the one given; stripes are not read
  TrackOptions track;
  DecodeSamplesOptions samples;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct DecodedLamp {
  Track track;
  /// In the brightest of the frames joined about `frame`. Under a moving camera it has no rim, and
  /// the track's place.
  Blob blob;
  int frame = 0;  ///< the last one that has as many joined frames after as before it
  DecodedCode code;
  CodeBudget budget;             ///< of its largest image
  std::optional<int> reference;  ///< s2psk: which track is its reference
};

/// One for each track, in the order in which they begin. Status: ok; no_lamps (nothing in any
/// frame). Throws std::invalid_argument when frames are none, differ in size or are not in the
/// order of their times (naming the frame), or the options do not validate.
LIBOCC_API Result<std::vector<DecodedLamp>> decode_lamps(const std::vector<SequenceFrame>& frames,
                                                         const Sensor& sensor,
                                                         const DecodeOptions& options = {});

/// The lamps' blobs, with the lamp_id of the map's lamp that says what was read. Of pieces of one
/// lamp the brightest has it. An id that lights in two places say (one may be a mirror image) or
/// that no lamp of the map has names no blob; `message` says so. Throws std::invalid_argument when
/// two lamps of the map say the same.
LIBOCC_API Result<std::vector<Blob>> named_blobs(const std::vector<DecodedLamp>& lamps,
                                                 const Scene& map, const Code& code);

}  // namespace occ
