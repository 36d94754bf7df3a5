// SPDX-License-Identifier: Apache-2.0
// Bounds of effects in views where each effect is large: the change by the effect reaches a known
// part of its bound, so a bound that is far too large or too small is noticed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ {
namespace {

/// A disc of 14 px on the optical axis at 2 m, with 14 bits that it does not saturate.
struct TightView {
  Scene scene;
  Rigid3 pose;
  SimulateOptions options = test::noiseless();

  TightView() {
    scene.camera = Camera::pinhole(160, 120, 280, 280, 79.6, 59.7);
    scene.lamps = {test::disc_lamp(0, {0, 0, 2}, 0.1)};
    scene.lamps[0].normal = {0, 0, -1};
    scene.sensor.bit_depth = 16;
    scene.sensor.black_level_dn = 0;
    scene.sensor.psf_sigma_px = 0.8;
    scene.sensor.full_well_e = 1e5;
    scene.sensor.gain_dn_per_e = 0.6;
    scene.sensor.read_noise_e = 5;
    expose(3e4);
  }

  /// Sets the lamps' power so that the first one has this many electrons in a whole pixel.
  void expose(double electrons) {
    scene.validate();
    const auto px = scene.camera.project(pose * scene.lamps[0].centre_m);
    const double now = scene.sensor.electrons(
        irradiance_at(scene.lamps[0], pose, scene.camera, scene.sensor, *px));
    for (Lamp& lamp : scene.lamps) lamp.power_w *= electrons / now;
  }

  EffectPlan plan(Effect effect) const {
    return plan_render(scene, pose, options).effects[static_cast<std::size_t>(effect)];
  }
  Eigen::MatrixXd image() const {
    const Image seen = simulate(scene, pose, options).image;
    Eigen::MatrixXd values(seen.width, seen.height);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x) values(x, y) = seen.u16[y * seen.width + x];
    return values;
  }
};

Eigen::Vector2d centre_of_light(const Eigen::MatrixXd& image) {
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int y = 0; y < image.cols(); ++y)
    for (int x = 0; x < image.rows(); ++x) moment += image(x, y) * Eigen::Vector2d(x, y);
  return moment / image.sum();
}

/// Bound over change, in grey levels and in pixels.
struct Tightness {
  double dn = 0, px = 0;
};

Tightness tightness(Effect effect, const std::function<void(TightView&)>& change) {
  TightView view;
  change(view);
  view.scene.validate();
  const EffectPlan plan = view.plan(effect);
  EXPECT_TRUE(plan.called_for);
  const Eigen::MatrixXd with = view.image();
  view.scene.effects.set(effect, Use::off);
  const Eigen::MatrixXd without = view.image();
  return {plan.bound_dn / (with - without).cwiseAbs().maxCoeff(),
          plan.bound_px / (centre_of_light(with) - centre_of_light(without)).norm()};
}

void aside(TightView& view, double x, double y) {
  view.scene.lamps[0].centre_m = {x, y, 2};
  view.expose(3e4);
}

/// Expects a bound that holds, up to rounding, and exceeds the change by at most these factors.
/// Zero: the view is symmetric, so that the centroid hardly moves.
void expect_tight(Effect effect, double max_dn, double max_px,
                  const std::function<void(TightView&)>& change) {
  const Tightness found = tightness(effect, change);
  EXPECT_GT(found.dn, 0.98) << effect_name(effect);
  EXPECT_LT(found.dn, max_dn) << effect_name(effect);
  if (max_px == 0) return;
  EXPECT_GT(found.px, 0.92) << effect_name(effect);
  EXPECT_LT(found.px, max_px) << effect_name(effect);
}

void move_aside(TightView& view) { aside(view, 0.35, 0.2); }

void tilt(TightView& view, double slope, double radius_m) {
  view.scene.lamps[0].radius_m = radius_m;
  view.scene.lamps[0].normal = Eigen::Vector3d(slope, 0.1, -1).normalized();
  view.expose(3e4);
}

