// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/circle_outline.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int ellipse_unknowns = 5;  // centre, and three elements of S
using Vector5 = Eigen::Matrix<double, ellipse_unknowns, 1>;
using Matrix5 = Eigen::Matrix<double, ellipse_unknowns, ellipse_unknowns>;

constexpr double outline_step_px = 0.25;  // sampling distance of a profile

/// Offset of the edge from the middle of a profile that runs from inside to outside.
std::optional<double> edge_offset(const GreyImage& grey, const Vector2d& at, const Vector2d& normal,
                                  double reach_px) {
  const int half = static_cast<int>(reach_px / outline_step_px);
  std::vector<double> profile;
  for (int i = -half; i <= half; ++i) {
    const Vector2d p = at + i * outline_step_px * normal;
    if (!grey.holds(p)) return std::nullopt;
    profile.push_back(grey.at(p));
  }
  const std::size_t n = profile.size(), ends = std::max<std::size_t>(2, n / 8);
  double low = 0, high = 0, sum = 0;
  for (std::size_t i = 0; i < ends; ++i) {
    low += profile[i] / static_cast<double>(ends);
    high += profile[n - 1 - i] / static_cast<double>(ends);
  }
  constexpr double min_contrast = 2;  // grey levels; find_ellipses() needs 1.5
  if (!(std::abs(high - low) > min_contrast)) return std::nullopt;
  // Trapezoidal rule: the ends have half the weight.
  for (std::size_t i = 0; i < n; ++i)
    sum += (i == 0 || i == n - 1 ? 0.5 : 1) * (profile[i] - low) / (high - low);
  const double offset = outline_step_px * (0.5 * static_cast<double>(n - 1) - sum);
  if (!(std::abs(offset) < reach_px)) return std::nullopt;
  return offset;
}

/// An edge: its offset across the ellipse, and the derivatives of the ellipse by its unknowns.
struct OutlineEdge {
  double offset = 0;
  Vector5 derivatives;
  bool used = false;
};

/// Edges around the ellipse, about one per pixel of its outline.
std::vector<OutlineEdge> edges_of(const GreyImage& grey, double reach_px,
                                  const EllipseOutline& outline) {
  constexpr int min_edges = 16, max_edges = 120;
  const double round_px = pi * outline.shape.trace();  // about the length of the outline
  const int count = std::clamp(static_cast<int>(round_px), min_edges, max_edges);
  const Matrix2d inverse = outline.shape.inverse();
  std::vector<OutlineEdge> edges;
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * pi * k / count;
    const Vector2d u(std::cos(angle), std::sin(angle));
    const Vector2d normal = (inverse * u).normalized();
    OutlineEdge edge;
    edge.derivatives << normal, normal.x() * u.x(), normal.x() * u.y() + normal.y() * u.x(),
        normal.y() * u.y();
    const auto offset = edge_offset(grey, outline.centre_px + outline.shape * u, normal, reach_px);
    edge.used = offset.has_value();
    edge.offset = offset.value_or(0);
    edges.push_back(edge);
  }
  return edges;
}

/// Moves the ellipse to the edges. False if they do not determine it.
bool move_to_edges(const std::vector<OutlineEdge>& edges, EllipseOutline& outline) {
  constexpr double min_part = 0.75;  // of the outline; the rest may be hidden or in glare
  Matrix5 information = Matrix5::Zero();
  Vector5 gradient = Vector5::Zero();
  std::size_t used = 0;
  for (const OutlineEdge& edge : edges) {
    if (!edge.used) continue;
    ++used;
    information += edge.derivatives * edge.derivatives.transpose();
    gradient += edge.offset * edge.derivatives;
  }
  if (!(static_cast<double>(used) >= min_part * static_cast<double>(edges.size()))) return false;
  const Matrix5 cofactors = core::inverse(information);
  const Vector5 step = cofactors * gradient;
  if (!step.allFinite()) return false;
  outline.centre_px += step.head<2>();
  outline.shape(0, 0) += step[2];
  outline.shape(0, 1) += step[3];
  outline.shape(1, 0) += step[3];
  outline.shape(1, 1) += step[4];
  outline.cofactors = cofactors.topLeftCorner<2, 2>();
  outline.residuals.clear();
  for (const OutlineEdge& edge : edges)
    outline.residuals.push_back(edge.used ? edge.offset - edge.derivatives.dot(step) : 0);
  return outline.shape.determinant() > 0 && outline.shape.trace() > 0;
}

