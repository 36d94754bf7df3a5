// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_solver.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::smooth {
namespace {

constexpr int gating_rounds = 8;
constexpr double negligible = 1e-13;  // negligible decrease of the cost, (3e-7 sigma)^2

template <class Body>
std::vector<typename Body::Pose> moved(const std::vector<typename Body::Pose>& poses,
                                       const std::vector<typename Body::Part>& delta) {
  auto out = poses;
  for (std::size_t k = 0; k < poses.size(); ++k) out[k] = Body::moved(poses[k], delta[k]);
  return out;
}

/// Decrease of the cost in the quadratic model.
template <int size>
double predicted_fall(const ChainNormals<size>& normals,
                      const std::vector<typename ChainNormals<size>::Part>& delta) {
  double fall = 0;
  for (std::size_t k = 0; k < delta.size(); ++k) {
    typename ChainNormals<size>::Part pull =
        normals.gradient[k] + 0.5 * (normals.diagonal(k) * delta[k]);
    if (k + 1 < delta.size()) pull += normals.coupling[k] * delta[k + 1];
    fall -= delta[k].dot(pull);
  }
  return fall;
}

template <class Body>
void minimise(const Chain<Body>& chain, const SmootherOptions& options,
              ChainSolution<Body>& solution) {
  // The minimum keeps undetermined poses where they are.
  core::LevenbergMarquardt damping(1e-7, 1e-12, 100);
  solution.cost = chain.cost(solution.poses);
  solution.converged = false;
  std::vector<typename Body::Part> delta;
  for (int i = 0; i < options.max_iterations; ++i) {
    const auto normals = chain.normals(solution.poses);
    ++solution.iterations;
    bool better = false, hopeless = false;
    for (; !better && !hopeless; hopeless = !better && !damping.reject()) {
      if (!solve(normals, damping.lambda(), delta)) continue;
      auto trial = moved<Body>(solution.poses, delta);
      const double cost = chain.cost(trial);
      const double fall = predicted_fall(normals, delta);
      if (fall <= negligible + 1e-15 * solution.cost) {  // the step still improves the solution
        if (cost <= solution.cost * (1 + 1e-13) + negligible) {
          solution.poses = std::move(trial);
          solution.cost = cost;
        }
        solution.converged = true;
        return;
      }
      if (!(solution.cost - cost >= 1e-3 * fall)) continue;
      better = true;
      solution.poses = std::move(trial);
      solution.cost = cost;
      damping.accept();
    }
    if (!better) {  // the remaining decrease is below rounding
      solution.converged = solution.cost < 1e300;
      return;
    }
  }
}

/// Tests a link against all other information. With M = J P J^T in units of its sigmas, and its
/// weight w, the deleted residual is (I - w M)^-1 r with covariance I + M (I - w M)^-1.
template <class Body>
void test_link(const Chain<Body>& chain, std::size_t k, const ChainSolution<Body>& solution,
               OdometryLink& report, double& factor) {
  report.chi2 = 0;
  report.dof = 0;
  factor = 1;
  const auto& p = solution.covariance;
  if (!p.determined[k] || !p.determined[k + 1]) return;
  const LinkTerms<Body> t = chain.link_terms(k, solution.poses);
  using Block = typename Body::Block;
  const Block across = t.d_from * p.coupling[k] * t.d_to.transpose();
  const Block m = t.d_from * p.diagonal[k] * t.d_from.transpose() +
                  t.d_to * p.diagonal[k + 1] * t.d_to.transpose() + across + across.transpose();
  const auto eigen = core::symmetric_eigen<Block>(m);
  double apart = 0;
  for (int i = 0; i < Body::size; ++i) {
    const double value = eigen.eigenvalues()[i];
    const double left = 1 - t.weight * value;
    if (left < 1e-7) continue;  // only this link determines the component
    const double along = eigen.eigenvectors().col(i).dot(t.residual);
    report.chi2 += along * along / (left * (left + value));
    apart += along * along / (left * left);
    ++report.dof;
  }
  if (report.dof > 0) factor = std::max(1.0, apart / report.dof);
}

/// Tests all links. Inflates the covariance of contradicted links whose test statistic exceeds
/// those of their neighbours (in the last round: of all contradicted links). A link that is
/// consistent again after a neighbour was inflated is restored, once. Returns true if any link
/// changed.
template <class Body>
bool gate(Chain<Body>& chain, const ChainSolution<Body>& solution, const SmootherOptions& options,
          bool last) {
  const std::size_t count = chain.links.size();
  std::vector<double> excess(count, 0), factors(count, 1);
  bool any = false;
  for (std::size_t k = 0; k < count; ++k) {
    Link<Body>& link = chain.links[k];
    if (!link.exists) continue;
    OdometryLink tested = link.report;
    test_link(chain, k, solution, tested, factors[k]);
    // If nothing else determines the link any more, its contradiction stays recorded.
    if (tested.dof == 0 && link.report.contradicted) continue;
    link.report = tested;
    if (!tested.odometry || tested.dof == 0 || !(options.link_gate > 0)) continue;
    const double limit = chi2_quantile(1 - options.link_gate, tested.dof);
    if (tested.contradicted && tested.chi2 < limit && !link.cleared && !last) {
      link.cleared = any = true;
      link.report.contradicted = false;
      link.report.factor = 1;
      continue;
    }
    const bool new_or_worse = !tested.contradicted || factors[k] > 2 * tested.factor;
    if (tested.chi2 > limit && new_or_worse) excess[k] = tested.chi2 / limit;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const double beside = std::max(k > 0 ? excess[k - 1] : 0, k + 1 < count ? excess[k + 1] : 0);
    if (excess[k] == 0 || (!last && excess[k] < beside)) continue;
    chain.links[k].report.contradicted = true;
    chain.links[k].report.factor = factors[k];
    any = true;
  }
  return any;
}

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
      out.residual_sigmas.emplace_back(view.root.size(), std::numeric_limits<double>::infinity());
      for (std::size_t i = 0; i < view.root.size(); ++i) {
        ++s.count;
        const auto residual = view.aside[i] ? std::nullopt : sighting_residual(view, i, spatial);
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

}  // namespace

template <class Body>
ChainSolution<Body> solved(Chain<Body>& chain, std::vector<typename Body::Pose> poses,
                           const SmootherOptions& options) {
  if (options.huber_sigmas > 0) chain.sighting_corner = options.huber_sigmas;
  if (options.link_gate > 0)
    chain.odometry_corner = std::sqrt(chi2_quantile(1 - options.link_gate, Body::size));
  ChainSolution<Body> solution;
  solution.poses = std::move(poses);
  chain.set_aside(solution.poses);
  for (int round = 0; round <= gating_rounds; ++round) {
    minimise(chain, options, solution);
    solution.covariance = covariance(chain.normals(solution.poses), chain.linked());
    // Both change the problem, which must not change in the last round.
    const bool last = round + 1 == gating_rounds;
    if (round == gating_rounds) {
      auto tested = chain;
      gate(tested, solution, options, last);
      for (std::size_t k = 0; k < chain.links.size(); ++k) {
        chain.links[k].report.chi2 = tested.links[k].report.chi2;
        chain.links[k].report.dof = tested.links[k].report.dof;
      }
      break;
    }
    const bool changed = chain.set_aside(solution.poses);
    if (!gate(chain, solution, options, last) && !changed) break;
  }
  return solution;
}

template <class Body>
Result<Smoothing<typename Body::Smoothed>> to_result(const Chain<Body>& chain,
                                                     const ChainSolution<Body>& solution) {
  Result<Smoothing<typename Body::Smoothed>> out;
  const std::vector<bool>& determined = solution.covariance.determined;
  for (std::size_t k = 0; k < chain.nodes.size(); ++k) {
    typename Body::Smoothed pose;
    pose.time_s = chain.nodes[k].time_s;
    Body::put(solution.poses[k], pose);
    pose.determined = determined[k];
    if (pose.determined) pose.covariance = solution.covariance.diagonal[k];
    out.value.poses.push_back(pose);
  }
  for (const auto& link : chain.links) out.value.links.push_back(link.report);
  measure_sightings(chain, solution, out.value);
  out.value.chi2 = 2 * solution.cost;
  out.value.dof = chain.rows() - Body::size * static_cast<int>(chain.nodes.size());
  out.value.iterations = solution.iterations;
  out.message = contradictions(chain);
  const auto known = std::count(determined.begin(), determined.end(), true);
  if (known == 0) {
    out.status = Status::too_few_lamps;
    out.message = "nothing determines any pose";
  } else if (known < static_cast<std::ptrdiff_t>(determined.size())) {
    out.status = Status::degenerate;
    out.message = undetermined(chain, determined) + " not determined" +
                  (out.message.empty() ? "" : "; " + out.message);
  } else if (!solution.converged) {
    out.status = Status::not_converged;
    out.message = "not converged after " + std::to_string(solution.iterations) + " iterations";
  }
  return out;
}

template ChainSolution<SpatialBody> solved(Chain<SpatialBody>&, std::vector<Rigid3>,
                                           const SmootherOptions&);
template ChainSolution<PlanarBody> solved(Chain<PlanarBody>&, std::vector<PlanarPose>,
                                          const SmootherOptions&);
template Result<Smoothing<SmoothedPose>> to_result(const Chain<SpatialBody>&,
                                                   const ChainSolution<SpatialBody>&);
template Result<Smoothing<SmoothedPlanarPose>> to_result(const Chain<PlanarBody>&,
                                                         const ChainSolution<PlanarBody>&);

}  // namespace occ::internal::smooth
