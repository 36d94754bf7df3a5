// SPDX-License-Identifier: Apache-2.0
// Results of the parts of the search, compared with those of an earlier version: observations, the
// gate of the prior, hypotheses at other poses, the index of lamps, and the order of the triples.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/identify/internal/covisibility.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/size_consistency.hpp"
#include "libocc/identify/internal/triple_order.hpp"
#include "libocc/identify/lamp_index.hpp"
#include "tests/identify/random_maps.hpp"
#include "tests/identify/reference_support.hpp"
#include "tests/support/random_objects.hpp"

namespace occ::test {
namespace {

using namespace internal::identify;

std::vector<double> numbers_of(const BearingObservation& s) {
  std::vector<double> numbers;
  const auto add = [&](const auto& matrix) {
    for (const double value : matrix.reshaped()) numbers.push_back(value);
  };
  add(s.bearing);
  add(s.origin);
  add(s.tangent);
  add(s.axis);
  add((1e6 * s.covariance).eval());
  for (const double value : {1e3 * s.sigma_rad, 1e3 * s.parallax_rad, 1e3 * s.min_radius_rad,
                             1e3 * s.max_radius_rad, 1e3 * s.radius_rad, s.radius_sigma, s.flatness,
                             std::log(std::max(s.flux, 1e-9)), s.flux_sigma})
    numbers.push_back(value);
  for (const bool flag : {s.of_centre, s.flux_is_bound, s.coded}) numbers.push_back(flag);
  for (const int lamp : s.lamps) numbers.push_back(lamp);
  return numbers;
}

CaseResults results_of(const AssignmentProblem& problem) {
  CaseResults results;
  results.add("size", problem.size_m);
  results.add("origin", Eigen::MatrixXd(problem.origin));
  results.add("variance", problem.map_variance_m2);
  results.add("radius", problem.min_radius_m);
  results.add("partial",
              std::vector<double>(problem.partial_blobs.begin(), problem.partial_blobs.end()));
  std::vector<double> numbers;
  for (const char foreign : problem.foreign) numbers.push_back(foreign);
  results.summarise("foreign", numbers);
  numbers.clear();
  for (const MapPoint& point : problem.map_points)
    for (const double value : {point.cone_cos, point.reliable_cos, point.power_w, point.order,
                               1.0 * point.duplicate, 1.0 * point.steady, point.radius_m})
      numbers.push_back(value);
  results.summarise("points", numbers);
  for (const BearingObservation& s : problem.observations)
    results.summarise(std::to_string(s.blob), numbers_of(s));
  return results;
}

/// A room with the lamps of three colours at one place, and one of its images.
struct VariedCase {
  Scene scene;
  Rigid3 pose;
  View view;
  IdentifyOptions options;

