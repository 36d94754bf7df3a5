// SPDX-License-Identifier: Apache-2.0
// The map while pictures are joined to it (survey.hpp): placement of pictures, the network of all
// placed pictures, and the lamps' shapes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/calibrate/point_starts.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/survey/internal/inertial_scale.hpp"
#include "libocc/survey/internal/known_lengths.hpp"
#include "libocc/survey/internal/lamp_kinds.hpp"
#include "libocc/survey/internal/lamp_links.hpp"
#include "libocc/survey/internal/lamp_map.hpp"
#include "libocc/survey/internal/shape_fit.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// That neighbours show the same lamps is expected; of other pictures it is not (odds of 30).
constexpr double neighbour_log10 = 1.5;

/// Thrown when the callback stops a survey; survey() catches it.
struct SurveyStopped {};

/// Map of the pictures that match each other.
class GrowingMap {
 public:
  GrowingMap(const std::vector<SurveyPicture>& pictures, const Camera& camera,
             const SurveyOptions& options, const SurveyCallback& progress);

  /// True if lamps of one kind have different sizes if they are in one plane.
  bool has_several_sizes(int picture) const;
  /// Starts a new map with the lamps of one picture. Lamps of one kind have one size or,
  /// `by_plane`, several ones.
  void start(int picture, bool by_plane = false);
  /// Starts a new map with known lamps and without a picture.
  void start(const std::vector<MapLamp>& known);
  /// Poses and positions that follow from links alone (free_starts()); points are links.
  std::vector<PointStarts> link_starts() const;
  /// Starts a new map with such poses and positions.
  void start(const PointStarts& starts);
  /// Joins pictures until none of the others has a unique match; returns the number of new ones.
  int join_pictures();
  /// Joins the pictures whose links show four known lamps, after start(const PointStarts&); returns
  /// their number.
  int join_by_links();
  /// Adjusts the placed pictures and the lamps that two of them show; then updates poses,
  /// positions, shapes and covariances of the map. Known lengths are observations if given.
  Result<Adjustment> adjust_all(const KnownLengths& lengths = {});
  /// Adjusts without known lengths and without the pictures that prevent a result; they do not join
  /// again.
  Result<Adjustment> adjust_without_lengths();
  /// Takes rejected image points from their lamps, for reassign(): a track may have changed to
  /// another lamp.
  void release_rejected(const Adjustment& adjusted);
  /// Leaves out lamps without a rim that fewer than three image points determine, so that a wrong
  /// link would not be noticed. Returns their number.
  int drop_unconfirmed(const Adjustment& adjusted);
  /// Estimates the errors beyond the noise from the residuals of an adjustment (variance
  /// component), for the next one; without enough redundancy they are kept.
  void estimate_model_sigma(const Adjustment& adjustment);
  double model_sigma_px() const { return model_sigma_px_; }
  /// Makes the rims of lamps with a shape observations of later adjustments, or their centres
  /// alone.
  void set_rims(bool used) { with_rims_ = used; }
  /// Camera with the parameters of the last adjustment, and their covariance if they are estimated.
  const Camera& camera() const { return camera_; }
  /// Poses of the placed pictures with times, in the order of their times, with the covariances of
  /// the last adjustment; in the frame of that adjustment.
  std::vector<TimedPose> timed_poses() const;
  /// Gives unassigned blobs of placed pictures the adjusted lamp at their place, and joins lamps
  /// that are one. Returns the number of changes.
  int reassign();

  /// Numbers of views with a shape, for the choice of the first picture.
  int views(int picture) const { return static_cast<int>(pictures_[picture].views.size()); }
  /// Number of views that a picture needs: four, or three with a tag.
  int min_views(int picture) const;
  /// Number of views of the first picture: three in a recording, where a neighbour joins it.
  int min_start_views(int picture) const { return options_.ordered ? 3 : min_views(picture); }
  /// Numbers of blobs with a link.
  int linked_blobs(int picture) const;
  /// True if the blobs with a link are on one line, so that they do not determine a pose.
  bool links_are_on_a_line(int picture) const;
  int placed() const { return static_cast<int>(map_.placed.size()); }
  const LampMap& map() const { return map_; }
  /// True if all lamps are on one line, about which only their rims determine the rotation.
  bool is_line() const;
  /// Relative standard deviation of the ratio of two distances, after an adjustment: median over
  /// three lamps each. Nothing for two lamps.
  std::optional<double> ratio_sigma() const;
  /// Lamps that two pictures show, in the order of the pictures: the points of the network.
  const std::vector<int>& order() const { return order_; }
  /// Point of the network for each lamp of the map; -1: fewer than two pictures show it.
  const std::vector<int>& point_of_lamp() const { return point_of_lamp_; }
  /// Fitted shape of each lamp; nothing without a rim or before adjust_all().
  const std::vector<std::optional<Lamp>>& shapes() const { return shapes_; }
  /// Why a picture is not placed, at its last attempt.
  const std::string& reason(int picture) const { return reasons_[picture]; }
  bool is_ambiguous(int picture) const { return ambiguous_[picture]; }
  /// Links that contradict themselves.
  const std::vector<std::string>& link_notes() const { return link_notes_; }
  /// Id that each lamp of the map transmits, as far as a blob shows it.
  std::vector<std::optional<int>> codes_of_lamps() const;
  /// Applies a similarity of the world.
  void transform(const Similarity& similarity);

