// SPDX-License-Identifier: Apache-2.0
// Pairs of lamps whose apparent sizes contradict the distance between them.
#include "libocc/identify/internal/size_consistency.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/support.hpp"

namespace occ {
using namespace internal::identify;
namespace {

/// Two discs of 0.1 m at the given distances along two rays, and their place in the map.
struct TwoDiscs {
  IdentifyOptions options;
  AssignmentProblem problem;
  double d1 = 3, d2 = 2, angle_rad = 0.5;

  TwoDiscs() {
    options.gate_sigma = 4;
    problem.options = &options;
    for (int i = 0; i < 2; ++i) {
      BearingObservation seen;
      seen.bearing = {std::sin(i * angle_rad), 0, std::cos(i * angle_rad)};
      seen.axis = seen.bearing;
      seen.tangent.setZero();
      seen.covariance.setZero();
      seen.sigma_rad = 0.005;
      see_at(seen, i == 0 ? d1 : d2, 1);
      problem.observations.push_back(seen);
      MapPoint point;
      point.centre.setZero();
      point.normal.setZero();
      point.disc = true;
      point.radius_m = 0.1;
      problem.map_points.push_back(point);
    }
    place(separation_m(d1, d2));
  }
  /// Sets the apparent size at a distance, within a relative tolerance (1: exact).
  static void see_at(BearingObservation& seen, double distance_m, double tolerance) {
    seen.min_radius_rad = 0.1 / (distance_m * tolerance);
    seen.max_radius_rad = 0.1 / (distance_m / tolerance);
  }
  /// Law of cosines.
  double separation_m(double a, double b) const {
    return std::sqrt(a * a + b * b - 2 * a * b * std::cos(angle_rad));
  }
  void place(double length_m) {
    problem.map_points[0].centre = {1, 2, 3};
    problem.map_points[1].centre = Eigen::Vector3d(1, 2, 3) + Eigen::Vector3d(0, length_m, 0);
  }
  bool permits() const { return SizeConsistency(problem).permits({0, 0}, {1, 1}); }
};

TEST(SizeConsistency, PermitsTheErrorsOfMapAndBearings) {
  TwoDiscs discs;
  EXPECT_TRUE(discs.permits());
  const double length = discs.separation_m(3, 2);
  // Four sigmas of 0.005 rad at 3 m and at 2 m, and 2 % of the length of the map.
  const double bearings = 4 * 0.005 * (3 + 2);
  for (const double side : {-1, 1}) {
    discs.place((length + side * 0.95 * bearings) / (1 - side * 0.95 * 0.02));
    EXPECT_TRUE(discs.permits()) << side;
    discs.place((length + side * 1.05 * bearings) / (1 - side * 1.05 * 0.02));
    EXPECT_FALSE(discs.permits()) << side;
  }
}

TEST(SizeConsistency, PermitsTheDistanceOfTheOriginsOfTheRays) {
  TwoDiscs discs;
  const double length = discs.separation_m(3, 2);
  discs.problem.observations[1].origin = {0.3, 0, 0.4};
  for (const double side : {-1, 1}) {
    discs.place(length + side * 0.5);
    EXPECT_TRUE(discs.permits()) << side;
    discs.place(length + side * 0.75);
    EXPECT_FALSE(discs.permits()) << side;
  }
}

TEST(SizeConsistency, PermitsAllDistancesWithinTheTolerance) {
  TwoDiscs discs;
  for (BearingObservation& seen : discs.problem.observations) seen.sigma_rad = 0;
  TwoDiscs::see_at(discs.problem.observations[0], 3, 1.2);
  TwoDiscs::see_at(discs.problem.observations[1], 2, 1.5);
  double smallest = 100, largest = 0;
  for (int i = 0; i <= 200; ++i)
    for (int k = 0; k <= 200; ++k) {
      const double a = 2.5 + (3.6 - 2.5) * i / 200, b = 2 / 1.5 + (3 - 2 / 1.5) * k / 200;
      smallest = std::min(smallest, discs.separation_m(a, b));
      largest = std::max(largest, discs.separation_m(a, b));
    }
  discs.place(smallest / 1.01);
  EXPECT_TRUE(discs.permits());
  discs.place(smallest / 1.03);
  EXPECT_FALSE(discs.permits());
  discs.place(largest / 0.99);
  EXPECT_TRUE(discs.permits());
  discs.place(largest / 0.97);
  EXPECT_FALSE(discs.permits());
}

TEST(SizeConsistency, NeedsTheSizesOfDiscs) {
  TwoDiscs discs;
  discs.place(50);
  EXPECT_FALSE(discs.permits());
  discs.problem.observations[0].min_radius_rad = 0;  // may be far away
  EXPECT_TRUE(discs.permits());
  discs.place(0.05);  // but not near the other one
  EXPECT_FALSE(discs.permits());
  discs.problem.map_points[0].disc = false;
  discs.place(1);  // the second one, at 2 m, has a neighbour at 1 m on some ray
  EXPECT_TRUE(discs.permits());
  // A point on a ray that passes the second disc, at 2 m, at 0.96 m is not nearer.
  discs.place(0.8);
  EXPECT_FALSE(discs.permits());
  for (BearingObservation& seen : discs.problem.observations) seen.max_radius_rad = 0;
  EXPECT_TRUE(discs.permits());
}

}  // namespace
}  // namespace occ
