// SPDX-License-Identifier: Apache-2.0
// robust_pose: the right pose among wrong matches, at the bound; nothing where there is nothing.
#include "libocc/locate/robust_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libocc/geometry/so3.hpp"
#include "libocc/locate/internal/point_problem.hpp"
#include "libocc/pose/internal/consensus_cost.hpp"
#include "libocc/pose/internal/false_alarms.hpp"
#include "libocc/refine/bound.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
using namespace internal::locate;
using namespace internal::pose;
namespace {

constexpr int points = 200;
constexpr double sigma_px = 0.5;

Camera vga() { return Camera::pinhole(640, 480, 800, 800, 319.5, 239.5); }

// The first `wrong` points were matched to pixels anywhere in the image.
struct Matched {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd pixels;
  Camera camera = vga();
  Rigid3 truth;
  int wrong = 0;
};

Matched matched(Random& random, double outlier_ratio, int count = points, Camera camera = vga()) {
  Matched m;
  m.camera = camera;
  m.wrong = static_cast<int>(std::lround(outlier_ratio * count));
  m.truth = random_pose(random);
  m.points.resize(3, count);
  m.pixels.resize(2, count);
  const auto anywhere = [&] {
    return Eigen::Vector2d(random.uniform(0, 640), random.uniform(0, 480));
  };
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel = anywhere();
    m.points.col(i) = m.truth.inverse() * (random.uniform(2, 8) * *camera.unproject(pixel));
    m.pixels.col(i) = pixel + sigma_px * Eigen::Vector2d(random.normal(), random.normal());
    if (i < m.wrong) m.pixels.col(i) = anywhere();
  }
  return m;
}

Result<RobustPose> solved(const Matched& m, RobustPoseOptions options = {}) {
  options.sigma_px = sigma_px;
  return robust_pose(m.points, m.pixels, m.camera, options);
}

Eigen::Vector3d up_of(const Matched& m, Random& random, double sigma_rad) {
  return so3_exp(sigma_rad * random_vector(random)) * m.truth.rotation.col(2);
}

double squared_error(const Matched& m, const Fix& fix, const Matrix6& covariance) {
  const Vector6 error = difference(fix.cam_from_world, m.truth);
  return test::nees(error, covariance);
}

Matrix6 bound_of(const Matched& m) {
  std::vector<Eigen::Vector3d> right;
  for (Eigen::Index i = m.wrong; i < m.points.cols(); ++i) right.push_back(m.points.col(i));
  return pose_bound(right, m.camera, m.truth, sigma_px)->covariance;
}

struct Outcome {
  int found = 0, wrong = 0;
  double squared = 0, nees = 0;
};

Outcome over_trials(double ratio, int trials, bool gravity, const Camera& camera = vga()) {
  constexpr double far_sigmas2 = 60;  // 6 degrees of freedom: 1 in 10^10
  Outcome outcome;
  Random random(71, static_cast<std::uint64_t>(100 * ratio));
  for (int t = 0; t < trials; ++t) {
    const Matched m = matched(random, ratio, points, camera);
    RobustPoseOptions options;
    options.seed = static_cast<std::uint64_t>(t);
    if (gravity) options.up_in_cam = up_of(m, random, options.up_sigma_rad);
    const Result<RobustPose> found = solved(m, options);
    if (!found.ok()) continue;
    const double squared = squared_error(m, found->fix, bound_of(m));
    if (squared > far_sigmas2) {
      ++outcome.wrong;
      continue;
    }
    ++outcome.found;
    outcome.squared += squared;
    outcome.nees += squared_error(m, found->fix, found->fix.covariance);
  }
  return outcome;
}

void expect_at_the_bound(double ratio, int trials, bool gravity, const Camera& camera = vga()) {
  const Outcome outcome = over_trials(ratio, trials, gravity, camera);
  EXPECT_EQ(outcome.wrong, 0) << ratio;
  EXPECT_GE(outcome.found, 0.995 * trials) << ratio;
  const auto interval = chi2_interval(6.0 * outcome.found);
  EXPECT_GT(outcome.nees, interval.first) << ratio;
  EXPECT_LT(outcome.nees, interval.second) << ratio;
  const double over_bound = std::sqrt(outcome.squared / (6.0 * outcome.found));
  EXPECT_LT(over_bound, std::sqrt(interval.second / (6.0 * outcome.found))) << ratio;
}

