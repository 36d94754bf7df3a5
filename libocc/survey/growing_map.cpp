// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/growing_map.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/survey/internal/tag_views.hpp"

namespace occ::internal::survey {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Standard deviations of the parameters that are not exact; f_px for two focal lengths with errors
/// that keep their ratio.
std::map<std::string, double> sigmas_of(const Camera& camera) {
  std::map<std::string, double> sigmas;
  const std::vector<CameraParameter> parameters = camera.parameters();
  const Eigen::MatrixXd covariance = camera.parameter_covariance();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    if (covariance(i, i) > 0) sigmas[parameters[k].name] = std::sqrt(covariance(i, i));
  }
  const auto fx = sigmas.find("fx_px"), fy = sigmas.find("fy_px");
  constexpr double min_correlation = 0.999999;
  if (fx == sigmas.end() || fy == sigmas.end() ||
      covariance(0, 1) < min_correlation * fx->second * fy->second)
    return sigmas;
  sigmas["f_px"] = fx->second;
  sigmas.erase("fx_px");
  sigmas.erase("fy_px");
  return sigmas;
}

}  // namespace

GrowingMap::GrowingMap(const std::vector<SurveyPicture>& pictures, const Camera& camera,
                       const SurveyOptions& options, const SurveyCallback& progress)
    : input_(pictures),
      given_camera_(camera),
      camera_(camera),
      options_(options),
      progress_(progress),
      links_(pictures, link_notes_),
      model_sigma_px_(options.model_sigma_px),
      reasons_(pictures.size()) {
  if (options.calibrate_camera) {
    for (const auto& [name, sigma] : sigmas_of(camera)) {
      free_parameters_.push_back(name);
      priors_.push_back({0, name, free_parameter(camera, name).value, sigma});
    }
  }
  for (const SurveyPicture& picture : pictures) {
    PictureViews views;
    views.blobs = &picture.blobs;
    for (std::size_t b = 0; b < picture.blobs.size(); ++b)
      if (auto view = lamp_view(picture.blobs[b], static_cast<int>(b), camera))
        views.views.push_back(std::move(*view));
    pictures_.push_back(std::move(views));
  }
  place_of_.assign(pictures.size(), -1);
  ambiguous_.assign(pictures.size(), false);
  dropped_.assign(pictures.size(), false);
}

void GrowingMap::clear() {
  map_ = {};
  camera_ = given_camera_;
  shapes_.clear();
  point_of_lamp_.clear();
  precision_.reset();
  is_rough_ = centres_have_failed_ = false;
  std::fill(place_of_.begin(), place_of_.end(), -1);
  std::fill(reasons_.begin(), reasons_.end(), std::string());
  std::fill(ambiguous_.begin(), ambiguous_.end(), false);
  std::fill(dropped_.begin(), dropped_.end(), false);
}

int GrowingMap::min_views(int picture) const {
  const std::vector<LampShapeView>& views = pictures_[picture].views;
  const auto is_tag = [](const LampShapeView& view) { return view.tag >= 0; };
  return std::any_of(views.begin(), views.end(), is_tag) ? 3 : 4;
}

bool GrowingMap::has_several_sizes(int picture) const {
  const std::vector<LampShapeView>& views = pictures_[picture].views;
  return groups_of(views, true).count > groups_of(views, false).count;
}

void GrowingMap::start(int picture, bool by_plane) {
  clear();
  place_of_[picture] = 0;
  PlacedPicture placed;
  placed.picture = picture;
  placed.lamp_of.assign(input_[picture].blobs.size(), -1);
  map_.placed.push_back(placed);
  is_rough_ = true;
  const std::vector<LampShapeView>& views = pictures_[picture].views;
  const std::vector<LampSize> sizes =
      sizes_of(views, groups_of(views, by_plane), options_.size_spread);
  for (std::size_t v = 0; v < views.size(); ++v)
    map_.placed[0].lamp_of[views[v].blob] = add_lamp(views[v], Rigid3(), sizes[v], nullptr);
  // Lamps of one ceiling face one direction; the normal of each follows when pictures are joined.
  const Vector3d normal = common_normal(views);
  for (MapLamp& lamp : map_.lamps)
    if (lamp.tag < 0) lamp.normal = normal;
}

void GrowingMap::start(const std::vector<MapLamp>& known) {
  clear();
  map_.lamps = known;
}

