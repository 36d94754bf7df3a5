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

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// 0.1 % false alarms and 80 % power: the shift that both ask of a normal variable.
constexpr double detectable_shift = 4.13;

ObservationStatistics statistics_of(const ImageObservation& seen, const ResidualCofactor& cofactor,
                                    double sigma0) {
  constexpr double nothing = 1e-9;
  const double infinity = std::numeric_limits<double>::infinity();
  ObservationStatistics one;
  one.used = true;
  const Eigen::Matrix2d left = cofactor.left();
  for (int k = 0; k < 2; ++k) {
    const double r = std::clamp(left(k, k), 0.0, 1.0);
    one.redundancy[k] = r;
    one.residual_px[k] = -cofactor.residual[k] * seen.sigma_px[k];
    one.w[k] = r > nothing ? -cofactor.residual[k] / std::sqrt(r) : 0;
    one.tau[k] = sigma0 > 0 ? one.w[k] / sigma0 : 0;
    one.detectable_px[k] =
        r > nothing ? detectable_shift * seen.sigma_px[k] / std::sqrt(r) : infinity;
    one.external[k] = r > nothing ? detectable_shift * std::sqrt((1 - r) / r) : infinity;
  }
  return one;
}

DistanceStatistics statistics_of(const DistanceObservation& known,
                                 const DistanceCofactor& cofactor) {
  constexpr double nothing = 1e-9;
  DistanceStatistics one;
  one.used = cofactor.used;
  if (!one.used) return one;
  const double r = cofactor.left;
  one.residual_m = -cofactor.residual * known.sigma_m;
  one.redundancy = r;
  one.w = r > nothing ? -cofactor.residual / std::sqrt(r) : 0;
  one.detectable_m = r > nothing ? detectable_shift * known.sigma_m / std::sqrt(r)
                                 : std::numeric_limits<double>::infinity();
  return one;
}

double tau_critical(double false_alarm, int tests, double redundancy) {
  const int dof = static_cast<int>(redundancy) - 1;
  if (dof < 1 || tests < 1) return std::numeric_limits<double>::infinity();
  const double t = student_quantile(1 - false_alarm / (2.0 * tests), dof);
  return std::sqrt(redundancy) * t / std::sqrt(dof + t * t);
}

}  // namespace

Result<NetworkStatistics> network_statistics(const Network& adjusted, int threads) {
  check_network(adjusted);
  require(threads >= 1, "threads", threads, "at least 1");
  Result<NetworkStatistics> result;
  NetworkStatistics& out = result.value;
  const NetworkLayout layout = layout_of(adjusted);
  const Objection objection = objection_to(adjusted, layout);
  result.status = objection.status;
  result.message = objection.message;
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
  const auto sigma0_at = [&](double normal) {
    return out.redundancy > 0 ? std::sqrt(gate_chi2(normal, out.redundancy) / out.redundancy) : 1;
  };
  out.sigma0_low = sigma0_at(-z);
  out.sigma0_high = sigma0_at(z);

  const Eigen::MatrixXd covariance = system.covariance();
  const auto cofactors = residual_cofactors(adjusted, layout, state, normal, covariance, threads);
  for (const DistanceObservation& known : adjusted.distances)
    out.distances.push_back(
        statistics_of(known, distance_cofactor(adjusted, layout, state, known, covariance)));
  constexpr double false_alarm = 0.01;
  int tests = 0;
  std::vector<int> in_image(adjusted.images.size());
  out.rms_px_of_image.assign(adjusted.images.size(), Eigen::Vector2d::Zero());
  out.image_observations.resize(cofactors.size());
  for (std::size_t i = 0; i < cofactors.size(); ++i) {
    if (!cofactors[i].used) continue;
    const ImageObservation& seen = adjusted.observations[i];
    out.image_observations[i] = statistics_of(seen, cofactors[i], out.sigma0);
    const ObservationStatistics& one = out.image_observations[i];
    out.image_redundancy += one.redundancy.sum();
    out.rms_px += one.residual_px.cwiseAbs2();
    out.rms_px_of_image[seen.image] += one.residual_px.cwiseAbs2();
    ++in_image[seen.image];
    tests += 2;
  }
  if (tests > 0) {
    out.rms_px = (out.rms_px / (0.5 * tests)).cwiseSqrt();
    out.w_critical = normal_quantile(1 - false_alarm / (2.0 * tests));
  }
  out.tau_critical = tau_critical(false_alarm, tests, out.redundancy);
  for (std::size_t i = 0; i < in_image.size(); ++i)
    if (in_image[i] > 0)
      out.rms_px_of_image[i] = (out.rms_px_of_image[i] / in_image[i]).cwiseSqrt();
  return result;
}

