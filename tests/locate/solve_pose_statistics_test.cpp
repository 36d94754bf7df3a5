// SPDX-License-Identifier: Apache-2.0
// solve_pose over many noisy problems: errors against the bound, covariances, wrong answers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/refine/bound.hpp"
#include "tests/locate/solve_pose_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
using namespace internal::pose;
namespace {

SolvePoseOptions with_sigma(double sigma_px) {
  SolvePoseOptions options;
  options.sigma_px = sigma_px;
  return options;
}

// A tilted view in which the pose is determined well.
SeenScene good_view(int count, bool flat, const Camera& camera) {
  Random random(61, static_cast<std::uint64_t>(count));
  SeenScene scene;
  scene.camera = camera;
  if (count == 4 && flat)
    scene.points =
        (Eigen::Matrix3Xd(3, 4) << -1, 1, 1, -1, -0.8, -1, 0.9, 1, 0, 0, 0, 0).finished();
  else
    scene.points = random_points(random, count, flat);
  scene.truth.rotation = so3_exp({0.7, 0.3, 0.4});
  scene.truth.translation << 0.2, -0.1, 3;
  EXPECT_TRUE(see(scene));
  return scene;
}

struct Statistics {
  double over_bound = 0;  ///< root mean square of the error in the bound's sigmas, over that of 6
  double nees = 0;        ///< sum of squared errors in the stated sigmas
  double covariance_over_bound = 0;  ///< mean ratio of the position's stated variance
};

Statistics over_images(const SeenScene& scene, double sigma_px, int images) {
  const auto bound = pose_bound(columns_of(scene.points), scene.camera, scene.truth, sigma_px);
  EXPECT_TRUE(bound.ok());
  const double least = bound->position_covariance_m2.trace();
  Statistics s;
  double squared = 0;
  int refused = 0;
  SeenScene noisy = scene;
  Random random(62);
  for (int i = 0; i < images; ++i) {
    noisy.pixels = noisy_pixels(scene, sigma_px, random);
    const Result<Fix> fix =
        solve_pose(noisy.points, noisy.pixels, noisy.camera, with_sigma(sigma_px));
    refused += !fix.ok();
    if (fix->candidates.empty()) continue;
    Candidate by_bound = fix->candidates[0];
    s.nees += squared_error(by_bound, scene);
    by_bound.covariance = bound->covariance;
    squared += squared_error(by_bound, scene);
    s.covariance_over_bound += fix->position_covariance_m2.trace() / least / images;
  }
  EXPECT_LE(refused, 2e-4 * images + 1);  // two degrees of freedom: chi2 > 20 in 1 of 22000
  s.over_bound = std::sqrt(squared / (6.0 * images));
  return s;
}

struct View {
  int count;
  bool flat;
};

void expect_attains_the_bound(const View& view, const Camera& camera, int images, double within) {
  const Statistics s = over_images(good_view(view.count, view.flat, camera), 0.3, images);
  const auto interval = chi2_interval(6.0 * images);
  EXPECT_GT(s.nees, interval.first) << view.count;
  EXPECT_LT(s.nees, interval.second) << view.count;
  EXPECT_NEAR(s.over_bound, 1, within) << view.count;
  EXPECT_NEAR(s.covariance_over_bound, 1, 0.02) << view.count;
}

TEST(SolvePoseStatistics, ErrorsAttainTheBound) {
  for (const View& view : {View{4, true}, View{4, false}, View{6, true}, View{6, false},
                           View{20, false}, View{100, false}})
    expect_attains_the_bound(view, plain_camera(), 2000, 0.025);
  expect_attains_the_bound({20, false}, bent_camera(), 2000, 0.025);
}

TEST(SlowSolvePoseStatistics, ErrorsAttainTheBound) {
  for (const View& view : {View{4, true}, View{6, false}, View{20, false}, View{100, false}})
    expect_attains_the_bound(view, plain_camera(), 20000, 0.01);
}

struct Answers {
  int problems = 0, ok = 0, ambiguous = 0, refused = 0;
  int wrong = 0;    ///< status ok, but the truth far away
  int missing = 0;  ///< status ok or ambiguous, the truth not among the candidates
  int lost = 0;     ///< status ok, though the minimum that the truth leads to is plausible too
};

std::ostream& operator<<(std::ostream& out, const Answers& a) {
  return out << a.problems << " problems: " << a.ok << " ok, of which " << a.wrong << " wrong; "
             << a.ambiguous << " ambiguous; " << a.refused << " refused; truth missing in "
             << a.missing << ", lost " << a.lost;
}

// A squared error of six degrees of freedom; chance exceeds it once in 2e10.
constexpr double too_far = 60;

double chi2_at_truth(const SeenScene& scene, double sigma_px) {
  double chi2 = 0;
  for (Eigen::Index i = 0; i < scene.points.cols(); ++i)
    chi2 += (*scene.camera.project(scene.truth * Eigen::Vector3d(scene.points.col(i))) -
             scene.pixels.col(i))
                .squaredNorm();
  return chi2 / (sigma_px * sigma_px);
}

// True if this candidate is the truth within its errors. Where they are so large that its
// covariance does not hold, whether both lie in one valley: no worse than the truth anywhere
// between them.
bool leads_to(const SeenScene& scene, const Candidate& c, double sigma_px) {
  if (squared_error(c, scene) < too_far) return true;
  const double top = chi2_at_truth(scene, sigma_px) + 9;
  const Eigen::Vector3d centroid = scene.points.rowwise().mean();
  const Eigen::Vector3d turn =
      so3_log(scene.truth.rotation * c.cam_from_world.rotation.transpose());
  SeenScene between = scene;
  const Eigen::Vector3d from = c.cam_from_world * centroid, to = scene.truth * centroid;
  for (int k = 1; k < 20; ++k) {
    const double part = k / 20.0;
    between.truth.rotation = so3_exp(part * turn) * c.cam_from_world.rotation;
    between.truth.translation = from + part * (to - from) - between.truth.rotation * centroid;
    if (chi2_at_truth(between, sigma_px) > top) return false;
  }
  return true;
}

// True if the minimum next to the truth is missing, though a likelihood ratio of less than
// 55 (twice its logarithm is 8) is all that speaks against it. Pinhole only.
bool loses_the_truth(const SeenScene& scene, const Fix& fix, double sigma_px) {
  const Eigen::Vector3d centroid = scene.points.rowwise().mean();
  const Eigen::Matrix3Xd about = scene.points.colwise() - centroid;
  const auto n = static_cast<double>(about.cols());
  const double size = std::sqrt(about.squaredNorm() / n);
  const Eigen::Matrix3d k = scene.camera.matrix();
  SeenPoints seen;
  for (Eigen::Index i = 0; i < about.cols(); ++i) {
    Eigen::Matrix<double, 2, 3> across = k.topRows<2>();
    across.col(2) -= scene.pixels.col(i);
    seen.add(about.col(i) / size, Eigen::Vector3d::UnitZ(), across / sigma_px);
  }
  const Rigid3 truth{scene.truth.rotation, scene.truth * centroid / size};
  const PointFit there = fit_points(seen, truth, 200, 1e-4);
  const double best = fix.candidates[0].chi2, dof = std::max(1.0, 2 * n - 6);
  if (!there.converged || there.equations.chi2 - best > 8 * std::max(1.0, best / dof)) return false;
  SeenScene found = scene;
  found.truth = {there.pose.rotation,
                 size * there.pose.translation - there.pose.rotation * centroid};
  return std::none_of(fix.candidates.begin(), fix.candidates.end(),
                      [&](const Candidate& c) { return squared_error(c, found) < 4; });
}

template <class MakeScene>
Answers answers_to(int problems, double sigma_px, std::uint64_t seed, const MakeScene& make) {
  Answers a;
  a.problems = problems;
  for (int i = 0; i < problems; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    SeenScene scene = make(random);
    scene.pixels = noisy_pixels(scene, sigma_px, random);
    const Result<Fix> fix =
        solve_pose(scene.points, scene.pixels, scene.camera, with_sigma(sigma_px));
    if (!fix.ok() && fix.status != Status::ambiguous) {
      ++a.refused;
      continue;
    }
    bool found = false;
    for (const Candidate& c : fix->candidates) found = found || leads_to(scene, c, sigma_px);
    ++(fix.ok() ? a.ok : a.ambiguous);
    a.wrong += fix.ok() && !found;
    a.missing += !found;
    a.lost += fix.ok() && loses_the_truth(scene, *fix, sigma_px);
  }
  return a;
}

void expect_hardly_ever_wrong(int problems) {
  const double sigma_px = 0.5, tilt = 40 * 3.14159265358979 / 180;
  const Camera camera = plain_camera();
  for (const Answers& a :
       {answers_to(problems, sigma_px, 63, [&](Random& r) { return square_scene(r, tilt); }),
        answers_to(problems, sigma_px, 64,
                   [&](Random& r) { return random_scene(r, 6, false, camera); }),
        answers_to(problems, sigma_px, 65,
                   [&](Random& r) { return random_scene(r, 6, true, camera); }),
        answers_to(problems, sigma_px, 66,
                   [&](Random& r) { return random_scene(r, 20, false, camera); })}) {
    EXPECT_LE(a.wrong, 1e-4 * problems) << a;
    EXPECT_LE(a.missing, 1e-4 * problems) << a;
    EXPECT_EQ(a.lost, 0) << a;
    EXPECT_LE(a.refused, 2e-3 * problems) << a;
  }
}

// Squares so small that the other branch fits as well, and at times better: a likelihood ratio of
// 100 the wrong way is what chance does once in a thousand where it can at all.
void expect_honest_when_small(int problems) {
  const Answers a =
      answers_to(problems, 0.5, 67, [&](Random& r) { return square_scene(r, 0.7, 0.03, 0.15); });
  EXPECT_GT(a.ambiguous, 0.1 * problems);
  EXPECT_EQ(a.lost, 0);
  EXPECT_LE(a.wrong, 5e-4 * problems) << a;
  EXPECT_LE(a.missing, 5e-4 * problems) << a;
  // A tilt by more than a quarter of a radian is open, and only one pose is a minimum.
  EXPECT_LE(a.refused, 0.06 * problems) << a;
}

// Four random points in a plane: the errors of the rotation may reach some degrees, so that the
// camera lies on an arc.
SeenScene plane_scene(Random& random) {
  SeenScene scene = random_scene(random, 4, true, plain_camera(), 3, 8);
  do {
    scene.points.resize(3, 4);
    for (int i = 0; i < 4; ++i)
      scene.points.col(i) << random.uniform(-1, 1), random.uniform(-1, 1), 0;
    scene.truth.rotation = random_rotation(random);
    scene.truth.translation << random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(3, 8);
  } while (std::abs(scene.truth.rotation(2, 2)) < 0.3 || !see(scene));
  return scene;
}

double squared_left_error(const SeenScene& scene, const Candidate& c) {
  const Vector6 error = difference(scene.truth, c.cam_from_world);
  return test::nees(error, c.covariance);
}

void expect_true_covariance_of_four(int problems) {
  const double sigma_px = 0.5;
  int ok = 0, wrong = 0, ambiguous = 0, lost = 0;
  double nees = 0;
  for (int i = 0; i < problems; ++i) {
    Random random(69, static_cast<std::uint64_t>(i));
    SeenScene scene = plane_scene(random);
    scene.pixels = noisy_pixels(scene, sigma_px, random);
    const Result<Fix> fix =
        solve_pose(scene.points, scene.pixels, scene.camera, with_sigma(sigma_px));
    if (!fix.ok() && fix.status != Status::ambiguous) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& c : fix->candidates)
      least = std::min(least, squared_left_error(scene, c));
    ++(fix.ok() ? ok : ambiguous);
    (fix.ok() ? wrong : lost) += least > too_far;
    if (fix.ok()) nees += std::min(least, too_far) / 6;
  }
  EXPECT_LE(wrong, 4e-4 * problems);
  EXPECT_LE(lost, 6e-4 * problems);
  EXPECT_NEAR(nees / ok, 1, 0.08);
  EXPECT_GT(ok, 0.7 * problems);
}

