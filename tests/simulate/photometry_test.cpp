// SPDX-License-Identifier: Apache-2.0
// Rooms with measured emission against closed forms: received power, rendered flux, light on walls.
#include "tests/support/photometry.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/simulate/received_power.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using Eigen::Vector3d;

/// The received power of a batwing rectangle: sum over points of its face.
double closed_form_w(const Scene& scene, const Lamp& lamp, const Rigid3& pose) {
  const Vector3d eye = pose.origin_in_source(), across = lamp.normal.cross(lamp.x_axis);
  constexpr int steps = 60;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const Vector3d point = lamp.centre_m +
                             ((i + 0.5) / steps - 0.5) * lamp.size_m.x() * lamp.x_axis +
                             ((j + 0.5) / steps - 0.5) * lamp.size_m.y() * across;
      const Vector3d way = eye - point;
      const double distance = way.norm(), gamma = std::acos(way.dot(lamp.normal) / distance);
      const double c = std::atan2(way.dot(-across), way.dot(lamp.x_axis));
      sum += lamp.power_w * test::batwing(gamma, c) / test::batwing_flux() *
             (pose * point).normalized().z() / (distance * distance);
    }
  return sum / (steps * steps) * aperture_m2(scene.camera, scene.sensor);
}

Scene room_with(std::shared_ptr<const EmissionProfile> profile) {
  Scene scene;
  scene.camera = test::vga_camera();
  Lamp lamp = test::disc_lamp(0, {2, 2, 3}, 0.085);
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.3, 0.1};
  lamp.normal = {0.2, 0.1, -1};
  lamp.x_axis = {0.3, 1, 0};
  lamp.photometry = std::move(profile);
  scene.lamps = {lamp};
  scene.validate();
  return scene;
}

std::vector<Rigid3> poses() {
  std::vector<Rigid3> all;
  for (const double x : {0.2, 1.5, 2.0, 3.4})
    for (const double y : {0.4, 2.1}) all.push_back(look_at({x, y, 0.5}, {2, 2, 3}, {0.1, 1, 0}));
  return all;
}

TEST(Photometry, ReceivedPowerIsThatOfTheClosedForm) {
  const Scene scene = room_with(test::profile_of(test::batwing, 5, 15));
  for (const Rigid3& pose : poses())
    EXPECT_NEAR(received_power(scene, pose).total_w() / closed_form_w(scene, scene.lamps[0], pose),
                1, 1e-3);
}

TEST(Photometry, ACosinePowerGivesThePowerOfALambertianLamp) {
  const Scene measured = room_with(test::profile_of(test::cosine_power(1.7), 2.5, 0));
  Scene lambertian = measured;
  lambertian.lamps[0].photometry = nullptr;
  lambertian.lamps[0].half_power_rad = std::acos(std::exp2(-1 / 1.7));
  for (const Rigid3& pose : poses())
    EXPECT_NEAR(
        received_power(measured, pose).total_w() / received_power(lambertian, pose).total_w(), 1,
        1e-3);
}

TEST(Photometry, RenderedFluxIsThatOfTheClosedForm) {
  const Scene scene = room_with(test::profile_of(test::batwing, 2.5, 7.5));
  const double per_w = (scene.sensor.electrons(1) - scene.sensor.electrons(0)) /
                       (scene.sensor.pixel_pitch_m * scene.sensor.pixel_pitch_m);
  for (const Rigid3& pose : poses()) {
    const double peak = test::peak_electrons(scene, pose);
    SimulateOptions options;
    options.spacing_sigma = 0.8;
    const double sum = test::mean_electrons(scene, pose, peak, options).sum();
    EXPECT_NEAR(sum / (per_w * closed_form_w(scene, scene.lamps[0], pose)), 1, 1e-3);
  }
}

TEST(Photometry, LightsTheWallsAsALambertianLampDoes) {
  Scene measured = room_with(test::profile_of(test::cosine_power(1.7), 2.5, 0));
  measured.room = Room{{4, 4, 3.5}, 0.6};
  Scene lambertian = measured;
  lambertian.lamps[0].photometry = nullptr;
  lambertian.lamps[0].half_power_rad = std::acos(std::exp2(-1 / 1.7));
  const Rigid3 pose = look_at({1, 1, 1}, {4, 2.5, 1.2}, {0, 0, 1});
  const double peak = 1.2 * test::mean_electrons(lambertian, pose, 1e5).maxCoeff();
  const Eigen::MatrixXd a = test::mean_electrons(measured, pose, peak);
  const Eigen::MatrixXd b = test::mean_electrons(lambertian, pose, peak);
  EXPECT_GT(b.mean(), 0.2 * peak);  // the wall is lit
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 2e-3 * peak);
  // A batwing lights the walls differently.
  Scene batwing = measured;
  batwing.lamps[0].photometry = test::profile_of(test::batwing, 5, 15);
  EXPECT_GT((test::mean_electrons(batwing, pose, 2 * peak) - b).cwiseAbs().maxCoeff(), 0.02 * peak);
}

TEST(Photometry, TheExtentsBoundHoldsForAStrongCurvature) {
  // Nearly a cone's edge: the light of the lamp's centre is not that of its face.
  Scene scene = room_with(test::profile_of(
      [](double gamma, double) { return 1 / (1 + std::exp(60 * (gamma - 0.6))) + 1e-3; }, 2.5, 0));
  scene.effects.tolerance_dn = 0.05;
  for (const double x : {0.2, 0.35, 0.5}) {
    const Rigid3 pose = look_at({x, 2, 0.5}, {2, 2, 3}, {0.1, 1, 0});
    Scene automatic = scene;
    automatic.effects.use.fill(Use::automatic);
    const double peak = test::peak_electrons(scene, pose);
    const Eigen::MatrixXd all = test::mean_electrons(scene, pose, peak);
    const Eigen::MatrixXd chosen = test::mean_electrons(automatic, pose, peak);
    EXPECT_LT((all - chosen).cwiseAbs().maxCoeff() / peak, 2e-4);
  }
}

}  // namespace