/// Excludes edges that are farther from the ellipse than the others.
int exclude_outliers(std::vector<OutlineEdge>& edges, const std::vector<double>& residuals) {
  constexpr double gate = 4, normal_median = 0.6745, min_sigma_px = 0.01;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (edges[i].used) sizes.push_back(std::abs(residuals[i]));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double limit_px = gate * std::max(*middle / normal_median, min_sigma_px);
  int outliers = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!edges[i].used || std::abs(residuals[i]) <= limit_px) continue;
    edges[i].used = false;
    ++outliers;
  }
  return outliers;
}

constexpr std::size_t max_edge_lag = 4;  // pixels along the outline

/// Sum of the correlations of the residuals over all lags, pooled over the discs; at least 1.
double correlation_sum(const std::vector<EllipseOutline>& outlines) {
  double variance = 0, sum = 0;
  for (const EllipseOutline& outline : outlines) {
    const std::vector<double>& e = outline.residuals;
    for (std::size_t i = 0; i < e.size(); ++i) {
      variance += e[i] * e[i];
      for (std::size_t lag = 1; lag <= max_edge_lag; ++lag) {
        // Bartlett's window, as in corner_fit.cpp.
        const double weight = 1 - static_cast<double>(lag) / (max_edge_lag + 1);
        sum += 2 * weight * e[i] * e[(i + lag) % e.size()];
      }
    }
  }
  return variance > 0 ? std::max(1.0, 1 + sum / variance) : 1;
}

}  // namespace

namespace {

/// True if the outline is that of an ellipse. The gaps between the discs of a dense grid are not.
bool is_elliptical(const EllipseOutline& outline, double minor_px) {
  constexpr double part = 0.05, noise_px = 0.15;
  double squared = 0, used = 0;
  for (const double residual : outline.residuals) {
    squared += residual * residual;
    used += residual != 0;
  }
  const double limit_px = part * minor_px + noise_px;
  return squared < used * limit_px * limit_px;
}

double minor_axis_px(const Matrix2d& shape) {
  const double half = 0.5 * shape.trace();
  return half - std::sqrt(std::max(0.0, half * half - shape.determinant()));
}

}  // namespace

bool fit_outline(const GreyImage& grey, double max_reach_px, EllipseOutline& outline) {
  constexpr int rounds = 4;  // profiles must be centred on the edges
  constexpr double min_reach_px = 1.25, part_of_axis = 0.7;
  const EllipseOutline start = outline;
  for (int i = 0; i < rounds; ++i) {
    const double reach_px = std::min(max_reach_px, part_of_axis * minor_axis_px(outline.shape));
    std::vector<OutlineEdge> edges = edges_of(grey, std::max(reach_px, min_reach_px), outline);
    EllipseOutline first = outline;
    if (!move_to_edges(edges, first)) return false;
    const int outliers = exclude_outliers(edges, first.residuals);
    if (!move_to_edges(edges, outline)) return false;
    outline.outliers = outliers;
  }
  const double size_px = 0.5 * start.shape.trace();
  return is_elliptical(outline, minor_axis_px(outline.shape)) &&
         (outline.centre_px - start.centre_px).norm() < 0.5 * size_px &&
         outline.shape.trace() < 3 * size_px && outline.shape.trace() > 1.2 * size_px;
}

std::vector<Matrix2d> centre_covariances(const std::vector<EllipseOutline>& outlines) {
  constexpr double min_variance_px2 = 0.003 * 0.003;  // interpolation of the profiles
  const double correlation = correlation_sum(outlines);
  std::vector<Matrix2d> covariances;
  for (const EllipseOutline& outline : outlines) {
    double squared = 0, used = 0;
    for (const double residual : outline.residuals) {
      squared += residual * residual;
      used += residual != 0;
    }
    const double variance = squared / std::max(1.0, used - ellipse_unknowns);
    covariances.push_back(correlation * std::max(variance, min_variance_px2) * outline.cofactors);
  }
  return covariances;
}

}  // namespace occ::internal::landmarks
