// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_branches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/smooth/internal/chain_start.hpp"

namespace occ::internal::smooth {
namespace {

/// Hypotheses are estimated to first order only: they stay open for longer than minima.
constexpr double kept_chi2 = 3 * open_chi2;
constexpr std::size_t max_hypotheses = 16;
constexpr std::size_t max_starts = 8;

double position_variance(const SpatialBody&, const Rigid3& pose, const Matrix6& covariance) {
  return position_covariance(pose, covariance).trace();
}

double position_variance(const PlanarBody&, const PlanarPose&, const Eigen::Matrix3d& covariance) {
  return covariance.topLeftCorner<2, 2>().trace();
}

template <class Body>
class Bank {
 public:
  using Pose = typename Body::Pose;
  using Block = typename Body::Block;
  using Part = typename Body::Part;

  Bank(const Chain<Body>& chain, const SmootherOptions& options, TimeDirection direction)
      : chain_(chain), options_(options), direction_(direction) {}

  std::vector<BranchStart<Body>> run() {
    const std::size_t count = chain_.nodes.size();
    std::vector<int> open;
    for (std::size_t step = 0; step < count; ++step) {
      const std::size_t k = direction_ == TimeDirection::forward ? step : count - 1 - step;
      open = open.empty() ? begun(k) : stepped(open, k);
    }
    return open.empty() ? together() : starts_of(open);
  }

 private:
  /// A pose at one node, after all observations so far.
  struct State {
    std::size_t node = 0;
    int parent = -1;
    Pose pose;
    Block information = Block::Zero();
    double chi2 = 0;
  };

  /// Two states that were merged.
  struct Merger {
    int loser = 0, winner = 0;
    double chi2 = 0;  ///< excess of the loser
  };

  std::size_t link_before(std::size_t k) const {
    return direction_ == TimeDirection::forward ? k - 1 : k;
  }

  /// Observations of one node as a chain, with sightings outside the domain at the pose aside.
  Chain<Body> alone(std::size_t k) const {
    Chain<Body> one;
    one.body = chain_.body;
    one.nodes = {chain_.nodes[k]};
    one.sighting_corner = chain_.sighting_corner;
    return one;
  }

  /// Minimum of the observations in `one`, with a wide prior so that it is regular.
  std::optional<State> fitted(Chain<Body>& one, const Pose& start, std::size_t k,
                              double tolerance) const {
    constexpr int max_steps = 30;
    State at;
    at.node = k;
    at.pose = start;
    one.set_aside({start});
    Part gradient = Part::Zero();
    double cost = one.node_cost(0, at.pose, &at.information, &gradient);
    if (!std::isfinite(cost)) return std::nullopt;
    double damping = 1e-9;
    for (int i = 0; i < max_steps; ++i) {
      Block regular = at.information;
      regular.diagonal() *= 1 + damping;
      regular.diagonal().array() += weak_;
      const core::Cholesky<Block> cholesky(regular);
      if (!cholesky.exists()) return std::nullopt;
      const Part delta = -cholesky.solve(gradient);
      const double fall = -gradient.dot(delta);
      if (fall < tolerance) break;
      const Pose next = Body::moved(at.pose, delta);
      Block information = Block::Zero();
      Part slope = Part::Zero();
      const double trial = one.node_cost(0, next, &information, &slope);
      if (!(trial < cost)) {
        damping = std::max(1e-4, 10 * damping);
        if (damping > 1e8) break;
        continue;
      }
      at.pose = next;
      at.information = information;
      gradient = slope;
      cost = trial;
      damping /= 10;
    }
    at.chi2 = 2 * cost + outside_chi2(one, one.nodes[0]);
    return at;
  }

  int add(State state) {
    states_.push_back(std::move(state));
    return static_cast<int>(states_.size()) - 1;
  }

  const std::vector<Pose>& roots(std::size_t k) {
    if (!roots_ || roots_k_ != k) {
      roots_ = poses_alone(chain_.body, chain_.nodes[k]);
      roots_k_ = k;
    }
    return *roots_;
  }

