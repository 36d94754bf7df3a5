// SPDX-License-Identifier: Apache-2.0
// Protection levels, roots, forecasts, ranks and values of points, compared with those of an
// earlier version.
#include <gtest/gtest.h>

#include "libocc/locate/locate.hpp"
#include "libocc/refine/internal/budget.hpp"
#include "libocc/refine/internal/expected_error.hpp"
#include "libocc/refine/internal/light_errors.hpp"
#include "libocc/refine/internal/light_evidence.hpp"
#include "libocc/refine/internal/pose_roots.hpp"
#include "libocc/refine/localisation_value.hpp"
#include "tests/refine/reference_rooms.hpp"
#include "tests/support/random_objects.hpp"

namespace occ::test {
namespace {

using namespace internal::refine;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = random.normal();
  return matrix;
}

SeparationModel random_separation(Random& random) {
  SeparationModel model;
  const int lamps = 2 + random.below(15);
  const Eigen::Index unknowns = 6 + random.below(3);
  for (int i = 0; i < lamps; ++i) {
    const Eigen::MatrixXd rows = even_log(random, 30, 300) * random_matrix(random, 2, unknowns);
    const Eigen::VectorXd off = random_matrix(random, 2, 1) * (occurs(random, 0.05) ? 5 : 0.7);
    model.lamps.push_back({10 + i, rows.transpose() * rows, rows.transpose() * off});
  }
  model.prior_information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  if (occurs(random, 0.4)) model.prior_information.diagonal().setConstant(400);
  model.prior_information.diagonal().tail(unknowns - 6).array() += 1;
  model.position_jacobian = random_matrix(random, 3, unknowns);
  if (occurs(random, 0.3)) model.variance_factor = random.uniform(1, 5);
  model.position_covariance_m2 = 1e-6 * Eigen::Matrix3d::Identity();
  model.excluded = occurs(random, 0.3) ? 1 + random.below(2) : 0;
  model.fault_probability = even_log(random, 1e-5, 0.05);
  return model;
}

TEST(References, ProtectionLevels) {
  References references("refine/levels");
  for (std::uint64_t i = 0; i < 150; ++i) {
    Random random(61, i);
    const SeparationModel model = random_separation(random);
    CaseResults results;
    add_level(results,
              protection_level(model, even_log(random, 1e-8, 1e-2), even_log(random, 1e-6, 1e-2),
                               occurs(random, 0.3) ? 1e-5 : 0));
    std::vector<double> lamps;
    for (const int lamp : separated_lamps(model, even_log(random, 1e-6, 0.3)))
      lamps.push_back(lamp);
    results.summarise("separated", lamps);
    references.add("model " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, OtherRootsAndErrorsOfLight) {
  References references("refine/roots");
  for (std::uint64_t i = 0; i < 150; ++i) {
    MeasuredRoom room = random_measured_room(1000 + i);
    if (i % 2 == 0) {  // few lamps have several roots
      room.matches.resize(std::min<std::size_t>(room.matches.size(), 3 + i % 4 / 2));
    }
    RefineOptions options;
    options.rung = Rung::centres;
    const Result<Refined> refined =
        refine(room.start, room.matches, room.blobs, room.scene, options);
    if (!refined.ok()) continue;
    CaseResults results;
    std::vector<double> values;
    for (const Rigid3& pose : other_roots(*refined, room.blobs, room.scene)) {
      for (const double value : pose.rotation.reshaped()) values.push_back(value);
      for (const double value : pose.translation) values.push_back(value);
    }
    results.summarise("roots", values);
    const Rigid3& pose = refined->cam_from_world;
    values.clear();
    for (const auto& changed :
         {with_errors_of_light(pose, room.matches, room.blobs, room.scene),
          without_light_gradient(pose, room.matches, room.blobs, room.scene)}) {
      values.push_back(changed ? 1 : 0);
      if (!changed) continue;
      for (const Blob& blob : *changed) {
        for (const double value : blob.centroid_px) values.push_back(value);
        for (const double root : signed_roots(blob.covariance_px2)) values.push_back(root);
        for (const RimPoint& point : blob.rim) values.push_back(point.px.sum());
      }
    }
    results.summarise("light", values);
    const Vector6 bias = bias_of_points(room.matches, room.blobs, room.scene, pose,
                                        refined->covariance, 0.1 * static_cast<double>(i % 3));
    const ExpectedError error = expected_error(pose, refined->covariance, bias);
    results.add("error", std::vector<double>{error.position_m, error.rotation_rad});
    values.clear();
    std::vector<SeenLight> lights;
    std::vector<double> others;
    Random random(62, i);
    for (const Match& match : room.matches) {
      const Blob& blob = room.blobs[static_cast<std::size_t>(match.blob)];
      SeenLight light;
      light.flux = flux_ratio(room.scene.lamps[static_cast<std::size_t>(match.lamp)], blob, pose,
                              room.scene);
      light.log_size = random.uniform(-3, 2);
      light.open = occurs(random, 0.2) ? 0.001 : 0.02;
      lights.push_back(light);
      const auto flux = log_flux(blob, room.scene);
      values.push_back(flux.value_or(-1));
      if (flux && occurs(random, 0.5)) others.push_back(*flux + random.uniform(-2, 1));
    }
    std::sort(others.begin(), others.end());
    values.push_back(log_light_ratio(lights, others));
    results.add("fluxes", values);
    references.add("room " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, ForecastsOfRungs) {
  References references("refine/forecasts");
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(63, i);
    const MeasuredRoom room = random_measured_room(2000 + i);
    std::vector<Hypothesis> hypotheses(1 + i % 3);
    for (Hypothesis& hypothesis : hypotheses) {
      hypothesis.cam_from_world = room.truth;
      hypothesis.matches = room.matches;
      hypothesis.chi2 = random.uniform(0, 20);
    }
    const Image image{640, 480, 1, PixelType::u8, std::vector<std::uint8_t>(640 * 480, 2), {}};
    const ImageView view = image.view();
    const RungCosts costs;
    const IdentifyOptions identify;
    CaseResults results;
    for (const bool has_budget : {false, true})
      for (const bool has_target : {false, true}) {
        RefinementAhead ahead{hypotheses, room.blobs, room.scene, room.options, costs, 5,
                              identify,   {},         {}};
        if (has_budget) ahead.budget_s = even_log(random, 3e-5, 3e-3);
        if (has_target) ahead.target_sigma_m = even_log(random, 3e-4, 3e-2);
        if (i % 4 != 0) ahead.image = &view;
        const RungChoice choice = rung_for(ahead, [] { return 1e-5; });
        std::vector<double> numbers{static_cast<double>(choice.rung), 1e3 * choice.predicted_s,
                                    choice.predicted_sigma_m.value_or(-1), choice.met ? 1.0 : 0.0};
        for (const RungForecast& forecast : choice.alternatives)
          numbers.insert(numbers.end(),
                         {static_cast<double>(forecast.rung), 1e3 * forecast.predicted_s,
                          forecast.predicted_sigma_m.value_or(-1)});
        results.add("choice", numbers);
        results.summarise("reason", {choice.reason.begin(), choice.reason.end()});
      }
    references.add("room " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, RankedPoses) {
  References references("refine/ranked");
  for (std::uint64_t i = 0; i < 120; ++i) {
    Random random(64, i);
    MeasuredRoom room = random_measured_room(3000 + i);
    for (int k = random.below(4); k > 0; --k) {  // false lights
      Blob blob = room.blobs.front();
      const Eigen::Vector2d px(random.uniform(10, 630), random.uniform(10, 470));
      for (RimPoint& point : blob.rim) point.px += px - blob.centroid_px;
      blob.centroid_px = blob.ellipse.centre_px = px;
      room.blobs.push_back(blob);
    }
    if (i % 4 == 1) displace_lamps(room.scene, 0, 0.12, random);  // sizes contradict all poses
    LocateOptions options;
    options.refine = room.options;
    options.refine.prior.reset();
    options.prior = room.options.prior;
    options.max_candidates = i % 5 == 0 ? 2 : 64;
    if (i % 3 == 0) options.target_sigma_m = even_log(random, 1e-4, 3e-2);
    const Result<Fix> fix = locate(room.blobs, room.scene, options);
    CaseResults results;
    results.add("status", static_cast<double>(fix.status));
    results.add("risk", fix->risk.value_or(-1));
    if (fix->choice)
      results.add("choice", std::vector<double>{static_cast<double>(fix->choice->rung),
                                                fix->choice->predicted_sigma_m.value_or(-1),
                                                fix->choice->met ? 1.0 : 0.0, fix->rms_px,
                                                std::sqrt(fix->position_covariance_m2.trace())});
    std::vector<double> candidates;
    for (const Candidate& candidate : fix->candidates) {
      candidates.insert(candidates.end(), {candidate.probability.value_or(-1), candidate.chi2});
      for (const double value : candidate.cam_from_world.translation) candidates.push_back(value);
    }
    results.summarise("candidates", candidates);
    results.summarise("excluded", {fix->excluded_lamps.begin(), fix->excluded_lamps.end()});
    references.add("room " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, ValuesOfPoints) {
  References references("refine/values");
  for (std::uint64_t i = 0; i < 12; ++i) {
    Random random(65, i);
    const Object object =
        bodies::random_object(random, 4 + random.below(7), random.uniform(0.8, 2));
    const std::vector<Rigid3> views = views_around(object, {1.5, 3}, 10 + random.below(20));
    const LocalisationValue value =
        localisation_value(object, bodies::camera(), views, even_log(random, 0.05, 1));
    CaseResults results;
    results.add("all", std::vector<double>{value.determined, value.sigma_m, value.sigma_rad});
    std::vector<double> points, poses;
    for (const PointValue& point : value.points)
      points.insert(points.end(), {point.seen, point.needed, point.growth});
    for (const Rigid3& view : views)
      for (const double entry : view.translation) poses.push_back(entry);
    results.summarise("points", points);
    results.summarise("views", poses);
    references.add("object " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
