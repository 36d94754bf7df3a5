// SPDX-License-Identifier: Apache-2.0
#include <pybind11/native_enum.h>

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/solver.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/pose/solvers/planar.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

py::array_t<double> stacked(const std::vector<Rigid3>& poses) {
  py::array_t<double> array(std::vector<py::ssize_t>{static_cast<py::ssize_t>(poses.size()), 4, 4});
  auto out = array.mutable_unchecked<3>();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Eigen::Matrix4d matrix = poses[k].matrix();
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) out(static_cast<py::ssize_t>(k), i, j) = matrix(i, j);
  }
  return array;
}

void define_p3p(py::module_& m) {
  m.def(
      "p3p",
      [](const Rows3& bearings, const Rows3& points_in_world) {
        require(bearings.rows() == 3, "bearings", bearings.rows(), "three rows");
        require(points_in_world.rows() == 3, "points_in_world", points_in_world.rows(),
                "three rows");
        return stacked(p3p(bearings.transpose(), points_in_world.transpose()));
      },
      py::arg("bearings"), py::arg("points_in_world"),
      R"(Computes all poses from which three known points are observed along three bearings.

bearings: (3, 3), a unit vector (camera frame) in each row. points_in_world: (3, 3), a point [m] in
each row. Returns: (k, 4, 4) candidates for cam_from_world, k from 0 to 4, in no particular order;
all of them fit. Raises: ValueError for another number of points, numbers that are not finite or
bearings that are not unit vectors.)");
}

void define_solvers(py::module_& m) {
  py::native_enum<Layout>(m, "Layout", "enum.Enum", "Layouts of points that a solver accepts.")
      .value("any", Layout::any)
      .value("coplanar", Layout::coplanar)
      .value("not_coplanar", Layout::not_coplanar)
      .finalize();
  py::class_<Solver>(m, "Solver", "A pose solver: its requirements and its known failures.")
      .def_readonly("name", &Solver::name, "Argument of solve_pose() and pose_candidates().")
      .def_readonly("min_points", &Solver::min_points, "Fewer points are rejected.")
      .def_readonly("max_points", &Solver::max_points, "Uses at most this many points; 0: all.")
      .def_readonly("max_candidates", &Solver::max_candidates, "Returns at most this many poses.")
      .def_readonly("layout", &Solver::layout, "Accepted layouts of the points.")
      .def_readonly("needs_up", &Solver::needs_up, "Requires the direction of gravity.")
      .def_readonly("takes_origins", &Solver::takes_origins, "Accepts several cameras on a rig.")
      .def_readonly("failures", &Solver::failures, "Known failures and slow cases.")
      .def_readonly("source", &Solver::source, "Paper, and package of the implementation.")
      .def("__repr__", [](const Solver& s) { return "<Solver: " + std::string(s.name) + ">"; });
  m.def("solvers", &solvers, "Returns all pose solvers, those for the fewest points first.");
  m.def(
      "missing_solvers",
      [] {
        py::typing::Dict<py::str, py::str> options;
        for (const MissingMethod& solver : missing_solvers()) options[solver.name] = solver.option;
        return options;
      },
      "Returns the solvers that this build lacks, with the CMake option that includes each.");
}

struct Conditioned {
  PoseCandidate candidate;
  double condition;
};

using Candidates = Result<std::vector<Conditioned>>;

Candidates pose_candidates_of(const Rows3& bearings, const Rows3& points_in_world_m,
                              const std::string& solver,
                              const std::optional<Rows3>& origins_in_cam_m,
                              const std::optional<Eigen::Vector3d>& up_in_cam, double tolerance_rad,
                              bool polish) {
  PoseProblem problem;
  problem.bearings = bearings.transpose();
  problem.points = points_in_world_m.transpose();
  if (origins_in_cam_m) problem.origins = origins_in_cam_m->transpose();
  problem.up_in_cam = up_in_cam;
  const auto found = pose_candidates(problem, solver, {tolerance_rad, polish});
  Candidates result{{}, found.status, found.message};
  for (const PoseCandidate& c : *found)
    result.value.push_back({c, pose_condition(problem, c.cam_from_world)});
  return result;
}

std::vector<Rigid3> planar_poses_of(const Rows3& bearings, const Rows3& points,
                                    const Eigen::Vector3d& up_in_cam, double height_m,
                                    const std::optional<double>& heading_rad) {
  const Eigen::Index needed = heading_rad ? 1 : 2;
  require(bearings.rows() == needed, "bearings", bearings.rows(),
          "two rows, or one with a heading_rad");
  require(points.rows() == needed, "points_in_world_m", points.rows(), "a row for each bearing");
  const PlanarCamera camera{up_in_cam, height_m};
  const std::vector<PoseCandidate> found =
      heading_rad ? planar_poses(Eigen::Vector3d(bearings.transpose()),
                                 Eigen::Vector3d(points.transpose()), *heading_rad, camera)
                  : planar_poses(Eigen::Matrix<double, 3, 2>(bearings.transpose()),
                                 Eigen::Matrix<double, 3, 2>(points.transpose()), camera);
  std::vector<Rigid3> poses;
  for (const PoseCandidate& c : found) poses.push_back(c.cam_from_world);
  return poses;
}

