// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/smooth/internal/chain_branches.hpp"

namespace occ::internal::smooth {
namespace {

constexpr std::size_t max_others = 8;
/// Factor of the iterations for a minimum that has not converged but has reached the lowest chi2.
constexpr int times_longer = 10;
/// Contradicted links whose sides are tried as starts; more are taken for odometry that fails.
constexpr int max_tried_links = 4;

std::ptrdiff_t at(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

template <class Body>
using Poses = std::vector<typename Body::Pose>;

/// Nodes first to last with the links between them.
template <class Body>
Chain<Body> part_of(const Chain<Body>& chain, std::size_t first, std::size_t last) {
  Chain<Body> part;
  part.body = chain.body;
  part.sighting_corner = chain.sighting_corner;
  part.odometry_corner = chain.odometry_corner;
  part.nodes.assign(chain.nodes.begin() + at(first), chain.nodes.begin() + at(last) + 1);
  part.links.assign(chain.links.begin() + at(first), chain.links.begin() + at(last));
  return part;
}

template <class Body>
bool is_one_part(const Chain<Body>& chain) {
  return std::all_of(chain.links.begin(), chain.links.end(),
                     [](const Link<Body>& link) { return link.exists; });
}

template <class Body>
bool has_contradiction(const Chain<Body>& chain) {
  return std::any_of(chain.links.begin(), chain.links.end(),
                     [](const Link<Body>& link) { return link.report.contradicted; });
}

/// True if a minimum is improbable if all data are right.
template <class Body>
bool is_alarm(const ChainMinimum<Body>& minimum) {
  if (has_contradiction(minimum.chain)) return true;
  const int dof = minimum.chain.rows() - Body::size * static_cast<int>(minimum.chain.nodes.size());
  return minimum.chi2 > chi2_quantile(1 - max_risk, std::max(1, dof));
}

/// Minima of one linked part of a chain.
template <class Body>
class PartSearch {
 public:
  PartSearch(Chain<Body> part, const SmootherOptions& options)
      : part_(std::move(part)), options_(options) {
    for (Link<Body>& link : part_.links) {  // blamed again, if the minimum contradicts it
      link.cleared = link.report.contradicted = false;
      link.report.factor = 1;
    }
  }

  /// `fallback` starts a part in which no node determines its pose.
  std::vector<ChainMinimum<Body>> run(const Poses<Body>& start,
                                      const typename Body::Pose& fallback) {
    if (!start.empty()) add(start);
    for (const auto& branch : branch_starts(part_, options_, TimeDirection::forward))
      add(branch.poses);
    if (minima_.empty()) add(carried_along(fallback));
    if (is_alarm(minima_.front())) try_opposed();
    if (!minima_.front().solution.converged) {
      options_.max_iterations *= times_longer;
      const ChainMinimum<Body> unfinished = minima_.front();
      minima_.erase(minima_.begin());
      add(unfinished.chain, unfinished.solution.poses);
    }
    return std::move(minima_);
  }

 private:
  Poses<Body> carried_along(const typename Body::Pose& first) const {
    Poses<Body> poses = {first};
    for (const Link<Body>& link : part_.links)
      poses.push_back(Body::after(poses.back(), link.step));
    return poses;
  }

  /// Keeps the minima sorted, and one of those that are the same.
  void add(Poses<Body> start) { add(part_, std::move(start)); }

  void add(Chain<Body> chain, Poses<Body> start) {
    ChainMinimum<Body> found{std::move(chain), {}, 0};
    found.solution = solved(found.chain, std::move(start), options_);
    found.chi2 = compared_chi2(found.chain, found.solution, options_);
    for (ChainMinimum<Body>& known : minima_) {
      if (!same_minimum(known.solution, found.solution)) continue;
      const bool better = found.solution.converged == known.solution.converged
                              ? found.chi2 < known.chi2
                              : found.solution.converged;
      if (better) known = std::move(found);
      std::stable_sort(minima_.begin(), minima_.end(), lower);
      return;
    }
    minima_.insert(std::upper_bound(minima_.begin(), minima_.end(), found, lower),
                   std::move(found));
  }

  void try_opposed() {
    for (const auto& branch : branch_starts(part_, options_, TimeDirection::backward))
      add(branch.poses);
    const ChainMinimum<Body> best = minima_.front();
    int tried = 0;
    for (std::size_t k = 0; k < best.chain.links.size() && tried < max_tried_links; ++k) {
      if (!best.chain.links[k].report.contradicted) continue;
      ++tried;
      Poses<Body> before = best.solution.poses, after = before;
      for (std::size_t i = k + 1; i-- > 0;) {
        before[i] = Body::before(before[i + 1], part_.links[i].step);
        if (i > 0 && best.chain.links[i - 1].report.contradicted) break;
      }
      for (std::size_t i = k + 1; i < after.size(); ++i) {
        after[i] = Body::after(after[i - 1], part_.links[i - 1].step);
        if (i < part_.links.size() && best.chain.links[i].report.contradicted) break;
      }
      add(std::move(before));
      add(std::move(after));
    }
  }

  static bool lower(const ChainMinimum<Body>& a, const ChainMinimum<Body>& b) {
    return a.chi2 < b.chi2;
  }

  Chain<Body> part_;
  SmootherOptions options_;
  std::vector<ChainMinimum<Body>> minima_;
};

template <class Body>
ChainMinimum<Body> blank(const Chain<Body>& chain) {
  ChainMinimum<Body> out;
  const std::size_t count = chain.nodes.size();
  out.chain = chain;
  out.solution.poses.resize(count);
  out.solution.covariance.diagonal.assign(count, Body::Block::Zero());
  out.solution.covariance.coupling.assign(chain.links.size(), Body::Block::Zero());
  out.solution.covariance.determined.assign(count, false);
  out.solution.converged = true;
  return out;
}

/// Writes a part's solution into that of the whole chain.
template <class Body>
void write_part(const ChainSolution<Body>& from, std::size_t first, ChainSolution<Body>& to) {
  const auto copy = [&](const auto& some, auto& all) {
    std::copy(some.begin(), some.end(), all.begin() + at(first));
  };
  copy(from.poses, to.poses);
  copy(from.covariance.diagonal, to.covariance.diagonal);
  copy(from.covariance.coupling, to.covariance.coupling);
  copy(from.covariance.determined, to.covariance.determined);
}

template <class Body>
void write_part(const ChainMinimum<Body>& part, std::size_t first, ChainMinimum<Body>& whole) {
  std::copy(part.chain.nodes.begin(), part.chain.nodes.end(),
            whole.chain.nodes.begin() + at(first));
  std::copy(part.chain.links.begin(), part.chain.links.end(),
            whole.chain.links.begin() + at(first));
  write_part(part.solution, first, whole.solution);
  whole.solution.cost += part.solution.cost;
  whole.solution.iterations += part.solution.iterations;
  whole.solution.converged = whole.solution.converged && part.solution.converged;
  whole.chi2 += part.chi2;
}

/// Another minimum of one part.
template <class Body>
struct OtherPart {
  std::size_t first;
  ChainSolution<Body> solution;
  double excess;  ///< difference of its cost to the best one
  double ratio;   ///< likelihood ratio to the best
};

template <class Body>
void add_others(std::vector<OtherPart<Body>>& others, ChainMinima<Body>& out) {
  std::stable_sort(
      others.begin(), others.end(),
      [](const OtherPart<Body>& a, const OtherPart<Body>& b) { return a.ratio > b.ratio; });
  for (const auto& other : others) {
    if (other.ratio < 0.01 * max_risk || out.others.size() == 4 * max_others) break;
    OtherMinimum<Body> whole{out.best.solution, other.ratio};
    write_part(other.solution, other.first, whole.solution);
    whole.solution.cost += other.excess;
    out.others.push_back(std::move(whole));
  }
}

}  // namespace

template <class Body>
double compared_chi2(const Chain<Body>& chain, const ChainSolution<Body>& solution,
                     const SmootherOptions& options) {
  double chi2 = 2 * solution.cost;
  for (const Link<Body>& link : chain.links) chi2 += gross_error_chi2(link, options);
  for (const Node<Body>& node : chain.nodes) chi2 += outside_chi2(chain, node);
  return chi2;
}

template <class Body>
bool same_minimum(const ChainSolution<Body>& a, const ChainSolution<Body>& b) {
  constexpr double same_chi2 = 1;
  for (std::size_t k = 0; k < a.poses.size(); ++k) {
    if (!a.covariance.determined[k]) continue;
    const typename Body::Part apart = Body::difference(b.poses[k], a.poses[k]);
    if (!(apart.dot(core::solve_llt(a.covariance.diagonal[k], apart)) < same_chi2)) return false;
  }
  return true;
}

template <class Body>
ChainMinima<Body> minima_of(Chain<Body> chain, const Poses<Body>& start,
                            const SmootherOptions& options) {
  set_corners(chain, options);
  ChainMinima<Body> out;
  if (is_one_part(chain)) {  // without copies
    auto minima = PartSearch<Body>(std::move(chain), options).run(start, {});
    for (std::size_t i = 1; i < minima.size(); ++i)
      out.others.push_back(
          {std::move(minima[i].solution), std::exp(-0.5 * (minima[i].chi2 - minima.front().chi2))});
    out.best = std::move(minima.front());
    settle_risk(out);
    return out;
  }
  out.best = blank(chain);
  std::vector<OtherPart<Body>> others;
  const std::size_t count = chain.nodes.size();
  typename Body::Pose fallback{};
  for (std::size_t first = 0, last = 0; first < count; first = ++last) {
    while (last + 1 < count && chain.links[last].exists) ++last;
    Poses<Body> own;
    if (!start.empty()) own.assign(start.begin() + at(first), start.begin() + at(last) + 1);
    const auto minima = PartSearch<Body>(part_of(chain, first, last), options).run(own, fallback);
    const ChainMinimum<Body>& best = minima.front();
    write_part(best, first, out.best);
    fallback = best.solution.poses.back();
    for (std::size_t i = 1; i < minima.size(); ++i)
      others.push_back({first, minima[i].solution, minima[i].solution.cost - best.solution.cost,
                        std::exp(-0.5 * (minima[i].chi2 - best.chi2))});
  }
  add_others(others, out);
  settle_risk(out);
  return out;
}

template <class Body>
void settle_risk(ChainMinima<Body>& minima) {
  std::vector<OtherMinimum<Body>>& others = minima.others;
  minima.risk = 0;
  for (const OtherMinimum<Body>& other : others) minima.risk += other.ratio;
  minima.risk /= 1 + minima.risk;
  if (minima.risk < max_risk) return others.clear();
  while (others.size() > 1 && (others.back().ratio < max_risk || others.size() > max_others))
    others.pop_back();
}

template <class Body>
std::vector<ChainMinimum<Body>> minima_at(const Chain<Body>& chain, std::size_t k,
                                          const Poses<Body>& start,
                                          const SmootherOptions& options) {
  std::size_t first = k, last = k;
  while (first > 0 && chain.links[first - 1].exists) --first;
  while (last + 1 < chain.nodes.size() && chain.links[last].exists) ++last;
  Chain<Body> part = part_of(chain, first, last);
  set_corners(part, options);
  const Poses<Body> own(start.begin() + at(first), start.begin() + at(last) + 1);
  std::vector<ChainMinimum<Body>> out;
  for (ChainMinimum<Body>& minimum : PartSearch<Body>(std::move(part), options).run(own, own[0])) {
    ChainMinimum<Body> whole = blank(chain);
    whole.solution.poses = start;
    write_part(minimum, first, whole);
    out.push_back(std::move(whole));
  }
  return out;
}

template double compared_chi2(const Chain<SpatialBody>&, const ChainSolution<SpatialBody>&,
                              const SmootherOptions&);
template double compared_chi2(const Chain<PlanarBody>&, const ChainSolution<PlanarBody>&,
                              const SmootherOptions&);
template bool same_minimum(const ChainSolution<SpatialBody>&, const ChainSolution<SpatialBody>&);
template bool same_minimum(const ChainSolution<PlanarBody>&, const ChainSolution<PlanarBody>&);
template ChainMinima<SpatialBody> minima_of(Chain<SpatialBody>, const std::vector<Rigid3>&,
                                            const SmootherOptions&);
template ChainMinima<PlanarBody> minima_of(Chain<PlanarBody>, const std::vector<PlanarPose>&,
                                           const SmootherOptions&);
template void settle_risk(ChainMinima<SpatialBody>&);
template void settle_risk(ChainMinima<PlanarBody>&);
template std::vector<ChainMinimum<SpatialBody>> minima_at(const Chain<SpatialBody>&, std::size_t,
                                                          const std::vector<Rigid3>&,
                                                          const SmootherOptions&);
template std::vector<ChainMinimum<PlanarBody>> minima_at(const Chain<PlanarBody>&, std::size_t,
                                                         const std::vector<PlanarPose>&,
                                                         const SmootherOptions&);

}  // namespace occ::internal::smooth
