// SPDX-License-Identifier: Apache-2.0
// Small lamps whose light falls off across their image: the centroid of the light is not the middle
// of the image, and a rim measured under uniform light is off, too.
#include "libocc/formation/light.hpp"

#include <cmath>

#include "libocc/refine/refine.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/pixel_blobs.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// A narrow beam seen at the edge of a wide view; lamps of this radius in the image.
Scene narrow_beams(double radius_m) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) {
    lamp.half_power_rad = 0.7;
    lamp.power_w *= 0.7 * std::pow(radius_m / lamp.radius_m, 2);
    lamp.radius_m = radius_m;
  }
  return scene;
}

double mean_nees(const Scene& scene, Rung rung, int frames, bool aware) {
  Random random(4);
  RefineOptions options;
  options.rung = rung;
  double nees = 0;
  int count = 0;
  for (std::uint64_t seed = 1; count < frames; ++seed) {
    const Rigid3 pose = test::random_room_pose(random, 0.3);
    test::Frame frame = test::make_frame(scene, pose, seed);
    if (frame.cut || frame.matches.size() < 5) continue;
    if (!aware)
      for (Blob& blob : frame.blobs) blob.light_response_px2.setZero();
    const auto refined = refine(pose, frame.matches, frame.blobs, scene, options);
    EXPECT_TRUE(refined.ok()) << refined.message;
    const Vector6 error = difference(refined->cam_from_world, pose);
    nees += test::nees(error, refined->covariance);
    ++count;
  }
  return nees / frames;
}

// Spots of about 2.5 px radius, and discs of 3.5 to 5 px whose few inner pixels tell no slope. How
// the light bends over a lamp is known to the first order only: covariances are true to 20 %.
TEST(RefineLight, CovarianceIsTrueForSmallLamps) {
  constexpr int frames = 120;
  const auto interval = test::chi2_interval(6.0 * frames);
  for (const double radius_m : {0.015, 0.022}) {
    const Scene scene = narrow_beams(radius_m);
    for (const Rung rung : {Rung::centres, Rung::rims}) {
      SCOPED_TRACE(std::to_string(radius_m) + " m, rung " + std::to_string(int(rung)));
      const double nees = mean_nees(scene, rung, frames, true);
      EXPECT_GT(1.2 * nees * frames, interval.first);
      EXPECT_LT(nees * frames / 1.2, interval.second);
    }
  }
  EXPECT_GT(mean_nees(narrow_beams(0.022), Rung::centres, frames, false), 12);
}

TEST(RefineLight, GradientIsThatOfTheIrradiance) {
  const Scene scene = narrow_beams(0.05);
  const Rigid3 pose = look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0});
  const Lamp& lamp = scene.lamps[0];
  const Eigen::Vector2d px = scene.camera.project(pose * lamp.centre_m).value();
  const auto log_irradiance = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    const double e = irradiance_at(lamp, pose, scene.camera, scene.sensor, at);
    return Eigen::VectorXd::Constant(1, std::log(e));
  };
  const Eigen::Vector2d gradient =
      log_irradiance_gradient(lamp, pose, scene.camera, scene.sensor, px);
  EXPECT_GT(gradient.norm(), 1e-3);
  const Eigen::MatrixXd numeric = test::numerical_jacobian(log_irradiance, px, 1e-5);
  EXPECT_TRUE(test::jacobian_agrees(gradient.transpose(), numeric, 1e-4));
  EXPECT_FALSE(test::jacobian_agrees(1.01 * gradient.transpose(), numeric, 1e-4));
  Lamp point = lamp;
  point.shape = LampShape::point;
  EXPECT_TRUE(log_irradiance_gradient(point, pose, scene.camera, scene.sensor, px).isZero(0));
}

}  // namespace
}  // namespace occ