 private:
  void clear();
  /// Removes the candidates that contradict the ids of views.
  void limit_by_codes(int picture, MatchCandidates& candidates) const;
  /// Removes pictures of which an adjustment rejected so many lamps that fewer than three are left,
  /// or those with the fewest. Returns their number.
  int drop_undetermined(const Result<Adjustment>& failed);
  std::vector<MapMatch> without_fast_motions(int picture, std::vector<MapMatch> matches) const;
  /// Counts it as evidence of a match that all m of its lamps are within an angle a of their
  /// directions in the neighbour. With n lamps in a field of F sr, chance gives (n pi a^2 / F)^m
  /// such matches.
  void count_small_motions(int picture, int neighbour, std::vector<MapMatch>& matches) const;
  void report(const SurveyProgress& state) const;  // throws SurveyStopped
  /// Indices into map_.placed of the pictures before and after one; the first of them, or -1.
  std::vector<int> placed_neighbours(int picture) const;
  int placed_neighbour(int picture) const;
  MatchCandidates candidates_near(int picture, int neighbour) const;
  bool join(int picture);
  void place(int picture, const MapMatch& match);
  void add(PlacedPicture placed);
  void remove_unused_lamps();  // after adjust_all()
  double smallest_spacing() const;
  bool is_one_lamp(int a, int b, double spacing) const;
  int add_lamp(const LampShapeView& view, const Rigid3& cam_from_map, const LampSize& size,
               const Matrix6* pose_covariance);
  std::vector<int> picture_counts() const;
  std::vector<int> lamps_in_order() const;
  Network network_of(const KnownLengths& lengths);
  KnownLengths tags_of_any_size() const;
  Eigen::Vector2d centre_correction(int lamp, const Rigid3& pose) const;
  void update_from(const Adjustment& adjustment);
  /// Poses of pictures that an adjustment left out, in the adjusted map. Their old ones drift away
  /// from it, and the next adjustment could end in another minimum.
  void pose_left_out(const Network& network);
  void add_rim(const PlacedPicture& placed, int blob, Network& network,
               ImageObservation& observation) const;
  /// True if the rims are observations of all adjustments: a picture shows lamps on one line only,
  /// two lamps included, or fewer than two pictures show four lamps.
  bool needs_rims() const;
  std::optional<ShapeOfViews> fitted_shape(int lamp) const;
  void set_shape(int lamp, const ShapeOfViews& found);
  void fit_shapes();  // before the first adjustment
  void update_shapes(const Network& network);
  std::vector<bool> update_tags(const Network& network);  // true: a tag of the network

  const std::vector<SurveyPicture>& input_;
  const Camera given_camera_;
  Camera camera_;
  std::vector<std::string> free_parameters_;  // of the camera
  std::vector<ParameterPrior> priors_;        // of these
  const SurveyOptions& options_;
  const SurveyCallback& progress_;
  std::vector<std::string> link_notes_;
  LampLinks links_;
  double model_sigma_px_;
  std::vector<PictureViews> pictures_;
  LampMap map_;
  std::vector<int> place_of_;  // index into map_.placed of each picture; -1: not placed
  std::vector<int> order_;
  std::vector<int> point_of_lamp_;
  std::optional<Precision> precision_;  // of the last adjustment
  bool is_rough_ = false;               // a start, or lamps were joined since the last adjustment
  bool with_rims_ = false;
  bool centres_have_failed_ = false;  // without the rims, an adjustment did not succeed
  std::vector<std::optional<Lamp>> shapes_;
  std::vector<std::string> reasons_;
  std::vector<bool> ambiguous_;
  std::vector<bool> dropped_;  // by drop_undetermined()
};

/// Outcome of start_from_links().
enum class LinkStart { none, started, ambiguous };

/// Starts a new map from links and adjusts it. none: they determine no map; ambiguous: two maps
/// agree with the pictures alike.
LinkStart start_from_links(GrowingMap& growing);

/// Throws std::invalid_argument for invalid arguments of survey().
void check_input(const std::vector<SurveyPicture>& pictures, const Camera& camera,
                 const SurveyOptions& options);

/// survey() that joins pictures to known lamps, if there are any, whose positions it determines
/// anew; the frame and the scale are its own. Row times are not used, and nothing is validated.
Result<Survey> survey_from(const std::vector<MapLamp>& known,
                           const std::vector<SurveyPicture>& pictures, const Camera& camera,
                           const SurveyOptions& options, const SurveyCallback& progress);

}  // namespace occ::internal::survey
