// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/grid_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Positions scaled to -1 to 1 per axis.
Eigen::Matrix2Xd normalised(const Eigen::Matrix2Xd& at) {
  const Eigen::Vector2d low = at.rowwise().minCoeff(), high = at.rowwise().maxCoeff();
  const Eigen::Vector2d scale = 2 * (high - low).cwiseInverse();
  return (scale.asDiagonal() * (at.colwise() - low)).array() - 1;
}

/// Number of different values.
int value_count(const Eigen::RowVectorXd& values) {
  std::vector<double> sorted(values.data(), values.data() + values.size());
  std::sort(sorted.begin(), sorted.end());
  constexpr double same = 1e-6;  // of the range
  int count = 1;
  for (std::size_t i = 1; i < sorted.size(); ++i) count += sorted[i] - sorted[i - 1] > same;
  return count;
}

/// Homography of the positions by linear least squares (Hartley, Zisserman, "Multiple view
/// geometry", 2nd edition, section 4.1.2, with h_33 = 1): their images.
Eigen::Matrix2Xd by_homography(const Eigen::Matrix2Xd& at, const Eigen::Matrix2Xd& px) {
  const Index n = at.cols();
  MatrixXd a = MatrixXd::Zero(2 * n, 8);
  VectorXd b(2 * n);
  for (Index i = 0; i < n; ++i)
    for (const Index axis : {0, 1}) {
      const Index row = 2 * i + axis;
      a.block<1, 2>(row, 3 * axis) = at.col(i).transpose();
      a(row, 3 * axis + 2) = 1;
      a.block<1, 2>(row, 6) = -px(axis, i) * at.col(i).transpose();
      b[row] = px(axis, i);
    }
  const VectorXd h = core::solve_pivoted_qr(a, b);
  Eigen::Matrix2Xd image(2, n);
  for (Index i = 0; i < n; ++i) {
    const double depth = 1 + h.segment<2>(6).dot(at.col(i));
    for (const Index axis : {0, 1})
      image(axis, i) = (h.segment<2>(3 * axis).dot(at.col(i)) + h[3 * axis + 2]) / depth;
  }
  return image;
}

/// Monomials of the positions, of at most `degree`.
MatrixXd monomials(const Eigen::Matrix2Xd& at, int degree) {
  const int max_x = std::min(degree, value_count(at.row(0)) - 1);
  const int max_y = std::min(degree, value_count(at.row(1)) - 1);
  MatrixXd terms(at.cols(), (max_x + 1) * (max_y + 1));
  Index count = 0;
  Eigen::ArrayXd of_x = Eigen::ArrayXd::Ones(at.cols());
  for (int a = 0; a <= max_x; ++a) {
    Eigen::ArrayXd term = of_x;
    for (int b = 0; b <= std::min(max_y, degree - a); ++b) {
      terms.col(count++) = term;
      term *= at.row(1).transpose().array();
    }
    of_x *= at.row(0).transpose().array();
  }
  return terms.leftCols(count);
}

/// Removes the distortion of an equidistant fisheye lens: the radius r about the middle becomes
/// f tan(r / f). An infinite focal length changes nothing.
struct EquidistantLens {
  Eigen::Vector2d middle_px;
  double focal_px;

  Eigen::Vector2d straightened(const Eigen::Vector2d& px) const {
    const Eigen::Vector2d off = px - middle_px;
    const double r = off.norm();
    if (std::isinf(focal_px) || !(r > 0)) return px;
    return middle_px + focal_px * std::tan(r / focal_px) / r * off;
  }
  Eigen::Vector2d bent(const Eigen::Vector2d& px) const {
    const Eigen::Vector2d off = px - middle_px;
    const double r = off.norm();
    if (std::isinf(focal_px) || !(r > 0)) return px;
    return middle_px + focal_px * std::atan(r / focal_px) / r * off;
  }
};