  std::vector<int> begun(std::size_t k) {
    constexpr double tolerance = 1e-3;
    std::vector<State> found;
    Chain<Body> one = alone(k);
    for (const Pose& root : roots(k)) {
      auto state = fitted(one, root, k, tolerance);
      if (state) found.push_back(*state);
    }
    return kept(found);
  }

  /// Adds a prediction to `one` and returns its covariance.
  Block predict(Chain<Body>& one, const State& from, const Pose& predicted, std::size_t k) const {
    Block regular = from.information;
    regular.diagonal().array() += weak_;
    const Block covariance = carried_covariance<Body>(
        chain_.links[link_before(k)], from.pose, predicted,
        core::solve_llt<Block, Block>(regular, Block::Identity()), direction_);
    Quadratic<Pose, Body::size> prior;
    prior.about = predicted;
    prior.root = core::Cholesky<Block>(covariance).template solve_lower<Block>(Block::Identity());
    prior.offset.setZero();
    one.nodes[0].priors.push_back(prior);
    return covariance;
  }

  std::vector<int> stepped(const std::vector<int>& open, std::size_t k) {
    constexpr double tolerance = 1e-2;
    std::vector<State> found;
    double least = std::numeric_limits<double>::infinity(), rise = least;
    Chain<Body> one = alone(k);
    for (const int parent : open) {
      const State from = states_[static_cast<std::size_t>(parent)];
      const auto& step = chain_.links[link_before(k)].step;
      const Pose predicted = direction_ == TimeDirection::forward ? Body::after(from.pose, step)
                                                                  : Body::before(from.pose, step);
      const Block covariance = predict(one, from, predicted, k);
      std::vector<Pose> starts = {predicted};
      if (!is_narrow(chain_.body, chain_.nodes[k], predicted, covariance))
        starts.insert(starts.end(), roots(k).begin(), roots(k).end());
      for (const Pose& start : starts) {
        auto state = fitted(one, start, k, tolerance);
        if (!state) continue;
        rise = std::min(rise, state->chi2);
        state->chi2 += from.chi2;
        state->parent = parent;
        least = std::min(least, state->chi2);
        found.push_back(*state);
      }
      one.nodes[0].priors.pop_back();
    }
    if (is_blamable(k, rise)) blame(open, k, one, found);
    return kept(found);
  }

  /// True if the frame contradicts all hypotheses, and odometry may be a gross error.
  bool is_blamable(std::size_t k, double rise) const {
    constexpr double tail = 1e-3;
    const Link<Body>& link = chain_.links[link_before(k)];
    if (!link.report.odometry || !(options_.link_gate > 0)) return false;
    double rows = 0;
    for (const View& view : chain_.nodes[k].views)
      rows += 2 * static_cast<double>(view.root.size());
    for (const auto& reading : chain_.nodes[k].readings)
      rows += static_cast<double>(reading.root.rows());
    for (const auto& prior : chain_.nodes[k].priors) rows += static_cast<double>(prior.root.rows());
    return rows > 0 && !(rise < chi2_quantile(1 - tail, rows));
  }

  /// Adds the poses of the frame itself, behind a gross error of odometry.
  void blame(const std::vector<int>& open, std::size_t k, Chain<Body>& one,
             std::vector<State>& found) {
    constexpr double tolerance = 1e-3;
    int parent = open.front();
    for (const int i : open)
      if (states_[i].chi2 < states_[parent].chi2) parent = i;
    for (const Pose& root : roots(k)) {
      auto state = fitted(one, root, k, tolerance);
      if (!state) continue;
      state->chi2 += states_[parent].chi2 + gross_error_chi2(options_);
      state->parent = parent;
      found.push_back(*state);
    }
  }

