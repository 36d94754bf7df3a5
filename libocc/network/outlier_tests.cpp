// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/outlier_tests.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/internal/minimise_network.hpp"
#include "libocc/network/internal/network_checks.hpp"
#include "libocc/network/internal/residual_cofactors.hpp"
#include "libocc/network/precision.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double min_redundancy = 1e-4;  // below it, the residual is numerical noise
/// The redundancy of the more accurate one of two distances is the ratio of their variances; it
/// may be the wrong one nevertheless. The residuals of distances and control points are accurate
/// enough.
constexpr double min_known_redundancy = 1e-9;

/// Variance of a residual over that of its observation; `factor`: of the images' sigmas.
double residual_variance(double redundancy, double factor) {
  return redundancy * (redundancy + factor * factor * (1 - redundancy));
}

/// Length that `dof` standard normal residuals exceed with the probability `tail`.
double critical_length(double tail, int dof) {
  return std::sqrt(gate_chi2(normal_quantile(1 - tail), dof));
}

OutlierCandidate test_control(const Network& network, const NetworkState& state, int index,
                              const Matrix3d& absorbed_m2, double factor, int& dof) {
  const ControlPoint& known = network.control[index];
  const core::Cholesky<Matrix3d> own(known.covariance_m2);
  const Vector3d residual = target_position(network, state, known.target) - known.position_m;
  const Vector3d whitened = own.solve_lower(residual);
  const Matrix3d half = own.solve_lower(absorbed_m2);
  const Matrix3d absorbed = own.solve_lower(Matrix3d(half.transpose()));
  const auto eigen =
      core::symmetric_eigen<Matrix3d>(Matrix3d(0.5 * (absorbed + absorbed.transpose())));
  OutlierCandidate result;
  result.index = index;
  dof = 0;
  double squared = 0;
  Matrix3d covariance = Matrix3d::Zero();  // of the whitened residual
  for (int k = 0; k < 3; ++k) {
    const double redundancy = 1 - eigen.eigenvalues()[k];
    if (redundancy < min_known_redundancy) continue;
    const double variance = residual_variance(redundancy, factor);
    const Vector3d direction = eigen.eigenvectors().col(k);
    squared += std::pow(direction.dot(whitened), 2) / variance;
    covariance += variance * direction * direction.transpose();
    ++dof;
  }
  result.normalised = std::sqrt(squared);
  const Matrix3d lower = own.lower();
  const Vector3d variances = (lower * covariance * lower.transpose()).diagonal();
  double worst = -1;
  for (int k = 0; k < 3; ++k) {
    if (!(variances[k] > 0)) continue;
    const double w = std::abs(residual[k]) / std::sqrt(variances[k]);
    if (w > worst) {
      worst = w;
      result.coordinate = k;
    }
  }
  return result;
}

void sort_by_size(std::vector<OutlierCandidate>& list) {
  std::stable_sort(list.begin(), list.end(),
                   [](const OutlierCandidate& a, const OutlierCandidate& b) {
                     return a.normalised > b.normalised;
                   });
}

}  // namespace

OutlierCandidates find_outliers(const Network& network, const NetworkLayout& layout,
                                double robust_scale, double false_alarm, int threads) {
  const NetworkState state(network);
  NormalEquations normal;
  build(network, layout, state, {}, 0, threads, normal);
  const ReducedSystem system(normal, reduced_gauge(network, layout, state));
  OutlierCandidates found;
  if (!system.determined()) return found;
  const Eigen::MatrixXd covariance = system.covariance();
  const auto cofactors = residual_cofactors(network, layout, state, normal, covariance, threads);
  const int rows = count_observations(network, layout);
  const int redundancy = rows - static_cast<int>(layout.total) + datum_defect(network).total();
  // The a posteriori sigma0 covers sigmas that were stated too small.
  const double factor = std::sqrt(variance_factor(2 * normal.cost, redundancy));
  const double scale = std::min(factor, robust_scale);
  const double tail = false_alarm / (2.0 * rows);
  const double quantile = normal_quantile(1 - tail);
  for (std::size_t i = 0; i < cofactors.size(); ++i) {
    if (!cofactors[i].used) continue;
    double worst = 0;
    const Eigen::Matrix2d r = cofactors[i].redundancy();
    for (int k = 0; k < 2; ++k)
      if (r(k, k) > min_redundancy)
        worst = std::max(worst, std::abs(cofactors[i].residual[k]) / std::sqrt(r(k, k)));
    if (worst > scale * quantile) found.images.push_back({static_cast<int>(i), worst});
  }
  for (std::size_t i = 0; i < network.distances.size(); ++i) {
    const DistanceCofactor one =
        distance_cofactor(network, layout, state, network.distances[i], covariance);
    if (!one.used || one.redundancy < min_known_redundancy) continue;
    const double w = std::abs(one.residual) / std::sqrt(residual_variance(one.redundancy, scale));
    if (w > quantile) found.distances.push_back({static_cast<int>(i), w});
  }
  for (std::size_t i = 0; i < network.control.size(); ++i) {
    const ControlPoint& control = network.control[i];
    if (!control.used || !layout.is_determined(control.target)) continue;
    const Matrix3d absorbed_m2 =
        position_cofactor(network, layout, state, normal, covariance, control.target);
    int dof = 0;
    const OutlierCandidate one =
        test_control(network, state, static_cast<int>(i), absorbed_m2, scale, dof);
    if (dof > 0 && one.normalised > critical_length(2 * tail, dof)) found.control.push_back(one);
  }
  for (auto* list : {&found.images, &found.distances, &found.control}) sort_by_size(*list);
  return found;
}

AgreeingObservations find_agreeing(const Network& network, double robust_scale, double false_alarm,
                                   int threads) {
  AgreeingObservations found;
  const auto is_rejected = [](const auto& known) { return !known.used; };
  if (std::none_of(network.distances.begin(), network.distances.end(), is_rejected) &&
      std::none_of(network.control.begin(), network.control.end(), is_rejected))
    return found;
  const NetworkLayout layout = layout_of(network);
  const DatumDefect defect = datum_defect(network);
  const Result<Precision> known = precision(network, {}, threads);
  if (!known.ok()) return found;
  const double tail = false_alarm / (2.0 * count_observations(network, layout));
  const double squared_scale = robust_scale * robust_scale;
  for (std::size_t i = 0; defect.scale == 0 && i < network.distances.size(); ++i) {
    const DistanceObservation& distance = network.distances[i];
    if (distance.used || !layout.is_determined(distance.from) || !layout.is_determined(distance.to))
      continue;
    const double length =
        (network.position_m(distance.to) - network.position_m(distance.from)).norm();
    const double predicted = known->distance_sigma_m(distance.from, distance.to);
    const double variance =
        distance.sigma_m * distance.sigma_m + squared_scale * predicted * predicted;
    if (std::abs(length - distance.length_m) < normal_quantile(1 - tail) * std::sqrt(variance))
      found.distances.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; defect.total() == 0 && i < network.control.size(); ++i) {
    const ControlPoint& control = network.control[i];
    if (control.used || !layout.is_determined(control.target)) continue;
    const Vector3d residual = network.position_m(control.target) - control.position_m;
    const Matrix3d covariance =
        control.covariance_m2 + squared_scale * known->position(control.target);
    if (!covariance.allFinite()) continue;
    if (core::Cholesky<Matrix3d>(covariance).solve_lower(residual).norm() <
        critical_length(2 * tail, 3))
      found.control.push_back(static_cast<int>(i));
  }
  return found;
}

}  // namespace occ::internal::network