TEST(TightBounds, OfTheLamp) {
  expect_tight(Effect::light_gradient, 2.3, 3.8, [](TightView& v) {
    v.scene.lamps[0].half_power_rad = 0.5;
    tilt(v, 0.8, 0.1);
  });
  expect_tight(Effect::extent, 4.8, 1.4, [](TightView& v) { tilt(v, 1.6, 0.01); });
  // Square waves of half a period in each exposure, and much faster than the readout.
  for (const double row_time_s : {0.0, 2e-5})
    expect_tight(Effect::modulation, 1.3, row_time_s > 0 ? 4.8 : 0, [&](TightView& v) {
      v.scene.lamps[0].frequency_hz = row_time_s > 0 ? 2000 : 300;
      v.scene.lamps[0].duty = 0.5;
      v.scene.sensor.exposure_s = row_time_s > 0 ? 1e-4 : 0.00167;
      v.scene.sensor.row_time_s = row_time_s;
      v.expose(3e4);
    });
}

TEST(TightBounds, OfTheLens) {
  expect_tight(Effect::vignetting, 1.6, 2.1, [](TightView& v) {
    v.scene.lens.vignetting = {-0.4};
    move_aside(v);
  });
  expect_tight(Effect::distortion, 1.8, 2.4, [](TightView& v) {
    v.scene.camera = Camera::pinhole(160, 120, 280, 280, 79.6, 59.7, {-0.1, 0, 0, 0});
    move_aside(v);
  });
  expect_tight(Effect::psf, 4.8, 0, [](TightView&) {});
  expect_tight(Effect::glare, 1.4, 0, [](TightView& v) { v.scene.lens.veiling_glare = 0.1; });
  expect_tight(Effect::ghosts, 1.6, 0, [](TightView& v) {
    v.scene.lens.ghosts = {{0.05, -0.8, 1}};
    aside(v, 0.3, 0.2);
  });
}

TEST(TightBounds, OfTheMotion) {
  expect_tight(Effect::motion_blur, 3.2, 1.4, [](TightView& v) {
    v.options.velocity << 0, 0.05, 0, 0.02, 0, 0;
    v.scene.sensor.exposure_s = 0.05;
    v.expose(3e4);
  });
  expect_tight(Effect::motion_blur, 1.4, 0, [](TightView& v) {
    v.scene.sensor.psf_sigma_px = 2;
    v.scene.sensor.exposure_s = 0.1;
    v.options.velocity << 0, 0.1, 0, 0, 0, 0;  // 2.8 px
    v.expose(3e4);
    v.scene.lamps[0].shape = LampShape::point;
    v.scene.lamps[0].power_w *= 0.01;
  });
  expect_tight(Effect::rolling_shutter, 2.0, 1.6, [](TightView& v) {
    v.options.velocity << 0, 0.5, 0, 0, 0, 0;
    v.scene.sensor.row_time_s = 1e-4;
  });
}

void in_a_room(TightView& view) {
  view.scene.room = Room{{3, 3, 2.2}, 0.6};
  view.scene.lamps[0].centre_m = {1.5, 1.5, 2.1};
  view.pose = look_at({1.4, 1.3, 0.3}, {1.5, 1.5, 2.1}, {0, 1, 0});
  view.expose(3e4);
}

TEST(TightBounds, OfTheRoom) {
  expect_tight(Effect::ambient, 1.05, 0, [](TightView& v) { v.scene.ambient_w_m2 = 0.2; });
  expect_tight(Effect::occlusion, 1.3, 6.5, [](TightView& v) {
    v.scene.boxes = {{{-0.2, -0.05, 1}, {0.0, 0.1, 1.1}}};
  });
  TightView view;
  in_a_room(view);
  const EffectPlan walls = view.plan(Effect::walls), more = view.plan(Effect::interreflection);
  const Eigen::MatrixXd all = view.image();
  view.scene.effects.set(Effect::interreflection, Use::off);
  const Eigen::MatrixXd once = view.image();
  view.scene.effects.set(Effect::walls, Use::off);
  const Eigen::MatrixXd none = view.image();
  const double indirect = (all - once).cwiseAbs().maxCoeff();
  const double both = (all - none).cwiseAbs().maxCoeff();
  ASSERT_GT(indirect, 3);
  EXPECT_GE(more.bound_dn, indirect - 1);
  EXPECT_LT(more.bound_dn, 4.4 * indirect);
  EXPECT_GE(walls.bound_dn, both - 1);
  EXPECT_LT(walls.bound_dn, 7.5 * both);
}

