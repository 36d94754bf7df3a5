// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/seen_together.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace occ::internal::identify {
namespace {

using Eigen::Vector3d;

// From a place to the nearest one in a cone of at most the half space; zero inside.
Vector3d way_into_cone(const MapPoint& target, const Vector3d& place) {
  const Vector3d v = place - target.centre;
  const double along = target.normal.dot(v), distance = v.norm();
  if (along >= target.cone_cos * distance) return Vector3d::Zero();
  const Vector3d across = v - along * target.normal;
  const double off = across.norm(), cosine = target.cone_cos;
  const double sine = std::sqrt(1 - cosine * cosine);
  const double reach = cosine * along + sine * off;  // along the nearest ray of the cone
  if (!(reach > 0)) return -v;                       // the apex
  return reach * (cosine * target.normal + (sine / off) * across) - v;
}

}  // namespace

// Half the sum of the squared ways into all cones is convex, and descent by their mean converges.
// Where the ways d_i come to cancel, no place x is in all cones: each has d_i . (x - place) >=
// |d_i|^2, so that sum d_i . (x - place) >= sum |d_i|^2.
bool seen_together(const AssignmentProblem& problem, const std::vector<int>& targets) {
  constexpr int max_steps = 300;
  constexpr double farthest = 1000, negligible = 1e-6;  // of the object's size
  std::vector<const MapPoint*> cones;
  Vector3d place = Vector3d::Zero();
  for (const int t : targets)
    if (problem.target(t).cone_cos >= 0) {
      cones.push_back(&problem.target(t));
      place += 10 * problem.size_m * problem.target(t).normal;
    }
  for (int step = 0; step < max_steps; ++step) {
    Vector3d sum = Vector3d::Zero();
    double squares = 0;
    for (const MapPoint* cone : cones) {
      const Vector3d way = way_into_cone(*cone, place);
      sum += way;
      squares += way.squaredNorm();
    }
    if (squares <= std::pow(negligible * problem.size_m, 2)) return true;
    if (squares > sum.norm() * (farthest * problem.size_m + place.norm())) return false;
    place += 1.8 / static_cast<double>(cones.size()) * sum;
  }
  return true;
}

SeenTogether::SeenTogether(const AssignmentProblem& problem)
    : problem_(problem), count_(problem.targets.size()) {
  if (problem.all_together) return;
  pairs_.assign(count_ * count_, 1);
  for (std::size_t a = 0; a < count_; ++a)
    for (std::size_t b = 0; b < a; ++b)
      pairs_[a * count_ + b] = pairs_[b * count_ + a] =
          seen_together(problem, {static_cast<int>(a), static_cast<int>(b)});
  triples_.assign(count_ * (count_ - 1) * (count_ - 2) / 6, 0);
}

bool SeenTogether::triple(int a, int b, int c) {
  if (all()) return true;
  if (!pair(a, b) || !pair(b, c) || !pair(a, c)) return false;
  std::array<int, 3> sorted{a, b, c};
  std::sort(sorted.begin(), sorted.end());
  const auto i = static_cast<std::size_t>(sorted[0]), j = static_cast<std::size_t>(sorted[1]),
             k = static_cast<std::size_t>(sorted[2]);
  char& known = triples_[k * (k - 1) * (k - 2) / 6 + j * (j - 1) / 2 + i];
  if (known == 0) known = seen_together(problem_, {sorted[0], sorted[1], sorted[2]}) ? 1 : 2;
  return known == 1;
}

}  // namespace occ::internal::identify
