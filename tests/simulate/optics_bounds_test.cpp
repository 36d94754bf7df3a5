// SPDX-License-Identifier: Apache-2.0
// Bounds of the plan for the effects that form a lamp's image. Images with and without an effect,
// with fine quantisation, must not differ by more than the bounds, over random scenes and poses.
#include <algorithm>
#include <cmath>
#include <iostream>

#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

struct Case {
  Scene scene;
  Rigid3 pose;
  SimulateOptions options;
};

void add_lamps(Random& random, int count, double size, Scene& scene) {
  for (int id = 0; id < count; ++id) {
    Lamp lamp = disc_lamp(id, {random.uniform(-0.6, 0.6), random.uniform(-0.45, 0.45), 2});
    lamp.shape = static_cast<LampShape>(random.below(4));
    lamp.radius_m = size * std::exp(random.uniform(-2, 0));
    lamp.size_m = lamp.radius_m * Eigen::Vector2d(random.uniform(0.5, 2), random.uniform(0.5, 2));
    lamp.exponent = std::exp(random.uniform(0, 3));
    lamp.normal = Eigen::Vector3d(0.4 * random.normal(), 0.4 * random.normal(), -1);
    lamp.x_axis = {1, random.normal(), 0};
    lamp.half_power_rad = random.uniform(0.3, 1.4);
    // Extended lamps have similar brightness, not similar power.
    lamp.power_w = lamp.shape == LampShape::point ? 0.01 : 100 * lamp.area_m2();
    scene.lamps.push_back(lamp);
  }
}

Case random_case(Random& random, int lamps, double size) {
  Case c;
  const double f = random.uniform(200, 300);
  c.scene.camera = Camera::pinhole(192, 144, f, f * random.uniform(0.9, 1.1),
                                   random.uniform(60, 120), random.uniform(40, 100));
  c.scene.sensor.psf_sigma_px = random.uniform(0.3, 1.2);
  add_lamps(random, lamps, size, c.scene);
  c.pose = {so3_exp({0.2 * random.normal(), 0.2 * random.normal(), random.normal()}),
            {0.3 * random.normal(), 0.3 * random.normal(), 0.2 * random.normal()}};
  c.scene.validate();
  c.options.noise = false;
  return c;
}

/// A finely quantised sensor that the scene does not saturate.
void quantise_finely(Effect effect, Case& c) {
  Sensor& sensor = c.scene.sensor;
  double all_e = 1e-3;
  for (const Lamp& lamp : c.scene.lamps)
    all_e += lamp_electrons(lamp, c.pose, c.scene.camera, sensor);
  Scene without = c.scene;
  without.effects.set(effect, Use::off);
  for (int i = 0; i < 2; ++i) {
    sensor.gain_dn_per_e = 60000 / all_e;
    sensor.bit_depth = 16;
    sensor.black_level_dn = 0;
    sensor.full_well_e = 10 * all_e;
    without.sensor = sensor;
    double brightest = 1;
    for (const Scene& scene : {without, c.scene})
      for (const std::uint16_t value : simulate(scene, c.pose, c.options).image.u16)
        brightest = std::max<double>(brightest, value);
    all_e *= 2 * brightest / 60000;
  }
}

Eigen::MatrixXd image_of(const Case& c) {
  const Image image = simulate(c.scene, c.pose, c.options).image;
  Eigen::MatrixXd values(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) values(x, y) = image.u16[y * image.width + x];
  return values;
}

Eigen::Vector2d centroid(const Eigen::MatrixXd& image) {
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int y = 0; y < image.cols(); ++y)
    for (int x = 0; x < image.rows(); ++x) moment += image(x, y) * Eigen::Vector2d(x, y);
  return moment / image.sum();
}

bool is_inside(const Eigen::MatrixXd& image) {
  return image.row(0).maxCoeff() + image.row(image.rows() - 1).maxCoeff() +
             image.col(0).maxCoeff() + image.col(image.cols() - 1).maxCoeff() <
         1;
}

/// Collects the ratios of the bounds to the changes.
class Slack {
 public:
  void add(double bound, double change, double least) {
    if (change > least) ratios_.push_back(bound / change);
  }
  double median() {
    if (ratios_.empty()) return 0;
    std::sort(ratios_.begin(), ratios_.end());
    return ratios_[ratios_.size() / 2];
  }
  std::size_t size() const { return ratios_.size(); }

 private:
  std::vector<double> ratios_;
};

struct Slacks {
  Slack dn, px;
};

void compare(Case c, Effect effect, Slacks& slacks) {
  quantise_finely(effect, c);
  const EffectPlan plan =
      plan_render(c.scene, c.pose, c.options).effects[static_cast<std::size_t>(effect)];
  const Eigen::MatrixXd with = image_of(c);
  c.scene.effects.set(effect, Use::off);
  const Eigen::MatrixXd without = image_of(c);
  const double change = (with - without).cwiseAbs().maxCoeff();
  if (!plan.called_for) {
    EXPECT_EQ(change, 0);
    return;
  }
  // Rounding, and the renderer's own error of 1e-4 of a lamp's peak.
  EXPECT_LE(change, 1.001 * plan.bound_dn + 7.5) << effect_name(effect);
  if (std::isfinite(plan.bound_dn)) slacks.dn.add(plan.bound_dn, change, 100);
  if (c.scene.lamps.size() != 1 || !is_inside(with) || !is_inside(without)) return;
  if (!(with.sum() > 20000) || !(without.sum() > 20000)) return;
  const double moved = (centroid(with) - centroid(without)).norm();
  // The rounding of each pixel moves the centroid.
  const double lit = static_cast<double>((with.array() > 0).count());
  const double rounding = 3 * std::sqrt(lit) * 20 / std::min(with.sum(), without.sum());
  EXPECT_LE(moved, 1.001 * plan.bound_px + rounding + 1e-4) << effect_name(effect);
  if (std::isfinite(plan.bound_px)) slacks.px.add(plan.bound_px, moved, 20 * rounding + 1e-3);
}

