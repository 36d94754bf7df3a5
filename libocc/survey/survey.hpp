// SPDX-License-Identifier: Apache-2.0
// Map of lamps from pictures of them, without a map and without known poses. One camera
// takes the pictures from unknown places, in any order.
//
// 1. The rim of a lamp gives its direction and its distance in units of the lamp's size, and one
//    picture a constellation of lamps up to scale. For this step only, lamps of the same shape and
//    ratio of the sides count as equally large within `size_spread`; the sizes of different kinds,
//    and of discs of several sizes, follow as if they were in one plane (internal/lamp_kinds.hpp).
// 2. Pictures are joined to the map of the first one by rigid motions of constellations. A picture
//    joins if a match as good is not expected by chance, and if no other motion matches as well
//    (internal/lamp_map.hpp). Other pictures are held back until the map has more lamps. In a
//    recording, a small motion from a neighbour in the map is also evidence, and two lamps suffice.
// 3. All pictures are adjusted together (network/adjust.hpp). The observation of a lamp is the
//    centre of its image, corrected to the projection of the lamp's centre. Sizes and normals
//    follow from the rims.
// 4. Pictures that were held back are matched with the adjusted map, and all are adjusted again.
// 5. In the last adjustments, whole rims of discs and rectangles are observations unless they are
//    over-exposed (internal/observed_rim.hpp): sizes, normals, places and poses are estimated
//    together, with one growth of all rims (NetworkCamera::outline_growth_px).
//
// The camera is known, or some of its parameters are estimated in all adjustments
// (SurveyOptions::calibrate_camera).
//
// Lamps without rims are mapped if tracks of a recording or ids that lamps transmit show which
// blobs are one lamp: the start is then the relative orientation of two pictures with four such
// lamps, and resection and intersection in turn (calibrate/point_starts.hpp). It is also used if
// it places more pictures than the rims do. Each start is adjusted; if two different maps agree
// with the pictures alike, the survey is ambiguous. Ids also exclude matches by rims.
//
// AprilTags link pictures as lamps do (internal/tag_views.hpp): a tag counts as one lamp, whose
// number is known, and a tag and a lamp of the map are enough for a frame whose neighbour is in the
// map. Their corners are observations of bodies, of unknown size unless tag_size_m is given.
//
// World frame: the lamps' mean normal points down (z is up; lamps without rims count with the
// normal of the plane that fits them best); x points from lamp 0 to the lamp farthest from it; the
// lamps' mean x and y, and the lowest camera's z are zero. Pictures do not show the scale: it
// follows from distances, from AprilTags of known size, from a lamp's radius, from odometry, or
// from an inertial measurement unit (internal/inertial_scale.hpp); otherwise it is free, and the
// distance from lamp 0 to the farthest lamp is 1.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ {

/// Detected blobs of one picture.
struct SurveyPicture {
  std::string name;                 ///< label for messages
  std::vector<Blob> blobs;          ///< result of detect()
  std::vector<AprilTag> tags = {};  ///< result of detect_april_tags(): they link pictures
  /// Track of each blob in a recording, or -1; empty: no tracks. Blobs of one track are one lamp.
  std::vector<int> tracks = {};
  std::optional<double> time_s = {};  ///< exposure of the middle row, for row_time_s and imu
  /// Position of the camera by odometry or another source, in any frame with the scale of metres.
  std::optional<Eigen::Vector3d> odometry_m = {};
};

/// Measured distance between the centres of two lamps.
struct LampDistance {
  int from = 0, to = 0;                 ///< ids of the lamps in the result of survey()
  double length_m = 1, sigma_m = 1e-3;  ///< distance and its standard deviation
};

/// Options of survey().
struct LIBOCC_API SurveyOptions {
  /// True if consecutive pictures are neighbours of one motion, such as frames of a video. Motions
  /// between neighbours that exceed max_motion_rad are then excluded, which decides between the
  /// symmetric matches of regular arrangements.
  bool ordered = false;
  /// Median change of the lamps' directions between neighbours. The camera turns by less than four
  /// times this angle, and moves by less than twice this angle times the distance of the nearest
  /// lamp.
  double max_motion_rad = 0.25;
  /// Time between the exposures of two rows (rolling shutter) of `ordered` pictures with times. The
  /// motion between neighbours is assumed to be uniform. 0: all rows at once.
  double row_time_s = 0;
  /// Base-10 logarithm of the number of accidental matches, as good, that is accepted.
  double max_log10_false_alarms = -4;
  /// Relative standard deviation of the differences between the lamps' sizes. Lamps of one type
  /// differ by a percent; the default allows for errors of the rims.
  double size_spread = 0.02;
  /// Standard deviation, per axis, of the error of a lamp's image that its noise does not contain,
  /// such as of the lens or of uneven light: start value, and final value if the redundancy is
  /// below 20. It is otherwise estimated from the residuals. It was up to 0.02 px in rendered and
  /// real pictures.
  double model_sigma_px = 0.02;
  /// Estimates the parameters of the camera whose errors it states along with the map, with their
  /// standard deviations as priors. Correlations are not used, except that errors of both focal
  /// lengths that keep their ratio are one of f_px.
  bool calibrate_camera = false;
  std::vector<LampDistance> distances;  ///< they determine the scale
  std::optional<double> radius_m;       ///< radius of all discs; determines the scale
  double radius_sigma = 0.01;           ///< its relative standard deviation
  std::optional<double> tag_size_m;     ///< side of the tags' black square; determines the scale
  /// Relative standard deviation of the length of a path by odometry. The distances between
  /// consecutive pictures with odometry_m determine the scale if nothing else does.
  double odometry_sigma = 0.01;
  /// Samples of a unit that is fixed to the camera, in the order of their times. They determine the
  /// scale if nothing else does, from pictures with times; the unit's axes and its clock are
  /// estimated (InertialAlignment).
  std::vector<ImuSample> imu;
  int threads = 2;  ///< at least 1; any number gives the same bits

