// SPDX-License-Identifier: Apache-2.0
// Share of suitable noise-free problems in which each solver returns the true pose.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

constexpr double exact = 1e-6;

// Share of problems in which a candidate of the bare solver is within `tolerance` of the truth; 1
// for a solver that this build lacks.
double solved(const char* name, int count, const ProblemKind& kind, double tolerance = exact,
              int problems = 200) {
  if (!in_build(name)) return 1;
  const Solver& solver = solver_named(name);
  int found = 0;
  for (int i = 0; i < problems; ++i) {
    Random random(11, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, count, kind);
    const std::vector<Rigid3> candidates = candidates_of(solver, known.problem);
    EXPECT_LE(static_cast<int>(candidates.size()), solver.max_candidates) << name;
    found += best_error(candidates, known.truth) < tolerance;
  }
  return static_cast<double>(found) / problems;
}

ProblemKind flat() { return {true, false, false}; }
ProblemKind half_turned() { return {false, false, true}; }
ProblemKind flat_half_turned() { return {true, false, true}; }
ProblemKind rig() { return {false, true, false}; }
ProblemKind rig_half_turned() { return {false, true, true}; }
ProblemKind at(double distance, bool in_plane) {
  return {in_plane, false, false, distance, distance * 1.001};
}

TEST(Solvers, ListIsComplete) {
  std::set<std::string> names;
  for (const Solver& solver : solvers()) {
    EXPECT_TRUE(names.insert(solver.name).second) << solver.name << " is listed twice";
    EXPECT_EQ(&solver_named(solver.name), &solver);
    EXPECT_TRUE(solver.max_points == 0 || solver.max_points >= solver.min_points) << solver.name;
    EXPECT_GE(solver.max_candidates, 1) << solver.name;
    EXPECT_GT(std::string(solver.failures).size(), 0u) << solver.name;
    EXPECT_GT(std::string(solver.source).size(), 0u) << solver.name;
  }
}

// Every solver is either in the list or missing, and a missing one is an error that says how to get
// it.
TEST(Solvers, MissingOnesNameTheirCMakeOption) {
  EXPECT_EQ(solvers().size() + missing_solvers().size(), 17u);
  for (const MissingMethod& missing : missing_solvers()) {
    const std::string message = complaint([&] { solver_named(missing.name); });
    EXPECT_NE(message.find(missing.name), std::string::npos) << message;
    EXPECT_NE(message.find(std::string("-D") + missing.option + "=ON"), std::string::npos);
    EXPECT_TRUE(std::string(missing.option) == "LIBOCC_OPENCV" ||
                std::string(missing.option) == "LIBOCC_OPENGV");
  }
}

TEST(Solvers, UnknownNameIsRejectedWithTheExistingNames) {
  const std::string message = complaint([] { solver_named("p3p_kniep"); });
  EXPECT_NE(message.find("p3p_kniep"), std::string::npos) << message;
  EXPECT_NE(message.find("p3p_triples"), std::string::npos) << message;
}

TEST(Solvers, SolveIntoACandidateListOnlyAppends) {
  Random random(1);
  for (const Solver& solver : solvers()) {
    const ProblemKind kind{solver.layout == Layout::coplanar, solver.takes_origins, false};
    const KnownProblem known = random_problem(random, std::max(solver.min_points, 3), kind);
    std::vector<Rigid3> candidates(1);
    candidates[0].translation << 7, 8, 9;
    solver.solve(known.problem, candidates);
    EXPECT_EQ(candidates[0].translation, Eigen::Vector3d(7, 8, 9)) << solver.name;
  }
}

TEST(Solvers, TwoPointsAndGravityAreAlwaysSolved) {
  EXPECT_EQ(solved("upright_p2p", 2, {}), 1);
  EXPECT_EQ(solved("upright_p2p", 2, half_turned()), 1);
  EXPECT_EQ(solved("upright_p2p", 2, rig()), 1);
  EXPECT_EQ(solved("upright_p2p", 2, at(50, false)), 1);
}

