// SPDX-License-Identifier: Apache-2.0
// Gross errors in networks: whatever is rejected is named, and what stays is right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libocc/core/math.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

constexpr double control_sigma_m = 1e-3;

void add_control(Network& network, int point, double sigma_m = control_sigma_m) {
  network.control.push_back({Target::of_point(point), network.points[point].position_m,
                             sigma_m * sigma_m * Eigen::Matrix3d::Identity()});
}

/// Adds normally distributed errors to the control points.
void disturb_control(Network& network, std::uint64_t seed) {
  Random random(seed, 4);
  for (ControlPoint& control : network.control)
    for (int k = 0; k < 3; ++k)
      control.position_m[k] += std::sqrt(control.covariance_m2(k, k)) * random.normal();
}

void add_bars(Network& network) {
  for (const auto& [from, to] : {std::pair{3, 14}, {0, 9}, {21, 33}, {7, 28}})
    test::add_distance(network, from, to, 2e-4);
}

bool is_named(const std::vector<std::string>& sentences, const std::string& name) {
  return std::any_of(sentences.begin(), sentences.end(), [&](const std::string& sentence) {
    return sentence.find(name) != std::string::npos;
  });
}

TEST(GrossErrors, AWrongControlPointIsNamedAndKeepsItsImagePoints) {
  for (const int coordinate : {0, 2}) {
    SCOPED_TRACE(coordinate);
    Network truth = test::pinhole_network(8, 40);
    for (const int point : {0, 5, 11, 17, 23, 31}) add_control(truth, point);
    Network network = noisy_network(truth, 3, 0.02);
    disturb_control(network, 3);
    network.control[2].position_m[coordinate] += 0.05;
    const auto found = adjust(network);
    ASSERT_TRUE(found.ok()) << found.message;
    ASSERT_EQ(found->rejected_control.size(), 1U);
    EXPECT_EQ(found->rejected_control[0].control, 2);
    EXPECT_EQ(found->rejected_control[0].coordinate, coordinate);
    EXPECT_NEAR(found->rejected_control[0].residual_m, 0.05, 0.005);
    EXPECT_GT(found->rejected_control[0].normalised, 20);
    EXPECT_FALSE(found->network.control[2].used);
    EXPECT_TRUE(found->rejected.empty()) << "its image points are right";
    EXPECT_TRUE(is_named(found->warnings, "p11"));
    EXPECT_NE(found.message.find("1 of 6 control points"), std::string::npos) << found.message;
    EXPECT_LT(test::worst_distance(found->network, truth), 6e-3);
  }
}

TEST(GrossErrors, SeveralWrongControlPointsAreRejected) {
  Network truth = test::pinhole_network(8, 40);
  for (int point = 0; point < 40; point += 4) add_control(truth, point);
  Network network = noisy_network(truth, 4, 0.02);
  disturb_control(network, 4);
  const std::set<int> wrong = {1, 4, 8};
  for (const int i : wrong) network.control[i].position_m += Eigen::Vector3d(0.03, -0.04, 0.02);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  std::set<int> rejected;
  for (const RejectedControl& one : found->rejected_control) rejected.insert(one.control);
  EXPECT_EQ(rejected, wrong);
  EXPECT_TRUE(found->rejected.empty());
}

TEST(GrossErrors, ThreeControlPointsThatContradictEachOtherAreAmbiguous) {
  Network truth = test::pinhole_network(8, 40);
  for (const int point : {0, 11, 23}) add_control(truth, point);
  Network network = noisy_network(truth, 3, 0.02);
  network.control[1].position_m.y() += 0.05;
  const auto found = adjust(network);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_NE(found.message.find("contradict"), std::string::npos) << found.message;
  EXPECT_NE(found.message.find("control point"), std::string::npos) << found.message;
}

TEST(GrossErrors, AWrongBarOfFourIsSaid) {
  Network truth = test::line_network(6, 40);
  add_bars(truth);
  Network network = noisy_network(truth, 2, 0.01);
  network.distances[2].length_m *= 1.01;
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->rejected_distances.size(), 1U);
  EXPECT_EQ(found->rejected_distances[0].distance, 2);
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_NE(found->warnings[0].find("distance 2 (p21 to p33"), std::string::npos)
      << found->warnings[0];
  EXPECT_NE(found.message.find("1 of 4 distances"), std::string::npos) << found.message;
}

