// SPDX-License-Identifier: Apache-2.0
// Results of identify() in rooms of a few lamps, compared with those of an earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/identify/reference_support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

/// Looks of the lamps by number: sizes, unknown fluxes, saturation, colours and codes.
Look room_look(int i) {
  Look look;
  look.sigma_px = std::array<double, 4>{0.05, 0.3, 1, 2.5}[static_cast<std::size_t>(i % 4)];
  look.flux_sigma = i % 5 == 0 ? 0 : 0.05;
  look.gain = i % 3 ? 1 : 20;
  look.sized = i % 3 != 1;
  look.unknown_flux = i % 7 == 2 ? 0.4 : 0;
  look.size_error = i % 7 == 6 ? 0.2 : 0.02;
  look.saturated = i % 3 == 1 ? 0.4 : 0;
  look.cut = i % 6 == 2 ? 0.3 : 0;
  look.merged = i % 6 == 3 ? 0.3 : 0;
  look.striped = i % 8 == 5 ? 0.5 : 0;
  look.dark = i % 4 == 3 ? 0.25 : 0;
  look.coloured = i % 5 == 2;
  look.read_frequencies = i % 3 == 0 ? 0.8 : 0.3;
  look.read_ids = i % 11 == 7 ? 0.7 : 0;
  return look;
}

IdentifyOptions room_options(int i) {
  IdentifyOptions options;
  options.model_sigma_px = i % 3 ? 0.5 : 0.1;
  if (i % 9 == 4) options.gate_sigma = 2.5;
  if (i % 9 == 7) options.miss_penalty = 15;
  if (i % 10 == 3) options.use_brightness = false;
  if (i % 10 == 6) options.light_sigma = 0.05;
  if (i % 8 == 2) options.use_frequency = false;
  if (i % 8 == 4) options.frequency_gate_sigma = 1, options.frequency_tolerance = 0.004;
  if (i % 12 == 5) options.max_hypotheses = 40;
  if (i % 12 == 9) options.max_risk = 0.3;
  return options;
}

