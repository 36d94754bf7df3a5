// SPDX-License-Identifier: Apache-2.0
// validate() of Lamp, Scene and Prior, and the prior's chi-square.
#include "libocc/scene/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/scene/prior.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using test::complaint;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Lamp rectangle_lamp(const Vector3d& normal, const Vector3d& x_axis) {
  Lamp lamp;
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.6, 0.3};
  lamp.normal = normal;
  lamp.x_axis = x_axis;
  return lamp;
}

TEST(Lamp, AreaAndOrder) {
  EXPECT_DOUBLE_EQ(test::disc_lamp(0, {0, 0, 3}, 0.5).area_m2(), pi / 4);
  EXPECT_DOUBLE_EQ(rectangle_lamp({0, 0, -1}, {1, 0, 0}).area_m2(), 0.18);
  Lamp point;
  point.shape = LampShape::point;
  EXPECT_EQ(point.area_m2(), 0);
  EXPECT_NEAR(point.order(), 1, 1e-14);
}

TEST(Lamp, AxesBecomeUnitAndOrthogonalAndStaySo) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const double scale = std::exp(random.uniform(-10, 10));
    Lamp lamp = rectangle_lamp(scale * test::random_vector(random), test::random_vector(random));
    const Vector3d normal = lamp.normal.normalized(), x_axis = lamp.x_axis;
    if (i % 3 == 1) lamp.shape = LampShape::point;
    if (i % 3 == 2) lamp = test::disc_lamp(i, {0, 0, 3}), lamp.normal = normal;
    lamp.validate();
    EXPECT_LT((lamp.normal - normal).norm(), 1e-15);
    EXPECT_NEAR(lamp.x_axis.norm(), 1, 1e-15);
    EXPECT_NEAR(lamp.x_axis.dot(lamp.normal), 0, 1e-15);
    if (lamp.shape == LampShape::rectangle) {
      EXPECT_NEAR(lamp.x_axis.dot(normal.cross(x_axis)), 0, 1e-12) << "x_axis left its plane";
      EXPECT_GT(lamp.x_axis.dot(x_axis), 0);
    }
    Lamp again = lamp;
    again.validate();
    EXPECT_EQ(again.normal, lamp.normal) << i;
    EXPECT_EQ(again.x_axis, lamp.x_axis) << i;
  }
}

TEST(Lamp, DiscMayFaceAlongTheDefaultXAxis) {
  for (const Vector3d& normal : {Vector3d(1, 0, 0), Vector3d(-1, 1e-9, 0), Vector3d(1, 0.01, 0)}) {
    Lamp lamp = test::disc_lamp(0, {0, 2, 1.5});
    lamp.normal = normal;
    EXPECT_NO_THROW(lamp.validate());
    EXPECT_NEAR(lamp.x_axis.dot(lamp.normal), 0, 1e-15);
    EXPECT_NEAR(lamp.x_axis.norm(), 1, 1e-15);
  }
}

TEST(Lamp, ValidateNamesLampFieldAndValue) {
  struct Case {
    const char* expected;
    std::function<void(Lamp&)> spoil;
  };
  const std::vector<Case> cases = {
      {"lamp 7: radius_m must be positive, got -0.1", [](Lamp& l) { l.radius_m = -0.1; }},
      {"lamp 7: radius_m must be positive, got nan", [](Lamp& l) { l.radius_m = nan; }},
      {"lamp 7: normal must be a direction, not zero, got [0, 0, 0]",
       [](Lamp& l) { l.normal.setZero(); }},
      {"lamp 7: normal must be finite, got [0, nan, 1]",
       [](Lamp& l) {
         l.normal = {0, nan, 1};
       }},
      {"lamp 7: centre_m must be finite, got [nan, 0, 3]",
       [](Lamp& l) {
         l.centre_m = {nan, 0, 3};
       }},
      {"lamp 7: power_w must be positive, got 0", [](Lamp& l) { l.power_w = 0; }},
      {"lamp 7: power_sigma must be zero or positive, got -1", [](Lamp& l) { l.power_sigma = -1; }},
      {"lamp 7: half_power_rad must be in (0, pi/2), got 2", [](Lamp& l) { l.half_power_rad = 2; }},
      {"lamp 7: frequency_hz must be positive, got 0", [](Lamp& l) { l.frequency_hz = 0; }},
      {"lamp 7: duty must be in (0, 1], got 1.5", [](Lamp& l) { l.duty = 1.5; }},
      {"lamp 7: size_m must be two positive lengths, got [0.6, 0]",
       [](Lamp& l) {
         l = rectangle_lamp({0, 0, -1}, {1, 0, 0}), l.id = 7, l.size_m.y() = 0;
       }},
      {"lamp 7: x_axis must be not parallel to the normal, got [0, 0, 5]",
       [](Lamp& l) {
         l = rectangle_lamp({0, 0, -1}, {0, 0, 5}), l.id = 7;
       }},
      {"lamp 7: x_axis must be a direction, not zero, got [0, 0, 0]",
       [](Lamp& l) {
         l = rectangle_lamp({0, 0, -1}, {0, 0, 0}), l.id = 7;
       }},
  };
  for (const Case& c : cases) {
    Lamp lamp = test::disc_lamp(7, {0, 0, 3});
    c.spoil(lamp);
    EXPECT_EQ(complaint([&] { lamp.validate(); }), c.expected);
  }
}

