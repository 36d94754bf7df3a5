// SPDX-License-Identifier: Apache-2.0
// Tracks a camera from image to image.
//
// A filter predicts the pose. Lamps are detected in windows around their predicted images, and
// correct the filter, even a single one. If no lamp is found there, the whole image is searched. A
// pose found by the search is accepted at once if it is inside the gate of the prediction,
// otherwise after several consecutive images agree on it: a camera that was moved by hand
// (kidnapping) is relocalised, and the jump is reported.
//
// A blob in the gate of a lamp is compared with the lamp in the images before, at most `coast_s`
// ago: below an eighth of its contrast (brightest pixel above the background), or above sixteen
// times its area, it is something else, such as a step of the background behind a dark lamp. The
// limits leave room for changes of distance, angle and power. They follow the median ratio of three
// or more lamps (exposure) and the motion during the exposure. Lamps that blink are not compared,
// nor are blobs that the image border cuts.
//
//   searching   no pose yet                        tracking   the lamps of the image fix the pose
//   coasting    no lamp fits, the pose is predicted    lost   prediction too old or too uncertain
//
// The pose of an image holds at the time of the image, when the exposure of its first line begins.
// With a rolling shutter, each lamp is evaluated at the time of the lines that show it; the
// camera's motion is that of the filter.
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"

namespace occ {

namespace internal::track {
class TrackerImpl;
}

/// States of a tracker.
enum class TrackerState {
  searching,  ///< no pose yet; whole images are searched
  tracking,   ///< the lamps of the image determine the pose
  coasting,   ///< no lamp fits; the pose is predicted
  lost,       ///< the prediction is too old or too uncertain
};

/// The enumerator's name, e.g. "tracking".
LIBOCC_API const char* to_string(TrackerState state);

/// Options of a Tracker.
struct LIBOCC_API TrackerOptions {
  /// Options of detection, identification and refinement. Rung::centres is four times as fast as
  /// Rung::rims, at twice the error (tools/bench/tracker_bench). The prior describes the camera
  /// before the first image; its height and gravity are used for all images.
  LocateOptions locate;
  PoseFilterOptions filter;                  ///< filter of a body that moves in space
  std::optional<PlanarFilterOptions> floor;  ///< filter of a vehicle on a floor, used instead
  bool windows = true;          ///< detect lamps around their predictions, not in the whole image
  double gate_sigma = 4;        ///< gate between a predicted lamp and a blob
  double model_sigma_px = 0.5;  ///< error of camera and map, added to that gate
  double coast_s = 1;           ///< maximum time without lamps for which the prediction is used
  double coast_sigma_m = 0.5;   ///< maximum standard deviation of its position
  /// Error of the prediction if odometry or a clock fails. Among several poses that explain an
  /// image (a square of equal lamps has four) the full search prefers those within it.
  double drift_sigma_m = 0.3, drift_sigma_rad = 0.2;
  /// Constant error of each camera's mount: rotation about each axis of the camera, and shift along
  /// it. Like stated errors of map and camera it does not average away: the covariance contains it
  /// after any number of images (consider parameters). 0: exact.
  double mount_sigma_rad = 0, mount_sigma_m = 0;
  double clock_sigma_s = 0;  ///< constant error of the times of all images
  int confirmations = 3;  ///< consecutive images that must agree on a pose outside the prediction
  /// Limit of the protection level of the body's position. If set, the level is computed although
  /// lamps may be faulty (LocateOptions::lamp_fault_probability), and a level beyond the limit is
  /// reported.
  std::optional<double> alert_limit_m;
  /// Probability, for each image, that the error exceeds the protection level undetected.
  double integrity_risk = 1e-7;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Result of one image.
struct TrackedFrame {
  double time_s = 0;                             ///< time of the image
  int camera = 0;                                ///< number of the camera
  TrackerState state = TrackerState::searching;  ///< state after the image
  std::string reason;                            ///< sentence on what was unexpected; else empty
  Rigid3 cam_from_world;                         ///< undefined while searching or lost
  /// Covariance of cam_from_world, see geometry/rigid.hpp.
  Matrix6 covariance = unknown_covariance<6>();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< camera in the world
  /// Covariance of position_m, world axes.
  Eigen::Matrix3d position_covariance_m2 = unknown_covariance<3>();
  std::map<int, Blob> lamps;  ///< lamp id -> blob, for the lamps that the pose was computed from
  std::vector<int> missing;   ///< ids of lamps that should be in view and were not found
  bool full_search = false;   ///< the whole image was searched
  bool relocated = false;     ///< the pose jumped out of the gate of its prediction
  double nis = 0;             ///< normalised innovation squared of the lamps
  int nis_dof = 0;            ///< degrees of freedom of `nis`; 0 without lamps
  /// Horizontal protection level of the body; infinite without TrackerOptions::alert_limit_m, and
  /// with too few lamps. See Tracker::protection_level_m().
  double protection_level_m = std::numeric_limits<double>::infinity();
  Timing timing_s;  ///< time of each step
};

/// Source of an image.
struct FrameSource {
  int camera = 0;                       ///< number returned by add_camera()
  std::optional<Rigid3> cam_from_body;  ///< mount at the time of the image, if it pans or tilts
};

/// Tracks the pose of a camera, or of a body with several cameras.
class LIBOCC_API Tracker {
 public:
  /// Throws std::invalid_argument when the scene or the options do not validate.
  explicit Tracker(const Scene& scene, const TrackerOptions& options = {},
                   const Rigid3& cam_from_body = {});
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  /// Adds a camera on the same body; its scene differs by camera, sensor and lens. Returns its
  /// number.
  int add_camera(const Scene& scene, const Rigid3& cam_from_body);

  /// Starts at a known pose instead of a search.
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);

  /// Adds an image and returns the pose at its time. Times of one camera must increase. An image
  /// with an earlier time is skipped and reported; after five of them in a row the clock has been
  /// set back, and the tracker restarts at the last pose. Images of different cameras may be late
  /// by the history of the filter. Throws std::invalid_argument for an image that does not have the
  /// camera's size, a time that is not finite, or an unknown camera.
  TrackedFrame add_image(const ImageView& image, double time_s, const FrameSource& source = {});

  /// Add odometry of a body in space, odometry of a vehicle on a floor, or an inertial sample. They
  /// throw like the filters, and std::logic_error for odometry of the other kind.
  FilterUpdate add(const Odometry& step);
  /// Adds odometry of a vehicle; needs TrackerOptions::floor.
  FilterUpdate add(const PlanarOdometry& step);
  /// Adds an inertial sample along the axes of the body.
  FilterUpdate add(const ImuSample& sample);

  /// State after the last image.
  TrackerState state() const;

  /// Returns the pose predicted to a time; nullopt while searching or lost.
  std::optional<PosePrediction> predict(double time_s) const;
  /// Like predict(), for a vehicle on a floor; nullopt for a body in space.
  std::optional<PlanarEstimate> planar(double time_s) const;

  /// Bounds the horizontal error of the body's predicted position: |x - x_i| + L + H d + k s, with
  /// the level L of position and H of heading of the best of the last images alone, evaluated at
  /// x_i, and the distance d and standard deviation s of the odometry since then, k = sqrt(-2 ln
  /// risk). Levels are those of refine/separation.hpp. Infinite without alert_limit_m, without a
  /// pose, and for a body in space at other times than that of the last image.
  double protection_level_m(double time_s) const;

 private:
  std::unique_ptr<internal::track::TrackerImpl> impl_;
};

}  // namespace occ
