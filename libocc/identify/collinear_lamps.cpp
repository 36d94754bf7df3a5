// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::identify {

using namespace internal::pose;

bool appears_collinear(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                       const Rigid3& pose, const std::vector<Match>& attached) {
  Eigen::Matrix3Xd centres(3, static_cast<Eigen::Index>(pairs.size() + attached.size()));
  Eigen::Index column = 0;
  double variance = 0;
  for (const Pair& pair : pairs) {
    centres.col(column++) = problem.map_point(pair.map_point).centre;
    variance += problem.observation(pair.observation).covariance.trace() / 2;
  }
  for (const Match& match : attached) centres.col(column++) = problem.map_point(match.lamp).centre;
  const double distance = (pose * Eigen::Vector3d(centres.rowwise().mean())).norm();
  const double sigma_rad = std::sqrt(variance / static_cast<double>(pairs.size()));
  return height_over_line(centres) < min_seen_height * sigma_rad * distance;
}

std::vector<Rigid3> rotations_by_prior(const AssignmentProblem& problem,
                                       const Assignment& assignment, const Rigid3& pose) {
  constexpr std::size_t count = 72;  // 5 degrees, over which the prior varies little
  constexpr double step_rad = 2 * pi / count;
  Eigen::Matrix3d ends;
  for (int i = 0; i < 3; ++i) ends.col(i) = problem.map_point(assignment[i].map_point).centre;
  const Triple spread = spread_triple(ends);
  const Eigen::Vector3d on_line = ends.col(spread[0]);
  const Eigen::Vector3d along = (ends.col(spread[1]) - on_line).normalized();
  std::array<Rigid3, count> rotated;
  std::array<double, count> chi2;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Matrix3d rotation = so3_exp(static_cast<double>(i) * step_rad * along);
    rotated[i] = pose * Rigid3{rotation, on_line - rotation * on_line};
    chi2[i] = problem.options->prior->chi2(problem.from_world(rotated[i]));
  }
  std::vector<Rigid3> best;
  for (std::size_t i = 0; i < count; ++i)
    if (chi2[i] < chi2[(i + 1) % count] && chi2[i] <= chi2[(i + count - 1) % count])
      best.push_back(rotated[i]);
  return best;
}

}  // namespace occ::internal::identify
