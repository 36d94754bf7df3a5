// SPDX-License-Identifier: Apache-2.0
// Accuracy gain of smoothing on the published set of four lamps, and consistency of its
// covariances.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "libocc/locate/solve_pose.hpp"
#include "libocc/smooth/consistency.hpp"
#include "libocc/smooth/window_smoother.hpp"
#include "tests/smooth/smoother_support.hpp"

namespace occ::test {
namespace {

struct Errors {
  double mean_m = 0;
  Eigen::MatrixXd nees;
  Eigen::MatrixXi dof;

  Errors(int runs, int poses)
      : nees(Eigen::MatrixXd::Zero(runs, poses)), dof(Eigen::MatrixXi::Constant(runs, poses, 6)) {}

  void add(int run, int k, const Rigid3& found, const Matrix6& covariance, const Rigid3& truth) {
    mean_m += position_error_m(found, truth) / static_cast<double>(nees.size());
    nees(run, k) = normalised_squared_error(difference(truth, found), covariance);
  }
};

struct Gain {
  Errors single, window, batch;

  explicit Gain(int runs, int poses)
      : single(runs, poses), window(runs, poses), batch(runs, poses) {
    for (int run = 0; run < runs; ++run) {
      const Drive drive = published_drive(static_cast<std::uint64_t>(run), poses);
      alone(run, drive);
      windowed(run, drive);
      const auto all = smooth(drive.input);
      EXPECT_TRUE(all.ok()) << run << ": " << all.message;
      for (int k = 0; k < poses; ++k) {
        const auto i = static_cast<std::size_t>(k);
        batch.add(run, k, all->poses[i].body_from_world, all->poses[i].covariance, drive.truth[i]);
      }
    }
  }

 private:
  void alone(int run, const Drive& drive) {
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      const SmootherFrame& frame = drive.input.frames[k];
      Eigen::Matrix3Xd points(3, 4);
      Eigen::Matrix2Xd px(2, 4);
      for (int i = 0; i < 4; ++i) {
        points.col(i) = frame.sightings[i].point_in_world;
        px.col(i) = frame.sightings[i].px;
      }
      SolvePoseOptions options;
      options.sigma_px = 2;
      const auto fix = solve_pose(points, px, frame.camera, options);
      single.add(run, static_cast<int>(k), fix->cam_from_world, fix->covariance, drive.truth[k]);
    }
  }

  void windowed(int run, const Drive& drive) {
    WindowSmoother smoother;
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      if (k > 0) smoother.add_odometry(drive.input.odometry[k - 1]);
      const auto now = smoother.add_frame(drive.input.frames[k]);
      EXPECT_TRUE(now.ok()) << run << ", " << k << ": " << now.message;
      window.add(run, static_cast<int>(k), now->newest.body_from_world, now->newest.covariance,
                 drive.truth[k]);
    }
  }
};

void expect_consistent(const char* name, const Errors& errors) {
  const ConsistencyReport report = nees(errors.nees, errors.dof);
  ::testing::Test::RecordProperty(std::string(name) + "_nees", std::to_string(report.mean));
  std::printf("%s: %.4f dm, NEES/dof %.4f in [%.4f, %.4f] (nu %.0f), inside at %.1f %% of times\n",
              name, 10 * errors.mean_m, report.mean, report.low, report.high, report.effective_dof,
              100 * report.share_inside);
  EXPECT_EQ(report.verdict, Consistency::consistent) << name << " " << report.mean;
  EXPECT_GE(report.share_inside, 0.85) << name;
}

TEST(SmoothingGain, OnThePublishedSet) {
  const Gain gain(4, 80);
  EXPECT_LT(gain.window.mean_m, 0.78 * gain.single.mean_m);
  EXPECT_LT(gain.batch.mean_m, 0.62 * gain.single.mean_m);
}

// Published: 0.671 dm alone, 0.524 dm by a window of ten; 0.506 dm most likely alone, 0.269 dm by
// a batch.
TEST(SlowSmoothingGain, OnThePublishedSetOver100Runs) {
  const Gain gain(100, 80);
  EXPECT_LE(gain.window.mean_m, 0.70 * gain.single.mean_m);
  EXPECT_LE(gain.batch.mean_m, 0.55 * gain.single.mean_m);
  EXPECT_LT(gain.single.mean_m, 0.0506);
  EXPECT_LT(gain.window.mean_m, 0.0524);
  EXPECT_LT(gain.batch.mean_m, 0.0269);
  std::printf("single: %.4f dm\n", 10 * gain.single.mean_m);
  expect_consistent("window", gain.window);
  expect_consistent("batch", gain.batch);
}

}  // namespace
}  // namespace occ::test
