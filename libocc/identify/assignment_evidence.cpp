// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/assignment_evidence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"
#include "libocc/identify/internal/brightness.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"

namespace occ::internal::identify {
namespace {

using pose::PoseEvidence;
using pose::PriorPart;
using pose::SeenLamp;

/// Offset from a disc's centre to a point that projects to the centre of the disc's image:
/// (r^2 / C_z) (n_z n - e_z), for a disc of radius r and normal n at C (the centre of the dual
/// conic C C' - r^2 (I - n n')).
Eigen::Vector3d to_image_centre(const BearingObservation& observation, const MapPoint& map_point,
                                const Eigen::Matrix3d& rotation, const Eigen::Vector3d& point) {
  const Eigen::Vector3d normal = rotation * map_point.normal;
  const double along = observation.axis.dot(point - observation.origin);
  if (!(along > 0)) return Eigen::Vector3d::Zero();
  return (observation.axis.dot(normal) * normal - observation.axis) *
         (square(map_point.radius_m) / along);
}

/// Residual of a blob's place; empty if the lamp is not in front of the camera. The centre of the
/// light of a lamp of another shape is uncertain by the offset of a disc's.
std::optional<SeenLamp> seen_at(const AssignmentProblem& problem, const Pair& pair,
                                const Rigid3& pose) {
  const BearingObservation& observation = problem.observation(pair.observation);
  const MapPoint& map_point = problem.map_point(pair.map_point);
  const Blob& blob = (*problem.blobs)[static_cast<std::size_t>(observation.blob)];
  const Eigen::Vector3d centre = pose * map_point.centre;
  const Eigen::Vector3d offset = to_image_centre(observation, map_point, pose.rotation, centre);
  const Eigen::Vector3d point = map_point.disc ? Eigen::Vector3d(centre + offset) : centre;
  Eigen::Matrix<double, 2, 3> by_point;
  const auto px = problem.camera->project(point, &by_point);
  if (!px) return std::nullopt;
  Eigen::Vector2d measured_px = blob.centroid_px;
  if (observation.of_centre)
    measured_px = problem.camera->project(observation.bearing).value_or(measured_px);
  SeenLamp seen;
  seen.residual_px = problem.camera->difference_px(*px, measured_px);
  seen.covariance_px2 = blob.covariance_px2;
  if (!map_point.disc && !observation.of_centre)
    seen.covariance_px2.diagonal().array() += (by_point * offset).squaredNorm();
  seen.by_pose = geometry::derivative_by_pose(by_point, point);
  return seen;
}

/// ln of the density ratio of a blob's size: normal in ln of the radius for a lamp, uniform over
/// two and a half decades for a false light. The size of one lamp in fifty is open: partly hidden.
double log_size_ratio(const BearingObservation& observation, const MapPoint& map_point,
                      double distance_m) {
  constexpr double log_range = 6, relative = 0.1, hidden = 0.02;
  if (!map_point.disc || !(observation.radius_rad > 0)) return 0;
  const double sigma =
      std::hypot(std::hypot(relative, observation.radius_sigma), map_point.size_sigma);
  const double off = std::log(size_ratio(observation, map_point, distance_m));
  const double ratio =
      std::exp(-0.5 * square(off / sigma)) * log_range / (std::sqrt(2 * pi) * sigma);
  return std::log((1 - hidden) * ratio + hidden);
}

/// ln of the density ratio of a code: one false light in a hundred has a code, which is then that
/// of any lamp. Several lamps may share a code.
double log_code_ratio(const BearingObservation& observation, std::size_t lamps) {
  constexpr double uncoded_lights = 100;
  if (!observation.coded) return 0;
  return std::log(uncoded_lights * static_cast<double>(lamps) /
                  static_cast<double>(observation.lamps.size()));
}

/// In one map of a hundred the powers are wrong and fluxes are open; a pose that they fit excludes
/// that.
double log_flux_ratio(const AssignmentProblem& problem, const PoseHypothesis& e, bool powers_fit) {
  constexpr double wrong_powers = 0.01;
  const double log = log_flux_ratio(problem, e);
  return powers_fit ? log : std::log((1 - wrong_powers) * std::exp(log) + wrong_powers);
}

/// ln of the density ratio of a lamp's visibility. Nearly edge-on a lamp is too dark to be found,
/// but for one in a hundred; there a missed one does not count either.
double log_visibility(const AssignmentProblem& problem, const MapPoint& map_point,
                      const Rigid3& pose) {
  constexpr double found = 0.01;
  const Eigen::Vector3d to_camera = pose.origin_in_source() - map_point.centre;
  const bool edge_on = map_point.normal.dot(to_camera) < map_point.reliable_cos * to_camera.norm();
  return problem.scene && edge_on ? std::log(found) : 0;
}

double log_appearance(const AssignmentProblem& problem, const PoseHypothesis& e, bool powers_fit) {
  const std::vector<Lamp> none;
  const scene::ColourTest colours(problem.scene ? problem.scene->lamps : none);
  double log = 0;
  for (const Pair& pair : e.pairs) {
    const BearingObservation& observation = problem.observation(pair.observation);
    const MapPoint& map_point = problem.map_point(pair.map_point);
    log += colours.log_ratio(pair.map_point,
                             (*problem.blobs)[static_cast<std::size_t>(observation.blob)]);
    log += log_code_ratio(observation, problem.map_points.size()) +
           log_visibility(problem, map_point, e.estimate.pose);
    if (problem.options->use_brightness)
      log += log_size_ratio(observation, map_point, (e.estimate.pose * map_point.centre).norm());
  }
  if (problem.options->use_brightness) log += log_flux_ratio(problem, e, powers_fit);
  return log;
}

/// Number of blobs that could be lamps.
int count_blobs(const AssignmentProblem& problem) {
  std::vector<char> counts(problem.blobs->size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Blob& blob = (*problem.blobs)[i];
    counts[i] = !blob.cut_by_border && !blob.merged && !problem.foreign[i];
  }
  for (const BearingObservation& observation : problem.observations)
    counts[static_cast<std::size_t>(observation.blob)] = 1;
  return static_cast<int>(std::count(counts.begin(), counts.end(), 1));
}

/// Solid angle of the image [sr].
double view_sr(const Camera& camera) {
  constexpr int columns = 8, rows = 6;
  const double width = camera.width(), height = camera.height();
  double sum = 0;
  for (int i = 0; i < columns; ++i)
    for (int k = 0; k < rows; ++k) {
      Eigen::Matrix<double, 3, 2> by_pixel;
      const Eigen::Vector2d px((i + 0.5) / columns * width - 0.5, (k + 0.5) / rows * height - 0.5);
      if (camera.unproject(px, &by_pixel)) sum += by_pixel.col(0).cross(by_pixel.col(1)).norm();
    }
  return sum * width * height / (columns * rows);
}

/// True if all lamps are visible only from in front of one plane, so that half of the directions
/// are excluded.
bool face_one_side(const AssignmentProblem& problem) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const MapPoint& map_point : problem.map_points) mean += map_point.normal;
  constexpr double aligned = 0.9;
  return std::all_of(problem.map_points.begin(), problem.map_points.end(), [&](const MapPoint& t) {
    return t.cone_cos >= 0 && t.normal.dot(mean) > aligned * mean.norm();
  });
}