int GrowingMap::add_lamp(const LampShapeView& view, const Rigid3& cam_from_map,
                         const LampSize& size, const Matrix6* pose_covariance) {
  const Matrix3d to_map = cam_from_map.rotation.transpose();
  const Vector3d in_cam = view_position(view, size.size);
  Matrix3d covariance = view_covariance(view, size.size, size.sigma);
  if (pose_covariance != nullptr) {
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << -skew(in_cam), Matrix3d::Identity();
    covariance += jacobian * *pose_covariance * jacobian.transpose();
  }
  MapLamp lamp;
  lamp.position = cam_from_map.inverse() * in_cam;
  lamp.covariance = to_map * covariance * to_map.transpose();
  lamp.tag = view.tag;
  lamp.shape = view.shape;
  lamp.aspect = aspect_of(view);
  lamp.size = size.size;
  lamp.size_sigma = size.sigma;
  lamp.normal = to_map * view.normals[0];
  lamp.x_axis = to_map * (view.tag < 0 ? long_side(view) : view.x_axis);
  if (!map_.lamps.empty()) {  // of both normals of a disc, the one like those of other lamps
    const Vector3d& other = map_.lamps[0].normal;
    for (const Vector3d& normal : view.normals)
      if (other.dot(to_map * normal) > other.dot(lamp.normal)) lamp.normal = to_map * normal;
  }
  map_.lamps.push_back(lamp);
  return static_cast<int>(map_.lamps.size()) - 1;
}

void GrowingMap::report(const SurveyProgress& state) const {
  if (progress_ && !progress_(state)) throw SurveyStopped();
}

bool GrowingMap::join(int picture) {
  report({"joining pictures", placed(), static_cast<int>(pictures_.size())});
  if (dropped_[picture]) return false;
  const int neighbour = options_.ordered ? placed_neighbour(picture) : -1;
  // A few lamps have no redundancy, and need the motion from a neighbour as evidence.
  const int min_matches = neighbour >= 0 ? 2 : min_views(picture);
  if (views(picture) < min_matches) {
    reasons_[picture] =
        "it shows " + std::to_string(views(picture)) +
        (views(picture) == 1 ? " whole lamp" : " whole lamps") + " with a measured rim" +
        (linked_blobs(picture) > 0 ? ", and too few known ones by tracks or ids" : "") +
        (options_.ordered && neighbour < 0 ? "; without a neighbour in the map, the minimum is "
                                           : "; the minimum is ") +
        std::to_string(min_matches);
    return false;
  }
  std::vector<int> all(map_.lamps.size());
  std::iota(all.begin(), all.end(), 0);
  MatchCandidates candidates = neighbour >= 0
                                   ? candidates_near(picture, neighbour)
                                   : MatchCandidates(pictures_[picture].views.size(), all);
  limit_by_codes(picture, candidates);
  std::vector<MapMatch> matches =
      match_picture(pictures_[picture], map_, pictures_, camera_, candidates,
                    neighbour >= 0 ? &map_.placed[neighbour].cam_from_map : nullptr);
  const bool has_matches = !matches.empty();
  if (neighbour >= 0) {
    matches = without_fast_motions(picture, std::move(matches));
    count_small_motions(picture, neighbour, matches);
  }
  const double max_log10 = options_.max_log10_false_alarms + (neighbour >= 0 ? neighbour_log10 : 0);
  const MatchVerdict verdict = judge_matches(matches, max_log10, min_matches);
  ambiguous_[picture] = verdict.kind == MatchVerdict::Kind::ambiguous;
  if (verdict.kind == MatchVerdict::Kind::matched) {
    place(picture, matches[0]);
    return true;
  }
  if (ambiguous_[picture]) {
    reasons_[picture] = "held back: it matches the map in " + std::to_string(verdict.ways) +
                        " ways, because the lamps are arranged regularly";
  } else if (matches.empty()) {
    reasons_[picture] =
        has_matches ? "it matches the map, but with a motion from its neighbour of more than "
                      "max_motion_rad: the camera moved too fast, or pictures are missing"
                    : "it does not match the map";
  } else {
    reasons_[picture] = "its best match with the map, of " + std::to_string(matches[0].matches) +
                        " lamps with " + std::to_string(matches[0].contradictions) +
                        " contradictions, may be accidental";
  }
  return false;
}

