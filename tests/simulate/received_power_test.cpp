// SPDX-License-Identifier: Apache-2.0
// Power through the lens: the figures of the conference contribution, the field of view, and lamps
// cut by its border or by boxes. The oracles are sums over single points, closed forms and the
// rendered image.
#include "libocc/simulate/received_power.hpp"

#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/scene_file.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A camera that looks straight up, with its image x axis along the world's x axis.
Rigid3 upright(double x, double y, double z = 1.5) {
  return {Eigen::Matrix3d::Identity(), -Vector3d(x, y, z)};
}

Rigid3 turned(const Vector3d& axis, double angle_rad, const Vector3d& position) {
  const Eigen::Matrix3d rotation = so3_exp(angle_rad * axis);
  return {rotation, -(rotation * position)};
}

Scene contribution(double focal_m, const std::string& name = "kookmin_one_lamp") {
  Scene scene = read_scene(LIBOCC_DATA "/scenes/" + name + ".yaml");
  const double f_px = focal_m / scene.sensor.pixel_pitch_m;
  scene.camera = Camera::pinhole(scene.camera.width(), scene.camera.height(), f_px, f_px,
                                 scene.camera.cx_px(), scene.camera.cy_px());
  return scene;
}

/// Sum over many random points of the face; each point is tested for visibility.
double brute_force(const Scene& scene, const Lamp& lamp, const Rigid3& pose,
                   double* seen_share = nullptr) {
  Random random(7);
  const Vector3d eye = pose.origin_in_source(), across = lamp.normal.cross(lamp.x_axis);
  const bool disc = lamp.shape == LampShape::disc;
  const Vector2d half = disc ? Vector2d::Constant(lamp.radius_m) : Vector2d(0.5 * lamp.size_m);
  const double exponent = disc ? 2 : lamp.exponent;
  double sum_w = 0;
  int count = 0, seen = 0;
  for (int i = 0; i < 400000; ++i) {
    const Vector2d at(random.uniform(-1, 1), random.uniform(-1, 1));
    const double radial =
        std::pow(std::abs(at.x()), exponent) + std::pow(std::abs(at.y()), exponent);
    if (lamp.shape != LampShape::rectangle && radial > 1) continue;
    ++count;
    const Vector3d point =
        lamp.centre_m + at.x() * half.x() * lamp.x_axis + at.y() * half.y() * across;
    const auto px = scene.camera.project(pose * point);
    if (!px || !scene.camera.contains(*px)) continue;
    bool hidden = false;
    for (const Box& box : scene.boxes)
      for (int k = 0; k < 400 && !hidden; ++k) {
        const Vector3d p = eye + (k + 0.5) / 400 * (point - eye);
        hidden = (p - box.min_m).minCoeff() > 0 && (box.max_m - p).minCoeff() > 0;
      }
    if (hidden) continue;
    ++seen;
    const Vector3d way = eye - point;
    const double d = way.norm();
    sum_w += aperture_power(lamp.power_w, lamp.order(), way.dot(lamp.normal) / d,
                            (pose * point).z() / d, d, aperture_m2(scene.camera, scene.sensor));
  }
  if (seen_share) *seen_share = static_cast<double>(seen) / count;
  return sum_w / count;
}

double electrons_per_w(const Sensor& sensor) {
  const double pixel_m2 = sensor.pixel_pitch_m * sensor.pixel_pitch_m;
  return sensor.electrons(1 / pixel_m2) - sensor.electrons(0);
}

double total_dbm(const Scene& scene, const Rigid3& pose) {
  return dbm(received_power(scene, pose).total_w());
}

TEST(Contribution, PowerThroughTheLens) {
  Scene scene = contribution(1.4e-3);
  scene.lamps[0].shape = LampShape::point;
  EXPECT_NEAR(total_dbm(scene, upright(2, 2)), -41.73, 5e-3);
  scene = contribution(3e-3);
  scene.lamps[0].shape = LampShape::point;
  EXPECT_NEAR(total_dbm(scene, upright(2, 2)), -35.11, 5e-3);
  // The power over the disc is lower by a fraction of about (r/d)^2 (m + 3) / 4.
  const double loss = 0.25 * std::pow(0.085 / 1.5, 2) * (0.64606 + 3);
  EXPECT_NEAR(total_dbm(contribution(3e-3), upright(2, 2)),
              total_dbm(scene, upright(2, 2)) + dbm(1e-3 * (1 - loss)), 1e-4);
}

