// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/turned_discs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/prior_gate.hpp"

namespace occ::internal::identify {
namespace {

constexpr double turn_sigma_rad = 0.05;

/// The pose after a turn of the disc about its normal, which is known to `sigma_rad`.
LampPose turned(const LampPose& pose, const Eigen::Vector3d& normal, double angle_rad,
                double sigma_rad = turn_sigma_rad) {
  LampPose out = pose;
  out.pose.rotation = pose.pose.rotation * Eigen::AngleAxisd(angle_rad, normal).toRotationMatrix();
  const Eigen::Vector3d axis = pose.pose.rotation * normal;
  out.information.topLeftCorner<3, 3>() += axis * axis.transpose() / square(sigma_rad);
  return out;
}

constexpr int steps = 36;  // of a turn

/// Chi-square of the prior after each step of the turn.
std::array<double, steps> prior_over_turn(const AssignmentProblem& problem, const MapPoint& disc,
                                          const LampPose& pose) {
  constexpr double step_sigma_rad = 0.1;  // so that a step does not miss the minimum
  std::array<double, steps> chi2;
  for (int i = 0; i < steps; ++i)
    chi2[static_cast<std::size_t>(i)] = prior_chi2(
        problem,
        to_local(turned(pose, disc.normal, 2 * pi * i / steps, step_sigma_rad), disc.centre));
  return chi2;
}

void add_turns_of_prior(const AssignmentProblem& problem, const MapPoint& disc,
                        const LampPose& pose, std::vector<LampPose>& found) {
  constexpr double open_chi2 = 9, max_open = 1.0 / 3;
  if (!problem.options->prior || problem.options->prior->empty()) return;
  const std::array<double, steps> chi2 = prior_over_turn(problem, disc, pose);
  const double least = *std::min_element(chi2.begin(), chi2.end());
  const auto open = std::count_if(chi2.begin(), chi2.end(),
                                  [&](double value) { return value < least + open_chi2; });
  if (!(least <= max_prior_chi2) || static_cast<double>(open) > max_open * steps) return;
  for (std::size_t i = 0; i < steps; ++i) {
    const double before = chi2[(i + steps - 1) % steps], after = chi2[(i + 1) % steps];
    if (chi2[i] > max_prior_chi2 || chi2[i] > before || chi2[i] >= after) continue;
    // The minimum of the parabola through three values.
    const double bend = before + after - 2 * chi2[i];
    const double at = static_cast<double>(i) + (bend > 0 ? 0.5 * (before - after) / bend : 0);
    found.push_back(turned(pose, disc.normal, 2 * pi * at / steps));
  }
}

/// The turn that brings a lamp next to a bearing. The lamp moves on a circle about the disc's axis;
/// the ray through the bearing meets the circle's plane.
void add_turn_of_pair(const AssignmentProblem& problem, const MapPoint& disc, const LampPose& pose,
                      const Pair& other, std::vector<LampPose>& found) {
  constexpr double tolerance_rad = 0.15;  // the tilt of a small disc is uncertain
  const Eigen::Vector3d& bearing = problem.observation(other.observation).bearing;
  const Eigen::Vector3d from_disc = problem.map_point(other.map_point).centre - disc.centre;
  const double along = from_disc.dot(disc.normal);
  const Eigen::Matrix3d& rotation = pose.pose.rotation;
  const Eigen::Vector3d normal = rotation * disc.normal;
  const Eigen::Vector3d middle = pose.pose.translation + along * normal;
  const Eigen::Vector3d start = rotation * (from_disc - along * disc.normal);
  const double range = middle.dot(normal) / bearing.dot(normal);
  if (!(start.norm() > 0) || !(range > 0 && std::isfinite(range))) return;
  const Eigen::Vector3d hit = range * bearing - middle;
  const double angle = std::atan2(hit.dot(normal.cross(start)), hit.dot(start));
  const Eigen::Vector3d reached = middle + Eigen::AngleAxisd(angle, normal) * start;
  if (reached.normalized().dot(bearing) < std::cos(tolerance_rad)) return;
  found.push_back(turned(pose, disc.normal, angle));
}

}  // namespace

bool prior_permits_a_turn(const AssignmentProblem& problem, const MapPoint& disc,
                          const LampPose& pose) {
  const std::array<double, steps> chi2 = prior_over_turn(problem, disc, pose);
  return *std::min_element(chi2.begin(), chi2.end()) <= max_prior_chi2;
}

std::vector<LampPose> turned_poses(const AssignmentProblem& problem, const Pair& pair,
                                   const std::vector<LampPose>& poses) {
  constexpr int max_observations = 16;  // with more, a single one proves nothing
  std::vector<LampPose> found;
  const MapPoint& disc = problem.map_point(pair.map_point);
  const auto count = static_cast<int>(problem.observations.size());
  // Three lamps say more than two discs: if they gave no pose, for example because they are in a
  // row, two of them would only seem to.
  const bool has_three = count >= 3 && problem.map_points.size() >= 3;
  if (count > max_observations) return found;
  for (const LampPose& pose : poses) {
    add_turns_of_prior(problem, disc, pose, found);
    if (has_three) continue;
    for (int s = 0; s < count; ++s) {
      if (s == pair.observation) continue;
      for (const int t : problem.observation(s).lamps)
        if (t != pair.map_point) add_turn_of_pair(problem, disc, pose, {s, t}, found);
    }
  }
  return found;
}

}  // namespace occ::internal::identify
