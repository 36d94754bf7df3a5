// SPDX-License-Identifier: Apache-2.0
// Tracker on rendered images: lamps that enter and leave the view, late, repeated and missing
// images, and a kidnapped camera.
#include "libocc/track/tracker.hpp"

#include <cmath>

#include "libocc/geometry/motion.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

constexpr double frame_s = 1.0 / 30;

Scene scene_named(const std::string& name) {
  return read_scene(std::string(LIBOCC_DATA) + "/scenes/" + name + ".yaml");
}

/// A camera that looks up and drives along x.
Rigid3 upright(double x, double y = 2, double heading = 0) {
  const Rigid3 camera = look_at({0, 0, 0.4}, {0, 0, 1}, {0, 1, 0});
  return camera * body_from_world({x, y, heading});
}

struct World {
  explicit World(const Scene& scene) : renderer(scene) {}

  const Image& image(const Rigid3& pose, double time_s, const Vector6& velocity = Vector6::Zero()) {
    SimulateOptions options;
    options.seed = 1;
    options.frame = frame++;
    options.noise_area = NoiseArea::around_lamps;
    options.start_s = time_s;
    options.velocity = velocity;
    renderer.render(pose, options, rendered);
    return rendered.image;
  }

  Renderer renderer;
  Rendered rendered;
  std::uint32_t frame = 0;
};

double error_m(const TrackedFrame& frame, const Rigid3& truth) {
  return (frame.position_m - truth.origin_in_source()).norm();
}

double nees(const TrackedFrame& frame, const Rigid3& truth) {
  const Vector6 off = difference(truth, frame.cam_from_world);
  return test::nees(off, frame.covariance);
}

TEST(Tracker, FollowsACameraThroughLampsThatComeAndGo) {
  const Scene scene = scene_named("irregular_six");
  World world(scene);
  Tracker tracker(scene);
  double sum = 0;
  int count = 0;
  std::size_t least = 6, most = 0;
  for (int i = 0; i < 90; ++i) {
    const Rigid3 pose = upright(0.8 + 0.025 * i);
    const TrackedFrame frame =
        tracker.add_image(world.image(pose, i * frame_s).view(), i * frame_s);
    ASSERT_EQ(frame.state, TrackerState::tracking) << i << ' ' << frame.reason;
    EXPECT_EQ(frame.full_search, i == 0) << i << ' ' << frame.reason;
    EXPECT_EQ(frame.reason, "");
    EXPECT_LT(error_m(frame, pose), 0.02) << i;
    EXPECT_TRUE(frame.missing.empty());
    least = std::min(least, frame.lamps.size());
    most = std::max(most, frame.lamps.size());
    if (i < 30) continue;
    sum += nees(frame, pose);
    ++count;
  }
  EXPECT_LT(least, most);           // some came or went
  EXPECT_LT(sum / count, 1.5 * 6);  // the motion is smoother than the filter allows for
}

TEST(Tracker, OneLampHoldsAPoseThatIsKnown) {
  Scene scene = scene_named("kookmin_four_lamps");
  World world(scene);
  Scene dark = scene;
  dark.lamps.resize(1);
  World one(dark);
  TrackerOptions options;
  options.floor.emplace();
  options.locate.prior.emplace();
  options.locate.prior->heading_rad = heading_rad(upright(0));
  Tracker tracker(scene, options, upright(0, 0));
  const auto drive = [&](World& from, int begin, int end) {
    TrackedFrame frame;
    for (int i = begin; i < end; ++i) {
      const Rigid3 pose = upright(1.5 + 0.01 * i);
      const Eigen::Matrix3d wheels = Eigen::Vector3d(1e-8, 1e-8, 1e-8).asDiagonal();
      if (i > 0) tracker.add(PlanarOdometry{(i - 1) * frame_s, i * frame_s, {0.01, 0, 0}, wheels});
      frame = tracker.add_image(from.image(pose, i * frame_s).view(), i * frame_s);
      EXPECT_EQ(frame.state, TrackerState::tracking) << i << ' ' << frame.reason;
      EXPECT_LT(error_m(frame, pose), 0.01) << i;
    }
    return frame;
  };
  EXPECT_EQ(drive(world, 0, 30).lamps.size(), 4u);
  const TrackedFrame last = drive(one, 30, 60);
  EXPECT_EQ(last.lamps.size(), 1u);
  EXPECT_EQ(last.missing.size(), 3u);
}

/// Maximum error and mean NEES of a camera that drives and rotates under a rolling shutter.
struct RollingDrive {
  double worst_m = 0, mean_nees = 0;
};

