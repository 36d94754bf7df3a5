// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/explain.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/support.hpp"

namespace {

using namespace occ;

Rigid3 room_pose() { return look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0}); }

const ExplainedEffect& of(const Explanation& explanation, Effect effect) {
  return explanation.effects[static_cast<std::size_t>(effect)];
}

/// Position of the camera that sees the lamps' centres at these pixels, by Gauss-Newton steps.
Eigen::Vector3d solved_position(const Scene& scene, const Rigid3& start,
                                const std::vector<Eigen::Vector2d>& px) {
  Rigid3 pose = start;
  for (int i = 0; i < 20; ++i) {
    const auto residual = [&](const Eigen::VectorXd& by) -> Eigen::VectorXd {
      const Rigid3 moved = perturb(pose, Vector6(by));
      Eigen::VectorXd r(2 * static_cast<Eigen::Index>(px.size()));
      for (std::size_t k = 0; k < px.size(); ++k)
        r.segment<2>(2 * static_cast<Eigen::Index>(k)) =
            scene.camera.project(moved * scene.lamps[k].centre_m).value() - px[k];
      return r;
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6);
    const Eigen::MatrixXd jacobian = test::numerical_jacobian(residual, zero, 1e-6);
    const Eigen::VectorXd step = jacobian.colPivHouseholderQr().solve(-residual(zero));
    pose = perturb(pose, Vector6(step));
  }
  return pose.origin_in_source();
}

TEST(Explain, ContainsThePlanOfTheImage) {
  const Scene scene = test::irregular_room();
  const RenderPlan plan = plan_render(scene, room_pose());
  const Explanation explanation = explain(scene, room_pose(), {}, 0);
  EXPECT_EQ(explanation.render_s, 0);
  for (std::size_t i = 0; i < effect_count; ++i) {
    EXPECT_EQ(explanation.effects[i].effect, plan.effects[i].effect);
    EXPECT_EQ(explanation.effects[i].applied, plan.effects[i].applied);
    EXPECT_EQ(explanation.effects[i].bound_px, plan.effects[i].bound_px);
    EXPECT_EQ(explanation.effects[i].cost_s, 0);
  }
}

// Centroids that move within their bound do not move the position beyond its bound, and some of
// these displacements move it by a large part of the bound.
TEST(Explain, PositionsStayWithinTheirBound) {
  const Scene scene = test::irregular_room();
  const ExplainedEffect effect = of(explain(scene, room_pose(), {}, 0), Effect::light_gradient);
  ASSERT_GT(effect.bound_px, 0);
  Random random(3);
  double farthest = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<Eigen::Vector2d> px;
    for (const Lamp& lamp : scene.lamps) {
      const double angle = random.uniform(0, 6.2831853);
      px.push_back(scene.camera.project(room_pose() * lamp.centre_m).value() +
                   effect.bound_px * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    const Eigen::Vector3d solved = solved_position(scene, room_pose(), px);
    farthest = std::max(farthest, (solved - room_pose().origin_in_source()).norm());
  }
  EXPECT_LT(farthest, 1.02 * effect.position_bound_m);
  EXPECT_GT(farthest, 0.3 * effect.position_bound_m);
}

TEST(Explain, LampsThatDetermineNoPoseBoundNothing) {
  Scene scene = test::irregular_room();
  scene.lamps.resize(2);
  const Explanation explanation = explain(scene, room_pose(), {}, 0);
  EXPECT_TRUE(std::isinf(of(explanation, Effect::light_gradient).position_bound_m));
  EXPECT_EQ(of(explanation, Effect::walls).position_bound_m, 0);
}

TEST(Explain, MeasuresTheTimeOfEffects) {
  Scene scene = test::irregular_room();
  scene.room = Room{{4, 4, 3.5}, 0.5};
  scene.sensor.full_well_e = 1e6;
  scene.sensor.blooming = 0.5;
  scene.effects.set(Effect::walls, Use::off);
  scene.effects.set(Effect::interreflection, Use::off);
  const Explanation explanation = explain(scene, room_pose(), {}, 3);
  EXPECT_GT(explanation.render_s, 0);
  EXPECT_NE(of(explanation, Effect::noise).cost_s, 0);
  EXPECT_FALSE(of(explanation, Effect::walls).applied);
  EXPECT_NE(of(explanation, Effect::walls).cost_s, 0);  // left out, but measured
  EXPECT_EQ(of(explanation, Effect::mosaic).cost_s, 0);
  EXPECT_THROW(explain(scene, room_pose(), {}, -1), std::invalid_argument);
}

}  // namespace
