// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/network_statistics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/internal/datum_directions.hpp"
#include "libocc/network/internal/minimise_network.hpp"
#include "libocc/network/internal/network_checks.hpp"
#include "libocc/network/internal/residual_cofactors.hpp"

namespace occ {

using namespace internal::network;

namespace {

/// Non-centrality of a normal variable for 0.1 % false alarms and 80 % power (Baarda 1968).
constexpr double detectable_shift = 4.13;

ObservationStatistics statistics_of(const ImageObservation& observation,
                                    const ResidualCofactor& cofactor, double sigma0) {
  constexpr double min_redundancy = 1e-9;  // below it, the residual is rounding error
  const double infinity = std::numeric_limits<double>::infinity();
  ObservationStatistics statistics;
  statistics.used = true;
  const Eigen::Matrix2d redundancy = cofactor.redundancy();
  for (int k = 0; k < 2; ++k) {
    const double r = std::clamp(redundancy(k, k), 0.0, 1.0);
    statistics.redundancy[k] = r;
    statistics.residual_px[k] = -cofactor.residual[k] * observation.sigma_px[k];
    statistics.w[k] = r > min_redundancy ? -cofactor.residual[k] / std::sqrt(r) : 0;
    statistics.tau[k] = sigma0 > 0 ? statistics.w[k] / sigma0 : 0;
    statistics.detectable_px[k] =
        r > min_redundancy ? detectable_shift * observation.sigma_px[k] / std::sqrt(r) : infinity;
    statistics.external[k] =
        r > min_redundancy ? detectable_shift * std::sqrt((1 - r) / r) : infinity;
  }
  return statistics;
}

DistanceStatistics statistics_of(const DistanceObservation& distance,
                                 const DistanceCofactor& cofactor) {
  constexpr double min_redundancy = 1e-9;
  DistanceStatistics statistics;
  statistics.used = cofactor.used;
  if (!statistics.used) return statistics;
  const double r = cofactor.redundancy;
  statistics.residual_m = -cofactor.residual * distance.sigma_m;
  statistics.redundancy = r;
  statistics.w = r > min_redundancy ? -cofactor.residual / std::sqrt(r) : 0;
  statistics.detectable_m = r > min_redundancy ? detectable_shift * distance.sigma_m / std::sqrt(r)
                                               : std::numeric_limits<double>::infinity();
  return statistics;
}

/// Critical value of Pope's tau for several tests (Pope 1976, from Student's distribution).
double tau_critical(double false_alarm, int test_count, double redundancy) {
  const int dof = static_cast<int>(redundancy) - 1;
  if (dof < 1 || test_count < 1) return std::numeric_limits<double>::infinity();
  const double t = student_quantile(1 - false_alarm / (2.0 * test_count), dof);
  return std::sqrt(redundancy) * t / std::sqrt(dof + t * t);
}

}  // namespace

Result<NetworkStatistics> network_statistics(const Network& adjusted, int threads) {
  check_network(adjusted);
  require(threads >= 1, "threads", threads, "at least 1");
  Result<NetworkStatistics> result;
  NetworkStatistics& out = result.value;
  const NetworkLayout layout = layout_of(adjusted);
  const CheckOutcome check = check_solvable(adjusted, layout);
  result.status = check.status;
  result.message = check.message;
  if (!result.ok()) return result;

  const NetworkState state(adjusted);
  NormalEquations normal;
  build(adjusted, layout, state, {}, 0, threads, normal);
  const ReducedSystem system(normal, reduced_gauge(adjusted, layout, state));
  if (!system.determined()) {
    result.status = Status::degenerate;
    result.message =
        "no observation determines " + names_of_unknowns(adjusted, layout, system.undetermined());
    return result;
  }
  out.observations = count_observations(adjusted, layout);
  out.unknowns = static_cast<int>(layout.total);
  out.defect = defect_at(adjusted, state).total();
  out.redundancy = out.observations - out.unknowns + out.defect;
  if (out.redundancy > 0) out.sigma0 = std::sqrt(2 * normal.cost / out.redundancy);
  constexpr double z = 1.959964;  // 95 %
  const auto sigma0_at = [&](double quantile) {
    return out.redundancy > 0 ? std::sqrt(gate_chi2(quantile, out.redundancy) / out.redundancy) : 1;
  };
  out.sigma0_low = sigma0_at(-z);
  out.sigma0_high = sigma0_at(z);

  const Eigen::MatrixXd covariance = system.covariance();
  const auto cofactors = residual_cofactors(adjusted, layout, state, normal, covariance, threads);
  for (const DistanceObservation& distance : adjusted.distances)
    out.distances.push_back(
        statistics_of(distance, distance_cofactor(adjusted, layout, state, distance, covariance)));
  constexpr double false_alarm = 0.01;
  int test_count = 0;
  std::vector<int> image_observations(adjusted.images.size());
  out.rms_px_of_image.assign(adjusted.images.size(), Eigen::Vector2d::Zero());
  out.image_observations.resize(cofactors.size());
  for (std::size_t i = 0; i < cofactors.size(); ++i) {
    if (!cofactors[i].used) continue;
    const ImageObservation& observation = adjusted.observations[i];
    out.image_observations[i] = statistics_of(observation, cofactors[i], out.sigma0);
    const ObservationStatistics& statistics = out.image_observations[i];
    out.image_redundancy += statistics.redundancy.sum();
    out.rms_px += statistics.residual_px.cwiseAbs2();
    out.rms_px_of_image[observation.image] += statistics.residual_px.cwiseAbs2();
    ++image_observations[observation.image];
    test_count += 2;
  }
  if (test_count > 0) {
    out.rms_px = (out.rms_px / (0.5 * test_count)).cwiseSqrt();
    out.w_critical = normal_quantile(1 - false_alarm / (2.0 * test_count));
  }
  out.tau_critical = tau_critical(false_alarm, test_count, out.redundancy);
  for (std::size_t i = 0; i < image_observations.size(); ++i)
    if (image_observations[i] > 0)
      out.rms_px_of_image[i] = (out.rms_px_of_image[i] / image_observations[i]).cwiseSqrt();
  return result;
}

Result<VarianceComponents> variance_components(const Network& network,
                                               const AdjustOptions& options) {
  constexpr int max_rounds = 30;
  constexpr double tolerance = 1e-3;
  Result<VarianceComponents> result;
  VarianceComponents& out = result.value;
  for (int camera = 0; camera < static_cast<int>(network.cameras.size()); ++camera)
    for (int axis = 0; axis < 2; ++axis) out.components.push_back({camera, axis, 1, 0, 0});
  Network current = network;
  for (; out.rounds < max_rounds; ++out.rounds) {
    Result<Adjustment> adjusted = adjust(current, options);
    result.status = adjusted.status;
    result.message = adjusted.message;
    out.adjustment = std::move(adjusted.value);
    if (!result.ok()) return result;
    const auto all = network_statistics(out.adjustment.network, options.threads);
    if (!all.ok()) {
      result.status = all.status;
      result.message = all.message;
      return result;
    }
    std::vector<double> squared_sums(out.components.size());
    for (VarianceComponent& component : out.components)
      component.redundancy = component.observations = 0;
    for (std::size_t i = 0; i < current.observations.size(); ++i) {
      const ObservationStatistics& statistics = all->image_observations[i];
      if (!statistics.used) continue;
      const ImageObservation& observation = current.observations[i];
      for (int axis = 0; axis < 2; ++axis) {
        const int k = 2 * current.images[observation.image].camera + axis;
        squared_sums[k] += std::pow(statistics.residual_px[axis] / observation.sigma_px[axis], 2);
        out.components[k].redundancy += statistics.redundancy[axis];
        ++out.components[k].observations;
      }
    }
    double change = 0;
    std::vector<double> steps(out.components.size(), 1);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (out.components[k].redundancy < 1 || squared_sums[k] <= 0) continue;
      steps[k] = std::sqrt(squared_sums[k] / out.components[k].redundancy);
      out.components[k].factor *= steps[k];
      change = std::max(change, std::abs(steps[k] - 1));
    }
    current = out.adjustment.network;
    for (ImageObservation& observation : current.observations)
      for (int axis = 0; axis < 2; ++axis)
        observation.sigma_px[axis] *= steps[2 * current.images[observation.image].camera + axis];
    if (change < tolerance) {
      ++out.rounds;
      out.adjustment.network = std::move(current);
      return result;
    }
  }
  result.status = Status::not_converged;
  result.message = "the variance components have not converged after 30 rounds";
  return result;
}

