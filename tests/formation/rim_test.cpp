// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/rim.hpp"

#include <Eigen/SVD>
#include <cmath>

#include "tests/formation/outline_support.hpp"
#include "tests/support/rim_support.hpp"

namespace occ {
namespace {

const Camera straight = Camera::pinhole(1280, 960, 1000, 990, 640, 480, {}, 0.5);
const Camera bent = Camera::pinhole(1280, 960, 1000, 990, 640, 480,
                                    {-0.28, 0.09, 1e-3, -8e-4, -0.01, 0.02, 0.01, 0.003});

Lamp tilted_disc(double radius_m = 0.09) {
  Lamp lamp = test::disc_lamp(0, {0.4, -0.3, 2.5}, radius_m);
  lamp.normal = Eigen::Vector3d(0.3, 0.45, -0.8).normalized();
  return lamp;
}

Lamp tilted_rectangle() {
  Lamp lamp = tilted_disc();
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.6, 0.25};
  lamp.x_axis = lamp.normal.cross(Eigen::Vector3d(0.2, 0.9, 0.3)).normalized();
  return lamp;
}

Lamp tilted_curve(double exponent) {
  Lamp lamp = tilted_rectangle();
  lamp.shape = LampShape::lame;
  lamp.exponent = exponent;
  return lamp;
}

Lamp tilted_polygon() {
  Lamp lamp = tilted_rectangle();
  lamp.shape = LampShape::polygon;
  lamp.corners_m = {{-0.2, -0.1}, {0.4, -0.1}, {0.4, 0.1}, {0.1, 0.1}, {-0.1, 0.3}, {-0.2, 0.2}};
  lamp.validate();
  return lamp;
}

Rigid3 some_pose() { return {so3_exp({0.1, -0.15, 0.7}), {0.1, 0.05, 0.2}}; }

/// Centre of the conic through the points, by least squares on its six coefficients.
Eigen::Vector2d conic_centre(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p / static_cast<double>(points.size());
  const double scale = (points.front() - mean).norm();
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 6);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d p = (points[i] - mean) / scale;
    rows.row(static_cast<Eigen::Index>(i)) << p.x() * p.x(), p.x() * p.y(), p.y() * p.y(), p.x(),
        p.y(), 1;
  }
  const Eigen::VectorXd q =
      Eigen::JacobiSVD<Eigen::MatrixXd>(rows, Eigen::ComputeFullV).matrixV().col(5);
  Eigen::Matrix2d hessian;
  hessian << 2 * q[0], q[1], q[1], 2 * q[2];
  const Eigen::Vector2d gradient(q[3], q[4]);
  return mean - scale * hessian.inverse() * gradient;
}

TEST(RimInWorld, DiscIsACircleCounterClockwiseSeenFromTheLitSide) {
  const Lamp lamp = tilted_disc();
  const auto rim = rim_in_world(lamp, 12);
  ASSERT_EQ(rim.size(), 12u);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Eigen::Vector3d a = rim[i] - lamp.centre_m;
    const Eigen::Vector3d b = rim[(i + 1) % rim.size()] - lamp.centre_m;
    EXPECT_NEAR(a.norm(), lamp.radius_m, 1e-15);
    EXPECT_NEAR(a.dot(lamp.normal), 0, 1e-15);
    EXPECT_GT(a.cross(b).dot(lamp.normal), 0);
  }
}

