// SPDX-License-Identifier: Apache-2.0
// Recognition of several objects: no false matches, correct poses, ambiguity reported.
#include "libocc/identify/recognise.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_objects.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using bodies::View;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double sigma_px = 0.2;

RecogniseOptions exact_camera() {
  RecogniseOptions options;
  options.identify.model_sigma_px = 0.1;
  return options;
}

std::vector<Object> random_objects(Random& random, int count, int points = 12) {
  std::vector<Object> objects;
  for (int i = 0; i < count; ++i) objects.push_back(bodies::random_object(random, points));
  return objects;
}

Result<Recognition> recognised(const View& view, const std::vector<Object>& objects) {
  return recognise(view.blobs, objects, bodies::camera(), exact_camera());
}

// Returns 1 if an object is reported in an image that shows none of them.
int declared(const View& view, const std::vector<Object>& objects) {
  return !recognised(view, objects)->found.empty();
}

void absent_objects_are_not_found(int trials) {
  Random random(1);
  const RecogniseOptions loose = [] {
    RecogniseOptions options = exact_camera();
    options.max_false_alarms = 0.1;
    return options;
  }();
  int strict = 0, at_a_tenth = 0;
  for (int i = 0; i < trials; ++i) {
    const std::vector<Object> objects = random_objects(random, 3);
    View view;
    if (i % 3 == 0) {  // shows another object
      bodies::add_object(view, 9, bodies::random_object(random, 12),
                         bodies::random_pose(random, 2.5), random, sigma_px);
    } else if (i % 3 == 1) {  // lights concentrated in a corner
      for (int k = 0; k < 9; ++k)
        bodies::add_blob(view, {random.uniform(20, 90), random.uniform(20, 90)}, sigma_px, {});
    }
    bodies::add_false_lights(view, i % 3 == 2 ? 10 : 2, random, sigma_px);
    strict += declared(view, objects);
    at_a_tenth += !recognise(view.blobs, objects, bodies::camera(), loose)->found.empty();
  }
  EXPECT_LE(strict, 1 + trials / 500);
  EXPECT_LE(at_a_tenth, 1 + trials / 10);
}

TEST(Recognise, AbsentObjectsAreNotFound) { absent_objects_are_not_found(12); }
TEST(SlowRecognise, AbsentObjectsAreNotFound) { absent_objects_are_not_found(600); }

void right_one_of_five(int trials) {
  Random random(2);
  int right = 0, wrong = 0, done = 0, surest = 0;
  while (done < trials) {
    const std::vector<Object> objects = random_objects(random, 5);
    const int shown = random.below(5);
    View view;
    bodies::add_object(view, shown, objects[shown], bodies::random_pose(random, 2.2), random,
                       sigma_px);
    if (bodies::lights_of(view, shown) < 7) continue;
    ++done;
    bodies::add_false_lights(view, 2, random, sigma_px);
    bodies::shuffle(view, random);
    const Result<Recognition> found = recognised(view, objects);
    for (const RecognisedObject& o : found->found) wrong += o.match.object != shown;
    if (found->found.empty()) continue;
    const RecognisedObject& first = found->found.front();
    right +=
        first.match.object == shown && bodies::is_right(first.match.poses.front(), view, shown);
    surest += found.ok();
  }
  EXPECT_GE(right, 0.99 * trials);
  EXPECT_GE(surest, 0.98 * trials - 1);
  EXPECT_LE(wrong, trials / 200);
}

TEST(Recognise, TheRightOneOfFive) { right_one_of_five(10); }
TEST(SlowRecognise, TheRightOneOfFive) { right_one_of_five(500); }

