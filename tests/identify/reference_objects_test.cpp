// SPDX-License-Identifier: Apache-2.0
// Results of identify_object() and recognise(), compared with those of an earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/false_alarms.hpp"
#include "libocc/identify/recognise.hpp"
#include "tests/identify/reference_support.hpp"
#include "tests/support/random_objects.hpp"

namespace occ::test {
namespace {

using namespace internal::identify;

Object varied_object(Random& random, int i) {
  const double cone =
      std::array<double, 5>{1.4, pi / 2, 0.8, 2.2, pi}[static_cast<std::size_t>(i % 5)];
  Object object = bodies::random_object(random, 5 + i % 11, cone);
  if (i % 3 == 1)
    for (ObjectPoint& point : object.points) point.radius_m = random.uniform(0.005, 0.03);
  if (i % 4 == 2) {  // symmetric: the other half is the first one turned by half a turn
    const std::size_t half = object.points.size() / 2;
    for (std::size_t k = 0; k < half; ++k) {
      ObjectPoint& turned = object.points[k + half];
      turned.position_m = object.points[k].position_m.cwiseProduct(Eigen::Vector3d(-1, -1, 1));
      turned.normal = object.points[k].normal.cwiseProduct(Eigen::Vector3d(-1, -1, 1));
    }
  }
  if (i % 7 == 3)
    for (ObjectPoint& point : object.points) point.position_m.z() = 0.2;
  return object;
}

TEST(References, IdentifiedPointsOfObjects) {
  References references("identify/objects");
  for (int i = 0; i < 120; ++i) {
    Random random(521, static_cast<std::uint64_t>(i));
    const Object object = varied_object(random, i);
    const Rigid3 pose = bodies::random_pose(random, random.uniform(1, 4));
    const double sigma_px = i % 3 ? 0.2 : 0.6;
    bodies::View view;
    bodies::add_object(view, 0, object, pose, random, sigma_px);
    if (i % 4 == 3 && view.blobs.size() > 5) view.blobs.pop_back();
    bodies::add_false_lights(view, i % 6, random, sigma_px);
    IdentifyOptions options;
    options.model_sigma_px = i % 2 ? 0.1 : 0.4;
    if (i % 5 == 4) options.prior = prior_of(pose, 1 + random.below(31), 1, random);
    if (i % 8 == 5) options.method = IdentifyMethod::alignment;
    if (i % 8 == 6) options.method = IdentifyMethod::clustering;
    const Result<Identification> found =
        identify_object(view.blobs, object, bodies::camera(), options);
    CaseResults results = results_of(found);
    const AssignmentProblem problem = make_problem(view.blobs, object, bodies::camera(), options);
    for (std::size_t k = 0; k < std::min<std::size_t>(2, found->hypotheses.size()); ++k)
      results.add("log10_nfa", log10_false_alarms(problem, found->hypotheses[k]));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

void add_match(CaseResults& results, const ObjectMatch& match) {
  results.add("object", match.object);
  results.add("plausible", match.plausible);
  results.add("log10_nfa", match.log10_false_alarms);
  add_hypotheses(results, "poses", match.poses);
}

TEST(References, RecognisedObjects) {
  References references("identify/recognised");
  for (int i = 0; i < 60; ++i) {
    Random random(522, static_cast<std::uint64_t>(i));
    std::vector<Object> objects;
    for (int k = 0; k < 1 + i % 3; ++k) objects.push_back(varied_object(random, i + 3 * k));
    if (i % 6 == 5) {  // almost a copy
      objects.push_back(objects.front());
      for (ObjectPoint& point : objects.back().points)
        point.position_m += 0.01 * random_vector(random);
    }
    const double sigma_px = i % 2 ? 0.2 : 0.5;
    bodies::View view;
    for (int k = 0; k < i % 3; ++k) {
      const Eigen::Vector2d off_px(k ? 180 : -120, k ? 60 : -40);
      bodies::add_object(view, k, objects[static_cast<std::size_t>(k) % objects.size()],
                         bodies::random_pose(random, 2.5, off_px), random, sigma_px);
    }
    bodies::add_false_lights(view, i % 3 ? i % 7 : 8, random, sigma_px);
    bodies::shuffle(view, random);
    RecogniseOptions options;
    options.identify.model_sigma_px = 0.1;
    if (i % 5 == 1) options.max_false_alarms = 0.5;
    options.identify.max_hypotheses = i % 5 == 2 ? 500 : 20000;
    const Result<Recognition> found = recognise(view.blobs, objects, bodies::camera(), options);
    CaseResults results;
    results.add("status", static_cast<double>(found.status));
    results.add("nfa", found->log10_false_alarms);
    for (const RecognisedObject& object : found->found) {
      add_match(results, object.match);
      results.add("log_risk", std::log(std::max(object.risk, 1e-100)));
      results.add("ambiguous", object.status == Status::ambiguous);
      for (const ObjectMatch& rival : object.rivals) add_match(results, rival);
    }
    if (!found.message.empty()) results.add("message", joined(found.message));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
