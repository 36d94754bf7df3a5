// SPDX-License-Identifier: Apache-2.0
// Lamps that are left out as gross errors, compared with refits without each lamp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
namespace {

constexpr double centroid_sigma_px = 0.05;

/// Lamps seen by their centroids, one of which is displaced.
struct DisplacedLamp {
  Scene scene = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  std::vector<Blob> blobs;

  DisplacedLamp(std::uint64_t seed, int lamp, double sigmas, double noise_sigmas = 1) {
    const double more_lamps_m[][3] = {{2.6, 1.5, 2.7}, {1.1, 2.2, 2.9}, {2.9, 2.0, 2.8},
                                      {1.7, 1.3, 2.6}, {2.2, 2.9, 3.0}, {1.9, 0.8, 2.9}};
    for (const auto& at : more_lamps_m)
      scene.lamps.push_back(
          test::disc_lamp(static_cast<int>(scene.lamps.size()), {at[0], at[1], at[2]}));
    Random random(71, seed);
    test::Measurement m;
    m.centroid_sigma_px = centroid_sigma_px;
    blobs = test::exact_blobs(scene, pose, m);
    for (Blob& blob : blobs)
      blob.centroid_px += test::noise_2d(random, noise_sigmas * centroid_sigma_px);
    const double turn = random.uniform(0, 6.283);
    blobs[lamp].centroid_px +=
        sigmas * centroid_sigma_px * Eigen::Vector2d(std::cos(turn), std::sin(turn));
  }
  Refined refined(const std::vector<Match>& matches, bool keep_all) const {
    RefineOptions options;
    options.rung = Rung::centres;
    if (keep_all) options.huber_sigma = std::numeric_limits<double>::infinity();
    return refine(pose, matches, blobs, scene, options).value;
  }
  /// Lamp whose removal lowers chi2 most, and whether both tests reject it at 0.1 %: the decrease
  /// as a chi-square with two degrees of freedom, and its ratio to the rest as Fisher's F. Another
  /// lamp must explain the contradiction less well by the same limit.
  struct Verdict {
    int worst = -1;
    bool rejected = false;
    double margin = 1e9;  ///< smallest distance of the three decisions from their limits
  };
  Verdict verdict(int lamps) const {
    std::vector<Match> all = test::in_order(scene);
    all.resize(static_cast<std::size_t>(lamps));
    const double chi2 = refined(all, true).chi2;
    std::vector<double> falls;
    for (int i = 0; i < lamps; ++i) {
      std::vector<Match> others = all;
      others.erase(others.begin() + i);
      falls.push_back(chi2 - refined(others, true).chi2);
    }
    Verdict out;
    out.worst = static_cast<int>(std::max_element(falls.begin(), falls.end()) - falls.begin());
    std::vector<double> sorted = falls;
    std::sort(sorted.rbegin(), sorted.rend());
    const double fall = sorted[0], rest = chi2 - fall, dof = 2 * lamps - 6 - 2;
    const double limit = 2 * std::log(1000);
    const double needed_of_f = rest * (std::pow(1000, 2 / dof) - 1);
    const double needed_of_second = sorted[1] + limit * std::max(1.0, rest / dof);
    out.rejected = fall > limit && fall > needed_of_f && fall >= needed_of_second;
    for (const double needed : {limit, needed_of_f, needed_of_second})
      out.margin = std::min(out.margin, std::abs(fall - needed));
    return out;
  }
};

TEST(Outliers, AreRejectedByBothTestsOfARefit) {
  int rejected = 0, kept = 0, compared = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Random random(72, seed);
    const int lamps = 5 + random.below(8), lamp = random.below(lamps);
    const double noise = std::vector<double>{0.3, 1, 4}[seed % 3];  // over the stated sigmas
    const DisplacedLamp view(seed, lamp, noise * random.uniform(2, 16), noise);
    const DisplacedLamp::Verdict expected = view.verdict(lamps);
    if (expected.margin < 0.3) continue;  // decided by rounding and curvature
    std::vector<Match> all = test::in_order(view.scene);
    all.resize(static_cast<std::size_t>(lamps));
    const Refined refined = view.refined(all, false);
    const bool any = std::any_of(refined.lamps.begin(), refined.lamps.end(),
                                 [](const LampResidual& r) { return r.contradicts; });
    EXPECT_EQ(any, expected.rejected) << seed;
    if (any && expected.rejected) {
      EXPECT_TRUE(refined.lamps[static_cast<std::size_t>(expected.worst)].contradicts) << seed;
    }
    ++compared;
    (expected.rejected ? rejected : kept) += 1;
  }
  EXPECT_GT(compared, 240);
  EXPECT_GT(rejected, 50);
  EXPECT_GT(kept, 50);
}

TEST(Outliers, AreNotSoughtWithoutRedundancy) {
  // Three lamps fit always; any one of four may be the wrong one.
  for (const int lamps : {3, 4}) {
    const DisplacedLamp view(1, 1, 60);
    std::vector<Match> all = test::in_order(view.scene);
    all.resize(static_cast<std::size_t>(lamps));
    for (const LampResidual& residual : view.refined(all, false).lamps)
      EXPECT_FALSE(residual.contradicts);
  }
}

}  // namespace
}  // namespace occ
