// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/survey.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/survey/internal/growing_map.hpp"
#include "libocc/survey/internal/inertial_scale.hpp"
#include "libocc/survey/internal/lamp_light.hpp"
#include "libocc/survey/internal/row_times.hpp"
#include "libocc/survey/internal/survey_notes.hpp"
#include "libocc/survey/internal/tag_views.hpp"
#include "libocc/survey/internal/world_frame.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using internal::survey::GrowingMap;
using internal::survey::KnownLengths;
using internal::survey::LinkStart;
using internal::survey::MapLamp;
using internal::survey::PlacedPicture;

constexpr int min_linked = 4;  // blobs of a picture that determine a pose
constexpr int min_link_redundancy = 10;
constexpr int max_starts = 6;             // first pictures that are tried; the largest map is kept
constexpr int max_lone_starts = 3;        // if no picture joins them: in a grid, none ever does
constexpr double max_ratio_sigma = 5e-3;  // of distances; most maps have a tenth of it
constexpr int max_rounds = 6;  // of adjustment and further matches; two suffice for most rooms

std::string percent(double relative) {
  std::ostringstream text;
  text.precision(2);
  text << 100 * relative << " %";
  return text.str();
}

/// A survey from the first match to the result.
class SurveyRun {
 public:
  SurveyRun(const std::vector<SurveyPicture>& pictures, const Camera& camera,
            const SurveyOptions& options, const SurveyCallback& progress,
            const std::vector<MapLamp>& known)
      : pictures_(pictures),
        options_(options),
        known_(known),
        growing_(pictures, camera, options, progress) {}

  Result<Survey> run() {
    if (!choose_start()) return unmatched();
    Result<Adjustment> adjusted;
    for (int round = 0; round < max_rounds; ++round) {
      adjusted = growing_.adjust_without_lengths();
      if (!adjusted.ok()) break;
      if (by_links_ == LinkStart::started) growing_.release_rejected(*adjusted);
      int changes = growing_.reassign();
      if (by_links_ == LinkStart::started) changes += growing_.join_by_links();
      if (growing_.join_pictures() + changes == 0) break;
    }
    if (by_links_ == LinkStart::started) {
      while (adjusted.ok() && growing_.drop_unconfirmed(*adjusted) > 0)
        adjusted = growing_.adjust_without_lengths();
      if (adjusted.ok() && adjusted->redundancy < min_link_redundancy) {
        adjusted.status = Status::too_few_lamps;
        adjusted.message = "a wrong track or id would not be noticed, as the redundancy is " +
                           std::to_string(adjusted->redundancy) + "; the minimum is " +
                           std::to_string(min_link_redundancy);
      }
    }
    if (adjusted.ok()) adjusted = final_adjustment();
    return result_of(adjusted);
  }

 private:
  /// Starts from rims, or from links if these place more pictures; false if neither has a second
  /// picture.
  bool choose_start() {
    if (!known_.empty()) {
      growing_.start(known_);
      return growing_.join_pictures() >= 2;
    }
    const int by_rims = start_from_rims();
    int with_pose = 0;
    for (int i = 0; i < static_cast<int>(pictures_.size()); ++i) {
      if (growing_.linked_blobs(i) < min_linked) continue;
      ++linked_;
      with_pose += !growing_.links_are_on_a_line(i);
    }
    if (with_pose < 2 || with_pose <= by_rims) return by_rims >= 2;
    by_links_ = internal::survey::start_from_links(growing_);
    if (by_links_ == LinkStart::started && growing_.placed() > by_rims) return true;
    if (by_rims < 2) return false;
    by_links_ = LinkStart::none;
    return start_from_rims() >= 2;
  }