using Change = void (*)(Random& random, Case& c);

void expect_bounds_hold(Effect effect, double size, Change change, double max_slack_dn,
                        double max_slack_px) {
  Random random(static_cast<std::uint64_t>(effect) + 100);
  Slacks slacks;
  for (int i = 0; i < 90; ++i) {
    Case c = random_case(random, i % 3 == 0 ? 6 : 1, size);
    change(random, c);
    SCOPED_TRACE(i);
    compare(c, effect, slacks);
    if (::testing::Test::HasFailure()) break;
  }
  EXPECT_GT(slacks.dn.size(), 20u) << "too few cases in which it changes anything";
  EXPECT_LT(slacks.dn.median(), max_slack_dn);
  EXPECT_LT(slacks.px.median(), max_slack_px);
  ::testing::Test::RecordProperty("slack_dn", std::to_string(slacks.dn.median()));
  ::testing::Test::RecordProperty("slack_px", std::to_string(slacks.px.median()));
  std::cout << effect_name(effect) << ": bound over change, median: " << slacks.dn.median()
            << " of " << slacks.dn.size() << " in grey levels, " << slacks.px.median() << " of "
            << slacks.px.size() << " in pixels\n";
}

void as_it_is(Random&, Case&) {}

void move(Random& random, Case& c, double exposure_s, double row_time_s) {
  c.options.velocity << random.normal(), random.normal(), random.normal(), random.normal(),
      random.normal(), random.normal();
  c.options.velocity *= std::exp(random.uniform(-4, 0));
  c.scene.sensor.exposure_s = exposure_s;
  c.scene.sensor.row_time_s = row_time_s;
}

void blink(Random& random, Case& c) {
  for (Lamp& lamp : c.scene.lamps) {
    if (random.uniform() < 0.3) continue;
    lamp.frequency_hz = std::exp(random.uniform(4, 8));
    lamp.duty = random.uniform(0.1, 0.9);
    if (random.uniform() < 0.3) lamp.waveform = {1, random.uniform(), 0, random.uniform()};
  }
}

TEST(OpticsBounds, Extent) { expect_bounds_hold(Effect::extent, 0.02, as_it_is, 20, 20); }

TEST(OpticsBounds, ExtentOfLampsWithoutBlur) {
  expect_bounds_hold(
      Effect::extent, 0.05, [](Random&, Case& c) { c.scene.effects.set(Effect::psf, Use::off); },
      20, 20);
}

TEST(OpticsBounds, LightGradient) {
  expect_bounds_hold(Effect::light_gradient, 0.2, as_it_is, 20, 20);
}

TEST(OpticsBounds, Psf) {
  expect_bounds_hold(
      Effect::psf, 0.1,
      [](Random& random, Case& c) {
        if (random.uniform() < 0.5) return;
        c.scene.sensor.f_number = 0.004 * std::exp(random.uniform(0, 3));
        c.scene.lens.focus_distance_m = random.uniform(1.7, 2.5);
      },
      20, 20);
}

TEST(OpticsBounds, Distortion) {
  expect_bounds_hold(
      Effect::distortion, 0.1,
      [](Random& random, Case& c) {
        const double k = 0.3 * std::exp(random.uniform(-6, 0));
        const Camera& p = c.scene.camera;
        c.scene.camera = Camera::pinhole(
            p.width(), p.height(), p.fx_px(), p.fy_px(), p.cx_px(), p.cy_px(),
            {k * random.normal(), 0.1 * k * random.normal(), 0.1 * k * random.normal(), 0});
      },
      20, 20);
}

TEST(OpticsBounds, Vignetting) {
  expect_bounds_hold(
      Effect::vignetting, 0.2,
      [](Random& random, Case& c) {
        c.scene.lens.vignetting = {-random.uniform(0, 0.5), random.uniform(-0.3, 0)};
      },
      20, 20);
}

TEST(OpticsBounds, MotionBlur) {
  expect_bounds_hold(
      Effect::motion_blur, 0.1, [](Random& random, Case& c) { move(random, c, 0.02, 0); }, 20, 20);
}

TEST(OpticsBounds, MotionBlurOfBlinkingLampsUnderARollingShutter) {
  expect_bounds_hold(
      Effect::motion_blur, 0.1,
      [](Random& random, Case& c) {
        move(random, c, 0.01, 1e-4);
        blink(random, c);
      },
      40, 40);
}

TEST(OpticsBounds, RollingShutter) {
  expect_bounds_hold(
      Effect::rolling_shutter, 0.1, [](Random& random, Case& c) { move(random, c, 0.001, 3e-4); },
      20, 20);
}

TEST(OpticsBounds, Modulation) {
  expect_bounds_hold(
      Effect::modulation, 0.1,
      [](Random& random, Case& c) {
        c.scene.sensor.exposure_s = 1e-3;
        c.scene.sensor.row_time_s = random.uniform() < 0.5 ? 0 : 1e-4;
        blink(random, c);
      },
      20, 40);
}

}  // namespace
