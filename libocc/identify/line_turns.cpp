// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/line_turns.hpp"

#include <array>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::identify {

using namespace internal::pose;

bool on_a_line(const AssignmentProblem& problem, const std::vector<Pair>& pairs, const Rigid3& pose,
               const std::vector<Match>& attached) {
  Eigen::Matrix3Xd centres(3, static_cast<Eigen::Index>(pairs.size() + attached.size()));
  Eigen::Index column = 0;
  double variance = 0;
  for (const Pair& pair : pairs) {
    centres.col(column++) = problem.target(pair.target).centre;
    variance += problem.sighting(pair.sighting).covariance.trace() / 2;
  }
  for (const Match& match : attached) centres.col(column++) = problem.target(match.lamp).centre;
  const double distance = (pose * Eigen::Vector3d(centres.rowwise().mean())).norm();
  const double sigma_rad = std::sqrt(variance / static_cast<double>(pairs.size()));
  return height_over_line(centres) < min_seen_height * sigma_rad * distance;
}

std::vector<Rigid3> turns_by_prior(const AssignmentProblem& problem, const Naming& naming,
                                   const Rigid3& pose) {
  constexpr std::size_t count = 72;  // the prior is smooth over 5 degrees
  constexpr double step_rad = 2 * pi / count;
  Eigen::Matrix3d ends;
  for (int i = 0; i < 3; ++i) ends.col(i) = problem.target(naming[i].target).centre;
  const Triple spread = spread_triple(ends);
  const Eigen::Vector3d on_line = ends.col(spread[0]);
  const Eigen::Vector3d along = (ends.col(spread[1]) - on_line).normalized();
  std::array<Rigid3, count> turned;
  std::array<double, count> chi2;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Matrix3d turn = so3_exp(static_cast<double>(i) * step_rad * along);
    turned[i] = pose * Rigid3{turn, on_line - turn * on_line};
    chi2[i] = problem.options->prior->chi2(problem.from_world(turned[i]));
  }
  std::vector<Rigid3> best;
  for (std::size_t i = 0; i < count; ++i)
    if (chi2[i] < chi2[(i + 1) % count] && chi2[i] <= chi2[(i + count - 1) % count])
      best.push_back(turned[i]);
  return best;
}

}  // namespace occ::internal::identify
