// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_window.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/smooth/internal/chain_branches.hpp"
#include "libocc/smooth/internal/chain_result.hpp"
#include "libocc/smooth/internal/chain_start.hpp"

namespace occ::internal::smooth {
namespace {

constexpr double near_sigmas = 5;  // limit of the mean residual of a node
/// Branches remain open for longer than they count as alternatives: their priors are linearised.
constexpr double kept_branch_chi2 = 2 * open_chi2;
constexpr std::size_t max_branches = 8;

/// Pseudo-inverse of A: undetermined directions get 0.
template <class Block>
Block pseudo_inverse(const Block& a) {
  Eigen::Matrix<double, Block::RowsAtCompileTime, 1> unit = a.diagonal();
  for (auto& value : unit) value = value > 0 ? 1 / std::sqrt(value) : 0;
  const Block scaled = unit.asDiagonal() * a * unit.asDiagonal();
  const auto eigen = core::symmetric_eigen<Block>(scaled);
  Block out = Block::Zero();
  for (int i = 0; i < Block::RowsAtCompileTime; ++i) {
    if (eigen.eigenvalues()[i] < 1e-13) continue;
    const auto axis = unit.cwiseProduct(eigen.eigenvectors().col(i)).eval();
    out += axis * axis.transpose() / eigen.eigenvalues()[i];
  }
  return out;
}

/// Errors that reach the next pose, each once; of too many, the first become independent.
template <int size>
CommonErrors<size> limited(const CommonErrors<size>& errors) {
  constexpr Eigen::Index max_errors = 192;  // positions of sixty points
  CommonErrors<size> merged;
  merged.counted = errors.counted;
  for (std::size_t j = 0; j < errors.numbers.size(); ++j) {
    const auto column = errors.columns.col(static_cast<Eigen::Index>(j));
    const auto known = std::find(merged.numbers.begin(), merged.numbers.end(), errors.numbers[j]);
    if (known != merged.numbers.end())
      merged.columns.col(known - merged.numbers.begin()) += column;
    else
      merged.append({errors.numbers[j]}, column);
  }
  const Eigen::Index excess = merged.columns.cols() - max_errors;
  if (excess <= 0) return merged;
  const auto dropped = merged.columns.leftCols(excess);
  merged.counted -= dropped * dropped.transpose();
  merged.columns = merged.columns.rightCols(max_errors).eval();
  merged.numbers.erase(merged.numbers.begin(), merged.numbers.begin() + excess);
  return merged;
}

template <class Body>
std::size_t position_of(const std::vector<Node<Body>>& nodes, double time_s) {
  const auto place =
      std::lower_bound(nodes.begin(), nodes.end(), time_s - same_time_s,
                       [](const Node<Body>& node, double time) { return node.time_s < time; });
  return static_cast<std::size_t>(place - nodes.begin());
}

}  // namespace

template <class Body>
ChainWindow<Body>::ChainWindow(const Body& body, const WindowOptions& options)
    : body_(body), options_(options) {
  options_.validate();
}

template <class Body>
void ChainWindow<Body>::restart() {
  branches_.clear();
  pieces_ = OdometryPieces<Body>(true);
}

template <class Body>
bool ChainWindow<Body>::add_odometry(const typename Body::Piece& piece) {
  OdometryPieces<Body>::validate(piece, "odometry");
  if (piece.from_s < pieces_.end_s() - same_time_s) return false;
  pieces_.add(piece);
  return true;
}

template <class Body>
typename ChainWindow<Body>::Estimate ChainWindow<Body>::add(
    double time_s, const std::function<void(Node<Body>&)>& put) {
  if (branches_.empty()) {
    branches_.resize(1);
    branches_.front().minimum.chain.body = body_;
  }
  const auto& nodes = branches_.front().minimum.chain.nodes;
  const bool before = !nodes.empty() && time_s < nodes.front().time_s - same_time_s;
  const std::size_t k = position_of(nodes, time_s);
  const bool fresh = k == nodes.size() || nodes[k].time_s > time_s + same_time_s;
  std::vector<Branch> found;
  for (Branch& branch : branches_) {
    Chain<Body>& chain = branch.minimum.chain;
    bool settled = !link_late(chain);
    std::size_t at = k;
    if (!before) {
      if (fresh) insert_node(branch, k, time_s);
      put(chain.nodes[k]);
      if (options_.smoothing.clock_sigma_s > 0) chain.set_velocities();
      settled = settled && is_settled(branch, k);
      if (chain.nodes.size() > static_cast<std::size_t>(options_.poses)) {
        forget_oldest(branch);
        at = k > 0 ? k - 1 : 0;
      }
    }
    update(std::move(branch), at, settled, found);
  }
  keep_plausible(std::move(found));
  pieces_.forget_before(branches_.front().minimum.chain.nodes.front().time_s);
  Estimate out = estimate();
  if (!before) return out;
  out.value.used = false;
  std::ostringstream text;
  text << time_s << " s is before the window's oldest pose, "
       << out.value.window.poses.front().time_s << " s: not used";
  out.message = text.str() + (out.message.empty() ? "" : "; " + out.message);
  return out;
}

template <class Body>
void ChainWindow<Body>::insert_node(Branch& branch, std::size_t k, double time_s) const {
  const auto at = static_cast<std::ptrdiff_t>(k);
  Chain<Body>& chain = branch.minimum.chain;
  std::vector<Pose>& poses = branch.minimum.solution.poses;
  chain.nodes.emplace(chain.nodes.begin() + at)->time_s = time_s;
  poses.insert(poses.begin() + at, Pose{});
  if (chain.nodes.size() > 1) {
    chain.links.emplace(chain.links.begin() + (k > 0 ? at - 1 : 0));
    if (k > 0) link(chain, k - 1);
    if (k + 1 < chain.nodes.size()) link(chain, k);
  }
  poses[k] = expected(branch, k);
}

template <class Body>
void ChainWindow<Body>::link(Chain<Body>& chain, std::size_t k) const {
  const double from_s = chain.nodes[k].time_s, to_s = chain.nodes[k + 1].time_s;
  const auto step = pieces_.between(from_s, to_s);
  chain.links[k] = step ? made_link<Body>(*step, from_s, to_s, true, options_.smoothing)
                        : walk_link<Body>(from_s, to_s, options_.smoothing);
}

/// Adds odometry that arrived after its frames; returns true if there is any.
template <class Body>
bool ChainWindow<Body>::link_late(Chain<Body>& chain) const {
  bool any = false;
  for (std::size_t k = 0; k < chain.links.size(); ++k) {
    if (chain.links[k].report.odometry) continue;
    link(chain, k);
    any = any || chain.links[k].report.odometry;
  }
  return any;
}

template <class Body>
typename Body::Pose ChainWindow<Body>::expected(const Branch& branch, std::size_t k) const {
  const Chain<Body>& chain = branch.minimum.chain;
  const std::vector<Pose>& poses = branch.minimum.solution.poses;
  if (k > 0)
    return chain.links[k - 1].exists ? Body::after(poses[k - 1], chain.links[k - 1].step)
                                     : poses[k - 1];
  if (poses.size() > 1 && chain.links[0].exists) return Body::before(poses[1], chain.links[0].step);
  return {};
}

/// True if the node's pose is predicted so well that it can lead to no other minimum. The
/// covariances are those before the node was added.
template <class Body>
bool ChainWindow<Body>::is_settled(const Branch& branch, std::size_t k) const {
  const Chain<Body>& chain = branch.minimum.chain;
  const ChainSolution<Body>& solution = branch.minimum.solution;
  if (k == 0 || !chain.links[k - 1].exists || !solution.covariance.determined[k - 1]) return false;
  const Pose predicted = expected(branch, k);
  const auto covariance =
      carried_covariance(chain.links[k - 1], solution.poses[k - 1], predicted,
                         solution.covariance.diagonal[k - 1], TimeDirection::forward);
  return is_narrow(body_, chain.nodes[k], predicted, covariance);
}

template <class Body>
void ChainWindow<Body>::forget_oldest(Branch& branch) const {
  Chain<Body>& chain = branch.minimum.chain;
  std::vector<Pose>& poses = branch.minimum.solution.poses;
  ChainNormals<Body::size> normals(chain.nodes.size());
  const std::vector<bool>& determined = branch.minimum.solution.covariance.determined;
  double cost = chain.node_cost(0, poses[0], &normals.own[0], &normals.gradient[0]);
  // The normal equations of a pose that is not determined hold at an arbitrary pose.
  if (chain.links.front().exists && !determined.empty() && determined.front()) {
    cost += chain.link_cost(0, poses);
    chain.add_link(0, poses, normals);
    const auto inverse = pseudo_inverse<typename Body::Block>(normals.diagonal(0));
    const typename Body::Block carried = normals.coupling[0].transpose() * inverse;
    const typename Body::Block information = normals.to[0] - carried * normals.coupling[0];
    const typename Body::Part gradient = normals.gradient[1] - carried * normals.gradient[0];
    auto prior = quadratic<Pose, Body::size>(poses[1], information, gradient);
    if (chain.has_errors()) {
      const typename Body::Block d_pose = -carried.transpose();
      prior.errors = limited(chain.errors_at(0, poses[0]).mapped(d_pose));
    }
    cost -= 0.5 * normals.gradient[0].dot(inverse * normals.gradient[0]) +
            0.5 * (prior.root * prior.offset).squaredNorm();
    chain.nodes[1].priors.push_back(prior);
    branch.forgotten_chi2 += gross_error_chi2(chain.links[0], options_.smoothing);
  }
  branch.forgotten_chi2 += 2 * cost + outside_chi2(chain, chain.nodes[0]);
  chain.nodes.erase(chain.nodes.begin());
  chain.links.erase(chain.links.begin());
  poses.erase(poses.begin());
}

template <class Body>
int ChainWindow<Body>::contradictions(const Branch& branch) {
  const auto& links = branch.minimum.chain.links;
  return static_cast<int>(std::count_if(
      links.begin(), links.end(), [](const Link<Body>& link) { return link.report.contradicted; }));
}

template <class Body>
void ChainWindow<Body>::solve(Branch& branch) const {
  ChainMinimum<Body>& m = branch.minimum;
  m.solution = solved(m.chain, m.solution.poses, options_.smoothing);
  m.chi2 = compared_chi2(m.chain, m.solution, options_.smoothing);
}

/// Adds all minima of the branch's window.
template <class Body>
void ChainWindow<Body>::search(const Branch& branch, std::size_t k,
                               std::vector<Branch>& found) const {
  for (ChainMinimum<Body>& minimum :
       minima_at(branch.minimum.chain, k, branch.minimum.solution.poses, options_.smoothing)) {
    Branch other{std::move(minimum), branch.forgotten_chi2};
    solve(other);
    found.push_back(std::move(other));
  }
}

/// Before odometry or most sightings of the node are contradicted, all minima are searched.
template <class Body>
void ChainWindow<Body>::update(Branch branch, std::size_t k, bool settled,
                               std::vector<Branch>& found) const {
  if (!settled) return search(branch, k, found);
  const Branch given = branch;
  solve(branch);
  const ChainMinimum<Body>& m = branch.minimum;
  if (contradictions(branch) > contradictions(given) ||
      !fits(m.chain, k, m.solution.poses[k], near_sigmas))
    return search(given, k, found);
  found.push_back(std::move(branch));
}

template <class Body>
void ChainWindow<Body>::keep_plausible(std::vector<Branch> found) {
  std::stable_sort(found.begin(), found.end(),
                   [](const Branch& a, const Branch& b) { return a.chi2() < b.chi2(); });
  branches_.clear();
  for (Branch& branch : found) {
    if (!branches_.empty() && !(branch.chi2() < branches_.front().chi2() + kept_branch_chi2)) break;
    if (branches_.size() == max_branches) break;
    const bool known = std::any_of(branches_.begin(), branches_.end(), [&](const Branch& other) {
      return same_minimum(other.minimum.solution, branch.minimum.solution);
    });
    if (!known) branches_.push_back(std::move(branch));
  }
  const double best = branches_.front().forgotten_chi2;
  for (Branch& branch : branches_) branch.forgotten_chi2 -= best;
}

template <class Body>
typename ChainWindow<Body>::Estimate ChainWindow<Body>::estimate() const {
  ChainMinima<Body> minima{branches_.front().minimum, 0, {}};
  for (std::size_t i = 1; i < branches_.size(); ++i) {
    const double ratio = std::exp(0.5 * (branches_.front().chi2() - branches_[i].chi2()));
    minima.others.push_back({branches_[i].minimum.solution, ratio});
  }
  settle_risk(minima);
  auto found = to_result(minima);
  Estimate out;
  out.status = found.status;
  out.message = std::move(found.message);
  out.value.window = std::move(found.value);
  out.value.newest = out.value.window.poses.back();
  return out;
}

template class ChainWindow<SpatialBody>;
template class ChainWindow<PlanarBody>;

}  // namespace occ::internal::smooth
