// SPDX-License-Identifier: Apache-2.0
// P3P returns every pose that fits and no other, for random problems and the hard cases of real
// rooms.
#include "libocc/pose/solvers/p3p.hpp"

#include <limits>
#include <numeric>

#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Problem {
  Matrix3d bearings;
  Matrix3d points;
  Rigid3 truth;
};

Problem make_problem(const Matrix3d& points, const Rigid3& truth) {
  Problem p{Matrix3d::Zero(), points, truth};
  for (int i = 0; i < 3; ++i) p.bearings.col(i) = (truth * Vector3d(points.col(i))).normalized();
  return p;
}

Matrix3d random_points(Random& random) {
  Matrix3d points;
  for (int i = 0; i < 3; ++i) points.col(i) = test::random_vector(random);
  return points;
}

// All three points at least 0.1 in front of the camera.
Problem random_problem(Random& random) {
  for (;;) {
    const Matrix3d points = random_points(random);
    const Rigid3 pose{so3_exp(3 * test::random_vector(random)),
                      {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 6)}};
    const Matrix3d in_cam = (pose.rotation * points).colwise() + pose.translation;
    if (in_cam.row(2).minCoeff() > 0.1) return make_problem(points, pose);
  }
}

// Tilted by up to tilt_rad about a random horizontal axis.
Rigid3 looking_up(Random& random, const Vector3d& position, double tilt_rad) {
  const double azimuth = random.uniform(-3, 3);
  const Matrix3d rotation =
      so3_exp(random.uniform(0, tilt_rad) * Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
      so3_exp(Vector3d(0, 0, random.uniform(-3, 3)));
  return {rotation, -(rotation * position)};
}

Matrix3d square_corners() {
  Matrix3d points;
  points << 1, 3, 1, 1, 1, 3, 3, 3, 3;
  return points;
}

Matrix3d equilateral() {
  Matrix3d points;
  for (int i = 0; i < 3; ++i) points.col(i) << std::cos(i * 2.0944), std::sin(i * 2.0944), 3;
  points.col(1) << -0.5, std::sqrt(0.75), 3;
  points.col(2) << -0.5, -std::sqrt(0.75), 3;
  return points;
}

// Rotation and position error, the latter over the distance of the points.
double pose_error(const Rigid3& pose, const Problem& p) {
  const Vector3d middle = p.points.rowwise().mean();
  const double distance = (p.truth * middle).norm() + (p.points.colwise() - middle).norm();
  const double moved = (pose.origin_in_source() - p.truth.origin_in_source()).norm() / distance;
  return std::max((pose.rotation - p.truth.rotation).norm(), moved);
}

double smallest_error(const std::vector<Rigid3>& poses, const Problem& p) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Rigid3& pose : poses) smallest = std::min(smallest, pose_error(pose, p));
  return smallest;
}

// Expects that every pose is a rotation and observes the points along the bearings.
void expect_all_fit(const std::vector<Rigid3>& poses, const Problem& p, double tolerance = 1e-9) {
  EXPECT_LE(poses.size(), 4u);
  for (const Rigid3& pose : poses) {
    ASSERT_TRUE(pose.rotation.allFinite() && pose.translation.allFinite());
    ASSERT_LT((pose.rotation * pose.rotation.transpose() - Matrix3d::Identity()).norm(), 1e-9);
    ASSERT_GT(pose.rotation.determinant(), 0);
    for (int i = 0; i < 3; ++i) {
      const Vector3d seen = (pose * Vector3d(p.points.col(i))).normalized();
      ASSERT_LT((seen - p.bearings.col(i)).norm(), tolerance);
    }
  }
}

// Share of problems whose true pose is among the results within `tolerance`.
template <typename Make>
double success_rate(int count, const Make& make, double tolerance = 1e-6) {
  Random random(11);
  int found = 0;
  for (int i = 0; i < count; ++i) {
    const Problem p = make(random);
    const std::vector<Rigid3> poses = p3p(p.bearings, p.points);
    expect_all_fit(poses, p);
    found += smallest_error(poses, p) < tolerance;
  }
  return static_cast<double>(found) / count;
}

TEST(P3p, RandomProblemsAreExact) { EXPECT_EQ(1, success_rate(20000, random_problem)); }

// Error of a pose's bearings, divided by the ratio of the points' distances.
double backward_error(const Rigid3& pose, const Problem& p) {
  const Matrix3d seen = (pose.rotation * p.points).colwise() + pose.translation;
  const Eigen::RowVector3d distance = seen.colwise().norm();
  const double worst = (seen.colwise().normalized() - p.bearings).colwise().norm().maxCoeff();
  return worst * distance.minCoeff() / distance.maxCoeff();
}

