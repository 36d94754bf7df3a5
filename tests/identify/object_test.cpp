// SPDX-License-Identifier: Apache-2.0
// Poses of objects: covisibility of points, and assignments restricted to covisible points.
#include <gtest/gtest.h>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/covisibility.hpp"
#include "tests/support/random_objects.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::identify;
namespace {

using bodies::View;
using Eigen::Vector3d;

AssignmentProblem problem_of(const Object& object, const Camera& camera,
                             const IdentifyOptions& options) {
  static const std::vector<Blob> none;
  return make_problem(none, object, camera, options);
}

TEST(Covisibility, NeverDeniesAPositionThatSeesAll) {
  Random random(1);
  const Camera camera = test::vga_camera();
  const IdentifyOptions options;
  int denied = 0, granted = 0;
  for (int i = 0; i < 300; ++i) {
    Object object{"any", {}};
    for (int k = 0; k < 3; ++k) {
      ObjectPoint p;
      p.id = k;
      p.position_m = test::random_vector(random);
      p.normal = test::random_vector(random).normalized();
      p.cone_rad = random.uniform(0.2, 1.7);
      object.points.push_back(p);
    }
    const AssignmentProblem problem = problem_of(object, camera, options);
    const bool together = are_covisible(problem, {0, 1, 2});
    bool seen = false;
    for (int k = 0; k < 3000 && !seen; ++k) {
      const Vector3d eye =
          bodies::random_direction(random) * std::exp(random.uniform(-1, 4)) * problem.size_m;
      seen = object.points[0].seen_from(eye) && object.points[1].seen_from(eye) &&
             object.points[2].seen_from(eye);
    }
    EXPECT_TRUE(together || !seen) << i;
    denied += !together;
    granted += together && seen;
  }
  EXPECT_GT(denied, 80);
  EXPECT_GT(granted, 80);
}

// Two cones of half angle a, whose axes enclose the angle b and whose apexes face away from each
// other, intersect exactly if 2 a > b.
TEST(Covisibility, IsSharp) {
  const Camera camera = test::vga_camera();
  const IdentifyOptions options;
  for (const double between : {0.5, 1.0, 2.0, 3.0})
    for (const double half : {0.4, 0.7, 1.2, 1.55}) {
      Object object{"any", {}};
      for (const double side : {-0.5, 0.5}) {
        ObjectPoint p;
        p.id = side > 0;
        p.normal = {std::sin(side * between), std::cos(side * between), 0};
        p.position_m = p.normal + Vector3d(side, 0, 0);
        p.cone_rad = half;
        object.points.push_back(p);
      }
      object.points.push_back(object.points[0]);
      const AssignmentProblem problem = problem_of(object, camera, options);
      EXPECT_EQ(are_covisible(problem, {0, 1}), 2 * half > between) << between << ' ' << half;
    }
}

// Faces that face each other are both visible from between them.
TEST(Covisibility, IncludesPositionsBetweenThePoints) {
  const Camera camera = test::vga_camera();
  const IdentifyOptions options;
  for (const double facing : {-1.0, 1.0}) {
    Object object{"gate", {}};
    for (const double side : {-1.0, 1.0}) {
      ObjectPoint p;
      p.id = side > 0;
      p.position_m = {side, 0, 0};
      p.normal = {facing * side, 0, 0};
      object.points.push_back(p);
    }
    EXPECT_EQ(are_covisible(problem_of(object, camera, options), {0, 1}), facing < 0);
  }
}

TEST(IdentifyObject, FindsThePoseAmongFalseLights) {
  Random random(2);
  int right = 0, wrong = 0, trials = 0;
  while (trials < 100) {
    const Object object = bodies::random_object(random, 12);
    View view;
    const Rigid3 pose = bodies::random_pose(random, 2.5);
    bodies::add_object(view, 0, object, pose, random, 0.2);
    if (bodies::lights_of(view, 0) < 6) continue;
    ++trials;
    bodies::add_false_lights(view, 2, random, 0.2);
    bodies::shuffle(view, random);
    IdentifyOptions options;
    options.model_sigma_px = 0.1;
    const auto found = identify_object(view.blobs, object, bodies::camera(), options);
    if (!found.ok()) continue;
    const Hypothesis& h = found->hypotheses.front();
    const bool is_right = bodies::is_right(h, view, 0);
    right += is_right;
    wrong += !is_right;
    if (is_right) {
      EXPECT_LT(so3_log(h.cam_from_world.rotation * pose.rotation.transpose()).norm(), 0.03);
      EXPECT_LT((h.cam_from_world.translation - pose.translation).norm(), 0.1);
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(right, 95);
}

// Restricting assignments to covisible points reduces the work and does not change the result.
TEST(IdentifyObject, ConesSaveWorkAndChangeNoAnswer) {
  for (const int points : {6, 14}) {
    Random random(3);
    double with = 0, without = 0;
    int trials = 0;
    while (trials < 30) {
      const Object object = bodies::random_object(random, points, 1.2);
      View view;
      bodies::add_object(view, 0, object, bodies::random_pose(random, 2.5), random, 0.2);
      if (bodies::lights_of(view, 0) < (points > 6 ? 5 : 4)) continue;
      ++trials;
      IdentifyOptions options;
      options.model_sigma_px = 0.1;
      AssignmentProblem problem = make_problem(view.blobs, object, bodies::camera(), options);
      const auto found = solve_assignment(problem);
      problem.all_covisible = true;
      const auto all = solve_assignment(problem);
      with += found->tried;
      without += all->tried;
      ASSERT_EQ(found->hypotheses.size(), all->hypotheses.size());
      for (std::size_t i = 0; i < all->hypotheses.size(); ++i)
        EXPECT_TRUE((found->hypotheses[i].cam_from_world.matrix() -
                     all->hypotheses[i].cam_from_world.matrix())
                        .isZero(1e-6));
      EXPECT_TRUE(std::any_of(found->hypotheses.begin(), found->hypotheses.end(),
                              [&](const Hypothesis& h) { return bodies::is_right(h, view, 0); }));
    }
    EXPECT_LT(with, 0.75 * without) << points;
  }
}

TEST(IdentifyObject, AllMethodsFindTheSame) {
  Random random(4);
  int trials = 0;
  while (trials < 10) {
    const Object object = bodies::random_object(random, 10);
    View view;
    bodies::add_object(view, 0, object, bodies::random_pose(random, 2), random, 0.1);
    if (bodies::lights_of(view, 0) < 6) continue;
    ++trials;
    for (const IdentifyMethod method :
         {IdentifyMethod::alignment, IdentifyMethod::voting, IdentifyMethod::ransac}) {
      IdentifyOptions options;
      options.method = method;
      options.model_sigma_px = 0.1;
      const auto found = identify_object(view.blobs, object, bodies::camera(), options);
      ASSERT_FALSE(found->hypotheses.empty());
      EXPECT_TRUE(bodies::is_right(found->hypotheses[0], view, 0)) << static_cast<int>(method);
    }
  }
}

// A pose from behind a light is rejected.
TEST(IdentifyObject, KeepsToTheCones) {
  Random random(5);
  Object object = bodies::random_object(random, 8, 1.4);
  View view;
  while (bodies::lights_of(view, 0) < 5) {
    view = {};
    bodies::add_object(view, 0, object, bodies::random_pose(random, 2), random, 0.1);
  }
  for (ObjectPoint& p : object.points) p.normal = -p.normal;
  const auto found = identify_object(view.blobs, object, bodies::camera(), {});
  for (const Hypothesis& h : found->hypotheses) EXPECT_FALSE(bodies::is_right(h, view, 0));
}

TEST(IdentifyObject, ReportsBadInput) {
  Random random(6);
  Object object = bodies::random_object(random, 5);
  View view;
  bodies::add_false_lights(view, 6, random, 0.1);
  object.points.resize(2);
  const auto few = identify_object(view.blobs, object, bodies::camera(), {});
  EXPECT_EQ(few.status, Status::too_few_lamps);
  EXPECT_NE(few.message.find("the object has 2"), std::string::npos) << few.message;
  EXPECT_EQ(identify_object({}, bodies::random_object(random, 5), bodies::camera(), {}).status,
            Status::too_few_lamps);
  object = bodies::random_object(random, 5);
  for (ObjectPoint& p : object.points) p.position_m = {p.position_m.x(), 0, 0};
  EXPECT_EQ(identify_object(view.blobs, object, bodies::camera(), {}).status, Status::degenerate);
}

}  // namespace
}  // namespace occ
