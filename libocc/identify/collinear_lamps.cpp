// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::identify {

using namespace internal::pose;
namespace {

constexpr double max_row_height = 0.05;  // over the length of a row

/// True if the third of the points is nearer to the line through the others than `max_height`, in
/// units of their distance.
bool are_straight(const Eigen::Matrix3d& points, const Triple& spread, double max_height) {
  const Eigen::Vector3d along = points.col(spread[1]) - points.col(spread[0]);
  const Eigen::Vector3d arm = points.col(spread[2]) - points.col(spread[0]);
  return along.cross(arm).norm() < max_height * along.squaredNorm();
}

}  // namespace

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

std::vector<Rigid3> rotations_about_line(const AssignmentProblem& problem,
                                         const Assignment& assignment, const Rigid3& pose) {
  constexpr std::size_t count = 72;  // 5 degrees, over which the prior varies little
  constexpr std::size_t step_without_prior = 6;
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
  }
  std::vector<Rigid3> best;
  const auto& prior = problem.options->prior;
  if (!prior || prior->empty()) {
    for (std::size_t i = 0; i < count; i += step_without_prior) best.push_back(rotated[i]);
    return best;
  }
  for (std::size_t i = 0; i < count; ++i) chi2[i] = prior->chi2(problem.from_world(rotated[i]));
  for (std::size_t i = 0; i < count; ++i)
    if (chi2[i] < chi2[(i + 1) % count] && chi2[i] <= chi2[(i + count - 1) % count])
      best.push_back(rotated[i]);
  return best;
}

Eigen::Matrix3d off_their_line(const Eigen::Matrix3d& points) {
  constexpr double straight = 1e-9, height = 1e-6;  // over the distance of the outer points
  const Triple spread = spread_triple(points);
  if (!are_straight(points, spread, straight)) return points;
  const Eigen::Vector3d along = points.col(spread[1]) - points.col(spread[0]);
  Eigen::Matrix3d moved = points;
  moved.col(spread[2]) += height * along.norm() * along.unitOrthogonal();
  return moved;
}

bool appear_as_row(const AssignmentProblem& problem) {
  Eigen::Matrix3Xd bearings(3, static_cast<Eigen::Index>(problem.observations.size()));
  for (Eigen::Index i = 0; i < bearings.cols(); ++i)
    bearings.col(i) = problem.observation(static_cast<int>(i)).bearing.normalized();
  const Eigen::Vector3d extent = point_layout(bearings).extent;
  // The points of a curved line of bearings are in the plane of its chord and its middle.
  const Eigen::Vector3d normal =
      core::symmetric_eigen<Eigen::Matrix3d>(bearings * bearings.transpose()).eigenvectors().col(0);
  return (normal.transpose() * bearings).norm() < max_row_height * extent[0];
}

bool are_a_row(const AssignmentProblem& problem, int a, int b, int c) {
  Eigen::Matrix3d points;
  points << problem.map_point(a).centre, problem.map_point(b).centre, problem.map_point(c).centre;
  return are_straight(points, spread_triple(points), max_row_height);
}

}  // namespace occ::internal::identify
