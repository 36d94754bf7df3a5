// SPDX-License-Identifier: Apache-2.0
// The network of a growing map, and the lamps' shapes.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/network/network_statistics.hpp"
#include "libocc/survey/internal/growing_map.hpp"
#include "libocc/survey/internal/observed_rim.hpp"
#include "libocc/survey/internal/shape_fit.hpp"

namespace occ::internal::survey {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// Error of all rims of a camera, such as of its response, beyond those that they state. It was up
// to 0.02 px in rendered and real pictures with a known response.
constexpr double rim_growth_sigma_px = 0.05;

/// Shape and errors of a lamp from its adjusted outline; nothing if it was left out. `covariance`:
/// Precision::outline().
std::optional<ShapeOfViews> adjusted_shape(const NetworkPoint& point,
                                           const Eigen::MatrixXd& covariance, const Lamp& before) {
  if (!covariance.allFinite()) return std::nullopt;
  ShapeOfViews found;
  found.is_fitted = true;
  found.lamp = before;
  found.lamp.centre_m = point.position_m;
  set_outline(*point.outline, found.lamp);
  found.size = size_of(found.lamp);
  const Eigen::Index sizes = point.outline->is_round ? 1 : 2;
  const Eigen::VectorXd variances = covariance.diagonal();
  found.lamp.size_sigma = std::sqrt(variances.tail(sizes).maxCoeff());
  found.lamp.tilt_sigma_rad =
      std::sqrt(variances.segment(3, variances.size() - 3 - sizes).maxCoeff());
  return found;
}

bool are_on_a_line(const std::vector<Vector3d>& positions) {
  constexpr double max_width = 0.1;  // over the length
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& at : positions) mean += at / static_cast<double>(positions.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& at : positions) scatter += (at - mean) * (at - mean).transpose();
  const Vector3d spread = core::symmetric_eigen<Matrix3d>(scatter).eigenvalues();
  return spread[1] < square(max_width) * spread[2];
}

}  // namespace

std::vector<int> GrowingMap::picture_counts() const {
  std::vector<int> counts(map_.lamps.size(), 0);
  for (const PlacedPicture& placed : map_.placed)
    for (const int lamp : placed.lamp_of)
      if (lamp >= 0) ++counts[lamp];
  return counts;
}

std::vector<int> GrowingMap::lamps_in_order() const {
  std::vector<const PlacedPicture*> placed;
  for (const PlacedPicture& picture : map_.placed) placed.push_back(&picture);
  std::stable_sort(placed.begin(), placed.end(),
                   [](const auto* a, const auto* b) { return a->picture < b->picture; });
  const std::vector<int> counts = picture_counts();
  std::vector<int> order;
  std::vector<bool> listed(map_.lamps.size(), false);
  for (const PlacedPicture* picture : placed)
    for (const int lamp : picture->lamp_of)
      if (lamp >= 0 && counts[lamp] >= 2 && !listed[lamp] && map_.lamps[lamp].tag < 0) {
        listed[lamp] = true;
        order.push_back(lamp);
      }
  return order;
}

Vector2d GrowingMap::centre_correction(int lamp, const Rigid3& pose) const {
  if (lamp >= static_cast<int>(shapes_.size()) || !shapes_[lamp]) return Vector2d::Zero();
  const auto centre = camera_.project(pose * shapes_[lamp]->centre_m);
  const auto image_centre = project_lamp_centre(*shapes_[lamp], pose, camera_);
  if (!centre || !image_centre) return Vector2d::Zero();
  return camera_.difference_px(*centre, *image_centre);
}

