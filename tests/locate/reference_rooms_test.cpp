// SPDX-License-Identifier: Apache-2.0
// Results of locate() for blobs and images, compared with those of an earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/identify/reference_support.hpp"
#include "tests/locate/reference_support.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ::test {
namespace {

CaseResults results_of(const Result<Fix>& found) {
  CaseResults results;
  add_status(results, found);
  add_fix(results, found.value);
  results.add("separable", static_cast<double>(found->separation.lamps.size()));
  results.add("fault", found->separation.fault_probability);
  return results;
}

/// Blobs with rims of the lamps that are well in view; some are dark, moved or false.
std::vector<Blob> rims_of(const Scene& scene, const Rigid3& pose, int i, Random& random) {
  Measurement m;
  m.rim_points = i % 4 == 3 ? 0 : 16;
  m.centroid_sigma_px = i % 5 == 2 ? 0.3 : 0.03;
  m.growth_px = i % 6 == 4 ? 1.5 : 0;
  m.flux_sigma = i % 3 ? 0.05 : 0;
  Scene seen = scene;
  seen.lamps.clear();
  for (const Lamp& lamp : scene.lamps) {
    const auto px = project_lamp_centre(lamp, pose, scene.camera);
    if (!px || px->minCoeff() < 30 || px->x() > 610 || px->y() > 450) continue;
    seen.lamps.push_back(lamp);
    if (i % 7 == 5 && seen.lamps.size() == 2) seen.lamps.back().centre_m.x() += 0.05;
    if (i % 9 == 7) seen.lamps.back().centre_m += 0.01 * random_vector(random);
    if (i % 11 == 3) seen.lamps.back().radius_m *= 1.1;
  }
  std::vector<Blob> blobs = noisy(exact_blobs(seen, pose, m), seen, m, random);
  for (std::size_t k = 0; k < blobs.size(); ++k) {
    const auto rim = project_rim(seen.lamps[k], pose, scene.camera, 64);
    if (m.rim_points > 0 && rim) set_ellipse(blobs[k], *rim, 1);
    blobs[k].saturated = m.growth_px > 0;
  }
  if (i % 4 == 1 && blobs.size() > 4) blobs.erase(blobs.begin() + 1);
  for (int k = 0; k < i % 4; ++k)
    blobs.push_back(spot({random.uniform(20, 620), random.uniform(20, 460)}, 0.1, 3000));
  return blobs;
}

TEST(References, FixesOfBlobs) {
  References references("locate/blobs");
  for (int i = 0; i < 300; ++i) {
    Random random(611, static_cast<std::uint64_t>(i));
    Scene scene = i % 10 == 6 ? square_room() : random_room(random, 4 + i % 7, i % 3 ? 2.5 : 3);
    if (i % 8 == 1) scene.map_sigma_m = Eigen::Vector3d(0.005, 0.01, 0.01);
    if (i % 8 == 5)
      for (Lamp& lamp : scene.lamps) lamp.size_sigma = 0.02;
    const Rigid3 pose = random_room_pose(random, 0.2);
    const std::vector<Blob> blobs = rims_of(scene, pose, i, random);
    LocateOptions options;
    options.identify.model_sigma_px = i % 2 ? 0.5 : 0.1;
    options.refine.rung = std::array<Rung, 4>{Rung::rims, Rung::centres, Rung::points,
                                              Rung::rims}[static_cast<std::size_t>(i / 3 % 4)];
    if (i % 5 == 1) options.refine.model_sigma_px = 0.05;
    if (i % 6 == 2) options.prior = prior_of(pose, 1 + random.below(31), 1, random);
    if (i % 12 == 9)
      options.prior = prior_of(pose * Rigid3{so3_exp({0, 0, 1.5}), {0.7, 0, 0}},
                               1 + random.below(31), 1, random);
    if (i % 13 == 4) options.max_candidates = 2;
    if (i % 14 == 8) options.max_risk = 0.5;
    if (i % 15 == 10) options.identify.max_hypotheses = 20;
    if (i % 16 == 11) options.refine.max_iterations = 1;
    if (i % 9 == 4) options.lamp_fault_probability = 0.01;
    references.add(std::to_string(i), results_of(locate(blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// One lamp or all lamps are not where the map states, in irregular and in regular rooms.
TEST(References, FixesWithWrongMaps) {
  References references("locate/wrong_maps");
  for (int i = 0; i < 150; ++i) {
    Random random(615, static_cast<std::uint64_t>(i));
    Scene scene = i % 3 == 2 ? square_room() : irregular_room();
    if (i % 6 == 1)
      for (int k = 0; k < 6; ++k)
        scene.lamps[static_cast<std::size_t>(k)].centre_m = {1.2 + 0.7 * (k % 3), 1.6 + k / 3, 3};
    if (i % 4 == 3 && scene.lamps.size() > 4) scene.lamps.resize(5);
    const Rigid3 pose =
        look_at({2.1 + 0.1 * random.normal(), 1.9, 0.5}, {2.1, 2, 3}, {random.normal(), 1, 0});
    Measurement m;
    m.rim_points = i % 5 == 4 ? 0 : 24;
    m.centroid_sigma_px = 0.02;
    m.flux_sigma = 0.05;
    std::vector<Blob> blobs = noisy(exact_blobs(scene, pose, m), scene, m, random);
    for (std::size_t k = 0; k < blobs.size(); ++k)
      if (const auto rim = project_rim(scene.lamps[k], pose, scene.camera, 64))
        set_ellipse(blobs[k], *rim, 1);
    const double shift_m = std::exp(random.uniform(-8, -1.5));
    if (i % 2)
      scene.lamps[static_cast<std::size_t>(i) % scene.lamps.size()].centre_m +=
          shift_m * random_vector(random);
    else
      for (Lamp& lamp : scene.lamps) lamp.centre_m += shift_m * random_vector(random);
    LocateOptions options;
    options.identify.model_sigma_px = i % 4 ? 0.5 : 5;
    if (i % 7 == 2) options.prior = prior_of(pose, 4, 1, random);
    references.add(std::to_string(i), results_of(locate(blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Few lamps of all shapes, with codes and unknown fluxes.
TEST(References, FixesOfVariedLamps) {
  References references("locate/varied");
  for (int i = 0; i < 300; ++i) {
    Random random(612, static_cast<std::uint64_t>(i));
    const Scene scene = varied_room(random, 3 + i % 6, i);
    const Rigid3 pose = random_room_pose(random);
    Look look;
    look.sigma_px = i % 3 ? 0.1 : 0.4;
    look.sized = i % 2 == 0;
    look.saturated = i % 5 == 3 ? 0.4 : 0;
    look.cut = look.merged = i % 4 == 2 ? 0.15 : 0;
    look.coloured = i % 5 == 1;
    look.read_ids = i % 7 == 6 ? 0.7 : 0;
    look.read_frequencies = 0.5;
    const View view = look_at_lamps(scene, pose, look, random, i % 3);
    LocateOptions options;
    options.identify.model_sigma_px = 0.2;
    if (i % 3 == 1) options.prior = prior_of(pose, 1 + random.below(31), i % 2 ? 1 : 3, random);
    references.add(std::to_string(i), results_of(locate(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// One rectangle, whose corners determine the pose.
TEST(References, FixesOfOneRectangle) {
  References references("locate/rectangle");
  for (int i = 0; i < 72; ++i) {
    Random random(613, static_cast<std::uint64_t>(i));
    Scene scene = square_room();
    for (Lamp& lamp : scene.lamps) {
      lamp.shape = LampShape::rectangle;
      lamp.size_m = {0.6, i % 2 ? 0.15 : 0.3};
    }
    const Rigid3 pose =
        look_at({1.2 + 0.1 * random.normal(), 1.1, random.uniform(0.5, 2)}, {1, 1, 3}, {0.3, 1, 0});
    Look look;
    look.sized = true;
    look.saturated = i % 5 == 4;
    look.read_ids = i % 6 == 5;
    View view = look_at_lamps(scene, pose, look, random);
    const auto first = std::find(view.lamp.begin(), view.lamp.end(), 0) - view.lamp.begin();
    if (first == static_cast<std::ptrdiff_t>(view.lamp.size())) continue;
    view.blobs = {view.blobs[static_cast<std::size_t>(first)]};
    LocateOptions options;
    if (i % 4) options.prior = prior_of(pose, 1 + i % 31, 1, random);
    references.add(std::to_string(i), results_of(locate(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, FixesOfImages) {
  References references("locate/images");
  for (int i = 0; i < 16; ++i) {
    Random random(614, static_cast<std::uint64_t>(i));
    Scene scene = varied_room(random, 5, 2 * i);
    for (Lamp& lamp : scene.lamps) lamp.frequency_hz.reset();
    if (i == 3) scene.sensor.exposure_s *= 20;
    const Rigid3 pose = random_room_pose(random, 0.1);
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(i);
    const Image image = simulate(scene, pose, simulation).image;
    LocateOptions options;
    if (i % 2) options.refine.rung = Rung::centres;
    references.add(std::to_string(i), results_of(locate(image.view(), scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
