// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/scene/internal/vignetting.hpp"

namespace occ::internal::identify {

using namespace internal::scene;
namespace {

void add_targets(AssignmentProblem& problem, std::vector<MapPoint> targets) {
  for (const MapPoint& target : targets)
    problem.origin += target.centre / static_cast<double>(targets.size());
  for (MapPoint& target : targets) {
    target.centre -= problem.origin;
    problem.size_m = std::max(problem.size_m, target.centre.norm());
  }
  problem.targets = std::move(targets);
}

MapPoint target_of(const Lamp& lamp) {
  MapPoint target{lamp.centre_m, lamp.normal.normalized(), lamp.reach_m(),
                  lamp.shape == LampShape::disc};
  target.power_w = lamp.power_w;
  target.power_sigma = lamp.power_sigma;
  target.order = lamp.order();
  target.steady = !lamp.frequency_hz;
  return target;
}

std::vector<MapPoint> targets_of(const std::vector<Lamp>& lamps) {
  std::vector<MapPoint> targets;
  for (const Lamp& lamp : lamps) targets.push_back(target_of(lamp));
  return targets;
}

std::vector<MapPoint> targets_of(const Object& object) {
  constexpr double everywhere = -2;
  constexpr double sure_rad = 0.1;  // so near to the cone's edge a point may be overlooked
  std::vector<MapPoint> targets;
  for (const ObjectPoint& point : object.points) {
    MapPoint target{point.position_m, point.normal.normalized(), point.radius_m,
                    point.radius_m > 0};
    const double cosine = std::cos(point.cone_rad);
    if (point.cone_rad >= pi) {
      target.cone_cos = target.sure_cos = everywhere;
    } else {
      target.cone_cos = std::abs(cosine) < 1e-15 ? 0 : cosine;
      target.sure_cos = std::cos(std::max(0.5 * point.cone_rad, point.cone_rad - sure_rad));
    }
    targets.push_back(target);
  }
  return targets;
}

// Lamps in one place, such as the emitters of three colours, or a lamp that the map has twice: no
// geometry tells them apart, so the first stands for all. Their light is not that of one.
void mark_twins(AssignmentProblem& problem) {
  const double one_place_m = 1e-4 * problem.size_m;
  std::vector<MapPoint>& targets = problem.targets;
  std::vector<std::size_t> by_x(targets.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::stable_sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) {
    return targets[a].centre.x() < targets[b].centre.x();
  });
  for (std::size_t i = 0; i < by_x.size(); ++i)
    for (std::size_t j = i + 1; j < by_x.size(); ++j) {
      MapPoint &a = targets[by_x[i]], &b = targets[by_x[j]];
      if (b.centre.x() - a.centre.x() > one_place_m) break;
      if ((a.centre - b.centre).norm() > one_place_m || a.normal.dot(b.normal) < 0.5) continue;
      (by_x[i] < by_x[j] ? b : a).twin = true;
      a.power_w = b.power_w = 0;
    }
}

Eigen::Matrix<double, 2, 3> tangent_plane(const Eigen::Vector3d& bearing) {
  Eigen::Index smallest = 0;
  bearing.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d first = bearing.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  Eigen::Matrix<double, 2, 3> rows;
  rows << first.transpose(), bearing.cross(first).transpose();
  return rows;
}

// A disc's apparent radius is that of its ellipse's longer axis: lamp radius over distance. Rims of
// saturated lamps have grown.
void measure_size(const Blob& blob, const Eigen::Matrix2d& rad_per_px, BearingObservation& s) {
  constexpr double tolerance = 1.3, error_px = 1, growth_px = 5;
  if (blob.rim.empty() || blob.merged) return;
  const Eigen::Vector2d axis(std::cos(blob.ellipse.angle_rad), std::sin(blob.ellipse.angle_rad));
  const Eigen::Vector2d across(-axis.y(), axis.x());
  const double radius_rad = std::max((rad_per_px * axis).norm() * blob.ellipse.semi_major_px,
                                     (rad_per_px * across).norm() * blob.ellipse.semi_minor_px);
  const double pixel_rad = rad_per_px.norm();
  const double grown_px = blob.saturated ? growth_px : 0;
  s.min_radius_rad = (radius_rad - (error_px + grown_px) * pixel_rad) / tolerance;
  s.largest_radius_rad = (radius_rad + error_px * pixel_rad) * tolerance;
  if (blob.saturated || blob.cut_by_border || blob.striped || !(blob.ellipse.semi_minor_px > 0))
    return;
  constexpr double model = 0.05;  // relative; a pixel's error weighs on small discs
  s.radius_rad = radius_rad;
  s.radius_sigma = std::hypot(model, error_px / blob.ellipse.semi_minor_px);
  s.flatness = blob.ellipse.semi_minor_px / blob.ellipse.semi_major_px;
}

// A flux without a sigma has not been measured.
void measure_flux(const Blob& blob, const Scene& scene, BearingObservation& s) {
  if (!(blob.flux_dn > 0 && blob.flux_sigma_dn > 0) || blob.merged) return;
  const double transmission = Vignetting(scene).transmission(blob.centroid_px);
  if (!(transmission > 0)) return;
  s.flux = blob.flux_dn / transmission;
  s.flux_sigma = blob.flux_sigma_dn / blob.flux_dn;
  s.flux_is_bound = blob.saturated || blob.cut_by_border || blob.striped;
}

// Whether enough of a lamp is inside the image that the ellipse through its rim has its centre.
bool is_almost_whole(const Blob& blob) {
  constexpr double share = 0.7;
  return !blob.rim.empty() && !blob.merged &&
         blob.area_px > share * pi * blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px;
}

// Nothing when the pixel is outside the camera's domain.
std::optional<BearingObservation> make_sighting(const AssignmentProblem& problem, int blob_index) {
  constexpr double min_variance_px2 = 1e-8;  // noise-free blobs under a perfect model
  constexpr double cut_sigma_px = 0.5;       // an ellipse through part of a rim
  const Blob& blob = (*problem.blobs)[blob_index];
  Eigen::Matrix<double, 3, 2> jacobian;
  const auto bearing = problem.camera->unproject(blob.centroid_px, &jacobian);
  if (!bearing) return std::nullopt;
  BearingObservation s;
  s.blob = blob_index;
  s.bearing = *bearing;
  s.tangent = tangent_plane(s.bearing);
  s.axis = problem.camera->is_pinhole() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : s.bearing;
  if (!problem.camera->is_central()) {
    s.origin = problem.camera->ray(blob.centroid_px)->origin;
    s.parallax_rad = s.origin.norm() / problem.size_m;
  }
  const double model = problem.options->model_sigma_px, cut = blob.cut_by_border ? cut_sigma_px : 0;
  const Eigen::Matrix2d pixel_covariance =
      blob.covariance_px2 +
      (model * model + cut * cut + min_variance_px2) * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d across = s.tangent * jacobian;
  s.covariance = across * pixel_covariance * across.transpose();
  s.sigma_rad = std::sqrt(s.covariance.trace() + s.parallax_rad * s.parallax_rad);
  measure_size(blob, across, s);
  if (problem.scene) measure_flux(blob, *problem.scene, s);
  return s;
}

// A lamp that says its id has a frequency, too: of its packets.
bool blinks(const Lamp& lamp) { return lamp.frequency_hz && !lamp.code; }

// Lamps whose code agrees with the blob's frequency and is as near to it as any; none when the
// frequency is absent or fits no code.
std::vector<int> lamps_of_frequency(const Blob& blob, const AssignmentProblem& problem) {
  std::vector<int> lamps;
  if (!problem.scene || !problem.options->use_frequency || !blob.frequency_hz) return lamps;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < static_cast<int>(problem.targets.size()); ++i) {
    const Lamp& lamp = problem.scene->lamps[i];
    if (!blinks(lamp)) continue;
    const double code = *lamp.frequency_hz, off = std::abs(*blob.frequency_hz - code);
    const double gate = problem.options->frequency_gate_sigma * blob.frequency_sigma_hz +
                        problem.options->frequency_tolerance * code;
    if (!(off <= gate) || off > nearest) continue;
    if (off < nearest) lamps.clear();
    nearest = off;
    lamps.push_back(i);
  }
  return lamps;
}

