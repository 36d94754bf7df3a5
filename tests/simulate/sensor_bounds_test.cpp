// SPDX-License-Identifier: Apache-2.0
// Bounds of the plan for the effects of the sensor and of light that does not come directly from
// lamps, all together in random rooms.
#include <algorithm>
#include <cmath>
#include <iostream>

#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

Lamp random_lamp(Random& random, int id, const Eigen::Vector3d& room_m) {
  Lamp lamp = disc_lamp(id, {random.uniform(0.3, 0.7) * room_m.x(),
                             random.uniform(0.3, 0.7) * room_m.y(), room_m.z() - 0.02});
  lamp.shape = static_cast<LampShape>(random.below(4));
  lamp.radius_m = random.uniform(0.02, 0.15);
  lamp.size_m = lamp.radius_m * Eigen::Vector2d(random.uniform(0.5, 2), random.uniform(0.5, 2));
  lamp.exponent = std::exp(random.uniform(0, 3));
  lamp.half_power_rad = random.uniform(0.5, 1.4);
  lamp.power_w = lamp.shape == LampShape::point ? 0.01 : 60 * lamp.area_m2();
  lamp.colour = {random.uniform(), random.uniform(), random.uniform()};
  if (random.uniform() < 0.3) lamp.frequency_hz = random.uniform(200, 2000);
  return lamp;
}

/// All effects of a room, a lens and a sensor together.
Scene random_scene(Random& random) {
  Scene scene;
  const double f = random.uniform(60, 120);
  scene.camera = Camera::pinhole(96, 72, f, f, random.uniform(40, 56), random.uniform(28, 44),
                                 {random.uniform(-0.05, 0.05), 0, 0, 0});
  scene.room = Room{{random.uniform(2, 5), random.uniform(2, 5), random.uniform(2, 4)},
                    random.uniform(0.1, 0.8)};
  for (int id = 0; id < 1 + random.below(4); ++id)
    scene.lamps.push_back(random_lamp(random, id, scene.room->size_m));
  scene.lens.veiling_glare = random.uniform(0, 0.1);
  scene.lens.vignetting = {-random.uniform(0, 0.4)};
  if (random.uniform() < 0.5)
    scene.lens.ghosts = {{random.uniform(0, 0.05), random.uniform(-1.5, -0.3), 1}};
  scene.ambient_w_m2 = random.uniform(0, 0.01);
  Sensor& sensor = scene.sensor;
  sensor.bit_depth = 14;
  sensor.full_well_e = 20000;
  sensor.gain_dn_per_e = 0.8;
  sensor.exposure_s *= std::exp(random.uniform(-1, 3.5));
  sensor.psf_sigma_px = random.uniform(0.4, 1.2);
  sensor.gain_sigma = random.uniform(0, 0.03);
  sensor.blooming = random.uniform();
  sensor.row_time_s = 1e-5;
  if (random.uniform() < 0.6) sensor.mosaic = static_cast<Mosaic>(1 + random.below(4));
  if (random.uniform() < 0.5) sensor.response = Response::srgb;
  if (sensor.mosaic != Mosaic::none && random.uniform() < 0.5)
    sensor.channels = {{random.uniform(0.3, 1), Response::linear, 2.2, {}},
                       {1, Response::gamma, random.uniform(1.2, 2.2), {}},
                       {random.uniform(0.3, 1), Response::srgb, 2.2, {}}};
  const Eigen::Vector3d corner =
      Eigen::Vector3d(random.uniform(0.4, 0.5), random.uniform(0.4, 0.5), 0.5)
          .cwiseProduct(scene.room->size_m);
  scene.boxes = {{corner, corner + Eigen::Vector3d(0.3, 0.3, 0.2)}};
  return scene;
}

Rigid3 random_pose(Random& random, const Scene& scene) {
  const Eigen::Vector3d& size = scene.room->size_m;
  const Eigen::Vector3d from(random.uniform(0.3, 0.7) * size.x(),
                             random.uniform(0.3, 0.7) * size.y(), random.uniform(0.1, 0.6));
  const Eigen::Vector3d to(0.5 * size.x(), 0.5 * size.y(), size.z());
  return look_at(from, to, Eigen::Vector3d(random.normal(), random.normal(), 0.1));
}

double max_change(const Image& a, const Image& b) {
  double change = 0;
  for (std::size_t i = 0; i < a.u16.size(); ++i)
    change = std::max(change, std::abs(static_cast<double>(a.u16[i]) - b.u16[i]));
  return change;
}

void leave_out(Effect effect, Effects& effects) {
  effects.set(effect, Use::off);
  if (effect == Effect::walls) effects.set(Effect::interreflection, Use::off);
  if (effect == Effect::saturation) effects.set(Effect::blooming, Use::off);
}

void expect_bound_holds(Effect effect, int min_changes) {
  Random random(static_cast<std::uint64_t>(effect) + 7);
  int changes = 0;
  for (int i = 0; i < 25; ++i) {
    SCOPED_TRACE(i);
    Scene scene = random_scene(random);
    const Rigid3 pose = random_pose(random, scene);
    const bool lit_by_walls = effect == Effect::interreflection || effect == Effect::walls;
    if (!lit_by_walls || i % 4 != 0)  // slow
      scene.effects.set(Effect::interreflection, Use::off);
    Scene without = scene;
    leave_out(effect, without.effects);
    const EffectPlan plan =
        plan_render(scene, pose, noiseless()).effects[static_cast<std::size_t>(effect)];
    const double change = max_change(simulate(scene, pose, noiseless()).image,
                                     simulate(without, pose, noiseless()).image);
    // Rounding, and the renderer's own error of 1e-4 of the peak.
    const double max_dn = plan.called_for ? plan.bound_dn + 1 + 1e-4 * 16383 : 0;
    EXPECT_LE(change, max_dn) << effect_name(effect);
    changes += change > 3;
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GE(changes, min_changes) << "too few cases in which it changes anything";
}

class SensorBounds : public ::testing::TestWithParam<Effect> {};

TEST_P(SensorBounds, Hold) { expect_bound_holds(GetParam(), 4); }

INSTANTIATE_TEST_SUITE_P(Effects, SensorBounds,
                         ::testing::Values(Effect::extent, Effect::light_gradient, Effect::psf,
                                           Effect::distortion, Effect::vignetting,
                                           Effect::modulation, Effect::ambient, Effect::walls,
                                           Effect::glare, Effect::ghosts, Effect::mosaic,
                                           Effect::gain, Effect::saturation, Effect::blooming,
                                           Effect::response),
                         [](const auto& info) { return std::string(effect_name(info.param)); });

TEST(SensorBoundsOf, Occlusion) { expect_bound_holds(Effect::occlusion, 4); }
TEST(SensorBoundsOf, Interreflection) { expect_bound_holds(Effect::interreflection, 2); }

}  // namespace
