// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/triangle.hpp"
//
#include <Eigen/Dense>
#include <array>
#include <cmath>

namespace occ {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr int samples = 128;       // of the angle searched over, on each of two branches
constexpr int most_steps = 100;    // of a bracket's refinement
constexpr double touching = 1e-4;  // of the squared side: a minimum this near to zero is a root

// The camera's centre O, a corner C and another corner A: `view` is the angle COA, `side` = |CA|.
struct Wedge {
  double view, side;

  // With the triangle's angle at A: |OC|, |OA| and their difference, which keeps its digits at
  // narrow views.
  double to_corner(double angle) const { return side * std::sin(angle) / std::sin(view); }
  double to_other(double angle) const { return side * std::sin(angle + view) / std::sin(view); }
  double other_minus_corner(double angle) const {
    return side * std::cos(angle + view / 2) / std::cos(view / 2);
  }
};

// Wedge `a` is that whose |OC| is bounded more tightly, so that every angle of it leaves both
// branches of the other.
struct Search {
  Wedge a, b;
  double chord2, side2;  // squared, between the bearings and the points A and B
  double reach;          // sin of the angle at B over sin of that at A, at most 1

  double other_angle(double angle, bool obtuse) const {
    const double acute = std::asin(std::min(1.0, reach * std::sin(angle)));
    return obtuse ? pi - acute : acute;
  }
  // (|AB|^2 as it follows from the angle) / (as it is) - 1.
  double misfit(double angle, bool obtuse) const {
    const double angle_b = other_angle(angle, obtuse);
    const double step = a.other_minus_corner(angle) - b.other_minus_corner(angle_b);
    return (step * step + a.to_other(angle) * b.to_other(angle_b) * chord2) / side2 - 1;
  }
};

double angle_between(const Eigen::Vector3d& f, const Eigen::Vector3d& g) {
  return 2 * std::atan2((f - g).norm(), (f + g).norm());
}

// Between two angles whose misfits have opposite signs: false position with halving of a stale end
// (Dowell and Jarratt's "Illinois" rule).
double root_between(const Search& search, bool obtuse, double low, double high) {
  double at_low = search.misfit(low, obtuse), at_high = search.misfit(high, obtuse);
  int stale = 0;  // end that has not moved
  double angle = low;
  for (int step = 0; step < most_steps; ++step) {
    angle = (low * at_high - high * at_low) / (at_high - at_low);
    if (!(angle > low && angle < high)) angle = 0.5 * (low + high);
    if (angle == low || angle == high) break;
    const double at = search.misfit(angle, obtuse);
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

// Angle of the least |misfit| between two of equal sign, by the golden section; stops early when
// the sign changes.
double lowest_between(const Search& search, bool obtuse, double low, double high, double sign) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = sign * search.misfit(left, obtuse),
         at_right = sign * search.misfit(right, obtuse);
  for (int step = 0; step < most_steps && high - low > 1e-12; ++step) {
    if (at_left < 0) return left;
    if (at_right < 0) return right;
    if (at_left < at_right) {
      high = right, right = left, at_right = at_left;
      left = high - golden * (high - low);
      at_left = sign * search.misfit(left, obtuse);
    } else {
      low = left, left = right, at_left = at_right;
      right = low + golden * (high - low);
      at_right = sign * search.misfit(right, obtuse);
    }
  }
  return 0.5 * (low + high);
}

void add_angles(const Search& search, bool obtuse, std::vector<double>& angles) {
  std::array<double, samples + 1> angle, misfit;
  for (std::size_t i = 0; i <= samples; ++i) {  // denser at the ends, where a depth goes to zero
    angle[i] = (pi - search.a.view) * 0.5 * (1 - std::cos(pi * static_cast<double>(i) / samples));
    misfit[i] = search.misfit(angle[i], obtuse);
  }
  for (std::size_t i = 0; i < samples; ++i)
    if ((misfit[i] < 0) != (misfit[i + 1] < 0))
      angles.push_back(root_between(search, obtuse, angle[i], angle[i + 1]));
  for (std::size_t i = 1; i < samples; ++i) {
    const double sign = misfit[i] < 0 ? -1 : 1;
    const double here = sign * misfit[i], before = sign * misfit[i - 1],
                 after = sign * misfit[i + 1];
    if (here > before || here > after || before < 0 || after < 0) continue;
    const double lowest = lowest_between(search, obtuse, angle[i - 1], angle[i + 1], sign);
    const double at = sign * search.misfit(lowest, obtuse);
    if (at < 0) {  // two roots between the samples
      angles.push_back(root_between(search, obtuse, angle[i - 1], lowest));
      angles.push_back(root_between(search, obtuse, lowest, angle[i + 1]));
    } else if (at < touching) {
      angles.push_back(lowest);
    }
  }
}

Eigen::Matrix3d frame(const Eigen::Matrix3d& corners) {
  Eigen::Matrix3d axes;
  axes.col(0) = (corners.col(1) - corners.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(corners.col(2) - corners.col(0)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Rigid3 pose_of(const PoseProblem& problem, const Eigen::Matrix3d& in_cam) {
  Rigid3 pose;
  pose.rotation = frame(in_cam) * frame(problem.points).transpose();
  pose.translation = in_cam.rowwise().mean() - pose.rotation * problem.points.rowwise().mean();
  return pose;
}

}  // namespace

void solve_triangle(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  if (problem.size() < 3) return;
  const auto view = [&](int i, int j) {
    return angle_between(problem.bearings.col(i), problem.bearings.col(j));
  };
  const auto side = [&](int i, int j) {
    return (problem.points.col(i) - problem.points.col(j)).norm();
  };
  // C is opposite to the narrowest view: both of its own are divided by.
  int c = 2;
  for (int k = 0; k < 3; ++k)
    if (view((k + 1) % 3, (k + 2) % 3) < view((c + 1) % 3, (c + 2) % 3)) c = k;
  int a = (c + 1) % 3, b = (c + 2) % 3;
  const auto bound = [&](int k) { return side(c, k) / std::sin(view(c, k)); };
  if (bound(b) < bound(a)) std::swap(a, b);
  const Search search{{view(c, a), side(c, a)},
                      {view(c, b), side(c, b)},
                      (problem.bearings.col(a) - problem.bearings.col(b)).squaredNorm(),
                      side(a, b) * side(a, b),
                      bound(a) / bound(b)};
  if (!(search.a.view > 0 && search.b.view > 0 && search.side2 > 0 && search.reach > 0)) return;
  for (const bool obtuse : {false, true}) {
    std::vector<double> angles;
    add_angles(search, obtuse, angles);
    for (const double angle : angles) {
      Eigen::Vector3d depths;
      depths[c] = search.a.to_corner(angle);
      depths[a] = search.a.to_other(angle);
      depths[b] = search.b.to_other(search.other_angle(angle, obtuse));
      if (depths.minCoeff() > 0)
        candidates.push_back(pose_of(problem, problem.bearings * depths.asDiagonal()));
    }
  }
}

}  // namespace occ