  /// Merges states at one place, deletes implausible ones, and stores the others.
  std::vector<int> kept(std::vector<State>& found) {
    constexpr double same_chi2 = 1;
    std::stable_sort(found.begin(), found.end(),
                     [](const State& a, const State& b) { return a.chi2 < b.chi2; });
    std::vector<int> out;
    for (State& state : found) {
      if (!out.empty() && state.chi2 > states_[out.front()].chi2 + kept_chi2) break;
      const auto same = std::find_if(out.begin(), out.end(), [&](int i) {
        const Part apart = Body::difference(state.pose, states_[i].pose);
        Block information = states_[i].information;
        information.diagonal().array() += weak_;
        return apart.dot(information * apart) < same_chi2;
      });
      if (same == out.end()) {
        if (out.size() < max_hypotheses) out.push_back(add(std::move(state)));
      } else if (state.parent != states_[*same].parent) {
        const double excess = state.chi2 - states_[*same].chi2;
        mergers_.push_back({add(std::move(state)), *same, excess});
      }
    }
    return out;
  }

  /// Poses of a state and its ancestors; those before the first state follow from the links.
  void write_path(int state, std::vector<Pose>& poses) const {
    std::size_t k = states_[static_cast<std::size_t>(state)].node;
    for (; state >= 0; state = states_[static_cast<std::size_t>(state)].parent) {
      k = states_[static_cast<std::size_t>(state)].node;
      poses[k] = states_[static_cast<std::size_t>(state)].pose;
    }
    if (direction_ == TimeDirection::forward) {
      for (; k > 0; --k) poses[k - 1] = Body::before(poses[k], chain_.links[k - 1].step);
    } else {
      for (; k + 1 < poses.size(); ++k) poses[k + 1] = Body::after(poses[k], chain_.links[k].step);
    }
  }

  /// Starts of a chain in which no frame alone determines its pose.
  std::vector<BranchStart<Body>> together() const {
    const auto seen = [](const Node<Body>& node) {
      std::size_t count = 0;
      for (const View& view : node.views) count += view.root.size();
      return count;
    };
    const auto most = std::max_element(
        chain_.nodes.begin(), chain_.nodes.end(),
        [&](const Node<Body>& a, const Node<Body>& b) { return seen(a) < seen(b); });
    const auto at = static_cast<std::size_t>(most - chain_.nodes.begin());
    std::vector<BranchStart<Body>> out;
    for (const Pose& pose : poses_together(chain_, at)) {
      std::vector<Pose> poses(chain_.nodes.size());
      poses[at] = pose;
      for (std::size_t k = at; k + 1 < poses.size(); ++k)
        poses[k + 1] = Body::after(poses[k], chain_.links[k].step);
      for (std::size_t k = at; k > 0; --k)
        poses[k - 1] = Body::before(poses[k], chain_.links[k - 1].step);
      out.push_back({std::move(poses), 0});
    }
    return out;
  }

  std::vector<BranchStart<Body>> starts_of(const std::vector<int>& open) const {
    std::vector<BranchStart<Body>> out;
    if (open.empty()) return out;
    BranchStart<Body> best{std::vector<Pose>(chain_.nodes.size()), states_[open.front()].chi2};
    write_path(open.front(), best.poses);
    std::vector<char> on_best(states_.size());
    for (int i = open.front(); i >= 0; i = states_[i].parent) on_best[i] = 1;
    const auto add_start = [&](int state, double chi2) {
      if (chi2 > best.chi2 + kept_chi2) return;
      out.push_back({best.poses, chi2});
      write_path(state, out.back().poses);
    };
    for (std::size_t i = 1; i < open.size(); ++i) add_start(open[i], states_[open[i]].chi2);
    for (const Merger& merger : mergers_)
      if (on_best[merger.winner]) add_start(merger.loser, best.chi2 + merger.chi2);
    std::stable_sort(out.begin(), out.end(),
                     [](const auto& a, const auto& b) { return a.chi2 < b.chi2; });
    out.insert(out.begin(), std::move(best));
    if (out.size() > max_starts) out.resize(max_starts);
    return out;
  }

