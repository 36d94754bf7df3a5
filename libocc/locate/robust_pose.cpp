// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/robust_pose.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/locate/internal/agreement.hpp"
#include "libocc/locate/internal/point_problem.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/internal/consensus.hpp"

namespace occ {

using namespace internal::locate;
using namespace internal::pose;
namespace {

constexpr double sample_noise = 3;  // error of other points at the pose of a sample [gates]

double focal_px(const Camera& camera) { return 0.5 * (camera.fx_px() + camera.fy_px()); }

int sample_size(const RobustPoseOptions& options) { return options.up_in_cam ? 2 : 3; }
int poses_per_sample(const RobustPoseOptions& options) { return options.up_in_cam ? 2 : 4; }

// Number of inliers that the search must be able to find. Residuals of one sigma are assumed; on a
// target not much larger than that, half of the points.
int fewest_inliers(const Eigen::Matrix2Xd& pixels, const RobustPoseOptions& options) {
  const int sample = sample_size(options);
  const FalseAlarmModel chance =
      chance_anywhere(pixels, options.sigma_px, sample, poses_per_sample(options));
  return std::min(internal::pose::min_inliers(chance, options.max_false_alarms),
                  std::max(sample + 1, (chance.points + 1) / 2));
}

ConsensusOptions search_options(const RobustPoseOptions& options, const Camera& camera,
                                const Eigen::Matrix2Xd& pixels) {
  ConsensusOptions search;
  search.gate_sigmas = options.gate_sigmas;
  search.sample_sigmas = sample_noise * options.gate_sigmas;
  if (options.up_in_cam)
    search.sample_sigmas +=
        sample_noise * options.up_sigma_rad * focal_px(camera) / options.sigma_px;
  search.confidence = options.confidence;
  search.max_iterations = options.max_iterations;
  search.min_inliers = fewest_inliers(pixels, options);
  search.seed = options.seed;
  if (options.up_in_cam) search.up_in_cam = options.up_in_cam->normalized();
  return search;
}

struct Correspondences {
  const Eigen::Matrix3Xd& points_in_world;
  const Eigen::Matrix2Xd& points_px;
  const Camera& camera;
  const RobustPoseOptions& options;
  PointProblem problem;
};

// Maximum-likelihood pose of the inliers, and all others that fit equally well.
Result<Fix> fix_of(const Correspondences& m, const Consensus& consensus) {
  SolvePoseOptions solve;
  solve.sigma_px = m.options.sigma_px;
  const Eigen::Matrix3Xd those = m.points_in_world(Eigen::all, consensus.inliers);
  const Eigen::Matrix2Xd seen = m.points_px(Eigen::all, consensus.inliers);
  Result<Fix> fix = solve_pose(those, seen, m.camera, solve);
  const double gate2 = m.options.gate_sigmas * m.options.gate_sigmas;
  const auto left_out =
      static_cast<double>(m.points_in_world.cols()) - static_cast<double>(consensus.inliers.size());
  const double chi2 = gate2 * (consensus.cost - left_out);
  if (!fix->candidates.empty() && fix->candidates.front().chi2 <= chi2 * (1 + 1e-3) + 1e-3)
    return fix;
  solve.start = m.problem.frame.restored(consensus.pose);
  return solve_pose(those, seen, m.camera, solve);
}

// The fit lowers the residuals, so its pose is used where there is one.
Significance significance_of(const Correspondences& m, const Consensus& consensus, const Fix& fix) {
  std::vector<double> chi2;
  each_chi2(
      m.problem.seen,
      fix.candidates.empty() ? consensus.pose : m.problem.frame.normalised(fix.cam_from_world),
      chi2);
  std::vector<Agreement> inliers;
  for (const int i : consensus.inliers)
    inliers.push_back({i, m.options.sigma_px * std::sqrt(chi2[i])});
  return significance(m.points_px, inliers, m.options.sigma_px, sample_size(m.options),
                      poses_per_sample(m.options));
}

// The smallest number of inliers that is not significantly fewer: if each of two poses is equally
// likely to explain a point, their numbers of inliers differ by about the root of their sum.
int fewest_of_a_rival(int inliers) {
  return static_cast<int>(std::ceil(inliers - std::sqrt(2.0 * inliers)));
}

// The best pose of the points that are far from agreeing with the first pose. Its inliers are empty
// if they are significantly fewer than those of the first.
Consensus rival_of(const Correspondences& m, const Consensus& first, ConsensusOptions search) {
  std::vector<double> chi2;
  each_chi2(m.problem.seen, first.pose, chi2);
  std::vector<int> rest;
  for (int i = 0; i < m.problem.seen.count(); ++i)
    if (!(chi2[i] < search.sample_sigmas * search.sample_sigmas)) rest.push_back(i);
  search.min_inliers = std::max(sample_size(m.options) + 1,
                                fewest_of_a_rival(static_cast<int>(first.inliers.size())));
  if (static_cast<int>(rest.size()) < search.min_inliers) return {};
  SeenPoints seen;
  seen.reserve(static_cast<int>(rest.size()));
  for (const int i : rest) seen.add(m.problem.seen, i);
  Consensus rival = find_consensus(m.problem.points(Eigen::all, rest),
                                   m.problem.bearings(Eigen::all, rest), seen, search);
  if (static_cast<int>(rival.inliers.size()) < search.min_inliers) return {};
  for (int& i : rival.inliers) i = rest[static_cast<std::size_t>(i)];
  rival.cost += static_cast<double>(m.problem.seen.count()) - static_cast<double>(rest.size());
  return rival;
}

std::string agreement(const RobustPose& found) {
  const auto agree = std::count(found.inliers.begin(), found.inliers.end(), true);
  return std::to_string(agree) + " of " + std::to_string(found.inliers.size()) + " points agree";
}

bool contradicts(const Fix& fix, const RobustPoseOptions& options) {
  constexpr double max_sigmas = 5;
  if (!options.up_in_cam) return false;
  const Eigen::Vector3d up = fix.cam_from_world.rotation.col(2);
  const Eigen::Vector3d across = up.cross(options.up_in_cam->normalized());
  const double angle = std::atan2(across.norm(), up.dot(*options.up_in_cam));
  const double fit2 = fix.covariance.topLeftCorner<3, 3>().trace();
  return angle > max_sigmas * std::sqrt(options.up_sigma_rad * options.up_sigma_rad + fit2);
}

// Probability of a pose with so many inliers beside another, if each is equally likely to explain a
// point: their difference is normal with the variance of the sum.
double share_of(std::size_t inliers, std::size_t of_other) {
  const auto a = static_cast<double>(inliers), b = static_cast<double>(of_other);
  const double ratio = std::exp(-0.5 * square(a - b) / (a + b));
  return a < b ? ratio / (1 + ratio) : 1 / (1 + ratio);
}

// Appends the candidates of a second fix that is right with the probability `share`.
void append(const Fix& other, double share, Fix& fix) {
  const auto scale = [](std::vector<Candidate>& candidates, std::size_t first, double factor) {
    for (std::size_t i = first; i < candidates.size(); ++i)
      candidates[i].probability = factor * candidates[i].probability.value_or(1);
  };
  scale(fix.candidates, 0, 1 - share);
  const std::size_t first = fix.candidates.size();
  fix.candidates.insert(fix.candidates.end(), other.candidates.begin(), other.candidates.end());
  scale(fix.candidates, first, share);
  fix.risk = 1 - *fix.candidates.front().probability;
}

// Adds the candidates of a second pose with about as many inliers: a part of the points may have
// moved, or may repeat another part.
void add_rival(const Correspondences& m, const Consensus& first, const ConsensusOptions& search,
               Result<RobustPose>& result) {
  const Consensus rival = rival_of(m, first, search);
  if (static_cast<int>(rival.inliers.size()) < 3) return;
  const Result<Fix> fix = fix_of(m, rival);
  if ((!fix.ok() && fix.status != Status::ambiguous) || contradicts(*fix, m.options)) return;
  if (significance_of(m, rival, *fix).log_false_alarms > std::log(m.options.max_false_alarms))
    return;
  append(*fix, share_of(rival.inliers.size(), first.inliers.size()), result.value.fix);
  result.status = Status::ambiguous;
  result.message = agreement(*result) + ", and " + std::to_string(rival.inliers.size()) +
                   " other points agree with another pose";
}

void conclude(const RobustPoseOptions& options, bool confident, Result<RobustPose>& result) {
  Fix& fix = result.value.fix;
  fix.risk = std::min(1.0, fix.risk.value_or(0) + std::pow(10, result->log10_false_alarms));
  if (result->log10_false_alarms > std::log10(options.max_false_alarms)) {
    result.status = Status::no_pose;
    result.message = agreement(*result) + "; as many are expected by chance";
    fix.risk = 1;
  } else if (result.status != Status::degenerate && contradicts(result->fix, options)) {
    result.status = Status::no_pose;
    result.message = agreement(*result) + ", with a pose that contradicts up_in_cam";
    fix.risk = 1;
  } else if (result.ok() && !confident) {
    result.message = "stopped after max_iterations = " + std::to_string(options.max_iterations) +
                     ", before the confidence was reached";
  }
}

void conclude_fit(const Correspondences& m, const Consensus& consensus,
                  const ConsensusOptions& search, Result<RobustPose>& result) {
  const Result<Fix> fix = fix_of(m, consensus);
  result.value.fix = *fix;
  result.status = fix.status;
  result.message = fix.message;
  const Significance found = significance_of(m, consensus, *fix);
  result.value.log10_false_alarms = found.log_false_alarms / std::log(10.0);
  const double gate_px = m.options.gate_sigmas * m.options.sigma_px;
  const FalseAlarmModel chance =
      chance_anywhere(m.points_px, std::min(gate_px, found.radius_px), sample_size(m.options),
                      poses_per_sample(m.options));
  const double sigmas =
      focal_px(m.camera) / (m.options.sigma_px * consensus.pose.translation.norm());
  if (rests_on_a_line(m.problem.points, consensus.inliers, sigmas, chance,
                      m.options.max_false_alarms)) {
    result.status = Status::degenerate;
    result.message = agreement(*result) +
                     ", nearly all collinear: the rotation about their line is not determined";
  } else if ((result.ok() || result.status == Status::ambiguous) &&
             found.log_false_alarms <= std::log(m.options.max_false_alarms)) {
    add_rival(m, consensus, search, result);
  }
}

}  // namespace

void RobustPoseOptions::validate() const {
  require(sigma_px > 0 && std::isfinite(sigma_px), "sigma_px", sigma_px, "positive");
  require(gate_sigmas >= 2 && std::isfinite(gate_sigmas), "gate_sigmas", gate_sigmas, "at least 2");
  require(confidence > 0 && confidence < 1, "confidence", confidence, "between 0 and 1");
  require(max_iterations > 0, "max_iterations", max_iterations, "positive");
  require(max_false_alarms > 0 && std::isfinite(max_false_alarms), "max_false_alarms",
          max_false_alarms, "positive");
  require(up_sigma_rad > 0 && std::isfinite(up_sigma_rad), "up_sigma_rad", up_sigma_rad,
          "positive");
  if (up_in_cam)
    require(std::abs(up_in_cam->norm() - 1) <= 1e-6, "up_in_cam", up_in_cam->transpose(), "unit");
}

Result<RobustPose> robust_pose(const Eigen::Matrix3Xd& points_in_world,
                               const Eigen::Matrix2Xd& points_px, const Camera& camera,
                               const RobustPoseOptions& options) {
  options.validate();
  const auto n = static_cast<int>(points_in_world.cols());
  require(points_px.cols() == n, "points_px", points_px.cols(), "one for each point in the world");
  require_finite(points_in_world, "points_in_world");
  require_finite(points_px, "points_px");
  const int sample = sample_size(options);
  Result<RobustPose> result;
  result.value.inliers.assign(static_cast<std::size_t>(n), false);
  if (n <= sample) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(n) + " points; a pose and its confirmation take " +
                     std::to_string(sample + 1);
    return result;
  }
  const Correspondences all{points_in_world, points_px, camera, options,
                            make_point_problem(points_in_world, points_px, camera,
                                               Eigen::VectorXd::Constant(1, options.sigma_px))};
  const PointProblem& problem = all.problem;
  if (on_a_line(problem, spread_triple(problem.points))) {
    result.status = Status::degenerate;
    result.message = "the points coincide or lie on a line";
    return result;
  }
  const ConsensusOptions search = search_options(options, camera, points_px);
  const Consensus consensus =
      find_consensus(problem.points, problem.bearings, problem.seen, search);
  for (const int i : consensus.inliers) result.value.inliers[i] = true;
  const auto agree = static_cast<int>(consensus.inliers.size());
  result.value.inlier_ratio = static_cast<double>(agree) / n;
  result.value.iterations = consensus.iterations;
  if (agree >= 3) conclude_fit(all, consensus, search, result);
  conclude(options, consensus.confident, result);
  return result;
}

}  // namespace occ
