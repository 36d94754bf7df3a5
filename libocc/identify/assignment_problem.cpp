// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/assignment_problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"
#include "libocc/scene/internal/vignetting.hpp"

namespace occ::internal::identify {

using namespace internal::scene;
namespace {

void add_map_points(AssignmentProblem& problem, std::vector<MapPoint> map_points) {
  for (const MapPoint& map_point : map_points)
    problem.origin += map_point.centre / static_cast<double>(map_points.size());
  for (MapPoint& map_point : map_points) {
    map_point.centre -= problem.origin;
    problem.size_m = std::max(problem.size_m, map_point.centre.norm());
  }
  problem.map_points = std::move(map_points);
}

void add_errors_of_map(AssignmentProblem& problem) {
  problem.min_radius_m = std::numeric_limits<double>::infinity();
  for (const Lamp& lamp : problem.scene->lamps) {
    problem.min_radius_m = std::min(problem.min_radius_m, lamp.reach_m());
    problem.map_variance_m2 =
        std::max(problem.map_variance_m2, problem.scene->position_variance_m2(lamp).maxCoeff());
  }
}

MapPoint to_map_point(const Lamp& lamp) {
  MapPoint map_point{lamp.centre_m, lamp.normal.normalized(), lamp.reach_m(),
                     lamp.shape == LampShape::disc};
  map_point.size_sigma = lamp.size_sigma;
  map_point.power_w = lamp.power_w;
  map_point.power_sigma = lamp.power_sigma;
  map_point.order = lamp.order();
  if (lamp.photometry) map_point.measured = std::make_shared<const scene::LampEmission>(lamp);
  map_point.steady = !lamp.frequency_hz;
  return map_point;
}

std::vector<MapPoint> to_map_points(const std::vector<Lamp>& lamps) {
  std::vector<MapPoint> map_points;
  for (const Lamp& lamp : lamps) map_points.push_back(to_map_point(lamp));
  return map_points;
}

std::vector<MapPoint> to_map_points(const Object& object) {
  constexpr double everywhere = -2;
  constexpr double sure_rad = 0.1;  // margin at the cone's edge, where a point may be overlooked
  std::vector<MapPoint> map_points;
  for (const ObjectPoint& point : object.points) {
    MapPoint map_point{point.position_m, point.normal.normalized(), point.radius_m,
                       point.radius_m > 0};
    const double cosine = std::cos(point.cone_rad);
    if (point.cone_rad >= pi) {
      map_point.cone_cos = map_point.reliable_cos = everywhere;
    } else {
      map_point.cone_cos = std::abs(cosine) < 1e-15 ? 0 : cosine;
      map_point.reliable_cos = std::cos(std::max(0.5 * point.cone_rad, point.cone_rad - sure_rad));
    }
    map_points.push_back(map_point);
  }
  return map_points;
}

// Marks lamps at one position, such as the emitters of three colours or a lamp listed twice.
// Geometry cannot distinguish them, so the first represents all. Its power is unknown.
void mark_duplicates(AssignmentProblem& problem) {
  const double one_place_m = 1e-4 * problem.size_m;
  std::vector<MapPoint>& map_points = problem.map_points;
  std::vector<std::size_t> by_x(map_points.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::stable_sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) {
    return map_points[a].centre.x() < map_points[b].centre.x();
  });
  for (std::size_t i = 0; i < by_x.size(); ++i)
    for (std::size_t j = i + 1; j < by_x.size(); ++j) {
      MapPoint &a = map_points[by_x[i]], &b = map_points[by_x[j]];
      if (b.centre.x() - a.centre.x() > one_place_m) break;
      if ((a.centre - b.centre).norm() > one_place_m || a.normal.dot(b.normal) < 0.5) continue;
      (by_x[i] < by_x[j] ? b : a).duplicate = true;
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

// The apparent radius of a disc, lamp radius over distance, is the semi-major axis of its image.
// The rim of a saturated blob lies outside the true rim.
void measure_size(const Blob& blob, const Eigen::Matrix2d& rad_per_px, BearingObservation& s) {
  constexpr double tolerance = 1.3, error_px = 1, growth_px = 5;
  if (blob.rim.empty() || blob.merged || blob.has_hidden_sides()) return;
  const Eigen::Vector2d axis(std::cos(blob.ellipse.angle_rad), std::sin(blob.ellipse.angle_rad));
  const Eigen::Vector2d across(-axis.y(), axis.x());
  const double radius_rad = std::max((rad_per_px * axis).norm() * blob.ellipse.semi_major_px,
                                     (rad_per_px * across).norm() * blob.ellipse.semi_minor_px);
  const double pixel_rad = rad_per_px.norm();
  const double grown_px = blob.saturated ? growth_px : 0;
  s.min_radius_rad = (radius_rad - (error_px + grown_px) * pixel_rad) / tolerance;
  s.max_radius_rad = (radius_rad + error_px * pixel_rad) * tolerance;
  if (blob.saturated || blob.cut_by_border || blob.striped || !(blob.ellipse.semi_minor_px > 0))
    return;
  constexpr double model = 0.05;  // relative error; the pixel error matters for small discs
  s.radius_rad = radius_rad;
  s.radius_sigma = std::hypot(model, error_px / blob.ellipse.semi_minor_px);
  s.flatness = blob.ellipse.semi_minor_px / blob.ellipse.semi_major_px;
}

// A flux without a sigma is not a measurement and is ignored.
void measure_flux(const Blob& blob, const Scene& scene, BearingObservation& s) {
  if (!(blob.flux_dn > 0 && blob.flux_sigma_dn > 0) || blob.merged) return;
  const double transmission = Vignetting(scene).transmission(blob.centroid_px);
  if (!(transmission > 0)) return;
  s.flux = blob.flux_dn / transmission;
  s.flux_sigma = blob.flux_sigma_dn / blob.flux_dn;
  s.flux_is_bound = blob.flux_is_lower_bound();
}

// True if enough of a lamp is inside the image for the ellipse through its rim to give the centre.
// The ellipse of a lamp with corners, which the border cuts, does not.
bool is_almost_whole(const Blob& blob) {
  constexpr double share = 0.7;
  return !blob.rim.empty() && !blob.merged && !blob.free_form && blob.corners_px.empty() &&
         blob.area_px > share * pi * blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px;
}

// Covariance of a pixel by the errors of the camera's parameters.
Eigen::Matrix2d covariance_of_camera(const AssignmentProblem& problem,
                                     const Eigen::Vector3d& bearing) {
  Camera::ParameterJacobian by_parameters;
  if (!problem.camera->project(problem.size_m * bearing, nullptr, &by_parameters))
    return Eigen::Matrix2d::Zero();
  return by_parameters * problem.camera->parameter_covariance() * by_parameters.transpose();
}

// Variance of the direction of a lamp by the errors of its position, at the distance that its size
// in the image shows for the smallest lamp, or at that of the map's size. Errors along the line of
// sight are included, because the direction to the lamp is not known yet.
double map_variance_rad2(const AssignmentProblem& problem, const Blob& blob,
                         const Eigen::Matrix2d& rad_per_px) {
  if (problem.map_variance_m2 == 0) return 0;
  double distance_m = problem.size_m;
  const double radius_rad = rad_per_px.norm() / std::sqrt(2.0) * blob.ellipse.semi_major_px;
  if (problem.min_radius_m > 0 && radius_rad > 0)
    distance_m = std::min(distance_m, problem.min_radius_m / radius_rad);
  return problem.map_variance_m2 / square(distance_m);
}

// Direction of a lamp's centre: the diagonals of a rectangle meet there, in any perspective. The
// centroid of the image of a large tilted one is several pixels away. Empty for other shapes.
std::optional<Eigen::Vector3d> bearing_of_diagonals(const Blob& blob, const Camera& camera) {
  constexpr std::size_t corners = 4;
  if (blob.corners_px.size() != corners || blob.cut_by_border || blob.hidden_in_part ||
      !camera.is_central())
    return std::nullopt;
  std::array<Eigen::Vector3d, corners> bearings;
  for (std::size_t i = 0; i < corners; ++i) {
    const auto bearing = camera.unproject(blob.corners_px[i]);
    if (!bearing) return std::nullopt;
    bearings[i] = *bearing;
  }
  const Eigen::Vector3d first = bearings[0].cross(bearings[2]);
  const Eigen::Vector3d centre = first.cross(bearings[1].cross(bearings[3]));
  if (!(centre.norm() > 0)) return std::nullopt;
  return std::copysign(1.0, centre.dot(bearings[0])) * centre.normalized();
}

// Returns nothing when the pixel is outside the camera's domain.
std::optional<BearingObservation> make_observation(const AssignmentProblem& problem,
                                                   int blob_index) {
  constexpr double min_variance_px2 =
      1e-8;  // keeps the covariance positive for noise-free blobs and a perfect model
  constexpr double cut_sigma_px = 0.5;  // error of an ellipse fitted to part of a rim
  const Blob& blob = (*problem.blobs)[blob_index];
  Eigen::Matrix<double, 3, 2> jacobian;
  const auto bearing = problem.camera->unproject(blob.centroid_px, &jacobian);
  if (!bearing) return std::nullopt;
  BearingObservation s;
  s.blob = blob_index;
  const auto of_centre = problem.has_polygons ? std::optional<Eigen::Vector3d>()
                                              : bearing_of_diagonals(blob, *problem.camera);
  s.bearing = of_centre.value_or(*bearing);
  s.of_centre = of_centre.has_value();
  s.tangent = tangent_plane(s.bearing);
  s.axis = problem.camera->is_pinhole() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : s.bearing;
  if (!problem.camera->is_central()) {
    s.origin = problem.camera->ray(blob.centroid_px)->origin;
    s.parallax_rad = s.origin.norm() / problem.size_m;
  }
  const double model = problem.options->model_sigma_px, cut = blob.cut_by_border ? cut_sigma_px : 0;
  Eigen::Matrix2d pixel_covariance =
      blob.covariance_px2 +
      (model * model + cut * cut + min_variance_px2) * Eigen::Matrix2d::Identity();
  if (!problem.camera->is_exact()) pixel_covariance += covariance_of_camera(problem, *bearing);
  const Eigen::Matrix2d across = s.tangent * jacobian;
  s.covariance = across * pixel_covariance * across.transpose();
  s.covariance += map_variance_rad2(problem, blob, across) * Eigen::Matrix2d::Identity();
  s.sigma_rad = std::sqrt(s.covariance.trace() + s.parallax_rad * s.parallax_rad);
  measure_size(blob, across, s);
  if (problem.scene) measure_flux(blob, *problem.scene, s);
  return s;
}

// A lamp that transmits an id has a frequency as well, that of its packets.
bool blinks(const Lamp& lamp) { return lamp.frequency_hz && !lamp.code; }

// Returns the lamps whose frequency agrees with the blob's within the gate; of these the nearest
// ones.
std::vector<int> lamps_of_frequency(const Blob& blob, const AssignmentProblem& problem) {
  std::vector<int> lamps;
  if (!problem.scene || !problem.options->use_frequency || !blob.frequency_hz) return lamps;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < static_cast<int>(problem.map_points.size()); ++i) {
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

// Returns the lamp whose id was decoded from the blob; empty for an id that is not in the map.
std::vector<int> lamp_of_id(const Blob& blob, const AssignmentProblem& problem) {
  if (!problem.scene) return {};
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  const auto lamp =
      std::find_if(lamps.begin(), lamps.end(), [&](const Lamp& l) { return l.id == blob.lamp_id; });
  if (lamp == lamps.end()) return {};
  return {static_cast<int>(lamp - lamps.begin())};
}

void assign_by_code(BearingObservation& s, const AssignmentProblem& problem) {
  const Blob& blob = (*problem.blobs)[s.blob];
  s.lamps = blob.lamp_id ? lamp_of_id(blob, problem) : lamps_of_frequency(blob, problem);
  s.coded = !s.lamps.empty();
  if (s.coded || blob.lamp_id) return;
  for (int i = 0; i < static_cast<int>(problem.map_points.size()); ++i)
    if (!problem.map_point(i).duplicate) s.lamps.push_back(i);
}

void exclude_by_shape(BearingObservation& s, const AssignmentProblem& problem) {
  const Blob& blob = (*problem.blobs)[s.blob];
  if (!problem.scene || blob.corners_px.empty()) return;
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  const auto differs = [&](int lamp) { return !lamps[lamp].may_show(blob); };
  s.lamps.erase(std::remove_if(s.lamps.begin(), s.lamps.end(), differs), s.lamps.end());
}

// Three lamps identified by their codes show that codes are legible. Then a blob without a code
// cannot be a blinking lamp; blobs without any candidate lamp are removed.
void exclude_by_code(AssignmentProblem& problem) {
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  std::vector<char> read(lamps.size(), 0);
  for (const BearingObservation& s : problem.observations)
    if (s.coded) read[s.lamps.front()] = 1;
  if (std::count(read.begin(), read.end(), 1) < 3) return;
  const auto coded = [&](int lamp) { return blinks(lamps[lamp]); };
  for (BearingObservation& s : problem.observations)
    if (!s.coded)
      s.lamps.erase(std::remove_if(s.lamps.begin(), s.lamps.end(), coded), s.lamps.end());
  problem.observations.erase(
      std::remove_if(problem.observations.begin(), problem.observations.end(),
                     [](const BearingObservation& s) { return s.lamps.empty(); }),
      problem.observations.end());
}

// Removes the lamps that the blob's colour contradicts. Returns false if none remains.
bool exclude_by_colour(const ColourTest& colours, const Blob& blob, BearingObservation& s) {
  if (!colours.is_active() || !blob.colour || s.lamps.empty()) return true;
  const auto contradicted = [&](int lamp) { return colours.contradicts(lamp, blob); };
  s.lamps.erase(std::remove_if(s.lamps.begin(), s.lamps.end(), contradicted), s.lamps.end());
  return !s.lamps.empty();
}

// Adds the whole blobs as observations. Blobs of another colour than all lamps are left out. A
// merged blob is used like a whole one if fewer than three are whole and a frequency or a prior can
// confirm the result, because its centroid is inaccurate.
void add_observations(AssignmentProblem& problem) {
  const std::vector<Blob>& blobs = *problem.blobs;
  const std::vector<Lamp> none;
  const ColourTest colours(problem.scene ? problem.scene->lamps : none);
  const auto is_cut = [](const Blob& b) { return b.cut_by_border && !is_almost_whole(b); };
  std::ptrdiff_t whole = 0;
  for (const Blob& blob : blobs) {
    problem.foreign.push_back(colours.contradicts_all(blob));
    whole += !problem.foreign.back() && !is_cut(blob) && !blob.merged;
  }
  const bool prior = problem.options->prior && !problem.options->prior->empty();
  for (int i = 0; i < static_cast<int>(blobs.size()); ++i) {
    if (problem.foreign[static_cast<std::size_t>(i)]) continue;
    const Blob& blob = blobs[i];
    const bool serves = whole < 3 && (blob.frequency_hz || prior);
    if (is_cut(blob) || (blob.merged && !serves)) {
      problem.partial_blobs.push_back(i);
    } else if (std::optional<BearingObservation> s = make_observation(problem, i)) {
      assign_by_code(*s, problem);
      if (!exclude_by_colour(colours, blob, *s)) continue;
      exclude_by_shape(*s, problem);
      if (s->lamps.empty() && !blob.corners_px.empty())
        problem.partial_blobs.push_back(i);
      else
        problem.observations.push_back(std::move(*s));
    }
  }
  if (problem.scene) exclude_by_code(problem);
  std::stable_sort(problem.observations.begin(), problem.observations.end(),
                   [&](const BearingObservation& a, const BearingObservation& b) {
                     if (a.coded != b.coded) return a.coded;
                     return blobs[a.blob].flux_dn > blobs[b.blob].flux_dn;
                   });
  if (problem.observations.size() > max_observations) problem.observations.resize(max_observations);
}

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene* scene,
                               std::vector<MapPoint> map_points, const Camera& camera,
                               const IdentifyOptions& options) {
  AssignmentProblem problem;
  problem.blobs = &blobs;
  problem.camera = &camera;
  problem.scene = scene;
  problem.all_covisible = scene != nullptr;
  problem.has_polygons =
      scene && std::any_of(scene->lamps.begin(), scene->lamps.end(),
                           [](const Lamp& lamp) { return lamp.shape == LampShape::polygon; });
  problem.options = &options;
  constexpr double max_timed_s = 1e6;  // longer times are unlimited and would overflow the clock
  if (options.max_time_s < max_timed_s)
    problem.deadline = std::chrono::steady_clock::now() +
                       std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                           std::chrono::duration<double>(options.max_time_s));
  add_map_points(problem, std::move(map_points));
  if (scene) add_errors_of_map(problem);
  mark_duplicates(problem);
  add_observations(problem);
  problem.allowed.assign(problem.observations.size() * problem.map_points.size(), 0);
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    for (const int lamp : problem.observations[i].lamps)
      problem.allowed[i * problem.map_points.size() + lamp] = 1;
  return problem;
}

}  // namespace

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene& scene,
                               const IdentifyOptions& options) {
  return make_problem(blobs, &scene, to_map_points(scene.lamps), scene.camera, options);
}

AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Object& object,
                               const Camera& camera, const IdentifyOptions& options) {
  return make_problem(blobs, nullptr, to_map_points(object), camera, options);
}

}  // namespace occ::internal::identify