  /// Grows maps from the pictures with most rims; returns the number of pictures of the largest.
  int start_from_rims() {
    std::vector<int> order;
    for (int i = 0; i < static_cast<int>(pictures_.size()); ++i)
      if (growing_.views(i) >= growing_.min_start_views(i)) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return growing_.views(a) > growing_.views(b); });
    candidates_ = static_cast<int>(order.size());
    int best = 0, best_placed = 0, tries = 0;
    bool best_by_plane = false;
    for (const int picture : order) {
      if (tries == max_starts || (tries == max_lone_starts && best_placed < 2)) break;
      ++tries;
      for (const bool by_plane : {false, true}) {
        if (by_plane && !growing_.has_several_sizes(picture)) continue;
        growing_.start(picture, by_plane);
        growing_.join_pictures();
        if (growing_.placed() > best_placed) {
          best = picture;
          best_by_plane = by_plane;
          best_placed = growing_.placed();
        }
        if (best_placed == candidates_) return best_placed;
      }
    }
    if (candidates_ == 0) return 0;
    growing_.start(best, best_by_plane);
    growing_.join_pictures();
    return best_placed;
  }

  Result<Survey> unmatched() const {
    Result<Survey> result;
    note_pictures(result.value);
    int ambiguous = 0;
    for (int i = 0; i < static_cast<int>(pictures_.size()); ++i)
      ambiguous += growing_.is_ambiguous(i);
    if (by_links_ == LinkStart::ambiguous) {
      result.status = Status::ambiguous;
      result.message =
          "the tracks or ids of the lamps agree with two maps alike, as for lamps in one plane; "
          "take more pictures, from further places";
    } else if (candidates_ < 2) {
      result.status = Status::too_few_lamps;
      result.message =
          std::to_string(candidates_) + " of " + std::to_string(pictures_.size()) +
          " pictures show " + (options_.ordered ? "three" : "four") +
          " whole lamps with measured rims; the minimum is two" +
          (options_.ordered ? "" : ", or three lamps in frames of one motion (`ordered`)") +
          (linked_ > 0 ? "; tracks and ids of lamps determine no map: two pictures must "
                         "show four such lamps, not on one line, from different places"
                       : "");
    } else if (ambiguous > 0) {
      result.status = Status::ambiguous;
      result.message =
          "the lamps are arranged regularly, so that pictures match each other in several ways; "
          "take a video, in which neighbours decide, or pictures that show more of the room";
    } else {
      result.status = Status::no_pose;
      result.message = "no two pictures match; take pictures that overlap by four lamps or more";
    }
    return result;
  }

  Result<Adjustment> final_adjustment() {
    // The first adjustment has centres corrected by the shapes so far, the second by its own.
    Result<Adjustment> first = growing_.adjust_without_lengths();
    if (!first.ok()) return first;
    constexpr double max_line_sigma0 = 3;  // a wrong minimum of rims had 4
    if (growing_.is_line() && first->sigma0 > max_line_sigma0) {
      std::ostringstream text;
      text.precision(2);
      text << "lamps on one line need exact rims, and their residuals are " << first->sigma0
           << " times the expected ones";
      first.status = Status::degenerate;
      first.message = text.str();
      return first;
    }
    growing_.estimate_model_sigma(*first);
    order_ = growing_.order();
    const Similarity frame = internal::survey::world_frame(growing_.map(), order_);
    if (!options_.imu.empty() && options_.scale_is_free()) align_inertial(frame);
    growing_.transform(frame);
    apply_scale();
    move_to_origin();
    Result<Adjustment> adjusted = adjust_with_rims();
    if (!adjusted.ok()) return adjusted;
    if (const auto sigma = growing_.ratio_sigma(); sigma && *sigma > max_ratio_sigma)
      warnings_.push_back("distances between the lamps are known to " + percent(*sigma) +
                          " only, apart from the scale: take pictures from further places");
    // The adjustment has changed a scale that it does not observe.
    if (scale_source_ == SurveyScale::free || scale_source_ == SurveyScale::radius) {
      Similarity similarity;
      similarity.scale = scale_source_ == SurveyScale::free
                             ? internal::survey::world_frame(growing_.map(), order_).scale
                             : *scale_by_radius();
      growing_.transform(similarity);
      adjusted.value.network = transformed(adjusted.value.network, similarity);
    }
    const Similarity shift = move_to_origin();  // the cameras have moved with the focal length
    adjusted.value.network = transformed(adjusted.value.network, shift);
    if (scale_source_ == SurveyScale::radius) check_radii();
    warnings_.insert(warnings_.end(), notes_of_tags_.begin(), notes_of_tags_.end());
    return adjusted;
  }

  /// Aligns the inertial measurements with the map that `frame` is to transform.
  void align_inertial(const Similarity& frame) {
    const auto found = internal::survey::align_inertial(growing_.timed_poses(), options_.imu);
    if (found.ok()) {
      inertial_ = found.value;
      inertial_->scale /= frame.scale;
      inertial_->down = frame.rotation * found->down;
      for (const int picture : found->contradictions)
        warnings_.push_back("the inertial measurements after " + pictures_[picture].name +
                            " are not used: the turn to the next picture differs");
    } else {
      warnings_.push_back("the inertial measurements give no scale: " + found.message);
    }
  }

  Similarity move_to_origin() {
    Similarity shift;
    shift.translation = -internal::survey::world_origin(growing_.map(), order_);
    growing_.transform(shift);
    return shift;
  }

  /// Adjusts with the rims as observations. They are linear about the result so far, which the
  /// second adjustment has from the first.
  Result<Adjustment> adjust_with_rims() {
    growing_.set_rims(true);
    Result<Adjustment> adjusted = growing_.adjust_all(known_lengths());
    if (adjusted.ok()) adjusted = growing_.adjust_all(known_lengths());
    if (adjusted.ok()) return adjusted;
    const std::string reason = adjusted.message;
    growing_.set_rims(false);
    adjusted = growing_.adjust_all(known_lengths());
    if (adjusted.ok())
      warnings_.push_back("the rims of the lamps are not used, only their centres: " + reason);
    return adjusted;
  }

  double distance(const LampDistance& measured) const {
    return (growing_.map().lamps[order_[measured.to]].position -
            growing_.map().lamps[order_[measured.from]].position)
        .norm();
  }

  void apply_scale() {
    Similarity similarity;
    const int count = static_cast<int>(order_.size());
    if (!options_.distances.empty()) {
      std::vector<double> ratios;
      for (std::size_t i = 0; i < options_.distances.size(); ++i) {
        const LampDistance& measured = options_.distances[i];
        const std::string name = "distances[" + std::to_string(i) + "]";
        const std::string rule = "the id of a lamp of the map, 0 to " + std::to_string(count - 1);
        require(measured.from < count, name + ".from", measured.from, rule);
        require(measured.to < count, name + ".to", measured.to, rule);
        ratios.push_back(measured.length_m / distance(measured));
      }
      similarity.scale = median(ratios);
      scale_source_ = SurveyScale::distances;
    } else if (options_.tag_size_m) {
      const internal::survey::PlacedTags tags = placed_tags();
      const auto scale = tags.scale(*options_.tag_size_m);
      if (!scale) {
        warnings_.push_back("tag_size_m: no tag is measured by two pictures; the scale is free");
        return;
      }
      similarity.scale = *scale;
      scale_sigma_ = tags.scale_sigma();
      scale_source_ = SurveyScale::tags;
    } else if (options_.radius_m) {
      const auto scale = scale_by_radius();
      if (!scale) {
        warnings_.push_back("radius_m: no lamp of the map is a disc; the scale is free");
        return;
      }
      similarity.scale = *scale;
      scale_source_ = SurveyScale::radius;
    } else if (const auto scale = internal::survey::scale_by_odometry(pictures_, growing_.map(),
                                                                      options_.odometry_sigma)) {
      similarity.scale = scale->first;
      scale_sigma_ = scale->second;
      scale_source_ = SurveyScale::odometry;
    } else if (inertial_) {
      similarity.scale = std::exchange(inertial_->scale, 1);
      scale_sigma_ = inertial_->scale_sigma;
      scale_source_ = SurveyScale::imu;
    }
    growing_.transform(similarity);
  }

  /// Scale by the radius of the discs, with its sigma; nothing without discs.
  std::optional<double> scale_by_radius() {
    const auto radii = internal::survey::radii_of(growing_.shapes(), order_);
    if (!radii) return std::nullopt;
    scale_sigma_ = std::hypot(options_.radius_sigma, radii->sigma);
    return *options_.radius_m / radii->median;
  }

  void check_radii() {
    const auto radii = internal::survey::radii_of(growing_.shapes(), order_);
    constexpr double max_spread = 0.05;  // larger than errors of rims: two kinds of lamps
    if (radii && radii->largest > (1 + max_spread) * radii->smallest)
      warnings_.push_back("the lamps' radii differ by " +
                          percent(radii->largest / radii->smallest - 1) +
                          "; the scale assumes that their median is the given radius");
  }

  internal::survey::PlacedTags placed_tags() {
    notes_of_tags_.clear();
    return {pictures_, growing_.map(), growing_.camera(), notes_of_tags_};
  }

  KnownLengths known_lengths() {
    KnownLengths all;
    for (const LampDistance& measured : options_.distances) {
      DistanceObservation observation;
      observation.from = Target::of_point(growing_.point_of_lamp()[order_[measured.from]]);
      observation.to = Target::of_point(growing_.point_of_lamp()[order_[measured.to]]);
      observation.length_m = measured.length_m;
      observation.sigma_m = measured.sigma_m;
      all.distances.push_back(observation);
    }
    if (scale_source_ == SurveyScale::tags) placed_tags().add_to(all, *options_.tag_size_m);
    return all;
  }

  void note_pictures(Survey& survey) const {
    survey.image_of_picture.assign(pictures_.size(), -1);
    for (const SurveyPicture& picture : pictures_)
      survey.lamp_of_blob.emplace_back(internal::survey::lamp_blobs(picture), -1);
    for (int i = 0; i < static_cast<int>(pictures_.size()); ++i)
      if (!growing_.reason(i).empty())
        survey.omissions.push_back({pictures_[i].name, -1, growing_.reason(i)});
  }

  Result<Survey> result_of(const Result<Adjustment>& adjusted);
  void set_light(SurveyedLamp& surveyed, int lamp) const;
  void note_blobs(Survey& survey) const;
  void note_rejections(Survey& survey) const;

  const std::vector<SurveyPicture>& pictures_;
  const SurveyOptions& options_;
  const std::vector<MapLamp>& known_;  // lamps of the start; empty: it is to be found
  GrowingMap growing_;
  std::vector<int> order_;
  std::vector<std::string> warnings_, notes_of_tags_;
  SurveyScale scale_source_ = SurveyScale::free;
  double scale_sigma_ = 0;
  std::optional<InertialAlignment> inertial_;
  int candidates_ = 0, linked_ = 0;  // pictures with four views, or four linked blobs
  LinkStart by_links_ = LinkStart::none;
};