TEST(RimInWorld, RectangleKeepsItsCornersForAnyCountAndAspect) {
  for (const double width : {0.6, 30.0, 0.01}) {
    for (const int count : {8, 9, 33, 64}) {
      Lamp lamp = tilted_rectangle();
      lamp.size_m.x() = width;
      const auto rim = rim_in_world(lamp, count);
      ASSERT_EQ(rim.size(), static_cast<std::size_t>(count));
      const Eigen::Vector3d y_axis = lamp.normal.cross(lamp.x_axis);
      for (const double x : {-0.5, 0.5}) {
        for (const double y : {-0.5, 0.5}) {
          const Eigen::Vector3d corner =
              lamp.centre_m + x * lamp.size_m.x() * lamp.x_axis + y * lamp.size_m.y() * y_axis;
          double nearest = 1e9;
          for (const auto& p : rim) nearest = std::min(nearest, (p - corner).norm());
          EXPECT_LT(nearest, 1e-12) << width << " " << count;
        }
      }
      double swept = 0;
      for (std::size_t i = 0; i < rim.size(); ++i) {
        swept += (rim[i] - lamp.centre_m)
                     .cross(rim[(i + 1) % rim.size()] - lamp.centre_m)
                     .dot(lamp.normal);
      }
      EXPECT_NEAR(swept / 2, lamp.area_m2(), 1e-9);
    }
  }
}

TEST(RimInWorld, IsEmptyForAPointAndRejectsSmallCounts) {
  Lamp lamp = tilted_disc();
  EXPECT_THROW(rim_in_world(lamp, 7), std::invalid_argument);
  lamp.shape = LampShape::point;
  EXPECT_TRUE(rim_in_world(lamp, 8).empty());
  const auto pixel = project_rim(lamp, some_pose(), bent, 8);
  ASSERT_TRUE(pixel);
  ASSERT_EQ(pixel->size(), 1u);
  EXPECT_EQ(pixel->front(), *bent.project(some_pose() * lamp.centre_m));
}

TEST(ProjectRim, IsNulloptForTheDarkSideBehindOrOutsideTheDomain) {
  for (Lamp lamp : {tilted_disc(), tilted_rectangle()}) {
    EXPECT_TRUE(project_rim(lamp, some_pose(), straight, 16));
    EXPECT_TRUE(project_lamp_centre(lamp, some_pose(), straight));
    Lamp dark = lamp;
    dark.normal = -dark.normal;
    EXPECT_FALSE(project_rim(dark, some_pose(), straight, 16));
    EXPECT_FALSE(project_lamp_centre(dark, some_pose(), straight));
    Lamp astride = lamp;  // the lit side is visible, but part of it is behind the camera
    astride.centre_m = {0, 0, 0.02};
    astride.normal = Eigen::Vector3d(-1, 0, -0.1).normalized();
    astride.x_axis = Eigen::Vector3d(-0.1, 0, 1).normalized();
    astride.centre_m.x() = 0.5;
    EXPECT_FALSE(project_rim(astride, Rigid3{}, straight, 16));
    EXPECT_FALSE(project_lamp_centre(astride, Rigid3{}, straight));
    Lamp far_off = lamp;  // beyond the radius at which this lens folds back
    far_off.centre_m = {9, 0, 2.5};
    far_off.normal = -Eigen::Vector3d::UnitZ();
    far_off.x_axis = Eigen::Vector3d::UnitX();
    EXPECT_TRUE(project_rim(far_off, Rigid3{}, straight, 16));
    const Camera folding = Camera::pinhole(640, 480, 500, 500, 320, 240, {-0.3, 0, 0, 0});
    EXPECT_FALSE(project_rim(far_off, Rigid3{}, folding, 16));
    EXPECT_FALSE(project_lamp_centre(far_off, Rigid3{}, folding));
  }
}

TEST(LampCentre, DiscIsTheCentreOfTheConicThroughItsRim) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Lamp lamp = tilted_disc(random.uniform(0.02, 0.4));
    lamp.centre_m += 0.5 * test::random_vector(random);
    lamp.normal = (Eigen::Vector3d(0, 0, -1) + 0.4 * test::random_vector(random)).normalized();
    const auto rim = project_rim(lamp, some_pose(), straight, 24);
    if (!rim) continue;
    const auto centre = project_lamp_centre(lamp, some_pose(), straight);
    ASSERT_TRUE(centre);
    EXPECT_LT((*centre - conic_centre(*rim)).norm(), 1e-8);
  }
}

