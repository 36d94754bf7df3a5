// SPDX-License-Identifier: Apache-2.0
// Risk of a fix: false lights alone, regular grids with dark lamps and false lights, wrong priors.
// Whatever is ok must be right.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "libocc/core/random.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/support/simulate_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

constexpr double ceiling_m = 3;

struct Room {
  Scene scene;
  double width_m = 6;
};

/// Lamps on a grid, `jitter_m` off their places.
Room room_of(const Camera& camera, int side, double width_m, double jitter_m, Random& random) {
  Room room{{}, width_m};
  room.scene.camera = camera;
  for (int i = 0; i < side * side; ++i) {
    Lamp lamp = test::disc_lamp(
        i, {(i % side + 0.5) * width_m / side, (i / side + 0.5) * width_m / side, ceiling_m}, 0.05);
    lamp.centre_m.head<2>() += jitter_m * Eigen::Vector2d(random.normal(), random.normal());
    room.scene.lamps.push_back(lamp);
  }
  return room;
}

Blob spot(const Eigen::Vector2d& px, double sigma_px) {
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = 1000;
  blob.area_px = 20;
  return blob;
}

Blob false_light(const Camera& camera, double sigma_px, Random& random) {
  return spot({random.uniform(0, camera.width() - 1), random.uniform(0, camera.height() - 1)},
              sigma_px);
}

Rigid3 pose_in(const Room& room, Random& random) {
  const Eigen::Vector3d position(random.uniform(0.2, 0.8) * room.width_m,
                                 random.uniform(0.2, 0.8) * room.width_m, random.uniform(0.3, 1.2));
  const Eigen::Matrix3d rotation = so3_exp({0, 0, random.uniform(0, 6.28)}) *
                                   so3_exp({random.uniform(0, 0.4), 0, 0}) *
                                   so3_exp({0, 0, random.uniform(0, 6.28)});
  return {rotation, -rotation * position};
}

/// Blobs of the lamps in view that are not dark, and of false lights.
std::vector<Blob> view_of(const Room& room, const Rigid3& pose, double dark, int false_lights,
                          double sigma_px, Random& random) {
  std::vector<Blob> blobs;
  const Camera& camera = room.scene.camera;
  for (const Lamp& lamp : room.scene.lamps) {
    const auto px = project_lamp_centre(lamp, pose, camera);
    const bool lit = random.uniform() >= dark;
    const Eigen::Vector2d noise(random.normal(), random.normal());
    if (lit && px && camera.contains(*px)) blobs.push_back(spot(*px + sigma_px * noise, sigma_px));
  }
  for (int i = 0; i < false_lights; ++i) blobs.push_back(false_light(camera, sigma_px, random));
  return blobs;
}

struct Tally {
  int ok = 0, wrong = 0, lost = 0;  ///< lost: ambiguous without the right pose
};

void count(const Result<Fix>& fix, const Rigid3& truth, Tally& tally) {
  constexpr double right_m = 0.1;
  const auto is_right = [&](const Candidate& candidate) {
    return (candidate.position_m - truth.origin_in_source()).norm() < right_m;
  };
  tally.ok += fix.ok();
  tally.wrong += fix.ok() && !is_right(fix->candidates.front());
  tally.lost += fix.status == Status::ambiguous &&
                std::none_of(fix->candidates.begin(), fix->candidates.end(), is_right);
}

/// Images without any lamp; with no prior, gravity, or the camera's height.
int false_fixes(int images, std::uint64_t seed) {
  int ok = 0;
  for (int i = 0; i < images; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const Camera camera = Camera::pinhole(1280, 960, 900, 900, 639.5, 479.5);
    const Room room = room_of(camera, 2 + i % 3, 6, 0.2, random);
    const double sigma_px = std::pow(10, random.uniform(-1.7, -0.3));
    std::vector<Blob> blobs;
    for (int k = 0; k < 4 + i % 7; ++k) blobs.push_back(false_light(camera, sigma_px, random));
    LocateOptions options;
    options.prior = Prior{};
    if (i % 5 == 1) options.prior->gravity_in_cam = -Eigen::Vector3d::UnitZ();
    if (i % 5 == 2) options.prior->height_m = 1;
    ok += locate(blobs, room.scene, options).ok();
  }
  return ok;
}