TEST(Solvers, ThreePoints) {
  for (const ProblemKind& kind : {ProblemKind{}, half_turned(), at(1.2, false)}) {
    EXPECT_GE(solved("p3p_kneip", 3, kind), 0.99);
    EXPECT_GE(solved("p3p_gao", 3, kind), 0.985);
    EXPECT_EQ(solved("triangle", 3, kind), 1);
    EXPECT_GE(solved("gp3p", 3, kind), 0.78);
    EXPECT_GE(solved("gp3p", 3, kind, 0.1), 0.95);
    EXPECT_GE(solved("upnp", 3, kind), 0.9);
    EXPECT_GE(solved("upnp", 3, kind, 1e-2), 0.99);
  }
  EXPECT_GE(solved("sqpnp", 3, {}), 0.75);
}

TEST(Solvers, ThreePointsFarAway) {
  EXPECT_EQ(solved("triangle", 3, at(50, false)), 1);
  EXPECT_EQ(solved("triangle", 3, at(2000, false)), 1);
  EXPECT_GE(solved("p3p_gao", 3, at(50, false), 1e-2), 0.9);
}

TEST(Solvers, FourAndMorePointsInAPlane) {
  for (const int count : {4, 5, 9})
    for (const ProblemKind& kind : {flat(), flat_half_turned(), at(1.2, true), at(50, true)}) {
      EXPECT_EQ(solved("homography", count, kind), 1) << count;
      EXPECT_EQ(solved("ippe", count, kind), 1) << count;
      EXPECT_GE(solved("iterative", count, kind), 0.98) << count;
      EXPECT_GE(solved("sqpnp", count, kind, exact, 60), 0.95) << count;
    }
}

TEST(Solvers, FourAndMorePointsInSpace) {
  for (const ProblemKind& kind : {ProblemKind{}, half_turned(), at(1.2, false)}) {
    EXPECT_GE(solved("sqpnp", 4, kind, exact, 60), 0.94);
    for (const int count : {6, 20}) {
      EXPECT_EQ(solved("sqpnp", count, kind), 1) << count;
      EXPECT_EQ(solved("iterative", count, kind), 1) << count;
      EXPECT_EQ(solved("dlt", count, kind), 1) << count;
      EXPECT_EQ(solved("epnp", count, kind), 1) << count;
    }
  }
  EXPECT_EQ(solved("epnp", 5, {}), 1);
}

TEST(Solvers, UpnpTakesAnyLayoutAndRig) {
  for (const int count : {4, 5, 12})
    for (const ProblemKind& kind :
         {ProblemKind{}, flat(), flat_half_turned(), half_turned(), rig(), rig_half_turned()})
      EXPECT_GE(solved("upnp", count, kind, exact, 50), 0.98) << count;
}

TEST(Solvers, SeveralCentres) {
  for (const ProblemKind& kind : {rig(), rig_half_turned()}) {
    EXPECT_GE(solved("gp3p", 3, kind), 0.78);
    EXPECT_GE(solved("gp3p", 3, kind, 0.1), 0.95);
    EXPECT_EQ(solved("gpnp", 6, kind, exact, 100), 1);
    EXPECT_EQ(solved("gpnp", 15, kind, exact, 100), 1);
  }
}

TEST(Solvers, PositConvergesFromThreeSizesAway) {
  EXPECT_GE(solved("posit", 4, at(3, false)), 0.97);
  EXPECT_EQ(solved("posit", 6, at(5, false)), 1);
  EXPECT_EQ(solved("posit", 4, at(50, false)), 1);
  EXPECT_LT(solved("posit", 4, at(1.5, false)), 0.9);  // as its `failures` states
}

TEST(Solvers, PositInAPlaneConvergesFromFarther) {
  EXPECT_GE(solved("posit_coplanar", 4, at(4, true)), 0.87);
  EXPECT_GE(solved("posit_coplanar", 4, at(10, true)), 0.95);
  EXPECT_GE(solved("posit_coplanar", 4, at(50, true)), 0.99);
  EXPECT_LT(solved("posit_coplanar", 4, at(2, true)), 0.85);  // as its `failures` states
}