TEST(TightBounds, OfTheSensor) {
  expect_tight(Effect::gain, 2.4, 0, [](TightView& v) { v.scene.sensor.gain_sigma = 0.02; });
  expect_tight(Effect::saturation, 1.35, 0, [](TightView& v) {
    v.scene.sensor.full_well_e = 2e4;
    v.scene.sensor.gain_dn_per_e = 1;
  });
  expect_tight(Effect::blooming, 2.1, 0, [](TightView& v) {
    v.scene.sensor.full_well_e = 2.8e4;
    v.scene.sensor.blooming = 1;
    aside(v, 0, 0.3);
  });
  expect_tight(Effect::response, 1.02, 0,
               [](TightView& v) { v.scene.sensor.response = Response::srgb; });
  expect_tight(Effect::mosaic, 1.3, 0, [](TightView& v) {
    v.scene.sensor.mosaic = static_cast<Mosaic>(1);
    v.scene.lamps[0].colour = {1, 0.5, 0.2};
  });
}

// A ghost of scale -1 is a second image of the lamp, so its bounds are those of the lamp times its
// strength.
TEST(TightBounds, OfGhostsAddToThoseOfLamps) {
  for (const Effect effect : {Effect::psf, Effect::light_gradient}) {
    TightView view;
    view.scene.lamps[0].half_power_rad = 0.5;
    tilt(view, 0.8, 0.1);
    const double alone = view.plan(effect).bound_dn;
    view.scene.lens.ghosts = {{0.5, -1, 1}};
    EXPECT_NEAR(view.plan(effect).bound_dn / alone, 1.5, 0.03) << effect_name(effect);
    view.scene.lens.ghosts = {{0, -1, 1}};
    EXPECT_EQ(view.plan(effect).bound_dn, alone) << effect_name(effect);
  }
}

// Independent factors of standard deviation p move the centroid of a disc by p / (2 sqrt(pi)) along
// each axis, for any radius. The bound covers rare cases, not impossible ones.
TEST(TightBounds, OfTheGainsCentroidIsSomeSigmas) {
  TightView view;
  view.scene.sensor.gain_sigma = 0.02;
  const double sigma = 0.02 / (2 * std::sqrt(pi));
  EXPECT_GT(view.plan(Effect::gain).bound_px, 4 * sigma);
  EXPECT_LT(view.plan(Effect::gain).bound_px, 7 * sigma);
  // A long disc: the deviation along it is larger by the root of its axis ratio.
  const double round = view.plan(Effect::gain).bound_px;
  tilt(view, 2.5, 0.1);
  EXPECT_NEAR(view.plan(Effect::gain).bound_px / round, std::pow(1 + 2.5 * 2.5, 0.25), 0.15);
}

// One standard deviation of a pixel, and of the length of the centroid's error.
TEST(TightBounds, OfNoiseIsItsStandardDeviation) {
  TightView view;
  view.scene.sensor.read_noise_e = 20;
  const Eigen::MatrixXd mean = view.image() / view.scene.sensor.gain_dn_per_e;
  view.options.noise = true;
  const EffectPlan plan = view.plan(Effect::noise);
  const double floor_e2 = 20 * 20;
  EXPECT_NEAR(plan.bound_dn,
              view.scene.sensor.gain_dn_per_e * std::sqrt(floor_e2 + mean.maxCoeff()),
              0.05 * plan.bound_dn);
  const Eigen::Vector2d centre = centre_of_light(mean);
  double squares = 0;
  for (int y = 0; y < mean.cols(); ++y)
    for (int x = 0; x < mean.rows(); ++x) {
      const double distance2 = (Eigen::Vector2d(x, y) - centre).squaredNorm();
      if (distance2 < 16 * 16) squares += distance2 * (floor_e2 + mean(x, y));
    }
  EXPECT_NEAR(plan.bound_px, std::sqrt(squares) / mean.sum(), 0.2 * plan.bound_px);
}