/// Regular grids seen by a wide camera that has gravity, and every other time a heading.
Tally grids(int images, std::uint64_t seed) {
  Tally tally;
  for (int i = 0; i < images; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const Camera camera = Camera::pinhole(1280, 960, 450, 450, 639.5, 479.5);
    const Room room = room_of(camera, 4 + i % 3, random.uniform(5, 9), 0, random);
    const Rigid3 truth = pose_in(room, random);
    const double dark[] = {0, 0.1, 0.25};
    const std::vector<Blob> blobs = view_of(room, truth, dark[i % 3], 4 * (i % 4),
                                            std::pow(10, random.uniform(-1.5, -0.3)), random);
    LocateOptions options;
    options.prior = Prior{};
    options.prior->gravity_in_cam = -truth.rotation.col(2);
    options.prior->gravity_sigma_rad = 0.01;
    if (i % 2 == 0) {
      options.prior->heading_rad = heading_rad(truth);
      options.prior->heading_sigma_rad = 0.2;
    }
    count(locate(blobs, room.scene, options), truth, tally);
  }
  return tally;
}

/// Irregular rooms with a position that is `sigmas` of its standard deviation off.
Tally wrong_positions(int images, double sigmas, std::uint64_t seed) {
  Tally tally;
  for (int i = 0; i < images; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const Camera camera = Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5);
    const Room room = room_of(camera, 3 + i % 3, 6, 0.1, random);
    const Rigid3 truth = pose_in(room, random);
    const std::vector<Blob> blobs = view_of(room, truth, 0.1, i % 5, 0.1, random);
    LocateOptions options;
    options.prior = Prior{};
    options.prior->position_sigma_m = 0.3;
    const Eigen::Vector3d along =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    options.prior->position_m = truth.origin_in_source() + sigmas * 0.3 * along;
    count(locate(blobs, room.scene, options), truth, tally);
  }
  return tally;
}

TEST(Risk, FalseLightsAloneAreNeverOk) { EXPECT_EQ(false_fixes(150, 1), 0); }

TEST(SlowRisk, FalseLightsAloneAreNeverOk) { EXPECT_EQ(false_fixes(5000, 2), 0); }

TEST(Risk, AGridIsNeverTakenForItselfAfterAShift) {
  const Tally tally = grids(120, 3);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_LE(tally.lost, 2);
  EXPECT_GT(tally.ok, 5);
}

TEST(SlowRisk, AGridIsNeverTakenForItselfAfterAShift) {
  const Tally tally = grids(2000, 4);
  EXPECT_LE(tally.wrong, 1);  // in one view most of the lamps in view are dark
  EXPECT_LE(tally.lost, 20);
  EXPECT_GT(tally.ok, 100);
}

TEST(Risk, AWrongPriorIsNotBelieved) {
  for (const double sigmas : {0, 2, 4, 6}) {
    const Tally tally = wrong_positions(15, sigmas, 5);
    EXPECT_EQ(tally.wrong, 0) << sigmas;
    EXPECT_GT(tally.ok, sigmas < 3 ? 7 : -1) << sigmas;
  }
}

TEST(SlowRisk, AWrongPriorIsNotBelieved) {
  for (const double sigmas : {0, 2, 4, 6})
    EXPECT_EQ(wrong_positions(500, sigmas, 6).wrong, 0) << sigmas;
}

/// The blobs of all lamps, and those of a few lamps as seen from another pose, which the prior
/// states. Returns the number of rooms with enough lamps in view.
int views_with_a_wrong_prior(std::uint64_t rooms) {
  constexpr int lamps_from_elsewhere = 7;
  int views = 0;
  for (std::uint64_t seed = 0; seed < rooms; ++seed) {
    Random random(12, seed);
    const Camera camera = Camera::pinhole(1280, 960, 300, 300, 639.5, 479.5);
    const Room room = room_of(camera, 5, 6, 0.3, random);
    const Rigid3 truth = pose_in(room, random);
    const Rigid3 elsewhere{truth.rotation * so3_exp({0, 0, 1.4}), {}};
    const Rigid3 decoy{elsewhere.rotation, -elsewhere.rotation * Eigen::Vector3d(3, 3, 0.7)};
    std::vector<Blob> blobs = view_of(room, truth, 0, 0, 0.1, random);
    std::vector<Blob> others = view_of(room, decoy, 0, 0, 0.1, random);
    if (std::min(blobs.size(), others.size()) < 2 * lamps_from_elsewhere) continue;
    ++views;
    blobs.insert(blobs.end(), others.begin(), others.begin() + lamps_from_elsewhere);
    LocateOptions options;
    options.prior = Prior{};
    options.prior->gravity_in_cam = -truth.rotation.col(2);
    options.prior->gravity_sigma_rad = 0.01;
    options.prior->heading_rad = heading_rad(decoy);
    options.prior->heading_sigma_rad = 0.2;
    const Result<Fix> fix = locate(blobs, room.scene, options);
    Tally tally;
    count(fix, truth, tally);
    EXPECT_EQ(tally.wrong + tally.lost, 0) << seed << ": " << fix.message;
    EXPECT_NE(fix.message.find("check the prior"), std::string::npos)
        << seed << ": " << to_string(fix.status) << " " << fix.message;
  }
  return views;
}

