// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/candidates.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/p3p_triples.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/internal/pose_newton.hpp"

namespace occ {

using namespace internal::pose;
namespace {

// Poses closer than this are equal: rotation [rad], and translation over the points' distance.
constexpr double same_pose = 1e-7;

// Thickness over extent of points that solvers for a plane accept at most, and that solvers for
// points in space require at least.
constexpr double max_plane_thickness = 1e-3;
constexpr double min_space_thickness = 1e-6;

bool has_origins(const PoseProblem& p) { return p.origins.cols() > 0; }

void check_columns(const Eigen::Matrix3Xd& columns, const char* name, Eigen::Index count) {
  require(columns.cols() == count, name, columns.cols(), "one column for each point");
  require_finite(columns, name);
}

constexpr double squared_tolerance = 2e-6;  // of a squared length: 1e-6 of the length

void check(const PoseProblem& p) {
  const Eigen::Index n = p.points.cols();
  check_columns(p.points, "points", n);
  check_columns(p.bearings, "bearings", n);
  if (has_origins(p)) check_columns(p.origins, "origins", n);
  for (Eigen::Index i = 0; i < n; ++i)
    if (!(std::abs(p.bearings.col(i).squaredNorm() - 1) <= squared_tolerance))
      require(false, "bearings[" + std::to_string(i) + "]", p.bearings.col(i).transpose(),
              "of unit length");
  if (p.up_in_cam)
    require(std::abs(p.up_in_cam->squaredNorm() - 1) <= squared_tolerance, "up_in_cam",
            p.up_in_cam->transpose(), "of unit length");
}

void check_solver(const Solver& solver, const PoseProblem& p) {
  require(p.up_in_cam || !solver.needs_up, "solver", solver.name, "given up_in_cam");
  require(!has_origins(p) || solver.takes_origins, "solver", solver.name,
          "one that takes origins, when origins are given");
}

const char* solver_for(const PoseProblem& p) {
  if (p.size() == 2 && p.up_in_cam) return "upright_p2p";
  if (has_origins(p)) return p.size() == 3 ? "gp3p" : "upnp";
  return p.size() == 3 ? "p3p" : "p3p_triples";
}

// A problem converted to the unit frame of its points.
struct Normalised {
  PoseProblem problem;
  UnitFrame frame;

  explicit Normalised(const PoseProblem& p) {
    problem.points = p.points;
    frame = normalise(problem.points);
    problem.bearings = p.bearings.colwise().normalized();
    if (has_origins(p)) problem.origins = p.origins / frame.size_m;
    if (p.up_in_cam) problem.up_in_cam = p.up_in_cam->normalized();
  }
};

// Message for points that determine no pose or that the solver does not accept; empty if valid.
std::string layout_error(const PoseProblem& p, double offset, const Solver& solver) {
  if (!std::isfinite(p.points.sum())) return "the points coincide";
  if (p.size() < 3) return "";
  const Triple chosen = p.size() == 3 ? Triple{0, 1, 2} : spread_triple(p.points);
  if (on_a_line(p.points, chosen, offset)) return "the points lie on a line";
  if (solver.layout == Layout::any) return "";
  const PointLayout layout = point_layout(p.points);
  const double thickness = layout.extent[2] / layout.extent[0];
  if (solver.layout == Layout::coplanar && thickness > max_plane_thickness)
    return std::string(solver.name) + " accepts only points in one plane";
  if (solver.layout == Layout::not_coplanar && thickness < min_space_thickness)
    return std::string(solver.name) + " does not accept points that lie in one plane";
  return "";
}

// The `count` points of a triple of large area.
PoseProblem spread_subset(const PoseProblem& p, int count) {
  const Triple chosen = spread_triple(p.points);
  PoseProblem part;
  part.up_in_cam = p.up_in_cam;
  part.points.resize(3, count);
  part.bearings.resize(3, count);
  if (has_origins(p)) part.origins.resize(3, count);
  for (int i = 0; i < count; ++i) {
    const int from = chosen[i];
    part.points.col(i) = p.points.col(from);
    part.bearings.col(i) = p.bearings.col(from);
    if (has_origins(p)) part.origins.col(i) = p.origins.col(from);
  }
  return part;
}

// Orthonormalises a matrix that is a rotation up to rounding; returns false for any other.
bool make_rotation(Eigen::Matrix3d& r) {
  // Above `max_error` the matrix is rejected, above `linear` a first-order correction is too
  // inexact.
  constexpr double max_error = 1e-2, linear = 1e-7, rounding = 1e-14;
  const Eigen::Matrix3d excess = r.transpose() * r - Eigen::Matrix3d::Identity();
  const double off = excess.cwiseAbs().maxCoeff();
  if (!(off < max_error) || !(r.determinant() > 0)) return false;
  if (off > linear)
    r = nearest_rotation(r);
  else if (off > rounding)
    r -= (0.5 * r * excess).eval();  // one step of Newton's method
  return true;
}

// Computes the misfit. Returns false for a pose that polishing cannot make fit: with a point behind
// the camera, not a rotation or, for three points, which fit exactly, far from the bearings.
bool measure(const PoseProblem& p, double tolerance_rad, PoseCandidate& c) {
  constexpr double no_root_rad = 0.01;  // misfit that no rounding of a root explains
  c.misfit_rad = misfit_rad(p.bearings, p.points, p.origins, c.cam_from_world);
  if (!std::isfinite(c.misfit_rad)) return false;
  if (p.size() == 3 && c.misfit_rad > std::max(no_root_rad, tolerance_rad)) return false;
  return make_rotation(c.cam_from_world.rotation);
}

// `seen`: the points of the problem, used for more than three.
void polish(const PoseProblem& p, const SeenPoints& seen, double tolerance_rad, PoseCandidate& c) {
  constexpr double exact_rad = 1e-11;  // no further gain for three points
  constexpr double rounding = 1e-15;
  if (p.size() < 3) return;  // two points do not determine the tilt
  if (p.size() == 3 && c.misfit_rad < exact_rad) return;
  constexpr int max_steps = 30;
  PoseCandidate polished = c;
  Rigid3& pose = polished.cam_from_world;
  if (p.size() > 3) pose = fit_points(seen, pose, max_steps, 1e-15).pose;
  polish_pose(p.bearings, p.points, p.origins, max_steps, pose);
  if (measure(p, tolerance_rad, polished) && polished.misfit_rad < c.misfit_rad + rounding)
    c = polished;
}

bool same(const Rigid3& a, const Rigid3& b) {
  const double distance = 1 + a.translation.norm();  // the points have unit size
  return (a.rotation - b.rotation).norm() < same_pose &&
         (a.translation - b.translation).norm() < same_pose * distance;
}

void merge_and_rank(std::vector<PoseCandidate>& candidates) {
  std::sort(
      candidates.begin(), candidates.end(),
      [](const PoseCandidate& a, const PoseCandidate& b) { return a.misfit_rad < b.misfit_rad; });
  std::size_t kept = 0;
  for (const PoseCandidate& c : candidates) {
    const auto known = candidates.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::none_of(candidates.begin(), known, [&](const PoseCandidate& k) {
          return same(k.cam_from_world, c.cam_from_world);
        }))
      candidates[kept++] = c;
  }
  candidates.resize(kept);
}

std::vector<PoseCandidate> checked_candidates(const PoseProblem& p, const Solver& solver,
                                              const CandidateOptions& options) {
  std::vector<Rigid3> raw;
  raw.reserve(static_cast<std::size_t>(solver.max_candidates));
  if (solver.max_points > 0 && p.size() > solver.max_points)
    solver.solve(spread_subset(p, solver.max_points), raw);
  else
    solver.solve(p, raw);
  const bool needs_fit = options.polish && p.size() > 3;
  const SeenPoints seen = needs_fit ? seen_along(p) : SeenPoints{};
  std::vector<PoseCandidate> candidates;
  candidates.reserve(raw.size());
  for (const Rigid3& pose : raw) {
    PoseCandidate c{pose};
    if (!measure(p, options.tolerance_rad, c)) continue;
    if (options.polish) polish(p, seen, options.tolerance_rad, c);
    candidates.push_back(c);
  }
  merge_and_rank(candidates);
  return candidates;
}

}  // namespace

