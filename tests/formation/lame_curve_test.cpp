// SPDX-License-Identifier: Apache-2.0
// Lamps with the shape of a Lame curve, compared with sums over the face in polar coordinates.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/lamp_image.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/formation/outline_support.hpp"
#include "tests/support/quadrature.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

constexpr double exponents[] = {1.0, 1.3, 2.0, 2.7, 5.0, 100.0};

Lamp lame_lamp(double exponent, const Eigen::Vector2d& size_m = {0.34, 0.2}) {
  Lamp lamp = disc_lamp(0, {0.4, -0.3, 2.5});
  lamp.shape = LampShape::lame;
  lamp.size_m = size_m;
  lamp.exponent = exponent;
  lamp.normal = Eigen::Vector3d(0.3, 0.45, -0.8);
  lamp.x_axis = {1, 0.3, 0};
  lamp.validate();
  return lamp;
}

const Camera bent = Camera::pinhole(160, 120, 200, 198, 50.2, 80.4, {-0.2, 0.05, 0.002, -0.003});
Rigid3 some_pose() { return {so3_exp({0.1, -0.15, 0.7}), {0.1, 0.05, 0.2}}; }

/// Elements of the face: position in the world and area.
struct Element {
  Eigen::Vector3d at;
  double area;
};
std::vector<Element> elements(const Lamp& lamp, int panels, int rings) {
  const Eigen::Vector3d x = lamp.size_m.x() / 2 * lamp.x_axis;
  const Eigen::Vector3d y = lamp.size_m.y() / 2 * lamp.normal.cross(lamp.x_axis);
  std::vector<Element> all;
  for (int eighth = 0; eighth < 8; ++eighth)
    for (const Eigen::Vector2d& turn : quadrature(panels)) {
      // Finer towards both ends of the eighth, where the curvature is large.
      const double t = turn.x() + 0.5, smooth = t * t * (3 - 2 * t);
      const double angle = (eighth + smooth) * pi / 4;
      const double speed = 6 * t * (1 - t) * pi / 4;
      const double c = std::cos(angle), s = std::sin(angle), n = lamp.exponent;
      const double rim = std::pow(std::pow(std::abs(c), n) + std::pow(std::abs(s), n), -1 / n);
      for (const Eigen::Vector2d& ring : quadrature(rings)) {
        const double r = rim * (ring.x() + 0.5);
        all.push_back({lamp.centre_m + r * (c * x + s * y),
                       ring.y() * turn.y() * speed * rim * r * x.cross(y).norm()});
      }
    }
  return all;
}

TEST(LameCurve, AreaIsTheSumOfItsElements) {
  for (const double n : exponents) {
    const Lamp lamp = lame_lamp(n);
    double area = 0;
    for (const Element& e : elements(lamp, 40, 1)) area += e.area;
    EXPECT_NEAR(area / lamp.area_m2(), 1, 1e-9) << n;
  }
  EXPECT_NEAR(lame_lamp(2, {0.2, 0.2}).area_m2(), pi * 0.01, 1e-15);
  EXPECT_NEAR(lame_lamp(1, {0.2, 0.4}).area_m2(), 0.04, 1e-15);
}

TEST(LameCurve, RimLiesOnTheCurveAndReachIsItsFarthestPoint) {
  for (const double n : exponents) {
    const Lamp lamp = lame_lamp(n);
    double farthest = 0;
    Eigen::Vector3d before = rim_in_world(lamp, 4000).back();
    for (const Eigen::Vector3d& point : rim_in_world(lamp, 4000)) {
      const Eigen::Vector3d from = point - lamp.centre_m;
      const double x = from.dot(lamp.x_axis), y = from.dot(lamp.normal.cross(lamp.x_axis));
      EXPECT_NEAR(std::pow(std::abs(2 * x / 0.34), n) + std::pow(std::abs(2 * y / 0.2), n), 1,
                  1e-11);
      EXPECT_NEAR(from.dot(lamp.normal), 0, 1e-15);
      EXPECT_GT((before - lamp.centre_m).cross(from).dot(lamp.normal), 0);
      before = point;
      farthest = std::max(farthest, from.norm());
    }
    EXPECT_NEAR(farthest / lamp.reach_m(), 1, 1e-4) << n;
    EXPECT_LT(farthest / lamp.reach_m(), 1 + 1e-12) << n;
  }
  EXPECT_EQ(rim_in_world(lame_lamp(3), 9).size(), 9u);
}

