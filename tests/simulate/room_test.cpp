// SPDX-License-Identifier: Apache-2.0
// Ambient light, glare, ghosts, the room's surfaces and occlusion: each compared with its own
// oracle, and with its bound.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/plan.hpp"
#include "tests/support/quadrature.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

Scene one_lamp(const std::vector<double>& distortion = {}) {
  Scene scene;
  scene.camera = Camera::pinhole(96, 72, 120, 120, 47.5, 35.5, distortion);
  scene.lamps = {disc_lamp(0, {2, 2, 3}, 0.2)};
  scene.room = Room{};
  scene.validate();
  return scene;
}

Rigid3 upward(double x = 1.9, double y = 2.05, double z = 1) {
  return look_at({x, y, z}, {x + 0.2, y - 0.1, 3}, Vector3d::UnitY());
}

double lamp_peak(const Scene& scene, const Rigid3& pose) {
  const Lamp& lamp = scene.lamps.front();
  const auto px = scene.camera.project(pose * lamp.centre_m);
  return scene.sensor.electrons(irradiance_at(lamp, pose, scene.camera, scene.sensor, *px)) -
         scene.sensor.electrons(0);
}

// Mean electrons with an effect and without it.
struct Both {
  MatrixXd with, without;
};
Both with_and_without(Scene scene, const Rigid3& pose, Effect effect, double peak_e) {
  Both both;
  both.with = mean_electrons(scene, pose, peak_e);
  if (effect == Effect::walls) scene.effects.set(Effect::interreflection, Use::off);
  scene.effects.set(effect, Use::off);
  both.without = mean_electrons(scene, pose, peak_e);
  return both;
}

// Compares the bound of the plan, in electrons, with the change when the effect is left out.
void expect_bounded(const Scene& scene, const Rigid3& pose, Effect effect, double peak_e,
                    double slack = 30) {
  const Both both = with_and_without(scene, pose, effect, peak_e);
  const double change = (both.with - both.without).cwiseAbs().maxCoeff();
  Scene deep = scene;
  deep.sensor.bit_depth = 16;  // so that full scale does not limit the bound
  const EffectPlan plan = plan_render(deep, pose).effects[static_cast<std::size_t>(effect)];
  EXPECT_TRUE(plan.called_for);
  const double bound = plan.bound_dn / scene.sensor.gain_dn_per_e;
  EXPECT_LE(change, bound + peak_e / 30000) << effect_name(effect);
  EXPECT_GT(change * slack, bound) << effect_name(effect) << ": a silly bound";
}

TEST(AmbientLight, IsTheSameOnEveryPixel) {
  Scene scene = one_lamp();
  const Rigid3 pose = upward();
  const double peak = lamp_peak(scene, pose);
  scene.ambient_w_m2 = 0.1;
  const double expected = scene.sensor.electrons(0.1) - scene.sensor.electrons(0);
  const Both both = with_and_without(scene, pose, Effect::ambient, 2 * peak);
  EXPECT_LT(((both.with - both.without).array() - expected).abs().maxCoeff(), peak / 10000);
  expect_bounded(scene, pose, Effect::ambient, 2 * peak, 1.1);
}

TEST(VeilingGlare, SpreadsAFractionOfTheLampsLightEvenly) {
  Scene scene = one_lamp();
  const Rigid3 pose = upward();
  const double peak = lamp_peak(scene, pose);
  scene.lens.veiling_glare = 0.3;
  const double electrons = simulate(scene, pose, noiseless()).lamps[0].electrons;
  const Both both = with_and_without(scene, pose, Effect::glare, 2 * peak);
  const double expected = 0.3 * electrons / (96 * 72);
  EXPECT_LT(((both.with - both.without).array() - expected).abs().maxCoeff(), peak / 10000);
  EXPECT_GT(expected, peak / 500);
  expect_bounded(scene, pose, Effect::glare, 2 * peak, 2);
}

