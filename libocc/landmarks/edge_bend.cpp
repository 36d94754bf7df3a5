// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/edge_bend.hpp"

#include <cmath>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::landmarks {

using Eigen::Vector2d;

Vector2d edge_bend(const Vector2d& corner, const std::vector<Vector2d>& others) {
  constexpr std::size_t min_others = 2, min_for_cubic = 5;
  if (others.size() < min_others) return Vector2d::Zero();
  // The farthest point determines the direction, which need not be exact.
  Vector2d farthest = Vector2d::Zero();
  for (const Vector2d& px : others)
    if ((px - corner).norm() > farthest.norm()) farthest = px - corner;
  const double scale_px = farthest.norm();
  if (!(scale_px > 0)) return Vector2d::Zero();
  const Vector2d along = farthest / scale_px, normal(-along.y(), along.x());
  // A cubic term keeps the bend at the end of a line from being that of its middle.
  const Eigen::Index terms = others.size() < min_for_cubic ? 2 : 3;
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(others.size()), terms);
  Eigen::VectorXd across(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Vector2d off = others[static_cast<std::size_t>(i)] - corner;
    const double a = off.dot(along) / scale_px;
    rows(i, 0) = a;
    rows(i, 1) = 0.5 * a * a;
    if (terms > 2) rows(i, 2) = a * a * a;
    across[i] = off.dot(normal);
  }
  const Eigen::VectorXd curve = core::solve_pivoted_qr(rows, across);
  const Vector2d bend = curve[1] / (scale_px * scale_px) * normal;
  return bend.allFinite() ? bend : Vector2d::Zero();
}

}  // namespace occ::internal::landmarks