Network GrowingMap::network_of(const KnownLengths& lengths) {
  Network network;
  network.cameras.push_back({"camera", camera_, free_parameters_, 0, rim_growth_sigma_px});
  network.parameter_priors = priors_;
  order_ = lamps_in_order();
  point_of_lamp_.assign(map_.lamps.size(), -1);
  for (std::size_t id = 0; id < order_.size(); ++id) {
    point_of_lamp_[order_[id]] = static_cast<int>(id);
    network.points.push_back(
        {"lamp " + std::to_string(id), map_.lamps[order_[id]].position, false});
  }
  const bool with_rims = with_rims_ || centres_have_failed_ || needs_rims();
  if (with_rims && shapes_.empty()) fit_shapes();
  for (const PlacedPicture& placed : map_.placed) {
    const SurveyPicture& picture = input_[placed.picture];
    const int image = network.add_image(picture.name, 0, placed.cam_from_map);
    for (std::size_t b = 0; b < placed.lamp_of.size(); ++b) {
      const int lamp = placed.lamp_of[b];
      if (lamp < 0 || point_of_lamp_[lamp] < 0) continue;
      const Blob& blob = picture.blobs[b];
      ImageObservation observation;
      observation.image = image;
      observation.target = Target::of_point(point_of_lamp_[lamp]);
      observation.pixel = blob.centroid_px + centre_correction(lamp, placed.cam_from_map);
      observation.sigma_px =
          (blob.covariance_px2.diagonal().array().max(0.0) + square(model_sigma_px_)).sqrt();
      if (with_rims) add_rim(placed, static_cast<int>(b), network, observation);
      network.observations.push_back(observation);
    }
  }
  network.distances = lengths.distances;
  const KnownLengths tags = lengths.bodies.empty() ? tags_of_any_size() : lengths;
  network.bodies = tags.bodies;
  network.observations.insert(network.observations.end(), tags.tag_observations.begin(),
                              tags.tag_observations.end());
  return network;
}

KnownLengths GrowingMap::tags_of_any_size() const {
  KnownLengths lengths;
  std::vector<std::string> notes;  // of tags that are left out, also in SurveyRun
  PlacedTags(input_, map_, camera_, notes).add_to(lengths, std::nullopt);
  return lengths;
}

void GrowingMap::add_rim(const PlacedPicture& placed, int blob, Network& network,
                         ImageObservation& observation) const {
  const int lamp = placed.lamp_of[blob];
  if (lamp >= static_cast<int>(shapes_.size()) || !shapes_[lamp]) return;
  const Blob& seen = input_[placed.picture].blobs[blob];
  const std::vector<LampShapeView>& views = pictures_[placed.picture].views;
  const bool is_of_shape = std::any_of(views.begin(), views.end(), [&](const LampShapeView& view) {
    return view.blob == blob && view.shape == shapes_[lamp]->shape;
  });
  constexpr double max_tilt_sigma_rad = 0.1;  // beyond it the outline is no longer linear
  if (!is_of_shape || seen.saturated ||
      !(shapes_[lamp]->tilt_sigma_rad.value_or(infinity) < max_tilt_sigma_rad))
    return;
  auto rim = observed_rim(*shapes_[lamp], seen, placed.cam_from_map, camera_, model_sigma_px_,
                          !free_parameters_.empty());
  if (!rim) return;
  observation.pixel = rim->centre_px;
  observation.sigma_px = rim->sigma_px;
  rim->outline.observation = static_cast<int>(network.observations.size());
  network.outlines.push_back(std::move(rim->outline));
  network.points[observation.target.point].outline = outline_of(*shapes_[lamp]);
}

bool GrowingMap::is_line() const {
  std::vector<Vector3d> at;
  for (const int lamp : order_) at.push_back(map_.lamps[lamp].position);
  return are_on_a_line(at);
}

std::optional<double> GrowingMap::ratio_sigma() const {
  std::vector<double> sigmas;
  for (std::size_t i = 0; precision_ && i + 2 < order_.size(); ++i) {
    const int point = static_cast<int>(i);
    const Vector3d& middle = map_.lamps[order_[i + 1]].position;
    const Vector3d to_first = map_.lamps[order_[i]].position - middle;
    const Vector3d to_last = map_.lamps[order_[i + 2]].position - middle;
    const Vector3d by_first = to_first / to_first.squaredNorm();
    const Vector3d by_last = to_last / to_last.squaredNorm();
    Eigen::Matrix<double, 9, 1> gradient;  // of the logarithm of the ratio
    gradient << by_first, by_last - by_first, -by_last;
    const Eigen::MatrixXd joint = precision_->joint(
        {Target::of_point(point), Target::of_point(point + 1), Target::of_point(point + 2)});
    const double variance = gradient.dot(joint * gradient);
    if (std::isfinite(variance)) sigmas.push_back(std::sqrt(std::max(0.0, variance)));
  }
  if (sigmas.empty()) return std::nullopt;
  return median(std::move(sigmas));
}

bool GrowingMap::needs_rims() const {
  constexpr std::size_t min_lamps = 4;  // that have redundancy without their rims
  int redundant = 0;
  for (const PlacedPicture& placed : map_.placed) {
    std::vector<Vector3d> at;
    bool has_tag = false;  // its corners determine the pose
    for (const int lamp : placed.lamp_of) {
      has_tag = has_tag || (lamp >= 0 && map_.lamps[lamp].tag >= 0);
      if (lamp >= 0 && point_of_lamp_[lamp] >= 0) at.push_back(map_.lamps[lamp].position);
    }
    if (!has_tag && are_on_a_line(at)) return true;
    redundant += has_tag || at.size() >= min_lamps;
  }
  return redundant < 2;
}

