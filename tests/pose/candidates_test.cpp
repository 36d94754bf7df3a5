// SPDX-License-Identifier: Apache-2.0
// Checks around every solver: results fit, are poses, and do not depend on the world's origin or
// unit, or on the order of points. Unsolvable problems are rejected.
#include "libocc/pose/candidates.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

using Found = Result<std::vector<PoseCandidate>>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

// A problem that the solver accepts; layout, number of points and rig depend on i.
KnownProblem suitable(const Solver& solver, int i) {
  Random random(21, static_cast<std::uint64_t>(i));
  const std::string name = solver.name;
  int count = solver.max_points > 0 ? solver.max_points : solver.min_points + i % 5;
  ProblemKind kind;
  kind.flat = solver.layout == Layout::coplanar || (solver.layout == Layout::any && i % 2 == 1);
  if (name == "iterative" && !kind.flat) count += 2;
  kind.rig = name == "gpnp" || (solver.takes_origins && i % 4 < 2);
  kind.half_turn = i % 5 == 0;
  return random_problem(random, count, kind);
}

KnownProblem noisy(const Solver& solver, int i, double sigma_rad = 0.01) {
  KnownProblem known = suitable(solver, i);
  Random random(22, static_cast<std::uint64_t>(i));
  for (int k = 0; k < known.problem.size(); ++k)
    known.problem.bearings.col(k) += sigma_rad * random_vector(random);
  known.problem.bearings.colwise().normalize();
  return known;
}

// Computes the angle itself, independently of the library.
double worst_angle(const PoseProblem& p, const Rigid3& pose) {
  double worst = 0;
  for (int i = 0; i < p.size(); ++i) {
    Eigen::Vector3d x = pose * Eigen::Vector3d(p.points.col(i));
    if (p.origins.cols() > 0) x -= p.origins.col(i);
    const Eigen::Vector3d f = p.bearings.col(i);
    worst = std::max(worst, std::atan2(f.cross(x).norm(), f.dot(x)));
  }
  return worst;
}

bool is_rotation(const Eigen::Matrix3d& r, double within) {
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).norm() < within && r.determinant() > 0;
}

std::vector<Rigid3> poses(const Found& found) {
  std::vector<Rigid3> list;
  for (const PoseCandidate& c : *found) list.push_back(c.cam_from_world);
  return list;
}

// Expects the properties of every result of pose_candidates.
void expect_valid(const Found& found, const PoseProblem& p, double tolerance_rad,
                  const std::string& what) {
  for (std::size_t i = 0; i < found->size(); ++i) {
    const PoseCandidate& c = found.value[i];
    ASSERT_TRUE(c.cam_from_world.translation.allFinite()) << what;
    EXPECT_TRUE(is_rotation(c.cam_from_world.rotation, 1e-12)) << what;
    const double angle = worst_angle(p, c.cam_from_world);
    EXPECT_LT(angle, 1.5708) << what << ": a point behind";
    EXPECT_NEAR(std::tan(angle), c.misfit_rad, 1e-13 + 1e-6 * c.misfit_rad) << what;
    if (found.ok()) {
      EXPECT_LE(angle, tolerance_rad + 1e-13) << what;
    }
    if (i > 0) {
      EXPECT_GE(c.misfit_rad, found.value[i - 1].misfit_rad) << what;
    }
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_GT(pose_error(c.cam_from_world, found.value[k].cam_from_world), 1e-8) << what;
  }
}

// Share of noise-free problems whose true pose is among the candidates; 1 if not listed.
double share_solved(const std::string& name) {
  static const std::map<std::string, double> shares = {
      {"p3p_kneip", 0.98}, {"p3p_gao", 0.98}, {"gp3p", 0.95},          {"sqpnp", 0.85},
      {"upnp", 0.97},      {"posit", 0.8},    {"posit_coplanar", 0.9}, {"epnp", 0.8}};
  const auto found = shares.find(name);
  return found == shares.end() ? 1 : found->second;
}

