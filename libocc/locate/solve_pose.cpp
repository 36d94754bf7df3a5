// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/solve_pose.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/internal/curved_covariance.hpp"
#include "libocc/locate/internal/point_problem.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/missing_method.hpp"
#include "libocc/pose/internal/p3p_triples.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

using namespace internal::locate;
using namespace internal::pose;
namespace {

// Limit of the further decrease of chi2 after one Gauss-Newton step.
constexpr double optimism = 0.1;

// Beyond this standard deviation, the rotation is not determined.
constexpr double max_rotation_sigma_rad = 0.25;

// A subset of many points finds and ranks the start values.
constexpr int few_points = 12;

using Problem = PointProblem;

// Subset of many points: a triple of large area and evenly spaced others, which alone could lie on
// a line (a column of a grid).
Problem part_of(const Problem& p, const Triple& spread, int count) {
  constexpr int triple = 3;
  Problem part;
  part.points.resize(3, count);
  part.bearings.resize(3, count);
  if (p.origins.cols() > 0) part.origins.resize(3, count);
  part.seen.reserve(count);
  for (int i = 0; i < count; ++i) {
    const int from = i < triple ? spread[i] : (i - triple) * p.seen.count() / (count - triple);
    part.points.col(i) = p.points.col(from);
    part.bearings.col(i) = p.bearings.col(from);
    if (p.origins.cols() > 0) part.origins.col(i) = p.origins.col(from);
    part.seen.add(p.seen, from);
  }
  return part;
}

struct Start {
  Rigid3 pose;
  double chi2 = 0;
  double lowest = 0;  // chi2 after twice the decrease predicted by the normal equations
};

// State after one Gauss-Newton step, which separates branches that lead to a minimum from others.
Start step_from(const SeenPoints& seen, const Rigid3& pose) {
  const PointEquations e = point_equations(seen, pose);
  const Vector6 step = -internal::core::solve_llt(e.information, e.gradient);
  const double lowest = e.chi2 + 2 * e.gradient.dot(step);
  const Rigid3 moved{so3_exp(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()};
  const double chi2 = point_chi2(seen, moved);
  return chi2 < e.chi2 ? Start{moved, chi2, lowest} : Start{pose, e.chi2, lowest};
}

// Poses of a solver given by name, after its guard. Without a pose, status and message are those of
// the guard.
Result<std::vector<Rigid3>> poses_by(const Problem& p, const std::string& solver) {
  PoseProblem problem;
  problem.points = p.points;
  problem.bearings = p.bearings;
  if (solver_named(solver).takes_origins) problem.origins = p.origins;
  CandidateOptions options;
  options.polish = false;
  options.tolerance_rad = 4;  // no gate: the fit decides
  const Result<std::vector<PoseCandidate>> found = pose_candidates(problem, solver, options);
  Result<std::vector<Rigid3>> poses{{}, found.status, found.message};
  for (const PoseCandidate& c : *found) poses.value.push_back(c.cam_from_world);
  return poses;
}

Result<std::vector<Start>> starts_of(const Problem& p, const std::string& solver) {
  constexpr double enough =
      50;  // chi2 per point; the noise of three points alone causes about this
  Result<std::vector<Rigid3>> poses;
  if (solver == "auto") {
    solve_p3p_triples(p.points, p.bearings, p.seen, enough * p.seen.count(), poses.value);
    // For rays far from a common centre, the poses of a central solver are inaccurate. A build
    // without OpenGV has no other one.
    if (p.origins.cols() > 0 && is_in_build("gp3p")) {
      const Result<std::vector<Rigid3>> general = poses_by(p, "gp3p");
      poses.value.insert(poses.value.end(), general.value.begin(), general.value.end());
    }
  } else {
    poses = poses_by(p, solver);
  }
  Result<std::vector<Start>> starts{{}, poses.status, poses.message};
  for (const Rigid3& pose : *poses) {
    const Start start = step_from(p.seen, pose);
    if (std::isfinite(start.chi2)) starts.value.push_back(start);
  }
  std::sort(starts.value.begin(), starts.value.end(),
            [](const Start& a, const Start& b) { return a.chi2 < b.chi2; });
  return starts;
}

// True if two poses differ by less than one sigma.
bool same(const PointFit& fit, const Rigid3& pose) {
  Vector6 apart;
  apart << so3_log(pose.rotation * fit.pose.rotation.transpose()),
      pose.translation - fit.pose.translation;
  return apart.dot(fit.equations.information * apart) < 1;
}

// Second pose of a plane seen from far away: mirrors the depths.
Rigid3 mirrored(const Rigid3& pose, const Eigen::Vector3d& normal) {
  const auto mirror = [](const Eigen::Vector3d& unit) -> Eigen::Matrix3d {
    return Eigen::Matrix3d::Identity() - 2 * unit * unit.transpose();
  };
  return {mirror(pose.translation.normalized()) * pose.rotation * mirror(normal), pose.translation};
}

struct Fits {
  std::vector<PointFit> plausible;  // best first
  double excluded = 0;              // sum of the likelihood ratios of the others to the best
};

// Fits the start values that can reach a chi2 near the best, and keeps those that do. `normal`: of
// the plane through a triple of large area, if other poses are searched.
Fits fits_of(const Problem& p, const std::vector<Start>& starts,
             const std::optional<Eigen::Vector3d>& normal, const SolvePoseOptions& options,
             double misfit_dof) {
  constexpr double tolerance = 5e-3;  // sigmas
  const double max_delta_chi2 = -2 * std::log(options.max_risk);
  Fits out;
  std::vector<PointFit>& fits = out.plausible;
  double best = std::numeric_limits<double>::infinity();
  const auto misfit = [&] { return std::max(1.0, best / misfit_dof); };
  const auto plausible = [&](double chi2) { return chi2 - best <= max_delta_chi2 * misfit(); };
  const auto known = [&](const Rigid3& pose) {
    return std::any_of(fits.begin(), fits.end(),
                       [&](const PointFit& fit) { return same(fit, pose); });
  };
  const auto try_start = [&](const Start& start) {
    if (!plausible(optimism * start.chi2) || known(start.pose)) return;
    Start from = start;
    if (!fits.empty()) {  // the test takes less time than a fit
      from = step_from(p.seen, start.pose);
      if (!plausible(from.lowest) || known(from.pose)) return;
    }
    const PointFit fit = fit_points(p.seen, from.pose, options.max_iterations, tolerance);
    if (!std::isfinite(fit.equations.chi2) || known(fit.pose)) return;
    best = std::min(best, fit.equations.chi2);
    fits.push_back(fit);
  };
  for (const Start& start : starts) try_start(start);
  if (fits.size() == 1 &&
      normal) {  // noise can merge two branches; both starts then give the same pose
    const Rigid3 other = mirrored(fits.front().pose, *normal);
    try_start({other, point_chi2(p.seen, other)});
  }
  std::sort(fits.begin(), fits.end(), [](const PointFit& a, const PointFit& b) {
    return a.equations.chi2 < b.equations.chi2;
  });
  while (!fits.empty() && !plausible(fits.back().equations.chi2)) {
    out.excluded += std::exp((best - fits.back().equations.chi2) / (2 * misfit()));
    fits.pop_back();
  }
  return out;
}

Candidate candidate_of(const Problem& p, const PointFit& fit) {
  Candidate c;
  c.cam_from_world = p.frame.restored(fit.pose);
  c.chi2 = fit.equations.chi2;
  c.dof = 2 * p.seen.count() - 6;
  c.covariance = left_covariance(p.seen, fit, variance_factor(c.chi2, c.dof));
  c.covariance.rightCols<3>() *= p.frame.size_m;
  c.covariance.bottomRows<3>() *= p.frame.size_m;
  c.position_m = c.cam_from_world.origin_in_source();
  return c;
}

// Distance of the points from their best-fitting line, as seen in the image, in sigmas.
double seen_height(const Problem& p, const Triple& spread, const Camera& camera, double sigma_px,
                   const Rigid3& pose) {
  const double focal_px = 0.5 * (camera.fx_px() + camera.fy_px());
  const double sigmas = focal_px / (sigma_px * pose.translation.norm());
  // Lower limit from three of the points.
  const Eigen::Vector3d corner = p.points.col(spread[0]);
  const Eigen::Vector3d base = p.points.col(spread[1]) - corner;
  const Eigen::Vector3d side = p.points.col(spread[2]) - corner;
  const double least = std::sqrt(0.5) * base.cross(side).norm() / base.norm();
  return sigmas * (sigmas * least > min_seen_height ? least : height_over_line(p.points));
}

Eigen::Vector3d normal_of(const Eigen::Matrix3Xd& points, const Triple& spread) {
  const Eigen::Vector3d corner = points.col(spread[0]);
  return (points.col(spread[1]) - corner).cross(points.col(spread[2]) - corner).normalized();
}

// One sigma for all points or one for each; `typical` is their root mean square.
Eigen::VectorXd sigmas_of(const SolvePoseOptions& options, Eigen::Index points, double& typical) {
  const auto n = static_cast<Eigen::Index>(options.sigmas_px.size());
  if (n == 0) return Eigen::VectorXd::Constant(1, typical = options.sigma_px);
  require(n == points, "sigmas_px", n, "one for each point");
  const Eigen::VectorXd sigmas = Eigen::Map<const Eigen::VectorXd>(options.sigmas_px.data(), n);
  typical = sigmas.norm() / std::sqrt(static_cast<double>(n));
  return sigmas;
}

std::string misfit_message(const Candidate& best, double sigma_px) {
  std::ostringstream text;
  text << "the best pose leaves " << best.rms_px << " px r.m.s. with sigma_px = " << sigma_px;
  return text.str();
}

struct Ending {
  bool converged = true;
  bool flat = false;
};

void conclude(const Problem& problem, const Triple& spread, const Camera& camera,
              const SolvePoseOptions& options, double sigma_px, const Ending& ending,
              Result<Fix>& result) {
  const Candidate& best = result->candidates.front();
  const double height =
      seen_height(problem, spread, camera, sigma_px, problem.frame.normalised(best.cam_from_world));
  const bool misfits = best.chi2 > options.max_misfit * std::max(1, best.dof);
  const double sigmas = misfits ? 1 : std::sqrt(variance_factor(best.chi2, best.dof));
  if (!best.covariance.allFinite()) {
    result.status = Status::degenerate;
    result.message = "the points do not determine the pose";
  } else if (!(height >= min_seen_height * sigmas)) {
    result.status = Status::degenerate;
    result.message =
        "the points are collinear within the measurement errors; the rotation about their "
        "line is not determined";
  } else if (misfits) {
    result.status = Status::no_pose;
    result.message = misfit_message(best, sigma_px);
    result.value.risk = 1;
  } else if (!ending.converged) {
    result.status = Status::not_converged;
    result.message = "stopped after max_iterations = " + std::to_string(options.max_iterations);
  } else if (result->candidates.size() > 1) {
    result.status = Status::ambiguous;
    result.message = rivals_message(*result);
  } else if (ending.flat ||
             !(std::sqrt(best.covariance.topLeftCorner<3, 3>().trace()) < max_rotation_sigma_rad)) {
    result.status = Status::degenerate;
    result.message = "the points hardly determine the rotation";
  }
}

}  // namespace

void SolvePoseOptions::validate() const {
  require(sigma_px > 0 && std::isfinite(sigma_px), "sigma_px", sigma_px, "positive");
  for (const double sigma : sigmas_px)
    require(sigma > 0 && std::isfinite(sigma), "sigmas_px", sigma, "positive");
  require(max_misfit > 0, "max_misfit", max_misfit, "positive");
  require(max_iterations > 0, "max_iterations", max_iterations, "positive");
  require(max_risk > 0 && max_risk <= 1, "max_risk", max_risk, "above 0 and at most 1");
}

Result<Fix> solve_pose(const Eigen::Matrix3Xd& points_in_world, const Eigen::Matrix2Xd& points_px,
                       const Camera& camera, const SolvePoseOptions& options) {
  options.validate();
  const Eigen::Index n = points_in_world.cols();
  require(points_px.cols() == n, "points_px", points_px.cols(), "one for each point in the world");
  require_finite(points_in_world, "points_in_world");
  require_finite(points_px, "points_px");
  if (options.solver != "auto") solver_named(options.solver);
  Result<Fix> result;
  if (n < 3) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(n) + " points; a pose takes three";
    return result;
  }
  double sigma_px = 0;
  const Eigen::VectorXd sigmas_px = sigmas_of(options, n, sigma_px);
  const Problem problem = make_point_problem(points_in_world, points_px, camera, sigmas_px);
  const Triple spread = spread_triple(problem.points);
  if (on_a_line(problem, spread)) {
    result.status = Status::degenerate;
    result.message = "the points coincide or lie on a line";
    return result;
  }
  const double dof = std::max(1.0, 2.0 * static_cast<double>(n) - 6);
  const bool many = options.solver == "auto" && n > 2 * few_points;
  Result<std::vector<Start>> starts;
  std::optional<Eigen::Vector3d> normal;
  if (options.start) {
    starts.value.push_back({problem.frame.normalised(*options.start), 0});
  } else {
    starts = starts_of(many ? part_of(problem, spread, few_points) : problem, options.solver);
    normal = normal_of(problem.points, spread);
  }
  const Fits fits = fits_of(problem, *starts, normal, options, dof);
  Ending ending;
  for (const PointFit& fit : fits.plausible) {
    Candidate c = candidate_of(problem, fit);
    c.rms_px = sigma_px * std::sqrt(fit.equations.chi2 / static_cast<double>(n));
    ending.converged = ending.converged && fit.converged;
    result.value.candidates.push_back(c);
  }
  if (result->candidates.empty()) {
    result.status = starts.ok() ? Status::no_pose : starts.status;
    result.message = starts.ok() ? "no pose has all points in front of the camera" : starts.message;
    return result;
  }
  const PointFit& best = fits.plausible.front();
  take_best(result.value);
  if (!options.start) weigh(result.value, std::max(1.0, best.equations.chi2 / dof), fits.excluded);
  ending.flat = is_curved(best, result->covariance.topLeftCorner<3, 3>().trace()) &&
                is_flat(problem.seen, best,
                        variance_factor(best.equations.chi2, result->candidates.front().dof));
  conclude(problem, spread, camera, options, sigma_px, ending, result);
  return result;
}

}  // namespace occ
