// SPDX-License-Identifier: Apache-2.0
// Smoothers with faulty input: gross errors of odometry, wrong sightings, gaps, poses that nothing
// determines, bad input.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "libocc/smooth/window_smoother.hpp"
#include "tests/smooth/smoother_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void expect_numbers(const Smoothing<SmoothedPose>& found) {
  for (const SmoothedPose& pose : found.poses) {
    EXPECT_TRUE(pose.body_from_world.rotation.allFinite());
    EXPECT_TRUE(pose.body_from_world.translation.allFinite());
    EXPECT_FALSE(pose.covariance.hasNaN());
    EXPECT_EQ(pose.determined, pose.covariance.allFinite());
  }
  EXPECT_TRUE(std::isfinite(found.chi2));
}

std::set<std::size_t> contradicted(const std::vector<OdometryLink>& links) {
  std::set<std::size_t> out;
  for (std::size_t k = 0; k < links.size(); ++k)
    if (links[k].contradicted) out.insert(k);
  return out;
}

double worst_sigmas(const Drive& drive, const Smoothing<SmoothedPose>& found) {
  double worst = 0;
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const Vector6 error = difference(drive.truth[k], found.poses[k].body_from_world);
    worst = std::max(worst, test::nees(error, found.poses[k].covariance));
  }
  return std::sqrt(worst);
}

TEST(SmootherFaults, OdometryThatLiesIsSaidAndNotFollowed) {
  for (const double lie_m : {0.05, 0.3, 3.0}) {
    Drive drive = room_drive(21, 20);
    for (const std::size_t k : {3u, 10u, 11u, 12u})
      drive.input.odometry[k].to_from_from.translation.x() += lie_m;
    const auto found = smooth(drive.input);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_EQ(contradicted(found->links), (std::set<std::size_t>{3, 10, 11, 12})) << lie_m;
    EXPECT_NE(found.message.find("odometry from 0.3 s to 0.4 s is contradicted"), std::string::npos)
        << found.message;
    EXPECT_NE(found.message.find("3 more"), std::string::npos) << found.message;
    EXPECT_LT(worst_sigmas(drive, *found), 6) << lie_m;
    for (const OdometryLink& link : found->links) EXPECT_EQ(link.factor > 1, link.contradicted);
  }
}

TEST(SmootherFaults, OdometryThatLiesForLong) {
  Drive drive = room_drive(30, 40);
  std::set<std::size_t> lies;
  for (std::size_t k = 8; k < 28; ++k) {
    drive.input.odometry[k].to_from_from.translation *= -1;  // backwards
    lies.insert(k);
  }
  const auto found = smooth(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(contradicted(found->links), lies);
  EXPECT_LT(worst_sigmas(drive, *found), 6);
}

// Whatever is missing or wrong: numbers, the same ones again, and covariances that only grow to
// infinity where nothing is known.
void expect_numbers_of_mixtures(std::uint64_t drives) {
  int ok = 0, parts = 0, stuck = 0;
  for (std::uint64_t seed = 0; seed < drives; ++seed) {
    Drive drive = room_drive(700 + seed, 12);
    Random random(seed, 9);
    for (SmootherFrame& frame : drive.input.frames) {
      frame.sightings.resize(static_cast<std::size_t>(random.below(7)));
      for (PointSighting& seen : frame.sightings) {
        if (random.below(12) == 0) seen.px = {random.uniform(-1e4, 1e4), random.uniform(0, 480)};
        if (random.below(40) == 0) seen.point_in_world *= -1;
        if (random.below(40) == 0) seen.covariance_px2 *= 1e-8;
      }
    }
    for (std::size_t k = drive.input.odometry.size(); k-- > 0;) {
      Odometry& odometry = drive.input.odometry[k];
      if (random.below(8) == 0) odometry.to_from_from = random_pose(random, 100);
      if (random.below(8) == 0) odometry.covariance *= random.below(2) == 0 ? 1e4 : 1e-4;
      if (random.below(8) == 0)
        drive.input.odometry.erase(drive.input.odometry.begin() + static_cast<std::ptrdiff_t>(k));
    }
    const auto found = smooth(drive.input), again = smooth(drive.input);
    expect_numbers(*found);
    ok += found.ok();
    parts += found.status == Status::degenerate || found.status == Status::ambiguous;
    stuck += found.status == Status::not_converged;
    EXPECT_EQ(found->chi2, again->chi2);
    WindowOptions options;
    options.poses = 4;
    WindowSmoother window(options);
    for (const Odometry& odometry : drive.input.odometry) window.add_odometry(odometry);
    for (const SmootherFrame& frame : drive.input.frames)
      expect_numbers(window.add_frame(frame)->window);
  }
  const auto all = static_cast<double>(drives);
  EXPECT_GT(ok, 0.08 * all);  // the rest is said
  EXPECT_GT(parts, 0.6 * all);
  EXPECT_LT(stuck, 0.08 * all);
}

TEST(SmootherFaults, AnyMixtureGivesNumbers) { expect_numbers_of_mixtures(25); }

TEST(SlowSmootherFaults, AnyMixtureGivesNumbers) { expect_numbers_of_mixtures(100); }

TEST(SmootherFaults, HonestOdometryIsNotCalledALie) {
  int links = 0, called = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto found = smooth(room_drive(300 + seed, 15).input);
    links += static_cast<int>(found->links.size());
    called += static_cast<int>(contradicted(found->links).size());
  }
  EXPECT_EQ(links, 40 * 14);
  EXPECT_EQ(called, 0);
}