// Bearings in all directions, which no image plane contains.
TEST(Solvers, CameraAmongThePoints) {
  ProblemKind among{false, false, false, 0.1, 0.6};
  among.widest = -1;
  EXPECT_EQ(solved("upright_p2p", 2, among), 1);
  EXPECT_GE(solved("p3p_kneip", 3, among), 0.98);
  EXPECT_GE(solved("p3p_gao", 3, among), 0.98);
  EXPECT_EQ(solved("triangle", 3, among), 1);
  EXPECT_GE(solved("gp3p", 3, among, 0.1), 0.95);
  EXPECT_EQ(solved("upnp", 6, among, exact, 100), 1);
  EXPECT_EQ(solved("dlt", 6, among), 1);
  among.flat = true;
  EXPECT_EQ(solved("homography", 5, among), 1);
  among.flat = false;
  among.rig = true;
  EXPECT_EQ(solved("upright_p2p", 2, among), 1);
  EXPECT_EQ(solved("upnp", 6, among, exact, 100), 1);
  EXPECT_EQ(solved("gpnp", 6, among, exact, 100), 1);
}

// Far away a plane has two poses that differ in tilt and fit equally well: both must be returned.
TEST(Solvers, BothPosesOfAPlaneAreReturned) {
  for (const char* name : {"ippe", "posit_coplanar"})
    for (int i = 0; i < 50 && in_build(name); ++i) {
      Random random(5, static_cast<std::uint64_t>(i));
      const KnownProblem known = random_problem(random, 4, at(1000, true));
      const std::vector<Rigid3> candidates = candidates_of(solver_named(name), known.problem);
      ASSERT_EQ(candidates.size(), 2u) << name;
      for (const Rigid3& pose : candidates) {
        const Eigen::Matrix3Xd seen =
            ((pose.rotation * known.problem.points).colwise() + pose.translation)
                .colwise()
                .normalized();
        EXPECT_LT((seen - known.problem.bearings).norm(), 1e-5) << name;
      }
    }
}

// A camera above the middle of an equilateral triangle has four poses.
TEST(Solvers, TriangleFindsAllPosesOfSymmetricViews) {
  PoseProblem problem;
  problem.points.resize(3, 3);
  for (int i = 0; i < 3; ++i)
    problem.points.col(i) << std::cos(2.0943951023931953 * i), std::sin(2.0943951023931953 * i), 0;
  problem.bearings = problem.points.colwise() + Eigen::Vector3d(0, 0, 2);
  problem.bearings.colwise().normalize();
  EXPECT_EQ(candidates_of(solver_named("triangle"), problem).size(), 4u);
}

// The camera on the cylinder through the points and along their normal: two poses merge into one.
TEST(Solvers, TriangleFindsADoubleRoot) {
  const Solver& triangle = solver_named("triangle");
  for (int i = 0; i < 100; ++i) {
    Random random(8, static_cast<std::uint64_t>(i));
    PoseProblem problem;
    problem.points.resize(3, 3);
    for (int k = 0; k < 3; ++k) {
      const double angle = random.uniform(2.1 * k, 2.1 * k + 1.5);
      problem.points.col(k) << std::cos(angle), std::sin(angle), 0;
    }
    const double angle = random.uniform(0, 6.28);
    Rigid3 truth;
    truth.rotation = random_rotation(random);
    truth.translation = -(truth.rotation * Eigen::Vector3d(std::cos(angle), std::sin(angle), -2.5));
    problem.bearings = (truth.rotation * problem.points).colwise() + truth.translation;
    problem.bearings.colwise().normalize();
    EXPECT_LT(best_error(candidates_of(triangle, problem), truth), 1e-5) << i;
  }
}

}  // namespace
}  // namespace occ::test