TEST(RobustPose, AttainsTheBoundAmongWrongMatches) {
  expect_at_the_bound(0.3, 200, false);
  expect_at_the_bound(0.7, 100, false);
}

TEST(RobustPose, AttainsTheBoundThroughALens) {
  const Camera bent = Camera::pinhole(640, 480, 810, 790, 320, 235, {-0.2, 0.05, 1e-3, -1e-3}, 1);
  expect_at_the_bound(0.5, 100, false, bent);
}

TEST(RobustPose, KnownGravityTakesSamplesOfTwo) {
  expect_at_the_bound(0.8, 150, true);
  Random random(3);
  const Matched m = matched(random, 0.8);
  RobustPoseOptions options;
  const int three = solved(m, options)->iterations;
  options.up_in_cam = m.truth.rotation.col(2);
  EXPECT_LT(3 * solved(m, options)->iterations, three);
}

TEST(SlowRobustPose, AttainsTheBoundAtEveryRatio) {
  for (const double ratio : {0.3, 0.5, 0.7, 0.85}) {
    expect_at_the_bound(ratio, 500, false);
    expect_at_the_bound(ratio, 500, true);
  }
}

TEST(RobustPose, SaysWhichMatchesAreRight) {
  Random random(4);
  const Matched m = matched(random, 0.5);
  const Result<RobustPose> found = solved(m);
  ASSERT_TRUE(found.ok()) << found.message;
  int mistaken = 0;
  for (int i = 0; i < points; ++i) mistaken += found->inliers[i] != (i >= m.wrong);
  EXPECT_LE(mistaken, 1);
  EXPECT_NEAR(found->inlier_ratio, 0.5, 0.006);
  EXPECT_LT(found->log10_false_alarms, -100);
  EXPECT_EQ(found->fix.candidates.front().dof, 2 * std::lround(points * found->inlier_ratio) - 6);
}

TEST(RobustPose, NoiseFreePointsGiveTheExactPose) {
  Random random(5);
  Matched m = matched(random, 0.4);
  for (int i = m.wrong; i < points; ++i)
    m.pixels.col(i) = *m.camera.project(m.truth * Eigen::Vector3d(m.points.col(i)));
  const Result<RobustPose> found = solved(m);
  EXPECT_LT(difference(found->fix.cam_from_world, m.truth).norm(), 1e-6);
}

TEST(RobustPose, AnotherWorldFrameTurnsTheAnswer) {
  Random random(6);
  const Matched m = matched(random, 0.5);
  Matched moved = m;
  const Rigid3 world_from_other = random_pose(random, 100);
  for (int i = 0; i < points; ++i)
    moved.points.col(i) = world_from_other.inverse() * Eigen::Vector3d(m.points.col(i));
  moved.truth = m.truth * world_from_other;
  const Rigid3 expected = solved(m)->fix.cam_from_world * world_from_other;
  EXPECT_LT(squared_error({{}, {}, vga(), expected, 0}, solved(moved)->fix, bound_of(moved)), 1e-3);
}

TEST(RobustPose, TheSameSeedGivesTheSameBits) {
  Random random(7);
  const Matched m = matched(random, 0.6);
  const Result<RobustPose> once = solved(m), again = solved(m);
  EXPECT_EQ(once->fix.cam_from_world.matrix(), again->fix.cam_from_world.matrix());
  EXPECT_EQ(once->fix.covariance, again->fix.covariance);
  EXPECT_EQ(once->iterations, again->iterations);
  RobustPoseOptions other;
  other.seed = 1;
  EXPECT_LT(squared_error(m, solved(m, other)->fix, bound_of(m)), 60);
}

// Wrong matches alone, and clusters: pixels are crowded there, and many points share each.
int found_in(int trials, bool clusters, RobustPoseOptions options) {
  int found = 0;
  Random random(clusters ? 9 : 8);
  for (int t = 0; t < trials; ++t) {
    const int count = 20 + random.below(100);
    Matched m = matched(random, 1, count);
    if (clusters) {
      Eigen::Matrix2Xd centres(2, 5);
      for (Eigen::Index i = 0; i < centres.size(); ++i) centres(i) = random.uniform(50, 400);
      Eigen::Matrix3Xd of_world = 2 * Eigen::Matrix3Xd::Random(3, 5);
      for (int i = 0; i < count; ++i) {
        const int cluster = random.below(5);
        m.points.col(i) = of_world.col(cluster) + 0.005 * random_vector(random);
        m.pixels.col(i) =
            centres.col(cluster) + 1.5 * Eigen::Vector2d(random.normal(), random.normal());
      }
    }
    options.seed = static_cast<std::uint64_t>(t);
    if (t % 2 == 1) options.up_in_cam = random_vector(random).normalized();
    found += solved(m, options).ok();
    options.up_in_cam.reset();
  }
  return found;
}

