// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/tag_corners.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double min_reach_px = 1.2;  // min half length of a profile: the blur of an edge
constexpr double max_reach_px = 5;    // max half length
constexpr double ring_part = 0.85, blur_px = 0.8;  // usable part of a ring; blur of its edge
constexpr double step_px = 0.25;                   // sampling distance of a profile
constexpr double corner_px = 2.5;  // excluded at each end of a side: blur of the other side

/// Side bent by lens distortion: points origin + u half along + (a + b u + c u^2) normal, from
/// corner to corner for u from -1 to 1, with the cofactors of (a, b, c) for edges of unit variance.
struct Side {
  Vector2d origin, along, normal;
  double half_px = 0;
  Vector3d curve = Vector3d::Zero();
  Matrix3d cofactors = Matrix3d::Zero();
  std::optional<double> known_bend_px;  // offset of its middle from the line between its corners
  std::vector<Vector2d> edges;          // (u, across)
  double squared = 0;                   // sum of squared residuals of the edges

  static Vector3d powers(double u) { return {1, u, u * u}; }
  double off(const Vector2d& edge) const { return edge.y() - curve.dot(powers(edge.x())); }
};

/// Finds the position of a sharp step with the same integral as the profile; the levels on both
/// sides are those of the profile's ends. False for too little contrast.
bool edge_at(const std::vector<double>& profile, double& offset) {
  const std::size_t n = profile.size(), ends = std::max<std::size_t>(2, n / 8);
  double low = 0, high = 0, sum = 0;
  for (std::size_t i = 0; i < ends; ++i) {
    low += profile[i];
    high += profile[n - 1 - i];
  }
  low /= static_cast<double>(ends);
  high /= static_cast<double>(ends);
  constexpr double min_contrast = 8;  // grey levels
  if (!(std::abs(high - low) > min_contrast)) return false;
  // Trapezoidal rule: the ends have half the weight.
  for (std::size_t i = 0; i < n; ++i)
    sum += (i == 0 || i == n - 1 ? 0.5 : 1) * (profile[i] - low) / (high - low);
  offset = step_px * (0.5 * static_cast<double>(n - 1) - sum);
  return true;
}

/// Min distance of a profile from the corner, in units of its half length, for it not to cross the
/// other side. The profile is across the side from `corner` to `along`.
double lean(const Vector2d& corner, const Vector2d& along, const Vector2d& other) {
  const Vector2d one = (along - corner).normalized(), two = (other - corner).normalized();
  return std::abs(one.dot(two) / (one.x() * two.y() - one.y() * two.x()));
}

/// Finds the edges across side k, within reach_px of its current curve.
bool find_edges(const GreyImage& grey, const TagCorners& corners, std::size_t k, double reach_px,
                Side& side) {
  const double bend_px = side.known_bend_px ? -*side.known_bend_px : side.curve[2];
  const Vector2d a = corners.px[k], b = corners.px[(k + 1) % 4];
  const double length = (b - a).norm();
  const double begin = corner_px + lean(a, b, corners.px[(k + 3) % 4]) * reach_px;
  const double end = length - corner_px - lean(b, a, corners.px[(k + 2) % 4]) * reach_px;
  side.origin = 0.5 * (a + b);
  side.along = (b - a).normalized();
  side.normal = {-side.along.y(), side.along.x()};
  side.half_px = 0.5 * length;
  side.edges.clear();
  const int half = static_cast<int>(reach_px / step_px);
  std::vector<double> profile(static_cast<std::size_t>(2 * half + 1));
  for (double s = begin; s <= end; s += 1) {
    const double u = s / side.half_px - 1, bent = bend_px * (u * u - 1);
    const Vector2d at = a + s * side.along + bent * side.normal;
    bool inside = true;
    for (int i = -half; i <= half && inside; ++i) {
      const Vector2d px = at + i * step_px * side.normal;
      inside = grey.holds(px);
      if (inside) profile[i + half] = grey.at(px);
    }
    double offset = 0;
    if (!inside) return false;
    if (edge_at(profile, offset) && std::abs(offset) < reach_px)
      side.edges.push_back({u, bent + offset});
  }
  return true;
}

