// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_solver.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

template <class Body>
void set_corners(Chain<Body>& chain, const SmootherOptions& options) {
  if (options.huber_sigmas > 0) chain.sighting_corner = options.huber_sigmas;
  if (options.link_gate > 0)
    chain.odometry_corner = std::sqrt(chi2_quantile(1 - options.link_gate, Body::size));
}

template <class Body>
ChainSolution<Body> solved(Chain<Body>& chain, std::vector<typename Body::Pose> poses,
                           const SmootherOptions& options) {
  set_corners(chain, options);
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

template void set_corners(Chain<SpatialBody>&, const SmootherOptions&);
template void set_corners(Chain<PlanarBody>&, const SmootherOptions&);
template ChainSolution<SpatialBody> solved(Chain<SpatialBody>&, std::vector<Rigid3>,
                                           const SmootherOptions&);
template ChainSolution<PlanarBody> solved(Chain<PlanarBody>&, std::vector<PlanarPose>,
                                          const SmootherOptions&);

}  // namespace occ::internal::smooth