// The lamp whose id the blob's code told; none for a light that is in no map.
std::vector<int> lamp_of_id(const Blob& blob, const AssignmentProblem& problem) {
  if (!problem.scene) return {};
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  const auto told = std::find_if(lamps.begin(), lamps.end(),
                                 [&](const Lamp& lamp) { return lamp.id == blob.lamp_id; });
  if (told == lamps.end()) return {};
  return {static_cast<int>(told - lamps.begin())};
}

void name_by_code(BearingObservation& s, const AssignmentProblem& problem) {
  const Blob& blob = (*problem.blobs)[s.blob];
  s.lamps = blob.lamp_id ? lamp_of_id(blob, problem) : lamps_of_frequency(blob, problem);
  s.named = !s.lamps.empty();
  if (s.named || blob.lamp_id) return;
  for (int i = 0; i < static_cast<int>(problem.targets.size()); ++i)
    if (!problem.target(i).twin) s.lamps.push_back(i);
}

// Where codes are legible, a light without one is no coded lamp: three lamps named by their codes
// show that they are. What then can be no lamp at all is left out.
void rule_out_by_code(AssignmentProblem& problem) {
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  std::vector<char> named(lamps.size(), 0);
  for (const BearingObservation& s : problem.sightings)
    if (s.named) named[s.lamps.front()] = 1;
  if (std::count(named.begin(), named.end(), 1) < 3) return;
  const auto coded = [&](int lamp) { return blinks(lamps[lamp]); };
  for (BearingObservation& s : problem.sightings)
    if (!s.named)
      s.lamps.erase(std::remove_if(s.lamps.begin(), s.lamps.end(), coded), s.lamps.end());
  problem.sightings.erase(
      std::remove_if(problem.sightings.begin(), problem.sightings.end(),
                     [](const BearingObservation& s) { return s.lamps.empty(); }),
      problem.sightings.end());
}

