// SPDX-License-Identifier: Apache-2.0
// Results of identify() for maps of many lamps, compared with those of an earlier version: every
// search method, grids with dark lamps, and priors that are right or wrong.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/identify/lamp_index.hpp"
#include "tests/identify/random_maps.hpp"
#include "tests/identify/reference_support.hpp"

namespace occ::test {
namespace {

maps::Options map_options(int i) {
  maps::Options options;
  options.lamps = std::array<int, 6>{7, 9, 12, 20, 40, 80}[static_cast<std::size_t>(i % 6)];
  options.visible = 4 + i % 6;
  options.hidden = i % 5 == 1 ? 2 : i % 3 == 0 ? 1 : 0;
  if (options.visible + options.hidden > options.lamps) options.hidden = 0;
  if (options.lamps < 9) options.visible = std::min(options.visible, 6);
  options.false_lights = i % 24 == 22 ? 62 : i % 7;  // more blobs than are used
  options.noise_px = i % 4 == 0 ? 0.1 : 0.5;
  options.thickness_m = i % 3 ? 0.5 : 0;
  return options;
}

TEST(References, SearchMethodsOfRandomMaps) {
  constexpr std::array<IdentifyMethod, 6> methods{
      IdentifyMethod::automatic, IdentifyMethod::alignment,  IdentifyMethod::voting,
      IdentifyMethod::ransac,    IdentifyMethod::clustering, IdentifyMethod::hashing};
  References references("identify/methods");
  for (int i = 0; i < 120; ++i) {
    Random random(511, static_cast<std::uint64_t>(i));
    maps::View view = maps::random_view(random, map_options(i));
    if (i % 10 == 7) view.blobs.front().lamp_id = 999;  // not in the map
    IdentifyOptions options;
    options.model_sigma_px = 0.1;
    options.method = methods[static_cast<std::size_t>(i / 6 % 6)];
    options.seed = static_cast<std::uint64_t>(i);
    const bool many = view.scene.lamps.size() > 20;
    if (many && options.method != IdentifyMethod::hashing && i % 4)
      options.method = IdentifyMethod::automatic;
    if (many) options.max_hypotheses = 20000;
    if (i % 24 == 22) options.max_hypotheses = 5000;
    if (i % 11 == 4) options.max_hypotheses = 300;
    if (i % 3 != 1) options.prior = maps::gravity(view, i % 2 ? 0.01 : 0.03, random);
    if (i % 9 == 5) options.prior = prior_of(view.cam_from_world, 8 + random.below(8), 1, random);
    if (options.method == IdentifyMethod::hashing && i % 2)
      options.index = LampIndex(view.scene.lamps);
    references.add(std::to_string(i), results_of(identify(view.blobs, view.scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Lamps at one height or nearly so, some with ids or colours, looked up by the shapes of
/// triangles.
TEST(References, HashedMaps) {
  References references("identify/hashed");
  for (int i = 0; i < 120; ++i) {
    Random random(514, static_cast<std::uint64_t>(i));
    maps::Options map = map_options(i);
    map.lamps = std::max(map.lamps, 9);
    map.thickness_m = std::array<double, 4>{0, 0.002, 0.012, 0.03}[static_cast<std::size_t>(i % 4)];
    map.max_tilt_rad = i % 5 == 2 ? 1.1 : 0.5;
    maps::View view = maps::random_view(random, map);
    if (i % 6 == 1)
      for (std::size_t k = 0; k < view.scene.lamps.size(); k += 6)
        view.scene.lamps[k].centre_m.z() -= 0.4;
    if (i % 7 == 3) {
      view.scene.lamps.push_back(view.scene.lamps.front());
      view.scene.lamps.back().id = 1000;
    }
    for (std::size_t k = 0; k < view.scene.lamps.size(); ++k)
      if (i % 3 == 2 && k % 2) view.scene.lamps[k].colour = {1, 0.2, 0.1};
    for (std::size_t k = 0; k < view.blobs.size(); ++k) {
      if (view.lamp[k] < 0) continue;
      const Lamp& lamp = view.scene.lamps[static_cast<std::size_t>(view.lamp[k])];
      if (i % 3 == 2)
        view.blobs[k].colour =
            BlobColour{lamp.colour / lamp.colour.sum(), Eigen::Vector3d::Constant(0.02), {}};
      if (i % 8 == 5 && k == 0) view.blobs[k].lamp_id = lamp.id;
    }
    IdentifyOptions options;
    options.method = IdentifyMethod::hashing;
    options.model_sigma_px = i % 2 ? 0.1 : 0.5;
    options.max_hypotheses = 20000;
    options.prior = maps::gravity(view, i % 3 ? 0.01 : 0.04, random);
    if (i % 9 == 4) options.prior->height_m = view.cam_from_world.origin_in_source().z();
    if (i % 2) options.index = LampIndex(view.scene.lamps);
    references.add(std::to_string(i), results_of(identify(view.blobs, view.scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Lamps near the places of a grid or in a row; some are dark.
TEST(References, IdentifiedLampsOfGrids) {
  References references("identify/grids");
  for (int i = 0; i < 100; ++i) {
    Random random(512, static_cast<std::uint64_t>(i));
    maps::View view{maps::grid(3 + i % 4), {}, {}, {}};
    const double off_m = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 0.02 : 0.1;
    for (Lamp& lamp : view.scene.lamps) lamp.centre_m += off_m * random_vector(random);
    if (i % 10 == 9)
      for (Lamp& lamp : view.scene.lamps) lamp.centre_m.y() = 1 + 0.01 * random.normal();
    maps::Options map;
    map.lamps = 4 + i % 4;
    map.max_tilt_rad = 0.3;
    view.cam_from_world = maps::random_pose(random, map);
    for (const Lamp& lamp : view.scene.lamps) {
      const auto px = view.scene.camera.project(view.cam_from_world * lamp.centre_m);
      if (!px || !view.scene.camera.contains(*px) || random.uniform() < 0.15) continue;
      const Eigen::Vector2d noise(random.normal(), random.normal());
      view.blobs.push_back(maps::spot(*px + 0.3 * noise, 0.3));
    }
    for (int k = 0; k < i % 5; ++k)
      view.blobs.push_back(maps::spot({random.uniform(0, 479), random.uniform(0, 479)}, 0.3));
    IdentifyOptions options;
    options.model_sigma_px = 0.1;
    const int of_prior = i % 8;
    if (of_prior == 1) options.prior = maps::gravity(view, 0.01, random);
    if (of_prior == 2) options.prior = prior_of(view.cam_from_world, 16, 1, random);
    if (of_prior == 3) options.prior = prior_of(view.cam_from_world, 1 + 8, 1, random);
    if (of_prior == 4)
      options.prior = prior_of(view.cam_from_world * Rigid3{Eigen::Matrix3d::Identity(), {1, 0, 0}},
                               1 + random.below(31), 1, random);
    if (of_prior == 5) options.prior = prior_of(view.cam_from_world, 16 + 8 + 2, 3, random);
    if (of_prior == 6) options.prior = prior_of(view.cam_from_world, 4 + 2, 4, random);
    options.max_hypotheses = i % 13 == 6 ? 100 : 30000;
    references.add(std::to_string(i), results_of(identify(view.blobs, view.scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Few lamps of a regular grid: more poses than are kept, with and without priors that select some.
TEST(References, IdentifiedCellsOfGrids) {
  References references("identify/cells");
  for (int i = 0; i < 80; ++i) {
    Random random(515, static_cast<std::uint64_t>(i));
    maps::View view{maps::grid(3 + i % 5), {}, {}, {}};
    const double focal_px = i % 3 ? 480 : 380;
    view.scene.camera = Camera::pinhole(480, 480, focal_px, focal_px, 239.5, 239.5);
    const Eigen::Vector3d eye(1.2 + 0.03 * random.normal(), 1.2 + 0.03 * random.normal(), 0.7);
    const double turn = random.uniform(-pi, pi);
    view.cam_from_world = look_at(eye, eye + Eigen::Vector3d(0.02, 0.01, 1),
                                  Eigen::Vector3d(std::cos(turn), std::sin(turn), 0));
    for (const Lamp& lamp : view.scene.lamps) {
      const auto px = view.scene.camera.project(view.cam_from_world * lamp.centre_m);
      if (!px || !view.scene.camera.contains(*px) || random.uniform() < 0.1) continue;
      const Eigen::Vector2d noise(random.normal(), random.normal());
      view.blobs.push_back(maps::spot(*px + 0.1 * noise, 0.1));
    }
    for (int k = 0; k < i % 3; ++k)
      view.blobs.push_back(maps::spot({random.uniform(0, 479), random.uniform(0, 479)}, 0.3));
    IdentifyOptions options;
    options.model_sigma_px = 0.1;
    options.max_hypotheses = 20000;
    const Rigid3 elsewhere =
        view.cam_from_world * Rigid3{so3_exp({0, 0, i % 8 == 5 ? 0.5 * pi : 0}), {0.8, 0, 0}};
    if (i % 4 == 1)
      options.prior = prior_of(
          i % 8 == 1 ? view.cam_from_world : elsewhere,
          std::array<int, 5>{16, 24, 17, 3, 20}[static_cast<std::size_t>(i / 4 % 5)], 0.5, random);
    if (i % 4 == 2) options.prior = maps::gravity(view, 0.01, random);
    if (i % 5 == 4) options.method = IdentifyMethod::alignment;
    references.add(std::to_string(i), results_of(identify(view.blobs, view.scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Priors that are off by a few sigmas or of another place.
TEST(References, IdentifiedLampsWithPriors) {
  References references("identify/priors");
  for (int i = 0; i < 120; ++i) {
    Random random(513, static_cast<std::uint64_t>(i));
    const maps::View view = maps::random_view(random, map_options(i));
    IdentifyOptions options;
    options.model_sigma_px = i % 2 ? 0.1 : 0.5;
    const double off = std::array<double, 4>{0.5, 1, 3, 8}[static_cast<std::size_t>(i / 6 % 4)];
    options.prior = prior_of(view.cam_from_world, 1 + i % 31, off, random);
    options.max_hypotheses = view.scene.lamps.size() > 20 || i % 24 == 22 ? 10000 : 50000;
    references.add(std::to_string(i), results_of(identify(view.blobs, view.scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