void CandidateOptions::validate() const {
  require(tolerance_rad > 0, "tolerance_rad", tolerance_rad, "positive");
}

Result<std::vector<PoseCandidate>> pose_candidates(const PoseProblem& problem,
                                                   const std::string& name,
                                                   const CandidateOptions& options) {
  options.validate();
  check(problem);
  const Solver& solver = solver_named(name == "auto" ? solver_for(problem) : name);
  check_solver(solver, problem);
  Result<std::vector<PoseCandidate>> result;
  if (problem.size() < solver.min_points) {
    result.status = Status::too_few_lamps;
    result.message = std::string(solver.name) + " needs " + std::to_string(solver.min_points) +
                     " points or more, got " + std::to_string(problem.size());
    return result;
  }
  const Normalised normalised(problem);
  result.message = layout_error(normalised.problem, normalised.frame.offset(), solver);
  if (!result.message.empty()) {
    result.status = Status::degenerate;
    return result;
  }
  std::vector<PoseCandidate>& candidates = result.value;
  candidates = checked_candidates(normalised.problem, solver, options);
  for (PoseCandidate& c : candidates)
    c.cam_from_world = normalised.frame.restored(c.cam_from_world);
  const auto fits = [&](const PoseCandidate& c) { return c.misfit_rad <= options.tolerance_rad; };
  if (std::any_of(candidates.begin(), candidates.end(), fits)) {
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), std::not_fn(fits)),
                     candidates.end());
    return result;
  }
  result.status = Status::no_pose;
  result.message = candidates.empty() ? "no pose puts every point in front along its bearing"
                                      : "no pose reproduces the bearings within the tolerance";
  if (candidates.size() > 1) candidates.resize(1);
  return result;
}

double pose_condition(const PoseProblem& problem, const Rigid3& cam_from_world) {
  check(problem);
  if (problem.size() < 3) return std::numeric_limits<double>::infinity();
  const Normalised normalised(problem);
  const Rigid3 pose = normalised.frame.normalised(cam_from_world);
  const Matrix6 information = point_equations(seen_along(normalised.problem), pose).information;
  // The camera's centre moves by -(shift + t x rotation) when the points rotate about their
  // centroid.
  Matrix6 pose_by_step = Matrix6::Identity();
  const double distance = pose.translation.norm();
  pose_by_step.bottomLeftCorner<3, 3>() = skew(pose.translation) / distance;
  pose_by_step.bottomRightCorner<3, 3>() /= distance;
  const Matrix6 step_by_pose = internal::core::inverse(pose_by_step);
  const Matrix6 scaled = step_by_pose.transpose() * information * step_by_pose;
  const double smallest =
      internal::core::symmetric_eigen<Matrix6>(scaled, Eigen::EigenvaluesOnly).eigenvalues()[0];
  return smallest > 0 ? 1 / std::sqrt(smallest) : std::numeric_limits<double>::infinity();
}

}  // namespace occ