Result<Survey> SurveyRun::result_of(const Result<Adjustment>& adjusted) {
  Result<Survey> result;
  result.status = adjusted.status;
  result.message = adjusted.message;
  if (!adjusted.ok() && adjusted.status != Status::ambiguous)  // that of distances names them
    result.message = std::to_string(growing_.placed()) + " of " + std::to_string(pictures_.size()) +
                     " pictures match, and do not determine a map: " + adjusted.message +
                     "; take more pictures that overlap";
  Survey& survey = result.value;
  survey.adjustment = adjusted.value;
  survey.camera = growing_.camera();
  survey.scale = scale_source_;
  survey.scale_sigma = scale_sigma_;
  if (scale_source_ == SurveyScale::imu) survey.inertial = inertial_;
  survey.model_sigma_px = growing_.model_sigma_px();
  survey.warnings = growing_.link_notes();
  survey.warnings.insert(survey.warnings.end(), warnings_.begin(), warnings_.end());
  note_pictures(survey);
  if (!adjusted.ok()) return result;
  internal::survey::note_growth(survey);
  internal::survey::note_contradictions(survey);
  if (!options_.calibrate_camera && !survey.camera.is_exact())
    survey.warnings.push_back(
        "the map does not contain the errors that the camera states: estimate them along "
        "(calibrate_camera)");
  for (std::size_t image = 0; image < growing_.map().placed.size(); ++image)
    survey.image_of_picture[growing_.map().placed[image].picture] = static_cast<int>(image);
  internal::survey::note_left_out(survey);
  std::set<int> ids;
  for (const int lamp : growing_.order()) {
    SurveyedLamp surveyed;
    const auto& shape = growing_.shapes()[lamp];
    surveyed.has_shape = shape.has_value();
    if (shape) {
      surveyed.lamp = *shape;
    } else {
      surveyed.lamp.shape = LampShape::point;
      surveyed.lamp.normal = -Vector3d::UnitZ();
    }
    surveyed.lamp.centre_m = growing_.map().lamps[lamp].position;
    surveyed.lamp.id = static_cast<int>(survey.lamps.size());
    set_light(surveyed, lamp);
    if (surveyed.code_id && !ids.insert(*surveyed.code_id).second)
      survey.warnings.push_back("several lamps of the map transmit the id " +
                                std::to_string(*surveyed.code_id));
    survey.lamps.push_back(surveyed);
  }
  internal::survey::normalise_power(survey.lamps);
  note_blobs(survey);
  note_rejections(survey);
  return result;
}

