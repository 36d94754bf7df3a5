// SPDX-License-Identifier: Apache-2.0
// Drives with several minima: frames of three lamps have up to four poses. An answer that is ok is
// the minimum near the truth, and correct odometry is not contradicted.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "libocc/smooth/window_smoother.hpp"
#include "tests/smooth/few_lamps_drive.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

/// True if a pose is far from the truth, in metres and in its own sigmas. A wrong minimum is off by
/// thousands; errors beyond first order reach about 80.
bool is_wrong(const Rigid3& truth, const SmoothedPose& found) {
  constexpr double max_m = 0.1, max_nees = 200;
  const Vector6 error = difference(truth, found.body_from_world);
  return found.determined && position_error_m(truth, found.body_from_world) > max_m &&
         test::nees(error, found.covariance) > max_nees;
}

int contradicted(const Smoothing<SmoothedPose>& found) {
  return static_cast<int>(
      std::count_if(found.links.begin(), found.links.end(),
                    [](const OdometryLink& link) { return link.contradicted; }));
}

bool is_wrong(const Drive& drive, const std::vector<SmoothedPose>& poses) {
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    if (is_wrong(drive.truth[k], poses[k])) return true;
  return false;
}

struct Count {
  int ok = 0, wrong = 0, contradicted = 0, all = 0;
  int curved = 0;  ///< the right minimum, whose covariance is too small: exact to first order only
};

/// True if the minimisation from the truth finds a lower chi2.
bool has_lower_minimum(const Drive& drive, double chi2) {
  SmootherInput input = drive.input;
  input.start = drive.truth;
  return smooth(input)->chi2 < chi2 - 0.1;
}

/// Batches of drives with these numbers.
template <class Seeds>
Count batches(const Seeds& seeds) {
  Count count;
  FewLampsOptions options;
  options.frames = 60;
  for (const std::uint64_t seed : seeds) {
    const Drive drive = few_lamps_drive(seed, options);
    const auto found = smooth(drive.input);
    ++count.all;
    if (!found.ok()) continue;
    ++count.ok;
    count.contradicted += contradicted(*found) > 0;
    if (!is_wrong(drive, found->poses)) continue;
    const bool wrong = has_lower_minimum(drive, found->chi2);
    count.wrong += wrong;
    count.curved += !wrong;
  }
  return count;
}

/// All frames of windows over drives with these numbers.
template <class Seeds>
Count windows(const Seeds& seeds) {
  Count count;
  for (const std::uint64_t seed : seeds) {
    const Drive drive = few_lamps_drive(seed);
    WindowSmoother window;
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      if (k > 0) window.add_odometry(drive.input.odometry[k - 1]);
      const auto now = window.add_frame(drive.input.frames[k]);
      ++count.all;
      if (!now.ok()) continue;
      ++count.ok;
      count.wrong += is_wrong(drive.truth[k], now->newest);
      count.contradicted += contradicted(now->window) > 0;
    }
  }
  return count;
}

std::vector<std::uint64_t> numbers(std::uint64_t from, std::uint64_t to) {
  std::vector<std::uint64_t> out;
  for (; from < to; ++from) out.push_back(from);
  return out;
}

// Each frame started from its own most likely pose ends in a wrong minimum of these drives.
TEST(SmootherBranches, FindsTheMinimumOfDrivesWithFewLamps) {
  const Count count = batches(std::vector<std::uint64_t>{27, 28, 44, 48});
  EXPECT_EQ(count.ok, 4);
  EXPECT_EQ(count.wrong, 0);
  EXPECT_EQ(count.contradicted, 0);
}

TEST(SmootherBranches, AWindowThatIsOkIsRight) {
  const Count count = windows(std::vector<std::uint64_t>{0, 21, 27, 32, 42, 44});
  EXPECT_GT(count.ok, count.all / 2);
  EXPECT_EQ(count.wrong, 0);
  EXPECT_LE(count.contradicted, 1);
}

TEST(SmootherBranches, ThreeLampsAloneAreAmbiguous) {
  int ambiguous = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    FewLampsOptions options;
    options.frames = 1;
    options.max_lamps = 3;
    options.cut_until = 1;
    const Drive drive = few_lamps_drive(seed, options);
    if (drive.input.frames[0].sightings.size() < 3) continue;
    const auto found = smooth(drive.input);
    if (found.ok()) {
      EXPECT_FALSE(is_wrong(drive, found->poses)) << seed;
      EXPECT_TRUE(found->alternatives.empty());
    }
    if (found.status != Status::ambiguous) continue;
    ++ambiguous;
    EXPECT_GT(found->risk, 1e-4);
    EXPECT_NE(found.message.find("another trajectory"), std::string::npos) << found.message;
    ASSERT_FALSE(found->alternatives.empty());
    bool holds_truth = !is_wrong(drive, found->poses);
    for (const auto& other : found->alternatives) {
      EXPECT_EQ(other.poses.size(), 1u);
      EXPECT_GT(other.likelihood_ratio, 0);
      EXPECT_LE(other.likelihood_ratio, 1);
      holds_truth = holds_truth || !is_wrong(drive, other.poses);
    }
    EXPECT_TRUE(holds_truth) << seed;
  }
  EXPECT_GT(ambiguous, 8);
}

/// Three lamps in the first frames leave several poses; then all lamps are seen.
TEST(SmootherBranches, LaterFramesDecideAWindowThatIsAmbiguous) {
  int ambiguous = 0, decided = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    FewLampsOptions options;
    options.frames = 30;
    options.first_cut = 30;
    options.max_lamps = 3;
    options.cut_until = 3;
    const Drive drive = few_lamps_drive(seed, options);
    WindowSmoother window;
    bool open = false;
    WindowSmoother::Estimate now;
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      if (k > 0) window.add_odometry(drive.input.odometry[k - 1]);
      now = window.add_frame(drive.input.frames[k]);
      open = open || now.status == Status::ambiguous;
      if (now.ok()) {
        EXPECT_FALSE(is_wrong(drive.truth[k], now->newest)) << seed << ' ' << k;
      }
    }
    ambiguous += open;
    decided += open && now.ok();
  }
  EXPECT_GT(ambiguous, 3);
  EXPECT_EQ(decided, ambiguous);
}

// Over 600 drives, ok is wrong for none of the batches.
TEST(SlowSmootherBranches, OkIsRight) {
  const Count batch = batches(numbers(0, 600)), window = windows(numbers(0, 200));
  std::printf("batch: %d of %d ok, %d wrong, %d contradicted\n", batch.ok, batch.all, batch.wrong,
              batch.contradicted);
  std::printf("window: %d of %d ok, %d wrong, %d contradicted\n", window.ok, window.all,
              window.wrong, window.contradicted);
  EXPECT_GT(batch.ok, 500);
  EXPECT_EQ(batch.wrong, 0);
  EXPECT_LE(batch.contradicted, 1);
  EXPECT_LE(batch.curved, batch.ok / 100);  // no frame with three lamps
  EXPECT_LE(window.wrong, window.all / 1000);
  EXPECT_LE(window.contradicted, window.all / 1000);
}

}  // namespace
}  // namespace occ::test
