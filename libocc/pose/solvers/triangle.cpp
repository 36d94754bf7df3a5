// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/triangle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/math.hpp"

namespace occ {
namespace {

constexpr int samples = 128;            // samples of the searched angle on each of two branches
constexpr double same_root = 1e-8;      // closer angles [rad] are one root
constexpr int max_bracket_steps = 100;  // limit of a bracket's refinement; bisection needs 55
constexpr double max_bend = 0.05;       // twice the spacing of the samples [rad]
constexpr double flat = 0.02;           // two more roots may be near a root with such small misfits
constexpr double touching = 1e-4;       // a minimum below this share of the squared side is a root

// The camera's centre O, a corner C and another corner A: `view` is the angle COA, `side` = |CA|.
struct Wedge {
  double view, side;

  // |OC|, |OA| and their difference from the triangle's angle at A. The last formula avoids
  // cancellation at narrow views.
  double to_corner(double angle) const { return side * std::sin(angle) / std::sin(view); }
  double to_other(double angle) const { return side * std::sin(angle + view) / std::sin(view); }
  double other_minus_corner(double angle) const {
    return side * std::cos(angle + view / 2) / std::cos(view / 2);
  }
};

// Wedge `a` has the tighter bound of |OC|, so that both branches of wedge `b` exist for each of its
// angles.
struct Search {
  int corner, to_a, to_b;  // columns of the problem
  Wedge a, b;
  double chord2, side2;  // squared, between the bearings and the points A and B
  double reach;          // sin of the angle at B over sin of that at A, at most 1