TEST(SlowP3p, AMillionRandomProblemsAreBackwardStable) {
  Random random(11);
  int unstable = 0, lost = 0;
  for (int i = 0; i < 1000000; ++i) {
    const Problem p = random_problem(random);
    const std::vector<Rigid3> poses = p3p(p.bearings, p.points);
    lost += !(smallest_error(poses, p) < 1e-6);
    for (const Rigid3& pose : poses) unstable += !(backward_error(pose, p) < 2e-14);
  }
  EXPECT_LE(unstable, 1);
  EXPECT_EQ(lost, 0);
}

TEST(P3p, ResultsAreDistinct) {
  Random random(6);
  for (int i = 0; i < 2000; ++i) {
    const Problem p = random_problem(random);
    const std::vector<Rigid3> poses = p3p(p.bearings, p.points);
    for (std::size_t a = 0; a < poses.size(); ++a)
      for (std::size_t b = a + 1; b < poses.size(); ++b)
        EXPECT_GT(difference(poses[a], poses[b]).norm(), 1e-8);
  }
}

// Expects equal poses, and as many, in a moved and rotated world.
TEST(P3p, DoesNotDependOnTheWorldFrame) {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const Problem p = random_problem(random);
    const Rigid3 world_from_other = test::random_pose(random);
    const Rigid3 other_from_world = world_from_other.inverse();
    const Matrix3d moved =
        (other_from_world.rotation * p.points).colwise() + other_from_world.translation;
    const std::vector<Rigid3> here = p3p(p.bearings, p.points), there = p3p(p.bearings, moved);
    ASSERT_EQ(here.size(), there.size());
    for (const Rigid3& pose : there) {
      const Problem found{p.bearings, p.points, pose * other_from_world};
      EXPECT_LT(smallest_error(here, found), 1e-6);
    }
  }
}