TEST(PoseCandidates, FitWithoutNoise) {
  constexpr int problems = 200;
  for (const Solver& solver : solvers()) {
    int solved = 0;
    for (int i = 0; i < problems; ++i) {
      const KnownProblem known = suitable(solver, i);
      const Found found = pose_candidates(known.problem, solver.name);
      expect_valid(found, known.problem, 1e-6, solver.name);
      EXPECT_LE(static_cast<int>(found->size()), solver.max_candidates) << solver.name;
      if (found.ok()) {
        EXPECT_LT(found->front().misfit_rad, 1e-11) << solver.name << i;
      }
      solved += best_error(poses(found), known.truth) < 1e-7;
    }
    EXPECT_GE(solved, share_solved(solver.name) * problems) << solver.name;
  }
}

TEST(PoseCandidates, AllFitForThreePoints) {
  for (int i = 0; i < 1000; ++i) {
    const KnownProblem known = suitable(solver_named("p3p"), i);
    const Found found = pose_candidates(known.problem);
    ASSERT_TRUE(found.ok()) << found.message;
    for (const PoseCandidate& c : *found) EXPECT_LT(c.misfit_rad, 1e-11) << i;
  }
}

// With noisy bearings, no solver yields a candidate outside the tolerance.
TEST(PoseCandidates, NoneIsOutsideTheTolerance) {
  for (const Solver& solver : solvers())
    for (int i = 0; i < 60; ++i) {
      const KnownProblem known = noisy(solver, i);
      for (const double tolerance : {1e-6, 3e-3, 0.05, 4.0})
        for (const bool polish : {false, true}) {
          const Found found = pose_candidates(known.problem, solver.name, {tolerance, polish});
          expect_valid(found, known.problem, tolerance, solver.name);
          EXPECT_TRUE(found.ok() || found.status == Status::no_pose);
          if (!found.ok() && !found->empty()) {
            EXPECT_EQ(found->size(), 1u);
            EXPECT_GT(found->front().misfit_rad, tolerance) << solver.name;
          }
        }
    }
}

TEST(PoseCandidates, ArePolishedOnlyIfRequested) {
  int improved = 0;
  for (const char* name : {"ippe", "homography", "dlt"})
    for (int i = 0; i < 50 && in_build(name); ++i) {
      const KnownProblem known = noisy(solver_named(name), 2 * i);
      const std::vector<Rigid3> raw = candidates_of(solver_named(name), known.problem);
      const Found as_found = pose_candidates(known.problem, name, {4, false});
      for (const PoseCandidate& c : *as_found) {
        EXPECT_LT(best_error(raw, c.cam_from_world), 1e-6) << name;
      }
      const Found polished = pose_candidates(known.problem, name, {4, true});
      ASSERT_EQ(as_found.ok(), polished.ok());
      if (!polished.ok()) continue;
      EXPECT_LE(polished->front().misfit_rad, as_found->front().misfit_rad);
      improved += polished->front().misfit_rad < 0.9 * as_found->front().misfit_rad;
    }
  EXPECT_GT(improved, 50);
}

// True if each pose of either list is within `tolerance` of one of the other list.
bool same_poses(const std::vector<Rigid3>& a, const std::vector<Rigid3>& b, double tolerance) {
  const auto covered = [&](const std::vector<Rigid3>& some, const std::vector<Rigid3>& all) {
    return std::all_of(some.begin(), some.end(),
                       [&](const Rigid3& pose) { return best_error(all, pose) < tolerance; });
  };
  return covered(a, b) && covered(b, a);
}

// Largest condition number of the candidates; infinite if there are none.
double worst_condition(const PoseProblem& p, const Found& found) {
  double worst = found->empty() ? infinity : 0;
  for (const PoseCandidate& c : *found)
    worst = std::max(worst, pose_condition(p, c.cam_from_world));
  return worst;
}