/// Pixels minus those of the best homography through a lens.
Eigen::Matrix2Xd homography_residuals(const Eigen::Matrix2Xd& at, const Eigen::Matrix2Xd& px,
                                      const EquidistantLens& lens) {
  Eigen::Matrix2Xd straight(2, px.cols());
  for (Index i = 0; i < px.cols(); ++i) straight.col(i) = lens.straightened(px.col(i));
  const Eigen::Vector2d mean = straight.rowwise().mean();
  const double size = (straight.colwise() - mean).colwise().norm().maxCoeff();
  const Eigen::Matrix2Xd image = by_homography(at, (straight.colwise() - mean) / size);
  Eigen::Matrix2Xd off(2, px.cols());
  for (Index i = 0; i < px.cols(); ++i)
    off.col(i) = px.col(i) - lens.bent(size * image.col(i) + mean);
  return off;
}

/// Orthonormal bases of the polynomials of each degree for which the points suffice.
std::vector<MatrixXd> polynomial_bases(const Eigen::Matrix2Xd& at) {
  constexpr int min_degree = 3, max_degree = 7;
  std::vector<MatrixXd> bases;
  for (int degree = min_degree; degree <= max_degree; ++degree) {
    const MatrixXd terms = monomials(at, degree);
    // A quarter of the equations remain for the variance, with those of the homography.
    if (4 * (terms.cols() + 2) > 3 * at.cols()) break;
    bases.push_back(core::householder_q(terms, terms.cols()));
  }
  return bases;
}

/// Excess of the residuals about polynomials with the basis `q` over the covariances.
double excess_px2(const Eigen::Matrix2Xd& off, const MatrixXd& q,
                  const std::vector<Eigen::Matrix2d>& covariances) {
  const Eigen::Matrix2Xd residuals = off - (off * q) * q.transpose();
  double expected = 0, freedom = -2;
  for (Index i = 0; i < off.cols(); ++i) {
    const double redundancy = 1 - q.row(i).squaredNorm();
    expected += redundancy * covariances[static_cast<std::size_t>(i)].trace();
    freedom += 2 * redundancy;
  }
  expected *= freedom / (freedom + 2);  // two parameters of the homography
  return std::max(0.0, (residuals.squaredNorm() - expected) / freedom);
}

}  // namespace

double grid_scatter_px2(const Eigen::Matrix2Xd& positions, const Eigen::Matrix2Xd& px,
                        const std::vector<Eigen::Matrix2d>& covariances,
                        const Eigen::Vector2d& middle_px) {
  // Terms of a higher degree are for wide-angle lenses; otherwise they only add to the uncertainty
  // of the estimate. The same holds for the focal lengths.
  constexpr double max_ratio = 0.5;  // of the variances, to accept a higher degree
  const Eigen::Matrix2Xd at = normalised(positions);
  const std::vector<MatrixXd> bases = polynomial_bases(at);
  double best_px2 = infinity;
  const auto try_lens = [&](double focal_px) {
    const Eigen::Matrix2Xd off = homography_residuals(at, px, {middle_px, focal_px});
    if (!off.allFinite()) return false;
    for (const MatrixXd& q : bases) {
      const double px2 = excess_px2(off, q, covariances);
      if (!(px2 > max_ratio * best_px2)) best_px2 = px2;
    }
    return true;
  };
  if (!try_lens(infinity)) return 0;
  // The smallest focal length has the farthest point 75 degrees from the axis.
  constexpr double max_angle_rad = 1.3, focal_step = 1.12;
  constexpr int focal_lengths = 14;
  double focal_px = (px.colwise() - middle_px).colwise().norm().maxCoeff() / max_angle_rad;
  for (int i = 0; i < focal_lengths && best_px2 > 0; ++i, focal_px *= focal_step)
    try_lens(focal_px);
  return std::isfinite(best_px2) ? best_px2 : 0;
}

}  // namespace occ::internal::landmarks
