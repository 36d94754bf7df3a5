// SPDX-License-Identifier: Apache-2.0
// A reflected scene has the reflected image, with the same bounds of all effects: neither axis nor
// direction is preferred.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct ReflectedCase {
  Scene scene;
  Rigid3 pose;
  SimulateOptions options = noiseless();
};

/// Reverses x of world and camera, or y, or exchanges both.
enum class Reflection { reversed_x, reversed_y, exchanged };

Matrix3d matrix(Reflection by) {
  if (by == Reflection::reversed_x) return Vector3d(-1, 1, 1).asDiagonal();
  if (by == Reflection::reversed_y) return Vector3d(1, -1, 1).asDiagonal();
  Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  return m;
}

/// Pixel of the reflected image.
Vector2d reflected(const Vector2d& px, Reflection by, const Camera& camera) {
  if (by == Reflection::reversed_x) return {camera.width() - 1 - px.x(), px.y()};
  if (by == Reflection::reversed_y) return {px.x(), camera.height() - 1 - px.y()};
  return {px.y(), px.x()};
}

Camera reflected(const Camera& c, Reflection by, const std::vector<double>& distortion) {
  const Vector2d centre = reflected(Vector2d(c.cx_px(), c.cy_px()), by, c);
  if (by != Reflection::exchanged)
    return Camera::pinhole(c.width(), c.height(), c.fx_px(), c.fy_px(), centre.x(), centre.y(),
                           distortion);
  return Camera::pinhole(c.height(), c.width(), c.fy_px(), c.fx_px(), centre.x(), centre.y(),
                         distortion);
}

Mosaic reflected(Mosaic mosaic, Reflection by) {
  const bool red_on_diagonal = mosaic == Mosaic::rggb || mosaic == Mosaic::bggr;
  const auto either = [&](Mosaic a, Mosaic b) { return mosaic == a ? b : a; };
  if (mosaic == Mosaic::none || (by == Reflection::exchanged && red_on_diagonal)) return mosaic;
  if (by == Reflection::exchanged) return either(Mosaic::grbg, Mosaic::gbrg);
  if (by == Reflection::reversed_x)
    return mosaic == Mosaic::rggb   ? Mosaic::grbg
           : mosaic == Mosaic::grbg ? Mosaic::rggb
           : mosaic == Mosaic::bggr ? Mosaic::gbrg
                                    : Mosaic::bggr;
  return mosaic == Mosaic::rggb   ? Mosaic::gbrg
         : mosaic == Mosaic::gbrg ? Mosaic::rggb
         : mosaic == Mosaic::bggr ? Mosaic::grbg
                                  : Mosaic::bggr;
}

ReflectedCase reflected(const ReflectedCase& given, Reflection by,
                        const std::vector<double>& distortion) {
  ReflectedCase c = given;
  const Matrix3d m = matrix(by);
  // The reflected room begins at the origin again.
  const Vector3d shift = given.scene.room
                             ? Vector3d((m * given.scene.room->size_m).cwiseMin(0) * -1)
                             : Vector3d(0, 0, 0);
  for (Lamp& lamp : c.scene.lamps) {
    lamp.centre_m = m * lamp.centre_m + shift;
    lamp.normal = m * lamp.normal;
    lamp.x_axis = m * lamp.x_axis;
  }
  for (Box& box : c.scene.boxes) {
    const Vector3d a = m * box.min_m + shift, b = m * box.max_m + shift;
    box = {a.cwiseMin(b), a.cwiseMax(b)};
  }
  if (c.scene.room) c.scene.room->size_m = (m * given.scene.room->size_m).cwiseAbs();
  c.scene.camera = reflected(given.scene.camera, by, distortion);
  c.scene.sensor.mosaic = reflected(given.scene.sensor.mosaic, by);
  if (by == Reflection::exchanged)
    c.scene.sensor.readout =
        given.scene.sensor.readout == Readout::columns ? Readout::rows : Readout::columns;
  c.pose.rotation = m * given.pose.rotation * m;
  c.pose.translation = m * given.pose.translation - c.pose.rotation * shift;
  c.options.velocity.head<3>() = -m * given.options.velocity.head<3>();
  c.options.velocity.tail<3>() = m * given.options.velocity.tail<3>();
  return c;
}

double level(const Image& image, const Vector2d& px) {
  return image.u16[static_cast<std::size_t>(px.y() * image.width + px.x())];
}

void expect_reflected(const ReflectedCase& given, Reflection by,
                      const std::vector<double>& distortion) {
  SCOPED_TRACE(static_cast<int>(by));
  const ReflectedCase other = reflected(given, by, distortion);
  const RenderPlan plan = plan_render(given.scene, given.pose, given.options);
  const RenderPlan again = plan_render(other.scene, other.pose, other.options);
  for (std::size_t i = 0; i < effect_count; ++i) {
    const EffectPlan &a = plan.effects[i], &b = again.effects[i];
    SCOPED_TRACE(effect_name(a.effect));
    EXPECT_EQ(a.called_for, b.called_for);
    EXPECT_TRUE(a.bound_dn == b.bound_dn || std::abs(a.bound_dn - b.bound_dn) < 1e-6 * a.bound_dn)
        << a.bound_dn << ' ' << b.bound_dn;
    EXPECT_TRUE(a.bound_px == b.bound_px || std::abs(a.bound_px - b.bound_px) < 1e-6 * a.bound_px)
        << a.bound_px << ' ' << b.bound_px;
  }
  const Rendered seen = simulate(given.scene, given.pose, given.options);
  const Rendered mirrored = simulate(other.scene, other.pose, other.options);
  const Camera& camera = given.scene.camera;
  double worst_dn = 0, brightest_dn = 0;
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      const double here = level(seen.image, Vector2d(x, y));
      const double there = level(mirrored.image, reflected(Vector2d(x, y), by, camera));
      worst_dn = std::max(worst_dn, std::abs(here - there));
      brightest_dn = std::max(brightest_dn, here);
    }
  EXPECT_GT(brightest_dn, 5000);
  EXPECT_LT(worst_dn, 1.5 + 2e-4 * brightest_dn);
  ASSERT_EQ(seen.lamps.size(), mirrored.lamps.size());
  for (std::size_t i = 0; i < seen.lamps.size(); ++i) {
    const LampTruth &a = seen.lamps[i], &b = mirrored.lamps[i];
    EXPECT_EQ(a.in_view, b.in_view);
    EXPECT_EQ(a.whole, b.whole);
    EXPECT_NEAR(a.hidden, b.hidden, 1e-6);
    EXPECT_NEAR(a.electrons, b.electrons, 1e-4 * a.electrons + 0.01);
    EXPECT_EQ(a.rim_px.size(), b.rim_px.size());
    if (!a.in_view) continue;
    EXPECT_LT((reflected(a.centre_px, by, camera) - b.centre_px).norm(), 1e-6);
    EXPECT_LT((reflected(a.image_centre_px, by, camera) - b.image_centre_px).norm(), 1e-6);
  }
}