// True if a box intersects the line of sight: bisection for the point deepest inside the box, the
// maximum of a concave function.
bool is_hidden(const Box& box, const Vector3d& from, const Vector3d& to) {
  const auto depth = [&](double t) {
    const Vector3d p = from + t * (to - from);
    return std::min((p - box.min_m).minCoeff(), (box.max_m - p).minCoeff());
  };
  double low = 0, high = 1;
  for (int i = 0; i < 25; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    if (depth(a) > 0 || depth(b) > 0) return true;
    (depth(a) < depth(b) ? low : high) = depth(a) < depth(b) ? a : b;
  }
  return false;
}

// Sum over small elements of the disc that are not hidden by a box.
MatrixXd sum_over_seen(const Scene& scene, const Rigid3& pose, double& hidden) {
  const Lamp& disc = scene.lamps.front();
  const Vector3d eye = pose.origin_in_source(), across = disc.x_axis,
                 along = disc.normal.cross(across);
  MatrixXd image = MatrixXd::Zero(scene.camera.width(), scene.camera.height());
  const int side = 300;
  int seen = 0, all = 0;
  Random random(3);  // a regular grid could be parallel to a shadow's edge
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const Vector2d at(2 * (i + random.uniform()) / side - 1,
                        2 * (j + random.uniform()) / side - 1);
      if (at.norm() > 1) continue;
      ++all;
      Lamp element = disc;
      element.shape = LampShape::point;
      element.centre_m += disc.radius_m * (at.x() * across + at.y() * along);
      if (std::any_of(scene.boxes.begin(), scene.boxes.end(),
                      [&](const Box& box) { return is_hidden(box, eye, element.centre_m); }))
        continue;
      ++seen;
      element.power_w *= 4 / (pi * side * side);
      add_dot(image, *scene.camera.project(pose * element.centre_m), scene.sensor.psf_sigma_px,
              lamp_electrons(element, pose, scene.camera, scene.sensor));
    }
  hidden = 1 - static_cast<double>(seen) / all;
  return image;
}

TEST(Occlusion, RendersThePartThatBoxesDoNotHide) {
  const std::vector<std::vector<Box>> cases = {
      {{{2.02, 1.5, 2}, {3, 2.5, 2.2}}},        // hides half of the lamp
      {{{1.9, 1.97, 2.3}, {1.96, 2.02, 2.4}}},  // hides a part inside the lamp
      {{{1.5, 1.5, 2.0}, {1.95, 2.5, 2.1}},
       {{1.5, 2.02, 2}, {3, 3, 2.5}}},         // two overlapping boxes
      {{{2.05, 1.0, 0.2}, {2.4, 3.0, 3.5}}}};  // beside the camera, extends through the ceiling
  for (const std::vector<double>& distortion :
       {std::vector<double>{}, std::vector<double>{-0.2, 0.05, 0.002, -0.001}})
    for (std::size_t i = 0; i < cases.size(); ++i) {
      SCOPED_TRACE(i);
      Scene scene = one_lamp(distortion);
      const Rigid3 pose = upward();
      const double peak = lamp_peak(scene, pose);
      scene.boxes = cases[i];
      double hidden = 0;
      const MatrixXd truth = sum_over_seen(scene, pose, hidden);
      const MatrixXd image = mean_electrons(scene, pose, 1.2 * peak);
      EXPECT_GT(hidden, 0.02);
      EXPECT_LT(hidden, 0.98);
      EXPECT_LT((image - truth).cwiseAbs().maxCoeff(), 0.01 * peak);
      EXPECT_NEAR(simulate(scene, pose, noiseless()).lamps[0].hidden, hidden, 0.005);
      expect_bounded(scene, pose, Effect::occlusion, 1.2 * peak);
    }
}

