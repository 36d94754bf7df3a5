// SPDX-License-Identifier: Apache-2.0
// Which lamps a predicted pose puts where in the image, and which blobs they are.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/detect_windows.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::track {

/// A camera's motion about the time of its image.
struct PredictedCamera {
  double after_s = 0;  ///< that the first line began its exposure
  Rigid3 cam_from_world;
  Matrix6 covariance = Matrix6::Zero();
  Vector6 velocity = Vector6::Zero();
  Matrix6 velocity_covariance = Matrix6::Zero();
};

struct ExpectedLamp {
  int lamp = 0;  ///< index
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();  ///< model's error included
  double radius_px = 0;
  double lines_px = 0;  ///< extent of its image across the lines of a rolling shutter
  bool sure = false;    ///< whole, well inside the image, not seen too obliquely, and not dark
  bool dark = false;    ///< it may be, on all of its lines
  bool cut = false;     ///< it may blink while its lines are exposed: some show it, some do not
};

/// Lamps whose image may reach into the picture.
std::vector<ExpectedLamp> expected_lamps(const Scene& scene, const PredictedCamera& predicted,
                                         double gate_sigma, double model_sigma_px);

/// Where they must be, with room for the background about them.
std::vector<PixelWindow> windows_of(const std::vector<ExpectedLamp>& expected, double gate_sigma);

/// One blob for each lamp within the gate, the nearest pairs first; a lamp that might be either of
/// two blobs has none.
std::vector<Match> match_expected(const std::vector<ExpectedLamp>& expected,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  double gate_sigma);

/// From when the first line begins its exposure to the middle of that of the line at a pixel.
double readout_delay_s(const Sensor& sensor, const Eigen::Vector2d& px);

/// Mean of that over the matched blobs.
double mean_delay_s(const Sensor& sensor, const std::vector<Match>& matches,
                    const std::vector<Blob>& blobs);

/// Moves each matched blob from where it was seen to where it would have been seen at the
/// prediction's time; what the velocity's error makes of that is added to its covariances.
void to_time_of(const PredictedCamera& predicted, const Scene& scene,
                const std::vector<Match>& matches, std::vector<Blob>& blobs);

}  // namespace occ::internal::track