// Moves the world and changes its unit: poses are equal to within rounding of the points.
TEST(PoseCandidates, DoNotDependOnTheWorldsOriginAndUnit) {
  for (const Solver& solver : solvers())
    for (const double offset : {0.0, 1e4, 1e7})
      for (const double unit : {1e-6, 1e-3, 1.0, 1e6}) {
        int same = 0, tested = 0;
        for (int i = 0; i < 12; ++i) {
          const KnownProblem known = suitable(solver, i);
          const Found plain = pose_candidates(known.problem, solver.name);
          const double condition = worst_condition(known.problem, plain);
          if (condition > 1e4) continue;
          ++tested;
          const Eigen::Vector3d shift = offset * Eigen::Vector3d(0.7, -0.5, 0.4);
          PoseProblem moved = known.problem;
          moved.points = unit * (known.problem.points.colwise() + shift);
          moved.origins *= unit;
          const Found found = pose_candidates(moved, solver.name);
          std::vector<Rigid3> back = poses(found);
          for (Rigid3& pose : back)
            pose.translation = pose.translation / unit + pose.rotation * shift;
          same += same_poses(back, poses(plain), 100 * condition * (1e-13 + 1e-16 * offset));
        }
        // a solver that misses poses may miss other poses
        EXPECT_GE(same, share_solved(solver.name) == 1 ? tested : tested * 0.8)
            << solver.name << " at " << offset << " in " << unit;
      }
}

TEST(PoseCandidates, DoNotDependOnTheOrderOfPoints) {
  for (const Solver& solver : solvers()) {
    int same = 0, tested = 0;
    for (int i = 0; i < 40; ++i) {
      const KnownProblem known = suitable(solver, i);
      const int n = known.problem.size();
      PoseProblem turned = known.problem;
      for (int k = 0; k < n; ++k) {
        const int from = (k + 1 + i % (n - 1)) % n;
        turned.points.col(k) = known.problem.points.col(from);
        turned.bearings.col(k) = known.problem.bearings.col(from);
        if (turned.origins.cols() > 0) turned.origins.col(k) = known.problem.origins.col(from);
      }
      const Found plain = pose_candidates(known.problem, solver.name);
      const double condition = worst_condition(known.problem, plain);
      if (condition > 1e4) continue;
      ++tested;
      same +=
          same_poses(poses(pose_candidates(turned, solver.name)), poses(plain), 1e-11 * condition);
    }
    EXPECT_GE(same, share_solved(solver.name) == 1 ? tested : tested * 0.75) << solver.name;
  }
}

TEST(PoseCandidates, AutoChoosesASuitableSolver) {
  Random random(23);
  ProblemKind rig;
  rig.rig = true;
  for (const int count : {2, 3, 4, 9}) {
    const KnownProblem known = random_problem(random, count, {});
    EXPECT_LT(best_error(poses(pose_candidates(known.problem)), known.truth), 1e-9) << count;
  }
  if (!in_build("upnp")) GTEST_SKIP() << "rigs need OpenGV's solvers";
  const KnownProblem many = random_problem(random, 7, rig);
  EXPECT_LT(best_error(poses(pose_candidates(many.problem)), many.truth), 1e-9);
  EXPECT_TRUE(pose_candidates(random_problem(random, 3, rig).problem).ok());
}

// A minimal solver uses some of the points; the candidates are tested on all of them.
TEST(PoseCandidates, OfAMinimalSolverAreTestedOnAllPoints) {
  for (const char* name : {"p3p", "p3p_kneip", "triangle", "upright_p2p"})
    for (int i = 0; i < 100 && in_build(name); ++i) {
      Random random(24, static_cast<std::uint64_t>(i));
      const KnownProblem known = random_problem(random, 4 + i % 5, {});
      const Found found = pose_candidates(known.problem, name);
      if (!found.ok()) continue;
      EXPECT_LT(pose_error(found->front().cam_from_world, known.truth), 1e-9) << name;
      EXPECT_LT(worst_angle(known.problem, found->front().cam_from_world), 1e-11) << name;
    }
}