// Saturation cuts off the light beyond the full well. The centroid moves by at most the lamp's
// radius times the lost share.
TEST(TightBounds, OfSaturationsCentroidFollowsTheLostLight) {
  TightView view;
  view.scene.sensor.full_well_e = 2e4;
  EXPECT_NEAR(view.plan(Effect::saturation).bound_px, 14 * 0.5, 1);
  view.scene.sensor.full_well_e = 1e4;
  EXPECT_NEAR(view.plan(Effect::saturation).bound_px, 14, 0.5);
  view.scene.sensor.full_well_e = 4e4;
  EXPECT_EQ(view.plan(Effect::saturation).bound_px, 0);
  EXPECT_EQ(view.plan(Effect::saturation).bound_dn, 0);
}

// Ambient light and dark current take a part of the full well, so that the lamp exceeds it.
TEST(TightBounds, OfSaturationIncludesTheBackground) {
  for (const bool dark_current : {false, true}) {
    TightView view;
    view.scene.sensor.full_well_e = 3.4e4;
    EXPECT_EQ(view.plan(Effect::saturation).bound_dn, 0);
    if (dark_current) {
      view.scene.sensor.dark_current_e_per_s = 1e4 / view.scene.sensor.exposure_s;
    } else {
      view.scene.ambient_w_m2 = 100;
      TightView ambient = view;
      ambient.scene.lamps.clear();
      ambient.scene.sensor.full_well_e = 1e9;
      ambient.scene.sensor.gain_dn_per_e = 1e-3;
      view.scene.ambient_w_m2 *= 1e4 / (ambient.image()(0, 0) / 1e-3);
    }
    const double lost_dn = 0.6 * (3e4 + 1e4 - 3.4e4);
    EXPECT_NEAR(view.plan(Effect::saturation).bound_dn, lost_dn, 0.25 * lost_dn) << dark_current;
    view.scene.sensor.blooming = 1;
    EXPECT_GT(view.plan(Effect::blooming).bound_dn, lost_dn) << dark_current;
  }
}

// Charge fills the pixels above and below up to the full well: half of it goes each way.
TEST(TightBounds, OfBloomingsCentroidIsTheReachOfTheCharge) {
  TightView view;
  view.scene.sensor.full_well_e = 2.5e4;
  view.scene.sensor.blooming = 1;
  const double bound = view.plan(Effect::blooming).bound_px;
  const Eigen::MatrixXd with = view.image();
  view.scene.effects.set(Effect::blooming, Use::off);
  const Eigen::MatrixXd change = with - view.image();
  int reach = 0;
  for (int y = 0; y < change.cols(); ++y)
    if (change.col(y).maxCoeff() > 1) reach = std::max(reach, std::abs(y - 60));
  EXPECT_GE(bound, reach);
  EXPECT_LT(bound, 4 * reach);
  view.scene.effects.set(Effect::blooming, Use::on);
  view.scene.sensor.full_well_e = 4e4;  // no pixel overflows
  EXPECT_EQ(view.plan(Effect::blooming).bound_dn, 0);
  view.scene.sensor.full_well_e = 20;  // all of the image does
  EXPECT_LE(view.plan(Effect::blooming).bound_px, 120);
  EXPECT_GE(view.plan(Effect::blooming).bound_px, 60);
}