void two_at_once(int count) {
  Random random(3);
  int both = 0, trials = 0;
  while (trials < count) {
    const std::vector<Object> objects = random_objects(random, 4);
    View view;
    bodies::add_object(view, 0, objects[0], bodies::random_pose(random, 2.4, {-150, 0}), random,
                       sigma_px);
    bodies::add_object(view, 2, objects[2], bodies::random_pose(random, 2.4, {150, 20}), random,
                       sigma_px);
    if (bodies::lights_of(view, 0) < 7 || bodies::lights_of(view, 2) < 7) continue;
    ++trials;
    bodies::shuffle(view, random);
    const Result<Recognition> found = recognised(view, objects);
    std::vector<int> taken;
    bool right = found->found.size() == 2;
    for (const RecognisedObject& o : found->found) {
      right = right && bodies::is_right(o.match.poses.front(), view, o.match.object);
      for (const Match& m : o.match.poses.front().matches) taken.push_back(m.blob);
    }
    std::sort(taken.begin(), taken.end());
    EXPECT_EQ(std::adjacent_find(taken.begin(), taken.end()), taken.end());
    both += right;
  }
  EXPECT_GE(both, 0.95 * count);
}

TEST(Recognise, TwoAtOnce) { two_at_once(2); }
TEST(SlowRecognise, TwoAtOnce) { two_at_once(30); }

// One object is visible twice.
TEST(Recognise, OneObjectTwice) {
  Random random(4);
  const std::vector<Object> objects = random_objects(random, 2, 16);
  View view;
  for (int trials = 0; trials < 100; ++trials) {
    view = {};
    for (const double side : {-150.0, 150.0})
      bodies::add_object(view, side < 0 ? 0 : 1, objects[0],
                         bodies::random_pose(random, 2.4, {side, 0}), random, sigma_px);
    if (bodies::lights_of(view, 0) >= 7 && bodies::lights_of(view, 1) >= 7) break;
  }
  const Result<Recognition> found = recognised(view, objects);
  ASSERT_EQ(found->found.size(), 2u);
  EXPECT_EQ(found->found[0].match.object, 0);
  EXPECT_EQ(found->found[1].match.object, 0);
}

/// An object of `points` lights, and a view that shows at least `min_lights` of them.
std::pair<Object, View> seen_object(Random& random, int points, int min_lights) {
  constexpr int attempts =
      200;  // poses tried with one object; some objects never show enough lights
  for (;;) {
    const Object object = bodies::random_object(random, points);
    for (int i = 0; i < attempts; ++i) {
      View view;
      bodies::add_object(view, 0, object, bodies::random_pose(random, 2.2), random, sigma_px);
      if (bodies::lights_of(view, 0) >= min_lights) return {object, view};
    }
  }
}

void mirrored_and_similar_objects(int trials) {
  Random random(5);
  int sure = 0;
  for (int i = 0; i < trials; ++i) {
    const auto [object, view] = seen_object(random, 14, 8);
    std::vector<Object> objects{object, object};
    for (ObjectPoint& p : objects[1].points) {
      if (i % 2) {
        p.position_m.x() *= -1;
        p.normal.x() *= -1;
      } else if (p.id % 2) {
        p.position_m *= 1.2;  // moves every second light outwards
      }
    }
    const Result<Recognition> found = recognised(view, objects);
    ASSERT_FALSE(found->found.empty());
    EXPECT_EQ(found->found[0].match.object, 0);
    sure += found.ok();
  }
  EXPECT_GE(sure, 0.95 * trials);
}

TEST(Recognise, DistinguishesMirroredAndSimilarObjects) { mirrored_and_similar_objects(4); }
TEST(SlowRecognise, DistinguishesMirroredAndSimilarObjects) { mirrored_and_similar_objects(60); }