void define_planar(py::module_& m) {
  m.def(
      "planar_poses", &planar_poses_of, py::arg("bearings"), py::arg("points_in_world_m"),
      py::kw_only(), py::arg("up_in_cam"), py::arg("height_m"), py::arg("heading_rad") = py::none(),
      R"(Computes the poses of a camera of known tilt and height from two points, or one and a heading.

bearings: (2, 3) or, with heading_rad, (1, 3), unit vectors in the camera frame. points_in_world_m:
the same shape. up_in_cam: (3,), the world's Z in the camera's frame. height_m: the camera's z.
Returns: up to two poses, 4x4, the one with the smaller misfit first; none if the heading is
undetermined.
Raises: ValueError for numbers that are not finite, bearings that are not unit vectors, or other
counts.)");
}

void define_candidates(py::module_& m) {
  ResultClass<Conditioned>(m, "PoseCandidate",
                           "A pose that reproduces the bearings of known points.")
      .def_property_readonly(
          "cam_from_world", [](const Conditioned& c) { return c.candidate.cam_from_world; },
          "Pose, 4x4.")
      .def_property_readonly(
          "misfit_rad", [](const Conditioned& c) { return c.candidate.misfit_rad; },
          "Largest angle between a bearing and the direction to its point.")
      .def_readonly("condition", &Conditioned::condition,
                    "Errors of rotation [rad] and position / distance, per error of the bearings "
                    "[rad]; infinite at a double root.")
      .def("__repr__", [](const Conditioned& c) {
        return "<PoseCandidate: misfit " + value_repr(c.candidate.misfit_rad) + " rad, condition " +
               value_repr(c.condition) + ">";
      });
  ResultClass<Candidates> candidates(m, "PoseCandidates", "Checked results of a solver.");
  define_result(candidates);
  candidates
      .def_property_readonly(
          "value", [](const Candidates& c) { return c.value; },
          "List of PoseCandidate, best first.")
      .def("__repr__", [](const Candidates& c) {
        return "<PoseCandidates: " + std::string(to_string(c.status)) + ", " +
               std::to_string(c.value.size()) + ">";
      });
  m.def("pose_candidates", &pose_candidates_of, py::arg("bearings"), py::arg("points_in_world_m"),
        py::arg("solver") = "auto", py::kw_only(), py::arg("origins_in_cam_m") = py::none(),
        py::arg("up_in_cam") = py::none(),
        py::arg("tolerance_rad") = CandidateOptions{}.tolerance_rad,
        py::arg("polish") = CandidateOptions{}.polish,
        R"(Computes all poses from which known points are observed along bearings, with checks.

bearings: (n, 3), a unit vector (camera frame) in each row. points_in_world_m: (n, 3).
solver: a name in solvers(), or "auto". origins_in_cam_m: (n, 3), the start of each bearing, for
several cameras on a rig. up_in_cam: (3,), the world's Z in the camera's frame, if known.
tolerance_rad: limit of the misfit; noisy bearings need about 5 sigmas. polish: refines the solver's
poses.
Returns: PoseCandidates. Their status is ok; too_few_lamps for fewer points than the solver needs;
degenerate for points that coincide, lie on a line or have a layout that the solver does not accept;
no_pose if none fits (the best pose may be in the value).
Raises: ValueError for an unknown solver, numbers that are not finite or counts that differ.)");
}

Result<Fix> solve_pose_of(const Rows3& points_in_world_m, const Rows2& points_px,
                          const Camera& camera, const std::string& solver, double sigma_px,
                          const std::optional<Rigid3>& start, double max_misfit, int max_iterations,
                          const std::vector<double>& sigmas_px, double max_risk) {
  return solve_pose(points_in_world_m.transpose(), points_px.transpose(), camera,
                    {solver, start, sigma_px, max_misfit, max_iterations, sigmas_px, max_risk});
}

void define_solve_pose(py::module_& m) {
  const SolvePoseOptions defaults;
  m.def("solve_pose", &solve_pose_of, py::arg("points_in_world_m"), py::arg("points_px"),
        py::arg("camera"), py::arg("solver") = defaults.solver,
        py::arg("sigma_px") = defaults.sigma_px, py::kw_only(), py::arg("start") = py::none(),
        py::arg("max_misfit") = defaults.max_misfit,
        py::arg("max_iterations") = defaults.max_iterations,
        py::arg("sigmas_px") = std::vector<double>{}, py::arg("max_risk") = defaults.max_risk,
        R"(Computes the maximum-likelihood pose from points and their pixels, with its covariance.

points_in_world_m: (n, 3), n >= 3. points_px: (n, 2), their pixels. solver: a name in solvers(), or
"auto". sigma_px: standard deviation of a pixel coordinate. start: 4x4, initial cam_from_world, such
as that of the previous frame, instead of a solver; other poses that fit are then not searched.
max_misfit: largest chi2 / dof of a pose that fits. sigmas_px: (n,), replaces sigma_px. max_risk:
smallest likelihood ratio of another pose that makes the result ambiguous.
Returns: Fix; status ambiguous if another pose fits nearly as well (all are in `candidates`, with
their probabilities), no_pose if none fits, too_few_lamps, degenerate or not_converged. Its risk
takes the correspondences as right; with `start` it is None.
Raises: ValueError for counts that differ, numbers that are not finite, or an unknown solver.)");
}

}  // namespace

void define_pose(py::module_& m) {
  define_p3p(m);
  define_solvers(m);
  define_candidates(m);
  define_planar(m);
  define_solve_pose(m);
  define_robust_pose(m);
  define_april_tags(m);
  define_headlights(m);
}

}  // namespace occ::python
