// SPDX-License-Identifier: Apache-2.0
// Rungs that a refinement may choose from, and their predicted times.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/budget.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

struct Ahead {
  Scene scene = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  std::vector<Blob> blobs;
  std::vector<Hypothesis> hypotheses;
  RefineOptions options;
  RungCosts costs;
  IdentifyOptions identify;
  std::vector<unsigned char> pixels = std::vector<unsigned char>(640 * 480, 2);
  ImageView image;
  int max_candidates = 5;
  std::optional<double> budget_s = 1e9, target_sigma_m;
  bool has_image = true;

  Ahead() {
    scene.sensor.psf_sigma_px = 0.7;
    test::Measurement m;
    m.rim_points = 20;
    blobs = test::exact_blobs(scene, pose, m);
    for (Blob& blob : blobs) {
      const Eigen::Vector2d px = blob.centroid_px;
      blob.x0 = static_cast<int>(px.x()) - 10;
      blob.x1 = blob.x0 + 20;
      blob.y0 = static_cast<int>(px.y()) - 8;
      blob.y1 = blob.y0 + 16;
    }
    add(0);
    image.data = pixels.data();
    image.width = 640;
    image.height = 480;
    image.row_bytes = 640;
    costs.points = {1, 0, 0, 0};
    costs.centres = {10, 1, 0, 0};
    costs.rims = {100, 0, 1, 0};
    costs.direct = {1000, 0, 0, 0.1};
  }
  void add(double chi2, int lamps = 6) {
    Hypothesis h;
    h.cam_from_world = pose;
    h.matches = test::in_order(scene);
    h.matches.resize(static_cast<std::size_t>(lamps));
    h.chi2 = chi2;
    hypotheses.push_back(h);
  }
  RungChoice choice() const {
    const RefinementAhead ahead{
        hypotheses,     blobs,    scene,    options,        costs,
        max_candidates, identify, budget_s, target_sigma_m, has_image ? &image : nullptr};
    return rung_for(ahead, [] { return 0.0; });
  }
  std::vector<Rung> rungs() const {
    std::vector<Rung> out;
    for (const RungForecast& forecast : choice().alternatives) out.push_back(forecast.rung);
    return out;
  }
  bool offers(Rung rung) const {
    const std::vector<Rung> all = rungs();
    return std::find(all.begin(), all.end(), rung) != all.end();
  }
  double seconds(Rung rung) const {
    for (const RungForecast& forecast : choice().alternatives)
      if (forecast.rung == rung) return forecast.predicted_s;
    return -1;
  }
};

TEST(RungForecasts, AreOfTheRungsThatTheBlobsAllow) {
  Ahead ahead;
  EXPECT_EQ(ahead.rungs(),
            (std::vector<Rung>{Rung::points, Rung::centres, Rung::rims, Rung::direct}));
  for (std::size_t i = 1; i < ahead.blobs.size(); ++i) ahead.blobs[i].rim.clear();
  EXPECT_TRUE(ahead.offers(Rung::rims));
  ahead.blobs[0].rim.clear();
  EXPECT_FALSE(ahead.offers(Rung::rims));
  EXPECT_TRUE(ahead.offers(Rung::direct));
  ahead.has_image = false;
  EXPECT_EQ(ahead.rungs(), (std::vector<Rung>{Rung::points, Rung::centres}));
}

TEST(RungForecasts, OfferNoPixelsIfNoBlobIsAWholeSteadyLamp) {
  const auto offers_after = [](auto change) {
    Ahead ahead;
    for (std::size_t i = 1; i < ahead.blobs.size(); ++i) change(ahead, i);
    EXPECT_TRUE(ahead.offers(Rung::direct)) << "a single blob suffices";
    change(ahead, 0);
    return ahead.offers(Rung::direct);
  };
  EXPECT_FALSE(offers_after([](Ahead& a, std::size_t i) { a.blobs[i].merged = true; }));
  EXPECT_FALSE(offers_after([](Ahead& a, std::size_t i) { a.blobs[i].cut_by_border = true; }));
  EXPECT_FALSE(offers_after([](Ahead& a, std::size_t i) { a.blobs[i].striped = true; }));
  EXPECT_FALSE(offers_after([](Ahead& a, std::size_t i) {
    a.scene.sensor.row_time_s = 1e-5;
    a.scene.lamps[i].frequency_hz = 1000;
  }));
  EXPECT_TRUE(offers_after([](Ahead& a, std::size_t i) { a.scene.lamps[i].frequency_hz = 1000; }));
  EXPECT_TRUE(offers_after([](Ahead& a, std::size_t) { a.scene.sensor.row_time_s = 1e-5; }));
}

