// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/update.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/survey/internal/growing_map.hpp"
#include "libocc/survey/internal/lamp_block.hpp"
#include "libocc/survey/internal/lamp_changes.hpp"
#include "libocc/survey/internal/lamp_kinds.hpp"
#include "libocc/survey/internal/lamp_map.hpp"
#include "libocc/survey/internal/map_link.hpp"
#include "libocc/survey/internal/place_statistics.hpp"
#include "libocc/survey/internal/row_times.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using internal::survey::BlockLamp;
using internal::survey::LampBlock;
using internal::survey::LinkedBlock;
using internal::survey::LinkLamp;
using internal::survey::LinkWay;

constexpr std::size_t max_blocks = 8;    // constellations that do not overlap, as of large halls
constexpr std::size_t max_ways = 64;     // that are compared; a hall's grid has more
constexpr int min_map_lamps = 4;         // three determine the similarity
constexpr double missing_log10 = 1.3;    // a lamp changed with probability 1/20, as in survey()
constexpr double max_log10_odds = 4;     // of a rival; its risk is then 1e-4, as in locate()
constexpr double max_prior_risk = 1e-6;  // of a correct pose whose chi-square exceeds the limit

/// An update from the pictures to the verdicts.
class UpdateRun {
 public:
  UpdateRun(std::vector<SurveyPicture> pictures, const Scene& map, const UpdateOptions& options,
            const SurveyCallback& progress)
      : pictures_(std::move(pictures)), map_(map), options_(options), progress_(progress) {
    reasons_.resize(pictures_.size());
    MapUpdate& update = result_.value;
    update.cam_from_world.resize(pictures_.size());
    if (map.lamps.empty()) return;
    int assumed = 0;
    Eigen::Matrix3Xd places(3, static_cast<Index>(map.lamps.size()));
    for (std::size_t i = 0; i < map.lamps.size(); ++i)
      places.col(static_cast<Index>(i)) = map.lamps[i].centre_m;
    const Eigen::MatrixXd covariance = internal::survey::without_similarity(
        places, internal::survey::map_covariance(map, options.map_sigma_m, assumed));
    for (std::size_t i = 0; i < map.lamps.size(); ++i)
      map_lamps_.push_back(
          {map.lamps[i].centre_m,
           covariance.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(i)),
           map.lamps[i].normal, internal::survey::lamp_size(map.lamps[i])});
  }

  Result<MapUpdate> run() {
    if (static_cast<int>(map_.lamps.size()) < min_map_lamps) {
      fail(Status::too_few_lamps, "the map has " + std::to_string(map_.lamps.size()) +
                                      " lamps; an update needs four or more");
      return std::move(result_);
    }
    std::vector<SurveyPicture> left = pictures_;
    for (std::size_t block = 0; block < max_blocks; ++block) {
      Result<Survey> found = survey(left, map_.camera, options_.survey, progress_);
      const std::vector<internal::survey::MapLamp> lamps = lamps_with_size();
      if (!found.ok() && found.status != Status::not_converged && !lamps.empty()) {
        // Pictures that do not match each other join by the lamps of the map.
        Result<Survey> by_map =
            internal::survey::survey_from(lamps, left, map_.camera, options_.survey, progress_);
        if (by_map.ok() || by_map.status == Status::not_converged) found = std::move(by_map);
      }
      if (found.status == Status::not_converged) {
        fail(found.status, found.message);
        return std::move(result_);
      }
      for (const SurveyOmission& omission : found->omissions) note(omission, left);
      if (!found.ok()) {
        if (block == 0) fail(found.status, found.message);
        if (block == 0 && found.status == Status::ambiguous) name_ways_of_first_picture();
        break;
      }
      add(*found);
      for (std::size_t i = 0; i < left.size(); ++i) {
        if (found->image_of_picture[i] < 0) continue;
        left[i].blobs.clear();
        left[i].tracks.clear();
        left[i].tags.clear();
      }
      const auto is_used = [](const SurveyPicture& picture) { return picture.blobs.empty(); };
      if (std::count_if(left.begin(), left.end(), is_used) + 1 >=
          static_cast<std::ptrdiff_t>(left.size()))
        break;
    }
    if (!linked_.empty()) {
      result_.status = Status::ok;
      result_.message.clear();
      finish();
    }
    write_omissions();
    return std::move(result_);
  }

 private:
  /// Keeps the first failure.
  void fail(Status status, const std::string& message) {
    if (!result_.ok()) return;
    result_.status = status;
    result_.message = message;
  }

  void note(const SurveyOmission& omission, const std::vector<SurveyPicture>& left) {
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (left[i].name != omission.picture || left[i].blobs.empty()) continue;
      if (omission.blob < 0)
        reasons_[i] = omission.reason;
      else
        blob_omissions_.push_back({static_cast<int>(i), omission});
    }
  }

  /// Lamps of the map for matches with pictures, whose ranges are in units of the lamps' sizes;
  /// empty if a size is not known.
  std::vector<internal::survey::MapLamp> lamps_with_size() const {
    std::vector<internal::survey::MapLamp> lamps;
    for (std::size_t i = 0; i < map_lamps_.size(); ++i) {
      const Lamp& lamp = map_.lamps[i];
      internal::survey::MapLamp known;
      known.position = lamp.centre_m;
      known.covariance = map_lamps_[i].covariance;
      known.shape = lamp.shape == LampShape::rectangle ? lamp.shape : LampShape::disc;
      known.aspect = internal::survey::aspect_of(lamp);
      known.x_axis = internal::survey::long_side(lamp);
      known.size = map_lamps_[i].size;
      known.size_sigma = std::max(lamp.size_sigma, options_.survey.size_spread);
      known.normal = lamp.normal;
      if (!(known.size > 0)) return {};
      lamps.push_back(known);
    }
    return lamps;
  }

  /// Lists the poses in the map of the first picture that shows four lamps, because the pictures do
  /// not match each other in one way.
  void name_ways_of_first_picture() {
    internal::survey::PictureViews picture;
    std::size_t first = 0;
    constexpr std::size_t min_views = 4;
    for (; first < pictures_.size() && picture.views.size() < min_views; ++first) {
      picture = {&pictures_[first].blobs, {}};
      for (std::size_t b = 0; b < picture.blobs->size(); ++b)
        if (auto view =
                internal::survey::lamp_view((*picture.blobs)[b], static_cast<int>(b), map_.camera))
          picture.views.push_back(std::move(*view));
    }
    if (picture.views.size() < min_views) return;
    --first;
    const internal::survey::LampMap lamps{lamps_with_size(), {}};
    if (lamps.lamps.empty()) return;
    std::vector<MapWay> ways;
    for (const internal::survey::MapMatch& match :
         internal::survey::match_picture(picture, lamps, {}, map_.camera)) {
      if (match.log10_false_alarms > options_.max_log10_false_alarms || ways.size() == max_ways)
        continue;
      MapWay way;
      way.picture = pictures_[first].name;
      way.cam_from_world = match.cam_from_map;
      way.matches = match.matches;
      way.lamps = static_cast<int>(picture.views.size());
      way.missing = match.contradictions;
      way.log10_false_alarms = match.log10_false_alarms;
      if (options_.prior && first == 0) way.prior_chi2 = options_.prior->chi2(match.cam_from_map);
      for (const int lamp : match.lamp_of_view)
        if (lamp >= 0) way.lamp_ids.push_back(map_.lamps[lamp].id);
      ways.push_back(std::move(way));
    }
    result_.value.ways = plausible(ways);
    if (result_.value.ways.size() < 2) return;
    result_.message += "; " + pictures_[first].name + " alone matches the map in " +
                       std::to_string(result_.value.ways.size()) + " ways";
  }

  /// Links a constellation to the map, or writes why it is not linked.
  void add(const Survey& found) {
    LampBlock block(found, pictures_, map_.camera, options_.survey.threads);
    std::vector<LinkLamp> lamps;
    const Eigen::MatrixXd covariance = block.covariance();
    for (std::size_t i = 0; i < block.lamps().size(); ++i) {
      const BlockLamp& lamp = block.lamps()[i];
      lamps.push_back({lamp.lamp.centre_m,
                       covariance.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(i)),
                       lamp.lamp.normal,
                       lamp.has_shape ? internal::survey::lamp_size(lamp.lamp) : 0});
    }
    std::vector<LinkWay> all = internal::survey::link_ways(lamps, map_lamps_);
    const LinkWay* best = all.empty() ? nullptr : &all[0];
    const std::string best_text =
        best == nullptr ? "no similarity has three of their lamps in common with the map"
                        : "the best similarity has " + std::to_string(best->matches) +
                              " of their " + std::to_string(lamps.size()) +
                              " lamps in common with the map, which may be accidental";
    while (!all.empty() && all.back().log10_false_alarms > options_.max_log10_false_alarms)
      all.pop_back();
    if (all.empty()) {
      refuse(block, Status::no_pose,
             "the pictures match each other, and not the map: " + best_text +
                 "; check that the map is of this room and that its camera took the pictures");
      return;
    }
    if (all.size() > max_ways) all.resize(max_ways);
    std::vector<MapWay> ways;
    for (const LinkWay& way : all) ways.push_back(map_way(way, block));
    choose(std::move(all), std::move(ways), std::move(block));
  }

  MapWay map_way(const LinkWay& way, LampBlock block) const {
    block.transform(way.map_from_lamps);
    MapWay result;
    const int first = *std::min_element(block.pictures().begin(), block.pictures().end());
    result.picture = pictures_[first].name;
    result.cam_from_world = *block.pose(first);
    result.matches = way.matches;
    result.lamps = static_cast<int>(way.lamp_of.size());
    result.log10_false_alarms = way.log10_false_alarms;
    for (std::size_t a = 0; a < map_.lamps.size(); ++a) {
      if (std::count(way.lamp_of.begin(), way.lamp_of.end(), static_cast<int>(a)) > 0) {
        result.lamp_ids.push_back(map_.lamps[a].id);
        continue;
      }
      const internal::survey::PlaceEvidence evidence = internal::survey::place_evidence(
          map_.lamps[a], std::sqrt(map_lamps_[a].covariance.diagonal().maxCoeff()), -1, block,
          pictures_, map_);
      result.missing += evidence.missed.size() > evidence.seen.size();
    }
    if (options_.prior && first == 0)
      result.prior_chi2 = options_.prior->chi2(result.cam_from_world);
    return result;
  }

  static int contradictions(const MapWay& way) { return way.missing + way.lamps - way.matches; }

  /// The ways whose odds against the one with the fewest contradictions are not too small; fewest
  /// first.
  static std::vector<MapWay> plausible(std::vector<MapWay> ways) {
    std::stable_sort(ways.begin(), ways.end(), [](const MapWay& a, const MapWay& b) {
      return contradictions(a) < contradictions(b);
    });
    const auto is_improbable = [&](const MapWay& way) {
      return missing_log10 * (contradictions(way) - contradictions(ways[0])) >= max_log10_odds;
    };
    ways.erase(std::find_if(ways.begin(), ways.end(), is_improbable), ways.end());
    return ways;
  }

  /// Takes the way with the fewest contradictions if no other is plausible.
  void choose(std::vector<LinkWay> links, std::vector<MapWay> ways, LampBlock block) {
    std::vector<std::size_t> order(ways.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    if (options_.prior && ways[0].prior_chi2) {
      double smallest = infinity;
      for (const MapWay& way : ways) smallest = std::min(smallest, *way.prior_chi2);
      if (smallest > chi2_quantile(1 - max_prior_risk, std::max(1, options_.prior->dof()))) {
        std::ostringstream text;
        text.precision(3);
        text << "the pictures match the map, and contradict the prior of " << pictures_[0].name
             << ": chi-square " << smallest;
        refuse(block, Status::no_pose, text.str());
        return;
      }
      const double limit = smallest + 2 * max_log10_odds * std::log(10.0);
      const auto is_excluded = [&](std::size_t i) { return *ways[i].prior_chi2 > limit; };
      order.erase(std::remove_if(order.begin(), order.end(), is_excluded), order.end());
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return contradictions(ways[a]) < contradictions(ways[b]);
    });
    std::vector<MapWay> sorted;
    for (const std::size_t i : order) sorted.push_back(ways[i]);
    std::vector<MapWay> rivals = plausible(std::move(sorted));
    if (rivals.size() > 1) {
      const std::string more = links.size() == max_ways ? " or more" : "";
      refuse(block, Status::ambiguous,
             "the pictures match the map in " + std::to_string(rivals.size()) + more +
                 " ways, because its lamps are arranged regularly; " +
                 (options_.prior && !rivals[0].prior_chi2
                      ? "the prior is of " + pictures_[0].name + ", which is not among them"
                      : "a prior of the first picture's pose decides"));
      if (result_.value.ways.empty() && linked_.empty()) result_.value.ways = std::move(rivals);
      return;
    }
    if (linked_.empty()) result_.value.ways = std::move(rivals);
    const LinkWay& way = links[order[0]];
    block.transform(way.map_from_lamps);
    for (const int picture : block.pictures()) {
      reasons_[picture].clear();
      result_.value.cam_from_world[picture] = block.pose(picture);
    }
    linked_.push_back({std::move(block), way.lamp_of});
  }

  void refuse(const LampBlock& block, Status status, const std::string& reason) {
    fail(status, reason);
    for (const int picture : block.pictures()) reasons_[picture] = reason;
  }

  void finish() {
    internal::survey::LampChanges changes(map_, linked_, pictures_, options_);
    if (!changes.ok()) {
      fail(Status::degenerate,
           "the errors of map and pictures have no inverse covariance: check position_sigma_m and "
           "shared_errors_m of the map");
      return;
    }
    changes.write(result_.value);
    for (std::size_t b = 0; b < linked_.size(); ++b) {
      const LampBlock& block = linked_[b].block;
      const int number = static_cast<int>(b);
      for (const std::string& warning : block.warnings())
        result_.value.warnings.push_back(with_names(warning, number, changes));
      for (const auto& [picture, blob, lamp] : block.rejected())
        result_.value.omissions.push_back(
            {pictures_[picture].name, blob,
             changes.name_of(number, lamp) + " contradicts the other pictures"});
    }
  }

  /// Replaces the lamps' numbers in a constellation by their ids.
  std::string with_names(const std::string& text, int number,
                         const internal::survey::LampChanges& changes) const {
    const std::string word = "lamp ";
    const std::vector<BlockLamp>& lamps = linked_[number].block.lamps();
    std::string result;
    std::size_t at = 0;
    while (true) {
      const std::size_t found = text.find(word, at);
      const std::size_t digits = found == std::string::npos ? found : found + word.size();
      if (found == std::string::npos) return result + text.substr(at);
      std::size_t end = digits;
      while (end < text.size() && text[end] >= '0' && text[end] <= '9') ++end;
      result += text.substr(at, found - at);
      if (end == digits) {
        result += word;
      } else {
        const int id = std::stoi(text.substr(digits, end - digits));
        const auto lamp = std::find_if(lamps.begin(), lamps.end(),
                                       [&](const BlockLamp& one) { return one.number == id; });
        result += lamp == lamps.end()
                      ? "a lamp"
                      : changes.name_of(number, static_cast<int>(lamp - lamps.begin()));
      }
      at = end;
    }
  }

  void write_omissions() {
    std::vector<SurveyOmission>& omissions = result_.value.omissions;
    for (std::size_t i = 0; i < pictures_.size(); ++i)
      if (!reasons_[i].empty())
        omissions.push_back({pictures_[i].name, -1, reasons_[i]});
      else if (!result_.value.cam_from_world[i] && result_.ok())
        omissions.push_back({pictures_[i].name, -1, "it matches no other picture"});
    for (const auto& [picture, omission] : blob_omissions_) {
      const auto block = std::find_if(linked_.begin(), linked_.end(), [&](const LinkedBlock& one) {
        return one.block.pose(picture).has_value();
      });
      if (block != linked_.end() && block->block.lamp_of_blob(picture)[omission.blob] < 0)
        omissions.push_back(omission);
    }
  }

  const std::vector<SurveyPicture> pictures_;
  const Scene& map_;
  const UpdateOptions& options_;
  const SurveyCallback& progress_;
  std::vector<LinkLamp> map_lamps_;
  std::vector<LinkedBlock> linked_;
  std::vector<std::string> reasons_;  // of pictures; empty: used, or not tried
  std::vector<std::pair<int, SurveyOmission>> blob_omissions_;
  Result<MapUpdate> result_;
};

}  // namespace

