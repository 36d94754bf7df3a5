// SPDX-License-Identifier: Apache-2.0
// One lamp that is neither round nor an ellipse determines the pose, but for mirror poses and for
// turns that map it to itself: all of them are listed, and the right one is among them.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

struct Case {
  std::string name;
  Lamp lamp;
  int min_poses, max_poses;
};

Lamp polygon(const std::vector<Eigen::Vector2d>& corners_m) {
  Lamp lamp;
  lamp.shape = LampShape::polygon;
  lamp.corners_m = corners_m;
  return lamp;
}

Lamp with_size(LampShape shape, double exponent = 2) {
  Lamp lamp;
  lamp.shape = shape;
  lamp.size_m = {0.6, 0.4};
  lamp.exponent = exponent;
  return lamp;
}

std::vector<Case> cases() {
  return {
      {"rectangle", with_size(LampShape::rectangle), 2, 4},
      {"triangle", polygon({{0, 0}, {0.6, 0.1}, {0.15, 0.6}}), 2, 8},
      {"trapezium", polygon({{0.3, -0.15}, {0.1, 0.2}, {-0.1, 0.2}, {-0.3, -0.15}}), 1, 2},
      {"hexagon",
       polygon({{0.3, 0}, {0.15, 0.26}, {-0.15, 0.26}, {-0.3, 0}, {-0.15, -0.26}, {0.15, -0.26}}),
       6, 12},
      {"L", polygon({{0, 0}, {0.6, 0}, {0.6, 0.25}, {0.25, 0.25}, {0.25, 0.5}, {0, 0.5}}), 1, 2},
      {"Lame curve", with_size(LampShape::lame, 4), 2, 4},
      {"star", with_size(LampShape::lame, 1.3), 2, 8}};
}

TEST(OneLamp, AllPosesThatItsOutlineAllowsAreListed) {
  for (Case& c : cases()) {
    SCOPED_TRACE(c.name);
    Scene scene;
    scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
    scene.sensor.exposure_s = 5e-5;
    c.lamp.centre_m = {0, 0, 3};
    c.lamp.x_axis = {std::cos(0.3), std::sin(0.3), 0};
    c.lamp.power_w = 6;
    scene.lamps = {c.lamp};
    scene.validate();
    Random random(7);
    constexpr int views = 12;
    double nees = 0;
    for (int i = 0; i < views; ++i) {
      const double turn = random.uniform(0, 2 * pi);
      const Eigen::Vector3d at(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8),
                               random.uniform(0.3, 0.8));
      const Rigid3 pose = look_at(at, {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 2.9},
                                  {std::cos(turn), std::sin(turn), 0});
      SimulateOptions options;
      options.seed = static_cast<std::uint64_t>(i);
      const Image image = simulate(scene, pose, options).image;
      const Result<Fix> fix = locate(image.view(), scene);
      ASSERT_FALSE(fix->candidates.empty()) << i << ": " << fix.message;
      EXPECT_GE(static_cast<int>(fix->candidates.size()), c.min_poses);
      EXPECT_LE(static_cast<int>(fix->candidates.size()), c.max_poses);
      double nearest = infinity;
      for (const Candidate& candidate : fix->candidates) {
        const Eigen::Matrix3d covariance =
            position_covariance(candidate.cam_from_world, candidate.covariance);
        const Eigen::Vector3d off = candidate.position_m - at;
        nearest = std::min(nearest, off.dot(covariance.inverse() * off) / 3);
      }
      EXPECT_LT(nearest, 5.4) << i;  // chi-square of three coordinates, one in a thousand
      nees += nearest / views;
      if (fix.ok()) {
        EXPECT_LT((fix->position_m - at).norm(), 0.02) << i;
      }
    }
    EXPECT_LT(nees, test::chi2_interval(3.0 * views).second / (3 * views));
    EXPECT_GT(nees, 0.3);
  }
}

/// A camera below a room of discs, of which the picture shows two, or one.
struct FewDiscs {
  Scene scene;
  Rigid3 pose;
  Image image;
};