PriorPart part_of(const Prior& prior, const Rigid3& cam_from_world, double wrong) {
  const PriorRows rows = prior.rows(cam_from_world);
  return {rows.jacobian.transpose() * rows.jacobian, rows.jacobian.transpose() * rows.residuals,
          rows.residuals.squaredNorm(), wrong};
}

/// True if only the last pose of the prior excludes the pose.
bool is_by_last_pose(const Prior& prior, const Rigid3& excluded) {
  return believed_at(prior, excluded) || without_last_pose(prior).empty();
}

}  // namespace

double rotations_in_view(const Camera& camera, double map_radius_m, double distance_m) {
  const double cos_view = std::max(-1.0, 1 - view_sr(camera) / (2 * pi));
  const double cos_map = std::cos(std::atan2(map_radius_m, distance_m));
  return (1 - std::min(cos_view, cos_map)) / 2;
}

double volume_m3(double map_radius_m, double distance_m) {
  constexpr double min_m = 0.1, decades = 2;
  const double radius_m = std::max({min_m, map_radius_m, distance_m});
  return 4 * pi * decades * std::log(10.0) * std::pow(radius_m, 3);
}

std::vector<PriorPart> prior_parts(const Prior& prior, const Rigid3& cam_from_world) {
  constexpr double misstated = 1e-4;
  std::vector<PriorPart> parts;
  const auto add = [&](bool has, Prior part, double wrong) {
    if (has) parts.push_back(part_of(part, cam_from_world, wrong));
  };
  Prior position, height, heading, gravity, last;
  position.position_m = prior.position_m;
  position.position_sigmas_m = prior.position_sigmas();
  height.height_m = prior.height_m;
  height.height_sigma_m = prior.height_sigma_m;
  heading.heading_rad = prior.heading_rad;
  heading.heading_sigma_rad = prior.heading_sigma_rad;
  gravity.gravity_in_cam = prior.gravity_in_cam;
  gravity.gravity_sigma_rad = prior.gravity_sigma_rad;
  last.last_pose = prior.last_pose;
  add(prior.position_m.has_value(), position, misstated);
  add(prior.height_m.has_value(), height, misstated);
  add(prior.heading_rad.has_value(), heading, misstated);
  add(prior.gravity_in_cam.has_value(), gravity, misstated);
  add(prior.last_pose.has_value(), last, last_pose_wrong);
  if (prior.last_pose) parts.back().is_place = true;
  return parts;
}

