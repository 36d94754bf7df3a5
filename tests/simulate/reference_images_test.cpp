// SPDX-License-Identifier: Apache-2.0
// Images, truth and plans of random scenes, compared with those of an earlier version.
#include <gtest/gtest.h>

#include "libocc/simulate/explain.hpp"
#include "libocc/simulate/plan.hpp"
#include "libocc/simulate/received_power.hpp"
#include "libocc/simulate/renderer.hpp"
#include "tests/simulate/reference_scenes.hpp"

namespace occ::test {
namespace {

void add_truth(CaseResults& results, const Rendered& rendered) {
  for (const LampTruth& lamp : rendered.lamps) {
    std::vector<double> numbers{static_cast<double>(lamp.in_view),
                                static_cast<double>(lamp.whole),
                                lamp.centre_px.x(),
                                lamp.centre_px.y(),
                                lamp.image_centre_px.x(),
                                lamp.image_centre_px.y(),
                                lamp.hidden,
                                lamp.electrons};
    results.add("lamp", numbers);
    std::vector<double> rim;
    for (const Eigen::Vector2d& px : lamp.rim_px) rim.insert(rim.end(), {px.x(), px.y()});
    results.summarise("rim", rim);
  }
  std::vector<double> lit;
  for (const PixelRectangle& r : rendered.lit)
    for (const int side : {r.x0, r.y0, r.width, r.height}) lit.push_back(side);
  results.summarise("lit", lit);
  if (rendered.background_dn)
    for (const int level : *rendered.background_dn) results.add("background", level);
}

void add_plan(CaseResults& results, const RenderPlan& plan) {
  std::string applied;
  std::vector<double> dn, px;
  for (const EffectPlan& effect : plan.effects) {
    applied += effect.applied ? "1" : effect.called_for ? "0" : "-";
    if (!effect.called_for) continue;
    dn.push_back(effect.bound_dn);
    px.push_back(effect.bound_px);
  }
  results.add("applied", "plan" + applied);
  results.add("dn", dn);
  results.add("px", px);
}

TEST(References, RenderedImagesOfRandomScenes) {
  References references("simulate/images");
  for (std::uint64_t i = 0; i < 150; ++i) {
    const RandomView view = random_view(i);
    const Rendered rendered = simulate(view.scene, view.pose, view.options);
    CaseResults results;
    add_image(results, rendered.image);
    add_truth(results, rendered);
    references.add("view " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// The bounds of effects that are called for, with a deep sensor so that they are not limited by
// full scale, and a plan with automatic choice of all.
TEST(References, PlansOfRandomScenes) {
  References references("simulate/plans");
  for (std::uint64_t i = 0; i < 160; ++i) {
    RandomView view = random_view(1000 + i, 0.2);
    Random random(3, i);
    view.scene.sensor.bit_depth = i % 2 == 0 ? 16 : 8;
    if (i % 2 == 0) view.scene.sensor.gain_dn_per_e *= 1e-2;
    if (i % 8 > 4) {  // a lamp comes into view, or not
      view.scene.room.reset();
      const Camera& camera = view.scene.camera;
      Lamp& lamp = view.scene.lamps[0];
      const Eigen::Vector2d px(camera.width() + random.uniform(0, 60), 0.5 * camera.height());
      if (const auto ray = camera.unproject(px))
        lamp.centre_m = view.pose.inverse() * Eigen::Vector3d(1.2 * ray->normalized());
      lamp.normal = view.pose.origin_in_source() - lamp.centre_m;
      Sensor& sensor = view.scene.sensor;
      if (i % 8 == 5) sensor.row_time_s = 1e-2 * sensor.exposure_s;
      const double duration_s = sensor.exposure_s + camera.height() * sensor.row_time_s;
      view.options.velocity[1] = -log_uniform(random, 0.01, 1) / duration_s;
    }
    if (i % 8 == 4) {  // lamps partly outside of the lens's domain
      view.scene.camera = Camera::fisheye(90, 90, 30, 30, 45, 45, {-0.1, 0.01});
      for (Lamp& lamp : view.scene.lamps) {
        lamp.centre_m = view.pose.origin_in_source() +
                        random.uniform(0.4, 0.8) * random_vector(random).normalized();
        lamp.radius_m = 0.1;
        lamp.normal = view.pose.origin_in_source() - lamp.centre_m;
      }
      view.scene.room.reset();
      view.scene.boxes.clear();
    }
    CaseResults results;
    add_plan(results, plan_render(view.scene, view.pose, view.options));
    for (std::size_t k = 0; k < effect_count; ++k)
      if (view.scene.effects.use[k] == Use::on) view.scene.effects.use[k] = Use::automatic;
    view.scene.effects.tolerance_dn = log_uniform(random, 1e-3, 100);
    view.scene.effects.tolerance_px = log_uniform(random, 1e-3, 5);
    add_plan(results, plan_render(view.scene, view.pose, view.options));
    if (i % 8 == 0) add_image(results, simulate(view.scene, view.pose, view.options).image);
    references.add("view " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PositionBoundsOfExplanations) {
  References references("simulate/explanations");
  for (std::uint64_t i = 0; i < 60; ++i) {
    RandomView view = random_view(2000 + i);
    Random random(4, i);
    while (view.scene.lamps.size() < 3 + i % 4)
      view.scene.lamps.push_back(random_lamp(static_cast<int>(view.scene.lamps.size()),
                                             view.scene.camera, view.pose, random));
    std::vector<double> bounds;
    for (const ExplainedEffect& effect : explain(view.scene, view.pose, view.options, 0).effects)
      bounds.push_back(effect.position_bound_m);
    CaseResults results;
    results.add("bounds", bounds);
    references.add("view " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// One renderer and one image for all frames: noise areas, poses and options vary.
TEST(References, SequencesOfFrames) {
  References references("simulate/sequences");
  for (std::uint64_t i = 0; i < 30; ++i) {
    RandomView view = random_view(3000 + i);
    if (i % 5 != 0) view.options.velocity.setZero();
    Renderer renderer(view.scene);
    Rendered rendered;
    CaseResults results;
    for (std::uint32_t frame = 0; frame < 6; ++frame) {
      Random random(i, frame);
      view.options.frame = frame;
      view.options.noise = frame % 3 != 1;
      view.options.noise_area = frame < 3 ? NoiseArea::around_lamps : NoiseArea::everywhere;
      view.options.start_s += 1e-3;
      Rigid3 moved = view.pose;
      moved.translation += 0.02 * random_vector(random);
      renderer.render(moved, view.options, rendered);
      results.add("frame", sums_of_parts(rendered.image));
    }
    add_truth(results, rendered);
    references.add("sequence " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// Rooms that lamps light which are not in view, so that the walls have most of the grey levels.
TEST(References, ImagesOfWalls) {
  References references("simulate/walls");
  for (std::uint64_t i = 0; i < 8; ++i) {
    Random random(7, i);
    Scene scene;
    const double f = log_uniform(random, 40, 500);
    scene.camera = Camera::pinhole(80, 60, f, f, 39.5, 29.5);
    scene.room = Room{{random.uniform(3, 6), random.uniform(3, 6), 3}, random.uniform(0.2, 0.9)};
    const Eigen::Vector3d size_m = scene.room->size_m, eye = 0.5 * size_m;
    const Eigen::Vector3d towards = random_vector(random).normalized();
    const Rigid3 pose = look_at(eye, eye + towards, Eigen::Vector3d::UnitZ());
    for (int k = 0; k < 3; ++k) {
      Lamp lamp = random_lamp(k, scene.camera, pose, random);
      lamp.centre_m = eye - random.uniform(0.2, 1) * towards + 0.3 * random_vector(random);
      lamp.centre_m = lamp.centre_m.cwiseMax(0.05).cwiseMin(0.98 * size_m);
      lamp.normal = random_vector(random);
      scene.lamps.push_back(lamp);
    }
    const double typical_w_m2 = 0.05 / square(2 * scene.sensor.f_number);
    scene.sensor.full_well_e = 20 * scene.sensor.electrons(typical_w_m2);
    scene.sensor.bit_depth = 16;
    scene.sensor.gain_dn_per_e = 6e4 / scene.sensor.full_well_e;
    if (i % 2 == 0) scene.lens.vignetting = {-0.3};
    if (i % 4 == 1) scene.effects.set(Effect::interreflection, Use::off);
    if (i % 4 == 2) scene.boxes = {{eye + 0.2 * towards, eye + 0.2 * towards + eye / 9}};
    CaseResults results;
    add_image(results, simulate(scene, pose, noiseless()).image);
    add_plan(results, plan_render(scene, pose, noiseless()));
    references.add("room " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// Panoramas, whose images continue at the other end.
TEST(References, ImagesOfPanoramas) {
  References references("simulate/panoramas");
  for (std::uint64_t i = 0; i < 12; ++i) {
    RandomView view = random_view(4000 + i, 0.1);
    Random random(5, i);
    Scene& scene = view.scene;
    RotatingLine line = small_line(300, 100);
    scene.camera = i % 2 == 0 ? Camera::rotating_line(line)
                              : Camera::equirectangular(300, 100, 2 * pi / 300, 40, 149.5, 50);
    scene.boxes.clear();
    scene.lens.ghosts.clear();
    scene.effects = Effects{};
    view.options.velocity.setZero();
    view.pose = upright_line({2, 2, 1}, random.uniform(-3, 3));
    scene.lamps.clear();
    for (int k = 0; k < 5; ++k) {
      Lamp lamp = random_lamp(k, scene.camera, view.pose, random);
      lamp.normal = view.pose.origin_in_source() - lamp.centre_m;
      scene.lamps.push_back(lamp);
    }
    scene.sensor.full_well_e = 2 * brightest_e(scene, view.pose);
    scene.sensor.gain_dn_per_e = scene.sensor.full_scale_dn() / scene.sensor.full_well_e;
    CaseResults results;
    const Rendered rendered = simulate(scene, view.pose, view.options);
    add_image(results, rendered.image);
    add_truth(results, rendered);
    add_plan(results, plan_render(scene, view.pose, view.options));
    references.add("panorama " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, ReceivedPowerOfRandomScenes) {
  References references("simulate/received_power");
  for (std::uint64_t i = 0; i < 60; ++i) {
    const RandomView view = random_view(5000 + i, 0.3);
    std::vector<Rigid3> poses{view.pose};
    Random random(6, i);
    for (int k = 0; k < 3; ++k) {
      poses.push_back(view.pose);
      poses.back().translation += 0.2 * random_vector(random);
    }
    const Lamp& lamp = view.scene.lamps[0];
    const Eigen::Vector3d behind = lamp.centre_m - 0.4 * lamp.normal.normalized();
    poses.push_back(look_at(behind, lamp.centre_m, Eigen::Vector3d(0.1, 0.3, 1)));
    if (!view.scene.boxes.empty()) {
      const Box& box = view.scene.boxes[0];
      const Eigen::Vector3d inside = 0.4 * box.min_m + 0.6 * box.max_m;
      poses.push_back(look_at(inside, lamp.centre_m, Eigen::Vector3d(0.1, 0.3, 1)));
    }
    CaseResults results;
    for (const ReceivedPower& power : received_power(view.scene, poses)) {
      std::vector<double> numbers{power.total_w(), static_cast<double>(power.visible())};
      for (const ReceivedLamp& lamp : power.lamps)
        numbers.insert(numbers.end(), {lamp.power_w, static_cast<double>(lamp.whole)});
      results.add("power", numbers);
    }
    references.add("scene " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