TEST(Contribution, DiameterOfTheImage) {
  for (const auto& [focal_m, diameter_px] : {std::pair{1.4e-3, 22.3}, {3e-3, 47.9}}) {
    const Scene scene = contribution(focal_m);
    const auto rim = project_rim(scene.lamps[0], upright(2, 2), scene.camera, 64);
    EXPECT_NEAR(((*rim)[0] - (*rim)[32]).norm(), diameter_px, 0.05);
  }
}

struct View {
  double focal_m, width_deg, height_deg, half_x_m, half_y_m;
};
constexpr View views[] = {{1.4e-3, 116.7, 101.2, 2.43, 1.83}, {3e-3, 74.3, 59.2, 1.14, 0.85}};

TEST(Contribution, FieldOfView) {
  for (const View& view : views) {
    const Camera camera = contribution(view.focal_m).camera;
    const auto angle = [&](const Vector2d& a, const Vector2d& b) {
      return std::acos(camera.unproject(a)->dot(*camera.unproject(b))) * 180 / pi;
    };
    EXPECT_NEAR(angle({-0.5, 239.5}, {639.5, 239.5}), view.width_deg, 0.05);
    EXPECT_NEAR(angle({319.5, -0.5}, {319.5, 479.5}), view.height_deg, 0.05);
  }
}

// Largest horizontal distance between an upright camera and the lamp at which power arrives.
TEST(Contribution, Footprint) {
  for (const View& view : views) {
    Scene scene = contribution(view.focal_m);
    scene.lamps[0].shape = LampShape::point;
    const auto end = [&](const Vector3d& direction) {
      double seen = 0, lost = 10;
      while (lost - seen > 1e-6) {
        const double at = 0.5 * (seen + lost);
        const Vector3d position = Vector3d(2, 2, 1.5) + at * direction;
        const bool power = received_power(scene, upright(position.x(), position.y())).total_w() > 0;
        (power ? seen : lost) = at;
      }
      return seen;
    };
    for (const double sign : {-1, 1}) {
      EXPECT_NEAR(end(sign * Vector3d::UnitX()), view.half_x_m, 5e-3);
      EXPECT_NEAR(end(sign * Vector3d::UnitY()), view.half_y_m, 5e-3);
    }
  }
}

TEST(ReceivedPower, OfAFaceIsTheSumOverItsPoints) {
  Random random(5);
  for (const LampShape shape : {LampShape::disc, LampShape::rectangle, LampShape::lame}) {
    Scene scene = irregular_room();
    Lamp& lamp = scene.lamps[4];
    lamp.shape = shape;
    lamp.radius_m = shape == LampShape::disc ? 0.3 : 0;
    if (shape != LampShape::disc) lamp.size_m = {0.7, 0.4};
    lamp.exponent = 4;
    lamp.normal = Vector3d(0.2, -0.1, -1);
    lamp.validate();
    scene.lamps = {lamp};
    for (int i = 0; i < 3; ++i) {
      const Rigid3 pose = random_room_pose(random);
      const ReceivedPower received = received_power(scene, pose);
      double share = 0;
      const double expected_w = brute_force(scene, lamp, pose, &share);
      EXPECT_EQ(received.lamps[0].whole, share == 1);
      EXPECT_NEAR(received.total_w() / expected_w, 1, 1e-3) << "shape " << static_cast<int>(shape);
    }
  }
}

TEST(ReceivedPower, OfASmallLampFollowsFromItsCentre) {
  Scene scene = irregular_room();
  Scene points = scene;
  for (Lamp& lamp : points.lamps) lamp.shape = LampShape::point;
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 pose = random_room_pose(random);
    const ReceivedPower discs = received_power(scene, pose), dots = received_power(points, pose);
    for (std::size_t k = 0; k < scene.lamps.size(); ++k) {
      if (!discs.lamps[k].whole) continue;
      const double distance = (pose * scene.lamps[k].centre_m).norm();
      EXPECT_NEAR(discs.lamps[k].power_w / dots.lamps[k].power_w, 1,
                  4 * std::pow(0.085 / distance, 2));
      const double expected_e = lamp_electrons(scene.lamps[k], pose, scene.camera, scene.sensor);
      EXPECT_NEAR(dots.lamps[k].power_w * electrons_per_w(scene.sensor) / expected_e, 1, 1e-12);
    }
  }
}

