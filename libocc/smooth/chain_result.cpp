// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_result.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace occ::internal::smooth {
namespace {

template <class Body>
std::string undetermined(const Chain<Body>& chain, const std::vector<bool>& determined) {
  std::ostringstream text;
  const char* between = "";
  for (std::size_t k = 0; k < determined.size(); ++k) {
    if (determined[k]) continue;
    std::size_t end = k;
    while (end + 1 < determined.size() && !determined[end + 1]) ++end;
    text << between << (end == k ? "pose " : "poses ") << k;
    if (end > k) text << " to " << end;
    text << " (" << chain.nodes[k].time_s;
    if (end > k) text << " to " << chain.nodes[end].time_s;
    text << " s)";
    between = ", ";
    k = end;
  }
  return text.str();
}

template <class Body>
std::string contradictions(const Chain<Body>& chain) {
  std::ostringstream text;
  int found = 0;
  for (const auto& link : chain.links) {
    if (!link.report.contradicted) continue;
    if (found == 0)
      text << "odometry from " << link.report.from_s << " s to " << link.report.to_s
           << " s is contradicted (chi2 " << link.report.chi2 << " of " << link.report.dof
           << " dof) and weighed down";
    ++found;
  }
  if (found > 1) text << ", and " << found - 1 << " more";
  return text.str();
}

template <class Body>
void measure_sightings(const Chain<Body>& chain, const ChainSolution<Body>& solution,
                       Smoothing<typename Body::Smoothed>& out) {
  double squares = 0;
  SightingStatistics& s = out.sightings;
  for (std::size_t k = 0; k < chain.nodes.size(); ++k) {
    const Rigid3 spatial = chain.body.body_from_world(solution.poses[k]);
    for (const View& view : chain.nodes[k].views) {
      const auto residuals = residuals_of(view, spatial, chain.sighting_corner);
      out.residual_sigmas.emplace_back(view.root.size(), std::numeric_limits<double>::infinity());
      for (std::size_t i = 0; i < view.root.size(); ++i) {
        ++s.count;
        const auto& residual = residuals[i];
        s.outside += !residual;
        if (!residual) continue;
        out.residual_sigmas.back()[i] = residual->norm();
        s.beyond += residual->norm() > chain.sighting_corner;
        squares += view.root[i].inverse().operator*(*residual).squaredNorm();
      }
    }
  }
  s.beyond += s.outside;
  if (s.count > s.outside) s.rms_px = std::sqrt(0.5 * squares / (s.count - s.outside));
}

template <class Body>
std::vector<typename Body::Smoothed> smoothed_poses(const Chain<Body>& chain,
                                                    const ChainSolution<Body>& solution) {
  std::vector<typename Body::Smoothed> out;
  std::vector<typename Body::Block> covariances = solution.covariance.diagonal;
  if (chain.has_errors()) {
    std::vector<CommonErrors<Body::size>> errors;
    for (std::size_t k = 0; k < chain.nodes.size(); ++k)
      errors.push_back(chain.errors_at(k, solution.poses[k]));
    covariances = with_common_errors(chain.normals(solution.poses), chain.linked(), errors,
                                     solution.covariance);
  }
  for (std::size_t k = 0; k < chain.nodes.size(); ++k) {
    typename Body::Smoothed pose;
    pose.time_s = chain.nodes[k].time_s;
    Body::put(solution.poses[k], pose);
    pose.determined = solution.covariance.determined[k];
    if (pose.determined) pose.covariance = covariances[k];
    out.push_back(pose);
  }
  return out;
}

/// The largest distance between two trajectories, and the other's chi2.
template <class Body>
std::string other_trajectory(const ChainMinima<Body>& minima) {
  const Chain<Body>& chain = minima.best.chain;
  const ChainSolution<Body>&best = minima.best.solution, &other = minima.others.front().solution;
  double away_m = 0;
  std::size_t at = 0;
  for (std::size_t k = 0; k < chain.nodes.size(); ++k) {
    const double by_m = (chain.body.body_from_world(best.poses[k]).origin_in_source() -
                         chain.body.body_from_world(other.poses[k]).origin_in_source())
                            .norm();
    if (by_m < away_m) continue;
    away_m = by_m;
    at = k;
  }
  std::ostringstream text;
  text.precision(3);
  text << "another trajectory, " << away_m << " m away at " << chain.nodes[at].time_s
       << " s, is plausible: its chi2 is " << 2 * other.cost << ", that of the best is "
       << 2 * best.cost << "; the risk is " << minima.risk;
  return text.str();
}

}  // namespace

template <class Body>
Result<Smoothing<typename Body::Smoothed>> to_result(const ChainMinima<Body>& minima) {
  Result<Smoothing<typename Body::Smoothed>> out;
  const Chain<Body>& chain = minima.best.chain;
  const ChainSolution<Body>& solution = minima.best.solution;
  const std::vector<bool>& determined = solution.covariance.determined;
  out.value.poses = smoothed_poses(chain, solution);
  for (const auto& link : chain.links) out.value.links.push_back(link.report);
  measure_sightings(chain, solution, out.value);
  out.value.chi2 = 2 * solution.cost;
  out.value.dof = chain.rows() - Body::size * static_cast<int>(chain.nodes.size());
  out.value.iterations = solution.iterations;
  out.value.risk = minima.risk;
  for (const OtherMinimum<Body>& other : minima.others)
    out.value.alternatives.push_back(
        {smoothed_poses(chain, other.solution), 2 * other.solution.cost, other.ratio});
  const auto prepend = [&](Status status, const std::string& text) {
    out.status = status;
    out.message = text + (out.message.empty() ? "" : "; " + out.message);
  };
  out.message = contradictions(chain);
  const auto known = std::count(determined.begin(), determined.end(), true);
  if (known == 0) {
    out.status = Status::too_few_lamps;
    out.message = "nothing determines any pose";
    return out;
  }
  if (known < static_cast<std::ptrdiff_t>(determined.size()))
    prepend(Status::degenerate, undetermined(chain, determined) + " not determined");
  if (!minima.others.empty()) prepend(Status::ambiguous, other_trajectory(minima));
  if (out.ok() && !solution.converged) {
    out.status = Status::not_converged;
    out.message = "not converged after " + std::to_string(solution.iterations) + " iterations";
  }
  return out;
}

template Result<Smoothing<SmoothedPose>> to_result(const ChainMinima<SpatialBody>&);
template Result<Smoothing<SmoothedPlanarPose>> to_result(const ChainMinima<PlanarBody>&);

}  // namespace occ::internal::smooth