  explicit VariedCase(int i, Random& random) {
    scene = varied_room(random, 4 + i % 8, i);
    if (i % 5 == 3)
      for (int k = 0; k < 2; ++k) {
        Lamp lamp = scene.lamps.front();
        lamp.id = 100 + k;
        lamp.centre_m.x() += k * 1.5e-4;
        lamp.normal = so3_exp({0, 0.2 * (i / 5 % 8), 0}) * lamp.normal;
        scene.lamps.push_back(lamp);
      }
    if (i % 3 == 2) scene.lens.vignetting = {-0.2, 0.02, 0};
    if (i % 4 == 1) scene.lamps.back().position_sigma_m = Eigen::Vector3d(0.02, 0.05, 0.01);
    pose = random_room_pose(random, 0.4);
    Look look;
    look.sigma_px = 0.2;
    look.flux_sigma = i % 4 ? 0.05 : 0;
    look.sized = true;
    look.saturated = look.cut = look.merged = look.striped = 0.15;
    look.coloured = i % 2 == 0;
    look.read_frequencies = 0.6;
    look.read_ids = i % 6 == 5 ? 0.5 : 0;
    view = look_at_lamps(scene, pose, look, random, i % 4);
    options.model_sigma_px = i % 3 ? 0.5 : 0.1;
    if (i % 3 == 1) options.prior = prior_of(pose, 1 + random.below(31), 1, random);
    if (i % 7 == 2) options.use_frequency = false;
  }
};

TEST(References, ObservationsOfRooms) {
  References references("identify/observations");
  for (int i = 0; i < 90; ++i) {
    Random random(531, static_cast<std::uint64_t>(i));
    const VariedCase c(i, random);
    references.add(std::to_string(i), results_of(make_problem(c.view.blobs, c.scene, c.options)));
  }
  for (int i = 0; i < 10; ++i) {
    Random random(532, static_cast<std::uint64_t>(i));
    const Object object = bodies::random_object(random, 8, 0.1 + 0.33 * i);
    bodies::View view;
    bodies::add_object(view, 0, object, bodies::random_pose(random, 3), random, 0.3);
    const IdentifyOptions options;
    references.add("object " + std::to_string(i),
                   results_of(make_problem(view.blobs, object, bodies::camera(), options)));
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, HypothesesAtOtherPoses) {
  References references("identify/other_poses");
  for (int i = 0; i < 90; ++i) {
    Random random(533, static_cast<std::uint64_t>(i));
    const VariedCase c(i, random);
    const AssignmentProblem problem = make_problem(c.view.blobs, c.scene, c.options);
    std::vector<Match> matches;
    for (std::size_t k = 0; k < c.view.blobs.size(); ++k)
      if (c.view.lamp[k] >= 0 && random.uniform() < 0.7)
        matches.push_back({c.view.lamp[k], static_cast<int>(k)});
    CaseResults results;
    for (const double off : {0.0, 0.02, 0.3}) {
      const Rigid3 moved =
          Rigid3{so3_exp(off * random_vector(random)), off * random_vector(random)} * c.pose;
      const auto found = hypothesis_at(problem, matches, moved);
      if (found)
        add_hypotheses(results, "found", {*found});
      else
        results.add("found", "none");
    }
    const Result<Identification> searched = search_hypotheses(c.view.blobs, c.scene, c.options);
    results.add("status", static_cast<double>(searched.status));
    add_hypotheses(results, "searched", searched->hypotheses);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PriorsOfPoses) {
  References references("identify/prior_parts");
  for (int i = 0; i < 62; ++i) {
    Random random(534, static_cast<std::uint64_t>(i));
    VariedCase c(0, random);
    c.options.prior = prior_of(c.pose, 1 + i % 31, 1, random);
    if (i % 3 == 1) c.options.prior->position_sigmas_m = Eigen::Vector3d(0.1, 0.4, 1.5);
    const AssignmentProblem problem = make_problem(c.view.blobs, c.scene, c.options);
    CaseResults results;
    for (const auto& part : prior_parts(*c.options.prior, c.pose)) {
      results.add("chi2", part.chi2);
      results.add("wrong", part.wrong);
      results.add("is_place", part.is_place);
    }
    if (c.options.prior->gravity_in_cam) {
      const Eigen::Matrix3d upright = cam_from_upright(problem);
      const PriorGate gate(problem, upright);
      int allowed = 0;
      std::vector<double> which;
      for (int k = 0; k < 400; ++k) {
        const Eigen::Vector3d at = c.pose.origin_in_source() - problem.origin +
                                   (0.3 + 0.01 * k) * 0.5 * random_vector(random);
        const double turn = random.uniform(-pi, pi);
        const bool yes = gate.allows(at, std::cos(turn), std::sin(turn), random.uniform(1, 4),
                                     random.uniform(0, 0.2));
        allowed += yes;
        which.push_back(yes);
      }
      results.add("open", gate.is_open());
      results.summarise("allowed", which);
    }
    references.add(std::to_string(i), results);
  }
  CaseResults volumes;
  for (const double radius : {0.0, 0.05, 0.5, 3.0})
    for (const double distance : {0.01, 0.3, 2.0}) volumes.add("m3", volume_m3(radius, distance));
  references.add("volumes", volumes);
  EXPECT_EQ(references.differences(), "");
}

TEST(References, IndicesOfLamps) {
  References references("identify/indices");
  for (int i = 0; i < 40; ++i) {
    Random random(535, static_cast<std::uint64_t>(i));
    std::vector<Lamp> lamps;
    for (int k = 0; k < 3 + i; ++k) {
      Eigen::Vector3d at(random.uniform(0, 4), random.uniform(0, 0.2 * i), 3);
      at.z() += i % 4 == 1 ? 0.012 * random.normal() : 0;
      if (k % 5 == 4 && i % 3) at.z() -= 0.5;
      if (k % 7 == 6) at.head<2>() = lamps.back().centre_m.head<2>();
      if (i % 6 == 5) at.y() = 1;
      lamps.push_back(disc_lamp(k, at));
    }
    const LampIndex index(lamps);
    CaseResults results;
    results.add("applies", index.applies());
    results.add("triangles", static_cast<double>(index.triangles()));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, OrdersOfTriples) {
  References references("identify/triples");
  for (int i = 0; i < 48; ++i) {
    Random random(536, static_cast<std::uint64_t>(i));
    const VariedCase c(i, random);
    View view = c.view;
    add_false_lights(view, c.scene, random, i % 8 == 7 ? 20 : i % 8);
    const AssignmentProblem problem = make_problem(view.blobs, c.scene, c.options);
    if (problem.observations.size() < 3) continue;
    TripleOrder order(problem, i % 3 == 2 ? 2 : 3);
    if (i % 4 == 1) order.prefer_neighbours(problem);
    CaseResults results;
    results.add("groups", order.groups());
    results.add("blobs", order.blobs());
    std::vector<double> numbers;
    for (const int outliers : {0, 1, 2, 3, 5})
      while (const auto triple = order.next(outliers)) {
        for (const int s : triple->observations) numbers.push_back(s);
        numbers.push_back(triple->far);
      }
    results.summarise("order", numbers);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PairsAndTriplesOfLamps) {
  References references("identify/pairs");
  for (int i = 0; i < 40; ++i) {
    Random random(537, static_cast<std::uint64_t>(i));
    const VariedCase c(2 * i, random);
    const AssignmentProblem problem = make_problem(c.view.blobs, c.scene, c.options);
    SizeConsistency sizes(problem);
    const int points = static_cast<int>(problem.map_points.size());
    const int blobs = static_cast<int>(problem.observations.size());
    std::vector<double> permitted, rows;
    for (int a = 0; a < points; ++a)
      for (int b = 0; b < points; ++b) {
        for (int s = 0; s + 1 < blobs && a != b; ++s)
          permitted.push_back(sizes.permits({s, a}, {s + 1, b}));
        for (int k = 0; k < b; ++k) rows.push_back(are_a_row(problem, a, b, k));
      }
    CaseResults results;
    results.summarise("permitted", permitted);
    results.summarise("rows", rows);
    const Object object = bodies::random_object(random, 6, random.uniform(0.3, 1.5));
    const std::vector<Blob> none;
    const AssignmentProblem body = make_problem(none, object, bodies::camera(), c.options);
    std::vector<double> together;
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < a; ++b) {
        together.push_back(are_covisible(body, {a, b}));
        for (int k = 0; k < b; ++k) together.push_back(are_covisible(body, {a, b, k}));
      }
    results.summarise("covisible", together);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