  /// True if no distance, radius or size of tags determines the scale.
  bool scale_is_free() const { return distances.empty() && !radius_m && !tag_size_m; }
  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A lamp of the map.
struct SurveyedLamp {
  /// Position, shape, size, normal with size_sigma and tilt_sigma_rad; relative power; colour;
  /// blink frequency, if it was measured and the lamp transmits no id. The id is its number in the
  /// order in which the pictures show the lamps.
  Lamp lamp;
  int pictures = 0;        ///< number of pictures with an observation
  bool has_power = false;  ///< false: saturated in all pictures; power_w is then 1
  bool has_shape = false;  ///< false: no measured rim; the lamp is a point
  /// Id that it transmits (Blob::lamp_id); nothing if no blob, or contradictory ones, show it.
  std::optional<int> code_id;
};

/// A blob or a picture that is not in the result.
struct SurveyOmission {
  std::string picture;  ///< name of the picture
  int blob = -1;        ///< index of the blob; -1: the whole picture
  std::string reason;   ///< a sentence
};

/// Origin of the scale.
enum class SurveyScale {
  free,       ///< arbitrary
  distances,  ///< SurveyOptions::distances
  radius,     ///< SurveyOptions::radius_m
  tags,       ///< SurveyOptions::tag_size_m
  odometry,   ///< SurveyPicture::odometry_m
  imu,        ///< SurveyOptions::imu
};

/// Alignment of an inertial measurement unit with the map and the camera.
struct InertialAlignment {
  double scale = 1;        ///< metres per unit of the map: 1 in the result of survey()
  double scale_sigma = 0;  ///< its relative standard deviation
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();            ///< direction of gravity in the map
  Eigen::Matrix3d cam_from_imu = Eigen::Matrix3d::Identity();  ///< axes of the unit
  double time_offset_s = 0;  ///< time of the unit's clock minus that of the pictures
  Eigen::Vector3d turn_rate_bias_rad_s = Eigen::Vector3d::Zero();  ///< gyroscope
  /// Pictures from which to the next one the turn contradicts the others, as by a wrong time: the
  /// measurements between them are not used.
  std::vector<int> contradictions;
};

/// Result of survey().
struct Survey {
  Adjustment adjustment;  ///< points are named "lamp 7"; images have the pictures' names
  /// That of the call, or with the estimated parameters and their covariance.
  Camera camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  std::vector<SurveyedLamp> lamps;  ///< in the order of the network's points
  /// Image of the network for each picture; -1: not used.
  std::vector<int> image_of_picture;
  /// Id of the lamp of each blob of each picture; -1: none.
  std::vector<std::vector<int>> lamp_of_blob;
  std::vector<SurveyOmission> omissions;  ///< all that is not used, with the reason
  SurveyScale scale = SurveyScale::free;  ///< origin of the scale
  /// Radius, tags, odometry, imu: relative sigma of the scale by errors that all pictures share,
  /// which the network's precision does not contain.
  double scale_sigma = 0;
  std::optional<InertialAlignment> inertial;  ///< if the scale is that of SurveyOptions::imu
  /// Estimated standard deviation, per axis, of the errors of a lamp's image beyond its noise; that
  /// of the options if the redundancy does not determine it.
  double model_sigma_px = 0;
  std::vector<std::string> warnings;  ///< contradictions that the user should check
};

/// State of a survey.
struct SurveyProgress {
  const char* stage = "";  ///< "joining pictures" or "adjusting"
  int done = 0;            ///< pictures in the map, or iterations of the adjustment
  int total = 0;           ///< number of pictures; 0: unknown
};

/// Return false to stop: the result is then `not_converged`, without a map.
using SurveyCallback = std::function<bool(const SurveyProgress&)>;

/// Surveys lamps. Status: ok; too_few_lamps: fewer than two pictures show four lamps with measured
/// rims (three if they are `ordered`); ambiguous: the lamps' arrangement is symmetric, so that no
/// two pictures have a unique match, or two maps agree with tracks and ids alike; no_pose: no two
/// pictures match; not_converged: `progress` stopped it; otherwise that of adjust(). Throws
/// std::invalid_argument for options out of range, tracks that are not one per blob, a distance
/// whose lamps are not in the map, and an exact camera that is to be calibrated.
LIBOCC_API Result<Survey> survey(const std::vector<SurveyPicture>& pictures, const Camera& camera,
                                 const SurveyOptions& options = {},
                                 const SurveyCallback& progress = {});

}  // namespace occ