std::optional<ShapeOfViews> GrowingMap::fitted_shape(int lamp) const {
  std::vector<ViewInPicture> views;
  for (const PlacedPicture& placed : map_.placed)
    for (const LampShapeView& view : pictures_[placed.picture].views)
      if (placed.lamp_of[view.blob] == lamp)
        views.push_back({&view, &input_[placed.picture].blobs[view.blob], placed.cam_from_map});
  if (views.empty()) return std::nullopt;
  Vector3d others = Vector3d::Zero();
  for (std::size_t other = 0; other < map_.lamps.size(); ++other)
    if (static_cast<int>(other) != lamp && map_.lamps[other].tag < 0)
      others += map_.lamps[other].normal;
  return shape_of_views(map_.lamps[lamp].position, map_.lamps[lamp].shape, views, camera_, others);
}

void GrowingMap::set_shape(int lamp, const ShapeOfViews& found) {
  MapLamp& known = map_.lamps[lamp];
  known.normal = found.lamp.normal;
  known.x_axis = long_side(found.lamp);
  known.size = found.size;
  if (!found.is_fitted) return;
  known.size_sigma = std::min(options_.size_spread, found.lamp.size_sigma);
  shapes_[lamp] = found.lamp;
}

void GrowingMap::fit_shapes() {
  shapes_.assign(map_.lamps.size(), std::nullopt);
  for (const int lamp : order_)
    if (const auto found = fitted_shape(lamp)) set_shape(lamp, *found);
}

void GrowingMap::update_shapes(const Network& network) {
  std::vector<bool> has_outline(network.points.size(), false);  // one that is adjusted
  for (const OutlineObservation& outline : network.outlines) {
    const ImageObservation& centre = network.observations[outline.observation];
    if (centre.used && precision_) has_outline[centre.target.point] = true;
  }
  std::vector<std::optional<Lamp>> before;
  before.swap(shapes_);
  shapes_.assign(map_.lamps.size(), std::nullopt);
  for (int lamp = 0; lamp < static_cast<int>(map_.lamps.size()); ++lamp) {
    const int point = point_of_lamp_[lamp];
    if (point < 0) continue;
    std::optional<ShapeOfViews> found;
    if (has_outline[point])
      found = adjusted_shape(network.points[point], precision_->outline(point), *before[lamp]);
    if (!found) found = fitted_shape(lamp);
    if (found) set_shape(lamp, *found);
  }
}

void GrowingMap::update_from(const Adjustment& adjustment) {
  const Network& network = adjustment.network;
  for (std::size_t i = 0; i < map_.placed.size(); ++i)
    map_.placed[i].cam_from_map = network.cam_from_world(static_cast<int>(i));
  const Result<Precision> known = precision(network, {}, options_.threads);
  precision_.reset();
  const double factor = square(std::max(1.0, adjustment.sigma0));
  if (known.ok()) precision_ = known->scaled(factor);
  if (known.ok() && !free_parameters_.empty()) {
    camera_ = network.cameras[0].camera;
    const Eigen::MatrixXd by_free = free_parameter_directions(camera_, free_parameters_);
    camera_ = camera_.with_parameter_covariance(by_free * precision_->parameters(0) *
                                                by_free.transpose());
  }
  for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp) {
    if (point_of_lamp_[lamp] < 0) continue;
    map_.lamps[lamp].position = network.points[point_of_lamp_[lamp]].position_m;
    if (!precision_) continue;
    const Matrix3d covariance = precision_->point(point_of_lamp_[lamp]);
    if (covariance.allFinite()) map_.lamps[lamp].covariance = covariance;
  }
  update_shapes(network);
  const std::vector<bool> is_adjusted_tag = update_tags(network);
  pose_left_out(network);
  std::vector<MapLamp> adjusted;
  for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp)
    if (point_of_lamp_[lamp] >= 0) adjusted.push_back(map_.lamps[lamp]);
  for (const PlacedPicture& placed : map_.placed)  // lamps of one picture move with it
    for (const LampShapeView& view : pictures_[placed.picture].views) {
      const int lamp = placed.lamp_of[view.blob];
      if (lamp < 0 || point_of_lamp_[lamp] >= 0 || is_adjusted_tag[lamp]) continue;
      const Matrix3d to_map = placed.cam_from_map.rotation.transpose();
      const LampSize size =
          size_of_further_lamp(view, placed.cam_from_map, adjusted, options_.size_spread);
      map_.lamps[lamp].size = size.size;
      map_.lamps[lamp].size_sigma = size.sigma;
      map_.lamps[lamp].position = placed.cam_from_map.inverse() * view_position(view, size.size);
      map_.lamps[lamp].covariance =
          to_map * view_covariance(view, size.size, size.sigma) * to_map.transpose();
    }
}

