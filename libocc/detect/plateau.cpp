// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/plateau.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/plateau_sums.hpp"

namespace occ::internal::detect {
namespace {

// Fewer pixels than this leave a surface too free where it is carried on across the rim.
constexpr double clear_sigmas = 1.5;  // of blur inside the rim: 93 % of the light is there
constexpr int min_pixels = 4, plane_pixels = 30, paraboloid_pixels = 200;
// From here on the cubic terms of the light of a wide view move the centre by more than their own
// noise does, then those of higher degree.
constexpr int cubic_pixels = 15000, quintic_pixels = 40000;
constexpr double ring_hollow = 0.8;  // inner over outer size of the ring that bears a quintic
constexpr double min_visible = 0.5;  // of the ring; what is left of a lamp that the border cuts

constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2; }
constexpr int max_terms = terms_of(Plateau::max_degree);

struct Powers {
  int u, v;
};

/// 1, u, v, u^2, u v, v^2, u^3 ...
constexpr std::array<Powers, max_terms> powers_of_terms() {
  std::array<Powers, max_terms> out{};
  std::size_t k = 0;
  for (int degree = 0; degree <= Plateau::max_degree; ++degree)
    for (int v = 0; v <= degree; ++v) out[k++] = {degree - v, v};
  return out;
}
constexpr std::array<Powers, max_terms> term_powers = powers_of_terms();

using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_terms, 1>;
using TermsSquared = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_terms, max_terms>;

template <int Degree>
TermsSquared normal_matrix(const Sums<Degree>& sums, int used) {
  TermsSquared normal(used, used);
  for (int a = 0; a < used; ++a) {
    const Powers& i = term_powers[a];
    for (int b = 0; b < used; ++b) {
      const Powers& j = term_powers[b];
      normal(a, b) = sums.power[i.u + j.u][i.v + j.v];
    }
  }
  return normal;
}

template <int Degree>
Terms right_side(const Sums<Degree>& sums, int used) {
  Terms right(used);
  for (int a = 0; a < used; ++a) {
    const Powers& i = term_powers[a];
    right[a] = sums.signal[i.u][i.v];
  }
  return right;
}

/// How the terms add up along the part of the rim that is in view, `depth_px` inside: in the mean
/// level, and in the slope that fits the levels best.
class RimView {
 public:
  RimView(const Patch& patch, const FittedConic& conic, double depth_px, double scale, int used)
      : mean_(Terms::Zero(used)), by_place_(used, 2) {
    const Eigen::Matrix2d root = conic.shape.llt().matrixU();
    const Eigen::Matrix2d of_circle = root.inverse();
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    by_place_.setZero();
    for (int k = 0; k < points; ++k) {
      const double angle = 2 * pi * k / points;
      const Eigen::Vector2d edge = of_circle * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d at = edge - depth_px * (conic.shape * edge).normalized();
      const Eigen::Vector2d px = conic.centre + at;
      if (!patch.contains(static_cast<int>(px.x()), static_cast<int>(px.y()))) continue;
      const Terms terms = terms_at(at * scale, used);
      ++seen_;
      mean_ += terms;
      spread += at * at.transpose();
      by_place_ += terms * at.transpose();
    }
    if (empty()) return;
    mean_ /= seen_;
    by_place_ = by_place_ * spread.inverse();
  }

  bool empty() const { return seen_ < 3; }  ///< too few points to tell
  const Terms& mean() const { return mean_; }
  const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, max_terms, 2>& slope() const {
    return by_place_;
  }

 private:
  static constexpr int points = 16;

  /// Each degree's terms are those of the one before times u, and the last one times v.
  static Terms terms_at(const Eigen::Vector2d& uv, int used) {
    Terms out(used);
    out[0] = 1;
    for (int first = 0, count = 1; first + count < used; first += count++) {
      out.segment(first + count, count) = uv.x() * out.segment(first, count);
      out[first + 2 * count] = uv.y() * out[first + count - 1];
    }
    return out;
  }

  int seen_ = 0;
  Terms mean_;
  Eigen::Matrix<double, Eigen::Dynamic, 2, 0, max_terms, 2> by_place_;
};

}  // namespace

std::optional<Plateau> Plateau::fit(const Patch& patch, const FittedConic& conic, double blur_px) {
  const Ellipse ellipse = conic.ellipse();
  const double shrink = 1 - clear_sigmas * blur_px / ellipse.semi_minor_px;
  if (!(shrink > 0)) return std::nullopt;
  const double area = pi * ellipse.semi_major_px * ellipse.semi_minor_px * shrink * shrink;
  if (area < cubic_pixels) return fit_surface<2>(patch, conic, blur_px, shrink, 0);
  if (area < quintic_pixels) return fit_surface<3>(patch, conic, blur_px, shrink, 0);
  return fit_surface<5>(patch, conic, blur_px, shrink, ring_hollow);
}

template <int Degree>
std::optional<Plateau> Plateau::fit_surface(const Patch& patch, const FittedConic& conic,
                                            double blur_px, double shrink, double hollow) {
  Plateau plateau;
  plateau.centre_ = conic.centre;
  plateau.scale_ = 1 / conic.ellipse().semi_major_px;
  const Cover cover(conic, blur_px);
  Sums<Degree> sums;
  for_each_row(patch, conic, shrink, hollow, [&](int y, int x0, int x1) {
    const double dy = y - conic.centre.y();
    sums.add_row(patch.at(x0, y), x0 - conic.centre.x(), dy, x1 - x0 + 1, plateau.scale_, cover);
  });
  if (sums.pixels < min_pixels) return std::nullopt;
  const double ring =
      pi * (shrink * shrink - hollow * hollow) / std::sqrt(conic.shape.determinant());
  plateau.degree_ = Degree > 3 && sums.pixels < min_visible * ring ? 3
                    : Degree > 2                                   ? Degree
                    : sums.pixels < plane_pixels                   ? 0
                    : sums.pixels < paraboloid_pixels              ? 1
                                                                   : 2;
  const int used = terms_of(plateau.degree_);
  const Terms right = right_side(sums, used);
  const Eigen::LDLT<TermsSquared> solver(normal_matrix(sums, used));
  const Terms solution = solver.solve(right);
  for (int a = 0; a < used; ++a) {
    const Powers& p = term_powers[a];
    plateau.c_[p.u * (max_degree + 1) + p.v] = solution[a];
  }
  plateau.variance_ =
      std::max(0.0, sums.squares - solution.dot(right)) / std::max(1, sums.pixels - used);
  plateau.level_ = sums.signal[0][0] / sums.power[0][0];
  const RimView rim(patch, conic, level_depth * blur_px, plateau.scale_, used);
  if (rim.empty()) return plateau;
  plateau.rim_level_variance_ = rim.mean().dot(solver.solve(rim.mean()));
  if (plateau.degree_ > 0)
    plateau.gradient_covariance_ = rim.slope().transpose() * solver.solve(rim.slope());
  return plateau;
}

}  // namespace occ::internal::detect