/// Joint fit of two opposite sides. Distortion gives them nearly the same curvature; its change
/// across the tag is of the next order. Unknowns: (a, b) of each side, the common bend, and half
/// the difference of the bends; the last two have priors.
class Pair {
 public:
  Pair(Side& one, Side& two) : sides_{&one, &two} {
    mean_px_ = one.half_px + two.half_px;
    // Sigmas of bend and difference for a side of 50 px; they grow with the 2nd and 3rd power.
    constexpr double usual_px = 50, bend_px = 0.25, difference_px = 0.06;
    const double size = mean_px_ / usual_px;
    bend_sigma_px_ = bend_px * size * size;
    difference_sigma_px_ = difference_px * size * size * size;
    if (!one.known_bend_px || !two.known_bend_px) return;
    constexpr double known_part = 0.05, known_px = 0.003;  // accuracy of a calibrated lens
    bend_sigma_px_ = difference_sigma_px_ =
        known_px +
        known_part * std::max(std::abs(*one.known_bend_px), std::abs(*two.known_bend_px));
  }

  /// Cross-cofactors of the curves of both sides.
  Matrix3d cross_cofactors() const { return selection(0) * cofactors_ * selection(1).transpose(); }

  /// Fits twice, because the weight of the priors depends on the variance of the edges.
  bool fit() {
    constexpr double usual_error_px = 0.03, min_error_px = 0.003;
    if (!fit(usual_error_px * usual_error_px)) return false;
    const double freedom = static_cast<double>(sides_[0]->edges.size() + sides_[1]->edges.size());
    const double variance = (sides_[0]->squared + sides_[1]->squared) / freedom;
    return fit(std::max(variance, min_error_px * min_error_px));
  }

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  /// Derivative of (a, b, c) of a side by the unknowns; the second side runs in the opposite
  /// direction.
  Eigen::Matrix<double, 3, 6> selection(int which) const {
    const double part = 2 * sides_[which]->half_px / mean_px_, scale = part * part;
    Eigen::Matrix<double, 3, 6> select = Eigen::Matrix<double, 3, 6>::Zero();
    select(0, 2 * which) = select(1, 2 * which + 1) = 1;
    select(2, 4) = which == 0 ? scale : -scale;
    select(2, 5) = scale;
    return select;
  }

  bool fit(double edge_variance) {
    constexpr std::size_t min_edges = 5;
    Matrix6 information = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    information(4, 4) = edge_variance / (bend_sigma_px_ * bend_sigma_px_);
    information(5, 5) = edge_variance / (difference_sigma_px_ * difference_sigma_px_);
    for (const int k : {0, 1}) {
      if (sides_[k]->edges.size() < min_edges) return false;
      const Eigen::Matrix<double, 3, 6> select = selection(k);
      Matrix3d sums = Matrix3d::Zero();
      Vector3d across = Vector3d::Zero();
      const double bend = sides_[k]->known_bend_px.value_or(0);
      for (const Vector2d& edge : sides_[k]->edges) {
        const Vector3d powers = Side::powers(edge.x());
        sums += powers * powers.transpose();
        across += (edge.y() - bend * (1 - powers[2])) * powers;
      }
      information += select.transpose() * sums * select;
      gradient += select.transpose() * across;
    }
    cofactors_ = core::inverse(information);
    const Vector6 found = cofactors_ * gradient;
    for (const int k : {0, 1}) {
      Side& side = *sides_[k];
      const Eigen::Matrix<double, 3, 6> select = selection(k);
      side.curve = select * found + side.known_bend_px.value_or(0) * Vector3d(1, 0, -1);
      side.cofactors = select * cofactors_ * select.transpose();
      side.squared = 0;
      for (const Vector2d& edge : side.edges) side.squared += side.off(edge) * side.off(edge);
    }
    return true;
  }