/// Wrong by a slip of the decimal point or of the unit, and by less.
constexpr double wrong_factors[] = {100, 10, 2.54, 1.2, 1.1, 0.9, 0.4, 0.1, 0.01};

TEST(GrossErrors, ABarThatIsTotallyWrongIsSaid) {
  for (const bool is_line : {false, true})
    for (const double factor : wrong_factors)
      for (const std::size_t count : {4U, 3U, 2U}) {
        SCOPED_TRACE((is_line ? "line, " : "pinhole, ") + std::to_string(count) + " bars, times " +
                     std::to_string(factor));
        Network truth = is_line ? test::line_network(6, 40) : test::pinhole_network(8, 40);
        add_bars(truth);
        Network network = noisy_network(truth, 2, 0.01);
        network.distances.resize(count);
        network.distances[1].length_m *= factor;
        const auto found = adjust(network);
        if (count == 2) {
          EXPECT_EQ(found.status, Status::ambiguous) << found.message;
          EXPECT_TRUE(is_named({found.message}, "distance 0")) << found.message;
          EXPECT_TRUE(is_named({found.message}, "distance 1")) << found.message;
          continue;
        }
        ASSERT_TRUE(found.ok()) << found.message;
        ASSERT_EQ(found->rejected_distances.size(), 1U);
        EXPECT_EQ(found->rejected_distances[0].distance, 1);
        EXPECT_LE(found->rejected.size(), 2U) << "its image points are right";
        EXPECT_TRUE(is_named(found->warnings, "distance 1 (p0 to p9"));
        EXPECT_LT(test::worst_distance(found->network, truth), 1e-2);
      }
}

TEST(GrossErrors, AControlPointThatIsTotallyWrongIsSaid) {
  Network truth = test::pinhole_network(8, 40);
  for (const int point : {0, 4, 8, 11, 23}) add_control(truth, point);
  for (const double factor : wrong_factors)
    for (const std::size_t count : {5U, 4U, 3U}) {
      SCOPED_TRACE(std::to_string(count) + " control points, times " + std::to_string(factor));
      Network network = noisy_network(truth, 3, 0.02);
      disturb_control(network, 3);
      network.control.resize(count);
      network.control[1].position_m.y() *= factor;
      const auto found = adjust(network);
      if (count == 3) {
        EXPECT_EQ(found.status, Status::ambiguous) << found.message;
        EXPECT_TRUE(is_named({found.message}, "control point 1")) << found.message;
        continue;
      }
      ASSERT_TRUE(found.ok()) << found.message;
      ASSERT_EQ(found->rejected_control.size(), 1U);
      EXPECT_EQ(found->rejected_control[0].control, 1);
      EXPECT_EQ(found->rejected_control[0].coordinate, 1);
      EXPECT_LE(found->rejected.size(), 2U) << "its image points are right";
      EXPECT_LT(test::worst_distance(found->network, truth), 6e-3);
    }
}

TEST(GrossErrors, BarsThatAgreeWithEachOtherButNotWithOthersAreAmbiguous) {
  Network truth = test::pinhole_network(8, 40);
  add_bars(truth);
  Network network = noisy_network(truth, 2, 0.01);
  for (const std::size_t k : {0U, 1U}) network.distances[k].length_m *= 2.54;
  const auto found = adjust(network);
  EXPECT_EQ(found.status, Status::ambiguous);
  for (int k = 0; k < 4; ++k)
    EXPECT_TRUE(is_named({found.message}, ("distance " + std::to_string(k)).c_str()))
        << found.message;
  EXPECT_TRUE(found->rejected_distances.empty());
}

TEST(GrossErrors, AnInaccurateBarIsNotToBlameForATotallyWrongOne) {
  Network truth = test::pinhole_network(8, 40);
  test::add_distance(truth, 3, 14, 2e-4);
  test::add_distance(truth, 0, 9, 0.1);  // does not decide on the scale
  Network network = noisy_network(truth, 2, 0.01);
  network.distances[0].length_m *= 10;
  const auto found = adjust(network);
  EXPECT_EQ(found.status, Status::ambiguous) << found.message;
  EXPECT_TRUE(found->rejected_distances.empty());
}

TEST(GrossErrors, ATotallyWrongBarBetweenTagsOfKnownSizeIsSaid) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.targets = 0;
  design.tags = 80;
  design.tag_side_m = 0.3;
  Network network = simulate_test_field(design).network;
  const Target from = Target::of_corner(2, 0), to = Target::of_corner(17, 1);
  const double length_m = (network.position_m(to) - network.position_m(from)).norm();
  network.distances = {{from, to, 10 * length_m, 1e-3, true}};
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->rejected_distances.size(), 1U);
  EXPECT_NEAR(found->rejected_distances[0].residual_m, 9 * length_m, 0.1);
  EXPECT_LT(found->sigma0, 1.1);
}

