// SPDX-License-Identifier: Apache-2.0
// Joins the blobs of each lamp over the frames of a sequence. One Kalman filter per lamp (constant
// velocity) predicts the position of its blob. Each blob is assigned to the nearest prediction
// within a gate that follows from both covariances. The gate widens while a lamp is dark or frames
// are missing. A lamp that is dark for longer than max_gap_s starts a new track.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"

namespace occ {

/// Options of track_blobs().
struct LIBOCC_API TrackOptions {
  double gate_sigma = 4;            ///< max distance between blob and prediction [sigma]
  double position_sigma_px = 1.0;   ///< added to a blob's own sigma: only part of a blinking lamp
                                    ///< may be lit
  double speed_sigma_px_s = 100;    ///< initial sigma of each velocity component
  double acceleration_px_s2 = 200;  ///< standard deviation of the white acceleration noise
  double max_gap_s = 2;             ///< max time between two blobs of one track

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Blobs of one frame.
struct FrameBlobs {
  double time_s = 0;        ///< must increase from frame to frame
  std::vector<Blob> blobs;  ///< in any order
};

/// Position of a lamp in one frame.
struct TrackPoint {
  int frame = 0;            ///< index of the frame
  std::optional<int> blob;  ///< index in the frame's blobs; empty: `px` is inter- or extrapolated
  /// Centroid of the blob, or the filter's position without one.
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

/// One lamp over all frames of the sequence.
struct Track {
  std::vector<TrackPoint> points;  ///< one per frame, in their order
  int seen = 0;                    ///< number of frames with a blob
};

/// Returns the tracks, sorted by the frame, then the index of their first blob. Before its first
/// and after its last blob a lamp is extrapolated with its velocity there. Throws
/// std::invalid_argument naming the first frame whose time is not after that of its predecessor.
LIBOCC_API std::vector<Track> track_blobs(const std::vector<FrameBlobs>& frames,
                                          const TrackOptions& options = {});

/// Throws std::invalid_argument unless the times are finite and strictly increasing.
LIBOCC_API void require_in_order(const std::vector<double>& times_s);

}  // namespace occ