TEST(P3p, DoesNotDependOnTheOrderOfPoints) {
  Random random(8);
  const int orders[5][3] = {{0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int i = 0; i < 1000; ++i) {
    const Problem p = random_problem(random);
    const std::vector<Rigid3> first = p3p(p.bearings, p.points);
    for (const auto& order : orders) {
      Matrix3d bearings, points;
      for (int k = 0; k < 3; ++k) {
        bearings.col(k) = p.bearings.col(order[k]);
        points.col(k) = p.points.col(order[k]);
      }
      const std::vector<Rigid3> again = p3p(bearings, points);
      ASSERT_EQ(first.size(), again.size());
      for (const Rigid3& pose : again)
        EXPECT_LT(smallest_error(first, {p.bearings, p.points, pose}), 1e-6);
    }
  }
}

TEST(P3p, FarFromTheWorldsOrigin) {
  const Vector3d far(1e6, -1e6, 2e5);
  Random random(9);
  for (int i = 0; i < 2000; ++i) {
    Problem p = make_problem(square_corners(), looking_up(random, {2.2, 1.7, 0.4}, 0.7));
    p.points.colwise() += far;
    p.truth.translation -= p.truth.rotation * far;
    EXPECT_LT(smallest_error(p3p(p.bearings, p.points), p), 1e-6);
  }
}

TEST(P3p, AnyUnitOfLength) {
  for (const double unit : {1e-6, 1e-3, 1e3, 1e6}) {
    const double rate = success_rate(2000, [&](Random& random) {
      Problem p = random_problem(random);
      p.points *= unit;
      p.truth.translation *= unit;
      return p;
    });
    EXPECT_EQ(rate, 1) << unit;
  }
}

TEST(P3p, NeverPutsAPointBehindTheCamera) {
  Random random(10);
  int with_behind = 0;
  for (int i = 0; i < 5000; ++i) {
    // One point is behind the camera: only other poses may be returned.
    const Rigid3 pose{so3_exp(3 * test::random_vector(random)), test::random_vector(random)};
    Problem p = make_problem(random_points(random), pose);
    const int flipped = random.below(3);
    p.bearings.col(flipped) *= -1;
    const std::vector<Rigid3> poses = p3p(p.bearings, p.points);
    expect_all_fit(poses, p);
    EXPECT_GT(smallest_error(poses, p), 1e-6);
    with_behind += !poses.empty();
  }
  EXPECT_GT(with_behind, 0);
}

TEST(P3pHardCases, CeilingLamps) {
  EXPECT_EQ(1, success_rate(3000, [](Random& random) {
              const Vector3d position(random.uniform(0.5, 3.5), random.uniform(0.5, 3.5),
                                      random.uniform(0, 1.5));
              return make_problem(square_corners(), looking_up(random, position, 0.7));
            }));
}

TEST(P3pHardCases, ExactlyUnderALamp) {
  EXPECT_EQ(1, success_rate(3000, [](Random& random) {
              const Vector3d position(1, 1, random.uniform(0, 1.5));
              return make_problem(square_corners(), looking_up(random, position, 0.7));
            }));
  EXPECT_EQ(1, success_rate(3000, [](Random& random) {
              const Vector3d position(1, 1, random.uniform(0, 1.5));
              return make_problem(square_corners(), {Matrix3d::Identity(), -position});
            }));
}

TEST(P3pHardCases, OnTheDangerCylinder) {
  for (const double off : {0.0, 1e-6, 1e-3}) {
    const auto make = [&](Random& random) {
      const double azimuth = random.uniform(-3, 3), radius = 1 + off;
      const Vector3d position(radius * std::cos(azimuth), radius * std::sin(azimuth),
                              random.uniform(0, 1.5));
      return make_problem(equilateral(), looking_up(random, position, 0.7));
    };
    // A double root is determined to the square root of the rounding error only.
    EXPECT_GE(success_rate(3000, make), 0.99) << off;
    EXPECT_EQ(1, success_rate(3000, make, 1e-4)) << off;
  }
}

// Rounding moves double roots, and thin triangles amplify it.
TEST(P3pHardCases, DoubleRootsOfRandomTriangles) {
  Random random(18);
  int lost = 0;
  for (int i = 0; i < 300000; ++i) {
    Matrix3d points;
    for (int k = 0; k < 3; ++k) {
      const double corner = random.uniform(0, 6.283);
      points.col(k) << std::cos(corner), std::sin(corner), 3;
    }
    const double azimuth = random.uniform(-3.1416, 3.1416);
    const Vector3d position(std::cos(azimuth), std::sin(azimuth), random.uniform(-5, 2.9));
    const Problem p = make_problem(points, looking_up(random, position, 0.7));
    lost += !(smallest_error(p3p(p.bearings, p.points), p) < 0.01);
  }
  EXPECT_LE(lost, 2);
}

// On the axis of three equal lamps there are four poses: three differ by rotations of 120 degrees.
TEST(P3pHardCases, OnTheAxisOfAnEquilateralTriangle) {
  Random random(12);
  for (int i = 0; i < 1000; ++i) {
    const Problem p =
        make_problem(equilateral(), looking_up(random, {0, 0, random.uniform(0, 1.5)}, 0.7));
    const std::vector<Rigid3> poses = p3p(p.bearings, p.points);
    expect_all_fit(poses, p);
    EXPECT_EQ(poses.size(), 4u);
    EXPECT_LT(smallest_error(poses, p), 1e-6);
  }
}

TEST(P3pHardCases, InTheSymmetryPlaneOfAnIsoscelesTriangle) {
  Matrix3d points;
  points << 1, -1, 0, 0, 0, 1.7, 3, 3, 3;
  EXPECT_EQ(1, success_rate(3000, [&](Random& random) {
              const Vector3d position(0, random.uniform(-1, 1), random.uniform(0, 1.5));
              return make_problem(points, looking_up(random, position, 0.7));
            }));
}

TEST(P3pHardCases, SmallAndFarAway) {
  for (const double distance : {10.0, 100.0, 1000.0})
    EXPECT_EQ(1, success_rate(2000,
                              [&](Random& random) {
                                return make_problem(
                                    0.1 * random_points(random),
                                    {so3_exp(3 * test::random_vector(random)), {0, 0, distance}});
                              }))
        << distance;
}

TEST(P3pHardCases, HalfTurnsAndIdentity) {
  EXPECT_EQ(1, success_rate(2000, [](Random& random) {
              Matrix3d points = random_points(random);
              points.row(2).array() += 8;
              return make_problem(points, Rigid3{});
            }));
  EXPECT_EQ(1, success_rate(2000, [](Random& random) {
              const Vector3d turn = 3.14159265358979 * Vector3d::Unit(random.below(3));
              return make_problem(random_points(random), {so3_exp(turn), {0, 0, 8}});
            }));
}

TEST(P3pHardCases, NearlyCollinear) {
  const auto rate = [](double height) {
    return success_rate(2000, [&](Random& random) {
      Matrix3d points;
      points << -1, 0, 1, 0, height, 0, 0, 0, 0;
      return make_problem(points, {so3_exp(3 * test::random_vector(random)), {0.3, -0.2, 4}});
    });
  };
  EXPECT_EQ(rate(1e-2), 1);
  EXPECT_GE(rate(1e-4), 0.95);
}

TEST(P3p, ReturnsNothingForCollinearOrCoincidentPoints) {
  Random random(13);
  for (int i = 0; i < 500; ++i) {
    const Rigid3 pose{so3_exp(test::random_vector(random)), {0, 0, 9}};
    const Vector3d start = test::random_vector(random), step = test::random_vector(random);
    Matrix3d line;
    line << start, start + step, start + random.uniform(-2, 2) * step;
    EXPECT_TRUE(p3p(make_problem(line, pose).bearings, line).empty());
    Matrix3d pair;
    pair << start, step, step;
    EXPECT_TRUE(p3p(make_problem(pair, pose).bearings, pair).empty());
    const Matrix3d one = start.replicate<1, 3>();
    EXPECT_TRUE(p3p(make_problem(one, pose).bearings, one).empty());
  }
}

TEST(P3p, ReturnsNothingForBearingsThatFitNoTriangle) {
  // Two bearings coincide but their points do not, and the third distance excludes such a view.
  Matrix3d bearings;
  bearings << 0, 0, 0.1, 0, 0, 0, 1, 1, 1;
  bearings.colwise().normalize();
  EXPECT_TRUE(p3p(bearings, equilateral()).empty());
  // Opposite directions: the camera would be on the segment. The third point is seen nearly along
  // it, closer than the triangle allows.
  Matrix3d points;
  points << -1, 1, 0, 0, 0, 5, 0, 0, 0;
  bearings << -1, 1, 0.9999, 0, 0, std::sqrt(1 - 0.9999 * 0.9999), 0, 0, 0;
  EXPECT_TRUE(p3p(bearings, points).empty());
}

TEST(P3p, RejectsValuesThatAreNotFiniteOrNotUnit) {
  Random random(14);
  const Problem p = random_problem(random);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Matrix3d bearings = p.bearings, points = p.points;
    bearings(1, 2) = bad;
    EXPECT_THROW(p3p(bearings, p.points), std::invalid_argument);
    points(0, 1) = bad;
    EXPECT_THROW(p3p(p.bearings, points), std::invalid_argument);
  }
  EXPECT_THROW(p3p(1.00001 * p.bearings, p.points), std::invalid_argument);
  EXPECT_NO_THROW(p3p((1 + 5e-7) * p.bearings, p.points));
  EXPECT_THROW(p3p(Matrix3d::Zero(), p.points), std::invalid_argument);
}