TEST(SolvePoseStatistics, FourPointsInAPlaneAreAsSureAsStated) {
  expect_true_covariance_of_four(10000);
}

TEST(SlowSolvePoseStatistics, FourPointsInAPlaneAreAsSureAsStated) {
  expect_true_covariance_of_four(100000);
}

// Few iterations leave many a second candidate on its way: no answer holds one that is.
// Squares seen from far away, where the second pose of the plane fits nearly as well.
void expect_calibrated_risk(int problems) {
  Random random(63);
  const std::vector<double> limits = {0, 1e-4, 0.01, 0.1, 0.3, 0.51};
  std::vector<double> stated(limits.size()), wrong(limits.size()), count(limits.size());
  for (int i = 0; i < problems; ++i) {
    SeenScene scene;
    scene.points = (Eigen::Matrix3Xd(3, 4) << -1, 1, 1, -1, -1, -1, 1, 1, 0, 0, 0, 0).finished();
    scene.truth.rotation =
        so3_exp(0.35 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    scene.truth.translation << 0, 0, random.uniform(15, 45);
    if (!see(scene)) continue;
    for (double& value : scene.pixels.reshaped()) value += 0.5 * random.normal();
    const Result<Fix> fix = solve_pose(scene.points, scene.pixels, scene.camera, with_sigma(0.5));
    if (fix->candidates.empty() || !fix->risk) continue;
    const auto off = [&](const Candidate& candidate) {
      return (candidate.cam_from_world.rotation - scene.truth.rotation).norm();
    };
    const bool best_is_right = std::none_of(
        fix->candidates.begin(), fix->candidates.end(),
        [&](const Candidate& other) { return off(other) < off(fix->candidates.front()); });
    const auto bin = static_cast<std::size_t>(
        std::upper_bound(limits.begin(), limits.end(), *fix->risk) - limits.begin() - 1);
    stated[bin] += *fix->risk;
    wrong[bin] += !best_is_right;
    ++count[bin];
  }
  EXPECT_EQ(wrong[0], 0);
  for (std::size_t bin = 1; bin + 1 < limits.size(); ++bin) {
    ASSERT_GT(count[bin], 0.02 * problems);
    const double sigma = std::sqrt(stated[bin] + 1);
    EXPECT_LT(wrong[bin], 1.2 * stated[bin] + 3 * sigma) << limits[bin];
    EXPECT_GT(wrong[bin], 0.7 * stated[bin] - 3 * sigma) << limits[bin];
  }
}

TEST(SolvePoseStatistics, RiskIsCalibrated) { expect_calibrated_risk(3000); }

TEST(SlowSolvePoseStatistics, RiskIsCalibrated) { expect_calibrated_risk(100000); }

TEST(SolvePoseStatistics, MaxRiskIsTheSmallestLikelihoodRatioThatCounts) {
  Random random(64);
  SolvePoseOptions options = with_sigma(0.5);
  SeenScene scene;
  scene.points = (Eigen::Matrix3Xd(3, 4) << -1, 1, 1, -1, -1, -1, 1, 1, 0, 0, 0, 0).finished();
  scene.truth.rotation = so3_exp({0.3, 0.2, 0.1});
  scene.truth.translation << 0, 0, 20;
  ASSERT_TRUE(see(scene));
  for (double& value : scene.pixels.reshaped()) value += 0.5 * random.normal();
  options.max_risk = 1e-100;
  const Result<Fix> both = solve_pose(scene.points, scene.pixels, scene.camera, options);
  ASSERT_EQ(both.status, Status::ambiguous);
  ASSERT_EQ(both->candidates.size(), 2u);
  EXPECT_NEAR(*both->risk, *both->candidates[1].probability, 1e-15);
  options.max_risk = std::min(1.0, 2 * *both->risk / (1 - *both->risk));
  const Result<Fix> one = solve_pose(scene.points, scene.pixels, scene.camera, options);
  EXPECT_TRUE(one.ok()) << one.message;
  EXPECT_NEAR(*one->risk, *both->risk, 1e-3 * *both->risk);
  options.max_risk = 0;
  EXPECT_THROW(solve_pose(scene.points, scene.pixels, scene.camera, options),
               std::invalid_argument);
}

TEST(SolvePoseStatistics, CandidatesAreMinima) {
  int stopped = 0, several = 0;
  for (int i = 0; i < 2000; ++i) {
    Random random(68, static_cast<std::uint64_t>(i));
    SeenScene scene = square_scene(random, 0.7, 0.03, 0.15);
    scene.pixels = noisy_pixels(scene, 0.5, random);
    SolvePoseOptions options = with_sigma(0.5);
    options.max_iterations = 20;
    const Result<Fix> fix = solve_pose(scene.points, scene.pixels, scene.camera, options);
    stopped += fix.status == Status::not_converged;
    if (!fix.ok() && fix.status != Status::ambiguous) continue;
    several += fix->candidates.size() > 1;
    for (const Candidate& c : fix->candidates) {
      SolvePoseOptions on = with_sigma(0.5);
      on.start = c.cam_from_world;
      const Result<Fix> further = solve_pose(scene.points, scene.pixels, scene.camera, on);
      EXPECT_NEAR(further->candidates[0].chi2, c.chi2, 0.05 * (1 + c.chi2)) << i;
    }
  }
  EXPECT_GT(stopped, 20);
  EXPECT_GT(several, 500);
}

TEST(SolvePoseStatistics, SmallSquaresAreAmbiguous) { expect_honest_when_small(10000); }

TEST(SlowSolvePoseStatistics, SmallSquaresAreAmbiguous) { expect_honest_when_small(100000); }

TEST(SolvePoseStatistics, WrongAnswersAreRare) { expect_hardly_ever_wrong(10000); }

TEST(SlowSolvePoseStatistics, WrongAnswersAreRare) { expect_hardly_ever_wrong(100000); }

}  // namespace
}  // namespace occ::test