TEST(Occlusion, OfTheWholeLampOrOfNothing) {
  Scene scene = one_lamp();
  const Rigid3 pose = upward();
  const Image clear = simulate(scene, pose).image;
  scene.boxes = {{{0, 0, 2}, {1, 4, 2.5}},
                 {{0, 0, 0}, {4, 4, 0.5}}};  // beside the line of sight, and behind the camera
  EXPECT_EQ(simulate(scene, pose).image.u8, clear.u8);
  scene.boxes = {{{1, 1, 2}, {3, 3, 2.5}}};
  const Rendered dark = simulate(scene, pose, noiseless());
  EXPECT_FALSE(dark.lamps[0].in_view);
  EXPECT_EQ(dark.lamps[0].hidden, 1);
  EXPECT_EQ(dark.lamps[0].electrons, 0);
  scene.lamps[0].shape = LampShape::point;
  EXPECT_EQ(simulate(scene, pose, noiseless()).lamps[0].electrons, 0);
  scene.boxes.clear();
  EXPECT_GT(simulate(scene, pose, noiseless()).lamps[0].electrons, 0);
}

// Sum of electrons and centroid.
struct Spot {
  double electrons = 0;
  Vector2d centre = Vector2d::Zero();
};
Spot spot_of(const MatrixXd& image) {
  Spot spot;
  for (int x = 0; x < image.rows(); ++x)
    for (int y = 0; y < image.cols(); ++y) {
      spot.electrons += image(x, y);
      spot.centre += image(x, y) * Vector2d(x, y);
    }
  spot.centre /= spot.electrons;
  return spot;
}

std::vector<Camera> cameras_of_all_lenses() {
  const std::vector<double> brown{-0.2, 0.05, 0, 0.003, -0.002, 0.004, -0.003};
  return {Camera::pinhole(96, 72, 120, 120, 47.5, 35.5, {-0.2, 0.05, 0.003, -0.002}),
          Camera::fisheye(96, 72, 120, 120, 47.5, 35.5, {0.1, -0.02}),
          Camera::fisheye(96, 72, 120, 120, 47.5, 35.5, {0.1, -0.02, 0.01, 0.005}),
          Camera::double_sphere(96, 72, 100, 100, 47.5, 35.5, -0.2, 0.6),
          Camera::brown_forward(96, 72, 120, 121, 47.5, 35.5, brown, 40, 0.1, 0.5),
          Camera::brown_backward(96, 72, 120, 121, 47.5, 35.5, brown, 40, 0.1, 0.5)};
}

TEST(Ghosts, AreAtTheScaledPositionWithTheirFractionOfTheLight) {
  for (const Camera& camera : cameras_of_all_lenses())
    for (const double scale : {-0.8, -1.3, 0.5})
      for (const bool point : {false, true}) {
        Scene scene = one_lamp();
        scene.camera = camera;
        scene.lamps[0].radius_m = 0.1;
        if (point) scene.lamps[0].shape = LampShape::point;
        const Rigid3 pose = upward(1.85, 1.9);
        const double electrons = simulate(scene, pose, noiseless()).lamps[0].electrons;
        const Vector2d middle(scene.camera.cx_px(), scene.camera.cy_px());
        const Vector2d lamp = spot_of(mean_electrons(scene, pose, electrons)).centre;
        scene.lens.ghosts = {{0.2, scale, 0.7}};
        const Both both = with_and_without(scene, pose, Effect::ghosts, electrons);
        const Spot ghost = spot_of(both.with - both.without);
        EXPECT_NEAR(ghost.electrons, 0.2 * electrons, 0.01 * electrons);
        EXPECT_LT((ghost.centre - middle - scale * (lamp - middle)).norm(), 0.03)
            << name_of(camera.kind()) << " " << scale;
        expect_bounded(scene, pose, Effect::ghosts, electrons);
      }
}

TEST(Ghosts, AreRejectedInPanoramas) {
  Scene scene = one_lamp();
  scene.camera = Camera::equirectangular(300, 100, 2 * pi / 300, 40, 149.5, 50);
  scene.lens.ghosts = {{0.1, -1, 0}};
  EXPECT_EQ(complaint([&] { simulate(scene, upward()); }),
            "lens.ghosts must be empty for a panorama, which has no principal point, got 1");
}

