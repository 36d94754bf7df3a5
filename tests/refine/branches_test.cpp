// SPDX-License-Identifier: Apache-2.0
// Three lamps near their danger cylinder, where two poses that fit their centres meet: the
// refinement must converge, also if noise leaves no pose that fits, and its covariance must contain
// the true pose.
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/refine/internal/pose_roots.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

constexpr double spot_sigma_px = 0.03;

struct View {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
  std::vector<Match> matches;
};

/// Spots under a level ceiling, seen from a point on the cylinder through their circle, or from
/// `inside_m` within it.
View view_of(double inside_m, std::uint64_t seed) {
  Random random(3, seed);
  View view;
  view.scene.camera = test::vga_camera();
  constexpr double radius_m = 0.8;
  const double first = random.uniform(-3, 3);
  for (int i = 0; i < 3; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.shape = LampShape::disc;
    lamp.radius_m = 0.003;
    lamp.normal = -Eigen::Vector3d::UnitZ();
    const double angle = first + (1.3 + 0.3 * random.uniform()) * i;
    lamp.centre_m = {radius_m * std::cos(angle), radius_m * std::sin(angle), 2.5};
    view.scene.lamps.push_back(lamp);
  }
  const double middle = first + 1.4 + random.uniform(-0.6, 0.6), out_m = radius_m - inside_m;
  const Eigen::Vector3d position(out_m * std::cos(middle), out_m * std::sin(middle), 0);
  const Eigen::Matrix3d rotation =
      so3_exp({random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0});
  view.truth = {rotation, -rotation * position};
  test::Measurement measurement;
  measurement.centroid_sigma_px = spot_sigma_px;
  view.blobs = test::noisy(test::exact_blobs(view.scene, view.truth, measurement), view.scene,
                           measurement, random);
  view.matches = test::in_order(view.scene);
  return view;
}

RefineOptions by_centres() {
  RefineOptions options;
  options.rung = Rung::centres;
  options.max_iterations = 200;  // as locate() for poses that are plausible
  return options;
}

TEST(RefineBranches, ConvergesOnTheDangerCylinder) {
  constexpr int views = 200;
  int failed = 0, outside = 0;
  for (std::uint64_t seed = 0; seed < views; ++seed) {
    const View view = view_of(0, seed);
    const Result<Refined> refined =
        refine(view.truth, view.matches, view.blobs, view.scene, by_centres());
    failed += !refined.ok();
    if (!refined.ok()) continue;
    EXPECT_LT(refined->chi2, 40) << seed;  // what the truth has at most
    const Vector6 off = difference(view.truth, refined->cam_from_world);
    outside += test::nees(off, refined->covariance) > 25;  // 0.03 % of chi2 with 6 dof
  }
  EXPECT_LE(failed, views / 4);  // chi2 is flat to second order
  EXPECT_LE(outside, 1);
}

TEST(RefineBranches, FindsEveryPoseThatFits) {
  int found = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const View view = view_of(0.15, seed);
    Eigen::Matrix3d bearings, points;
    for (int i = 0; i < 3; ++i) {
      bearings.col(i) = view.scene.camera.unproject(view.blobs[i].centroid_px).value();
      points.col(i) = view.scene.lamps[i].centre_m;
    }
    const Result<Refined> refined =
        refine(view.truth, view.matches, view.blobs, view.scene, by_centres());
    ASSERT_TRUE(refined.ok()) << seed;
    const std::vector<Rigid3> roots =
        internal::refine::other_roots(*refined, view.blobs, view.scene);
    for (const Rigid3& pose : p3p(bearings, points)) {
      const auto is_at = [&](const Rigid3& other) {
        return (pose.origin_in_source() - other.origin_in_source()).norm() < 1e-3;
      };
      EXPECT_TRUE(is_at(refined->cam_from_world) || std::any_of(roots.begin(), roots.end(), is_at))
          << seed;
    }
    found += static_cast<int>(roots.size());
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace occ