TEST(GrossErrors, AStoppedAdjustmentKeepsItsBars) {
  Network truth = test::pinhole_network(8, 40);
  add_bars(truth);
  const auto found = adjust(noisy_network(truth, 2, 0.01), {},
                            [](const AdjustProgress& state) { return state.iteration < 2; });
  EXPECT_EQ(found.status, Status::not_converged);
  EXPECT_EQ(found.message, "stopped by the caller");
  for (const DistanceObservation& one : found->network.distances) EXPECT_TRUE(one.used);
}

TEST(GrossErrors, ALessAccurateBarIsNotToBlameForAContradiction) {
  Network truth = test::line_network(6, 40);
  test::add_distance(truth, 0, 9, 2e-5);
  test::add_distance(truth, 3, 14, 5e-3);
  for (const std::size_t wrong : {0U, 1U}) {
    Network network = noisy_network(truth, 2, 0.01);
    network.distances[wrong].length_m *= 1.05;
    const auto found = adjust(network);
    EXPECT_EQ(found.status, Status::ambiguous) << wrong;
    EXPECT_TRUE(found->rejected_distances.empty());
  }
}

TEST(GrossErrors, AWeakImageIsLeftOutAndTheRestIsAdjusted) {
  const Network truth = test::pinhole_network(9, 40);
  Network network = noisy_network(truth, 5, 0.02);
  int kept = 0;  // image 4 observes five points, one of them wrongly
  for (ImageObservation& observation : network.observations)
    if (observation.image == 4 && ++kept > 5) observation.used = false;
  for (ImageObservation& observation : network.observations)
    if (observation.image == 4) {
      observation.pixel += Eigen::Vector2d(300, -200);
      break;
    }
  const auto with_five = adjust(network);
  ASSERT_TRUE(with_five.ok()) << with_five.message;
  EXPECT_LT(with_five->sigma0, 1.15);

  kept = 0;
  for (ImageObservation& observation : network.observations)
    if (observation.image == 4 && observation.used && ++kept > 2) observation.used = false;
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->left_out.size(), 1U);
  EXPECT_EQ(found->left_out[0].kind, LeftOut::Kind::station);
  EXPECT_EQ(found->left_out[0].index, 4);
  EXPECT_EQ(found->left_out[0].name, "station s4");
  EXPECT_TRUE(is_named(found->warnings, "station s4"));
  EXPECT_EQ(found->network.stations[4].station_from_world.translation,
            network.stations[4].station_from_world.translation);
}

TEST(GrossErrors, AnImageOfAnotherRoomIsLeftOutWithItsStartValue) {
  const Network truth = test::pinhole_network(9, 40);
  Network network = noisy_network(truth, 6, 0.02);
  Random random(1, 1);
  for (ImageObservation& observation : network.observations)
    if (observation.image == 3)
      observation.pixel = {random.uniform(0, 1280), random.uniform(0, 960)};
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->left_out.size(), 1U) << found->warnings[0];
  EXPECT_EQ(found->left_out[0].index, 3);
  EXPECT_EQ(found->network.stations[3].station_from_world.translation,
            network.stations[3].station_from_world.translation);
  EXPECT_LT(found->sigma0, 1.15);
  EXPECT_GT(found->rejected_share, 0.05);
  EXPECT_NE(found.message.find("image points"), std::string::npos) << found.message;
}

TEST(GrossErrors, AnImageWithAnotherZoomIsNamed) {
  const Network truth = test::pinhole_network(9, 40);
  Network network = noisy_network(truth, 6, 0.02);
  for (ImageObservation& observation : network.observations)
    if (observation.image == 5)
      observation.pixel =
          Eigen::Vector2d(645, 470) + 1.2 * (observation.pixel - Eigen::Vector2d(645, 470));
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_TRUE(is_named(found->warnings, "station s5")) << found.message;
  for (const RejectedObservation& one : found->rejected)
    EXPECT_EQ(network.observations[one.observation].image, 5);
}