/// `strangers`: round lights that are not on the map.
FewDiscs few_discs(Random& random, std::size_t seen, int strangers) {
  while (true) {
    FewDiscs out;
    out.scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
    out.scene.sensor.exposure_s = 1e-5;
    const int count = 2 + static_cast<int>(random.below(6));
    for (int i = 0; i < count + strangers; ++i) {
      Lamp lamp;
      lamp.id = i;
      lamp.centre_m = {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(2.6, 3.2)};
      lamp.radius_m = 0.12;
      out.scene.lamps.push_back(lamp);
    }
    out.scene.validate();
    const double turn = random.uniform(0, 2 * pi);
    out.pose = look_at({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, 0.8)},
                       {random.uniform(-1, 1), random.uniform(-1, 1), 3},
                       {std::cos(turn), std::sin(turn), 0});
    SimulateOptions options;
    options.seed = random.below(1000);
    Rendered rendered = simulate(out.scene, out.pose, options);
    std::size_t known = 0, others = 0;
    for (const LampTruth& lamp : rendered.lamps)
      if (lamp.in_view) ++(lamp.id < count ? known : others);
    if (known != seen || others != static_cast<std::size_t>(strangers)) continue;
    out.image = std::move(rendered.image);
    out.scene.lamps.resize(static_cast<std::size_t>(count));
    return out;
  }
}

struct Verdicts {
  int ok = 0, wrong = 0, ambiguous = 0, lost = 0;
};

Verdicts verdicts(int views, std::size_t seen, int strangers, bool with_prior) {
  Random random(11);
  Verdicts v;
  for (int i = 0; i < views; ++i) {
    const FewDiscs few = few_discs(random, seen, strangers);
    const Eigen::Vector3d at = few.pose.origin_in_source();
    LocateOptions options;
    if (with_prior) {
      constexpr double sigma_m = 0.01;
      Prior prior;
      prior.position_m = at + sigma_m * random_vector(random);
      prior.position_sigma_m = sigma_m;
      prior.gravity_in_cam = few.pose.rotation * -Eigen::Vector3d::UnitZ();
      prior.heading_rad = heading_rad(few.pose);
      prior.heading_sigma_rad = 0.05;
      options.prior = prior;
    }
    const Result<Fix> fix = locate(few.image.view(), few.scene, options);
    const auto is_right = [&](const Candidate& candidate) {
      const Eigen::Vector3d off = candidate.position_m - at;
      return off.dot(position_covariance(candidate.cam_from_world, candidate.covariance).inverse() *
                     off) < 25;
    };
    const bool is_listed = std::any_of(fix->candidates.begin(), fix->candidates.end(), is_right);
    if (fix.ok()) {
      ++v.ok;
      v.wrong += !is_right(fix->candidates.front());
    } else if (fix.status == Status::ambiguous) {
      ++v.ambiguous;
      v.lost += !is_listed;
    }
  }
  return v;
}

void expect_honest(int views) {
  for (const std::size_t seen : {1u, 2u})
    for (const int strangers : {0, 1})
      for (const bool with_prior : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << seen << " seen, " << strangers << " strangers, prior " << with_prior);
        const Verdicts v = verdicts(views, seen, strangers, with_prior);
        // One stranger in a thousand looks like a lamp of the map even where a prior is.
        EXPECT_LE(v.wrong, strangers * views / 500);
        // A stranger and a lamp may look like two lamps of the map.
        if (strangers == 0) {
          EXPECT_EQ(v.lost, 0);
          EXPECT_GE(v.ok + v.ambiguous, seen == 2 || with_prior ? 0.7 * views : 0);
        }
        if (seen == 2 && with_prior) {
          EXPECT_GT(v.ok, views / 2);
        }
      }
}

// Without a prior, another round light on the ceiling looks the same.
TEST(OneLamp, FewDiscsAreNotSilentlyWrong) { expect_honest(60); }
TEST(SlowOneLamp, FewDiscsAreNotSilentlyWrong) { expect_honest(1000); }

