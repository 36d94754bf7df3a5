// SPDX-License-Identifier: Apache-2.0
// Bounded time of locate(): the last pose is tried first, and the budget holds during the search.
// A fix is right, however short the search was.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <functional>

#include "libocc/core/random.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

struct View {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
};

Blob spot(const Eigen::Vector2d& px, double flux_dn) {
  constexpr double sigma_px = 0.1;
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = flux_dn;
  blob.area_px = 20;
  return blob;
}

Scene grid(int side, double pitch_m, double jitter_m, Random& random) {
  Scene scene;
  scene.camera = Camera::pinhole(1280, 960, 450, 450, 639.5, 479.5);
  for (int i = 0; i < side * side; ++i) {
    Lamp lamp = test::disc_lamp(i, {i % side * pitch_m, i / side * pitch_m, 3}, 0.05);
    lamp.centre_m.head<2>() += jitter_m * Eigen::Vector2d(random.normal(), random.normal());
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// A camera below the middle of the lamps, which looks up.
View view_of(Scene scene, double middle_m, int false_lights, Random& random) {
  const Eigen::Vector3d position(middle_m + random.uniform(-0.3, 0.3),
                                 middle_m + random.uniform(-0.3, 0.3), random.uniform(0.3, 1.2));
  const Eigen::Matrix3d rotation = so3_exp({0, 0, random.uniform(0, 6.28)}) *
                                   so3_exp({random.uniform(0, 0.2), 0, 0}) *
                                   so3_exp({0, 0, random.uniform(0, 6.28)});
  View view{std::move(scene), {rotation, -rotation * position}, {}};
  const Camera& camera = view.scene.camera;
  for (const Lamp& lamp : view.scene.lamps) {
    const auto px = project_lamp_centre(lamp, view.truth, camera);
    const Eigen::Vector2d noise(random.normal(), random.normal());
    if (px && px->minCoeff() > 12 && px->x() < camera.width() - 13 &&
        px->y() < camera.height() - 13)
      view.blobs.push_back(spot(*px + 0.1 * noise, random.uniform(1e3, 2e3)));
  }
  for (int i = 0; i < false_lights; ++i)
    view.blobs.push_back(
        spot({random.uniform(0, camera.width() - 1), random.uniform(0, camera.height() - 1)},
             random.uniform(1e3, 3e3)));
  return view;
}

LocateOptions with_last_pose(const Rigid3& pose, double sigma_rad, double sigma_m,
                             const Vector6& off) {
  Vector6 sigmas;
  sigmas << Eigen::Vector3d::Constant(sigma_rad), Eigen::Vector3d::Constant(sigma_m);
  LocateOptions options;
  options.prior = Prior{};
  options.prior->last_pose = PriorPose{perturb(pose, sigmas.cwiseProduct(off)),
                                       sigmas.cwiseAbs2().asDiagonal().toDenseMatrix()};
  return options;
}

Vector6 random_vector(Random& random) {
  Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = random.normal();
  return v;
}

bool is_right(const Rigid3& pose, const View& view) {
  return (pose.origin_in_source() - view.truth.origin_in_source()).norm() < 0.05;
}

/// Processor time: other processes delay the call, but do not add to it.
double seconds_of(const std::function<void()>& run) {
  const std::clock_t start = std::clock();
  run();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// A search of these views takes a second or more.
TEST(Bounded, TheLastPoseNamesManyLampsAtOnce) {
  for (const int side : {7, 9}) {
    Random random(static_cast<std::uint64_t>(side));
    for (int i = 0; i < 10; ++i) {
      const double middle_m = 0.4 * (side - 1);
      const View view = view_of(grid(side, 0.8, 0.1, random), middle_m, 3, random);
      const Result<Fix> fix = locate(view.blobs, view.scene,
                                     with_last_pose(view.truth, 0.01, 0.05, random_vector(random)));
      EXPECT_TRUE(fix.ok() && is_right(fix->cam_from_world, view)) << side << " " << fix.message;
      EXPECT_GE(fix->lamps.size(), 12u);
    }
  }
}

// The camera is one pitch away from the last pose of a regular grid. Nothing in the image says so.
TEST(Bounded, APlaceThatTheLastPoseExcludesIsACandidate) {
  Random random(3);
  for (int i = 0; i < 12; ++i) {
    const View view = view_of(grid(8, 0.8, 0, random), 2.8, 3, random);
    Rigid3 last = view.truth;
    last.translation -= last.rotation * Eigen::Vector3d(i % 2 ? 0.8 : -0.8, 0, 0);
    LocateOptions options = with_last_pose(last, 0.01, 0.05, random_vector(random));
    options.max_risk = 1e-6;
    const Result<Fix> fix = locate(view.blobs, view.scene, options);
    EXPECT_TRUE(!fix.ok() || is_right(fix->cam_from_world, view)) << i;
    const bool listed =
        std::any_of(fix->candidates.begin(), fix->candidates.end(),
                    [&](const Candidate& c) { return is_right(c.cam_from_world, view); });
    EXPECT_TRUE(listed) << i << " " << fix.message;
  }
}

TEST(Bounded, ALastPoseSixSigmaOffIsNotWrong) {
  Random random(4);
  for (int i = 0; i < 12; ++i) {
    const View view = view_of(grid(7, 0.8, i % 2 ? 0.1 : 0, random), 2.4, 3, random);
    const Vector6 off = 6 * random_vector(random).normalized();
    const Result<Fix> fix =
        locate(view.blobs, view.scene, with_last_pose(view.truth, 0.02, 0.1, off));
    EXPECT_TRUE(!fix.ok() || is_right(fix->cam_from_world, view)) << i;
  }
}

View hard_view(Random& random) {
  Scene scene = grid(3, 1.3, 0.25, random);
  scene.lamps.resize(6);
  return view_of(scene, 1.3, 50, random);
}

TEST(Bounded, TheBudgetHoldsDuringTheSearch) {
  constexpr int max_rounds = 3;
  Random random(5);
  int cut = 0;
  for (const double budget_s : {0.005, 0.01, 0.02, 0.05})
    for (int i = 0; i < 4; ++i) {
      const View view = hard_view(random);
      LocateOptions options;
      options.budget_s = budget_s;
      double fastest_s = 10;
      for (int round = 0; round < max_rounds && fastest_s > 1.2 * budget_s; ++round) {
        Result<Fix> fix;
        fastest_s =
            std::min(fastest_s, seconds_of([&] { fix = locate(view.blobs, view.scene, options); }));
        EXPECT_TRUE(!fix.ok() || is_right(fix->cam_from_world, view)) << i;
        EXPECT_TRUE(!fix->cut_short || fix.message.find("untried") != std::string::npos)
            << fix.message;
        cut += fix->cut_short;
      }
      EXPECT_LE(fastest_s, 1.2 * budget_s) << i;
    }
  EXPECT_GT(cut, 0);
}

TEST(Bounded, AWeakPoseOfASearchCutShortIsNotOk) {
  Random random(6);
  for (int i = 0; i < 10; ++i) {
    Scene scene = grid(3, 1.3, 0.25, random);
    scene.lamps.resize(5);
    const View view = view_of(scene, 1.3, 15, random);
    LocateOptions options;
    options.identify.max_hypotheses = 2000;
    const Result<Fix> fix = locate(view.blobs, view.scene, options);
    EXPECT_TRUE(!fix->cut_short || !fix.ok() || fix->lamps.size() >= 6);
    EXPECT_TRUE(!fix.ok() || is_right(fix->cam_from_world, view));
    EXPECT_EQ(fix->cut_short, fix.message.find("untried") != std::string::npos ||
                                  fix.message.find("max_hypotheses") != std::string::npos)
        << fix.message;
  }
}

}  // namespace
}  // namespace occ
