// SPDX-License-Identifier: Apache-2.0
// Joins the blobs of one lamp over the frames of a sequence. A Kalman filter of constant velocity
// per lamp predicts where its blob must be; blobs go to the nearest prediction within a gate that
// follows from both covariances. A lamp that is dark for some frames, or frames that are missing,
// widen the gate; lamps dark for longer than max_gap_s begin a new track.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"

namespace occ {

struct LIBOCC_API TrackOptions {
  double gate_sigma = 4;            ///< a blob this far from its prediction is another lamp's
  double position_sigma_px = 1.0;   ///< beside a blob's own: a blinking lamp is seen in part
  double speed_sigma_px_s = 100;    ///< of a new track, whose velocity is unknown
  double acceleration_px_s2 = 200;  ///< standard deviation, white over time
  double max_gap_s = 2;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct FrameBlobs {
  double time_s = 0;
  std::vector<Blob> blobs;
};

/// Where a lamp is in one frame.
struct TrackPoint {
  int frame = 0;
  std::optional<int> blob;  ///< of the frame; none: where it must be, from the frames around
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

struct Track {
  std::vector<TrackPoint> points;  ///< of every frame, in their order
  int seen = 0;                    ///< frames that have a blob of it
};

/// Tracks in the order in which they begin, then of their blobs; none for no blobs. Before its
/// first and after its last blob a lamp moves on with its velocity there. Throws
/// std::invalid_argument naming the frame whose time is not after that of the one before.
LIBOCC_API std::vector<Track> track_blobs(const std::vector<FrameBlobs>& frames,
                                          const TrackOptions& options = {});

/// Throws as track_blobs() does.
LIBOCC_API void require_in_order(const std::vector<double>& times_s);

}  // namespace occ