Scene white_room(double reflectance) {
  Scene scene = one_lamp();
  scene.room->wall_reflectance = reflectance;
  scene.lamps[0].centre_m = {1.5, 2.2, 2.5};
  scene.lamps.push_back(disc_lamp(1, {3.2, 0.8, 3}, 0.1));
  scene.lamps[1].half_power_rad = 0.8;
  scene.validate();
  return scene;
}

// Irradiance of a surface by a lamp that is small compared with its distance.
double irradiance_by(const Lamp& lamp, const Vector3d& point, const Vector3d& normal) {
  const Vector3d way = point - lamp.centre_m;
  const double d = way.norm();
  const double arriving = -way.dot(normal) / d;
  return arriving > 0 ? radiant_intensity(lamp.power_w, lamp.order(), way.dot(lamp.normal) / d) *
                            arriving / (d * d)
                      : 0;
}

struct Surface {
  Vector3d point, normal;
};
Surface surface_ahead(const Vector3d& from, const Vector3d& direction, const Vector3d& size) {
  double nearest = 1e9;
  Surface surface;
  for (int axis = 0; axis < 3; ++axis)
    for (const double wall : {0.0, size[axis]}) {
      const double way = (wall - from[axis]) / direction[axis];
      if (!(way > 1e-9 && way < nearest)) continue;
      nearest = way;
      surface = {from + way * direction, (wall == 0 ? 1 : -1) * Vector3d::Unit(axis)};
    }
  return surface;
}

// Irradiance of the diffuse surface that a pixel sees, computed from the pixel's electrons.
double surface_irradiance(double electrons, const Scene& scene, const Vector2d& px) {
  Eigen::Matrix<double, 3, 2> jacobian;
  const Vector3d bearing = *scene.camera.unproject(px, &jacobian);
  const double solid_angle = jacobian.col(0).cross(jacobian.col(1)).norm();
  const double of_one = irradiance_of_radiance(scene.room->wall_reflectance / pi, scene.camera,
                                               scene.sensor, bearing, solid_angle);
  return electrons / (scene.sensor.electrons(of_one) - scene.sensor.electrons(0));
}

// Image of the walls alone: the image of the lamps is subtracted.
MatrixXd wall_light(const Scene& scene, const Rigid3& pose, double peak_e) {
  const Both both = with_and_without(scene, pose, Effect::walls, peak_e);
  return both.with - both.without;
}

TEST(Walls, ReflectTheLampsLightOnce) {
  Scene scene = white_room(0.6);
  scene.effects.set(Effect::interreflection, Use::off);
  const Rigid3 pose = look_at({2, 1.8, 1.2}, {0.5, 0.2, 0.9}, Vector3d::UnitZ());
  const MatrixXd image = wall_light(scene, pose, 100);
  for (const Vector2d& px :
       {Vector2d(5, 6), Vector2d(50, 40), Vector2d(90, 70), Vector2d(20, 60)}) {
    const Vector3d ray = pose.rotation.transpose() * *scene.camera.unproject(px);
    const Surface surface = surface_ahead({2, 1.8, 1.2}, ray, scene.room->size_m);
    double expected = 0;
    for (const Lamp& lamp : scene.lamps)
      expected += irradiance_by(lamp, surface.point, surface.normal);
    const double electrons = image(static_cast<int>(px.x()), static_cast<int>(px.y()));
    EXPECT_NEAR(surface_irradiance(electrons, scene, px) / expected, 1, 0.01) << px.transpose();
  }
  expect_bounded(scene, pose, Effect::walls, 100, 60);
}