TEST(LampCentre, BiasOfADiscsProjectedCentreFollowsTheory) {
  const Camera camera = Camera::pinhole(1280, 960, 1000, 1000, 640, 480);
  const double tilt = 3.14159265358979 / 6;
  for (const auto& [diameter_m, bias_px] : {std::pair{0.18, 0.56}, {0.6, 6.3}}) {
    Lamp lamp = test::disc_lamp(0, {0, 0, 2.5}, diameter_m / 2);
    lamp.normal = {std::sin(tilt), 0, -std::cos(tilt)};
    const auto image = project_lamp_centre(lamp, Rigid3{}, camera);
    const auto point = camera.project(lamp.centre_m);
    ASSERT_TRUE(image && point);
    EXPECT_NEAR((*image - *point).norm(), bias_px, 0.01 * bias_px);
  }
}

TEST(LampCentre, IsTheCentroidOfTheImage) {
  for (const Lamp& lamp : {tilted_disc(0.3), tilted_rectangle()}) {
    for (const Camera* camera : {&straight, &bent}) {
      const auto rim = project_rim(lamp, some_pose(), *camera, 40000);
      const auto centre = project_lamp_centre(lamp, some_pose(), *camera);
      ASSERT_TRUE(rim && centre);
      EXPECT_LT((*centre - test::polygon_centroid(*rim)).norm(), 2e-6);
    }
  }
}

TEST(LampCentre, ClosedFormAndQuadratureAgree) {
  const Camera nearly_straight =
      Camera::pinhole(1280, 960, 1000, 990, 640, 480, {1e-15, 0, 0, 0}, 0.5);
  Eigen::Matrix<double, 2, 6> closed, quadrature;
  const auto a = project_lamp_centre(tilted_disc(0.3), some_pose(), straight, &closed);
  const auto b = project_lamp_centre(tilted_disc(0.3), some_pose(), nearly_straight, &quadrature);
  ASSERT_TRUE(a && b);
  EXPECT_LT((*a - *b).norm(), 1e-9);
  EXPECT_LT((closed - quadrature).norm(), 1e-8 * closed.norm());
}

TEST(LampCentre, JacobianAgreesWithDifferencesAndErrorsAreDetected) {
  Lamp point = tilted_disc();
  point.shape = LampShape::point;
  for (const Lamp& lamp : {tilted_disc(0.3), tilted_rectangle(), point}) {
    for (const Camera* camera : {&straight, &bent}) {
      const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        return project_lamp_centre(lamp, perturb(some_pose(), d), *camera).value();
      };
      const Eigen::MatrixXd numeric = test::numerical_jacobian(f, Eigen::VectorXd::Zero(6));
      Eigen::Matrix<double, 2, 6> analytic;
      ASSERT_TRUE(project_lamp_centre(lamp, some_pose(), *camera, &analytic));
      EXPECT_TRUE(test::jacobian_agrees(analytic, numeric));
      Eigen::Matrix<double, 2, 6> point_jacobian;  // of the projected centre, ignoring the shape
      ASSERT_TRUE(project_lamp_centre(point, some_pose(), *camera, &point_jacobian));
      if (lamp.shape != LampShape::point) {
        EXPECT_FALSE(test::jacobian_agrees(point_jacobian, numeric));
      }
    }
  }
}

TEST(RimDistance, IsZeroOnTheRimAndTheOffsetNearIt) {
  for (const Lamp& lamp :
       {tilted_disc(), tilted_rectangle(), tilted_curve(1.3), tilted_curve(4), tilted_polygon()}) {
    for (const Camera* camera : {&straight, &bent}) {
      for (const double offset : {0.0, 0.3, -0.3}) {
        const auto rim = test::exact_rim(lamp, some_pose(), *camera, 40, 0.05, offset);
        ASSERT_GE(rim.size(), 36u);
        for (const RimPoint& point : rim) {
          const auto ray = rim_ray(point, *camera);
          ASSERT_TRUE(ray);
          const auto distance = rim_distance_px(lamp, some_pose(), *ray);
          ASSERT_TRUE(distance);
          // The second order of a curve is larger where it bends most.
          const double near = lamp.shape == LampShape::lame ? 3e-3 : 2e-3;
          EXPECT_NEAR(*distance, offset, offset == 0 ? 1e-9 : near);
        }
      }
    }
  }
}

