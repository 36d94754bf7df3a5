// SPDX-License-Identifier: Apache-2.0
// Stations with three targets. Near the danger cylinder, through the circle of the targets and
// perpendicular to their plane, small errors of the images displace the pose by a lot, and two
// poses meet (Smith, "Some theorems on the resection problem", 1965).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <optional>

#include "tests/network/network_support.hpp"

namespace occ::test {
namespace {

using Eigen::Vector3d;

struct ThreeTargets {
  Network network;  ///< its last station observes three points
  Rigid3 truth;     ///< pose of that station
};

/// `off_cylinder`: distance of the camera from the axis over the radius of the circle, less 1.
ThreeTargets with_three_targets(double off_cylinder, std::uint64_t seed) {
  Random random(seed, 5);
  Network network = pinhole_network(6, 30);
  network.cameras[0].free_parameters.clear();
  const int first = 3 * static_cast<int>(seed % 9);
  const Vector3d a = network.points[first].position_m;
  const Vector3d b = network.points[first + 1].position_m - a,
                 c = network.points[first + 2].position_m - a;
  const Vector3d n = b.cross(c);
  const Vector3d centre =
      a + (n.cross(b) * c.squaredNorm() + c.cross(n) * b.squaredNorm()) / (2 * n.squaredNorm());
  const Vector3d along = n.normalized(), x = (a - centre).normalized(), y = along.cross(x);
  const double radius = (a - centre).norm(), turn = random.uniform(0, 2 * pi);
  const Vector3d camera = centre +
                          radius * (1 + off_cylinder) * (std::cos(turn) * x + std::sin(turn) * y) +
                          random.uniform(4, 5) * along;
  const Vector3d middle = a + (b + c) / 3;
  const int image = network.add_image("weak", 0, look_at(camera, middle, x));
  ThreeTargets made;
  made.truth = network.cam_from_world(image);
  for (int k = first; k < first + 3; ++k) {
    const auto pixel = network.cameras[0].camera.project(made.truth * network.points[k].position_m);
    if (pixel)
      network.observations.push_back({image, Target::of_point(k), *pixel, {0.3, 0.3}, true});
  }
  made.network = noisy_network(network, seed, 0.002);
  return made;
}

/// Squared error of the pose of the last station over its covariance (6 degrees of freedom);
/// nothing if the station is left out.
std::optional<double> squared_error(const ThreeTargets& made, const Adjustment& adjusted) {
  if (!adjusted.left_out.empty()) return std::nullopt;
  const auto known = precision(adjusted.network);
  EXPECT_TRUE(known.ok()) << known.message;
  const Rigid3 error = adjusted.network.cam_from_world(6) * made.truth.inverse();
  Vector6 d;
  d << so3_log(error.rotation), error.translation;
  return d.dot(known->station(6).inverse() * d);
}

TEST(WeakStations, OnADangerCylinderDoNotEndTheAdjustment) {
  int left_out = 0;
  const int seeds = 20;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const ThreeTargets made = with_three_targets(0, seed);
    const auto found = adjust(made.network);
    ASSERT_TRUE(found.ok()) << found.message;
    if (found->left_out.empty()) continue;
    ++left_out;
    ASSERT_EQ(found->left_out.size(), 1U);
    EXPECT_EQ(found->left_out[0].name, "station weak");
    EXPECT_NE(found->left_out[0].reason.find("danger cylinder"), std::string::npos);
    EXPECT_EQ(found->network.stations[6].station_from_world.translation,
              made.network.stations[6].station_from_world.translation);
    Network others = made.network;
    for (ImageObservation& observation : others.observations)
      if (observation.image == 6) observation.used = false;
    const auto expected = adjust(others);
    ASSERT_TRUE(expected.ok());
    EXPECT_EQ(found->redundancy, expected->redundancy);
    EXPECT_NEAR(found->sigma0, expected->sigma0, 1e-6);
  }
  EXPECT_GE(left_out, seeds - 1);
}

TEST(WeakStations, OfThreeTargetsHaveTheErrorsThatTheyState) {
  double sum = 0;
  int kept = 0;
  for (const double off_cylinder : {-0.5, 0.6, 1.0})
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const ThreeTargets made = with_three_targets(off_cylinder, seed);
      const auto found = adjust(made.network);
      ASSERT_TRUE(found.ok()) << found.message;
      const auto squared = squared_error(made, *found);
      if (!squared) continue;
      EXPECT_LT(*squared, 40) << off_cylinder << ", seed " << seed;
      sum += *squared / 6;
      ++kept;
    }
  EXPECT_GE(kept, 18);
  EXPECT_NEAR(sum / kept, 1, 0.35);
}

TEST(WeakStations, OfTargetsOnALineAreLeftOut) {
  Network network = pinhole_network(6, 30);
  const int image = network.add_image("weak", 0, network.stations[0].station_from_world);
  network.stations[image].station_from_world.translation += Vector3d(0.1, 0.2, -0.3);
  for (int k = 1; k < 5; ++k) {
    network.points.push_back(
        {"line " + std::to_string(k), Vector3d(1, 2, 3) + k * Vector3d(0.2, 0.1, 0.1), false});
    const int point = static_cast<int>(network.points.size()) - 1;
    for (int i = 0; i < 7; ++i) {
      const auto pixel = network.cameras[0].camera.project(network.cam_from_world(i) *
                                                           network.points[point].position_m);
      ASSERT_TRUE(pixel);
      network.observations.push_back({i, Target::of_point(point), *pixel, {0.3, 0.3}, true});
    }
  }
  const auto found = adjust(noisy_network(network, 3, 0.002));
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->left_out.size(), 1U);
  EXPECT_EQ(found->left_out[0].index, image);
}

/// Uses `count` observations only of each of the first `images` images.
void keep_observations(Network& network, int images, int count) {
  std::vector<int> seen(static_cast<std::size_t>(images), 0);
  for (ImageObservation& observation : network.observations)
    observation.used =
        observation.image >= images || ++seen[static_cast<std::size_t>(observation.image)] <= count;
}

TEST(WeakStations, AreNamedInOneWarning) {
  Network network = noisy_network(pinhole_network(6, 30), 4, 0.002);
  keep_observations(network, 2, 3);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_TRUE(found->left_out.empty());
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_NE(found->warnings[0].find("station s0, station s1"), std::string::npos);
}

TEST(WeakStations, ThatAreLeftOutShareAWarning) {
  Network network = noisy_network(pinhole_network(8, 30), 5, 0.002);
  keep_observations(network, 3, 2);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->left_out.size(), 3U);
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_EQ(found->warnings[0], "station s0 is left out: it " + found->left_out[0].reason +
                                    "; so are station s1, station s2");
}

}  // namespace
}  // namespace occ::test