void GrowingMap::pose_left_out(const Network& network) {
  std::vector<char> is_used(map_.placed.size());
  for (const ImageObservation& observation : network.observations)
    if (observation.used) is_used[observation.image] = 1;
  for (std::size_t i = 0; i < map_.placed.size(); ++i) {
    if (is_used[i]) continue;
    PlacedPicture& placed = map_.placed[i];
    const PictureViews& picture = pictures_[placed.picture];
    MatchCandidates known;
    for (const LampShapeView& view : picture.views) {
      known.emplace_back();
      if (placed.lamp_of[view.blob] >= 0) known.back().push_back(placed.lamp_of[view.blob]);
    }
    const std::vector<MapMatch> matches =
        match_picture(picture, map_, pictures_, camera_, known, &placed.cam_from_map);
    if (!matches.empty()) placed.cam_from_map = matches[0].cam_from_map;
  }
}

std::vector<bool> GrowingMap::update_tags(const Network& network) {
  std::vector<bool> is_adjusted(map_.lamps.size(), false);
  for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp)
    for (std::size_t i = 0; i < network.bodies.size(); ++i) {
      MapLamp& tag = map_.lamps[lamp];
      const NetworkBody& body = network.bodies[i];
      if (tag.tag < 0 || body.name != tag_name(tag.tag)) continue;
      is_adjusted[lamp] = true;
      const Matrix3d& axes = body.world_from_body.rotation;
      const double side = body.scale * (body.corners_m.col(1) - body.corners_m.col(0)).norm();
      tag.position = body.world_from_body.translation;
      tag.normal = tag.normal.dot(axes.col(2)) > 0 ? Vector3d(axes.col(2)) : Vector3d(-axes.col(2));
      tag.x_axis = axes.col(0);
      tag.size = side / std::sqrt(pi);
      tag.size_sigma = options_.size_spread;
      if (!precision_) continue;
      Matrix3d mean = Matrix3d::Zero();  // of the corners, whose errors are common
      for (int k = 0; k < 4; ++k)
        mean += precision_->position(Target::of_corner(static_cast<int>(i), k)) / 4;
      if (mean.allFinite()) tag.covariance = mean;
    }
  return is_adjusted;
}

std::vector<TimedPose> GrowingMap::timed_poses() const {
  std::vector<TimedPose> poses;
  for (std::size_t i = 0; i < map_.placed.size(); ++i) {
    const std::optional<double>& time_s = input_[map_.placed[i].picture].time_s;
    const Matrix6 covariance =
        precision_ ? precision_->station(static_cast<int>(i)) : Matrix6(Matrix6::Zero());
    if (time_s && covariance.allFinite())
      poses.push_back({map_.placed[i].picture, *time_s, map_.placed[i].cam_from_map, covariance});
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; });
  const auto same_time = [](const TimedPose& a, const TimedPose& b) {
    return a.time_s == b.time_s;
  };
  poses.erase(std::unique(poses.begin(), poses.end(), same_time), poses.end());
  return poses;
}

int GrowingMap::drop_undetermined(const Result<Adjustment>& failed) {
  if (map_.placed.size() < 4) return 0;  // the rest would be no map
  const Network& network = failed->network;
  std::vector<int> used(map_.placed.size(), 0), rays(network.points.size(), 0);
  for (const ImageObservation& observation : network.observations)
    if (observation.used && observation.target.point >= 0) ++rays[observation.target.point];
  for (const ImageObservation& observation : network.observations)
    if (observation.used &&
        (observation.target.point < 0 || rays[observation.target.point] >= 2))  // or of a tag
      ++used[observation.image];
  // Without such a picture, those with the fewest lamps are the least determined.
  const int min_used = std::max(3, 1 + *std::min_element(used.begin(), used.end()));
  std::vector<PlacedPicture> kept;
  for (std::size_t i = 0; i < map_.placed.size(); ++i) {
    const int picture = map_.placed[i].picture;
    if (used[i] >= min_used) {
      place_of_[picture] = static_cast<int>(kept.size());
      kept.push_back(std::move(map_.placed[i]));
      continue;
    }
    place_of_[picture] = -1;
    dropped_[picture] = true;
    reasons_[picture] =
        used[i] < 3
            ? "fewer than three of its lamps agree with the other pictures"
            : "it shows the fewest lamps of a map that is not determined: " + failed.message;
  }
  const int count = static_cast<int>(map_.placed.size() - kept.size());
  map_.placed = std::move(kept);
  return count;
}

