// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/robust_pose.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

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

ConsensusOptions search_options(const RobustPoseOptions& options, const Camera& camera,
                                const FalseAlarmModel& chance) {
  ConsensusOptions search;
  search.gate_sigmas = options.gate_sigmas;
  search.sample_sigmas = sample_noise * options.gate_sigmas;
  if (options.up_in_cam)
    search.sample_sigmas +=
        sample_noise * options.up_sigma_rad * focal_px(camera) / options.sigma_px;
  search.confidence = options.confidence;
  search.max_iterations = options.max_iterations;
  search.min_inliers = internal::pose::min_inliers(chance, options.max_false_alarms);
  search.seed = options.seed;
  if (options.up_in_cam) search.up_in_cam = options.up_in_cam->normalized();
  return search;
}

// Maximum-likelihood pose of the inliers, and all others that fit equally well.
Result<Fix> fix_of(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels,
                   const Camera& camera, const Consensus& consensus, const Rigid3& cam_from_world,
                   const RobustPoseOptions& options) {
  SolvePoseOptions solve;
  solve.sigma_px = options.sigma_px;
  const Eigen::Matrix3Xd those = points(Eigen::all, consensus.inliers);
  const Eigen::Matrix2Xd seen = pixels(Eigen::all, consensus.inliers);
  Result<Fix> fix = solve_pose(those, seen, camera, solve);
  const double gate2 = options.gate_sigmas * options.gate_sigmas;
  const auto left_out =
      static_cast<double>(points.cols()) - static_cast<double>(consensus.inliers.size());
  const double chi2 = gate2 * (consensus.cost - left_out);
  if (!fix->candidates.empty() && fix->candidates.front().chi2 <= chi2 * (1 + 1e-3) + 1e-3)
    return fix;
  solve.start = cam_from_world;
  return solve_pose(those, seen, camera, solve);
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

void conclude(const RobustPoseOptions& options, bool confident, Result<RobustPose>& result) {
  if (result->log10_false_alarms > std::log10(options.max_false_alarms)) {
    result.status = Status::no_pose;
    result.message = agreement(*result) + "; as many are expected by chance";
  } else if (result.status != Status::degenerate && contradicts(result->fix, options)) {
    result.status = Status::no_pose;
    result.message = agreement(*result) + ", with a pose that contradicts up_in_cam";
  } else if (result.ok() && !confident) {
    result.message = "stopped after max_iterations = " + std::to_string(options.max_iterations) +
                     ", before the confidence was reached";
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
  const bool upright = options.up_in_cam.has_value();
  const int sample = upright ? 2 : 3;
  Result<RobustPose> result;
  result.value.inliers.assign(static_cast<std::size_t>(n), false);
  if (n <= sample) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(n) + " points; a pose and its confirmation take " +
                     std::to_string(sample + 1);
    return result;
  }
  const PointProblem problem = make_point_problem(points_in_world, points_px, camera,
                                                  Eigen::VectorXd::Constant(1, options.sigma_px));
  if (on_a_line(problem, spread_triple(problem.points))) {
    result.status = Status::degenerate;
    result.message = "the points coincide or lie on a line";
    return result;
  }
  const double gate_px = options.gate_sigmas * options.sigma_px;
  const FalseAlarmModel chance = chance_anywhere(points_px, gate_px, sample, upright ? 2 : 4);
  const Consensus consensus = find_consensus(problem.points, problem.bearings, problem.seen,
                                             search_options(options, camera, chance));
  for (const int i : consensus.inliers) result.value.inliers[i] = true;
  const auto agree = static_cast<int>(consensus.inliers.size());
  result.value.inlier_ratio = static_cast<double>(agree) / n;
  result.value.iterations = consensus.iterations;
  if (agree >= 3) {
    result.value.log10_false_alarms =
        log_false_alarms(chance, points_px, gate_px, consensus.inliers) / std::log(10.0);
    const Result<Fix> fix = fix_of(points_in_world, points_px, camera, consensus,
                                   problem.frame.restored(consensus.pose), options);
    result.value.fix = *fix;
    result.status = fix.status;
    result.message = fix.message;
    const double sigmas = focal_px(camera) / (options.sigma_px * consensus.pose.translation.norm());
    if (rests_on_a_line(problem.points, consensus.inliers, sigmas, chance,
                        options.max_false_alarms)) {
      result.status = Status::degenerate;
      result.message = agreement(*result) +
                       ", nearly all collinear: the rotation about their line is not determined";
    }
  }
  conclude(options, consensus.confident, result);
  return result;
}

}  // namespace occ