int GrowingMap::join_pictures() {
  const int count = static_cast<int>(pictures_.size());
  std::vector<int> visits;  // forwards and backwards, so that a recording grows from its start
  for (int i = 0; i < count; ++i) visits.push_back(i);
  if (options_.ordered)
    for (int i = count - 1; i >= 0; --i) visits.push_back(i);
  int joined = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (const int picture : visits) {
      if (place_of_[picture] >= 0) continue;
      if (options_.ordered && placed_neighbour(picture) < 0) continue;
      if (!join(picture)) continue;
      changed = true;
      ++joined;
    }
    if (changed || !options_.ordered) continue;
    // After a gap, such as a picture without lamps, a recording continues where the map decides.
    for (int picture = 0; picture < count && !changed; ++picture) {
      if (place_of_[picture] >= 0 || placed_neighbour(picture) >= 0 || !join(picture)) continue;
      changed = true;
      ++joined;
    }
  }
  return joined;
}

void GrowingMap::place(int picture, const MapMatch& match) {
  PlacedPicture placed;
  placed.picture = picture;
  placed.cam_from_map = match.cam_from_map;
  placed.lamp_of.assign(input_[picture].blobs.size(), -1);
  const Matrix3d to_map = match.cam_from_map.rotation.transpose();
  const std::vector<MapLamp> known_lamps = map_.lamps;
  for (std::size_t v = 0; v < match.lamp_of_view.size(); ++v) {
    const LampShapeView& view = pictures_[picture].views[v];
    const int lamp = match.lamp_of_view[v];
    if (lamp < 0) {
      placed.lamp_of[view.blob] = add_lamp(
          view, match.cam_from_map,
          size_of_further_lamp(view, match.cam_from_map, known_lamps, options_.size_spread),
          &match.covariance);
      continue;
    }
    placed.lamp_of[view.blob] = lamp;
    // Fusion of both positions, weighted by their covariances.
    MapLamp& known = map_.lamps[lamp];
    const Vector3d in_cam = view_position(view, known.size);
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << -skew(in_cam), Matrix3d::Identity();
    const Matrix3d seen = to_map *
                          (view_covariance(view, known.size, known.size_sigma) +
                           jacobian * match.covariance * jacobian.transpose()) *
                          to_map.transpose();
    const Matrix3d gain = known.covariance * core::inverse<Matrix3d>(known.covariance + seen);
    known.position += gain * (match.cam_from_map.inverse() * in_cam - known.position);
    known.covariance -= gain * known.covariance;
    known.covariance = (0.5 * (known.covariance + known.covariance.transpose())).eval();
  }
  add(std::move(placed));
}

void GrowingMap::add(PlacedPicture placed) {
  place_of_[placed.picture] = static_cast<int>(map_.placed.size());
  reasons_[placed.picture].clear();
  ambiguous_[placed.picture] = false;
  map_.placed.push_back(std::move(placed));
}

void GrowingMap::remove_unused_lamps() {
  const std::vector<int> counts = picture_counts();
  std::vector<int> index(map_.lamps.size(), -1);
  int kept = 0;
  for (std::size_t lamp = 0; lamp < map_.lamps.size(); ++lamp) {
    if (counts[lamp] == 0) continue;
    index[lamp] = kept;
    map_.lamps[kept] = map_.lamps[lamp];
    point_of_lamp_[kept] = point_of_lamp_[lamp];
    shapes_[kept] = shapes_[lamp];
    ++kept;
  }
  map_.lamps.resize(static_cast<std::size_t>(kept));
  point_of_lamp_.resize(static_cast<std::size_t>(kept));
  shapes_.resize(static_cast<std::size_t>(kept));
  for (PlacedPicture& placed : map_.placed)
    for (int& lamp : placed.lamp_of)
      if (lamp >= 0) lamp = index[lamp];
}

double GrowingMap::smallest_spacing() const {
  double smallest = infinity;
  for (const PlacedPicture& placed : map_.placed)
    for (std::size_t i = 0; i < placed.lamp_of.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const int a = placed.lamp_of[i], b = placed.lamp_of[j];
        if (a >= 0 && b >= 0)
          smallest = std::min(smallest, (map_.lamps[a].position - map_.lamps[b].position).norm());
      }
  return smallest;
}

