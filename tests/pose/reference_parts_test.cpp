// SPDX-License-Identifier: Apache-2.0
// Results of candidates, evidence, fits and searches of poses, compared with those of an earlier
// version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/pose/candidates.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"
#include "libocc/pose/internal/consensus.hpp"
#include "libocc/pose/internal/consensus_cost.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/pose/internal/false_alarms.hpp"
#include "libocc/pose/internal/plane_starts.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/internal/pose_newton.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/pose/solvers/planar.hpp"
#include "tests/support/references.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

using namespace internal::pose;

void append(std::vector<double>& numbers, const Rigid3& pose) {
  for (const double value : pose.rotation.reshaped()) numbers.push_back(value);
  for (const double value : pose.translation) numbers.push_back(value);
}

void append(std::vector<double>& numbers, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  for (const double value : matrix.reshaped()) numbers.push_back(value);
}

/// Turns bearings by about `sigma_rad`, independently of one another.
void turn_bearings(PoseProblem& problem, double sigma_rad, Random& random) {
  for (Eigen::Index i = 0; i < problem.bearings.cols(); ++i)
    problem.bearings.col(i) =
        (problem.bearings.col(i) + sigma_rad * random_vector(random)).normalized();
}

/// Solvers whose poses are libocc's own.
std::vector<std::string> own_solvers() {
  std::vector<std::string> names{"auto"};
  for (const Solver& solver : solvers())
    if (std::string(solver.source).find("Open") == std::string::npos)
      names.emplace_back(solver.name);
  return names;
}

