// SPDX-License-Identifier: Apache-2.0
// A camera's way through the lamps, image by image. The filter predicts where the camera is; lamps
// are looked for where that puts them in the image, and what they say of the pose corrects the
// filter, however few they are. Where they are not found there, the whole image is searched, and
// what the search finds is believed at once when the prediction allows it, else when several images
// in a row agree: a kidnapped camera is found again, and the jump is said.
//
//   searching   no pose yet                         tracking   the image's lamps hold the pose
//   coasting    no lamp fits: the pose is predicted     lost   too long or too far: no pose
//
// An image's pose is that at its time, when its first line began its exposure; each lamp is taken
// at the time of the lines that see it (rolling shutter), the camera's motion being the filter's.
#pragma once

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

enum class TrackerState { searching, tracking, coasting, lost };

LIBOCC_API const char* to_string(TrackerState state);

struct LIBOCC_API TrackerOptions {
  /// How lamps are detected and named and the pose is refined: by Rung::centres four times as fast
  /// as by Rung::rims, at twice the error (tools/bench/tracker_bench). Its prior is what is known
  /// of the camera before the first image; height and gravity are taken to hold for ever.
  LocateOptions locate;
  PoseFilterOptions filter;                  ///< of a body that moves in space
  std::optional<PlanarFilterOptions> floor;  ///< instead: of a vehicle on a floor
  bool windows = true;          ///< look for lamps where they are expected, not in the whole image
  double gate_sigma = 4;        ///< a lamp and a blob agree within this
  double model_sigma_px = 0.5;  ///< error of camera and map, added to that gate
  double coast_s = 1;           ///< without lamps the prediction is believed so long,
  double coast_sigma_m = 0.5;   ///< and as long as the position's sigma is smaller
  /// How far off the prediction may be when odometry or a clock errs: among poses that explain an
  /// image (a square of equal lamps has four) the one within this is taken.
  double drift_sigma_m = 0.3, drift_sigma_rad = 0.2;
  int confirmations = 3;  ///< images in a row that must agree on a pose which was not predicted

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct TrackedFrame {
  double time_s = 0;
  int camera = 0;
  TrackerState state = TrackerState::searching;
  std::string reason;     ///< one sentence; empty while all is as expected
  Rigid3 cam_from_world;  ///< of no meaning while searching or lost
  Matrix6 covariance = unknown_covariance<6>();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of the camera in the world
  Eigen::Matrix3d position_covariance_m2 = unknown_covariance<3>();
  std::map<int, Blob> lamps;  ///< lamp id -> blob, of those that the pose was made of
  std::vector<int> missing;   ///< ids of lamps that should be in view and were not found
  bool full_search = false;   ///< the whole image was searched
  bool relocated = false;     ///< the pose has jumped to where it was not expected
  double nis = 0;             ///< normalised innovation squared of the lamps
  int nis_dof = 0;
  Timing timing_s;
};

/// Where and when an image was taken.
struct FrameSource {
  int camera = 0;                       ///< as add_camera() numbered it
  std::optional<Rigid3> cam_from_body;  ///< of a camera that pans or tilts: how it stood then
};

class LIBOCC_API Tracker {
 public:
  /// Throws std::invalid_argument when the scene or the options do not validate.
  explicit Tracker(const Scene& scene, const TrackerOptions& options = {},
                   const Rigid3& cam_from_body = {});
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  /// A second camera on the same body: its scene differs by camera, sensor and lens. Returns its
  /// number.
  int add_camera(const Scene& scene, const Rigid3& cam_from_body);

  /// Begins at a known pose instead of by a search.
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);

  /// Images of one camera come in the order of their times; one that does not is left out and
  /// said, unless five in a row show that the clock was set back: then the tracker begins anew at
  /// the last pose. Between cameras images may be late, as the filter's history allows. Throws
  /// std::invalid_argument for an image that is not of the camera's size, a time that is not
  /// finite, or a camera that there is not.
  TrackedFrame add_image(const ImageView& image, double time_s, const FrameSource& source = {});

  /// Odometry of a body in space; of a vehicle on a floor; inertial samples. Throw as the filters
  /// do, and std::logic_error for odometry of the other kind.
  FilterUpdate add(const Odometry& step);
  FilterUpdate add(const PlanarOdometry& step);
  FilterUpdate add(const ImuSample& sample);

  TrackerState state() const;

  /// Nothing while there is no pose. Predicted to a time.
  std::optional<PosePrediction> predict(double time_s) const;
  /// The same on the floor; nothing for a body in space.
  std::optional<PlanarEstimate> planar(double time_s) const;

 private:
  std::unique_ptr<internal::track::TrackerImpl> impl_;
};

}  // namespace occ