TEST(GrossErrors, AStationThatStartsElsewhereIsResected) {
  const Network truth = test::pinhole_network(8, 40);
  Network network = noisy_network(truth, 6, 0.02);
  Rigid3& pose = network.stations[2].station_from_world;
  pose = Rigid3{so3_exp({0.4, 1.2, -2}), {0.5, -1, 2}} * pose;
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_TRUE(found->left_out.empty());
  EXPECT_LE(found->rejected.size(), 2U);
  EXPECT_LT(found->sigma0, 1.15);
}

TEST(GrossErrors, PointsThatKeepTwoRaysAreNamed) {
  const Network truth = test::pinhole_network(8, 40);
  Network network = noisy_network(truth, 7, 0.02);
  int rays = 0;
  for (ImageObservation& observation : network.observations)
    if (observation.target.point == 12 && ++rays > 3) observation.used = false;
  rays = 0;
  for (ImageObservation& observation : network.observations)
    if (observation.target.point == 12 && observation.used && ++rays == 3)
      observation.pixel += Eigen::Vector2d(40, 90);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->weak_points, std::vector<int>{12});
  EXPECT_TRUE(is_named(found->warnings, "p12 keeps 2 rays of 3"));
}

TEST(GrossErrors, ATargetThatOccursTwiceInAnImageIsSaid) {
  Network network = noisy_network(test::pinhole_network(8, 40), 8, 0.02);
  EXPECT_TRUE(adjust(network)->warnings.empty());
  ImageObservation again = network.observations[17];
  again.pixel += Eigen::Vector2d(150, 3);
  network.observations.push_back(again);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_TRUE(is_named(found->warnings, "twice"));
  ASSERT_EQ(found->rejected.size(), 1U);
  EXPECT_EQ(found->rejected[0].observation, static_cast<int>(network.observations.size()) - 1);
}

TEST(GrossErrors, ContradictedPriorsAreSaid) {
  Network network = noisy_network(test::pinhole_network(8, 40), 8, 0.02);
  network.parameter_priors.push_back({0, "fx_px", 1000, 0.3});
  network.pose_priors.push_back(
      {0, network.stations[0].station_from_world, 1e-2 * Matrix6::Identity()});
  EXPECT_TRUE(adjust(network)->warnings.empty());
  network.parameter_priors[0].value = 1040;
  const auto found = adjust(network);
  EXPECT_TRUE(is_named(found->warnings, "the prior of fx_px of camera camera contradicts"));
}

TEST(GrossErrors, PlacesThatDetermineLittleAreSaid) {
  // Stations on a line, and stations within 1 cm.
  for (const double length_m : {3.0, 0.01}) {
    SCOPED_TRACE(length_m);
    Network network = test::cloud_network(test::small_pinhole(), {});
    network.observations.clear();
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d from(1 + length_m * (i - 2.5) / 5, -3, 3);
      network.stations[i].station_from_world = look_at(from, {1, 2, 3}, Eigen::Vector3d::UnitZ());
      for (int k = 0; k < 30; ++k) {
        const auto pixel = network.cameras[0].camera.project(network.cam_from_world(i) *
                                                             network.points[k].position_m);
        if (pixel && network.cameras[0].camera.contains(*pixel))
          network.observations.push_back({i, Target::of_point(k), *pixel, {0.3, 0.3}, true});
      }
    }
    const auto found = adjust(network, test::plain());
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_TRUE(is_named(found->warnings, length_m > 1 ? "from one line" : "from one place"));
  }
}

TEST(GrossErrors, TooManyAreNotOk) {
  Network network = noisy_network(test::pinhole_network(8, 40), 8, 0.01);
  Random random(5, 5);
  for (ImageObservation& observation : network.observations)
    if (random.uniform() < 0.5)
      observation.pixel = {random.uniform(0, 1280), random.uniform(0, 960)};
  const auto found = adjust(network);
  EXPECT_FALSE(found.ok()) << found->rejected_share;
}

/// A network with bars, control points and gross errors of all kinds, its truth, and its result.
struct Trial {
  Network truth, network;
  double share = 0;
  Result<Adjustment> found;