TEST(Scene, ValidateChecksEveryPart) {
  Scene good = test::irregular_room();
  good.room = Room{};
  EXPECT_NO_THROW(good.validate());

  Scene twice = good;
  twice.lamps[4].id = 2;
  EXPECT_EQ(complaint([&] { twice.validate(); }), "lamps: id must be unique, got 2");
  Scene lamp = good;
  lamp.lamps[3].radius_m = 0;
  EXPECT_EQ(complaint([&] { lamp.validate(); }), "lamp 3: radius_m must be positive, got 0");
  Scene sensor = good;
  sensor.sensor.gamma = -1;
  EXPECT_EQ(complaint([&] { sensor.validate(); }), "sensor.gamma must be positive, got -1");
  Scene room = good;
  room.room->size_m.z() = -3;
  EXPECT_EQ(complaint([&] { room.validate(); }),
            "room.size_m must be three positive lengths, got [4, 4, -3]");
  room = good;
  room.room->wall_reflectance = 1;
  EXPECT_EQ(complaint([&] { room.validate(); }), "room.wall_reflectance must be in [0, 1), got 1");
}

TEST(Prior, EmptyHasZeroChi2) {
  Random random(2);
  const Prior prior;
  EXPECT_TRUE(prior.empty());
  EXPECT_EQ(prior.chi2(test::random_pose(random)), 0);
  EXPECT_NO_THROW(prior.validate());
}

TEST(Prior, TheTruthHasZeroChi2) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const Rigid3 pose = test::random_pose(random);
    Prior prior;
    prior.position_m = pose.inverse() * Vector3d::Zero();
    prior.heading_rad = heading_rad(pose);
    prior.gravity_in_cam = pose.rotation * Vector3d(0, 0, -1);
    EXPECT_NO_THROW(prior.validate());
    EXPECT_NEAR(prior.chi2(pose), 0, 1e-20);
  }
}

TEST(Prior, PositionCountsSigmasPerAxis) {
  const Rigid3 pose = Rigid3{so3_exp({0.3, -0.2, 1}), {0, 0, 0}};
  Prior prior;
  prior.position_m = Vector3d(0.2, -0.4, 0.1);
  prior.position_sigma_m = 0.1;
  EXPECT_NEAR(prior.chi2(pose), 4 + 16 + 1, 1e-12);
}

TEST(Prior, HeadingWraps) {
  Prior prior;
  prior.heading_rad = pi - 0.1;
  prior.heading_sigma_rad = 0.1;
  // A camera that looks up, at heading -pi + 0.1: 0.2 rad away across the discontinuity at pi.
  for (const double heading : {-pi + 0.1, pi - 0.3}) {
    const Vector3d x(std::cos(heading), std::sin(heading), 0), z(0, 0, 1);
    Rigid3 pose;
    pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    EXPECT_NEAR(prior.chi2(pose), 4, 1e-9) << heading;
  }
}

TEST(Prior, GravityChi2IsIndependentOfTheHeading) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const Rigid3 pose = test::random_pose(random);
    const Vector3d down = pose.rotation * Vector3d(0, 0, -1);
    const double angle = random.uniform(0, pi);
    const Vector3d axis = down.cross(test::random_vector(random)).normalized();
    Prior prior;
    prior.gravity_in_cam = so3_exp(angle * axis) * down;
    prior.gravity_sigma_rad = 0.1;
    EXPECT_NEAR(std::sqrt(prior.chi2(pose)) * 0.1, angle, 1e-7);
    const Rigid3 turned = pose * Rigid3{so3_exp({0, 0, random.uniform(-3, 3)}), {1, 2, 3}};
    EXPECT_NEAR(prior.chi2(turned), prior.chi2(pose), 1e-6 * prior.chi2(pose));
  }
}

TEST(Prior, ValidateNamesFieldAndValue) {
  Prior prior;
  prior.position_m = Vector3d(0, nan, 0);
  EXPECT_EQ(complaint([&] { prior.validate(); }),
            "prior.position_m must be finite, got [0, nan, 0]");
  prior = {};
  prior.position_sigma_m = 0;
  EXPECT_EQ(complaint([&] { prior.validate(); }), "prior.position_sigma_m must be positive, got 0");
  prior = {};
  prior.heading_rad = nan;
  EXPECT_EQ(complaint([&] { prior.validate(); }), "prior.heading_rad must be finite, got nan");
  prior = {};
  prior.heading_sigma_rad = -1;
  EXPECT_EQ(complaint([&] { prior.validate(); }),
            "prior.heading_sigma_rad must be positive, got -1");
  prior = {};
  prior.gravity_in_cam = Vector3d(0, 9.81, 0);
  EXPECT_EQ(complaint([&] { prior.validate(); }),
            "prior.gravity_in_cam must be a unit vector, got [0, 9.81, 0]");
  prior = {};
  prior.gravity_sigma_rad = nan;
  EXPECT_EQ(complaint([&] { prior.validate(); }),
            "prior.gravity_sigma_rad must be positive, got nan");
}

}  // namespace
}  // namespace occ