Result<VarianceComponents> variance_components(const Network& network,
                                               const AdjustOptions& options) {
  constexpr int max_rounds = 30;
  constexpr double enough = 1e-3;
  Result<VarianceComponents> result;
  VarianceComponents& out = result.value;
  for (int camera = 0; camera < static_cast<int>(network.cameras.size()); ++camera)
    for (int axis = 0; axis < 2; ++axis) out.components.push_back({camera, axis, 1, 0, 0});
  Network now = network;
  for (; out.rounds < max_rounds; ++out.rounds) {
    Result<Adjustment> adjusted = adjust(now, options);
    result.status = adjusted.status;
    result.message = adjusted.message;
    out.adjustment = std::move(adjusted.value);
    if (!result.ok()) return result;
    const auto statistics = network_statistics(out.adjustment.network, options.threads);
    if (!statistics.ok()) {
      result.status = statistics.status;
      result.message = statistics.message;
      return result;
    }
    std::vector<double> squares(out.components.size());
    for (VarianceComponent& component : out.components)
      component.redundancy = component.observations = 0;
    for (std::size_t i = 0; i < now.observations.size(); ++i) {
      const ObservationStatistics& one = statistics->image_observations[i];
      if (!one.used) continue;
      const ImageObservation& seen = now.observations[i];
      for (int axis = 0; axis < 2; ++axis) {
        const std::size_t k = at(2 * now.images[seen.image].camera + axis);
        squares[k] += std::pow(one.residual_px[axis] / seen.sigma_px[axis], 2);
        out.components[k].redundancy += one.redundancy[axis];
        ++out.components[k].observations;
      }
    }
    double change = 0;
    std::vector<double> steps(out.components.size(), 1);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      if (out.components[k].redundancy < 1 || squares[k] <= 0) continue;
      steps[k] = std::sqrt(squares[k] / out.components[k].redundancy);
      out.components[k].factor *= steps[k];
      change = std::max(change, std::abs(steps[k] - 1));
    }
    now = out.adjustment.network;
    for (ImageObservation& seen : now.observations)
      for (int axis = 0; axis < 2; ++axis)
        seen.sigma_px[axis] *= steps[2 * now.images[seen.image].camera + axis];
    if (change < enough) {
      ++out.rounds;
      out.adjustment.network = std::move(now);
      return result;
    }
  }
  result.status = Status::not_converged;
  result.message = "the variance components still change";
  return result;
}

Result<CheckResult> check_points(const Network& adjusted, const Precision& precision,
                                 const std::vector<CheckPoint>& points) {
  require(!points.empty(), "points", points.size(), "one check point or more");
  Network reference = adjusted;
  Datum datum;
  for (const CheckPoint& point : points) {
    require_finite(point.position_m, "points");
    adjusted.name_of(point.target);  // throws when there is none
    require(point.target.body < 0, "points", point.target.corner, "points, not corners of bodies");
    reference.points[point.target.point].position_m = point.position_m;
    datum.targets.push_back(point.target);
  }
  Result<CheckResult> result;
  const Result<Network> aligned = in_datum(adjusted, reference, datum);
  const Result<Precision> there = precision.in_datum(datum);
  if (!aligned.ok() || !there.ok()) {
    result.status = aligned.ok() ? there.status : aligned.status;
    result.message = aligned.ok() ? there.message : aligned.message;
    return result;
  }
  CheckResult& out = result.value;
  const double count = static_cast<double>(points.size());
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), variances = Eigen::Vector3d::Zero();
  for (const CheckPoint& point : points) {
    out.errors_m.push_back(aligned->position_m(point.target) - point.position_m);
    squares += out.errors_m.back().cwiseAbs2() / count;
    variances += there->position(point.target).diagonal() / count;
  }
  out.rmse_m = squares.cwiseSqrt();
  out.predicted_m = variances.cwiseSqrt();
  out.rmse_3d_m = std::sqrt(squares.sum());
  out.predicted_3d_m = std::sqrt(variances.sum());
  return result;
}

}  // namespace occ