TEST(LameCurve, CoverageIsTheSumOverItsElements) {
  const double sigma = 0.8;
  for (const double n : {1.0, 2.7, 100.0}) {
    const Lamp lamp = lame_lamp(n, {0.3, 0.15});
    const Patch patch = coverage(*project_contour(lamp, some_pose(), bent, sigma), PixelPsf(sigma),
                                 bent.width(), bent.height());
    Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(bent.width(), bent.height());
    const Eigen::Vector3d normal = some_pose().rotation * lamp.normal;
    for (const Element& e : elements(lamp, 12, 9)) {
      const Eigen::Vector3d at = some_pose() * e.at;
      Eigen::Matrix<double, 2, 3> d_px;
      const Eigen::Vector2d px = *bent.project(at, &d_px);
      const Eigen::Vector3d u = normal.unitOrthogonal();
      Eigen::Matrix<double, 3, 2> plane;
      plane << u, normal.cross(u);
      add_dot(truth, px, sigma, e.area * std::abs((d_px * plane).determinant()));
    }
    double worst = 0;
    for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
      for (int x = patch.x0; x < patch.x0 + patch.width; ++x)
        worst = std::max(worst, std::abs(patch.at(x, y) - truth(x, y)));
    EXPECT_LT(worst, 3e-6) << n;
    EXPECT_GT(truth.maxCoeff(), 0.95);
  }
}

TEST(LameCurve, OfExponentTwoIsADisc) {
  Lamp disc = disc_lamp(0, {0.4, -0.3, 2.5}, 0.1), lame = lame_lamp(2, {0.2, 0.2});
  disc.normal = lame.normal;
  disc.validate();
  const PixelPsf psf(0.8);
  const Patch a = coverage(*project_contour(disc, some_pose(), bent, 0.8), psf, 160, 120);
  const Patch b = coverage(*project_contour(lame, some_pose(), bent, 0.8), psf, 160, 120);
  for (int y = 1; y + 1 < a.height; ++y)
    for (int x = 1; x + 1 < a.width; ++x)
      EXPECT_NEAR(a.at(a.x0 + x, a.y0 + y), b.at(a.x0 + x, a.y0 + y), 1e-6);
}

TEST(LameCurve, CentreIsTheCentroidOfItsImageWithTheRightJacobian) {
  for (const double n : exponents) {
    SCOPED_TRACE(n);
    const Lamp lamp = lame_lamp(n, {0.5, 0.25});
    for (const Camera& camera : {bent, Camera::pinhole(640, 480, 900, 900, 319.5, 239.5)}) {
      expect_true_centre(lamp, some_pose(), camera);
    }
  }
}

TEST(LameCurve, FluxFollowsTheApertureFormula) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  for (const double n : exponents) {
    scene.lamps = {lame_lamp(n, {0.1, 0.06})};
    const double expected = lamp_electrons(scene.lamps[0], some_pose(), scene.camera, scene.sensor);
    EXPECT_NEAR(simulate(scene, some_pose()).lamps[0].electrons / expected, 1, 2e-3) << n;
  }
}

Scene room_of_curves(double exponent, const Eigen::Vector2d& size_m) {
  Scene scene = irregular_room();
  for (Lamp& lamp : scene.lamps) {
    lamp.shape = LampShape::lame;
    lamp.size_m = size_m;
    lamp.exponent = exponent;
  }
  scene.validate();
  return scene;
}

TEST(LameCurve, LampsAreLocatedByTheirRims) {
  for (const double n : {1.3, 2.0, 2.5, 4.0, 10.0}) {
    SCOPED_TRACE(n);
    expect_located_by_rims(room_of_curves(n, {0.4, 0.28}));
  }
}

TEST(LameCurve, SmallLampsAreLocated) {
  for (const double n : {1.3, 1.7, 2.5, 4.0, 10.0}) {
    const Scene scene = room_of_curves(n, {0.2, 0.14});
    const Rigid3 pose = look_at({1.7, 2.1, 0.5}, {1.9, 2.1, 3}, Eigen::Vector3d::UnitY());
    const Rendered rendered = simulate(scene, pose);
    const Result<Fix> fix = locate(rendered.image.view(), scene);
    ASSERT_EQ(fix.status, Status::ok) << n << ": " << fix.message;
    EXPECT_LT((fix->position_m - pose.origin_in_source()).norm(), 3e-3) << n;
    EXPECT_EQ(fix->lamps.size(), 6u);
  }
}

}  // namespace