// Changes of two lamps add where their images overlap, and only there. The images are wide by the
// lamp, by the PSF or by defocus.
TEST(TightBounds, OfLampsAddWhereTheirImagesOverlap) {
  for (const int wide_by : {0, 1, 2}) {
    TightView view;
    if (wide_by == 1) view.scene.sensor.psf_sigma_px = 3;
    if (wide_by == 2) {
      view.scene.lens.focus_distance_m = 1;
      view.scene.sensor.pixel_pitch_m = 1e-5;
      view.scene.sensor.f_number = 0.03;
    }
    view.expose(3e4);
    const double alone = view.plan(Effect::psf).bound_dn;
    const Eigen::MatrixXd image = view.image();
    double radius_px = 0;
    for (int x = 0; x < image.rows(); ++x)
      if (image(x, 60) > 1e-4 * image.maxCoeff())
        radius_px = std::max(radius_px, std::abs(x - 79.6));
    EXPECT_GT(radius_px, wide_by == 0 ? 14 : 20);
    const double sigma_px = view.scene.sensor.psf_sigma_px;
    for (const bool overlap : {true, false}) {
      const double apart_px = overlap ? 2 * radius_px - 1 : 2 * (radius_px + 3 * sigma_px) + 5;
      TightView two = view;
      two.scene.lamps.push_back(two.scene.lamps[0]);
      two.scene.lamps[1].id = 1;
      for (const int k : {0, 1}) two.scene.lamps[k].centre_m.x() = (k - 0.5) * apart_px / 140;
      two.scene.validate();
      EXPECT_NEAR(two.plan(Effect::psf).bound_dn / alone, overlap ? 2 : 1, 0.05)
          << wide_by << ' ' << apart_px;
    }
  }
}

// The lines above and below a point see its blur from poses of their own, also if the line of the
// point itself is the first one.
TEST(TightBounds, OfARollingShutterIncludeTheLinesThatSeeTheBlur) {
  TightView view;
  view.scene.sensor.psf_sigma_px = 4;
  view.scene.sensor.row_time_s = 1e-4;
  view.scene.lamps[0].shape = LampShape::point;
  view.scene.lamps[0].centre_m = {0, -59.5 / 140, 2};
  view.options.velocity << 0, 2, 0, 0, 0, 0;
  view.scene.validate();
  const double bound_dn = view.plan(Effect::rolling_shutter).bound_dn;
  const Eigen::MatrixXd with = view.image();
  view.scene.effects.set(Effect::rolling_shutter, Use::off);
  const double change = (with - view.image()).cwiseAbs().maxCoeff();
  EXPECT_GT(change, 5);
  EXPECT_GT(bound_dn, change);
}

/// A scene with nearly all effects, none of which makes another one large.
TightView with_all_effects() {
  TightView view;
  Scene& scene = view.scene;
  scene.camera = Camera::pinhole(80, 60, 140, 140, 39.6, 29.7, {-0.02, 0, 0, 0});
  scene.lamps.push_back(test::disc_lamp(1, {0.35, 0.2, 2.1}, 0.05));
  for (Lamp& lamp : scene.lamps) {
    lamp.normal = {0.2, 0.1, -1};
    lamp.colour = {1, 0.8, 0.5};
  }
  for (Lamp& lamp : scene.lamps) {
    lamp.frequency_hz = 900;
    lamp.duty = 0.5;
  }
  scene.boxes = {{{-0.2, -0.05, 1}, {0.0, 0.03, 1.1}}};
  scene.lens.vignetting = {-0.2};
  scene.lens.veiling_glare = 0.05;
  scene.lens.ghosts = {{0.05, -0.8, 1}};
  scene.ambient_w_m2 = 0.02;
  Sensor& sensor = scene.sensor;
  sensor.row_time_s = 1e-5;
  sensor.exposure_s = 3e-4;
  sensor.gain_sigma = 0.01;
  sensor.full_well_e = 2.5e4;
  sensor.blooming = 0.5;
  sensor.response = Response::srgb;
  sensor.mosaic = Mosaic::rggb;
  view.options.velocity << 0.1, -0.2, 0.1, 0.1, 0.1, 0;
  view.expose(3e4);
  return view;
}

