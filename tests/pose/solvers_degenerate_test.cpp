// SPDX-License-Identifier: Apache-2.0
// Degenerate inputs: no solver may crash, throw, print or return more candidates than it declares.
// For inputs that a method does not accept it returns nothing.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/solver_problems.hpp"

namespace occ::test {
namespace {

using Deform = std::function<void(Random&, Eigen::Matrix3Xd& points, Rigid3& pose)>;

struct Degeneracy {
  const char* name;
  Deform deform;
};

Eigen::Vector3d corner(Eigen::Index i) {
  return {i & 1 ? 1. : -1., i & 2 ? 1. : -1., i & 4 ? 1. : -1.};
}

void face_on(Rigid3& pose) {
  pose.rotation.setIdentity();
  pose.translation << 0, 0, 5;
}

double thinness(Random& random) { return std::pow(10.0, -random.below(14)); }

std::vector<Degeneracy> degeneracies() {
  return {
      {"coincident", [](Random&, auto& p, auto&) { p.colwise() = Eigen::Vector3d(0.3, 0.2, 0.1); }},
      {"collinear",
       [](Random& random, auto& p, auto&) {
         const Eigen::Vector3d direction = random_rotation(random).col(0);
         for (Eigen::Index i = 0; i < p.cols(); ++i) p.col(i) = random.normal() * direction;
       }},
      {"on an axis, face-on",
       [](Random&, auto& p, auto& pose) {
         for (Eigen::Index i = 0; i < p.cols(); ++i)
           p.col(i) = static_cast<double>(i) * Eigen::Vector3d::UnitX();
         face_on(pose);
       }},
      {"coplanar", [](Random&, auto& p, auto&) { p.row(2).setZero(); }},
      {"coplanar, face-on",
       [](Random&, auto& p, auto& pose) {
         p.row(2).setZero();
         face_on(pose);
       }},
      {"square, face-on",
       [](Random&, auto& p, auto& pose) {
         for (Eigen::Index i = 0; i < p.cols(); ++i) p.col(i) = corner(i & 3);
         face_on(pose);
       }},
      {"cube, face-on",
       [](Random&, auto& p, auto& pose) {
         for (Eigen::Index i = 0; i < p.cols(); ++i) p.col(i) = corner(i);
         face_on(pose);
       }},
      {"nearly coplanar", [](Random& random, auto& p, auto&) { p.row(2) *= thinness(random); }},
      {"nearly collinear",
       [](Random& random, auto& p, auto&) { p.bottomRows(2) *= thinness(random); }},
      {"in two places",
       [](Random&, auto& p, auto&) {
         for (Eigen::Index i = 2; i < p.cols(); ++i) p.col(i) = p.col(i % 2).eval();
       }},
      {"in three places",
       [](Random&, auto& p, auto&) {
         for (Eigen::Index i = 3; i < p.cols(); ++i) p.col(i) = p.col(i % 3).eval();
       }},
      {"camera among the points", [](Random&, auto&, auto& pose) { pose.translation.setZero(); }},
      {"camera in the points' plane",
       [](Random&, auto& p, auto& pose) {
         p.row(2).setZero();
         pose.translation = pose.rotation * Eigen::Vector3d(4, 3, 0);
       }},
      {"behind the camera",
       [](Random&, auto&, auto& pose) {
         pose.rotation.setIdentity();
         pose.translation << 0, 0, -5;
       }},
  };
}

PoseProblem degenerate_problem(const Solver& solver, const Degeneracy& degeneracy, Random& random) {
  const int count = solver.max_points > 0 ? solver.max_points : solver.min_points + random.below(5);
  Eigen::Matrix3Xd points = random_points(random, count, false);
  Rigid3 pose{random_rotation(random), {}};
  pose.translation = pose.rotation * Eigen::Vector3d(0.2, 0.1, 5);
  degeneracy.deform(random, points, pose);
  points.colwise() -= points.rowwise().mean().eval();
  const double size = std::sqrt(points.squaredNorm() / count);
  if (size > 0) points /= size;
  PoseProblem problem;
  problem.points = points;
  const bool rig = solver.takes_origins && random.below(2) == 1;
  problem.origins = 0.3 * Eigen::Matrix3Xd::NullaryExpr(3, rig ? count : 0,
                                                        [&](auto...) { return random.normal(); });
  problem.bearings = (pose.rotation * points).colwise() + pose.translation;
  if (rig) problem.bearings -= problem.origins;
  for (Eigen::Index i = 0; i < count; ++i)
    if (!(problem.bearings.col(i).norm() > 0)) problem.bearings.col(i) = Eigen::Vector3d::UnitZ();
  problem.bearings.colwise().normalize();
  if (std::string(degeneracy.name) == "behind the camera") problem.bearings *= -1;
  problem.up_in_cam = pose.rotation.col(2);
  return problem;
}

class CapturedOutput {  // everything printed during its lifetime
 public:
  CapturedOutput() {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
  }
  std::string printed() {
    return testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  }
};

TEST(DegenerateSolvers, NoneCrashesThrowsOrPrints) {
  CapturedOutput output;
  for (const Degeneracy& degeneracy : degeneracies())
    for (const Solver& solver : solvers())
      for (int i = 0; i < 20; ++i) {
        Random random(3, static_cast<std::uint64_t>(i));
        const PoseProblem problem = degenerate_problem(solver, degeneracy, random);
        std::vector<Rigid3> candidates;
        EXPECT_NO_THROW(solver.solve(problem, candidates)) << solver.name << degeneracy.name;
        EXPECT_LE(static_cast<int>(candidates.size()), solver.max_candidates)
            << solver.name << ", " << degeneracy.name;
      }
  EXPECT_EQ(output.printed(), "");
}

TEST(DegenerateSolvers, SurviveBearingsOfNoPose) {
  CapturedOutput output;
  for (const Solver& solver : solvers())
    for (int i = 0; i < 60; ++i) {
      Random random(4, static_cast<std::uint64_t>(i));
      const int count = solver.max_points > 0 ? solver.max_points : solver.min_points + 2;
      PoseProblem problem = random_problem(random, count, {}).problem;
      for (int k = 0; k < count; ++k) {
        if (i % 3 == 0) problem.bearings.col(k) = random_rotation(random).col(0);
        if (i % 3 == 1) problem.bearings.col(k) = problem.bearings.col(0).eval();
        if (i % 3 == 2) problem.bearings.col(k) = problem.bearings.col(k % 2).eval();
      }
      std::vector<Rigid3> candidates;
      EXPECT_NO_THROW(solver.solve(problem, candidates)) << solver.name;
    }
  EXPECT_EQ(output.printed(), "");
}

bool anything_finite(const std::vector<Rigid3>& candidates) {
  for (const Rigid3& pose : candidates)
    if (pose.rotation.allFinite() && pose.translation.allFinite()) return true;
  return false;
}

TEST(DegenerateSolvers, CoincidentPointsYieldNoPose) {
  for (const Solver& solver : solvers()) {
    Random random(5);
    const PoseProblem problem = degenerate_problem(solver, degeneracies()[0], random);
    EXPECT_FALSE(anything_finite(candidates_of(solver, problem))) << solver.name;
  }
}

TEST(DegenerateSolvers, RejectLayoutsThatAMethodDoesNotAccept) {
  Random random(6);
  for (const char* name : {"dlt", "epnp", "gpnp", "posit"}) {
    if (!in_build(name)) continue;
    const PoseProblem flat = random_problem(random, 8, {true, true, false}).problem;
    EXPECT_TRUE(candidates_of(solver_named(name), flat).empty()) << name;
  }
  for (const char* name : {"homography", "ippe", "posit_coplanar", "iterative", "sqpnp", "upnp"}) {
    if (!in_build(name)) continue;
    const PoseProblem line = degenerate_problem(solver_named(name), degeneracies()[1], random);
    EXPECT_TRUE(candidates_of(solver_named(name), line).empty()) << name;
  }
  // The linear system of this method needs several centres.
  const PoseProblem central = random_problem(random, 8, {}).problem;
  if (in_build("gpnp")) {
    EXPECT_TRUE(candidates_of(solver_named("gpnp"), central).empty());
  }
}

TEST(DegenerateSolvers, RejectFewerPointsThanAMethodNeeds) {
  Random random(7);
  for (const char* name : {"dlt", "gp3p", "gpnp", "homography", "ippe", "iterative",
                           "posit_coplanar", "sqpnp", "triangle", "upnp", "upright_p2p"}) {
    if (!in_build(name)) continue;
    const Solver& solver = solver_named(name);
    const int count = solver.min_points - 1;
    const ProblemKind kind{solver.layout == Layout::coplanar, solver.takes_origins};
    KnownProblem known = random_problem(random, solver.min_points, kind);
    for (Eigen::Matrix3Xd* columns :
         {&known.problem.points, &known.problem.bearings, &known.problem.origins})
      if (columns->cols() > 0) *columns = columns->leftCols(count).eval();
    EXPECT_TRUE(candidates_of(solver, known.problem).empty()) << name;
  }
}

TEST(DegenerateSolvers, RejectBearingsOutsideAnyImagePlane) {
  PoseProblem around;  // four bearings, each 109 degrees from the others
  around.points = Eigen::Matrix3Xd(3, 6);
  around.points << 1, -1, 1, -1, 2, 0, 1, -1, -1, 1, 0, 2, 1, 1, -1, -1, 0, 0;
  around.bearings = around.points.colwise().normalized();
  for (const char* name : {"epnp", "ippe", "iterative", "posit", "posit_coplanar", "sqpnp"}) {
    if (!in_build(name)) continue;
    EXPECT_TRUE(candidates_of(solver_named(name), around).empty()) << name;
  }
}

// OpenGV's own UPnP reads outside its memory for this problem.
TEST(DegenerateSolvers, UpnpSolvesAFaceOnCube) {
  if (!in_build("upnp")) GTEST_SKIP() << "needs OpenGV";
  PoseProblem problem;
  problem.points.resize(3, 8);
  for (Eigen::Index i = 0; i < 8; ++i) problem.points.col(i) = corner(i) / std::sqrt(3.0);
  Rigid3 truth;
  truth.translation << 0, 0, 4;
  problem.bearings = (problem.points.colwise() + truth.translation).colwise().normalized();
  EXPECT_LT(best_error(candidates_of(solver_named("upnp"), problem), truth), 1e-6);
}

TEST(DegenerateSolvers, RejectAnUnobservableHeading) {
  const Solver& upright = solver_named("upright_p2p");
  PoseProblem problem;
  problem.up_in_cam = Eigen::Vector3d::UnitZ();
  problem.points = (Eigen::Matrix3Xd(3, 2) << 0, 0, 0, 0, -1, 1).finished();  // one above the other
  problem.bearings = (problem.points.colwise() + Eigen::Vector3d(3, 0, 0)).colwise().normalized();
  EXPECT_TRUE(candidates_of(upright, problem).empty());
  problem.points =
      (Eigen::Matrix3Xd(3, 2) << 0, 0, -1, 1, 0, 0).finished();  // at the camera's height
  problem.bearings = (problem.points.colwise() + Eigen::Vector3d(3, 0, 0)).colwise().normalized();
  EXPECT_TRUE(candidates_of(upright, problem).empty());
}

TEST(DegenerateSolvers, RejectGravityThatContradictsTheBearings) {
  PoseProblem problem;
  problem.points = (Eigen::Matrix3Xd(3, 2) << -0.1, 0.1, 0, 0, -1, 1).finished();
  problem.bearings =
      (Eigen::Matrix3Xd(3, 2) << -0.5, 0.5, 0, 0, 1, 1).finished().colwise().normalized();
  problem.up_in_cam = Eigen::Vector3d::UnitY();  // the upper point would be beside the lower
  EXPECT_TRUE(candidates_of(solver_named("upright_p2p"), problem).empty());
}

// OpenGV's EPnP uses static memory: without the lock about one result in 300 differs.
TEST(DegenerateSolvers, ThreadsDoNotDisturbOneAnother) {
  if (!in_build("epnp")) GTEST_SKIP() << "needs OpenGV";
  const Solver& epnp = solver_named("epnp");
  constexpr std::size_t count = 2000, workers = 4;
  std::vector<PoseProblem> problems;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(9, i);
    problems.push_back(random_problem(random, 8, {}).problem);
  }
  std::vector<std::vector<Rigid3>> together(count);
  std::vector<std::thread> threads;
  for (std::size_t first = 0; first < workers; ++first)
    threads.emplace_back([&, first] {
      for (std::size_t i = first; i < count; i += workers)
        together[i] = candidates_of(epnp, problems[i]);
    });
  for (std::thread& thread : threads) thread.join();
  int differing = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<Rigid3> alone = candidates_of(epnp, problems[i]);
    differing +=
        alone.size() != together[i].size() || alone[0].translation != together[i][0].translation;
  }
  EXPECT_EQ(differing, 0);
}

}  // namespace
}  // namespace occ::test