void GrowingMap::release_rejected(const Adjustment& adjusted) {
  for (const RejectedObservation& rejected : adjusted.rejected) {
    const ImageObservation& observation = adjusted.network.observations[rejected.observation];
    if (observation.target.point < 0) continue;
    std::vector<int>& lamp_of = map_.placed[observation.image].lamp_of;
    std::replace(lamp_of.begin(), lamp_of.end(), order_[observation.target.point], -1);
  }
}

int GrowingMap::drop_unconfirmed(const Adjustment& adjusted) {
  constexpr int min_used = 3;
  std::vector<int> used(order_.size(), 0);
  for (const ImageObservation& observation : adjusted.network.observations)
    if (observation.used && observation.target.point >= 0) ++used[observation.target.point];
  int count = 0;
  for (std::size_t point = 0; point < order_.size(); ++point) {
    const int lamp = order_[point];
    if (used[point] >= min_used || shapes_[lamp]) continue;
    ++count;
    for (PlacedPicture& placed : map_.placed)
      std::replace(placed.lamp_of.begin(), placed.lamp_of.end(), lamp, -1);
  }
  return count;
}

void GrowingMap::estimate_model_sigma(const Adjustment& adjustment) {
  constexpr int min_redundancy = 20;  // sigma0 is then known to 16 %
  constexpr double min_sigma_px = 0.002;
  double redundancy = adjustment.redundancy, squared = square(adjustment.sigma0) * redundancy;
  if (!adjustment.network.outlines.empty()) {  // those of the centres alone
    const auto found = network_statistics(adjustment.network, options_.threads);
    if (!found.ok()) return;
    redundancy = squared = 0;
    for (std::size_t i = 0; i < found->image_observations.size(); ++i) {
      const ObservationStatistics& one = found->image_observations[i];
      if (!one.used) continue;
      redundancy += one.redundancy.sum();
      squared +=
          one.residual_px.cwiseQuotient(adjustment.network.observations[i].sigma_px).squaredNorm();
    }
  }
  if (redundancy < min_redundancy) return;
  std::vector<double> noise;
  for (const PlacedPicture& placed : map_.placed)
    for (std::size_t b = 0; b < placed.lamp_of.size(); ++b)
      if (placed.lamp_of[b] >= 0)
        noise.push_back(0.5 * input_[placed.picture].blobs[b].covariance_px2.trace());
  const double variance = median(std::move(noise));
  const double observed = squared / redundancy * (variance + square(model_sigma_px_));
  model_sigma_px_ = std::sqrt(std::max(square(min_sigma_px), observed - variance));
}

Result<Adjustment> GrowingMap::adjust_all(const KnownLengths& lengths) {
  AdjustOptions options;
  options.threads = options_.threads;
  options.tolerance_sigma = 1e-4;  // far below the errors
  const auto callback = [&](const AdjustProgress& state) {
    report({"adjusting", state.iteration, 0});
    return true;
  };
  if (is_rough_) {
    // The drift between both positions of a joined lamp is no gross error, nor are errors of the
    // sizes that a start assumes: they are distributed first.
    is_rough_ = false;
    AdjustOptions plain = options;
    plain.robust = plain.snooping = false;
    const Result<Adjustment> spread = adjust(network_of(lengths), plain, callback);
    if (spread.ok()) update_from(*spread);
  }
  Result<Adjustment> adjusted = adjust(network_of(lengths), options, callback);
  if (adjusted.ok()) update_from(*adjusted);
  return adjusted;
}

Result<Adjustment> GrowingMap::adjust_without_lengths() {
  Result<Adjustment> adjusted = adjust_all();
  if (!adjusted.ok() && adjusted->network.outlines.empty()) {  // the rims may determine the map
    centres_have_failed_ = true;
    const Result<Adjustment> with_rims = adjust_all();
    centres_have_failed_ = with_rims.ok();
    if (with_rims.ok()) adjusted = with_rims;
  }
  while (!adjusted.ok() && drop_undetermined(adjusted) > 0) adjusted = adjust_all();
  return adjusted;
}

}  // namespace occ::internal::survey