void SurveyRun::set_light(SurveyedLamp& surveyed, int lamp) const {
  std::vector<internal::survey::BlobInPicture> blobs;
  for (const PlacedPicture& placed : growing_.map().placed)
    for (std::size_t b = 0; b < placed.lamp_of.size(); ++b)
      if (placed.lamp_of[b] == lamp)
        blobs.push_back({&pictures_[placed.picture].blobs[b], placed.cam_from_map});
  surveyed.pictures = static_cast<int>(blobs.size());
  const internal::survey::RelativeLight light = internal::survey::lamp_light(surveyed.lamp, blobs);
  surveyed.has_power = light.power.has_value();
  if (light.power) surveyed.lamp.power_w = *light.power;
  if (light.colour) surveyed.lamp.colour = *light.colour;
  const internal::survey::LampSignal signal = internal::survey::lamp_signal(blobs);
  surveyed.code_id = signal.id;
  if (!signal.id && signal.frequency_hz > 0) surveyed.lamp.frequency_hz = signal.frequency_hz;
}

void SurveyRun::note_blobs(Survey& survey) const {
  for (const PlacedPicture& placed : growing_.map().placed) {
    const SurveyPicture& picture = pictures_[placed.picture];
    for (std::size_t b = 0; b < internal::survey::lamp_blobs(picture); ++b) {
      const int lamp = placed.lamp_of[b];
      const int id = lamp < 0 ? -1 : growing_.point_of_lamp()[lamp];
      survey.lamp_of_blob[placed.picture][b] = id;
      if (id >= 0) continue;
      const std::string why = internal::survey::reason_without_view(picture.blobs[b]);
      survey.omissions.push_back({picture.name, static_cast<int>(b),
                                  !why.empty() && by_links_ != LinkStart::started
                                      ? why
                                      : "its place is not confirmed by other pictures"});
    }
  }
}