Result<CheckResult> check_points(const Network& adjusted, const Precision& precision,
                                 const std::vector<CheckPoint>& points) {
  require(!points.empty(), "points", points.size(), "one check point or more");
  Network reference = adjusted;
  Datum datum;
  for (const CheckPoint& point : points) {
    require_finite(point.position_m, "points");
    adjusted.name_of(point.target);  // throws for an invalid target
    require(point.target.body < 0, "points", point.target.corner, "points, not corners of bodies");
    reference.points[point.target.point].position_m = point.position_m;
    datum.targets.push_back(point.target);
  }
  Result<CheckResult> result;
  const Result<Network> aligned = in_datum(adjusted, reference, datum);
  const Result<Precision> precision_in_datum = precision.in_datum(datum);
  if (!aligned.ok() || !precision_in_datum.ok()) {
    result.status = aligned.ok() ? precision_in_datum.status : aligned.status;
    result.message = aligned.ok() ? precision_in_datum.message : aligned.message;
    return result;
  }
  CheckResult& out = result.value;
  const double count = static_cast<double>(points.size());
  Eigen::Vector3d squared_sums = Eigen::Vector3d::Zero(), variances = Eigen::Vector3d::Zero();
  for (const CheckPoint& point : points) {
    out.errors_m.push_back(aligned->position_m(point.target) - point.position_m);
    squared_sums += out.errors_m.back().cwiseAbs2() / count;
    variances += precision_in_datum->position(point.target).diagonal() / count;
  }
  out.rmse_m = squared_sums.cwiseSqrt();
  out.predicted_m = variances.cwiseSqrt();
  out.rmse_3d_m = std::sqrt(squared_sums.sum());
  out.predicted_3d_m = std::sqrt(variances.sum());
  return result;
}

}  // namespace occ
