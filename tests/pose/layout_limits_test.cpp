// SPDX-License-Identifier: Apache-2.0
// Thickness of the points up to which solvers for a plane accept them, and from which solvers for
// points in space do.
#include <gtest/gtest.h>

#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

/// Eight points whose extent across their plane is `thickness` of the largest one.
PoseProblem layer_problem(double thickness) {
  Random random(11);
  PoseProblem problem = random_problem(random, 8, {}).problem;
  internal::pose::PointLayout layout = internal::pose::point_layout(problem.points);
  Eigen::Matrix3Xd along = layout.axes.transpose() * (problem.points.colwise() - layout.centroid);
  along.row(2) *= thickness * layout.extent[0] / layout.extent[2];
  problem.points = along;
  const Rigid3 pose{so3_exp({0.3, 0.4, 0.2}), {0.1, 0.2, 4}};
  problem.bearings = (pose.rotation * along).colwise() + pose.translation;
  problem.bearings.colwise().normalize();
  return problem;
}

bool is_accepted(const char* solver, double thickness) {
  CandidateOptions options;
  options.tolerance_rad = 0.1;
  const auto found = pose_candidates(layer_problem(thickness), solver, options);
  return found.status != Status::degenerate;
}

TEST(LayoutLimits, APlaneIsUpToAThousandthThick) {
  for (const double thickness : {0.0, 1e-4, 6e-4, 0.95e-3, 1.05e-3, 1.4e-3, 0.1})
    EXPECT_EQ(is_accepted("homography", thickness), thickness < 1e-3) << thickness;
}

TEST(LayoutLimits, PointsInSpaceAreAMillionthThick) {
  for (const double thickness : {0.0, 0.6e-6, 0.95e-6, 1.05e-6, 1.4e-6, 0.1})
    EXPECT_EQ(is_accepted("dlt", thickness), thickness > 1e-6) << thickness;
}

}  // namespace
}  // namespace occ::test
