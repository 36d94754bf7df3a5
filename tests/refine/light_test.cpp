// SPDX-License-Identifier: Apache-2.0
// Small lamps whose light falls off across their image: the centroid of the light is not the middle
// of the image, and a rim measured under uniform light is off, too.
#include "libocc/formation/light.hpp"

#include <cmath>

#include "libocc/formation/rim.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/pixel_blobs.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::refine;
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

// Without a rim, a tube is where its light is. Along it, the light of a wide view changes by a
// third, so that a gradient at its centre does not suffice.
TEST(RefineLight, TubesWithoutRimAreWhereTheirLightIs) {
  Scene scene = test::irregular_room();
  Lamp& tube = scene.lamps[0];
  tube.shape = LampShape::rectangle;
  tube.size_m = {0.05, 1.2};
  tube.x_axis = Eigen::Vector3d::UnitX();
  scene.validate();
  const Rigid3 pose = look_at({2.1, 1.9, 0.3}, {2.0, 2.1, 3.0}, {0.2, 1, 0});
  Blob blob;
  blob.light_response_px2.setIdentity();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double total = 0;
  Lamp part = tube;
  for (int i = 0; i < 200; ++i)
    for (int j = 0; j < 4; ++j) {
      part.centre_m =
          tube.centre_m + Eigen::Vector3d((j - 1.5) / 4 * 0.05, (i - 99.5) / 200 * 1.2, 0);
      const double light = lamp_electrons(part, pose, scene.camera, scene.sensor);
      sum += light * *scene.camera.project(pose * part.centre_m);
      total += light;
    }
  const auto predicted = [&](const Rigid3& at, Eigen::Matrix<double, 2, 6>* jacobian = nullptr) {
    return predicted_centroid_px(tube, blob, at, scene, Rung::centres, jacobian).value();
  };
  Eigen::Matrix<double, 2, 6> jacobian;
  EXPECT_LT((predicted(pose, &jacobian) - sum / total).norm(), 0.003);
  const auto moved = [&](const Eigen::VectorXd& by) -> Eigen::VectorXd {
    return predicted(perturb(pose, Vector6(by)));
  };
  EXPECT_TRUE(test::jacobian_agrees(jacobian,
                                    test::numerical_jacobian(moved, Vector6::Zero(), 1e-6), 1e-4));
  const Eigen::Vector2d area_px = *project_lamp_centre(tube, pose, scene.camera);
  EXPECT_GT((sum / total - area_px).norm(), 1);
  EXPECT_LT((light_shift_px(tube, blob, pose, scene) - (sum / total - area_px)).norm(), 0.003);
}

}  // namespace
}  // namespace occ
