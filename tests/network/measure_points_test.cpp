// SPDX-License-Identifier: Apache-2.0
// Points measured in calibrated images.
#include "libocc/network/measure_points.hpp"

#include <algorithm>

#include "tests/network/network_support.hpp"

namespace occ {
namespace {

std::vector<std::vector<PointObservation>> observations(const Network& network, int points,
                                                        double noise = 0, std::uint64_t seed = 1) {
  Random random(seed, 2);
  std::vector<std::vector<PointObservation>> all(static_cast<std::size_t>(points));
  for (const ImageObservation& seen : network.observations)
    if (seen.target.point >= 0 && seen.target.point < points) {
      const double x = random.normal();
      all[seen.target.point].push_back(
          {seen.image, seen.pixel + noise * Eigen::Vector2d(x, random.normal()), seen.sigma_px});
    }
  return all;
}

TEST(Measure, NoiseFreePointsAreExact) {
  for (const Network& network : {test::pinhole_network(), test::line_network()}) {
    const Measurement m = measure_points(network, observations(network, 10));
    for (std::size_t i = 0; i < 10; ++i) {
      EXPECT_EQ(m.points[i].status, Status::ok);
      EXPECT_LT((m.points[i].position_m - network.points[i].position_m).norm(), 1e-9);
      EXPECT_LT(m.points[i].worst_residual_px, 1e-6);
      EXPECT_GT(m.points[i].angle_rad, 0.5);
    }
    EXPECT_NEAR(distance_between(m, 2, 5).length_m,
                (network.points[2].position_m - network.points[5].position_m).norm(), 1e-9);
  }
}

TEST(Measure, CovarianceMatchesMonteCarlo) {
  const Network network = test::line_network(3, 12);
  constexpr int runs = 400;
  Eigen::Matrix3d seen = Eigen::Matrix3d::Zero();
  double distance = 0, sigma0 = 0;
  Measurement m;
  const double length = (network.points[2].position_m - network.points[5].position_m).norm();
  for (std::uint64_t run = 0; run < runs; ++run) {
    m = measure_points(network, observations(network, 12, 0.3, run));
    const Eigen::Vector3d off = m.points[2].position_m - network.points[2].position_m;
    seen += off * off.transpose() / runs;
    distance += std::pow(distance_between(m, 2, 5).length_m - length, 2) / runs;
    sigma0 += m.points[2].sigma0 * m.points[2].sigma0 / runs;
  }
  const Eigen::Matrix3d predicted = m.points[2].covariance_m2;
  EXPECT_NEAR((predicted.llt().solve(seen)).trace(), 3, 0.4);
  EXPECT_NEAR(std::sqrt(distance) / distance_between(m, 2, 5).sigma_m, 1, 0.12);
  EXPECT_NEAR(sigma0, 1, 0.12);
}

/// Points of the network, removed from it and measured with all their images, have the covariance
/// that the adjustment without them predicts.
TEST(Measure, PropagatesTheUncertaintyOfCameras) {
  const Network network = test::line_network(6, 50);
  Network without = network;
  for (ImageObservation& seen : without.observations) seen.used = seen.target.point >= 4;
  Datum datum;
  for (int k = 4; k < 50; ++k) datum.targets.push_back(Target::of_point(k));
  const auto p = precision(without, datum);
  ASSERT_TRUE(p.ok()) << p.message;
  const auto all = observations(network, 4);
  const Measurement known = measure_points(network, all), m = measure_points(network, all, &*p);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_GT(m.points[i].covariance_m2.trace(), 1.02 * known.points[i].covariance_m2.trace());
  const Eigen::Matrix3d shared = m.covariance_m2.block<3, 3>(0, 3);
  EXPECT_GT(shared.norm(), 0) << "two points share the stations' errors";
  // Numerically: move the cameras and the stations by draws from their covariance is what Monte
  // Carlo does; here the whole adjustment, where these points have next to no weight of their own.
  Network weak = network;
  for (ImageObservation& seen : weak.observations)
    if (seen.target.point < 4) seen.sigma_px *= 1e4;
  const auto whole = precision(weak, datum);
  const Measurement large = [&] {
    auto wide = all;
    for (auto& one : wide)
      for (PointObservation& seen : one) seen.sigma_px *= 1e4;
    return measure_points(network, wide, &*p);
  }();
  for (int i = 0; i < 4; ++i) {
    const Eigen::Matrix3d a = whole->point(i), b = large.points[i].covariance_m2;
    EXPECT_LT((a - b).norm(), 1e-4 * a.norm());
  }
}

/// One station of ten observes little, so that its pose is poor. Its rays must not spoil the
/// points.
TEST(Measure, RaysOfAPoorImageHaveLittleWeight) {
  Network truth = test::cloud_network(test::small_pinhole(), {}, 10, 50);
  int kept = 0;
  for (ImageObservation& seen : truth.observations) {
    if (seen.target.point < 4) seen.used = false;
    if (seen.image == 9 && seen.target.point >= 4 && ++kept > 4) seen.used = false;
    if (seen.image == 9) seen.sigma_px.setConstant(20);
  }
  Datum datum;
  for (int k = 4; k < 50; ++k) datum.targets.push_back(Target::of_point(k));
  double nees = 0;
  constexpr int runs = 100;
  for (std::uint64_t run = 0; run < runs; ++run) {
    const auto found = adjust(noisy_network(truth, run, 0.001), test::plain());
    ASSERT_TRUE(found.ok()) << found.message;
    const auto aligned = in_datum(found->network, truth, datum);
    const auto p = precision(*aligned, datum);
    ASSERT_TRUE(p.ok()) << p.message;
    auto all = observations(truth, 4, 0.3, run);
    for (auto& point : all)
      for (PointObservation& seen : point) seen.sigma_px.setConstant(0.3);
    const Measurement with = measure_points(*aligned, all, &*p);
    for (auto& point : all)
      point.erase(std::remove_if(point.begin(), point.end(),
                                 [](const PointObservation& seen) { return seen.image == 9; }),
                  point.end());
    const Measurement without = measure_points(*aligned, all, &*p);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Matrix3d a = with.points[i].covariance_m2, b = without.points[i].covariance_m2;
      EXPECT_LT(a.trace(), 1.0001 * b.trace()) << "another ray never makes a point worse";
      const Eigen::Vector3d off = with.points[i].position_m - truth.points[i].position_m;
      nees += off.dot(a.inverse() * off) / (3 * 4 * runs);
    }
  }
  EXPECT_NEAR(nees, 1, 0.2);
}

TEST(Measure, ReportsPointsThatCannotBeMeasured) {
  const Network network = test::pinhole_network();
  auto all = observations(network, 4);
  all[0].resize(1);
  all[1] = {all[1][0], all[1][0]};
  all[3].clear();
  const Measurement m = measure_points(network, all);
  EXPECT_EQ(m.points[0].status, Status::too_few_lamps);
  EXPECT_EQ(m.points[1].status, Status::too_few_lamps) << "twice in one image is once";
  EXPECT_EQ(m.points[2].status, Status::ok);
  EXPECT_EQ(m.points[3].status, Status::too_few_lamps);
  EXPECT_TRUE(std::isinf(m.points[0].covariance_m2(0, 0)));
  EXPECT_TRUE(std::isinf(distance_between(m, 0, 2).sigma_m));
  EXPECT_FALSE(m.covariance_m2.hasNaN());

  Network twice = network;  // two images from one position: parallel rays
  twice.stations[1] = twice.stations[0];
  const auto pixel = [&](int image) {
    return *twice.cameras[0].camera.project(twice.cam_from_world(image) *
                                            twice.points[0].position_m);
  };
  const Measurement parallel =
      measure_points(twice, {{{0, pixel(0), {0.3, 0.3}}, {1, pixel(1), {0.3, 0.3}}}});
  EXPECT_EQ(parallel.points[0].status, Status::degenerate);

  EXPECT_THROW(measure_points(network, {{{77, {1, 1}, {1, 1}}}}), std::invalid_argument);
  EXPECT_THROW(measure_points(network, {{{0, {NAN, 1}, {1, 1}}}}), std::invalid_argument);
  EXPECT_THROW(measure_points(network, {{{0, {1, 1}, {1, 0}}}}), std::invalid_argument);
  EXPECT_THROW(distance_between(m, 0, 9), std::invalid_argument);
}

}  // namespace
}  // namespace occ