TEST(P3pWithin, FindsTheExactPosesToo) {
  Random random(15);
  int found = 0;
  constexpr int count = 2000;
  for (int i = 0; i < count; ++i) {
    const Problem p = random_problem(random);
    std::array<Rigid3, 4> poses;
    const int n = p3p_within(p.bearings, p.points, 1e-3, poses);
    found += smallest_error({poses.begin(), poses.begin() + n}, p) < 1e-4;
  }
  EXPECT_GE(found, count * 0.999);
}

TEST(P3pWithin, PosesAreRotationsHoweverThinTheTriangle) {
  constexpr double noise_rad = 1e-3;
  Random random(17);
  for (const double height : {1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6}) {
    int found = 0;
    for (int i = 0; i < 500; ++i) {
      Matrix3d points;
      const double between = random.uniform(-0.8, 0.8);
      points << -1, between, 1, 0, height, 0, 0, 0, 0;
      Problem p = make_problem(points, {so3_exp(test::random_vector(random)), {0.3, -0.2, 4}});
      for (int k = 0; k < 3; ++k) p.bearings.col(k) += noise_rad * test::random_vector(random);
      p.bearings.colwise().normalize();
      std::array<Rigid3, 4> poses;
      const int n = p3p_within(p.bearings, p.points, 0.3, poses);
      found += n;
      for (int k = 0; k < n; ++k) {
        const Matrix3d& r = poses[k].rotation;
        EXPECT_LT((r * r.transpose() - Matrix3d::Identity()).norm(), 1e-9) << height;
      }
    }
    EXPECT_GT(found, 500) << height;
  }
}

// On the danger cylinder noise makes the double root complex in half of the cases. Its real part is
// still a pose near the truth.
TEST(P3pWithin, KeepsDoubleRootsUnderNoise) {
  constexpr double noise_rad = 1e-3;
  constexpr int count = 2000;
  Random random(16);
  int exact = 0, within = 0;
  for (int i = 0; i < count; ++i) {
    const double azimuth = random.uniform(-3, 3);
    const Vector3d position(std::cos(azimuth), std::sin(azimuth), random.uniform(0, 1.5));
    Problem p = make_problem(equilateral(), looking_up(random, position, 0.5));
    for (int k = 0; k < 3; ++k) p.bearings.col(k) += noise_rad * test::random_vector(random);
    p.bearings.colwise().normalize();
    std::array<Rigid3, 4> poses;
    const int n = p3p_within(p.bearings, p.points, 8 * noise_rad, poses);
    within += smallest_error({poses.begin(), poses.begin() + n}, p) < 0.3;
    exact += smallest_error(p3p(p.bearings, p.points), p) < 0.3;
  }
  EXPECT_GE(within, count * 0.95);
  EXPECT_LT(exact, count * 0.9);
}

}  // namespace
}  // namespace occ
