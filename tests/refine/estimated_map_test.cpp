// SPDX-License-Identifier: Apache-2.0
// Errors of the map and of the camera that the scene does not state.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "libocc/core/statistics.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

constexpr test::Measurement with_rims{80, 0.05, 0.03};

Rigid3 seen_from() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

/// Refined pose of a real scene, measured with noise, with the scene as stated.
Result<Refined> refined_in(const Scene& stated, const Scene& real, Random& random) {
  const auto exact = test::exact_blobs(real, seen_from(), with_rims);
  const auto blobs = test::noisy(exact, real, with_rims, random);
  return refine(seen_from(), test::in_order(stated), blobs, stated);
}

Eigen::Vector3d position_error_m(const Refined& refined) {
  return refined.cam_from_world.origin_in_source() - seen_from().origin_in_source();
}

bool is_beyond_three_sigma(const Refined& refined) {
  constexpr double once_in_a_thousand = 16.3;
  return test::nees(position_error_m(refined),
                    position_covariance(refined.cam_from_world, refined.covariance)) >
         once_in_a_thousand;
}

struct Unstated {
  int estimated = 0, beyond_three_sigma = 0;
  std::vector<double> sigmas_m;
};

Unstated over_unstated_maps(double sigma_m, int count) {
  Random random(11);
  const Scene stated = test::irregular_room();
  Unstated all;
  for (int i = 0; i < count; ++i) {
    Scene real = stated;
    for (Lamp& lamp : real.lamps)
      for (double& coordinate : lamp.centre_m) coordinate += sigma_m * random.normal();
    const auto refined = refined_in(stated, real, random);
    EXPECT_TRUE(refined.ok()) << refined.message;
    all.beyond_three_sigma += is_beyond_three_sigma(*refined);
    all.estimated += refined->estimated_map_sigma_m.has_value();
    all.sigmas_m.push_back(refined->estimated_map_sigma_m.value_or(0));
    EXPECT_FALSE(refined->estimated_camera);
  }
  return all;
}

TEST(EstimatedMap, WrongMapsAreNoticed) {
  constexpr int count = 200;
  for (const double sigma_m : {0.002, 0.01}) {
    SCOPED_TRACE(sigma_m);
    Unstated all = over_unstated_maps(sigma_m, count);
    EXPECT_GE(all.estimated, 0.98 * count);
    EXPECT_LE(all.beyond_three_sigma, 0.01 * count);
    const double typical_m = median(all.sigmas_m);
    EXPECT_GT(typical_m, 0.8 * sigma_m);
    EXPECT_LT(typical_m, 1.25 * sigma_m);
  }
}

// Wrong sizes do not spoil the directions, which give a better pose than the rims do.
TEST(EstimatedMap, WrongSizesAreNoticed) {
  constexpr double size_sigma = 0.02;
  constexpr int count = 100;
  Random random(5);
  int estimated = 0, beyond_three_sigma = 0;
  std::vector<double> off_m;
  for (int i = 0; i < count; ++i) {
    const Scene stated = test::irregular_room();
    Scene real = stated;
    for (Lamp& lamp : real.lamps) lamp.radius_m *= 1 + size_sigma * random.normal();
    const auto refined = refined_in(stated, real, random);
    ASSERT_TRUE(refined.ok()) << refined.message;
    estimated += refined->estimated_size_sigma.has_value();
    beyond_three_sigma += is_beyond_three_sigma(*refined);
    off_m.push_back(position_error_m(*refined).norm());
  }
  EXPECT_GE(estimated, 0.9 * count);
  EXPECT_LE(beyond_three_sigma, 0.01 * count);
  EXPECT_LT(median(off_m), 0.002);  // 0.05 from the sizes alone
}

// Taken as errors of the map, a wrong focal length has poses ten of their sigmas off.
TEST(EstimatedMap, AWrongLensIsEstimated) {
  constexpr int count = 100;
  const Scene stated = test::irregular_room();
  const double focal_px = stated.camera.fx_px();
  for (const auto& [focal_error, k1] : {std::pair{0.01, 0.0}, {-0.02, 0.0}, {0.0, -0.05}}) {
    SCOPED_TRACE(focal_error);
    Scene real = stated;
    const double real_px = (1 + focal_error) * focal_px;
    real.camera = Camera::pinhole(stated.camera.width(), stated.camera.height(), real_px, real_px,
                                  stated.camera.cx_px(), stated.camera.cy_px(), {k1, 0, 0, 0});
    Random random(7);
    int beyond_three_sigma = 0;
    std::vector<double> off_m, off_px;
    for (int i = 0; i < count; ++i) {
      const auto refined = refined_in(stated, real, random);
      ASSERT_TRUE(refined.ok()) << refined.message;
      ASSERT_TRUE(refined->estimated_camera);
      EXPECT_FALSE(refined->estimated_map_sigma_m);
      beyond_three_sigma += is_beyond_three_sigma(*refined);
      off_m.push_back(position_error_m(*refined).norm());
      off_px.push_back(std::abs(refined->estimated_camera->fx_px() - real_px));
    }
    EXPECT_LE(beyond_three_sigma, 0.01 * count);
    EXPECT_LT(median(off_m), 0.01);
    EXPECT_LT(median(off_px), 0.005 * focal_px);
  }
}

// A response that is not stated moves all outlines outward. Four lamps have too few directions to
// show that their sizes are wrong, but one growth explains all of them.
TEST(EstimatedMap, AGrowthOfAllOutlinesIsEstimated) {
  constexpr int count = 60;
  constexpr double growth_px = 0.5;
  Scene scene = test::irregular_room();
  for (const std::size_t lamps : {6, 4}) {
    SCOPED_TRACE(lamps);
    scene.lamps.resize(lamps);
    Random random(7);
    int beyond_three_sigma = 0;
    for (int i = 0; i < count; ++i) {
      auto blobs =
          test::noisy(test::exact_blobs(scene, seen_from(), with_rims), scene, with_rims, random);
      for (Blob& blob : blobs)
        for (RimPoint& point : blob.rim) point.px += growth_px * point.normal;
      const auto refined = refine(seen_from(), test::in_order(scene), blobs, scene);
      ASSERT_TRUE(refined.ok()) << refined.message;
      ASSERT_TRUE(refined->estimated_growth_px) << i;
      EXPECT_NEAR(*refined->estimated_growth_px, growth_px, 0.1);
      beyond_three_sigma += is_beyond_three_sigma(*refined);
      EXPECT_LT(position_error_m(*refined).norm(), 0.01);
    }
    EXPECT_LE(beyond_three_sigma, 0.02 * count);
  }
}

TEST(EstimatedMap, ExactMapsAreNotDoubted) {
  const Unstated all = over_unstated_maps(0, 200);
  EXPECT_EQ(all.estimated, 0);
  EXPECT_LE(all.beyond_three_sigma, 2);
}

}  // namespace
}  // namespace occ
