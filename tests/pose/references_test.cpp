// SPDX-License-Identifier: Apache-2.0
// Results of the pose solvers for noisy problems, compared with those of an earlier version.
#include "tests/support/references.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/solver_problems.hpp"

namespace occ::test {
namespace {

std::vector<double> numbers_of(const std::vector<Rigid3>& poses) {
  std::vector<double> numbers;
  for (const Rigid3& pose : poses) {
    for (const double value : pose.rotation.reshaped()) numbers.push_back(value);
    for (const double value : pose.translation) numbers.push_back(value);
  }
  return numbers;
}

// Bearings turned by about `sigma_rad`, independently of one another.
void add_noise(PoseProblem& problem, double sigma_rad, Random& random) {
  for (Eigen::Index i = 0; i < problem.bearings.cols(); ++i) {
    const Eigen::Vector3d error(random.normal(), random.normal(), random.normal());
    problem.bearings.col(i) = (problem.bearings.col(i) + sigma_rad * error).normalized();
  }
}

TEST(References, SolversOfNoisyProblems) {
  References references("pose/solvers");
  for (const Solver& solver : solvers()) {
    const std::string source = solver.source;  // results of other libraries are not ours to keep
    if (source.find("Open") != std::string::npos) continue;
    const int least = solver.min_points;
    const int most = solver.max_points > 0 ? solver.max_points : least + 5;
    for (int i = 0; i < 20; ++i) {
      Random random(77, static_cast<std::uint64_t>(i));
      const bool flat =
          solver.layout == Layout::coplanar || (solver.layout == Layout::any && i % 2 == 0);
      const ProblemKind kind{flat, solver.takes_origins && i % 3 == 0, i % 5 == 0};
      KnownProblem known = random_problem(random, least + i % (most - least + 1), kind);
      add_noise(known.problem, 1e-3 * i, random);
      CaseResults results;
      results.summarise("poses", numbers_of(candidates_of(solver, known.problem)));
      references.add(std::string(solver.name) + " " + std::to_string(i), results);
    }
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