  /// `totally_wrong`: bars and control points are wrong by a factor up to 20 instead of 1 % and 5
  /// cm.
  Trial(std::uint64_t seed, bool totally_wrong) {
    Random random(seed, 21);
    const int stations = 6 + random.below(7), points = 30 + random.below(30);
    truth = seed % 4 == 3 ? test::line_network(stations, points)
                          : test::pinhole_network(stations, points);
    for (int k = 0; k < 4; ++k) test::add_distance(truth, 2 * k, points - 1 - 3 * k, 5e-4);
    for (int k = 0; k < 6; ++k) add_control(truth, (5 * k + 1) % points);
    network = noisy_network(truth, seed, 0.05);
    disturb_control(network, seed);
    share = random.uniform(0, 0.3);
    for (ImageObservation& observation : network.observations) {
      if (random.uniform() >= share) continue;
      const double angle = random.uniform(0, 2 * pi), far = std::exp(random.uniform(1.6, 5.3));
      observation.pixel += far * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    const auto factor = [&] { return std::exp(random.uniform(-3, 3)); };
    if (random.uniform() < 0.5)
      network.distances[random.below(4)].length_m *= totally_wrong ? factor() : 1.01;
    if (random.uniform() < 0.5)
      network.control[random.below(6)].position_m[random.below(3)] +=
          totally_wrong ? factor() : 0.05;
    found = adjust(network);
  }

  /// Points beyond 5 sigmas that no list names.
  std::vector<std::string> wrong_points() const {
    std::vector<std::string> wrong;
    const auto known = precision(found->network);
    if (!known.ok()) return {"no precision: " + known.message};
    for (int i = 0; i < static_cast<int>(truth.points.size()); ++i) {
      const Eigen::Matrix3d covariance =
          known->point(i) * std::max(1.0, std::pow(found->sigma0, 2));
      if (!covariance.allFinite()) continue;
      const Eigen::Vector3d off = found->network.points[i].position_m - truth.points[i].position_m;
      // 5 sigmas of a normal variable are 5.9 of a vector of three: the same probability.
      if (off.dot(covariance.inverse() * off) < 5.9 * 5.9) continue;
      const auto& named = found->weak_points;
      if (std::find(named.begin(), named.end(), i) == named.end())
        wrong.push_back(truth.points[i].name + " is off by " + std::to_string(1e3 * off.norm()) +
                        " mm, " + std::to_string(std::sqrt(off.dot(covariance.inverse() * off))) +
                        " sigmas");
    }
    return wrong;
  }
};

void run_campaign(int count, bool totally_wrong = false) {
  int ok = 0, bars = 0, controls = 0;
  for (int seed = 0; seed < count; ++seed) {
    const Trial trial(static_cast<std::uint64_t>(seed), totally_wrong);
    SCOPED_TRACE("seed " + std::to_string(seed) + ", share " + std::to_string(trial.share) + ": " +
                 trial.found.message);
    if (!trial.found.ok()) continue;
    ++ok;
    for (const std::string& wrong : trial.wrong_points()) ADD_FAILURE() << wrong;
    const auto is_left_out = [&](LeftOut::Kind kind, std::size_t index) {
      const auto& list = trial.found->left_out;
      return std::any_of(list.begin(), list.end(), [&](const LeftOut& one) {
        return one.kind == kind && one.index == static_cast<int>(index);
      });
    };
    // A distance to a point that keeps two rays is not controlled.
    const auto is_weak = [&](const Target& target) {
      const auto& weak = trial.found->weak_points;
      return std::find(weak.begin(), weak.end(), target.point) != weak.end();
    };
    for (std::size_t k = 0; k < trial.network.distances.size(); ++k)
      if (!is_left_out(LeftOut::Kind::distance, k) && !is_weak(trial.network.distances[k].from) &&
          !is_weak(trial.network.distances[k].to) &&
          std::abs(trial.network.distances[k].length_m - trial.truth.distances[k].length_m) > 5e-3)
        bars += trial.found->network.distances[k].used;
    for (std::size_t k = 0; k < trial.network.control.size(); ++k)
      if ((trial.network.control[k].position_m - trial.truth.control[k].position_m).norm() > 0.04)
        controls += trial.found->network.control[k].used;
  }
  EXPECT_GE(ok, 95 * count / 100);
  EXPECT_EQ(bars, 0) << "wrong bars in use";
  EXPECT_EQ(controls, 0) << "wrong control points in use";
}

TEST(GrossErrors, NoUnnamedPointIsWrong) { run_campaign(12); }

TEST(GrossErrors, NoUnnamedPointIsWrongWithTotallyWrongBars) { run_campaign(12, true); }

TEST(SlowGrossErrors, NoUnnamedPointIsWrong) { run_campaign(300); }

TEST(SlowGrossErrors, NoUnnamedPointIsWrongWithTotallyWrongBars) { run_campaign(300, true); }

}  // namespace
}  // namespace occ
