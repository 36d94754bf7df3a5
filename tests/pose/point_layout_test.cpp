// SPDX-License-Identifier: Apache-2.0
// Layout of points, bases of bearings and frames of a problem.
#include "libocc/pose/internal/point_layout.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "libocc/core/math.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/frames.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::pose;
namespace {

Eigen::Matrix3Xd random_columns(Random& random, int count) {
  Eigen::Matrix3Xd points(3, count);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = random.normal();
  return points;
}

double doubled_area(const Eigen::Matrix3Xd& points, const Triple& triple) {
  const Eigen::Vector3d a = points.col(triple[1]) - points.col(triple[0]);
  return a.cross(Eigen::Vector3d(points.col(triple[2]) - points.col(triple[0]))).norm();
}

TEST(PointLayout, HasThePrincipalAxesAndExtents) {
  Random random(1, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Matrix3d turn = so3_exp(test::random_vector(random));
    const Eigen::Vector3d centre = test::random_vector(random);
    // A box: the sums of squares along its axes are known.
    Eigen::Matrix3Xd box(3, 8);
    for (int i = 0; i < 8; ++i)
      box.col(i) = Eigen::Vector3d(i & 1 ? 3 : -3, i & 2 ? 2 : -2, i & 4 ? 0.5 : -0.5);
    const PointLayout layout = point_layout((turn * box).colwise() + centre);
    EXPECT_LT((layout.centroid - centre).norm(), 1e-12);
    EXPECT_LT((layout.extent / std::sqrt(8) - Eigen::Vector3d(3, 2, 0.5)).norm(), 1e-12);
    EXPECT_NEAR(layout.axes.determinant(), 1, 1e-12);
    EXPECT_LT((layout.axes * layout.axes.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(std::abs(layout.axes.col(k).dot(turn.col(k))), 1, 1e-12) << k;
    EXPECT_TRUE(spans_plane(layout));
    EXPECT_TRUE(spans_space(layout));
  }
}

TEST(PointLayout, RecognisesLinesAndPlanesAtAnyAngle) {
  Random random(2, 0);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3d turn = so3_exp(test::random_vector(random));
    Eigen::Matrix3Xd points = random_columns(random, 7);
    points.row(2) *= 1e-8;
    EXPECT_TRUE(spans_space(point_layout(turn * points)));
    points.row(2).setZero();
    EXPECT_FALSE(spans_space(point_layout(turn * points)));
    EXPECT_TRUE(spans_plane(point_layout(turn * points)));
    EXPECT_FALSE(on_a_line(turn * points, spread_triple(turn * points), 1));
    points.row(1) *= 1e-8;
    EXPECT_TRUE(spans_plane(point_layout(turn * points)));
    EXPECT_FALSE(on_a_line(turn * points, spread_triple(turn * points), 1));
    // Far from the origin, the same thickness is lost in the rounding of the coordinates.
    EXPECT_TRUE(on_a_line(turn * points, spread_triple(turn * points), 1e9));
    points.row(1).setZero();
    EXPECT_FALSE(spans_plane(point_layout(turn * points)));
    EXPECT_TRUE(on_a_line(turn * points, spread_triple(turn * points), 1));
    EXPECT_TRUE(on_a_line(1e6 * turn * points, spread_triple(turn * points), 1));
  }
  EXPECT_EQ(point_layout(random_columns(random, 2)).extent[2], 0);
}

TEST(PointLayout, HeightOverTheBestLine) {
  Random random(3, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Matrix3Xd points = random_columns(random, 6);
    const double height = height_over_line(points);
    const Eigen::Vector3d middle = points.rowwise().mean();
    const auto over = [&](const Eigen::Vector3d& along) {
      double sum = 0;
      for (int i = 0; i < 6; ++i)
        sum += along.cross(Eigen::Vector3d(points.col(i) - middle)).squaredNorm();
      return std::sqrt(sum);
    };
    // No direction has smaller distances, and the best axis has these.
    EXPECT_NEAR(over(point_layout(points).axes.col(0)), height, 1e-9);
    for (int i = 0; i < 50; ++i)
      EXPECT_GE(over(test::random_vector(random).normalized()), height - 1e-9);
  }
  Eigen::Matrix3Xd line(3, 4);
  for (int i = 0; i < 4; ++i) line.col(i) = Eigen::Vector3d(1, 2, 3) + i * Eigen::Vector3d(1, 1, 0);
  EXPECT_LT(height_over_line(line), 1e-6);
}

TEST(SpreadTriple, HasALargeAreaAndTheEndsOfTheLongestExtent) {
  Random random(4, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const int count = 3 + random.below(8);
    const Eigen::Matrix3Xd points = random_columns(random, count);
    const Triple chosen = spread_triple(points);
    EXPECT_EQ((std::set<int>(chosen.begin(), chosen.end()).size()), 3u);
    double largest = 0, farthest = 0, highest = 0;
    const Eigen::Vector3d from = points.col(chosen[0]);
    for (int i = 0; i < count; ++i) {
      farthest = std::max(farthest, (points.col(i) - from).norm());
      highest = std::max(highest, doubled_area(points, {chosen[0], chosen[1], i}));
      for (int j = 0; j < i; ++j)
        for (int k = 0; k < j; ++k) largest = std::max(largest, doubled_area(points, {i, j, k}));
    }
    EXPECT_GE(doubled_area(points, chosen), 0.35 * largest);
    EXPECT_EQ((points.col(chosen[1]) - from).norm(), farthest);
    EXPECT_NEAR(doubled_area(points, chosen), highest, 1e-12);
    // The first point is the farthest from the middle.
    const Eigen::Vector3d middle = points.rowwise().mean();
    EXPECT_NEAR((from - middle).norm(), (points.colwise() - middle).colwise().norm().maxCoeff(),
                1e-12);
  }
}

TEST(TriplesToTry, AreAllOfFourPointsTheLargestFirst) {
  Random random(5, 0);
  EXPECT_EQ(triples_to_try(random_columns(random, 3), random_columns(random, 3)),
            (std::vector<Triple>{{0, 1, 2}}));
  std::set<int> left_out;
  for (int trial = 0; trial < 40; ++trial) {
    const Eigen::Matrix3Xd points = random_columns(random, 4);
    const std::vector<Triple> triples = triples_to_try(points, random_columns(random, 4));
    ASSERT_EQ(triples.size(), 4u);
    std::set<std::set<int>> distinct;
    for (const Triple& triple : triples) {
      distinct.insert(std::set<int>(triple.begin(), triple.end()));
      EXPECT_LE(doubled_area(points, triple), doubled_area(points, triples[0]));
    }
    EXPECT_EQ(distinct.size(), 4u);
    left_out.insert(6 - triples[0][0] - triples[0][1] - triples[0][2]);
  }
  EXPECT_EQ(left_out.size(), 4u);
}

TEST(TriplesToTry, AreThoseOfPointsOfBearingsAndOfTheOthers) {
  Random random(6, 0);
  for (const int count : {5, 6, 9}) {
    const Eigen::Matrix3Xd points = random_columns(random, count);
    const Eigen::Matrix3Xd bearings = random_columns(random, count).colwise().normalized();
    const std::vector<Triple> triples = triples_to_try(points, bearings);
    ASSERT_EQ(triples.size(), count == 5 ? 2u : 3u);
    EXPECT_EQ(triples[0], spread_triple(points));
    EXPECT_EQ(triples[1], spread_triple(bearings));
    if (count == 5) continue;
    double farthest = 0;
    std::vector<int> rest;
    for (int i = 0; i < count; ++i)
      if (std::find(triples[0].begin(), triples[0].end(), i) == triples[0].end()) rest.push_back(i);
    for (const int i : rest)
      farthest = std::max(farthest, (points.col(i) - points.col(triples[2][0])).norm());
    for (const int i : triples[2])
      EXPECT_TRUE(std::find(rest.begin(), rest.end(), i) != rest.end());
    EXPECT_EQ((points.col(triples[2][1]) - points.col(triples[2][0])).norm(), farthest);
  }
}

TEST(TangentBasis, IsOrthonormalToTheBearing) {
  Random random(7, 0);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d bearing = test::random_vector(random).normalized();
    Eigen::Matrix3d all;
    all << tangent_basis(bearing), bearing.transpose();
    EXPECT_LT((all * all.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  }
}

TEST(SmallestRightVector, IsTheLastOneOfTheSingularValues) {
  Random random(8, 0);
  for (const int rows : {8, 9, 20})
    for (int trial = 0; trial < 10; ++trial) {
      Eigen::MatrixXd a(rows, 9);
      for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = random.normal();
      a.col(3) *= 1e-3;  // columns are exchanged in the decomposition
      const Eigen::VectorXd found = smallest_right_vector(a);
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeFullV);
      EXPECT_NEAR(found.norm(), 1, 1e-12);
      EXPECT_NEAR(std::abs(found.dot(svd.matrixV().col(8))), 1, 1e-9) << rows;
    }
}

TEST(SmallestRightVector, IsExactForCloseSingularValuesAndNullSpaces) {
  Random random(9, 0);
  for (int trial = 0; trial < 10; ++trial) {
    Eigen::MatrixXd full(6, 6);
    for (Eigen::Index i = 0; i < full.size(); ++i) full.data()[i] = random.normal();
    const Eigen::MatrixXd u =
        Eigen::JacobiSVD<Eigen::MatrixXd>(full, Eigen::ComputeFullU).matrixU();
    const Eigen::MatrixXd v =
        Eigen::JacobiSVD<Eigen::MatrixXd>(full, Eigen::ComputeFullV).matrixV();
    Eigen::VectorXd values(6);
    values << 5, 4, 3, 2, 1, 0.75;  // an angle shrinks to (0.75)^2 in each step
    const Eigen::VectorXd close = smallest_right_vector(u * values.asDiagonal() * v.transpose());
    EXPECT_LT(1 - std::abs(close.dot(v.col(5))), 1e-12);
    values[5] = 0;
    const Eigen::VectorXd null = smallest_right_vector(u * values.asDiagonal() * v.transpose());
    EXPECT_LT(1 - std::abs(null.dot(v.col(5))), 1e-12);
    values[4] = 0;  // any vector of the null space
    const Eigen::MatrixXd a = u * values.asDiagonal() * v.transpose();
    const Eigen::VectorXd two = smallest_right_vector(a);
    ASSERT_TRUE(two.allFinite());
    EXPECT_LT((a * two).norm(), 1e-12);
  }
}

PoseProblem problem_of(const Eigen::Matrix3Xd& bearings) {
  PoseProblem problem;
  problem.bearings = bearings;
  problem.points = bearings;
  return problem;
}

TEST(PinholeFrame, ShowsTheBearingsAboutTheirMean) {
  Random random(10, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Matrix3d turn = so3_exp(test::random_vector(random));
    Eigen::Matrix3Xd bearings = random_columns(random, 6);
    bearings.row(2) = bearings.row(2).cwiseAbs().array() + 0.3;
    bearings.colwise().normalize();
    bearings = turn * bearings;
    const auto frame = pinhole_frame(problem_of(bearings));
    ASSERT_TRUE(frame);
    const Eigen::Matrix3d& r = frame->turned_from_cam;
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_NEAR(r.determinant(), 1, 1e-13);
    EXPECT_LT((r * bearings.rowwise().mean().normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d back = r.transpose() * frame->image.col(i).homogeneous().normalized();
      EXPECT_LT((back - bearings.col(i)).norm(), 1e-12);
    }
    const Rigid3 turned = test::random_pose(random);
    const Rigid3 pose = frame->cam_from_world(turned);
    const Eigen::Vector3d point = test::random_vector(random);
    EXPECT_LT((r * (pose * point) - turned * point).norm(), 1e-12);
  }
}

TEST(PinholeFrame, NeedsBearingsInFrontOfTheirMean) {
  const auto spread = [](double angle) {
    Eigen::Matrix3Xd bearings(3, 4);
    for (int i = 0; i < 4; ++i)
      bearings.col(i) << std::sin(angle) * std::cos(pi / 2 * i), std::cos(angle),
          std::sin(angle) * std::sin(pi / 2 * i);
    return problem_of(bearings);
  };
  EXPECT_TRUE(pinhole_frame(spread(1.5)));
  EXPECT_TRUE(pinhole_frame(spread(89.93 * pi / 180)));
  EXPECT_FALSE(pinhole_frame(spread(89.95 * pi / 180)));
  PoseProblem problem = spread(1);
  problem.bearings(0, 0) = std::nan("");
  EXPECT_FALSE(pinhole_frame(problem));
}

TEST(UnitFrame, RestoresWhatItNormalises) {
  Random random(11, 0);
  Eigen::Matrix3Xd points = 5 * random_columns(random, 7);
  points.colwise() += Eigen::Vector3d(30, -20, 10);
  Eigen::Matrix3Xd scaled = points;
  const UnitFrame frame = normalise(scaled);
  EXPECT_LT(scaled.rowwise().mean().norm(), 1e-12);
  EXPECT_NEAR(scaled.squaredNorm() / 7, 1, 1e-12);
  EXPECT_NEAR(frame.offset() * frame.size_m, points.rowwise().mean().norm(), 1e-9);
  const Rigid3 pose = test::random_pose(random);
  const Rigid3 unit = frame.normalised(pose);
  for (int i = 0; i < 7; ++i) {
    const Eigen::Vector3d expected = pose * Eigen::Vector3d(points.col(i)) / frame.size_m;
    EXPECT_LT((unit * Eigen::Vector3d(scaled.col(i)) - expected).norm(), 1e-9);
  }
  EXPECT_LT((frame.restored(unit).translation - pose.translation).norm(), 1e-9);
}

}  // namespace
}  // namespace occ