// Its outline is the same after any turn.
TEST(OneLamp, ADiscDoesNotDetermineThePose) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  scene.sensor.exposure_s = 5e-5;
  Lamp lamp;
  lamp.centre_m = {0, 0, 3};
  lamp.radius_m = 0.25;
  lamp.power_w = 6;
  scene.lamps = {lamp};
  const Rigid3 pose = look_at({0.4, 0.2, 0.5}, {0, 0, 3}, Eigen::Vector3d::UnitY());
  EXPECT_EQ(locate(simulate(scene, pose).image.view(), scene).status, Status::too_few_lamps);
  scene.lamps[0].shape = LampShape::lame;  // an ellipse, of which all are equal in pictures
  scene.lamps[0].size_m = {0.5, 0.5};
  EXPECT_EQ(locate(simulate(scene, pose).image.view(), scene).status, Status::too_few_lamps);
}

// All poses of the circle show the same disc, and the true pose is among them.
TEST(OneLamp, ADiscAllowsACircleOfPoses) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  scene.sensor.exposure_s = 5e-5;
  Lamp lamp;
  lamp.id = 4;
  lamp.centre_m = {0.3, -0.2, 3};
  lamp.radius_m = 0.25;
  lamp.power_w = 6;
  lamp.validate();
  scene.lamps = {lamp};
  double chi2 = 0;
  int views = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Random random(31, seed);
    const Eigen::Vector3d place(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, 1));
    const double turn = random.uniform(0, 2 * pi);
    const Rigid3 pose = look_at(place, lamp.centre_m, {std::cos(turn), std::sin(turn), 0});
    SimulateOptions options;
    options.seed = seed;
    const auto fix = locate(simulate(scene, pose, options).image.view(), scene);
    EXPECT_EQ(fix.status, Status::too_few_lamps);
    ASSERT_GE(fix->circles.size(), 1u) << fix.message;
    EXPECT_LE(fix->circles.size(), 2u);
    EXPECT_NE(fix.message.find("if it is lamp 4"), std::string::npos) << fix.message;
    double best = infinity;
    for (const PoseCircle& circle : fix->circles) {
      const double height = lamp.centre_m.z() - place.z();
      const double radius = (place - lamp.centre_m).head<2>().norm();
      EXPECT_LT((circle.at(0).origin_in_source() - circle.cam_from_world.origin_in_source()).norm(),
                1e-12);
      for (const double angle : {0.5, 2.0, 4.0}) {
        const Eigen::Vector3d at = circle.at(angle).origin_in_source();
        EXPECT_NEAR((at - circle.centre_m).norm(), circle.radius_m, 1e-9);
        EXPECT_NEAR((at - circle.centre_m).dot(circle.axis), 0, 1e-9);
        EXPECT_LT((circle.at(angle) * lamp.centre_m - circle.at(0) * lamp.centre_m).norm(), 1e-9);
      }
      // The turn that brings the camera nearest to the truth, and the error there.
      const Eigen::Vector3d from = circle.at(0).origin_in_source() - circle.centre_m;
      const Eigen::Vector3d to = place - circle.centre_m;
      const double angle = std::atan2(circle.axis.dot(from.cross(to)),
                                      from.dot(to) - from.dot(circle.axis) * to.dot(circle.axis));
      const Vector6 error = difference(pose, circle.at(angle));
      best = std::min(best, error.dot(circle.information * error));
      if (std::abs(circle.radius_m - radius) < 5 * circle.radius_sigma_m) {
        EXPECT_LT(std::abs(circle.height_m - height), 5 * circle.height_sigma_m);
      }
    }
    chi2 += best;
    ++views;
  }
  EXPECT_GT(chi2 / views / 5, 0.5);
  EXPECT_LT(chi2 / views / 5, 1.6);
  // A prior of the height that contradicts it leaves none; one that knows the turn selects a pose.
  const Rigid3 pose = look_at({0.9, 0.2, 0.5}, lamp.centre_m, Eigen::Vector3d::UnitY());
  const Image image = simulate(scene, pose).image;
  LocateOptions wrong;
  wrong.prior.emplace().height_m = 2;
  EXPECT_TRUE(locate(image.view(), scene, wrong)->circles.empty());
}

}  // namespace