TEST(RimDistance, JacobianAgreesWithDifferencesAndErrorsAreDetected) {
  for (const Lamp& lamp :
       {tilted_disc(), tilted_rectangle(), tilted_curve(1.3), tilted_curve(4), tilted_polygon()}) {
    for (const Camera* camera : {&straight, &bent}) {
      // 3 px off, so that the dependence of the scale on the pose matters
      for (const RimPoint& point : test::exact_rim(lamp, some_pose(), *camera, 16, 0.05, 3)) {
        const auto ray = rim_ray(point, *camera);
        ASSERT_TRUE(ray);
        const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return Eigen::VectorXd::Constant(
              1, rim_distance_px(lamp, perturb(some_pose(), d), *ray).value());
        };
        const Eigen::MatrixXd numeric = test::numerical_jacobian(f, Eigen::VectorXd::Zero(6));
        Eigen::Matrix<double, 1, 6> analytic, elsewhere;
        ASSERT_TRUE(rim_distance_px(lamp, some_pose(), *ray, &analytic));
        EXPECT_TRUE(test::jacobian_agrees(analytic, numeric));
        const Rigid3 off = perturb(some_pose(), Vector6::Constant(1e-3));
        ASSERT_TRUE(rim_distance_px(lamp, off, *ray, &elsewhere));
        EXPECT_FALSE(test::jacobian_agrees(elsewhere, numeric));
      }
    }
  }
}

TEST(RimDistance, RectanglesCornersFollowTheMeasuredSide) {
  Lamp lamp = test::disc_lamp(0, {0, 0, 2});
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.4, 0.4};
  const Camera camera = Camera::pinhole(640, 480, 500, 500, 320, 240);
  // The half side is 50 px. A point of the right side, 0.2 px from the corner, is measured 0.3 px
  // too far inside, so it is nearer to the neighbouring side than to its own.
  const auto ray = rim_ray({{369.7, 289.8}, {1, 0}, 0.1}, camera);
  ASSERT_TRUE(ray);
  const auto distance = rim_distance_px(lamp, Rigid3{}, *ray);
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, -0.3, 1e-9);
}

TEST(RimDistance, IsNulloptWhereItIsUndefined) {
  const Lamp lamp = test::disc_lamp(0, {0, 0, 2}, 0.1);
  const Camera camera = Camera::pinhole(640, 480, 500, 500, 320, 240);
  const RimRay on_rim = rim_ray({{345, 240}, {1, 0}, 0.1}, camera).value();
  EXPECT_TRUE(rim_distance_px(lamp, Rigid3{}, on_rim));
  Lamp dark = lamp;
  dark.normal = -dark.normal;
  EXPECT_FALSE(rim_distance_px(dark, Rigid3{}, on_rim));
  Lamp behind = lamp;
  behind.centre_m.z() = -2;
  EXPECT_FALSE(rim_distance_px(behind, Rigid3{}, on_rim));
  Lamp wall = lamp;  // the ray meets its plane behind the camera
  wall.centre_m = {-1, 0, 2};
  wall.normal = {1, 0, 0};
  EXPECT_FALSE(rim_distance_px(wall, Rigid3{}, on_rim));
  const RimRay inverted = rim_ray({{345, 240}, {-1, 0}, 0.1}, camera).value();
  EXPECT_FALSE(rim_distance_px(lamp, Rigid3{}, inverted));
  const RimRay centre = rim_ray({{320, 240}, {1, 0}, 0.1}, camera).value();
  EXPECT_FALSE(rim_distance_px(lamp, Rigid3{}, centre));
  Lamp point = lamp;
  point.shape = LampShape::point;
  EXPECT_FALSE(rim_distance_px(point, Rigid3{}, on_rim));
  const Camera folding = Camera::pinhole(640, 480, 500, 500, 320, 240, {-0.3, 0, 0, 0});
  EXPECT_FALSE(rim_ray({{2000, 240}, {1, 0}, 0.1}, folding));
}

}  // namespace
}  // namespace occ
