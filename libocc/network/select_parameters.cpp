// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/network_statistics.hpp"

namespace occ {

using namespace internal::network;

namespace {

using Eigen::Index;

/// Fixes a parameter at its value in another network and removes its priors.
void fix_parameter(Network& network, int camera, const std::string& name, const Network& nominal) {
  NetworkCamera& owner = network.cameras[camera];
  owner.free_parameters.erase(
      std::find(owner.free_parameters.begin(), owner.free_parameters.end(), name));
  owner.camera = with_free_parameter(owner.camera, name,
                                     free_parameter(nominal.cameras[camera].camera, name).value);
  auto& priors = network.parameter_priors;
  priors.erase(std::remove_if(priors.begin(), priors.end(),
                              [&](const ParameterPrior& prior) {
                                return prior.camera == camera && prior.parameter == name;
                              }),
               priors.end());
}

Network nominal_network(Network network, const std::vector<Camera>& cameras) {
  if (cameras.empty()) return network;
  require(cameras.size() == network.cameras.size(), "nominal", cameras.size(),
          "one camera for each of the network");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& given = network.cameras[i].camera;
    require(cameras[i].kind() == given.kind() &&
                cameras[i].parameters().size() == given.parameters().size(),
            "nominal[" + std::to_string(i) + "]", name_of(cameras[i].kind()),
            std::string("a ") + name_of(given.kind()) + " with as many parameters");
    network.cameras[i].camera = cameras[i];
  }
  return network;
}

struct DropCandidate {
  int camera;
  std::string name, reason;
};

}  // namespace

std::vector<ParameterStatistics> parameter_statistics(const Network& adjusted,
                                                      const Network& nominal,
                                                      const Precision& precision) {
  require(adjusted.cameras.size() == nominal.cameras.size(), "nominal", nominal.cameras.size(),
          "a network of the same cameras");
  constexpr double significant_t = 2.5758, highly_correlated = 0.9;
  std::vector<ParameterStatistics> all;
  for (int camera = 0; camera < static_cast<int>(adjusted.cameras.size()); ++camera) {
    const NetworkCamera& owner = adjusted.cameras[camera];
    const Eigen::MatrixXd covariance = precision.parameters(camera);
    const Eigen::MatrixXd correlation = precision.parameter_correlation(camera);
    require(covariance.rows() == static_cast<Index>(owner.free_parameters.size()), "precision",
            covariance.rows(), "that of the adjusted network");
    for (Index k = 0; k < covariance.rows(); ++k) {
      ParameterStatistics parameter;
      const CameraParameter now = free_parameter(owner.camera, owner.free_parameters[k]);
      parameter.camera = camera;
      parameter.name = now.name;
      parameter.unit = now.unit;
      parameter.value = now.value;
      parameter.nominal = free_parameter(nominal.cameras[camera].camera, now.name).value;
      parameter.sigma = std::sqrt(covariance(k, k));
      const double off = std::abs(parameter.value - parameter.nominal);
      parameter.t = parameter.sigma > 0 ? off / parameter.sigma : 0;
      parameter.significant = parameter.t > significant_t;
      for (Index other = 0; other < covariance.rows(); ++other)
        if (other != k && std::abs(correlation(k, other)) > std::abs(parameter.correlation)) {
          parameter.correlation = correlation(k, other);
          parameter.correlated_with = owner.free_parameters[other];
        }
      parameter.highly_correlated = std::abs(parameter.correlation) > highly_correlated;
      all.push_back(parameter);
    }
  }
  return all;
}

Result<Selection> select_parameters(const Network& network, const SelectOptions& options) {
  require(options.false_alarm > 0 && options.false_alarm < 1, "false_alarm", options.false_alarm,
          "between 0 and 1");
  require(options.max_correlation > 0 && options.max_correlation <= 1, "max_correlation",
          options.max_correlation, "in (0, 1]");
  const double critical = normal_quantile(1 - options.false_alarm / 2);
  const Network nominal = nominal_network(network, options.nominal);
  Result<Selection> result;
  Selection& out = result.value;
  Network start = network;
  DropCandidate last{0, "", ""};
  const auto is_kept = [&](const std::string& name) {
    return std::find(options.keep.begin(), options.keep.end(), name) != options.keep.end();
  };
  for (;;) {
    Result<Adjustment> adjusted = adjust(start, options.adjust);
    result.status = adjusted.status;
    result.message = adjusted.message;
    out.adjustment = std::move(adjusted.value);
    int free = 0;
    for (const NetworkCamera& camera : start.cameras)
      free += static_cast<int>(camera.free_parameters.size());
    out.steps.push_back(
        {last.name.empty() ? "" : last.name + " of " + network.cameras[last.camera].name,
         last.reason, out.adjustment.sigma0,
         2 * out.adjustment.cost + free * std::log(std::max(1, out.adjustment.observations))});

    std::optional<DropCandidate> next;
    if (!result.ok()) {
      // The message names an undetermined parameter, or one that prevents convergence.
      for (int camera = 0; camera < static_cast<int>(start.cameras.size()) && !next; ++camera)
        for (const std::string& name : start.cameras[camera].free_parameters)
          if (!next && !is_kept(name) && result.message.find(name + " of ") != std::string::npos)
            next = DropCandidate{camera, name, "not determined"};
      if (!next) return result;
    } else {
      const Result<Precision> precise =
          precision(out.adjustment.network, {}, options.adjust.threads);
      if (!precise.ok()) return result;
      const double factor = std::pow(std::max(1.0, out.adjustment.sigma0), 2);
      double smallest_t = critical;
      const auto parameters =
          parameter_statistics(out.adjustment.network, nominal, precise->scaled(factor));
      for (const ParameterStatistics& parameter : parameters)
        if (!is_kept(parameter.name) && parameter.t < smallest_t) {
          smallest_t = parameter.t;
          next = DropCandidate{parameter.camera, parameter.name, "not significant"};
        }
      if (!next) {
        double smallest_t_correlated = std::numeric_limits<double>::infinity();
        for (const ParameterStatistics& parameter : parameters)
          if (!is_kept(parameter.name) &&
              std::abs(parameter.correlation) > options.max_correlation &&
              parameter.t < smallest_t_correlated) {
            smallest_t_correlated = parameter.t;
            next = DropCandidate{parameter.camera, parameter.name,
                                 "correlated with " + parameter.correlated_with};
          }
        if (next) {  // keep both if the fit without one is worse than the BIC penalty
          Network without = start;
          fix_parameter(without, next->camera, next->name, nominal);
          const Result<Adjustment> trial = adjust(without, options.adjust);
          const double penalty = std::log(std::max(1, out.adjustment.observations));
          if (!trial.ok() || 2 * (trial->cost - out.adjustment.cost) / factor > penalty)
            next.reset();
        }
      }
      if (!next) return result;
    }
    last = *next;
    fix_parameter(start, last.camera, last.name, nominal);
  }
}

}  // namespace occ
