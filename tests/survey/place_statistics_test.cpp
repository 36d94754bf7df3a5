// SPDX-License-Identifier: Apache-2.0
// Tests and estimates of places against drawn errors.
#include "libocc/survey/internal/place_statistics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::test {
namespace {

using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using internal::survey::add_free_similarity;
using internal::survey::PlaceEstimate;
using internal::survey::PlaceItem;
using internal::survey::PlacePair;
using internal::survey::PlaceStatistics;
using internal::survey::without_similarity;

constexpr int count = 8;
using Kind = PlaceItem::Kind;

Eigen::VectorXd normals(Eigen::Index size, Random& random) {
  Eigen::VectorXd values(size);
  for (Eigen::Index i = 0; i < size; ++i) values[i] = random.normal();
  return values;
}

MatrixXd random_covariance(double sigma, Random& random) {
  MatrixXd root(3 * count, 3 * count);
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal();
  return square(sigma) *
         (root * root.transpose() / (3.0 * count) + 0.2 * MatrixXd::Identity(3 * count, 3 * count));
}

Matrix3Xd with_errors(const Matrix3Xd& at, const MatrixXd& covariance, Random& random) {
  const Eigen::VectorXd errors = MatrixXd(covariance.llt().matrixL()) * normals(3 * count, random);
  return at + Eigen::Map<const Matrix3Xd>(errors.data(), 3, count);
}

struct Drawn {
  Matrix3Xd truth;
  PlaceStatistics statistics;
};

/// Lamp 6 was moved by 0.1 m, lamp 7 is not among the unchanged ones.
Drawn drawn(Random& random) {
  Matrix3Xd truth(3, count);
  for (int i = 0; i < count; ++i)
    truth.col(i) = Vector3d(random.uniform(0, 5), random.uniform(0, 4), random.uniform(2.5, 2.8));
  const MatrixXd s = random_covariance(0.003, random), w = random_covariance(0.002, random);
  const Matrix3Xd map = with_errors(truth, s, random);
  Matrix3Xd now = truth;
  now.col(6).x() += 0.1;
  Matrix3Xd places = with_errors(now, w, random);
  const Vector3d turn = 0.003 * Vector3d(random.normal(), random.normal(), random.normal());
  for (int i = 0; i < count; ++i)
    places.col(i) = 1.002 * (so3_exp(turn) * places.col(i)) + Vector3d(0.01, -0.02, 0.005);
  MatrixXd free = w;
  add_free_similarity(places, free);
  PlaceStatistics statistics(map, s, places, free);
  std::vector<PlacePair> pairs;
  for (int i = 0; i < 6; ++i) pairs.push_back({i, i});
  EXPECT_TRUE(statistics.set_unchanged(pairs));
  return {now, statistics};
}

TEST(PlaceStatistics, HaveAChiSquareDistribution) {
  double inside = 0, outside = 0, moved = 0;
  constexpr int draws = 1500;
  Random random(3);
  for (int i = 0; i < draws; ++i) {
    const Drawn one = drawn(random);
    inside += one.statistics.test({2, 2}).statistic / draws;
    outside += one.statistics.test({7, 7}).statistic / draws;
    const auto test = one.statistics.test({6, 6});
    const Vector3d error = test.moved - Vector3d(0.1, 0, 0);
    moved += error.dot(test.covariance.inverse() * error) / draws;
  }
  constexpr double four_sigmas = 4 * 2.45 / 38.7;  // of the mean of 1500, variance 6
  EXPECT_NEAR(inside, 3, four_sigmas);
  EXPECT_NEAR(outside, 3, four_sigmas);
  EXPECT_NEAR(moved, 3, four_sigmas);
}

TEST(PlaceStatistics, EstimateWithTheirCovariance) {
  const std::vector<PlaceItem> items = {{Kind::fused, 0},  {Kind::fused, 3}, {Kind::placed, 6},
                                        {Kind::placed, 7}, {Kind::kept, 7},  {Kind::fused, 5}};
  const std::vector<int> lamps = {0, 3, 6, 7, 7, 5};
  double sum = 0;
  constexpr int draws = 800;
  Random random(4);
  for (int i = 0; i < draws; ++i) {
    const Drawn one = drawn(random);
    const PlaceEstimate found = one.statistics.estimate(items);
    Eigen::VectorXd errors(18);
    for (int k = 0; k < 6; ++k)
      errors.segment<3>(3 * k) = found.places.col(k) - one.truth.col(lamps[k]);
    sum += errors.dot(found.covariance.ldlt().solve(errors)) / draws;
  }
  EXPECT_NEAR(sum, 18, 4 * 6 / 28.3);  // of the mean of 800, variance 36
}

TEST(PlaceStatistics, SeparateTheMovedLamp) {
  Random random(5);
  Drawn one = drawn(random);
  std::vector<PlacePair> all;
  for (int i = 0; i < count; ++i) all.push_back({i, i});
  ASSERT_TRUE(one.statistics.set_unchanged(all));
  one.statistics.separate(all, 16.3, 4);
  for (int i = 0; i < count; ++i) EXPECT_EQ(one.statistics.is_unchanged({i, i}), i != 6) << i;
}

TEST(PlaceStatistics, RemoveErrorsThatASimilarityExplains) {
  Random random(6);
  Matrix3Xd at(3, count);
  for (int i = 0; i < count; ++i)
    at.col(i) = Vector3d(random.uniform(0, 5), random.uniform(0, 4), 2.7);
  MatrixXd shift = MatrixXd::Zero(3 * count, 3 * count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) shift(3 * i + 2, 3 * j + 2) = 0.01;
  EXPECT_LT(without_similarity(at, shift).norm(), 1e-12);
  const MatrixXd own = MatrixXd::Identity(3 * count, 3 * count);
  EXPECT_NEAR(without_similarity(at, own).trace(), 3 * count - 7, 1e-9);
}

}  // namespace
}  // namespace occ::test