TEST(RobustPose, FindsNothingInWrongMatches) {
  RobustPoseOptions options;
  options.max_iterations = 3000;
  EXPECT_EQ(found_in(200, false, options), 0);
  EXPECT_EQ(found_in(50, true, options), 0);
}

TEST(SlowRobustPose, FindsNothingInWrongMatches) {
  RobustPoseOptions options;
  options.max_iterations = 20000;
  EXPECT_EQ(found_in(2000, false, options), 0);
  EXPECT_EQ(found_in(200, true, options), 0);
}

TEST(RobustPose, RefusesWhatDeterminesNothing) {
  Random random(10);
  Matched m = matched(random, 0, 3);
  EXPECT_EQ(solved(m).status, Status::too_few_lamps);
  EXPECT_FALSE(solved(m)->fix.covariance.allFinite());
  m = matched(random, 0.5);
  m.points.colwise() = Eigen::Vector3d(1, 2, 3);
  EXPECT_EQ(solved(m).status, Status::degenerate);
  for (int i = 0; i < points; ++i) m.points.col(i) = Eigen::Vector3d(1, 2, 3) * i;
  EXPECT_EQ(solved(m).status, Status::degenerate);
  m.points.resize(3, 0);
  m.pixels.resize(2, 0);
  EXPECT_EQ(solved(m).status, Status::too_few_lamps);
}

TEST(RobustPose, RightMatchesOnALineAreDegenerate) {
  Random random(11);
  Matched m = matched(random, 0.5);
  for (int i = m.wrong; i < points; ++i) {
    m.points.col(i) = m.truth.inverse() * Eigen::Vector3d(0.01 * (i - 150), 0.1, 4);
    m.pixels.col(i) = *m.camera.project(m.truth * Eigen::Vector3d(m.points.col(i)));
  }
  EXPECT_NE(solved(m).status, Status::ok);
}

TEST(RobustPose, RefusesAPoseThatContradictsGravity) {
  Random random(12);
  const Matched m = matched(random, 0.1);
  RobustPoseOptions options;
  options.up_in_cam = so3_exp({0.08, 0, 0}) * m.truth.rotation.col(2);
  const Result<RobustPose> found = solved(m, options);
  EXPECT_EQ(found.status, Status::no_pose);
  EXPECT_NE(found.message.find("contradicts up_in_cam"), std::string::npos) << found.message;
}

// A grid of 95 points on 44 x 40 pixels. A gate of 8 pixels contains a tenth of that area, but the
// residuals are far smaller than the gate.
Matched small_target(double noise_px, Random& random) {
  Matched m;
  m.truth = {so3_exp({0.5, -0.4, 0.3}), {0.05, -0.03, 9}};
  m.points.resize(3, 95);
  m.pixels.resize(2, 95);
  for (int i = 0; i < 95; ++i) {
    m.points.col(i) << 0.055 * (i % 10 - 4.5), 0.055 * (i / 10 - 4.5), 0.1 * (i % 3);
    m.pixels.col(i) = *m.camera.project(m.truth * Eigen::Vector3d(m.points.col(i))) +
                      noise_px * Eigen::Vector2d(random.normal(), random.normal());
  }
  return m;
}

TEST(RobustPose, ResidualsCountInsteadOfTheGateOnASmallTarget) {
  Random random(16);
  for (const double noise_px : {3e-5, 0.1}) {
    const Matched m = small_target(noise_px, random);
    for (const double sigma_px : {0.5, 1.0, 1.5, 2.0, 4.0}) {
      RobustPoseOptions options;
      options.sigma_px = sigma_px;
      const Result<RobustPose> found = robust_pose(m.points, m.pixels, m.camera, options);
      EXPECT_TRUE(found.ok() || found.status == Status::ambiguous)
          << sigma_px << " " << found.message;
      EXPECT_EQ(found->inlier_ratio, 1) << sigma_px;
      EXPECT_LT(found->log10_false_alarms, -70) << sigma_px;
    }
  }
}

