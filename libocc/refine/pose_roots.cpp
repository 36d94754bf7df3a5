// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pose_roots.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/plane_starts.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ::internal::refine {
namespace {

using pose::PointFit;

/// Errors of the map, and of the offsets, which are taken at one pose.
constexpr double sigma_px = 0.05;

/// Noise turns a double root into a complex pair, whose real part misses by more than the noise.
constexpr double p3p_tolerance_rad = 0.1;

/// Centroids in the unit frame of the lamps' centres.
struct Centroids {
  PoseProblem problem;
  pose::SeenPoints seen;
  pose::UnitFrame frame;
};

/// Centroid minus the offset of the image's centre from the image of the lamp's centre.
std::optional<Eigen::Vector2d> centre_px(const LampResidual& residual, const Refined& refined,
                                         const std::vector<Blob>& blobs, const Scene& scene) {
  const Lamp& lamp = scene.lamps[residual.match.lamp];
  const Blob& blob = blobs[residual.match.blob];
  if (residual.contradicts || !is_whole(blob)) return std::nullopt;
  const auto predicted =
      predicted_centroid_px(lamp, blob, refined.cam_from_world, scene, Rung::centres);
  const auto centre = scene.camera.project(refined.cam_from_world * lamp.centre_m);
  if (!predicted || !centre) return std::nullopt;
  return blob.centroid_px - scene.camera.difference_px(*predicted, *centre);
}

struct Seen {
  Eigen::Vector3d point, bearing, origin = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 2, 3> across = Eigen::Matrix<double, 2, 3>::Zero();
};

std::optional<Seen> see(const LampResidual& residual, const Refined& refined,
                        const std::vector<Blob>& blobs, const Scene& scene) {
  const auto px = centre_px(residual, refined, blobs, scene);
  if (!px) return std::nullopt;
  Eigen::Matrix<double, 3, 2> by_px;
  const auto bearing = scene.camera.unproject(*px, &by_px);
  if (!bearing) return std::nullopt;
  Seen seen{scene.lamps[residual.match.lamp].centre_m, *bearing};
  seen.across = (by_px.transpose() * by_px).inverse() * by_px.transpose() / sigma_px;
  if (!scene.camera.is_central())
    if (const auto ray = scene.camera.ray(*px)) seen.origin = ray->origin;
  return seen;
}

Centroids centroids_of(const Refined& refined, const std::vector<Blob>& blobs, const Scene& scene) {
  std::vector<Seen> lamps;
  for (const LampResidual& residual : refined.lamps)
    if (const auto seen = see(residual, refined, blobs, scene)) lamps.push_back(*seen);
  const auto count = static_cast<Eigen::Index>(lamps.size());
  Centroids all;
  all.problem.points.resize(3, count);
  all.problem.bearings.resize(3, count);
  if (count < 3) return all;
  for (Eigen::Index i = 0; i < count; ++i) {
    all.problem.points.col(i) = lamps[i].point;
    all.problem.bearings.col(i) = lamps[i].bearing;
  }
  all.frame = pose::normalise(all.problem.points);
  all.seen.reserve(static_cast<int>(count));
  for (Eigen::Index i = 0; i < count; ++i)
    all.seen.add(all.problem.points.col(i), lamps[i].bearing, lamps[i].across,
                 lamps[i].origin / all.frame.size_m);
  return all;
}

/// Poses of the triples, and the reflected pose of a plane. With five lamps and more, each pose
/// that fits is near one of a single triple of large area.
std::vector<Rigid3> starts_of(const Centroids& all, const Rigid3& known) {
  std::vector<Rigid3> starts;
  const auto triples = all.seen.count() > 4
                           ? std::vector<pose::Triple>{pose::spread_triple(all.problem.points)}
                           : pose::triples_to_try(all.problem.points, all.problem.bearings);
  for (const pose::Triple& triple : triples) {
    Eigen::Matrix3d points, bearings;
    for (int i = 0; i < 3; ++i) {
      points.col(i) = all.problem.points.col(triple[i]);
      bearings.col(i) = all.problem.bearings.col(triple[i]);
    }
    std::array<Rigid3, 4> poses;
    const int count = p3p_within(bearings, points, p3p_tolerance_rad, poses);
    starts.insert(starts.end(), poses.begin(), poses.begin() + count);
  }
  starts.push_back(pose::reflected_pose(all.problem, known));
  return starts;
}

/// Minus ln of the likelihood for errors of an unknown size, up to a constant: the residuals of n
/// points count as 2 n - 6 numbers.
double log_misfit(double chi2, int points) {
  const double dof = 2.0 * points - 6;
  return dof > 0 ? 0.5 * dof * std::log1p(chi2 / dof) : 0;
}

/// Chi-square after twice the decrease that the normal equations predict.
double lowest_chi2(const pose::SeenPoints& seen, const Rigid3& start) {
  const pose::PointEquations e = pose::point_equations(seen, start);
  const double fall = e.gradient.dot(core::solve_llt(e.information, e.gradient));
  return std::max(0.0, e.chi2 - 2 * fall);
}

bool same(const PointFit& a, const Rigid3& b) {
  constexpr double max_sigmas = 0.1;
  Vector6 apart;
  apart << so3_log(b.rotation * a.pose.rotation.transpose()), b.translation - a.pose.translation;
  return apart.dot(a.equations.information * apart) < square(max_sigmas);
}

}  // namespace

std::vector<Rigid3> other_roots(const Refined& refined, const std::vector<Blob>& blobs,
                                const Scene& scene) {
  constexpr int max_iterations = 30;
  constexpr double tolerance = 5e-3;     // sigmas
  constexpr double max_rms_px = 10;      // a pose that misses by more does not fit
  constexpr double negligible_log = 16;  // a likelihood ratio of 1e-7
  const Centroids all = centroids_of(refined, blobs, scene);
  const int count = all.seen.count();
  if (count < 3) return {};
  const Rigid3 known = all.frame.normalised(refined.cam_from_world);
  std::vector<PointFit> fits{pose::fit_points(all.seen, known, max_iterations, tolerance)};
  const auto is_known = [&](const Rigid3& pose) {
    return std::any_of(fits.begin(), fits.end(),
                       [&](const PointFit& fit) { return same(fit, pose); });
  };
  const double known_misfit = log_misfit(fits.front().equations.chi2, count);
  for (const Rigid3& start : starts_of(all, known)) {
    // The test takes less time than a fit. Noise of four lamps can hide a pose from it.
    if (count > 4 &&
        !(log_misfit(lowest_chi2(all.seen, start), count) - known_misfit < negligible_log))
      continue;
    if (is_known(start)) continue;
    const PointFit fit = pose::fit_points(all.seen, start, max_iterations, tolerance);
    const double rms_px = sigma_px * std::sqrt(fit.equations.chi2 / count);
    if (rms_px <= max_rms_px && !is_known(fit.pose)) fits.push_back(fit);
  }
  const auto better = [](const PointFit& a, const PointFit& b) {
    return a.equations.chi2 < b.equations.chi2;
  };
  const double best =
      log_misfit(std::min_element(fits.begin(), fits.end(), better)->equations.chi2, count);
  std::stable_sort(fits.begin() + 1, fits.end(), better);
  std::vector<Rigid3> others;
  for (auto fit = fits.begin() + 1; fit != fits.end(); ++fit)
    if (log_misfit(fit->equations.chi2, count) - best < negligible_log)
      others.push_back(all.frame.restored(fit->pose));
  return others;
}

}  // namespace occ::internal::refine