TEST(Risk, APriorIsNotBelievedAgainstMostOfTheImage) {
  EXPECT_GT(views_with_a_wrong_prior(30), 10);
}

TEST(SlowRisk, APriorIsNotBelievedAgainstMostOfTheImage) {
  EXPECT_GT(views_with_a_wrong_prior(300), 100);
}

TEST(Risk, ProbabilitiesAndRiskAreOne) {
  Random random(7);
  const Room room =
      room_of(Camera::pinhole(1280, 960, 450, 450, 639.5, 479.5), 4, 6, 0, random);  // symmetric
  const Rigid3 truth = pose_in(room, random);
  const std::vector<Blob> blobs = view_of(room, truth, 0, 0, 0.1, random);
  const Result<Fix> fix = locate(blobs, room.scene);
  ASSERT_EQ(fix.status, Status::ambiguous);
  ASSERT_GE(fix->candidates.size(), 4u);
  double sum = 0;
  for (const Candidate& candidate : fix->candidates) sum += *candidate.probability;
  EXPECT_NEAR(sum, 1, 1e-6);
  EXPECT_NEAR(*fix->risk, 1 - *fix->candidates.front().probability, 1e-6);
  EXPECT_GT(*fix->risk, 0.7);
}

TEST(Risk, MaxRiskIsTheLimitOfOk) {
  Random random(8);
  const Room room = room_of(Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5), 3, 6, 0.1, random);
  Rigid3 truth = pose_in(room, random);
  std::vector<Blob> blobs = view_of(room, truth, 0, 0, 0.1, random);
  while (blobs.size() < 5) {
    truth = pose_in(room, random);
    blobs = view_of(room, truth, 0, 0, 0.1, random);
  }
  LocateOptions options;
  const Result<Fix> fix = locate(blobs, room.scene, options);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(*fix->risk, 1e-4);
  options.max_risk = *fix->risk / 2;
  EXPECT_EQ(locate(blobs, room.scene, options).status, Status::ambiguous);
  for (const double wrong : {0.0, -1.0, 1.5, std::nan("")}) {
    options.max_risk = wrong;
    EXPECT_THROW(locate(blobs, room.scene, options), std::invalid_argument) << wrong;
  }
}

TEST(Risk, WhereNoPoseIsMoreProbableThereIsNone) {
  // Bright discs that fit no pose, and specks of which some fit one by chance.
  int none = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Random random(100 + seed);
    const Camera camera = Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5);
    const Room room = room_of(camera, 3, 6, 0.3, random);
    std::vector<Blob> blobs;
    for (int i = 0; i < 10; ++i) blobs.push_back(false_light(camera, 0.3, random));
    for (int i = 0; i < 6; ++i) {
      Blob bright = false_light(camera, 0.3, random);
      bright.flux_dn = 1e6;
      bright.flux_sigma_dn = 1e3;
      blobs.push_back(bright);
    }
    const Result<Fix> fix = locate(blobs, room.scene);
    EXPECT_FALSE(fix.ok());
    if (fix.status != Status::no_pose || fix->candidates.empty()) continue;
    ++none;
    EXPECT_GT(*fix->risk, 0.5);
    EXPECT_NE(fix.message.find("accidental"), std::string::npos) << fix.message;
  }
  EXPECT_GT(none, 3);
}