// Two points fit a family of poses: the vertical must keep its given direction.
TEST(PoseCandidates, OfTwoPointsKeepTheVertical) {
  for (int i = 0; i < 200; ++i) {
    Random random(25, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 2, {});
    const Found found = pose_candidates(known.problem, "upright_p2p");
    ASSERT_TRUE(found.ok());
    for (const PoseCandidate& c : *found)
      EXPECT_LT((c.cam_from_world.rotation.col(2) - *known.problem.up_in_cam).norm(), 1e-11);
  }
  // If the two headings coincide, rounding of the bearings causes a misfit that a change of the
  // tilt would reduce.
  PoseProblem p;
  p.points = (Eigen::Matrix3Xd(3, 2) << 2, 1, 1, 1, 2, 1).finished();
  p.up_in_cam = Eigen::Vector3d::UnitZ();
  int found_some = 0;
  for (int i = 0; i < 200; ++i) {
    Random random(31, static_cast<std::uint64_t>(i));
    p.bearings = p.points.colwise().normalized();
    for (int k = 0; k < 2; ++k) p.bearings.col(k) += 2e-13 * random_vector(random);
    const Found found = pose_candidates(p);
    for (const PoseCandidate& c : *found) {
      ++found_some;
      EXPECT_LT((c.cam_from_world.rotation.col(2) - *p.up_in_cam).norm(), 1e-11) << i;
    }
  }
  EXPECT_GT(found_some, 50);
}

TEST(PoseCandidates, NoPointIsBehindItsBearing) {
  for (const Solver& solver : solvers())
    for (int i = 0; i < 40; ++i) {
      PoseProblem behind = suitable(solver, i).problem;
      behind.bearings *= -1;
      const Found found = pose_candidates(behind, solver.name);
      // Points in a plane, and few points, have other poses with all points in front.
      expect_valid(found, behind, 1e-6, solver.name);
      if (behind.size() > 5 && i % 2 == 0 && solver.layout != Layout::coplanar) {
        EXPECT_EQ(found.status, Status::no_pose) << solver.name;
      }
      if (found->empty()) {
        EXPECT_FALSE(found.message.empty());
      }
    }
}

TEST(PoseCandidates, BearingsOfOtherPointsFitNoPose) {
  for (const Solver& solver : solvers()) {
    if (solver.max_points > 0) continue;
    int nearest = 0;
    for (int i = 0; i < 40; ++i) {
      PoseProblem mixed = suitable(solver, i).problem;
      if (mixed.size() < 5) continue;
      mixed.bearings.col(0).swap(mixed.bearings.col(2));
      mixed.bearings.col(1).swap(mixed.bearings.col(4));
      const Found found = pose_candidates(mixed, solver.name);
      EXPECT_EQ(found.status, Status::no_pose) << solver.name;
      EXPECT_FALSE(found.message.empty());
      EXPECT_LE(found->size(), 1u);
      nearest += !found->empty() && found->front().misfit_rad > 1e-6;
    }
    if (std::string(solver.name) == "p3p_triples") {
      EXPECT_GT(nearest, 10);
    }
  }
  // A triangle seen wider than from any position.
  PoseProblem wide;
  wide.points = Eigen::Matrix3Xd::Identity(3, 3);
  wide.points.col(2) << 0.5, 0.5, 1e-3;
  wide.bearings = (Eigen::Matrix3Xd(3, 3) << 1, -0.5, -0.5, 0, 0.866, -0.866, 0.1, 0.1, 0.1)
                      .finished()
                      .colwise()
                      .normalized();
  EXPECT_EQ(pose_candidates(wide, "p3p").status, Status::no_pose);
}

Found with_points(PoseProblem problem, const Eigen::Matrix3Xd& points, const Solver& solver) {
  problem.points = points;
  return pose_candidates(problem, solver.name);
}

TEST(PoseCandidates, RejectsPointsThatDetermineNoPose) {
  for (const Solver& solver : solvers())
    for (const double offset : {0.0, 1e4, 1e7}) {
      const KnownProblem known = suitable(solver, 1);
      const int n = known.problem.size();
      const Eigen::Vector3d at(0.3 + offset, 0.2 - offset, 0.1), along(0.3, -0.7, 0.2);
      const Eigen::Matrix3Xd coincident = at.replicate(1, n);
      EXPECT_EQ(with_points(known.problem, coincident, solver).status, Status::degenerate)
          << solver.name << offset;
      if (n < 3) continue;
      Eigen::Matrix3Xd line = coincident, pair = coincident;
      for (int i = 0; i < n; ++i) {
        line.col(i) += (i * i - 2.5) * along;
        pair.col(i) += (i % 2) * along;
      }
      EXPECT_EQ(with_points(known.problem, line, solver).status, Status::degenerate)
          << solver.name << offset;
      const Found found = with_points(known.problem, pair, solver);
      EXPECT_EQ(found.status, Status::degenerate) << solver.name << offset;
      EXPECT_TRUE(found->empty());
      EXPECT_FALSE(found.message.empty());
    }
}