TEST(RobustPose, ASmallTargetOfWrongMatchesIsStillRefused) {
  Random random(17);
  for (int trial = 0; trial < 20; ++trial) {
    Matched m = small_target(0, random);
    for (int i = 0; i < 95; ++i)
      m.pixels.col(i) = Eigen::Vector2d(random.uniform(300, 344), random.uniform(220, 260));
    for (const double sigma_px : {0.5, 2.0}) {
      RobustPoseOptions options;
      options.sigma_px = sigma_px;
      options.max_iterations = 3000;
      EXPECT_FALSE(robust_pose(m.points, m.pixels, m.camera, options).ok()) << sigma_px;
    }
  }
}

// The first `moved` points are seen from a second pose.
Matched two_poses(Random& random, int moved, int anywhere, int count) {
  Matched m = matched(random, 0, count);
  const Rigid3 second =
      perturb(m.truth, (Vector6() << 0.1, -0.05, 0.08, 0.2, -0.1, 0.3).finished());
  for (int i = 0; i < moved; ++i)
    m.pixels.col(i) = *m.camera.project(second * Eigen::Vector3d(m.points.col(i))) +
                      sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  for (int i = moved; i < moved + anywhere; ++i)
    m.pixels.col(i) << random.uniform(0, 640), random.uniform(0, 480);
  return m;
}

bool is_among(const Rigid3& pose, const Fix& fix) {
  for (const Candidate& c : fix.candidates) {
    const Vector6 error = difference(c.cam_from_world, pose);
    if (test::nees(error, c.covariance) < 60) return true;
  }
  return false;
}

TEST(RobustPose, TwoPosesWithAsManyInliersAreAmbiguous) {
  Random random(18);
  for (int trial = 0; trial < 30; ++trial) {
    const Matched m = two_poses(random, 40, 60, 140);
    const Rigid3 second =
        perturb(m.truth, (Vector6() << 0.1, -0.05, 0.08, 0.2, -0.1, 0.3).finished());
    RobustPoseOptions options;
    options.seed = static_cast<std::uint64_t>(trial);
    const Result<RobustPose> found = solved(m, options);
    EXPECT_EQ(found.status, Status::ambiguous) << trial << " " << found.message;
    EXPECT_TRUE(is_among(m.truth, found->fix)) << trial;
    EXPECT_TRUE(is_among(second, found->fix)) << trial;
    double sum = 0;
    for (const Candidate& candidate : found->fix.candidates) sum += *candidate.probability;
    EXPECT_NEAR(sum, 1, 1e-9);
    EXPECT_GT(*found->fix.risk, 0.1) << trial;
    EXPECT_LT(*found->fix.risk, 0.9) << trial;
  }
}

// 14 of 80 points on a plane agree with one pose and 14 others with a second one near it. A pose
// between the two has a few inliers of both.
TEST(RobustPose, APoseBetweenTwoDoesNotHideThem) {
  constexpr int count = 80, each = 14;
  Random random(31);
  int hidden = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Matched m = matched(random, 0, count);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d ray =
          m.truth.inverse().rotation * Eigen::Vector3d(*m.camera.unproject(Eigen::Vector2d(
                                           random.uniform(0, 640), random.uniform(0, 480))));
      const Eigen::Vector3d from = m.truth.origin_in_source();
      const Eigen::Vector3d normal = m.truth.inverse().rotation * Eigen::Vector3d(0.3, 0.1, 1);
      m.points.col(i) = from + 4 * normal.squaredNorm() / normal.dot(ray) * ray;
    }
    const Rigid3 second = perturb(
        m.truth,
        0.03 * (Vector6() << random_vector(random), random_vector(random)).finished().normalized());
    for (int i = 0; i < count; ++i) {
      const Rigid3& pose = i < each ? m.truth : second;
      const auto px = m.camera.project(pose * Eigen::Vector3d(m.points.col(i)));
      if (i < 2 * each && px)
        m.pixels.col(i) = *px + sigma_px * Eigen::Vector2d(random.normal(), random.normal());
      else
        m.pixels.col(i) << random.uniform(0, 640), random.uniform(0, 480);
    }
    RobustPoseOptions options;
    options.seed = static_cast<std::uint64_t>(trial);
    options.max_iterations = 20000;
    const Result<RobustPose> found = solved(m, options);
    hidden += std::count(found->inliers.begin(), found->inliers.end(), true) < each - 2;
  }
  EXPECT_EQ(hidden, 0);
}