void SurveyRun::note_rejections(Survey& survey) const {
  const Network& network = survey.adjustment.network;
  for (const RejectedObservation& rejected : survey.adjustment.rejected) {
    const ImageObservation& observation = network.observations[rejected.observation];
    if (observation.target.point < 0) {
      survey.warnings.push_back(network.name_of(observation.target) + " in " +
                                network.images[observation.image].name +
                                " contradicts the other pictures and is not used");
      continue;
    }
    const int picture = growing_.map().placed[observation.image].picture;
    const std::vector<int>& lamps = survey.lamp_of_blob[picture];
    const auto blob = std::find(lamps.begin(), lamps.end(), observation.target.point);
    survey.omissions.push_back({pictures_[picture].name, static_cast<int>(blob - lamps.begin()),
                                network.name_of(observation.target) +
                                    " contradicts the other pictures (" + rejected.reason + ")"});
  }
  for (const std::string& warning : survey.adjustment.warnings) survey.warnings.push_back(warning);
}

}  // namespace

Result<Survey> internal::survey::survey_from(const std::vector<MapLamp>& known,
                                             const std::vector<SurveyPicture>& pictures,
                                             const Camera& camera, const SurveyOptions& options,
                                             const SurveyCallback& progress) {
  try {
    return SurveyRun(pictures, camera, options, progress, known).run();
  } catch (const SurveyStopped&) {
    Result<Survey> stopped;
    stopped.status = Status::not_converged;
    stopped.message = "the survey was stopped";
    return stopped;
  }
}

Result<Survey> survey(const std::vector<SurveyPicture>& pictures, const Camera& camera,
                      const SurveyOptions& options, const SurveyCallback& progress) {
  internal::survey::check_input(pictures, camera, options);
  std::vector<std::string> notes;
  std::vector<SurveyPicture> still = pictures;
  if (options.ordered && options.row_time_s > 0)
    still = internal::survey::without_rolling_shutter(std::move(still), options.row_time_s,
                                                      camera.width(), camera.height(), notes);
  still = internal::survey::with_tags_as_blobs(std::move(still));
  Result<Survey> result = internal::survey::survey_from({}, still, camera, options, progress);
  result.value.warnings.insert(result.value.warnings.end(), notes.begin(), notes.end());
  return result;
}

}  // namespace occ