// The power agrees with the electrons of the image times the energy of a photon.
TEST(ReceivedPower, IsTheLightInTheRenderedImage) {
  for (const double x : {2.0, 0.9, 0.82}) {  // whole, cut, nearly outside
    Scene scene = contribution(3e-3);
    scene.lens.vignetting = {-0.3};
    const Rigid3 pose = upright(x, 2.1);
    const double peak_e = 2e4;
    const Eigen::MatrixXd electrons = mean_electrons(scene, pose, peak_e);
    const double per_w = electrons_per_w(scene.sensor);
    const ReceivedPower received = received_power(scene, pose);
    // A blurred rim moves some light across the image's border, in both directions.
    EXPECT_NEAR(received.total_w() * per_w / electrons.sum(), 1, x == 2.0 ? 2e-4 : 2e-2) << x;
    EXPECT_EQ(received.lamps[0].whole, x == 2.0);
    EXPECT_EQ(received.visible(), 1);
  }
}

// A lamp that is halved by the border gives half of its power; its centre alone would give all or
// none.
TEST(ReceivedPower, OfHalfALampIsHalf) {
  Scene scene = contribution(3e-3);
  scene.lamps[0].half_power_rad = pi / 3;
  const double border_m = 1.5 * 320 / scene.camera.fx_px();
  for (const double sign : {-1, 1}) {
    const Rigid3 pose = upright(2 + sign * border_m, 2);
    const double cut_w = received_power(scene, pose).total_w();
    scene.camera =
        Camera::pinhole(1280, 480, scene.camera.fx_px(), scene.camera.fy_px(), 639.5, 239.5);
    const double whole_w = received_power(scene, pose).total_w();
    scene.camera = contribution(3e-3).camera;
    // The inner half is nearer and brighter, by the gradient of the light.
    EXPECT_NEAR(cut_w / whole_w, 0.5, 0.03);
    EXPECT_NEAR(cut_w / brute_force(scene, scene.lamps[0], pose), 1, 5e-3);
  }
}

TEST(ReceivedPower, IsZeroIfNothingIsVisible) {
  const Scene scene = contribution(1.4e-3);
  EXPECT_EQ(received_power(scene, upright(2, 2, 3.2)).total_w(), 0) << "behind the lamp";
  EXPECT_EQ(received_power(scene, upright(2, 2, 3)).total_w(), 0) << "at the lamp";
  const Rigid3 down = turned(Vector3d::UnitX(), pi, {2, 2, 1.5});
  EXPECT_EQ(received_power(scene, down).total_w(), 0) << "looking down";
  EXPECT_EQ(received_power(scene, down).visible(), 0);
  EXPECT_FALSE(received_power(scene, down).lamps[0].whole);
}

TEST(ReceivedPower, OfARoundViewDoesNotDependOnTheHeading) {
  Scene scene = contribution(1.4e-3, "kookmin_four_lamps");
  const auto at_heading = [&](double angle_rad) {
    return received_power(scene, turned(Vector3d::UnitZ(), angle_rad, {2, 2, 2.2}));
  };
  // All four lamps are equivalent seen from the middle of the square, and the view is symmetric to
  // them.
  const Camera& c = scene.camera;
  scene.camera = Camera::pinhole(1600, 1600, c.fx_px(), c.fy_px(), 799.5, 799.5);
  const double straight_w = at_heading(0).total_w();
  for (const double angle_rad : {0.3, 1.0, 2.5, -1.9}) {
    EXPECT_EQ(at_heading(angle_rad).visible(), 4);
    EXPECT_NEAR(at_heading(angle_rad).total_w() / straight_w, 1, 1e-6);
  }
  scene.camera = c;
  EXPECT_NE(at_heading(0).total_w(), at_heading(0.3).total_w()) << "a narrow view cuts lamps";
}

