// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/covisibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace occ::internal::identify {
namespace {

using Eigen::Vector3d;

// Returns the displacement from a position to the nearest point of a cone; zero inside. The cone
// must not exceed a half space.
Vector3d displacement_into_cone(const MapPoint& map_point, const Vector3d& position) {
  const Vector3d v = position - map_point.centre;
  const double along = map_point.normal.dot(v), distance = v.norm();
  if (along >= map_point.cone_cos * distance) return Vector3d::Zero();
  const Vector3d across = v - along * map_point.normal;
  const double off = across.norm(), cosine = map_point.cone_cos;
  const double sine = std::sqrt(1 - cosine * cosine);
  const double reach = cosine * along + sine * off;  // distance along the nearest ray of the cone
  if (!(reach > 0)) return -v;                       // the apex is nearest
  return reach * (cosine * map_point.normal + (sine / off) * across) - v;
}

}  // namespace

// Minimises half the sum of squared distances to the cones, which is convex, by gradient descent
// with the mean displacement (relaxation factor 1.8 of the stable range 0 to 2).
//
// Certificate of emptiness: a position x inside all cones satisfies d_i . (x - position) >= |d_i|^2
// for each displacement d_i, hence sum d_i . (x - position) >= sum |d_i|^2. This is impossible for
// all x within `farthest` once sum |d_i|^2 > |sum d_i| * (farthest + |position|).
bool are_covisible(const AssignmentProblem& problem, const std::vector<int>& map_points) {
  constexpr int max_steps = 300;
  constexpr double farthest = 1000, negligible = 1e-6;  // in units of the object's size
  std::vector<const MapPoint*> cones;
  Vector3d position = Vector3d::Zero();
  for (const int t : map_points)
    if (problem.map_point(t).cone_cos >= 0) {
      cones.push_back(&problem.map_point(t));
      position += 10 * problem.size_m * problem.map_point(t).normal;
    }
  for (int step = 0; step < max_steps; ++step) {
    Vector3d sum = Vector3d::Zero();
    double squares = 0;
    for (const MapPoint* cone : cones) {
      const Vector3d displacement = displacement_into_cone(*cone, position);
      sum += displacement;
      squares += displacement.squaredNorm();
    }
    if (squares <= std::pow(negligible * problem.size_m, 2)) return true;
    if (squares > sum.norm() * (farthest * problem.size_m + position.norm())) return false;
    position += 1.8 / static_cast<double>(cones.size()) * sum;
  }
  return true;
}

Covisibility::Covisibility(const AssignmentProblem& problem)
    : problem_(problem), count_(problem.map_points.size()) {
  if (problem.all_covisible) return;
  pairs_.assign(count_ * count_, 1);
  for (std::size_t a = 0; a < count_; ++a)
    for (std::size_t b = 0; b < a; ++b)
      pairs_[a * count_ + b] = pairs_[b * count_ + a] =
          are_covisible(problem, {static_cast<int>(a), static_cast<int>(b)});
  triples_.assign(count_ * (count_ - 1) * (count_ - 2) / 6, 0);
}

bool Covisibility::triple(int a, int b, int c) {
  if (all()) return true;
  if (!pair(a, b) || !pair(b, c) || !pair(a, c)) return false;
  std::array<int, 3> sorted{a, b, c};
  std::sort(sorted.begin(), sorted.end());
  const std::size_t i = sorted[0], j = sorted[1], k = sorted[2];
  char& state = triples_[k * (k - 1) * (k - 2) / 6 + j * (j - 1) / 2 + i];
  if (state == 0) state = are_covisible(problem_, {sorted[0], sorted[1], sorted[2]}) ? 1 : 2;
  return state == 1;
}

}  // namespace occ::internal::identify