// Indirect irradiance by random walks. At a diffuse surface it is rho times the mean of the
// irradiance at the points that cosine-distributed directions lead to.
struct Estimate {
  double mean = 0, error = 0;
};
Estimate indirect_by_walks(const Scene& scene, const Surface& start, int walks) {
  Random random(7);
  double sum = 0, squares = 0;
  for (int i = 0; i < walks; ++i) {
    Surface here = start;
    double light = 0, weight = 1;
    for (int bounce = 0; bounce < 12; ++bounce) {
      const Vector3d u = here.normal.unitOrthogonal(), v = here.normal.cross(u);
      const double r = std::sqrt(random.uniform()), angle = 2 * pi * random.uniform();
      const Vector3d way =
          r * std::cos(angle) * u + r * std::sin(angle) * v + std::sqrt(1 - r * r) * here.normal;
      here = surface_ahead(here.point, way, scene.room->size_m);
      weight *= scene.room->wall_reflectance;
      for (const Lamp& lamp : scene.lamps)
        light += weight * irradiance_by(lamp, here.point, here.normal);
    }
    sum += light;
    squares += light * light;
  }
  const double mean = sum / walks;
  return {mean, std::sqrt((squares / walks - mean * mean) / walks)};
}

TEST(Interreflection, AgreesWithRandomWalks) {
  const Scene scene = white_room(0.6);
  const Rigid3 pose = look_at({2, 1.8, 1.2}, {0.5, 0.2, 0.9}, Vector3d::UnitZ());
  const Both both = with_and_without(scene, pose, Effect::interreflection, 100);
  for (const Vector2d& px : {Vector2d(5, 6), Vector2d(50, 40), Vector2d(90, 70)}) {
    const Vector3d ray = pose.rotation.transpose() * *scene.camera.unproject(px);
    const Surface surface = surface_ahead({2, 1.8, 1.2}, ray, scene.room->size_m);
    const Estimate expected = indirect_by_walks(scene, surface, 60000);
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const double found = surface_irradiance(both.with(x, y) - both.without(x, y), scene, px);
    const double tiles = 0.01 * expected.mean;  // light is assumed even over each tile
    EXPECT_NEAR(found, expected.mean, 4 * expected.error + tiles) << px.transpose();
  }
  expect_bounded(scene, pose, Effect::interreflection, 100, 60);
}

TEST(Interreflection, AllLightIsAbsorbed) {
  Scene scene = white_room(0.7);
  scene.camera = Camera::pinhole(80, 80, 40, 40, 39.5, 39.5);  // six views of a cube
  const Vector3d eye(1.9, 2.1, 1.4);
  double absorbed = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Vector3d up = axis == 2 ? Vector3d::UnitX() : Vector3d::UnitZ();
      const Rigid3 pose = look_at(eye, eye + side * Vector3d::Unit(axis), up);
      const MatrixXd image = wall_light(scene, pose, 400);
      for (int x = 0; x < 80; ++x)
        for (int y = 0; y < 80; ++y) {
          Eigen::Matrix<double, 3, 2> jacobian;
          const Vector3d bearing = *scene.camera.unproject({x, y}, &jacobian);
          const Vector3d ray = pose.rotation.transpose() * bearing;
          const Surface surface = surface_ahead(eye, ray, scene.room->size_m);
          const double solid_angle = jacobian.col(0).cross(jacobian.col(1)).norm();
          const double area =
              solid_angle * (surface.point - eye).squaredNorm() / std::abs(surface.normal.dot(ray));
          absorbed += 0.3 * surface_irradiance(image(x, y), scene, {x, y}) * area;
        }
    }
  EXPECT_NEAR(absorbed / (2 * scene.lamps[0].power_w), 1, 0.01);
}

TEST(Walls, ABoxInFrontIsBlack) {
  Scene scene = white_room(0.6);
  const Rigid3 pose = look_at({2, 1.8, 1.2}, {0.5, 0.2, 0.9}, Vector3d::UnitZ());
  const MatrixXd clear = wall_light(scene, pose, 100);
  scene.boxes = {{{1, 0.6, 0.9}, {1.2, 1, 1.2}}};
  const MatrixXd boxed = wall_light(scene, pose, 100);
  const Vector3d eye(2, 1.8, 1.2);
  int black = 0;
  for (int x = 0; x < 96; ++x)
    for (int y = 0; y < 72; ++y) {
      const Vector3d ray = pose.rotation.transpose() * *scene.camera.unproject({x, y});
      const bool hidden = is_hidden(scene.boxes[0], eye, eye + 3 * ray);
      black += hidden;
      const double expected = hidden ? 0 : clear(x, y);
      EXPECT_NEAR(boxed(x, y), expected, 0.01 + 0.01 * expected) << x << " " << y;
    }
  EXPECT_GT(black, 50);
}

