// SPDX-License-Identifier: Apache-2.0
// Similarities between constellations and maps: the right one is found, and accidental ones have
// an honest number of false alarms.
#include "libocc/survey/internal/map_link.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <iostream>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using internal::survey::link_ways;
using internal::survey::LinkLamp;

std::vector<LinkLamp> random_lamps(int count, double sigma, Random& random) {
  std::vector<LinkLamp> lamps;
  for (int i = 0; i < count; ++i) {
    LinkLamp lamp;
    lamp.position = {random.uniform(0, 5), random.uniform(0, 4), random.uniform(2.4, 2.8)};
    lamp.covariance = square(sigma) * Matrix3d::Identity();
    lamp.size = 0.08;
    lamps.push_back(lamp);
  }
  return lamps;
}

/// The lamps in another frame and unit, with errors.
std::vector<LinkLamp> moved(std::vector<LinkLamp> lamps, const Similarity& similarity, double sigma,
                            Random& random) {
  for (LinkLamp& lamp : lamps) {
    lamp.position += sigma * Vector3d(random.normal(), random.normal(), random.normal());
    lamp.position = similarity * lamp.position;
    lamp.normal = similarity.rotation *
                  so3_exp(0.01 * Vector3d(random.normal(), random.normal(), random.normal())) *
                  lamp.normal;
    lamp.covariance = square(sigma * similarity.scale) * Matrix3d::Identity();
    lamp.size *= similarity.scale;
  }
  return lamps;
}

Similarity any_similarity(Random& random) {
  Similarity similarity;
  similarity.scale = random.uniform(0.1, 3);
  similarity.rotation = so3_exp({random.normal(), random.normal(), random.normal()});
  similarity.translation = {random.normal(), random.normal(), random.normal()};
  return similarity;
}

TEST(LinkWays, FindTheLampsThatDidNotChange) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 4);
    const std::vector<LinkLamp> map = random_lamps(12, 0.003, random);
    std::vector<LinkLamp> now = map;
    for (int i = 0; i < 5; ++i) now[i].position += Vector3d(random.normal(), random.normal(), 0);
    const auto ways = link_ways(moved(now, any_similarity(random), 0.003, random), map);
    ASSERT_FALSE(ways.empty());
    EXPECT_LT(ways[0].log10_false_alarms, -4);
    for (int i = 5; i < 12; ++i) EXPECT_EQ(ways[0].lamp_of[i], i) << seed;
    if (ways.size() > 1) {
      EXPECT_GT(ways[1].log10_false_alarms, -4) << seed;
    }
  }
}

// The mean number of accidental ways with NFA below a limit must not exceed the limit.
TEST(LinkWays, AreAccidentalAsRarelyAsStated) {
  constexpr int rooms = 400;
  int below_one = 0, below_tenth = 0, below_hundredth = 0;
  for (std::uint64_t seed = 1; seed <= rooms; ++seed) {
    Random random(seed, 5);
    const double sigma = seed % 2 == 0 ? 0.02 : 0.05;  // many accidents
    const std::vector<LinkLamp> map = random_lamps(9, sigma, random);
    const std::vector<LinkLamp> other = random_lamps(8, sigma, random);
    for (const auto& way : link_ways(moved(other, any_similarity(random), sigma, random), map)) {
      below_one += way.log10_false_alarms < 0;
      below_tenth += way.log10_false_alarms < -1;
      below_hundredth += way.log10_false_alarms < -2;
    }
  }
  std::cout << "accidental ways in " << rooms << " rooms with NFA below 1: " << below_one
            << ", 0.1: " << below_tenth << ", 0.01: " << below_hundredth << std::endl;
  EXPECT_LT(below_one, rooms);
  EXPECT_LT(below_tenth, 0.1 * rooms + 15);  // plus 2.5 sigmas
  EXPECT_LT(below_hundredth, 0.01 * rooms + 5);
}

TEST(LinkWays, ListAllTurnsOfASquare) {
  Random random(1);
  std::vector<LinkLamp> map = random_lamps(4, 0.003, random);
  for (int i = 0; i < 4; ++i) map[i].position = {i % 2 * 2.0, i / 2 * 2.0, 2.7};
  const auto ways = link_ways(moved(map, any_similarity(random), 0.003, random), map);
  int whole = 0;
  for (const auto& way : ways) whole += way.matches == 4;
  EXPECT_EQ(whole, 4);
}

TEST(LinkWays, NeedThreeLamps) {
  Random random(1);
  const std::vector<LinkLamp> map = random_lamps(4, 0.003, random);
  EXPECT_TRUE(link_ways({map[0], map[1]}, map).empty());
  EXPECT_TRUE(link_ways(map, {map[0], map[1]}).empty());
}

}  // namespace
}  // namespace occ::test
