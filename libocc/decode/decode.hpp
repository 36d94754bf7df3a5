// SPDX-License-Identifier: Apache-2.0
// Decodes the ids that blinking lamps transmit, from the frames of an image sequence.
//
// Blobs are detected in the pixel-wise maximum of several frames, because a lamp may be dark or
// striped in any single frame. They are joined to tracks (track_blobs.hpp), the light along each
// track is sampled (lamp_rows.hpp), and the samples are decoded (codes/decode_samples.hpp).
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

/// One image of a sequence.
struct SequenceFrame {
  ImageView image;    ///< not copied: must outlive the call
  double time_s = 0;  ///< start of the exposure of its first line
};

/// Options of decode_lamps().
struct LIBOCC_API DecodeOptions {
  Code code;  ///< code of all lamps in the sequence
  /// Blobs are detected in the maximum of so many frames, centred on each frame (1, 3, 5, ...);
  /// 0: maximum of all frames, for a camera that does not move.
  int join_frames = 15;
  int min_seen = 2;      ///< min number of frames in which a lamp has a blob
  int max_lamps = 64;    ///< limit for the brightest blobs per frame and for the tracks with the
                         ///< most blobs; bounds the time
  DetectOptions detect;  ///< its fields `sensor` and `stripes` are ignored
  TrackOptions track;    ///< joining of blobs over the frames
  DecodeSamplesOptions samples;  ///< decoding of each lamp's samples

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A blinking lamp of the sequence with its decoded id.
struct DecodedLamp {
  Track track;  ///< position in every frame
  /// Blob in the maximum of the frames joined around `frame`. For a moving camera (join_frames > 0)
  /// it is at the position of the track and has no rim.
  Blob blob;
  int frame = 0;                 ///< last frame with as many joined frames after as before it
  DecodedCode code;              ///< id, or the reason why there is none
  CodeBudget budget;             ///< for the lamp's largest image
  std::optional<int> reference;  ///< s2psk: index of the reference lamp
};

/// Returns one entry for each track, in the order of their first blobs. Status: ok; no_lamps (no
/// track in any frame). Throws std::invalid_argument if there are no frames, if their sizes or
/// types differ, if their times do not increase (naming the frame), or for invalid options.
LIBOCC_API Result<std::vector<DecodedLamp>> decode_lamps(const std::vector<SequenceFrame>& frames,
                                                         const Sensor& sensor,
                                                         const DecodeOptions& options = {});

/// Returns the lamps' blobs with lamp_id set to the lamp of the map that transmits the decoded id.
/// If noise splits a lamp into several blobs, only the brightest gets the lamp_id. No lamp_id is
/// set for an id that was read at two places (one may be a mirror image) or that the map does not
/// contain; `message` reports these. Throws std::invalid_argument if two lamps of the map transmit
/// the same id.
LIBOCC_API Result<std::vector<Blob>> identified_blobs(const std::vector<DecodedLamp>& lamps,
                                                      const Scene& map, const Code& code);

}  // namespace occ