bool GrowingMap::is_one_lamp(int a, int b, double spacing) const {
  if (map_.lamps[a].tag != map_.lamps[b].tag) return false;
  const Vector3d difference = map_.lamps[a].position - map_.lamps[b].position;
  // Two lamps cannot be nearer than their sizes.
  if (difference.norm() < std::min(map_.lamps[a].size, map_.lamps[b].size)) return true;
  // When a recording returns, its drift separates the two positions of a lamp. Drift beyond a
  // quarter of the spacing of lamps may also lead to the next lamp, and decides nothing.
  if (!(difference.norm() < 0.25 * spacing) || !precision_ || point_of_lamp_[a] < 0 ||
      point_of_lamp_[b] < 0)
    return false;
  const Matrix6 joint = precision_->positions(Target::of_point(point_of_lamp_[a]),
                                              Target::of_point(point_of_lamp_[b]));
  if (!joint.allFinite()) return false;
  const Matrix3d covariance = joint.topLeftCorner<3, 3>() + joint.bottomRightCorner<3, 3>() -
                              joint.topRightCorner<3, 3>() - joint.bottomLeftCorner<3, 3>();
  constexpr double max_chi2 = 21.1;  // exceeded with probability 1e-4, 3 degrees of freedom
  return difference.dot(core::inverse<Matrix3d>(covariance) * difference) < max_chi2;
}

int GrowingMap::reassign() {
  int changes = 0;
  const auto replace = [&](int from, int to) {
    for (PlacedPicture& placed : map_.placed)
      for (int& lamp : placed.lamp_of)
        if (lamp == from) lamp = to;
    ++changes;
  };
  const int count = static_cast<int>(map_.lamps.size());
  std::vector<int> counts = picture_counts();
  const auto share_a_picture = [&](int a, int b) {
    for (const PlacedPicture& placed : map_.placed)
      if (std::count(placed.lamp_of.begin(), placed.lamp_of.end(), a) > 0 &&
          std::count(placed.lamp_of.begin(), placed.lamp_of.end(), b) > 0)
        return true;
    return false;
  };
  const double spacing = smallest_spacing();
  const std::vector<std::optional<int>> codes = codes_of_lamps();
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) {
      if (counts[a] == 0 || counts[b] == 0 || (codes[a] && codes[b] && *codes[a] != *codes[b]) ||
          share_a_picture(a, b) || !is_one_lamp(a, b, spacing))
        continue;
      replace(b, a);
      counts[a] += counts[b];
      counts[b] = 0;
      is_rough_ = true;
    }
  for (PlacedPicture& placed : map_.placed) {
    const std::vector<Blob>& blobs = input_[placed.picture].blobs;
    for (int lamp = 0; lamp < count; ++lamp) {
      if (counts[lamp] < 2 || std::count(placed.lamp_of.begin(), placed.lamp_of.end(), lamp) > 0)
        continue;
      const auto px = camera_.project(placed.cam_from_map * map_.lamps[lamp].position);
      if (!px) continue;
      for (std::size_t b = 0; b < blobs.size(); ++b) {
        const Blob& blob = blobs[b];
        if (blob.cut_by_border || blob.merged || map_.lamps[lamp].tag != tag_of(blob).value_or(-1))
          continue;
        const int other = placed.lamp_of[b];
        if (other >= 0 && counts[other] >= 2) continue;
        const auto code = links_.code(links_.link(placed.picture, static_cast<int>(b)));
        if (code && codes[lamp] && *code != *codes[lamp]) continue;
        constexpr double max_distance_px = 2;  // error of an adjusted map and a centre's bias
        const double gate = max_distance_px + 4 * std::sqrt(blob.covariance_px2.trace());
        if (camera_.difference_px(*px, blob.centroid_px).norm() > gate) continue;
        placed.lamp_of[b] = lamp;
        ++changes;
        break;
      }
    }
  }
  remove_unused_lamps();
  return changes;
}

void GrowingMap::transform(const Similarity& similarity) {
  const double s = similarity.scale;
  for (MapLamp& lamp : map_.lamps) {
    lamp.position = similarity * lamp.position;
    lamp.covariance =
        s * s * similarity.rotation * lamp.covariance * similarity.rotation.transpose();
    lamp.normal = similarity.rotation * lamp.normal;
    lamp.x_axis = similarity.rotation * lamp.x_axis;
    lamp.size *= s;
  }
  for (std::optional<Lamp>& shape : shapes_) {
    if (!shape) continue;
    shape->centre_m = similarity * shape->centre_m;
    shape->normal = similarity.rotation * shape->normal;
    shape->x_axis = similarity.rotation * shape->x_axis;
    shape->radius_m *= s;
    shape->size_m *= s;
  }
  for (PlacedPicture& placed : map_.placed) {
    Rigid3& pose = placed.cam_from_map;  // s (pose X) as a function of X' = s R X + t
    const Matrix3d rotation = pose.rotation * similarity.rotation.transpose();
    pose.translation = s * pose.translation - rotation * similarity.translation;
    pose.rotation = rotation;
  }
}

}  // namespace occ::internal::survey