RollingDrive drive_under_rolling_shutter(bool wheels) {
  Scene scene = scene_named("irregular_six");
  scene.sensor.row_time_s = 5e-5;  // 24 ms for the image
  World world(scene);
  TrackerOptions options;
  options.locate.detect.stripes = false;
  if (wheels) options.floor.emplace();
  Tracker tracker(scene, options, upright(0, 0));
  RollingDrive out;
  int count = 0;
  for (int i = 0; i < 60; ++i) {
    const double t = i * frame_s;
    const auto pose = [](double s) { return upright(1.2 + 0.8 * s, 2, 0.5 * s); };
    const Vector6 velocity = velocity_between(pose(t), pose(t + 1e-3), 1e-3);
    if (wheels && i > 0) {
      const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-8, 1e-8, 1e-8).asDiagonal();
      const auto on_floor = [](double s) { return PlanarPose{1.2 + 0.8 * s, 2, 0.5 * s}; };
      tracker.add(PlanarOdometry{t, t + frame_s, on_floor(t).inverse() * on_floor(t + frame_s),
                                 covariance});
    }
    const TrackedFrame frame = tracker.add_image(world.image(pose(t), t, velocity).view(), t);
    EXPECT_EQ(frame.state, TrackerState::tracking) << i << ' ' << frame.reason;
    if (i <= 15) continue;
    out.worst_m = std::max(out.worst_m, error_m(frame, pose(t)));
    out.mean_nees += nees(frame, pose(t));
    ++count;
  }
  out.mean_nees /= count;
  return out;
}

TEST(Tracker, RollingShuttersRowsAreTakenAtTheirTimes) {
  // 12 ms to the middle row at 0.8 m/s are 10 mm.
  EXPECT_LT(drive_under_rolling_shutter(true).worst_m, 0.002);
  const RollingDrive by_images = drive_under_rolling_shutter(false);
  EXPECT_LT(by_images.worst_m, 0.02);
  EXPECT_LT(by_images.mean_nees, 12);
}

TEST(Tracker, WithoutLampsItCoastsThenIsLostAndFindsItselfAgain) {
  const Scene scene = scene_named("irregular_six");
  World world(scene);
  const Scene dark = [&] {
    Scene s = scene;
    for (Lamp& lamp : s.lamps) lamp.power_w = 1e-9;
    return s;
  }();
  World night(dark);
  Tracker tracker(scene);
  int i = 0;
  const auto next = [&](World& from) {
    const double t = i++ * frame_s;
    return tracker.add_image(from.image(upright(1 + 0.2 * t), t).view(), t);
  };
  while (i < 30) next(world);
  const TrackedFrame coasting = next(night);
  EXPECT_EQ(coasting.state, TrackerState::coasting);
  EXPECT_EQ(coasting.reason, "nothing in the image stands out from the background");
  EXPECT_LT(error_m(coasting, upright(1 + 0.2)), 0.01);
  TrackedFrame frame;
  while (i < 75) frame = next(night);
  EXPECT_EQ(frame.state, TrackerState::lost);
  EXPECT_TRUE(std::isinf(frame.position_covariance_m2(0, 0)));
  EXPECT_FALSE(tracker.predict(i * frame_s));
  while (i < 80) frame = next(world);
  EXPECT_EQ(frame.state, TrackerState::tracking);
  EXPECT_LT(error_m(frame, upright(1 + 0.2 * (i - 1) * frame_s)), 0.01);
}

TEST(Tracker, AKidnappedCameraIsFoundAgainAndTheJumpIsSaid) {
  const Scene scene = scene_named("irregular_six");
  World world(scene);
  Tracker tracker(scene);
  int jumps = 0;
  for (int i = 0; i < 60; ++i) {
    const Rigid3 pose = i < 30 ? upright(1.0, 1.5) : upright(2.5, 2.5, 1.0);
    const TrackedFrame frame =
        tracker.add_image(world.image(pose, i * frame_s).view(), i * frame_s);
    jumps += frame.relocated;
    if (frame.state == TrackerState::tracking) {
      EXPECT_LT(error_m(frame, pose), 0.02) << i;
      EXPECT_EQ(frame.relocated, i == 32) << i;
    } else {
      EXPECT_TRUE(i == 30 || i == 31) << i << ' ' << frame.reason;
      EXPECT_NE(frame.reason.find("images that must agree"), std::string::npos) << frame.reason;
    }
  }
  EXPECT_EQ(jumps, 1);
}

TEST(Tracker, ASquareOfEqualLampsNeedsAPrior) {
  const Scene scene = scene_named("kookmin_four_lamps");
  World world(scene);
  Tracker blind(scene);
  const Image& image = world.image(upright(1.7), 0);
  const TrackedFrame frame = blind.add_image(image.view(), 0);
  EXPECT_EQ(frame.state, TrackerState::searching);
  EXPECT_NE(frame.reason.find("4 poses match"), std::string::npos) << frame.reason;
  EXPECT_TRUE(std::isinf(frame.covariance(0, 0)));
}

