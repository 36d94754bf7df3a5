// SPDX-License-Identifier: Apache-2.0
// Predicts the images of lamps from a predicted pose, and assigns blobs to them.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/detect_windows.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::track {

/// Predicted pose and velocity of a camera near the time of its image.
struct PredictedCamera {
  double after_s = 0;  ///< time of the pose after the exposure of the first line began
  Rigid3 cam_from_world;
  Matrix6 covariance = Matrix6::Zero();
  Vector6 velocity = Vector6::Zero();
  Matrix6 velocity_covariance = Matrix6::Zero();
};

/// Brightness and size of a lamp's blob in an image.
struct LampLook {
  double time_s = 0;
  double contrast_dn = 0;  ///< brightest pixel above the background
  double area_px = 0;
};

struct ExpectedLamp {
  int lamp = 0;  ///< index in the scene
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();  ///< with the error of the model
  double radius_px = 0;
  double lines_px = 0;  ///< extent of its image across the lines of a rolling shutter
  bool sure = false;    ///< must be detected: wholly inside the image, not oblique, not dark
  bool dark = false;    ///< all of its lines may be dark, because it blinks
  bool cut = false;     ///< some of its lines may be dark, because it blinks while they are exposed
  double smear_px = 0;  ///< motion of its image during the exposure
  std::optional<LampLook> before;  ///< measured in the images before
};

LIBOCC_API LampLook look_of(const Blob& blob, double time_s);

/// Predicts all lamps whose image may overlap the picture.
LIBOCC_API std::vector<ExpectedLamp> expected_lamps(const Scene& scene,
                                                    const PredictedCamera& predicted,
                                                    double gate_sigma, double model_sigma_px);

/// Returns the windows that contain the lamps within the gate, with a margin of background, clipped
/// to the image. A lamp near the camera's image plane has an unlimited gate.
LIBOCC_API std::vector<PixelWindow> windows_of(const std::vector<ExpectedLamp>& expected,
                                               const Camera& camera, double gate_sigma);

/// Deletes the references `before` of lamps that may have changed for a good reason: those that
/// blink. The contrast of all others is scaled by the median ratio of the blobs in the gates, if at
/// least three lamps have one: a camera that changes its exposure changes all lamps.
LIBOCC_API void adapt_looks(std::vector<ExpectedLamp>& expected, const std::vector<Blob>& blobs,
                            const Scene& scene, double gate_sigma);

/// Assigns at most one blob to each lamp, nearest pairs first, within the gate. A lamp with two
/// similarly near blobs stays unassigned. A blob is compared with the lamp in the images before, if
/// `before` is set: it must have an eighth of its contrast, or less if its image is smeared, and at
/// most sixteen times its area. A blob that the border cuts or that is larger because it saturates
/// is not rejected.
LIBOCC_API std::vector<Match> match_expected(const std::vector<ExpectedLamp>& expected,
                                             const std::vector<Blob>& blobs, const Scene& scene,
                                             double gate_sigma);

/// Time from the start of the first line's exposure to the middle of the exposure of the line at a
/// pixel.
LIBOCC_API double readout_delay_s(const Sensor& sensor, const Eigen::Vector2d& px);

/// Mean of readout_delay_s over the matched blobs.
LIBOCC_API double mean_delay_s(const Sensor& sensor, const std::vector<Match>& matches,
                               const std::vector<Blob>& blobs);

/// Moves each matched blob to its place at the time of the prediction. The error of the velocity is
/// propagated to the covariances of the blob.
LIBOCC_API void to_time_of(const PredictedCamera& predicted, const Scene& scene,
                           const std::vector<Match>& matches, std::vector<Blob>& blobs);

}  // namespace occ::internal::track