  double narrowest_view() const { return std::min(a.view, b.view); }
  double other_angle(double angle, bool obtuse) const {
    const double acute = std::asin(std::min(1.0, reach * std::sin(angle)));
    return obtuse ? pi - acute : acute;
  }
  // (|AB|^2 computed from the angle) / (true |AB|^2) - 1.
  double misfit(double angle, bool obtuse) const {
    const double angle_b = other_angle(angle, obtuse);
    const double step = a.other_minus_corner(angle) - b.other_minus_corner(angle_b);
    return (step * step + a.to_other(angle) * b.to_other(angle_b) * chord2) / side2 - 1;
  }
};

double angle_between(const Eigen::Vector3d& f, const Eigen::Vector3d& g) {
  return 2 * std::atan2((f - g).norm(), (f + g).norm());
}

Search make_search(const PoseProblem& problem, int corner) {
  const auto wedge = [&](int other) -> Wedge {
    return {angle_between(problem.bearings.col(corner), problem.bearings.col(other)),
            (problem.points.col(corner) - problem.points.col(other)).norm()};
  };
  int a = (corner + 1) % 3, b = (corner + 2) % 3;
  const auto bound = [&](int other) { return wedge(other).side / std::sin(wedge(other).view); };
  if (bound(b) < bound(a)) std::swap(a, b);
  return {corner,
          a,
          b,
          wedge(a),
          wedge(b),
          (problem.bearings.col(a) - problem.bearings.col(b)).squaredNorm(),
          (problem.points.col(a) - problem.points.col(b)).squaredNorm(),
          bound(a) / bound(b)};
}

// Chooses among the corners with views of at least half the maximum, because the views' sines are
// divided by. Of these it takes the corner whose two branches are farthest from touching; they
// touch with a kink when the reach is 1.
Search best_search(const PoseProblem& problem) {
  const std::array<Search, 3> searches = {make_search(problem, 0), make_search(problem, 1),
                                          make_search(problem, 2)};
  double widest = 0;
  for (const Search& search : searches) widest = std::max(widest, search.narrowest_view());
  const Search* best = nullptr;
  for (const Search& search : searches)
    if (search.narrowest_view() >= 0.5 * widest && (!best || search.reach < best->reach))
      best = &search;
  return best ? *best : searches[0];
}

// Root of f between two angles at which its signs differ: false position with halving of a stale
// end (Dowell and Jarratt's "Illinois" rule).
template <typename Function>
double root_between(const Function& f, double low, double high) {
  double at_low = f(low), at_high = f(high);
  int stale = 0;  // end that has not moved
  double angle = low;
  for (int step = 0; step < max_bracket_steps; ++step) {
    angle = (low * at_high - high * at_low) / (at_high - at_low);
    if (!(angle > low && angle < high)) angle = 0.5 * (low + high);
    if (angle == low || angle == high) break;
    const double at = f(angle);
    if (at == 0) break;
    if ((at < 0) == (at_low < 0)) {
      low = angle, at_low = at;
      if (stale == 1) at_high /= 2;
      stale = 1;
    } else {
      high = angle, at_high = at;
      if (stale == -1) at_low /= 2;
      stale = -1;
    }
  }
  return angle;
}

// Minimum of f between two angles by the golden section; stops at any angle where f is negative.
template <typename Function>
double minimum_between(const Function& f, double low, double high) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = f(left), at_right = f(right);
  for (int step = 0; step < max_bracket_steps && high - low > 1e-12; ++step) {
    if (at_left < 0) return left;
    if (at_right < 0) return right;
    if (at_left < at_right) {
      high = right, right = left, at_right = at_left;
      left = high - golden * (high - low);
      at_left = f(left);
    } else {
      low = left, left = right, at_left = at_right;
      right = low + golden * (high - low);
      at_right = f(right);
    }
  }
  return 0.5 * (low + high);
}

void add_angle(double angle, std::vector<double>& angles) {
  for (const double known : angles)
    if (std::abs(known - angle) < same_root) return;
  angles.push_back(angle);
}

// Adds two roots of f, or one where f almost touches zero, between angles at which f is positive.
template <typename Function>
void add_pair(const Function& f, double low, double high, std::vector<double>& angles) {
  const double lowest = minimum_between(f, low, high), at = f(lowest);
  if (at < 0) {
    add_angle(root_between(f, low, lowest), angles);
    add_angle(root_between(f, lowest, high), angles);
  } else if (at < touching) {
    add_angle(lowest, angles);
  }
}

// Samples are denser at the ends, where a depth goes to zero, and around a right angle, where a
// reach near 1 bends the branches.
std::vector<double> sample_angles(const Search& search) {
  const double end = pi - search.a.view;
  std::vector<double> angles;
  for (int i = 0; i <= samples; ++i) angles.push_back(end * 0.5 * (1 - std::cos(pi * i / samples)));
  const double bend = std::sqrt(std::max(1e-12, (1 - search.reach) * (1 + search.reach)));
  for (double off = bend / 4; off < max_bend; off *= 1.5)
    for (const double angle : {pi / 2 - off, pi / 2 + off})
      if (angle < end) angles.push_back(angle);
  std::sort(angles.begin(), angles.end());
  return angles;
}

void add_angles(const Search& search, bool obtuse, std::vector<double>& angles) {
  const auto misfit = [&](double angle) { return search.misfit(angle, obtuse); };
  const std::vector<double> angle = sample_angles(search);
  const std::size_t last = angle.size() - 1;
  std::vector<double> at;
  for (const double sample : angle) at.push_back(misfit(sample));
  for (std::size_t i = 0; i < last; ++i) {
    if ((at[i] < 0) == (at[i + 1] < 0)) continue;
    const double root = root_between(misfit, angle[i], angle[i + 1]);
    add_angle(root, angles);
    // Two more roots may be near it without a change of sign: roots of misfit / (angle - root).
    const std::size_t low = i > 2 ? i - 2 : 0, high = std::min(i + 3, last);
    if (std::min(std::abs(at[low]), std::abs(at[high])) > flat) continue;
    const double sign = at[i + 1] < 0 ? -1 : 1;
    add_pair([&](double x) { return sign * misfit(x) / (x - root); }, angle[low], angle[high],
             angles);
  }
  for (std::size_t i = 1; i < last; ++i) {
    const double sign = at[i] < 0 ? -1 : 1;
    const double here = sign * at[i], before = sign * at[i - 1], after = sign * at[i + 1];
    if (here > before || here > after || before < 0 || after < 0) continue;
    add_pair([&](double x) { return sign * misfit(x); }, angle[i - 1], angle[i + 1], angles);
  }
}

Eigen::Matrix3d frame(const Eigen::Matrix3d& corners) {
  Eigen::Matrix3d axes;
  axes.col(0) = (corners.col(1) - corners.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(corners.col(2) - corners.col(0)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Rigid3 pose_from_corners(const PoseProblem& problem, const Eigen::Matrix3d& in_cam) {
  Rigid3 pose;
  pose.rotation = frame(in_cam) * frame(problem.points).transpose();
  pose.translation = in_cam.rowwise().mean() - pose.rotation * problem.points.rowwise().mean();
  return pose;
}

void solve_triangle(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 3) return;
  const Search search = best_search(problem);
  if (!(search.narrowest_view() > 0 && search.side2 > 0 && search.reach > 0)) return;
  for (const bool obtuse : {false, true}) {
    std::vector<double> angles;
    add_angles(search, obtuse, angles);
    for (const double angle : angles) {
      Eigen::Vector3d depths;
      depths[search.corner] = search.a.to_corner(angle);
      depths[search.to_a] = search.a.to_other(angle);
      depths[search.to_b] = search.b.to_other(search.other_angle(angle, obtuse));
      if (depths.minCoeff() > 0)
        candidates.push_back(pose_from_corners(problem, problem.bearings * depths.asDiagonal()));
    }
  }
}

}  // namespace

constexpr Solver triangle_solver = {
    /*name=*/"triangle",
    /*min_points=*/3,
    /*max_points=*/3,
    /*max_candidates=*/8,
    Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/"takes 30 times as long as p3p_kneip",
    /*source=*/"DeMenthon, lecture \"Object pose from a single image\"",
    solve_triangle};

}  // namespace occ