// Dark current is no light: it adds to no bound on the change of light.
TEST(TightBounds, DoNotIncludeDarkCurrent) {
  TightView view;
  in_a_room(view);
  view.scene.lens.veiling_glare = 0.05;
  view.scene.lens.ghosts = {{0.05, -0.8, 1}};
  view.scene.ambient_w_m2 = 0.02;
  view.scene.sensor.full_well_e = 1e9;
  const RenderPlan plan = plan_render(view.scene, view.pose, view.options);
  view.scene.sensor.dark_current_e_per_s = 1e4 / view.scene.sensor.exposure_s;
  const RenderPlan dark = plan_render(view.scene, view.pose, view.options);
  for (std::size_t i = 0; i < effect_count; ++i) {
    if (plan.effects[i].effect == Effect::noise) continue;
    EXPECT_NEAR(plan.effects[i].bound_dn, dark.effects[i].bound_dn, 1e-6)
        << effect_name(plan.effects[i].effect);
    EXPECT_EQ(plan.effects[i].bound_px, dark.effects[i].bound_px);
  }
  EXPECT_GT(plan.effects[static_cast<std::size_t>(Effect::ambient)].bound_dn, 1);
}

// An effect that is off changes neither the image nor the bounds of other effects. Bounds need not
// depend on effects that change them a little only; they are then too large, not too small.
TEST(Effects, ThatAreOffAreAsIfTheirCauseWasAbsent) {
  struct Cause {
    Effect effect;
    bool counts;  ///< the bounds of all others depend on it
    std::function<void(Scene&)> remove;
  };
  const Cause causes[] = {
      {Effect::distortion, false,
       [](Scene& s) { s.camera = Camera::pinhole(80, 60, 140, 140, 39.6, 29.7); }},
      {Effect::vignetting, true, [](Scene& s) { s.lens.vignetting.clear(); }},
      {Effect::modulation, false,
       [](Scene& s) {
         for (Lamp& lamp : s.lamps) {
           lamp.frequency_hz.reset();
           lamp.power_w *= lamp.duty;
         }
       }},
      {Effect::occlusion, true, [](Scene& s) { s.boxes.clear(); }},
      {Effect::ambient, true, [](Scene& s) { s.ambient_w_m2 = 0; }},
      {Effect::glare, true, [](Scene& s) { s.lens.veiling_glare = 0; }},
      {Effect::ghosts, true, [](Scene& s) { s.lens.ghosts.clear(); }},
      {Effect::mosaic, true, [](Scene& s) { s.sensor.mosaic = Mosaic::none; }},
      {Effect::gain, false, [](Scene& s) { s.sensor.gain_sigma = 0; }},
      {Effect::blooming, true, [](Scene& s) { s.sensor.blooming = 0; }},
      {Effect::response, false, [](Scene& s) { s.sensor.response = Response::linear; }},
  };
  for (const Cause& cause : causes) {
    SCOPED_TRACE(effect_name(cause.effect));
    TightView off = with_all_effects(), absent = off;
    off.scene.effects.set(cause.effect, Use::off);
    cause.remove(absent.scene);
    const RenderPlan plan = plan_render(off.scene, off.pose, off.options);
    const RenderPlan expected = plan_render(absent.scene, absent.pose, absent.options);
    for (std::size_t i = 0; i < effect_count; ++i) {
      const EffectPlan &a = plan.effects[i], &b = expected.effects[i];
      if (a.effect == cause.effect) continue;
      SCOPED_TRACE(effect_name(a.effect));
      EXPECT_GE(a.bound_dn, 0.99 * b.bound_dn);
      EXPECT_GE(a.bound_px, 0.99 * b.bound_px);
      if (cause.effect == Effect::modulation && a.effect == Effect::motion_blur) {
        EXPECT_LE(a.bound_px, 1.000001 * b.bound_px);
      }
      if (!cause.counts) continue;
      EXPECT_LE(a.bound_dn, 1.000001 * b.bound_dn);
      EXPECT_LE(a.bound_px, 1.000001 * b.bound_px);
    }
    EXPECT_LE((off.image() - absent.image()).cwiseAbs().maxCoeff(), 1);
  }
}

}  // namespace
}  // namespace occ