TEST(References, CandidatesOfNoisyProblems) {
  References references("pose/candidates");
  const std::vector<std::string> names = own_solvers();
  for (int i = 0; i < 440; ++i) {
    Random random(801, static_cast<std::uint64_t>(i));
    const std::string& name = names[static_cast<std::size_t>(i) % names.size()];
    const ProblemKind kind{i % 3 == 0, false, i % 7 == 3, 2, i % 5 == 4 ? 300.0 : 6.0};
    KnownProblem known = random_problem(random, 3 + i % 8, kind);
    const double sigma_rad =
        std::array<double, 5>{0, 1e-9, 1e-4, 1e-3, 0.03}[static_cast<std::size_t>(i / 11 % 5)];
    turn_bearings(known.problem, sigma_rad, random);
    if (i % 9 == 5) known.problem.points *= 20;
    if (i % 10 == 6) known.problem.points.colwise() += Eigen::Vector3d(5, -3, 2);
    if (i % 13 == 8) known.problem.points.row(2) *= 1e-4;
    if (i % 17 == 4) known.problem.bearings.col(0) *= -1;
    CandidateOptions options;
    options.tolerance_rad = i % 4 == 1 ? 1e-6 : 8 * sigma_rad + 1e-6;
    options.polish = i % 6 != 2;
    if (name != "auto" && known.problem.size() < solver_named(name).min_points) continue;
    const auto found = pose_candidates(known.problem, name, options);
    CaseResults results;
    results.add("status", static_cast<double>(found.status));
    std::vector<double> numbers, misfits;
    for (const PoseCandidate& c : *found) {
      append(numbers, c.cam_from_world);
      if (c.misfit_rad > 1e-6) misfits.push_back(1e3 * c.misfit_rad);
    }
    results.summarise("poses", numbers);
    results.summarise("misfits", misfits);
    results.add("condition", std::log(pose_condition(known.problem, known.truth)));
    references.add(name + " " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, TriplesOfNoisyBearings) {
  References references("pose/triples");
  for (int i = 0; i < 240; ++i) {
    Random random(802, static_cast<std::uint64_t>(i));
    const ProblemKind kind{true, false, i % 7 == 3, 1.2, i % 5 == 4 ? 1e3 : 5.0};
    KnownProblem known = random_problem(random, 3, kind);
    if (i % 4 == 1) {  // on the cylinder through the triangle's circle, where two roots meet
      known.problem.points << 1, -0.5, -0.5, 0, 0.8660254, -0.8660254, 0, 0, 0;
      known.truth.translation = {0.3 * (i % 3 - 1), 0, 3};
      known.truth.rotation = so3_exp({0, 0, 0.1 * i});
      known.problem.bearings =
          (known.truth.rotation * known.problem.points).colwise() + known.truth.translation;
      known.problem.bearings.colwise().normalize();
    }
    const double sigma_rad =
        std::array<double, 4>{1e-5, 1e-3, 0.01, 0.05}[static_cast<std::size_t>(i % 4)];
    turn_bearings(known.problem, sigma_rad, random);
    const Eigen::Matrix3d bearings = known.problem.bearings, points = known.problem.points;
    std::vector<double> exact, within;
    for (const Rigid3& pose : p3p(bearings, points)) append(exact, pose);
    std::array<Rigid3, 4> poses;
    const int count = p3p_within(bearings, points, 5 * sigma_rad, poses);
    for (int k = 0; k < count; ++k) append(within, poses[static_cast<std::size_t>(k)]);
    CaseResults results;
    results.summarise("exact", exact);
    results.summarise("within", within);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

SeenLamp random_lamp(Random& random, int i, double size) {
  SeenLamp lamp;
  lamp.residual_px = size * Eigen::Vector2d(random.normal(), random.normal());
  lamp.covariance_px2 = 0.04 * Eigen::Matrix2d::Identity();
  lamp.covariance_px2(0, 1) = lamp.covariance_px2(1, 0) = 0.01;
  for (Eigen::Index k = 0; k < 12; ++k) lamp.by_pose(k) = 300 * random.normal();
  lamp.by_size = {5 * random.normal(), 3};
  if (i % 3 == 1) {
    lamp.shape_residual_px = 0.2 * size * random_vector(random);
    for (Eigen::Index k = 0; k < 18; ++k) lamp.shape_by_pose(k) = 10 * random.normal();
    lamp.shape_sigma_px = 0.05;
    lamp.shape_by_size = {10, 1, -2};
  }
  return lamp;
}

PoseEvidence random_evidence(Random& random, int i) {
  PoseEvidence evidence;
  const double size = std::array<double, 4>{0.1, 0.5, 2, 8}[static_cast<std::size_t>(i % 4)];
  for (int k = 0; k < 1 + i % 8; ++k) evidence.lamps.push_back(random_lamp(random, i, size));
  for (int k = 0; k < (i % 5 == 2 ? 4 : 0); ++k)
    evidence.corners.push_back(random_lamp(random, 0, size));
  for (int k = 0; k < i % 4; ++k) {
    PriorPart part;
    Eigen::Matrix<double, 2, 6> rows;
    for (Eigen::Index j = 0; j < 12; ++j) rows(j) = 3 * random.normal();
    const Eigen::Vector2d residuals(random.normal(), i % 3 * random.normal());
    part.information = rows.transpose() * rows;
    part.gradient = rows.transpose() * residuals;
    part.chi2 = residuals.squaredNorm();
    part.wrong = k == 0 ? 1e-4 : 1e-2;
    part.is_place = k == 1;
    evidence.prior.push_back(part);
  }
  evidence.image_px2 = 640 * 480;
  evidence.blobs = static_cast<int>(evidence.lamps.size()) + i % 6 - 1;
  evidence.missed = i % 7;
  evidence.volume_m3 = std::exp(random.uniform(-1, 7));
  evidence.rotations = i % 2 ? 1 : 0.1;
  evidence.model_sigma_px = i % 3 ? 0.5 : 0.1;
  evidence.log_appearance = random.normal();
  return evidence;
}

TEST(References, EvidenceOfPoses) {
  References references("pose/evidence");
  for (int i = 0; i < 240; ++i) {
    Random random(803, static_cast<std::uint64_t>(i));
    std::vector<PoseEvidence> group{random_evidence(random, i)};
    if (i % 3 == 2) {
      group.push_back(group.front());
      for (SeenLamp& lamp : group.back().lamps)
        lamp.shape_residual_px *= 2, lamp.residual_px *= 1.5;
    }
    CaseResults results;
    std::vector<double> values;
    for (const LogEvidence& log : log_evidences(group)) {
      results.add("value", log.value);
      results.add("prior", log.if_prior_wrong);
      results.add("place", log.if_place_wrong);
      values.push_back(log.value);
    }
    std::vector<double> logs;
    for (const double share : probabilities({0.1 * values[0], 2, -1}, i % 5 - 2))
      logs.push_back(std::log(share));
    results.add("probabilities", logs);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, FitsOfPoints) {
  References references("pose/fits");
  for (int i = 0; i < 240; ++i) {
    Random random(804, static_cast<std::uint64_t>(i));
    const ProblemKind kind{i % 2 == 0, i % 5 == 3, false, 2, i % 7 == 5 ? 100.0 : 6.0};
    KnownProblem known = random_problem(random, 3 + i % 9, kind);
    const double sigma_rad = i % 3 ? 1e-3 : 0.03;
    turn_bearings(known.problem, sigma_rad, random);
    SeenPoints seen;
    for (Eigen::Index k = 0; k < known.problem.points.cols(); ++k) {
      TangentBasis across = tangent_basis(known.problem.bearings.col(k)) / sigma_rad;
      if (i % 4 == 1) across.row(0) *= 2;
      const Eigen::Vector3d origin =
          kind.rig ? Eigen::Vector3d(known.problem.origins.col(k)) : Eigen::Vector3d::Zero();
      seen.add(known.problem.points.col(k), known.problem.bearings.col(k), across, origin);
    }
    const double off = std::array<double, 4>{0.01, 0.1, 0.5, 1.5}[static_cast<std::size_t>(i % 4)];
    const Rigid3 start{so3_exp(off * random_vector(random)) * known.truth.rotation,
                       known.truth.translation + off * random_vector(random)};
    const PointFit fit = fit_points(seen, start, i % 6 == 4 ? 3 : 100, i % 3 ? 1e-3 : 1e-9);
    const PointEquations at_start = point_equations(seen, start);
    std::vector<double> numbers, each, equations;
    append(numbers, fit.pose);
    each_chi2(seen, start, each);
    append(equations, at_start.information);
    append(equations, at_start.gradient);
    Rigid3 polished = known.truth;
    polish_pose(known.problem.bearings, known.problem.points, known.problem.origins, 3, polished);
    std::vector<double> polished_numbers;
    append(polished_numbers, polished);
    CaseResults results;
    results.add("converged", fit.converged);
    results.add("chi2", std::vector<double>{fit.equations.chi2, at_start.chi2,
                                            point_chi2(seen, known.truth)});
    results.summarise("pose", numbers);
    results.summarise("each", each);
    results.summarise("equations", equations);
    results.summarise("polished", polished_numbers);
    results.add("misfit", 1e3 * misfit_rad(known.problem.bearings, known.problem.points,
                                           known.problem.origins, start));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, ConsensusOfPoints) {
  References references("pose/consensus");
  for (int i = 0; i < 160; ++i) {
    Random random(805, static_cast<std::uint64_t>(i));
    const int count = std::array<int, 5>{5, 9, 17, 40, 80}[static_cast<std::size_t>(i % 5)];
    const double away = std::array<double, 3>{12, 4, 1.5}[static_cast<std::size_t>(i % 3)];
    const Rigid3 pose{so3_exp({0.3, -0.2, 0.5}), {0.1, -0.2, away}};
    constexpr double sigma_rad = 1e-3;
    Eigen::Matrix3Xd points(3, count), bearings(3, count);
    SeenPoints seen;
    for (int k = 0; k < count; ++k) {
      points.col(k) = (i % 3 == 2 ? 0.3 : 1) * random_vector(random);
      if (i % 4 == 2) points(2, k) = 0;
      const bool wrong = random.uniform() < 0.15 * (i % 5);
      const Eigen::Vector3d away(random.uniform(-1, 1), random.uniform(-1, 1), 1);
      const Eigen::Vector3d at = (pose * Eigen::Vector3d(points.col(k))).normalized();
      bearings.col(k) = (wrong ? away : at + sigma_rad * random_vector(random)).normalized();
      seen.add(points.col(k), bearings.col(k), tangent_basis(bearings.col(k)) / sigma_rad,
               Eigen::Vector3d::Zero());
    }
    ConsensusOptions options;
    options.seed = static_cast<std::uint64_t>(i);
    options.max_iterations = i % 6 == 4 ? 15 : 3000;
    options.gate_sigmas = i % 7 == 3 ? 2.5 : 4;
    options.sample_sigmas = i % 8 == 5 ? 5 : 12;
    options.confidence = i % 9 == 7 ? 0.6 : 0.9999;
    options.min_inliers = i % 10 == 6 ? count / 2 : 4;
    if (i % 4 == 1) options.up_in_cam = pose.rotation.col(2);
    const Consensus found = find_consensus(points, bearings, seen, options);
    CaseResults results;
    const ConsensusCost cost(seen, bearings, 12);
    for (const double off : {0.0, 3e-3, 0.03}) {
      const Rigid3 moved{so3_exp(off * Eigen::Vector3d(1, 2, 3)) * pose.rotation, pose.translation};
      results.add("cost", cost(moved, 1e6F));
    }
    results.add("cost", found.cost);
    results.add("iterations", found.iterations);
    results.add("confident", found.confident);
    results.summarise("inliers", std::vector<double>(found.inliers.begin(), found.inliers.end()));
    std::vector<double> numbers;
    append(numbers, found.pose);
    if (found.inliers.size() > 3) results.summarise("pose", numbers);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, LayoutsAndStarts) {
  References references("pose/layouts");
  for (int i = 0; i < 200; ++i) {
    Random random(806, static_cast<std::uint64_t>(i));
    KnownProblem known = random_problem(random, 3 + i % 7, {i % 2 == 0});
    PoseProblem& problem = known.problem;
    turn_bearings(problem, i % 3 ? 1e-3 : 0.03, random);
    CaseResults results;
    std::vector<double> starts;
    append(starts, reflected_pose(problem, known.truth));
    results.summarise("starts", starts);
    if (i % 5 == 1) problem.points.bottomRows<2>() *= std::pow(10, -(i % 16));
    const PointLayout layout = point_layout(problem.points);
    results.add("spans", 2 * spans_plane(layout) + spans_space(layout));
    results.add("height", height_over_line(problem.points));
    std::vector<double> indices;
    for (const Triple& triple : triples_to_try(problem.points, problem.bearings))
      for (const int k : triple) indices.push_back(k);
    results.summarise("triples", indices);
    const Triple chosen = spread_triple(problem.points);
    results.add("line", on_a_line(problem.points, chosen, i % 4 ? 0 : 1e6));
    const FalseAlarmModel model{10 + i, i % 2 ? 3 : 2, 4, std::pow(10, random.uniform(-5, -0.5))};
    results.add("alarms", std::vector<double>{log_false_alarms(model, 5 + i % 9),
                                              1.0 * min_inliers(model, i % 3 ? 1e-3 : 1e-8)});
    std::vector<double> planar;
    const PlanarCamera camera{known.truth.rotation.col(2), known.truth.origin_in_source().z()};
    for (const PoseCandidate& c :
         planar_poses(Eigen::Matrix<double, 3, 2>(problem.bearings.leftCols<2>()),
                      Eigen::Matrix<double, 3, 2>(problem.points.leftCols<2>()), camera))
      append(planar, c.cam_from_world);
    for (const PoseCandidate& c :
         planar_poses(Eigen::Vector3d(problem.bearings.col(0)),
                      Eigen::Vector3d(problem.points.col(0)), 0.1 * i, camera))
      append(planar, c.cam_from_world);
    results.summarise("planar", planar);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