  Side* sides_[2];
  Matrix6 cofactors_ = Matrix6::Zero();
  double mean_px_ = 0, bend_sigma_px_ = 0, difference_sigma_px_ = 0;
};

bool fit_pair(Side& one, Side& two, Matrix3d& cross_cofactors) {
  if (!Pair(one, two).fit()) return false;
  for (Side* side : {&one, &two}) {
    const double gate = 2.5 * std::sqrt(side->squared / static_cast<double>(side->edges.size()));
    side->edges.erase(
        std::remove_if(side->edges.begin(), side->edges.end(),
                       [&](const Vector2d& edge) { return std::abs(side->off(edge)) > gate; }),
        side->edges.end());
  }
  Pair pair(one, two);
  const bool fits = pair.fit();
  cross_cofactors = pair.cross_cofactors();
  return fits;
}

/// Intersection of two sides, by Newton's method, with its derivatives by their curves (a, b, c).
struct Meeting {
  Vector2d px;
  Eigen::Matrix<double, 2, 3> by_one, by_two;
};

bool meet(const Side& one, const Side& two, Meeting& meeting) {
  constexpr double min_sine = 0.05;
  constexpr int steps = 4;
  const Side* sides[2] = {&one, &two};
  Matrix2d slopes;
  Vector3d powers[2];
  for (int i = 0; i < steps; ++i) {
    Vector2d off;
    for (int k = 0; k < 2; ++k) {
      const Side& side = *sides[k];
      const double u = side.along.dot(meeting.px - side.origin) / side.half_px;
      const double slope = (side.curve[1] + 2 * side.curve[2] * u) / side.half_px;
      off[k] = side.off({u, side.normal.dot(meeting.px - side.origin)});
      slopes.row(k) = side.normal - slope * side.along;
      powers[k] = Side::powers(u);
    }
    if (!(std::abs(slopes.determinant()) > min_sine)) return false;
    meeting.px -= slopes.inverse() * off;
  }
  const Matrix2d inverse = slopes.inverse();
  meeting.by_one = inverse.col(0) * powers[0].transpose();
  meeting.by_two = inverse.col(1) * powers[1].transpose();
  return meeting.px.allFinite();
}

/// Computes all corners of a tag. Their errors are correlated, because they have sides in common;
/// the covariances are inflated so that the mean of the corners has its correct covariance.
/// `crosses`: cross-cofactors of sides 0 and 2, and of 1 and 3.
bool meet_all(const std::array<Side, 4>& sides, const Matrix3d (&crosses)[2], TagCorners& corners) {
  Eigen::Matrix<double, 12, 12> cofactors = Eigen::Matrix<double, 12, 12>::Zero();
  for (int k = 0; k < 4; ++k) cofactors.block<3, 3>(3 * k, 3 * k) = sides[k].cofactors;
  for (int k = 0; k < 2; ++k) {
    cofactors.block<3, 3>(3 * k, 3 * k + 6) = crosses[k];
    cofactors.block<3, 3>(3 * k + 6, 3 * k) = crosses[k].transpose();
  }
  Eigen::Matrix<double, 2, 12> of_mean = Eigen::Matrix<double, 2, 12>::Zero();
  double as_independent = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t before = (k + 3) % 4;
    Meeting meeting{corners.px[k], {}, {}};
    if (!meet(sides[before], sides[k], meeting)) return false;
    Eigen::Matrix<double, 2, 12> of_corner = Eigen::Matrix<double, 2, 12>::Zero();
    of_corner.middleCols<3>(static_cast<Eigen::Index>(3 * before)) = meeting.by_one;
    of_corner.middleCols<3>(static_cast<Eigen::Index>(3 * k)) = meeting.by_two;
    corners.px[k] = meeting.px;
    corners.covariance_px2[k] = of_corner * cofactors * of_corner.transpose();
    as_independent += corners.covariance_px2[k].trace() / 16;
    of_mean += of_corner / 4;
  }
  const double of_all = (of_mean * cofactors * of_mean.transpose()).trace();
  for (Matrix2d& covariance : corners.covariance_px2)
    covariance *= std::max(1.0, of_all / as_independent);
  return true;
}