LocateOptions with_last_pose(const Rigid3& pose, double sigma_rad, double sigma_m) {
  Vector6 sigmas;
  sigmas << Eigen::Vector3d::Constant(sigma_rad), Eigen::Vector3d::Constant(sigma_m);
  LocateOptions options;
  options.prior = Prior{};
  options.prior->last_pose = PriorPose{pose, sigmas.cwiseAbs2().asDiagonal().toDenseMatrix()};
  return options;
}

TEST(Risk, ARightLastPoseAddsNoDoubt) {
  const Scene scene = test::irregular_room();
  Random random(12);
  for (int i = 0; i < 5; ++i) {
    const Rigid3 truth = test::random_room_pose(random, 0.1);
    const std::vector<Blob> blobs = detect(simulate(scene, truth).image.view(), {});
    if (blobs.size() < 5) continue;
    for (const double sigma : {0.02, 0.2, 0.5}) {
      const Result<Fix> fix = locate(blobs, scene, with_last_pose(truth, sigma, sigma));
      EXPECT_TRUE(fix.ok()) << fix.message;
      EXPECT_LT(*fix->risk, 1e-9) << i << " " << sigma;
    }
  }
}

TEST(Risk, ALastPoseSelectsOnePoseOfASquare) {
  Scene scene = test::irregular_room();
  scene.lamps.resize(4);
  for (int i = 0; i < 4; ++i)
    scene.lamps[i].centre_m = {i % 2 ? 3.0 : 1.0, i / 2 ? 3.0 : 1.0, ceiling_m};
  const Eigen::Vector3d position(2.05, 1.9, 0.3);
  const auto turned = [&](double angle_rad) {
    const Eigen::Matrix3d rotation = so3_exp({0, 0, angle_rad});
    return Rigid3{rotation, -rotation * position};
  };
  const std::vector<Blob> blobs = detect(simulate(scene, turned(0.3)).image.view(), {});
  ASSERT_EQ(blobs.size(), 4u);
  EXPECT_EQ(locate(blobs, scene).status, Status::ambiguous);
  for (const double off_rad : {0.0, 0.2, -0.3}) {
    const Result<Fix> fix = locate(blobs, scene, with_last_pose(turned(0.3 + off_rad), 0.2, 0.3));
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_LT((fix->position_m - position).norm(), 0.01);
    EXPECT_GE(*fix->risk, 2.9e-5);  // the last pose may be that of one of the three others
  }
  // Half of a quarter turn off, the last pose selects none of two.
  for (const double off_rad : {-0.87, -pi / 4, -0.75, 0.75, pi / 4, 0.87}) {
    const Result<Fix> fix = locate(blobs, scene, with_last_pose(turned(0.3 + off_rad), 0.2, 0.3));
    EXPECT_EQ(fix.status, Status::ambiguous) << off_rad;
    EXPECT_TRUE(std::any_of(fix->candidates.begin(), fix->candidates.end(), [&](const auto& c) {
      return (c.position_m - position).norm() < 0.01 && *c.probability > 1e-3;
    })) << off_rad;
  }
}

TEST(Risk, RimsThatAllGrewAreNoAccident) {
  const Scene scene = test::irregular_room();
  Random random(11);
  const Rigid3 truth = test::random_room_pose(random, 0.1);
  std::vector<Blob> blobs = detect(simulate(scene, truth).image.view(), {});
  ASSERT_GE(blobs.size(), 5u);
  for (Blob& blob : blobs) {  // bloom beyond what the PSF explains
    const double growth_px = random.uniform(5, 7);
    const Eigen::Vector2d off(0.4 * random.normal(), 0.4 * random.normal());
    for (RimPoint& point : blob.rim) point.px += growth_px * point.normal + off;
    blob.ellipse.semi_major_px += growth_px;
    blob.ellipse.semi_minor_px += growth_px;
    blob.centroid_px += off;
    blob.saturated = true;
  }
  const Result<Fix> fix = locate(blobs, scene);
  EXPECT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(*fix->risk, 1e-6);
}

TEST(Risk, WithoutBlobsItIsOne) {
  Random random(9);
  const Room room = room_of(Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5), 3, 6, 0.1, random);
  EXPECT_EQ(locate(std::vector<Blob>{}, room.scene)->risk, 1.0);
}

}  // namespace
}  // namespace occ