TEST(RungForecasts, CountRimsOfAllPosesAndPixelsOfThePlausibleOnes) {
  Ahead ahead;
  // 6 lamps, 120 points of rims, and boxes of 29 x 25 pixels.
  const double rims = 100 + 120, pixels = 1000 + 0.1 * 6 * 29 * 25;
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::points), 1);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::centres), 16);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::rims), rims);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::direct), rims + pixels);
  ahead.add(13);    // a likelihood ratio of 665
  ahead.add(0, 5);  // fewer lamps
  ahead.add(15);    // 1800, beyond a thousand
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::centres), 3 * 16 + 15);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::rims), 4 * rims - 20);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::direct), 4 * rims - 20 + 2 * pixels);
  ahead.max_candidates = 2;
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::rims), 2 * rims);
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::direct), 2 * rims + 2 * pixels);
}

TEST(RungForecasts, WithoutAWishAreOfTheRungOfTheOptions) {
  Ahead ahead;
  ahead.budget_s.reset();
  ahead.options.rung = Rung::direct;
  EXPECT_EQ(ahead.rungs(), std::vector<Rung>{Rung::direct});
  ahead.has_image = false;
  EXPECT_EQ(ahead.rungs(), std::vector<Rung>{Rung::rims});
  ahead.options.rung = Rung::centres;
  EXPECT_EQ(ahead.rungs(), std::vector<Rung>{Rung::centres});
  EXPECT_DOUBLE_EQ(ahead.seconds(Rung::centres), 16);
}

/// Predicted error of the direct rung.
double direct_sigma_m(const Ahead& ahead) {
  for (const RungForecast& forecast : ahead.choice().alternatives)
    if (forecast.rung == Rung::direct) return forecast.predicted_sigma_m.value();
  return -1;
}

double position_sigma_m(const Result<PoseBound>& bound) {
  return std::sqrt(bound->position_covariance_m2.trace());
}

TEST(RungForecasts, PredictPixelsByTheSceneOfTheObservedLampsOrByTheImage) {
  Ahead ahead;
  ahead.budget_s.reset();
  ahead.target_sigma_m = 1e-12;  // asks for all bounds
  ahead.hypotheses.front().matches = {{0, 0}, {1, 1}, {2, 2}, {3, 3}};
  Scene observed = ahead.scene;
  observed.lamps.resize(4);
  const double of_scene =
      position_sigma_m(pose_bound(observed, ahead.pose, Rung::direct, ahead.options.flux));
  EXPECT_NEAR(direct_sigma_m(ahead), of_scene, 1e-9 * of_scene);
  // The image of a merged blob shows less, and a prior more.
  const auto by_image = [](const Ahead& a) {
    RefineOptions options = a.options;
    options.rung = Rung::direct;
    return position_sigma_m(
        pose_bound(a.hypotheses.front().matches, a.blobs, a.scene, a.pose, options, a.image));
  };
  Ahead merged = ahead;
  merged.image.data = merged.pixels.data();
  merged.blobs[1].merged = true;
  EXPECT_NEAR(direct_sigma_m(merged), by_image(merged), 1e-9 * of_scene);
  EXPECT_GT(direct_sigma_m(merged), 1.01 * of_scene);
  Ahead known = ahead;
  known.image.data = known.pixels.data();
  known.options.prior.emplace();
  known.options.prior->position_m = known.pose.origin_in_source();
  known.options.prior->position_sigma_m = 0.3 * of_scene;
  EXPECT_NEAR(direct_sigma_m(known), by_image(known), 1e-9 * of_scene);
  EXPECT_LT(direct_sigma_m(known), 0.6 * of_scene);
  known.options.prior = Prior{};  // an empty one is none
  EXPECT_NEAR(direct_sigma_m(known), of_scene, 1e-9 * of_scene);
  known.options.model_sigma_px = 0.3;
  EXPECT_NEAR(direct_sigma_m(known), by_image(known), 1e-9 * of_scene);
  EXPECT_GT(direct_sigma_m(known), 1.2 * of_scene);
}

TEST(RungForecasts, AnUndeterminedPoseHasAnInfiniteError) {
  Ahead ahead;
  ahead.budget_s.reset();
  ahead.target_sigma_m = 1e-3;
  ahead.hypotheses.front().matches = {{0, 0}, {1, 1}};
  for (Blob& blob : ahead.blobs) blob.rim.clear();
  ahead.has_image = false;
  const RungChoice choice = ahead.choice();
  EXPECT_FALSE(choice.met);
  for (const RungForecast& forecast : choice.alternatives)
    EXPECT_EQ(forecast.predicted_sigma_m.value(), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace occ