  const Chain<Body>& chain_;
  const SmootherOptions& options_;
  TimeDirection direction_;
  /// Information of a prior of 1e4 rad and m, so that singular information is regular.
  const double weak_ = 1e-8;
  std::vector<State> states_;
  std::vector<Merger> mergers_;
  std::optional<std::vector<Pose>> roots_;
  std::size_t roots_k_ = 0;
};

}  // namespace

double gross_error_chi2(const SmootherOptions& options) {
  return options.link_gate > 0 ? -2 * std::log(options.link_gate)
                               : std::numeric_limits<double>::infinity();
}

template <class Body>
double gross_error_chi2(const Link<Body>& link, const SmootherOptions& options) {
  if (!link.report.contradicted) return 0;
  return Body::size * std::log(link.report.factor) + gross_error_chi2(options);
}

template <class Body>
double outside_chi2(const Chain<Body>& chain, const Node<Body>& node) {
  double sum = 0;
  for (const View& view : node.views) {
    const double diagonal_px = std::hypot(view.frame.camera.width(), view.frame.camera.height());
    for (std::size_t i = 0; i < view.root.size(); ++i)
      if (view.aside[i])
        sum += 2 * core::huber_loss(0.5 * square(diagonal_px) * view.root[i].squaredNorm(),
                                    chain.sighting_corner);
  }
  return sum;
}

template <class Body>
bool is_narrow(const Body& body, const Node<Body>& node, const typename Body::Pose& predicted,
               const typename Body::Block& covariance) {
  // At 5 sigmas, the directions to the points are linear in the position to 10 %.
  constexpr double sigmas = 5, share = 0.1;
  double nearest_m = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d origin = body.body_from_world(predicted).origin_in_source();
  for (const View& view : node.views)
    for (const PointSighting& seen : view.frame.sightings)
      nearest_m = std::min(nearest_m, (seen.point_in_world - origin).norm());
  return square(sigmas) * position_variance(body, predicted, covariance) <
         square(share * nearest_m);
}

template <class Body>
typename Body::Block carried_covariance(const Link<Body>& link, const typename Body::Pose& from,
                                        const typename Body::Pose& to,
                                        const typename Body::Block& covariance,
                                        TimeDirection direction) {
  using Block = typename Body::Block;
  Block d_from, d_to;
  if (direction == TimeDirection::forward)
    Body::residual(from, to, link.step, &d_from, &d_to);
  else
    Body::residual(to, from, link.step, &d_to, &d_from);
  // residual = d_from delta_from + d_to delta_to, with the covariance of the step
  const Block solved = core::inverse<Block>(link.root * d_to);
  const Block carried = solved * link.root * d_from;
  return carried * covariance * carried.transpose() + solved * solved.transpose();
}

template <class Body>
std::vector<BranchStart<Body>> branch_starts(const Chain<Body>& chain,
                                             const SmootherOptions& options,
                                             TimeDirection direction) {
  return Bank<Body>(chain, options, direction).run();
}

template double gross_error_chi2(const Link<SpatialBody>&, const SmootherOptions&);
template double gross_error_chi2(const Link<PlanarBody>&, const SmootherOptions&);
template double outside_chi2(const Chain<SpatialBody>&, const Node<SpatialBody>&);
template double outside_chi2(const Chain<PlanarBody>&, const Node<PlanarBody>&);
template bool is_narrow(const SpatialBody&, const Node<SpatialBody>&, const Rigid3&,
                        const Matrix6&);
template bool is_narrow(const PlanarBody&, const Node<PlanarBody>&, const PlanarPose&,
                        const Eigen::Matrix3d&);
template Matrix6 carried_covariance(const Link<SpatialBody>&, const Rigid3&, const Rigid3&,
                                    const Matrix6&, TimeDirection);
template Eigen::Matrix3d carried_covariance(const Link<PlanarBody>&, const PlanarPose&,
                                            const PlanarPose&, const Eigen::Matrix3d&,
                                            TimeDirection);
template std::vector<BranchStart<SpatialBody>> branch_starts(const Chain<SpatialBody>&,
                                                             const SmootherOptions&, TimeDirection);
template std::vector<BranchStart<PlanarBody>> branch_starts(const Chain<PlanarBody>&,
                                                            const SmootherOptions&, TimeDirection);

}  // namespace occ::internal::smooth