TEST(RoomLight, RejectsInvalidPositionsAndSettings) {
  Scene scene = white_room(0.5);
  const auto said = [&](const Rigid3& pose) { return complaint([&] { simulate(scene, pose); }); };
  const auto from = [](const Vector3d& eye) {
    return look_at(eye, eye + Vector3d(0.1, 0, 1), Vector3d::UnitY());
  };
  EXPECT_NE(said(from({5, 1, 1})).find("in the room whose walls are rendered"), std::string::npos);
  EXPECT_NE(said(from({1.5, 2.2, 2.5})).find("outside lamp 0"), std::string::npos);
  scene.boxes = {{{1, 1, 0}, {2, 2, 1}}};
  EXPECT_NE(said(from({1.5, 1.5, 0.5})).find("outside boxes[0]"), std::string::npos);
  scene.effects.set(Effect::walls, Use::off);
  EXPECT_EQ(said(from({3, 3, 0.5})),
            "effects.interreflection must be off or auto where walls is off, got on");
  scene = white_room(0.5);
  scene.lamps[0].centre_m.z() = 3.2;
  EXPECT_EQ(said(from({3, 3, 0.5})),
            "lamp 0: centre_m must be in the room of [4, 4, 3] m, not behind its walls, got [1.5, "
            "2.2, 3.2]");
}

TEST(RoomLight, InterreflectionRequiresWalls) {
  Scene scene = white_room(0.5);
  const Rigid3 pose = look_at({3, 3, 0.5}, {3.1, 3, 1.5}, Vector3d::UnitY());
  const auto part = [](const RenderPlan& plan, Effect effect) {
    return plan.effects[static_cast<std::size_t>(effect)];
  };
  scene.effects.set(Effect::walls, Use::off);
  scene.effects.set(Effect::interreflection, Use::automatic);
  scene.effects.tolerance_dn = 1e-9;
  const EffectPlan left_out = part(plan_render(scene, pose), Effect::interreflection);
  EXPECT_FALSE(left_out.applied);
  EXPECT_EQ(left_out.reason, "not without walls");
  scene.effects.set(Effect::walls, Use::automatic);
  scene.effects.set(Effect::interreflection, Use::on);
  scene.effects.tolerance_dn = 1e6;
  const EffectPlan needed = part(plan_render(scene, pose), Effect::walls);
  EXPECT_TRUE(needed.applied);
  EXPECT_EQ(needed.reason, "for interreflection");
}

// Without walls there is no interreflection either, because dark surfaces do not light each other.
TEST(RoomLight, TheBoundOfWallsIncludesInterreflection) {
  const Scene scene = white_room(0.8);
  const Rigid3 pose = look_at({3, 3, 0.5}, {3.1, 3, 1.5}, Vector3d::UnitY());
  Scene once = scene;
  once.effects.set(Effect::interreflection, Use::off);
  const auto walls = static_cast<std::size_t>(Effect::walls);
  EXPECT_GT(plan_render(scene, pose).effects[walls].bound_dn,
            3 * plan_render(once, pose).effects[walls].bound_dn);
}

TEST(RoomLight, AbsentEffectsChangeNoBit) {
  const Scene plain = one_lamp();
  Scene scene = plain;
  scene.boxes = {{{0, 0, 2}, {1, 1, 2.5}}};
  scene.room->wall_reflectance = 0.5;
  scene.ambient_w_m2 = 0.2;
  scene.lens.veiling_glare = 0.1;
  scene.lens.ghosts = {{0.1, -1, 0}};
  for (const Effect effect : {Effect::occlusion, Effect::walls, Effect::interreflection,
                              Effect::ambient, Effect::glare, Effect::ghosts})
    scene.effects.set(effect, Use::off);
  EXPECT_EQ(simulate(scene, upward()).image.u8, simulate(plain, upward()).image.u8);
}

}  // namespace
