// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_window.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/smooth/internal/chain_solver.hpp"
#include "libocc/smooth/internal/chain_start.hpp"

namespace occ::internal::smooth {
namespace {

constexpr double near_sigmas = 5;  // limit of the residuals at the pose predicted by odometry

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

}  // namespace

template <class Body>
ChainWindow<Body>::ChainWindow(const Body& body, const WindowOptions& options) : options_(options) {
  options_.validate();
  chain_.body = body;
}

template <class Body>
void ChainWindow<Body>::restart() {
  const Body body = chain_.body;
  chain_ = {};
  chain_.body = body;
  poses_.clear();
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
  auto& nodes = chain_.nodes;
  if (!nodes.empty() && time_s < nodes.front().time_s - same_time_s) {
    Estimate out;
    if (!nodes.empty()) out = solve();
    out.value.used = false;
    std::ostringstream text;
    text << time_s << " s is before the window's oldest pose, " << nodes.front().time_s
         << " s: not used";
    out.message = text.str() + (out.message.empty() ? "" : "; " + out.message);
    return out;
  }
  const auto place =
      std::lower_bound(nodes.begin(), nodes.end(), time_s - same_time_s,
                       [](const Node<Body>& node, double time) { return node.time_s < time; });
  auto k = static_cast<std::size_t>(place - nodes.begin());
  const bool fresh = place == nodes.end() || place->time_s > time_s + same_time_s;
  if (fresh) insert_node(k, time_s);
  put(nodes[k]);
  if (fresh) poses_[k] = start_of(k);
  if (nodes.size() > static_cast<std::size_t>(options_.poses)) forget_oldest();
  return solve();
}

template <class Body>
void ChainWindow<Body>::insert_node(std::size_t k, double time_s) {
  const auto at = static_cast<std::ptrdiff_t>(k);
  chain_.nodes.emplace(chain_.nodes.begin() + at)->time_s = time_s;
  poses_.insert(poses_.begin() + at, Pose{});
  if (chain_.nodes.size() == 1) return;
  chain_.links.emplace(chain_.links.begin() + (k > 0 ? at - 1 : 0));
  if (k > 0) link(k - 1);
  if (k + 1 < chain_.nodes.size()) link(k);
}

template <class Body>
void ChainWindow<Body>::link(std::size_t k) {
  const double from_s = chain_.nodes[k].time_s, to_s = chain_.nodes[k + 1].time_s;
  const auto step = pieces_.between(from_s, to_s);
  chain_.links[k] = step ? made_link<Body>(*step, from_s, to_s, true, options_.smoothing)
                         : walk_link<Body>(from_s, to_s, options_.smoothing);
}

template <class Body>
typename Body::Pose ChainWindow<Body>::start_of(std::size_t k) const {
  std::optional<Pose> expected;
  if (k > 0)
    expected = chain_.links[k - 1].exists ? Body::after(poses_[k - 1], chain_.links[k - 1].step)
                                          : poses_[k - 1];
  const bool led = k > 0 && chain_.links[k - 1].exists;
  if (led && fits(chain_.body, chain_.nodes[k], *expected, near_sigmas)) return *expected;
  const auto alone = pose_alone(chain_.body, chain_.nodes[k], expected ? &*expected : nullptr);
  if (alone) return *alone;
  return expected.value_or(Pose{});
}

template <class Body>
void ChainWindow<Body>::forget_oldest() {
  if (chain_.links.front().exists) {
    ChainNormals<Body::size> normals(chain_.nodes.size());
    chain_.node_cost(0, poses_[0], &normals.own[0], &normals.gradient[0]);
    chain_.add_link(0, poses_, normals);
    const typename Body::Block carried =
        normals.coupling[0].transpose() * pseudo_inverse<typename Body::Block>(normals.diagonal(0));
    const typename Body::Block information = normals.to[0] - carried * normals.coupling[0];
    const typename Body::Part gradient = normals.gradient[1] - carried * normals.gradient[0];
    chain_.nodes[1].priors.push_back(quadratic<Pose, Body::size>(poses_[1], information, gradient));
  }
  chain_.nodes.erase(chain_.nodes.begin());
  chain_.links.erase(chain_.links.begin());
  poses_.erase(poses_.begin());
  pieces_.forget_before(chain_.nodes.front().time_s);
}

template <class Body>
typename ChainWindow<Body>::Estimate ChainWindow<Body>::solve() {
  for (std::size_t k = 0; k < chain_.links.size(); ++k)
    if (!chain_.links[k].report.odometry) link(k);  // odometry may arrive after its frames
  const auto solution = solved(chain_, poses_, options_.smoothing);
  poses_ = solution.poses;
  auto found = to_result(chain_, solution);
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