TEST(RobustPose, APoseWithFewInliersIsNoRival) {
  Random random(19);
  for (int trial = 0; trial < 30; ++trial) {
    const Matched m = two_poses(random, 20, 60, 140);
    const Result<RobustPose> found = solved(m);
    EXPECT_TRUE(found.ok()) << trial << " " << found.message;
    EXPECT_TRUE(is_among(m.truth, found->fix)) << trial;
  }
}

TEST(RobustPose, SaysWhenItStoppedBeforeItsConfidence) {
  Random random(13);
  const Matched m = matched(random, 0.3);
  RobustPoseOptions options;
  options.max_iterations = 10;
  const Result<RobustPose> found = solved(m, options);
  ASSERT_TRUE(found.ok());
  EXPECT_NE(found.message.find("max_iterations = 10"), std::string::npos) << found.message;
}

TEST(RobustPose, TellsTheCallersMistakes) {
  Random random(14);
  Matched m = matched(random, 0.3);
  const auto complaint_of = [&](RobustPoseOptions options) {
    return complaint([&] { robust_pose(m.points, m.pixels, m.camera, options); });
  };
  RobustPoseOptions options;
  options.confidence = 1;
  EXPECT_NE(complaint_of(options).find("confidence"), std::string::npos);
  options = {};
  options.sigma_px = -1;
  EXPECT_NE(complaint_of(options).find("sigma_px must be positive, got -1"), std::string::npos);
  options = {};
  options.up_in_cam = Eigen::Vector3d(0, 0, 2);
  EXPECT_NE(complaint_of(options).find("up_in_cam"), std::string::npos);
  m.pixels(0, 7) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint_of({}).find("points_px[7]"), std::string::npos);
  m.pixels.resize(2, 3);
  EXPECT_NE(complaint_of({}).find("points_px"), std::string::npos);
}

TEST(ConsensusCost, HasTheSameBitsWithEveryInstructionSetAndTheValueOfItsFormula) {
  Random random(15);
  const Matched m = matched(random, 0.3, 77);
  const PointProblem p =
      make_point_problem(m.points, m.pixels, m.camera, Eigen::VectorXd::Constant(1, sigma_px));
  const Rigid3 near = perturb(m.truth, 1e-3 * Vector6::Ones());
  const Rigid3 pose = p.frame.normalised(near);
  const float bar = 1000, cost = ConsensusCost(p.seen, p.bearings, 12, Simd::baseline)(pose, bar);
  if (widest_simd() != Simd::baseline) {
    EXPECT_EQ(ConsensusCost(p.seen, p.bearings, 12, Simd::avx2)(pose, bar), cost);
  }
  EXPECT_EQ(ConsensusCost(p.seen, p.bearings, 12)(pose, bar), cost);
  double expected = 0;
  for (int i = 0; i < 77; ++i) {
    const auto pixel = m.camera.project(near * Eigen::Vector3d(m.points.col(i)));
    const double limit2 = 144 * sigma_px * sigma_px;
    expected += pixel ? std::min(1.0, (*pixel - m.pixels.col(i)).squaredNorm() / limit2) : 1;
  }
  EXPECT_NEAR(cost, expected, 1e-3 * expected);
  EXPECT_GT(ConsensusCost(p.seen, p.bearings, 12)(pose, cost / 2), cost / 2);  // given up
}

TEST(Chance, LeastAgreementIsTheFirstThatIsRareEnough) {
  for (const int n : {5, 20, 200, 5000}) {
    const FalseAlarmModel c{n, 3, 4, 4e-5};
    const int least = min_inliers(c, 1e-4);
    EXPECT_LE(log_false_alarms(c, least), std::log(1e-4) + 1e-9) << n;
    EXPECT_GT(log_false_alarms(c, least - 1), std::log(1e-4)) << n;
  }
  EXPECT_EQ(min_inliers({200, 3, 4, 1}, 1e-4), 201);
  // C(6, 5) C(5, 3) = 60 ways, 3 * 4 poses.
  EXPECT_NEAR(std::exp(log_false_alarms({6, 3, 4, 0.01}, 5)), 12 * 60 * 1e-4, 1e-12);
}

}  // namespace
}  // namespace occ::test