// A merged blob serves as a whole one when there are too few of those and something else than its
// vague place, a code or a prior, can speak for what is made of it.
void add_sightings(AssignmentProblem& problem) {
  const std::vector<Blob>& blobs = *problem.blobs;
  const auto is_cut = [](const Blob& b) { return b.cut_by_border && !is_almost_whole(b); };
  const auto whole = std::count_if(blobs.begin(), blobs.end(),
                                   [&](const Blob& b) { return !is_cut(b) && !b.merged; });
  for (int i = 0; i < static_cast<int>(blobs.size()); ++i) {
    const Blob& blob = blobs[i];
    const bool serves = whole < 3 && (blob.frequency_hz || problem.options->prior);
    if (is_cut(blob) || (blob.merged && !serves)) {
      problem.weak_blobs.push_back(i);
    } else if (std::optional<BearingObservation> s = make_sighting(problem, i)) {
      name_by_code(*s, problem);
      problem.sightings.push_back(std::move(*s));
    }
  }
  if (problem.scene) rule_out_by_code(problem);
  std::stable_sort(problem.sightings.begin(), problem.sightings.end(),
                   [&](const BearingObservation& a, const BearingObservation& b) {
                     if (a.named != b.named) return a.named;
                     return blobs[a.blob].flux_dn > blobs[b.blob].flux_dn;
                   });
  if (problem.sightings.size() > max_sightings) problem.sightings.resize(max_sightings);
}

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene* scene,
                               std::vector<MapPoint> targets, const Camera& camera,
                               const IdentifyOptions& options) {
  AssignmentProblem problem;
  problem.blobs = &blobs;
  problem.camera = &camera;
  problem.scene = scene;
  problem.all_together = scene != nullptr;
  problem.options = &options;
  add_targets(problem, std::move(targets));
  mark_twins(problem);
  add_sightings(problem);
  problem.allowed.assign(problem.sightings.size() * problem.targets.size(), 0);
  for (std::size_t i = 0; i < problem.sightings.size(); ++i)
    for (const int lamp : problem.sightings[i].lamps)
      problem.allowed[i * problem.targets.size() + static_cast<std::size_t>(lamp)] = 1;
  return problem;
}

}  // namespace

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene& scene,
                               const IdentifyOptions& options) {
  return make_problem(blobs, &scene, targets_of(scene.lamps), scene.camera, options);
}

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Object& object,
                               const Camera& camera, const IdentifyOptions& options) {
  return make_problem(blobs, nullptr, targets_of(object), camera, options);
}

}  // namespace occ::internal::identify
