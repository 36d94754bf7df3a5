// SPDX-License-Identifier: Apache-2.0
#include "libocc/ladder/internal/ladder_steps.hpp"

#include <array>
#include <limits>
#include <stdexcept>

#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/missing_method.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/pose/solvers/p3p_kneip.hpp"

namespace occ {

using namespace internal::ladder;
using namespace internal::pose;
namespace {

/// Bearings of pixels with the points as they are, not normalised.
PoseProblem bearings_of(const Camera& camera, const Eigen::Matrix3Xd& points_in_world,
                        const Eigen::Matrix2Xd& points_px) {
  PoseProblem problem;
  problem.points = points_in_world;
  problem.bearings.resize(3, points_px.cols());
  for (Eigen::Index i = 0; i < points_px.cols(); ++i)
    problem.bearings.col(i) = camera.unproject(points_px.col(i)).value_or(Eigen::Vector3d::UnitZ());
  return problem;
}

/// The candidate with the smallest reprojection error; no_pose if every candidate has a point that
/// does not project.
Result<Rigid3> nearest_to(const Camera& camera, const Eigen::Matrix3Xd& points_in_world,
                          const Eigen::Matrix2Xd& points_px,
                          const std::vector<Rigid3>& candidates) {
  Result<Rigid3> best;
  best.status = Status::no_pose;
  double min_sum = std::numeric_limits<double>::infinity();
  for (const Rigid3& pose : candidates) {
    double sum = 0;
    for (Eigen::Index i = 0; i < points_px.cols(); ++i) {
      const auto px = camera.project(pose * points_in_world.col(i));
      sum += px ? camera.difference_px(*px, points_px.col(i)).squaredNorm()
                : std::numeric_limits<double>::infinity();
    }
    if (!(sum < min_sum)) continue;
    min_sum = sum;
    best = {pose, Status::ok, ""};
  }
  return best;
}

Result<Rigid3> nearest_candidate(const LadderProblem& p, const std::vector<Rigid3>& candidates) {
  return nearest_to(p.scene.camera, p.points_in_world, p.points_px, candidates);
}

/// Solves three of the points; all points select among the candidates.
template <const Solver& solver>
Result<Rigid3> by_three(const LadderProblem& p) {
  return nearest_candidate(p, candidates_of_three(p, solver, spread_triple(p.points_in_world)));
}

/// Candidates of the bare solver, which expects a normalised frame.
std::vector<Rigid3> solved_in_unit_frame(PoseProblem problem, const char* name) {
  const UnitFrame frame = normalise(problem.points);
  std::vector<Rigid3> candidates;
  solver_named(name).solve(problem, candidates);
  for (Rigid3& c : candidates) c = frame.restored(c);
  return candidates;
}

Result<Rigid3> by_solver(const LadderProblem& p, const char* name) {
  return nearest_candidate(
      p, solved_in_unit_frame(bearings_of(p.scene.camera, p.points_in_world, p.points_px), name));
}

Result<Rigid3> by_p3p_triples(const LadderProblem& p) { return by_solver(p, "p3p_triples"); }
#if LIBOCC_OPENGV
Result<Rigid3> by_upnp(const LadderProblem& p) { return by_solver(p, "upnp"); }
Result<Rigid3> by_epnp(const LadderProblem& p) { return by_solver(p, "epnp"); }
#endif
Result<Rigid3> by_posit(const LadderProblem& p) { return by_solver(p, "posit"); }
Result<Rigid3> by_posit_coplanar(const LadderProblem& p) { return by_solver(p, "posit_coplanar"); }
Result<Rigid3> by_homography(const LadderProblem& p) { return by_solver(p, "homography"); }
Result<Rigid3> by_dlt(const LadderProblem& p) { return by_solver(p, "dlt"); }

Result<Rigid3> guarded(const LadderProblem& p) {
  CandidateOptions options;
  options.tolerance_rad = 0.05;  // wide: bearings are noisy, and all correspondences are right
  const auto found =
      pose_candidates(bearings_of(p.scene.camera, p.points_in_world, p.points_px), "auto", options);
  if (!found.ok()) return {{}, found.status, found.message};
  return {found->front().cam_from_world, Status::ok, ""};
}

/// Counts an ambiguous answer by its best pose.
Result<Rigid3> least_squares(const Eigen::Matrix3Xd& points_in_world,
                             const Eigen::Matrix2Xd& points_px, const LadderProblem& p,
                             double sigma_px) {
  SolvePoseOptions options;
  options.sigma_px = sigma_px;
  const Result<Fix> fix = solve_pose(points_in_world, points_px, p.scene.camera, options);
  const bool answered = fix.ok() || fix.status == Status::ambiguous;
  return {fix->cam_from_world, answered ? Status::ok : fix.status, fix.message};
}

Result<Rigid3> by_solve_pose(const LadderProblem& p) {
  return least_squares(p.points_in_world, p.points_px, p, p.sigma_px);
}

Result<Rigid3> by_corners(const LadderProblem& p) {
  constexpr double corner_sigma_px = 0.05;  // of well exposed lamps
  return least_squares(p.corners_in_world, p.corners_px, p, corner_sigma_px);
}

template <Rung rung, FluxModel flux = FluxModel::ignore>
Result<Rigid3> refined(const LadderProblem& p) {
  const Result<Rigid3> start = start_of(p);
  if (!start.ok()) return start;
  RefineOptions options;
  options.rung = rung;
  options.flux = flux;
  const Result<Refined> found = refine(*start, p.matches, p.blobs, p.scene, options, p.image);
  return {found->cam_from_world, found.status, found.message};
}

bool three(const LadderProblem& p) { return p.points_px.cols() >= 3; }
bool four(const LadderProblem& p) { return p.points_px.cols() >= 4; }
bool coplanar_four(const LadderProblem& p) { return four(p) && is_coplanar(p); }
bool not_coplanar_four(const LadderProblem& p) { return four(p) && is_not_coplanar(p); }
bool not_coplanar_six(const LadderProblem& p) {
  return p.points_px.cols() >= 6 && is_not_coplanar(p);
}

std::vector<LadderStep> own_steps() {
  constexpr FluxModel no_flux = FluxModel::ignore;
  constexpr Rung points = Rung::points, rims = Rung::rims;
  return {
    {"p3p",
     "libocc",
     "three points, chosen by the others",
     points,
     no_flux,
     three,
     by_three<p3p_solver>},
#if LIBOCC_OPENGV
        {"p3p_kneip",
         "OpenGV",
         "three points, chosen by the others",
         points,
         no_flux,
         three,
         by_three<p3p_kneip_solver>},
#endif
        {"p3p_triples", "libocc",      "the best of several triples", points, no_flux,
         three,         by_p3p_triples},
        {"guard", "libocc", "p3p_triples, checked and polished by all points", points, no_flux,
         three,   guarded},
        {"posit", "libocc", "all points", points, no_flux, not_coplanar_four, by_posit},
        {"posit_coplanar", "libocc",      "a plane's points", points,
         no_flux,          coplanar_four, by_posit_coplanar},
        {"homography", "libocc", "a plane's points", points, no_flux, coplanar_four, by_homography},
        {"dlt", "libocc", "all points", points, no_flux, not_coplanar_six, by_dlt},
#if LIBOCC_OPENGV
        {"epnp", "OpenGV", "all points", points, no_flux, not_coplanar_four, by_epnp},
        {"upnp", "OpenGV", "all points", points, no_flux, four, by_upnp},
#endif
        {"solve_pose", "libocc",     "all points, least squares, with covariance", points, no_flux,
         three,        by_solve_pose},
        {"points",
         "libocc",
         "refined by centroids taken for the lamps' centres",
         points,
         no_flux,
         three,
         refined<Rung::points>},
        {"centres",
         "libocc",
         "refined by centroids, ellipses corrected",
         Rung::centres,
         no_flux,
         three,
         refined<Rung::centres>},
        {"corners",     "libocc",  "corners of rectangles, least squares", rims, no_flux,
         has_rectangle, by_corners},
        {"rims", "libocc", "refined by rims", rims, no_flux, has_start, refined<Rung::rims>},
        {"rims+flux",
         "libocc",
         "refined by rims and brightness",
         rims,
         FluxModel::known_power,
         has_start,
         refined<Rung::rims, FluxModel::known_power>},
    {
      "direct", "libocc", "refined by every pixel", Rung::direct, no_flux, has_start,
          refined<Rung::direct>
    }
  };
}

}  // namespace

std::vector<Rigid3> internal::ladder::candidates_of_three(const LadderProblem& p,
                                                          const Solver& solver,
                                                          const Triple& triple) {
  PoseProblem three;
  three.points.resize(3, 3);
  three.bearings.resize(3, 3);
  for (int k = 0; k < 3; ++k) {
    const auto bearing = p.scene.camera.unproject(p.points_px.col(triple[k]));
    if (!bearing) return {};
    three.points.col(k) = p.points_in_world.col(triple[k]);
    three.bearings.col(k) = *bearing;
  }
  std::vector<Rigid3> candidates;
  solver.solve(three, candidates);
  return candidates;
}

bool internal::ladder::has_rectangle(const LadderProblem& p) { return p.corners_px.cols() > 0; }
bool internal::ladder::has_start(const LadderProblem& p) { return three(p) || has_rectangle(p); }

Result<Rigid3> internal::ladder::start_of(const LadderProblem& p) {
  if (three(p)) return by_p3p_triples(p);
  const PoseProblem problem = bearings_of(p.scene.camera, p.corners_in_world, p.corners_px);
  return nearest_to(p.scene.camera, p.corners_in_world, p.corners_px,
                    solved_in_unit_frame(problem, "p3p_triples"));
}

bool internal::ladder::is_coplanar(const LadderProblem& p) { return !is_not_coplanar(p); }
bool internal::ladder::is_not_coplanar(const LadderProblem& p) {
  return spans_space(point_layout(p.points_in_world));
}

const std::vector<LadderStep>& ladder_steps() {
  static const std::vector<LadderStep> list = [] {
    std::vector<LadderStep> steps = own_steps();
    for (const LadderStep& step : shape_steps()) steps.push_back(step);
#if LIBOCC_OPENCV
    for (const LadderStep& step : opencv_steps()) steps.push_back(step);
#endif
    return steps;
  }();
  return list;
}

const std::vector<MissingMethod>& missing_ladder_steps() {
  static const std::vector<MissingMethod> list = [] {
    std::vector<MissingMethod> missing;
#if !LIBOCC_OPENGV
    for (const char* name : {"p3p_kneip", "epnp", "upnp"})
      missing.push_back({name, "LIBOCC_OPENGV"});
#endif
#if !LIBOCC_OPENCV
    for (const char* name : {"AP3P", "IPPE", "EPNP", "SQPNP", "ITERATIVE"})
      missing.push_back({name, "LIBOCC_OPENCV"});
#endif
    return missing;
  }();
  return list;
}

const LadderStep& ladder_step_named(const std::string& name) {
  std::string known;
  for (const LadderStep& step : ladder_steps()) {
    if (step.name == name) return step;
    known += (known.empty() ? "" : ", ") + std::string(step.name);
  }
  require_in_build("rung", name, missing_ladder_steps());
  throw std::invalid_argument("rung = \"" + name + "\" must be one of " + known);
}

}  // namespace occ