const char* to_string(LampFate fate) {
  switch (fate) {
    case LampFate::unchanged:
      return "unchanged";
    case LampFate::changed:
      return "changed";
    case LampFate::moved:
      return "moved";
    case LampFate::gone:
      return "gone";
    case LampFate::not_seen:
      return "not_seen";
    case LampFate::added:
      break;
  }
  return "added";
}

void UpdateOptions::validate() const {
  survey.validate();
  require(survey.distances.empty(), "survey.distances", survey.distances.size(),
          "empty: the scale is that of the map");
  if (survey.radius_m)
    require(false, "survey.radius_m", *survey.radius_m, "omitted: the scale is that of the map");
  require(!survey.calibrate_camera, "survey.calibrate_camera", "true",
          "false: places are compared with a known camera");
  if (survey.tag_size_m)
    require(false, "survey.tag_size_m", *survey.tag_size_m,
            "omitted: the scale is that of the map");
  require_positive(map_sigma_m, "map_sigma_m");
  require(false_alarm > 0 && false_alarm < 0.5, "false_alarm", false_alarm, "in (0, 0.5)");
  require_not_negative(max_move_m, "max_move_m");
  require(min_gone_pictures >= 2, "min_gone_pictures", min_gone_pictures, "at least 2");
  require(std::isfinite(max_log10_false_alarms), "max_log10_false_alarms", max_log10_false_alarms,
          "finite");
  if (prior) prior->validate();
}

Result<MapUpdate> update_map(const std::vector<SurveyPicture>& pictures, const Scene& map,
                             const UpdateOptions& options, const SurveyCallback& progress) {
  options.validate();
  Scene checked = map;
  checked.validate();
  require(checked.camera.is_central(), "camera", name_of(checked.camera.kind()),
          "one with a single projection centre");
  UpdateOptions once = options;
  once.survey.row_time_s = 0;  // is applied here
  std::vector<std::string> notes;
  std::vector<SurveyPicture> still = pictures;
  once.survey.imu.clear();  // the map has the scale
  for (SurveyPicture& picture : still) picture.odometry_m.reset();
  if (options.survey.ordered && options.survey.row_time_s > 0)
    still = internal::survey::without_rolling_shutter(std::move(still), options.survey.row_time_s,
                                                      checked.camera.width(),
                                                      checked.camera.height(), notes);
  Result<MapUpdate> result = UpdateRun(std::move(still), checked, once, progress).run();
  result.value.warnings.insert(result.value.warnings.end(), notes.begin(), notes.end());
  return result;
}

}  // namespace occ