TEST(References, IdentifiedLampsOfRooms) {
  References references("identify/rooms");
  for (int i = 0; i < 240; ++i) {
    Random random(501, static_cast<std::uint64_t>(i));
    const Scene scene = varied_room(random, 3 + i % 10, i);
    const Rigid3 pose = random_room_pose(random, i % 2 ? 0.25 : 0.5);
    View view = look_at_lamps(scene, pose, room_look(i), random, i % 5 == 4 ? 0 : i % 7);
    if (i % 13 == 3 && !view.blobs.empty()) view.blobs.front().lamp_id = 999;  // not in the map
    IdentifyOptions options = room_options(i);
    if (i % 3 == 2)
      options.prior = prior_of(pose, 1 + random.below(31), i % 4 == 0 ? 3 : 1, random);
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Symmetric layouts: a square, a ring, a row, a grid, two heights, a lamp listed twice, and a row
/// with one lamp beside it.
Scene symmetric_room(int kind) {
  Scene scene = square_room();
  std::vector<Eigen::Vector3d> places;
  if (kind == 1)
    for (int k = 0; k < 7; ++k)
      places.push_back({2 + std::cos(2 * pi * k / 7), 2 + std::sin(2 * pi * k / 7), 3});
  if (kind == 2 || kind == 6)
    for (int k = 0; k < 5; ++k) places.push_back({1 + 0.5 * k, 2, 3});
  if (kind == 6) places.push_back({2.2, 2.7, 2.8});
  if (kind == 3)
    for (int k = 0; k < 12; ++k) places.push_back({1.2 + 0.5 * (k % 4), 1.2 + 0.5 * (k / 4), 3});
  if (kind == 4)
    for (int k = 0; k < 8; ++k) places.push_back({1.5 + k % 2, 1.5 + k / 2 % 2, k < 4 ? 3.0 : 2.6});
  if (kind == 5) places = {{1, 1, 3}, {3, 1, 3}, {1, 3, 3}, {3, 3, 3}, {3, 3, 3}, {2, 2.4, 2.7}};
  if (!places.empty()) scene.lamps.clear();
  for (const Eigen::Vector3d& place : places)
    scene.lamps.push_back(disc_lamp(static_cast<int>(scene.lamps.size()), place));
  return scene;
}

TEST(References, IdentifiedLampsOfSymmetricRooms) {
  References references("identify/symmetric_rooms");
  for (int i = 0; i < 154; ++i) {
    Random random(502, static_cast<std::uint64_t>(i));
    Scene scene = symmetric_room(i % 7);
    if (i % 4 == 1)
      for (Lamp& lamp : scene.lamps) lamp.centre_m += 0.004 * random_vector(random);
    if (i % 5 == 2) scene.lamps.back().power_w = 4;
    const Rigid3 pose = random_room_pose(random, 0.3);
    Look look;
    look.sigma_px = i % 3 ? 0.1 : 0.5;
    look.sized = i % 2 == 1;
    look.dark = i % 3 == 2 ? 0.2 : 0;
    View view = look_at_lamps(scene, pose, look, random, i % 4);
    IdentifyOptions options;
    options.model_sigma_px = i % 2 ? 0.5 : 0.1;
    if (i / 7 % 3 == 1) options.prior = prior_of(pose, 1 + random.below(31), 1, random);
    if (i / 7 % 6 == 2) {  // another place
      const Rigid3 moved = pose * Rigid3{so3_exp({0, 0, i % 2 ? 0.0 : 0.5 * pi}), {0.5, 0.1, 0.1}};
      options.prior = prior_of(moved, 1 + random.below(31), 1, random);
    }
    if (i % 11 == 7) options.prior = Prior{};
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Faint specks around lamps that show their sizes: most are left out at first.
TEST(References, IdentifiedLampsAmongSpecks) {
  References references("identify/specks");
  for (int i = 0; i < 120; ++i) {
    Random random(504, static_cast<std::uint64_t>(i));
    const Scene scene = varied_room(random, 7 + i % 5, i);
    const Rigid3 pose = random_room_pose(random);
    Look look;
    look.sized = i % 6 != 5;
    look.flux_sigma = i % 9 == 4 ? 0 : 0.05;
    look.saturated = i % 5 == 2 ? 0.3 : 0;
    look.unknown_flux = i % 4 == 3 ? 0.4 : 0;
    look.dark = i % 4 == 1 ? 0.2 : 0;
    look.read_frequencies = i % 2;
    View view = look_at_lamps(scene, pose, look, random);
    const double size = std::array<double, 3>{0.002, 0.02, 0.2}[static_cast<std::size_t>(i % 3)];
    const std::size_t lamps = view.blobs.size();
    if (i % 5 < 2 && lamps > 5) {  // a lamp that looks like a speck
      view.blobs.front().flux_dn *= 1e-3;
      view.blobs.front().flux_sigma_dn *= 1e-3;
      view.blobs.front().rim.clear();
      view.blobs.front().corners_px.clear();
    }
    for (int k = 0; k < 4 + i % 9 && lamps > 0; ++k) {
      Blob speck = spot({random.uniform(10, 630), random.uniform(10, 470)}, 0.3,
                        size * view.blobs[static_cast<std::size_t>(k) % lamps].flux_dn);
      speck.flux_sigma_dn = i % 7 == 3 ? 0 : 0.1 * speck.flux_dn;
      if (k % 5 == 4) speck.flux_dn = 0;
      view.blobs.push_back(speck);
    }
    IdentifyOptions options;
    options.model_sigma_px = 0.2;
    options.max_hypotheses = 20000;
    if (i % 10 == 9) options.prior = prior_of(pose, 8, 1, random);
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Lamps on the walls, seen by cameras of all models, some with uncertain parameters.
TEST(References, IdentifiedLampsOfCameras) {
  References references("identify/cameras");
  const std::array<Camera, 5> cameras{
      Camera::rotating_line(small_line(2400, 700)),
      Camera::fisheye(1200, 1200, 360, 360, 599.5, 599.5, {0.02, -0.003}),
      Camera::double_sphere(1200, 1200, 330, 330, 599.5, 599.5, -0.1, 0.58),
      Camera::pinhole(800, 600, 420, 430, 395, 305), Camera::rotating_line(small_line(1600, 500))};
  for (int i = 0; i < 60; ++i) {
    Random random(505, static_cast<std::uint64_t>(i));
    Scene scene = irregular_room();
    scene.lamps.clear();
    const bool turns = i % 5 == 0 || i % 5 == 4;
    scene.camera = cameras[static_cast<std::size_t>(i % 5)];
    if (i % 4 == 2) {
      const Eigen::Index n = scene.camera.parameter_covariance().rows();
      scene.camera = scene.camera.with_parameter_covariance(1e-7 * Eigen::MatrixXd::Identity(n, n));
    }
    for (int k = 0; k < 5 + i % 7; ++k) {
      const double angle = random.uniform(-pi, pi), away = random.uniform(1.5, 3);
      const Eigen::Vector3d across(std::cos(angle), std::sin(angle), 0);
      Lamp lamp = disc_lamp(k, away * across + Eigen::Vector3d(0, 0, random.uniform(0.8, 2.4)),
                            i % 3 ? 0.06 : 0.15);
      lamp.normal = turns || k % 2 ? Eigen::Vector3d(-across) : Eigen::Vector3d(0, 0, -1);
      lamp.x_axis = across.cross(lamp.normal).norm() > 0.5 ? across : Eigen::Vector3d::UnitZ();
      scene.lamps.push_back(lamp);
    }
    scene.validate();
    const Eigen::Vector3d eye(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                              turns ? 1.4 : 0.2);
    const Rigid3 pose = turns ? upright_line(eye, random.uniform(-pi, pi), 0.02)
                              : upright(eye, random.uniform(-pi, pi), random.uniform(-0.2, 0.2));
    Look look;
    look.sized = i % 2 == 1;
    look.cut = i % 6 == 3 ? 0.3 : 0;
    look.merged = i % 6 == 5 ? 0.2 : 0;
    View view = look_at_lamps(scene, pose, look, random, i % 4);
    if (i % 4 == 1) view.blobs.push_back(spot({3, 2}, 0.2, 1e3));
    IdentifyOptions options;
    options.model_sigma_px = 0.1;
    if (i % 3 == 1) options.prior = prior_of(pose, 1 + random.below(31), 1, random);
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// One or a few rectangles: the pose follows from the corners of one.
TEST(References, IdentifiedRectangles) {
  References references("identify/rectangles");
  for (int i = 0; i < 120; ++i) {
    Random random(506, static_cast<std::uint64_t>(i));
    Scene scene = random_room(random, 3 + i % 3, i % 2 ? 2.5 : 3);
    for (Lamp& lamp : scene.lamps) {
      lamp.shape = i % 7 == 4 && lamp.id == 1 ? LampShape::disc : LampShape::rectangle;
      lamp.size_m = {random.uniform(0.3, 0.7), random.uniform(0.1, 0.3)};
      if (i % 5 == 3) lamp.size_m = {0.5, 0.5};
      const double turn = random.uniform(-pi, pi);
      lamp.x_axis = {std::cos(turn), std::sin(turn), 0};
    }
    scene.validate();
    const Rigid3 pose = random_room_pose(random, 0.4);
    Look look;
    look.sigma_px = std::array<double, 3>{0.05, 0.3, 1}[static_cast<std::size_t>(i % 3)];
    look.sized = true;
    look.saturated = i % 4 == 1 ? 0.5 : 0;
    look.cut = i % 8 == 6 ? 0.3 : 0;
    look.dark = std::array<double, 3>{0.7, 0.4, 0}[static_cast<std::size_t>(i / 3 % 3)];
    look.read_ids = i % 9 == 5 ? 0.5 : 0;
    const View view = look_at_lamps(scene, pose, look, random, i % 4 == 3 ? 2 : 0);
    IdentifyOptions options;
    options.model_sigma_px = i % 2 ? 0.5 : 0.1;
    if (i % 5 < 2) options.prior = prior_of(pose, 1 + random.below(31), i % 3 ? 1 : 4, random);
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

/// Mirror images of the lamps in a wall, and brighter lamps among fainter copies.
TEST(References, IdentifiedLampsAmongReflections) {
  References references("identify/reflections");
  for (int i = 0; i < 120; ++i) {
    Random random(503, static_cast<std::uint64_t>(i));
    Scene scene = varied_room(random, 5 + i % 4, 2 * i);
    const bool is_exact = i % 4 == 2;
    if (is_exact)
      for (Lamp& lamp : scene.lamps) lamp.power_sigma = 0.002;
    const Rigid3 pose = random_room_pose(random);
    Look look;
    if (is_exact) look.flux_sigma = 0.002;
    look.dark = i % 3 == 2 ? 0.3 : 0;
    look.unknown_flux = i % 6 == 5 ? 1 : i % 6 == 3 ? 0.3 : 0;
    View view = look_at_lamps(scene, pose, look, random);
    look.unknown_flux = 0;
    Scene mirrored = scene;
    for (Lamp& lamp : mirrored.lamps) {
      if (i % 3) {  // a copy elsewhere, which has a pose as well
        lamp.centre_m += Eigen::Vector3d(i % 2 ? 0.5 : -0.4, 0.3, 0);
        continue;
      }
      lamp.centre_m.x() = (i % 2 ? 4.4 : 1) - lamp.centre_m.x();
      lamp.normal.x() = -lamp.normal.x();
    }
    look.gain = std::array<double, 4>{0.05, 0.4, 0.7, 3}[static_cast<std::size_t>(i % 4)];
    if (is_exact) look.gain = std::exp(-0.2 * random.uniform());
    look.dark = i % 5 == 4 ? 0.3 : 0;
    const View reflected = look_at_lamps(mirrored, pose, look, random, i % 3);
    view.blobs.insert(view.blobs.end(), reflected.blobs.begin(), reflected.blobs.end());
    IdentifyOptions options;
    options.model_sigma_px = 0.2;
    options.max_hypotheses = 20000;
    if (is_exact) options.light_sigma = 0.002;
    references.add(std::to_string(i), results_of(identify(view.blobs, scene, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