TEST(SmootherFaults, ALinksChi2IsThatOfADeletedResidual) {
  double sum = 0;
  int dof = 0;
  SmootherOptions options;
  options.huber_sigmas = options.link_gate = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto found = smooth(room_drive(400 + seed, 6).input, options);
    sum += found->links[2].chi2;  // others depend on it
    dof += found->links[2].dof;
  }
  const auto [low, high] = chi2_interval(dof);
  EXPECT_EQ(dof, 240);
  EXPECT_GT(sum, low);
  EXPECT_LT(sum, high);

  // Against the answer without the link: predicted from the rest and its covariance.
  Drive drive = room_drive(441, 2);
  const auto with = smooth(drive.input, options);
  const Odometry step = drive.input.odometry[0];
  drive.input.odometry.clear();
  const auto without = smooth(drive.input, options);
  const Rigid3 &a = without->poses[0].body_from_world, &b = without->poses[1].body_from_world;
  const Matrix6 carried = adjoint(b * a.inverse());
  const Matrix6 covariance = step.covariance + without->poses[1].covariance +
                             carried * without->poses[0].covariance * carried.transpose();
  const Vector6 off = difference(b * a.inverse(), step.to_from_from);
  const double chi2 = test::nees(off, covariance);
  EXPECT_NEAR(with->links[0].chi2, chi2, 0.01 * chi2);
}

TEST(SmootherFaults, WrongSightingsCountLittle) {
  Drive drive = room_drive(22, 15);
  drive.input.frames[5].sightings[1].px += Eigen::Vector2d(60, 25);
  drive.input.frames[8].sightings[4].px = {3, 470};
  const auto found = smooth(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_sigmas(drive, *found), 6);
  EXPECT_GE(found->sightings.beyond, 2);
  EXPECT_GT(found->residual_sigmas[5][1], 50);
  EXPECT_EQ(contradicted(found->links).size(), 0u);
}

TEST(SmootherFaults, ASightingOutsideTheDomainIsCounted) {
  Drive drive = room_drive(23, 6);
  drive.input.frames[2].sightings[0].point_in_world.z() = -5;  // behind the camera
  const auto found = smooth(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->sightings.outside, 1);
  EXPECT_TRUE(std::isinf(found->residual_sigmas[2][0]));
  EXPECT_LT(worst_sigmas(drive, *found), 6);
}

TEST(SmootherFaults, AFrameWithoutSightingsIsHeldByOdometry) {
  Drive drive = room_drive(24, 9);
  for (const std::size_t k : {3u, 4u, 5u, 8u}) drive.input.frames[k].sightings.clear();
  const auto found = smooth(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_sigmas(drive, *found), 6);
  EXPECT_GT(found->poses[4].covariance.trace(), found->poses[2].covariance.trace());
  EXPECT_GT(found->poses[8].covariance.trace(), found->poses[7].covariance.trace());
}

TEST(SmootherFaults, AGapParts) {
  Drive drive = room_drive(25, 8);
  drive.input.odometry.erase(drive.input.odometry.begin() + 3);
  drive.input.frames[4].sightings.resize(1);
  const auto parts = smooth(drive.input);
  ASSERT_TRUE(parts.ok()) << parts.message;
  EXPECT_FALSE(parts->links[3].odometry);
  EXPECT_LT(worst_sigmas(drive, *parts), 6);
  // The first part is what it is alone.
  SmootherInput first;
  first.frames.assign(drive.input.frames.begin(), drive.input.frames.begin() + 4);
  first.odometry.assign(drive.input.odometry.begin(), drive.input.odometry.begin() + 3);
  const auto alone = smooth(first);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(difference(alone->poses[k].body_from_world, parts->poses[k].body_from_world).norm(),
              1e-9);
  SmootherOptions walking;
  walking.walk_m = walking.walk_rad = 0.5;
  const auto walked = smooth(drive.input, walking);
  EXPECT_LT(walked->poses[4].covariance.trace(), parts->poses[4].covariance.trace());
  EXPECT_LT(worst_sigmas(drive, *walked), 6);
}