Prior without_last_pose(Prior prior) {
  prior.last_pose.reset();
  return prior;
}

std::optional<Prior> believed_at(const Prior& prior, const Rigid3& excluded) {
  const Prior others = without_last_pose(prior);
  if (others.empty() || !(others.chi2(excluded) <= max_prior_chi2)) return std::nullopt;
  return others;
}

double log_misstated(const Prior& prior, const Rigid3& excluded) {
  constexpr double last_pose_elsewhere = 1e-5, all_misstated = 1e-8;
  return std::log(is_by_last_pose(prior, excluded) ? last_pose_elsewhere : all_misstated);
}

double share_of_excluded(const Prior& prior, const Rigid3& excluded,
                         const std::function<double(const std::optional<Prior>&)>& log_ratio) {
  constexpr double max_log = 100;  // larger ratios have the same effect
  const std::optional<Prior> believed = believed_at(prior, excluded);
  double log = log_misstated(prior, excluded) + log_ratio(believed);
  if (!is_by_last_pose(prior, excluded)) log = std::max(log, log_ratio(prior));
  return std::exp(std::min(log, max_log));
}

PoseEvidence evidence_of(const AssignmentProblem& problem, const PoseHypothesis& e,
                         const std::optional<Prior>& prior, bool powers_fit) {
  const Rigid3& pose = e.estimate.pose;
  PoseEvidence evidence;
  evidence.image_px2 = static_cast<double>(problem.camera->width()) * problem.camera->height();
  evidence.blobs = count_blobs(problem);
  evidence.missed = e.missed;
  const double distance_m = pose.origin_in_source().norm();
  evidence.volume_m3 = volume_m3(problem.size_m, distance_m) * (face_one_side(problem) ? 0.5 : 1);
  evidence.rotations = rotations_in_view(*problem.camera, problem.size_m, distance_m);
  evidence.model_sigma_px = problem.options->model_sigma_px;
  for (const Pair& pair : e.pairs) {
    if (const auto seen = seen_at(problem, pair, pose))
      evidence.lamps.push_back(*seen);
    else
      ++evidence.missed;
  }
  evidence.log_appearance = log_appearance(problem, e, powers_fit);
  if (prior) evidence.prior = prior_parts(*prior, problem.from_world(pose));
  return evidence;
}

}  // namespace occ::internal::identify