/// Width of the uniform rings at a side.
double ring_px(const TagCorners& corners, std::size_t k, double border) {
  const Vector2d a = corners.px[k], along = (corners.px[(k + 1) % 4] - a).normalized();
  double height = std::numeric_limits<double>::infinity();
  for (const std::size_t other : {(k + 2) % 4, (k + 3) % 4}) {
    const Vector2d to = corners.px[other] - a;
    height = std::min(height, std::abs(along.x() * to.y() - along.y() * to.x()));
  }
  return border * height;
}

/// Model error of a corner: interpolation, and light from beyond narrow rings. Fitted to the errors
/// in rendered tags.
double model_sigma_px(double ring_px) { return 0.005 + 0.09 * std::exp(-ring_px * ring_px / 18); }

/// Effective variance of an edge, such that the mean of n edges has variance / n. Neighbouring
/// edges are correlated by noise and by interpolation, so it is estimated from means of four edges.
double edge_variance(const std::array<Side, 4>& sides) {
  constexpr std::size_t few = 4;
  constexpr double unknowns = 2.5 * 4;  // effective number for all sides
  constexpr double min_freedom = 8;
  double by_edges = 0, edges = -unknowns, by_means = 0, means = -unknowns;
  for (const Side& side : sides) {
    by_edges += side.squared;
    edges += static_cast<double>(side.edges.size());
    for (std::size_t i = 0; i + few <= side.edges.size(); i += few) {
      double sum = 0;
      for (std::size_t k = i; k < i + few; ++k) sum += side.off(side.edges[k]);
      by_means += sum * sum / few;
      means += 1;
    }
  }
  return means >= min_freedom ? by_means / means : by_edges / edges;
}

bool refine_once(const GreyImage& grey, double border, std::array<Side, 4>& sides,
                 TagCorners& corners) {
  double rings[4];
  for (std::size_t k = 0; k < 4; ++k) {
    rings[k] = ring_px(corners, k, border);
    // Usable part of the rings: their width minus the blur.
    const double reach_px = ring_part * std::min(rings[k], max_reach_px) - blur_px;
    if (!(reach_px >= min_reach_px) || !find_edges(grey, corners, k, reach_px, sides[k]))
      return false;
  }
  Matrix3d crosses[2];
  if (!fit_pair(sides[0], sides[2], crosses[0]) || !fit_pair(sides[1], sides[3], crosses[1]) ||
      !meet_all(sides, crosses, corners))
    return false;
  const double variance = edge_variance(sides);
  for (std::size_t k = 0; k < 4; ++k) {
    const double model = model_sigma_px(std::min(rings[k], rings[(k + 3) % 4]));
    corners.covariance_px2[k] =
        variance * corners.covariance_px2[k] + model * model * Matrix2d::Identity();
  }
  return true;
}

}  // namespace

bool refine_corners(const Image& image, double border, TagCorners& corners) {
  constexpr int rounds = 3;  // profiles must be centred on the edges
  const GreyImage grey(image);
  const TagCorners start = corners;
  std::array<Side, 4> sides;
  for (std::size_t k = 0; k < 4 && corners.bends_px; ++k)
    sides[k].known_bend_px = (*corners.bends_px)[k];
  for (int i = 0; i < rounds; ++i)
    if (!refine_once(grey, border, sides, corners)) return false;
  for (std::size_t k = 0; k < 4; ++k) {
    // Max change; includes the bias of libapriltag for bent sides.
    const double farthest_px = 1 + 0.02 * (start.px[(k + 1) % 4] - start.px[k]).norm();
    if (!((corners.px[k] - start.px[k]).norm() < farthest_px)) return false;
  }
  return true;
}

}  // namespace occ::internal::landmarks