TEST(Recognise, ObjectsThatLookAlikeAreRivals) {
  Random random(6);
  const auto [object, view] = seen_object(random, 12, 7);
  // The third object equals the first except for the lights that are not visible.
  std::vector<Object> objects{object, bodies::random_object(random, 12), object};
  for (ObjectPoint& p : objects[2].points) {
    const auto& lights = view.lights;
    const bool seen = std::any_of(lights.begin(), lights.end(),
                                  [&](const bodies::Light& l) { return l.point == p.id; });
    if (!seen) p.position_m += 0.02 * p.normal;
  }
  const Result<Recognition> found = recognised(view, objects);
  ASSERT_EQ(found.status, Status::ambiguous);
  ASSERT_EQ(found->found.size(), 1u);
  const RecognisedObject& first = found->found[0];
  ASSERT_EQ(first.rivals.size(), 1u);
  EXPECT_EQ(first.match.object + first.rivals[0].object, 2);
  EXPECT_TRUE(bodies::is_right(first.rivals[0].poses.front(), view, 0));
}

// A square of lights on a mast has four poses.
TEST(Recognise, AnObjectThatRepeatsIsAmbiguous) {
  Object square{"square", {}};
  for (int i = 0; i < 8; ++i) {
    ObjectPoint p;
    p.id = i;
    const double angle = i % 4 * 1.5707963267948966, radius = i < 4 ? 0.3 : 0.15;
    p.position_m = {radius * std::cos(angle), radius * std::sin(angle), i < 4 ? 0 : 0.1};
    square.points.push_back(p);
  }
  Random random(7);
  View view;
  const Rigid3 pose = look_at({0.3, 0.4, 2}, {0, 0, 0}, Vector3d::UnitY());
  bodies::add_object(view, 0, square, pose, random, 0.1);
  const Result<Recognition> found =
      recognise(view.blobs, {square}, bodies::camera(), exact_camera());
  ASSERT_EQ(found.status, Status::ambiguous);
  EXPECT_EQ(found->found[0].match.poses.size(), 4u);
  EXPECT_EQ(found->found[0].match.plausible, 4);
  EXPECT_TRUE(found->found[0].rivals.empty());
}

TEST(Recognise, MoreAgreementIsLessOftenChance) {
  Random random(8);
  auto [object, view] = seen_object(random, 16, 9);
  double last = -300;
  for (; view.blobs.size() >= 5; view.blobs.pop_back(), view.lights.pop_back()) {
    const auto found = recognise(view.blobs, {object}, bodies::camera(), exact_camera());
    EXPECT_GT(found->log10_false_alarms[0], last);
    last = found->log10_false_alarms[0];
  }
  EXPECT_GT(last, -3);  // five lights, of which three determine the pose
}

TEST(Recognise, ReportsBadInput) {
  Random random(9);
  const std::vector<Object> objects = random_objects(random, 2);
  EXPECT_EQ(recognise({}, objects, bodies::camera()).status, Status::too_few_lamps);
  View view;
  bodies::add_false_lights(view, 8, random, sigma_px);
  const auto none = recognised(view, objects);
  EXPECT_EQ(none.status, Status::no_pose);
  EXPECT_EQ(none->log10_false_alarms.size(), 2u);
  EXPECT_THROW(recognise(view.blobs, {}, bodies::camera()), std::invalid_argument);
  RecogniseOptions options;
  options.max_false_alarms = 0;
  EXPECT_NE(test::complaint([&] {
              recognise(view.blobs, objects, bodies::camera(), options);
            }).find("max_false_alarms"),
            std::string::npos);
  view.blobs[0].centroid_px.x() = std::nan("");
  EXPECT_THROW(recognised(view, objects), std::invalid_argument);
}

TEST(Recognise, ManyBlobsEndInTime) {
  Random random(10);
  View view;
  bodies::add_false_lights(view, 600, random, sigma_px);
  RecogniseOptions options = exact_camera();
  options.identify.max_hypotheses = 20000;
  const auto found = recognise(view.blobs, random_objects(random, 2), bodies::camera(), options);
  EXPECT_TRUE(found->found.empty());
  EXPECT_NE(found.message.find("max_hypotheses = 20000"), std::string::npos) << found.message;
}

}  // namespace
}  // namespace occ