TEST(Tracker, ClocksThatRepeatOrGoBackAreSaid) {
  const Scene scene = scene_named("irregular_six");
  World world(scene);
  Tracker tracker(scene);
  const auto at = [&](double t) {
    return tracker.add_image(world.image(upright(1.5), t).view(), t);
  };
  for (int i = 0; i < 10; ++i) at(100 + i * frame_s);
  const TrackedFrame repeated = at(100 + 9 * frame_s);
  EXPECT_NE(repeated.reason.find("a repeated image"), std::string::npos) << repeated.reason;
  EXPECT_EQ(repeated.state, TrackerState::tracking);
  for (int i = 0; i < 4; ++i)
    EXPECT_NE(at(50 + i * frame_s).reason.find("the clock went back"), std::string::npos);
  const TrackedFrame anew = at(50 + 4 * frame_s);
  EXPECT_NE(anew.reason.find("set back by"), std::string::npos) << anew.reason;
  EXPECT_EQ(anew.state, TrackerState::tracking);
  EXPECT_EQ(at(50 + 5 * frame_s).reason, "");
  // A jump ahead: the prediction is too old to be used, then the camera is relocalised.
  TrackedFrame later;
  for (int i = 0; i < 5; ++i) later = at(1000 + i * frame_s);
  EXPECT_EQ(later.state, TrackerState::tracking);
  EXPECT_LT(error_m(later, upright(1.5)), 0.01);
}

TEST(Tracker, TwoCamerasOnOneBodyShareAPose) {
  const Scene scene = scene_named("irregular_six");
  World world(scene);
  const Rigid3 left = upright(0, 0), right = upright(0, -0.5);
  Tracker tracker(scene, {}, left);
  EXPECT_EQ(tracker.add_camera(scene, right), 1);
  const auto body = [](double t) { return body_from_world({1.5 + 0.3 * t, 2, 0}); };
  for (int i = 0; i < 20; ++i) {
    const double t = i * frame_s, later = t + 0.01;
    const TrackedFrame a = tracker.add_image(world.image(left * body(t), t).view(), t);
    const TrackedFrame b =
        tracker.add_image(world.image(right * body(later), later).view(), later, {1, {}});
    EXPECT_EQ(a.state, TrackerState::tracking) << a.reason;
    EXPECT_EQ(b.state, TrackerState::tracking) << b.reason;
    EXPECT_EQ(b.camera, 1);
    EXPECT_LT(error_m(a, left * body(t)), 0.02);
    EXPECT_LT(error_m(b, right * body(later)), 0.02);
  }
}

/// Near the image plane the window of a lamp exceeds the range of int. At these depths, only one of
/// its ends does.
TEST(Tracker, ALampBesideTheCameraIsNotSearchedOutsideTheImage) {
  Scene scene;
  scene.camera = test::vga_camera();
  for (int i = 0; i < 3; ++i)
    scene.lamps.push_back(test::disc_lamp(i, {0.3 * i - 0.3, 0.2 * i * i, 3}, 0.05));
  scene.lamps.push_back(test::disc_lamp(9, {2, 0, 0}, 0.1));
  scene.lamps.back().normal = {-1, 0, 0};
  scene.lamps.back().x_axis = {0, 0, 1};
  Image dark;
  dark.width = scene.camera.width();
  dark.height = scene.camera.height();
  dark.u8.assign(static_cast<std::size_t>(dark.width) * static_cast<std::size_t>(dark.height), 2);
  for (double depth_m = 3.2e-4; depth_m < 3.6e-4; depth_m *= 1.0001) {
    Tracker tracker(scene);
    Rigid3 pose;
    pose.translation.z() = depth_m;
    tracker.start(0, pose, 1e-8 * Matrix6::Identity());
    EXPECT_NO_THROW(tracker.add_image(dark.view(), 0.001)) << depth_m;
  }
}

TEST(Tracker, RefusesImagesOfAnotherSizeAndOdometryOfTheOtherKind) {
  const Scene scene = scene_named("irregular_six");
  Tracker tracker(scene);
  Image small;
  small.width = small.height = 8;
  small.u8.resize(64);
  const std::string text = test::complaint([&] { tracker.add_image(small.view(), 0); });
  EXPECT_NE(text.find("8 x 8"), std::string::npos) << text;
  EXPECT_THROW(tracker.add_image(small.view(), 0, {3, {}}), std::invalid_argument);
  EXPECT_THROW(tracker.add(PlanarOdometry{0, 1, {}, {}}), std::logic_error);
  TrackerOptions wrong;
  wrong.confirmations = 0;
  EXPECT_THROW(Tracker(scene, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace occ