/// Four lamps with sides and a point below the ceiling of a room with a box.
ReflectedCase room_case(Random& random, std::vector<double>& distortion) {
  ReflectedCase c;
  const double f = random.uniform(40, 60);
  distortion = {random.uniform(-0.05, 0.05), 0, 0, 0};
  c.scene.camera = Camera::pinhole(64, 48, f, 1.1 * f, random.uniform(26, 38),
                                   random.uniform(18, 30), distortion);
  const Vector3d size(random.uniform(3, 5), random.uniform(3, 5), 3);
  for (int id = 0; id < 5; ++id) {
    Lamp lamp = disc_lamp(id, {random.uniform(0.2, 0.8) * size.x(),
                               random.uniform(0.2, 0.8) * size.y(), random.uniform(2.5, 2.95)});
    lamp.shape = id == 0 ? LampShape::point : id < 3 ? LampShape::rectangle : LampShape::lame;
    lamp.size_m = {random.uniform(0.1, 0.4), random.uniform(0.1, 0.4)};
    lamp.exponent = std::exp(random.uniform(0.3, 2));
    lamp.normal = {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), -1};
    lamp.x_axis = {1, random.normal(), 0};
    lamp.half_power_rad = random.uniform(0.5, 1.4);
    lamp.power_w = id == 0 ? 0.02 : 60 * lamp.area_m2();
    lamp.colour = {random.uniform(), random.uniform(), random.uniform()};
    c.scene.lamps.push_back(lamp);
  }
  c.scene.room = Room{size, 0.5};
  const Vector3d corner(0.45 * size.x(), 0.4 * size.y(), 1.5);
  c.scene.boxes = {{corner, corner + Vector3d(0.3, 0.4, 0.2)}};
  const Vector3d eye(random.uniform(0.35, 0.65) * size.x(), random.uniform(0.35, 0.65) * size.y(),
                     0.4);
  c.pose = look_at(eye, {0.5 * size.x(), 0.5 * size.y(), 3},
                   Vector3d(random.normal(), random.normal(), 0.1));
  Sensor& sensor = c.scene.sensor;
  sensor.bit_depth = 16;
  sensor.black_level_dn = 0;
  sensor.full_well_e = 1e6;
  sensor.gain_dn_per_e = 1;
  sensor.exposure_s = 0.003;
  sensor.psf_sigma_px = 0.8;
  c.scene.validate();
  Scene dark = c.scene;
  dark.room.reset();
  const double peak_e = peak_electrons(dark, c.pose);
  for (Lamp& lamp : c.scene.lamps) lamp.power_w *= 40000 / peak_e;
  return c;
}

constexpr Reflection all[] = {Reflection::reversed_x, Reflection::reversed_y,
                              Reflection::exchanged};

TEST(Reflections, OfARoomWithAllEffectsOfTheLens) {
  Random random(1);
  for (int i = 0; i < 2; ++i) {
    std::vector<double> distortion;
    ReflectedCase c = room_case(random, distortion);
    c.scene.effects.set(Effect::interreflection, Use::off);  // sampled on a grid; slow
    c.scene.lens.veiling_glare = 0.05;
    c.scene.lens.vignetting = {-0.3, -0.1};
    c.scene.lens.ghosts = {{0.03, -0.8, 1}};
    c.scene.ambient_w_m2 = 0.005;
    c.scene.sensor.mosaic = i == 0 ? Mosaic::rggb : Mosaic::gbrg;
    for (const Reflection by : all) expect_reflected(c, by, distortion);
  }
}

TEST(Reflections, OfMotion) {
  Random random(3);
  for (int i = 0; i < 4; ++i) {
    std::vector<double> distortion;
    ReflectedCase c = room_case(random, distortion);
    c.scene.room.reset();
    c.options.velocity << 0.8, -0.5, 0.9, 0.3, -0.2, 0.5;
    c.scene.sensor.row_time_s = i < 2 ? 0 : 1e-4;
    c.scene.sensor.readout = i == 2 ? Readout::rows : Readout::columns;
    if (i % 2) c.scene.lamps[1].frequency_hz = 700;
    if (i == 1) c.scene.lens.focus_distance_m = 1.2, c.scene.sensor.f_number = 0.05;
    for (const Reflection by : all) {
      // The lines of a rolling shutter are exposed in one direction.
      if (i == 2 && by == Reflection::reversed_y) continue;
      if (i == 3 && by == Reflection::reversed_x) continue;
      expect_reflected(c, by, distortion);
    }
  }
}

}  // namespace