TEST(PoseCandidates, RejectsLayoutsThatASolverDoesNotAccept) {
  for (const Solver& solver : solvers()) {
    if (solver.layout == Layout::any) continue;
    Random random(26);
    ProblemKind kind;
    kind.flat = solver.layout == Layout::not_coplanar;
    kind.rig = solver.takes_origins;
    const Found found = pose_candidates(random_problem(random, 8, kind).problem, solver.name);
    EXPECT_EQ(found.status, Status::degenerate);
    EXPECT_NE(found.message.find(solver.name), std::string::npos) << found.message;
  }
}

TEST(PoseCandidates, RejectsTooFewPoints) {
  Random random(27);
  for (const Solver& solver : solvers()) {
    PoseProblem few = random_problem(random, solver.min_points, {}).problem;
    few.points.conservativeResize(3, solver.min_points - 1);
    few.bearings.conservativeResize(3, solver.min_points - 1);
    const Found found = pose_candidates(few, solver.name);
    EXPECT_EQ(found.status, Status::too_few_lamps) << solver.name;
    EXPECT_NE(found.message.find(std::to_string(solver.min_points)), std::string::npos);
  }
  PoseProblem none;
  EXPECT_EQ(pose_candidates(none).status, Status::too_few_lamps);
  PoseProblem two = random_problem(random, 2, {}).problem;
  two.up_in_cam.reset();
  EXPECT_EQ(pose_candidates(two).status, Status::too_few_lamps);
}

std::string error_message(const PoseProblem& problem, const std::string& solver = "auto",
                          const CandidateOptions& options = {}) {
  return complaint([&] { pose_candidates(problem, solver, options); });
}

void expect_contains(const std::string& message, const char* what) {
  EXPECT_NE(message.find(what), std::string::npos) << message << ", expected: " << what;
}

TEST(PoseCandidates, ThrowsForInvalidArguments) {
  Random random(28);
  const PoseProblem good = random_problem(random, 5, {}).problem;
  ProblemKind kind;
  kind.rig = true;
  const PoseProblem rig = random_problem(random, 5, kind).problem;
  for (const double bad : {nan, infinity, -infinity}) {
    PoseProblem p = good;
    p.points(1, 3) = bad;
    expect_contains(error_message(p), "points[3]");
    p = good;
    p.bearings(0, 2) = bad;
    expect_contains(error_message(p), "bearings[2]");
    p = rig;
    p.origins(2, 4) = bad;
    expect_contains(error_message(p), "origins[4]");
    p = good;
    (*p.up_in_cam)[1] = bad;
    expect_contains(error_message(p), "up_in_cam");
  }
  PoseProblem p = good;
  for (const double side : {-1, 1}) {
    p.bearings.col(4) = (1 + side * 1.2e-6) * good.bearings.col(4);
    expect_contains(error_message(p), "bearings[4]");
    p.bearings.col(4) = (1 + side * 0.8e-6) * good.bearings.col(4);
    *p.up_in_cam = (1 + side * 0.8e-6) * *good.up_in_cam;
    EXPECT_EQ(error_message(p), "");
    *p.up_in_cam = (1 + side * 1.2e-6) * *good.up_in_cam;
    expect_contains(error_message(p), "up_in_cam");
    p = good;
  }
  p = good;
  p.bearings.conservativeResize(3, 4);
  expect_contains(error_message(p), "bearings");
  p = rig;
  p.origins.conservativeResize(3, 4);
  expect_contains(error_message(p), "origins");
  expect_contains(error_message(rig, "p3p"), "p3p");
  expect_contains(error_message(good, "pnp"), "p3p_triples, ");
  p = good;
  p.up_in_cam.reset();
  expect_contains(error_message(p, "upright_p2p"), "up_in_cam");
  for (const double bad : {0.0, -1.0, nan})
    expect_contains(error_message(good, "p3p", {bad}), "tolerance_rad");
}

}  // namespace
}  // namespace occ::test