TEST(ReceivedPower, DoesNotDependOnTheWorldsFrame) {
  Random random(9);
  Scene scene = irregular_room();
  scene.lamps[2].shape = LampShape::rectangle;
  scene.lamps[2].radius_m = 0;
  scene.lamps[2].size_m = {0.4, 0.2};
  scene.lamps[2].validate();
  const Rigid3 pose = random_room_pose(random), other = random_pose(random);
  Scene moved = scene;
  for (Lamp& lamp : moved.lamps) {
    lamp.validate();
    lamp.centre_m = other * lamp.centre_m;
    lamp.normal = other.rotation * lamp.normal;
    lamp.x_axis = other.rotation * lamp.x_axis;
  }
  const ReceivedPower a = received_power(scene, pose);
  const ReceivedPower b = received_power(moved, pose * other.inverse());
  ASSERT_GT(a.visible(), 2);
  for (std::size_t k = 0; k < a.lamps.size(); ++k)
    EXPECT_NEAR(a.lamps[k].power_w, b.lamps[k].power_w, 1e-4 * a.total_w());
}

TEST(ReceivedPower, BoxesHide) {
  Scene scene = contribution(1.4e-3);
  scene.lamps[0].radius_m = 0.3;
  const Rigid3 pose = upright(2.1, 2);
  const double free_w = received_power(scene, pose).total_w();

  scene.boxes = {{{3, 3, 0}, {4, 4, 2}}};
  EXPECT_EQ(received_power(scene, pose).total_w(), free_w) << "a box elsewhere";
  EXPECT_TRUE(received_power(scene, pose).lamps[0].whole);

  scene.boxes = {{{1.5, 1.5, 2.5}, {2.5, 2.5, 2.6}}};
  EXPECT_EQ(received_power(scene, pose).total_w(), 0) << "a box before all of it";

  scene.boxes = {{{1.5, 1.5, 2.5}, {2, 2.5, 2.6}}, {{2.1, 1.9, 2.2}, {2.12, 2.1, 2.25}}};
  double share = 0;
  const double expected_w = brute_force(scene, scene.lamps[0], pose, &share);
  ASSERT_GT(share, 0.2);
  ASSERT_LT(share, 0.8);
  EXPECT_NEAR(received_power(scene, pose).total_w() / expected_w, 1, 5e-3);
  EXPECT_FALSE(received_power(scene, pose).lamps[0].whole);

  scene.boxes = {{{2, 1, 1}, {3, 3, 2}}};
  EXPECT_EQ(received_power(scene, pose).total_w(), 0) << "the camera is inside a box";
}

TEST(ReceivedPower, OfManyPosesEqualsThatOfSinglePoses) {
  const Scene scene = contribution(3e-3, "kookmin_four_lamps");
  std::vector<Rigid3> poses;
  for (int i = 0; i < 30; ++i) poses.push_back(upright(0.13 * i, 4 - 0.11 * i));
  const std::vector<ReceivedPower> all = received_power(scene, poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const ReceivedPower one = received_power(scene, poses[i]);
    for (std::size_t k = 0; k < scene.lamps.size(); ++k) {
      EXPECT_EQ(all[i].lamps[k].power_w, one.lamps[k].power_w);
      EXPECT_EQ(all[i].lamps[k].whole, one.lamps[k].whole);
    }
  }
}

TEST(ReceivedPower, RejectsInvalidInput) {
  Scene scene = contribution(3e-3);
  const Rigid3 bad = upright(std::numeric_limits<double>::quiet_NaN(), 1);
  EXPECT_NE(complaint([&] {
              received_power(scene, std::vector<Rigid3>{upright(1, 1), bad});
            }).find("cam_from_world[1] must be finite"),
            std::string::npos);
  scene.sensor.f_number = -1;
  EXPECT_NE(complaint([&] { received_power(scene, upright(1, 1)); }).find("f_number"),
            std::string::npos);
}

TEST(Dbm, IsDecibelsOverAMilliwatt) {
  EXPECT_DOUBLE_EQ(dbm(1e-3), 0);
  EXPECT_DOUBLE_EQ(dbm(1), 30);
  EXPECT_EQ(dbm(0), -std::numeric_limits<double>::infinity());
  EXPECT_NE(complaint([] { dbm(-1); }), "");
  EXPECT_NE(complaint([] { dbm(std::numeric_limits<double>::quiet_NaN()); }), "");
}

}  // namespace