TEST(SmootherFaults, SaysWhichPosesAreNotDetermined) {
  Drive drive = room_drive(26, 9);
  drive.input.odometry.erase(drive.input.odometry.begin() + 6);
  drive.input.odometry.erase(drive.input.odometry.begin() + 3);
  drive.input.frames[4].sightings.resize(1);
  drive.input.frames[5].sightings.clear();
  drive.input.frames[6].sightings.resize(1);
  const auto found = smooth(drive.input);
  EXPECT_EQ(found.status, Status::degenerate);
  EXPECT_EQ(found.message.rfind("poses 4 to 6 (0.4 to 0.6 s) not determined", 0), 0u)
      << found.message;
  expect_numbers(*found);
  for (const std::size_t k : {3u, 7u, 8u}) {
    EXPECT_TRUE(found->poses[k].determined);
    EXPECT_LT(position_error_m(found->poses[k].body_from_world, drive.truth[k]), 0.02);
  }
  // Two lamps, however often, leave the turn about the line through them open. A third one ends it,
  // but leaves two poses (P3P).
  const auto seen = room_drive(26, 9).input.frames[5].sightings;
  drive.input.frames[5].sightings = {seen[0], seen[1]};
  EXPECT_EQ(smooth(drive.input).status, Status::degenerate);
  drive.input.frames[5].sightings = {seen[1], seen[2]};
  const auto enough = smooth(drive.input);
  EXPECT_EQ(enough.status, Status::ambiguous) << enough.message;
  EXPECT_EQ(enough.message.find("not determined"), std::string::npos) << enough.message;
  double nearest_m = position_error_m(enough->poses[5].body_from_world, drive.truth[5]);
  for (const auto& other : enough->alternatives)
    nearest_m =
        std::min(nearest_m, position_error_m(other.poses[5].body_from_world, drive.truth[5]));
  EXPECT_LT(nearest_m, 0.1);
}

TEST(SmootherFaults, NothingTellsAnything) {
  SmootherInput input;
  input.frames.resize(3);
  for (int k = 0; k < 3; ++k) input.frames[k].time_s = k;
  const auto found = smooth(input);
  EXPECT_EQ(found.status, Status::too_few_lamps);
  expect_numbers(*found);
}

TEST(SmootherFaults, WheelsThatDoNotSlipSideways) {
  PlanarDrive drive = planar_drive(27, 10);
  for (PlanarOdometry& odometry : drive.input.odometry) {
    const PlanarPose step = arc(0.05, 0.08);
    odometry.increment = step;
    odometry.covariance.setZero();
    odometry.covariance(2, 2) = 1e-6;
  }
  const auto found = smooth_planar(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  for (std::size_t k = 0; k < 10; ++k)
    EXPECT_LT(difference(found->poses[k].pose, drive.truth[k]).norm(), 3e-3);
}

TEST(SmootherFaults, TwoLampsAndAFloorAreEnough) {
  PlanarDrive drive = planar_drive(28, 8);
  for (SmootherFrame& frame : drive.input.frames) frame.sightings.resize(2);
  drive.input.odometry.clear();
  const auto found = smooth_planar(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_LT(difference(found->poses[k].pose, drive.truth[k]).norm(), 0.02);
}

template <class Change>
std::string complaint_of(const Change& change) {
  SmootherInput input = room_drive(29, 4).input;
  SmootherOptions options;
  change(input, options);
  return complaint([&] { smooth(input, options); });
}

using I = SmootherInput;
using O = SmootherOptions;

TEST(SmootherFaults, BadInputIsNamed) {
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.frames[2].time_s = 0.05;
            }).rfind("frames[2].time_s must be no earlier than the one before, got 0.05", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.frames[1].time_s = nan;
            }).rfind("frames[1].time_s must be finite", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.frames[1].sightings[3].px.y() = nan;
            }).rfind("frames[1].sightings[3].px must be finite", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.frames[1].sightings[3].covariance_px2.setZero();
            }).rfind("frames[1].sightings[3].covariance_px2 must be positive definite", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.odometry[1].from_s = 0.05;
            }).rfind("odometry[1].from_s must be no earlier than the end of the one before", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.odometry[1].to_s = 0.1;
            }).rfind("odometry[1].to_s must be finite and after from_s", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.odometry[2].covariance(1, 1) = -1;
            }).rfind("odometry[2].covariance must be positive semi-definite", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.odometry[2].to_from_from.translation[0] = nan;
            }).rfind("odometry[2] must be finite", 0),
            0u);
  EXPECT_EQ(complaint_of([](I& i, O&) {
              i.start.resize(2);
            }).rfind("start must be as long as there are poses, 4, got 2", 0),
            0u);
  EXPECT_NE(complaint_of([](I& i, O&) { i = {}; }), "");
  EXPECT_NE(complaint_of([](I&, O& o) { o.huber_sigmas = nan; }), "");
  EXPECT_NE(complaint_of([](I&, O& o) { o.link_gate = 1; }), "");
  EXPECT_NE(complaint_of([](I&, O& o) { o.walk_m = 0; }), "");
  EXPECT_NE(complaint_of([](I&, O& o) { o.max_iterations = 0; }), "");
  EXPECT_EQ(complaint_of([](I&, O&) {}), "");
}

}  // namespace
}  // namespace occ::test
