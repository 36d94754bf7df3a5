// SPDX-License-Identifier: Apache-2.0
// Refinement with measured emission: unbiased poses with true covariances from rendered batwings,
// and a map with Lambertian lamps in their place contradicts the images.
#include "tests/support/photometry.hpp"

#include <cmath>

#include "libocc/refine/bound.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/pixel_blobs.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene batwing_room() {
  Scene scene = test::irregular_room();
  const auto profile = test::profile_of(test::batwing, 5, 15);
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    Lamp& lamp = scene.lamps[i];
    const double angle = static_cast<double>(i);
    lamp.x_axis = {std::cos(angle), std::sin(angle), 0};
    lamp.photometry = profile;
    lamp.power_sigma = 0.01;
  }
  return scene;
}

Scene lambertian(Scene scene) {
  for (Lamp& lamp : scene.lamps) lamp.photometry = nullptr;
  return scene;
}

Result<Refined> refine_frame(const test::Frame& frame, const Rigid3& start, const Scene& map,
                             Rung rung) {
  RefineOptions options;
  options.rung = rung;
  options.flux = FluxModel::known_power;
  return refine(start, frame.matches, frame.blobs, map, options, frame.image.view());
}

TEST(RefinePhotometry, IsExactWithoutNoise) {
  Scene scene = batwing_room();
  scene.sensor.bit_depth = 16;
  scene.sensor.gain_dn_per_e = 6;
  const Rigid3 truth = look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0});
  const Rigid3 start = perturb(truth, 0.003 * Vector6::Ones());
  const test::Frame frame = test::make_frame(scene, truth, 1, false);
  ASSERT_GE(frame.matches.size(), 5u);
  const auto refined = refine_frame(frame, start, scene, Rung::direct);
  ASSERT_TRUE(refined.ok()) << refined.message;
  EXPECT_LT((refined->cam_from_world.origin_in_source() - truth.origin_in_source()).norm(), 5e-6);
  // The scene's Lambertian lamps of the same power contradict the fluxes.
  const auto wrong = refine_frame(frame, start, lambertian(scene), Rung::direct);
  EXPECT_GT(wrong->chi2, 10 * std::max(1.0, refined->chi2));
}

TEST(RefinePhotometry, CovarianceIsTrue) {
  const Scene scene = batwing_room();
  constexpr int frames = 60;
  const auto interval = test::chi2_interval(6.0 * frames);
  for (const Rung rung : {Rung::centres, Rung::rims, Rung::direct}) {
    SCOPED_TRACE(std::to_string(static_cast<int>(rung)));
    Random random(4);
    double nees = 0;
    int count = 0;
    for (std::uint64_t seed = 1; count < frames; ++seed) {
      const Rigid3 pose = test::random_room_pose(random, 0.3);
      Scene true_scene = scene;
      for (Lamp& lamp : true_scene.lamps)
        lamp.power_w *= std::exp(lamp.power_sigma * random.normal());
      const test::Frame frame = test::make_frame(true_scene, pose, seed);
      if (frame.cut || frame.matches.size() < 5) continue;
      ++count;
      const auto refined = refine_frame(frame, pose, scene, rung);
      ASSERT_TRUE(refined.ok()) << refined.message;
      nees += test::nees(difference(refined->cam_from_world, pose), refined->covariance);
    }
    EXPECT_GT(1.2 * nees, interval.first);
    EXPECT_LT(nees / 1.2, interval.second);
  }
}

TEST(RefinePhotometry, TheBoundUsesTheMeasuredEmission) {
  const Scene scene = batwing_room();
  const Rigid3 pose = look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0});
  const auto measured = pose_bound(scene, pose, Rung::centres, FluxModel::known_power);
  const auto assumed = pose_bound(lambertian(scene), pose, Rung::centres, FluxModel::known_power);
  ASSERT_TRUE(measured.ok()) << measured.message;
  const double ratio =
      std::sqrt(measured->position_covariance_m2.trace() / assumed->position_covariance_m2.trace());
  EXPECT_GT(std::abs(std::log(ratio)), 0.002);
  EXPECT_LT(std::abs(std::log(ratio)), 1);
}

}  // namespace
}  // namespace occ
