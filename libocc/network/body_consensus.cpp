// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/internal/consensus.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

struct BodyPlacement {
  Rigid3 pose;
  double scale = 1;
};

/// One body with its observations, at a trial placement.
class BodyTrial {
 public:
  BodyTrial(const Network& network, const NetworkLayout& layout, NetworkState& state, int body,
            const std::vector<int>& observations, double limit)
      : network_(network),
        layout_(layout),
        state_(state),
        body_(body),
        observations_(observations),
        limit_(limit) {}

  BodyPlacement placement() const { return {state_.bodies[body_], state_.scales[body_]}; }
  void place(const BodyPlacement& where) {
    state_.bodies[body_] = where.pose;
    state_.scales[body_] = where.scale;
  }

  std::vector<char> inliers() const { return inliers_at(network_, state_, observations_, limit_); }

  /// Gauss-Newton steps on the inliers while their number does not decrease.
  void refine(std::vector<char>& is_inlier) {
    const Index size = layout_.body_sizes[body_];
    for (int step = 0; step < 6; ++step) {
      Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
      for (std::size_t k = 0; k < observations_.size(); ++k) {
        ObservationRows rows;
        if (!is_inlier[k] ||
            !rows_of(network_, layout_, state_, network_.observations[observations_[k]], rows))
          continue;
        for (int axis = 0; axis < 2; ++axis) {
          const Eigen::Map<const Eigen::VectorXd> b(rows.b[axis], size);
          information += b * b.transpose();
          gradient -= rows.r[axis] * b;
        }
      }
      const core::Cholesky<Eigen::MatrixXd> cholesky(information);
      if (!cholesky.exists() || !(cholesky.rcond() > 1e-13)) return;
      const Eigen::VectorXd move = cholesky.solve(gradient);
      const BodyPlacement before = placement();
      BodyPlacement next = before;
      next.pose.rotation = so3_exp(move.head<3>()) * before.pose.rotation;
      next.pose.translation += move.segment<3>(3);
      if (size == 7) next.scale *= std::exp(move[6]);
      place(next);
      std::vector<char> now = inliers();
      if (std::count(now.begin(), now.end(), 1) < std::count(is_inlier.begin(), is_inlier.end(), 1))
        return place(before);
      is_inlier = std::move(now);
    }
  }

  /// Placement from the corners that both images show; nothing below three.
  std::optional<BodyPlacement> hypothesis_from_pair(int first, int second) const {
    Matrix3Xd in_body(3, 0), in_world(3, 0);
    for (const int i : observations_)
      for (const int k : observations_) {
        const ImageObservation &a = network_.observations[i], &b = network_.observations[k];
        if (a.image != first || b.image != second || !(a.target == b.target)) continue;
        const auto point = intersect_observations(network_, state_, {i, k});
        if (!point) continue;
        in_body.conservativeResize(3, in_body.cols() + 1);
        in_world.conservativeResize(3, in_world.cols() + 1);
        in_body.rightCols<1>() = network_.bodies[body_].corners_m.col(a.target.corner);
        in_world.rightCols<1>() = *point;
      }
    if (in_body.cols() < 3) return std::nullopt;
    std::optional<double> known_scale;
    if (layout_.body_sizes[body_] != 7) known_scale = state_.scales[body_];
    const Similarity found = similarity_between(in_body, in_world, known_scale);
    if (!found.rotation.allFinite() || !(found.scale > 0)) return std::nullopt;
    return BodyPlacement{{found.rotation, found.translation}, found.scale};
  }

 private:
  const Network& network_;
  const NetworkLayout& layout_;
  NetworkState& state_;
  int body_;
  const std::vector<int>& observations_;
  double limit_;
};

}  // namespace

Similarity similarity_between(const Matrix3Xd& from, const Matrix3Xd& to,
                              std::optional<double> scale) {
  const Vector3d from_mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  const Matrix3Xd shape = from.colwise() - from_mean, moved = to.colwise() - to_mean;
  Similarity found;
  found.rotation = nearest_rotation(moved * shape.transpose());
  found.scale =
      scale ? *scale : moved.cwiseProduct(found.rotation * shape).sum() / shape.squaredNorm();
  found.translation = to_mean - found.scale * found.rotation * from_mean;
  return found;
}

std::vector<char> inliers_at(const Network& network, const NetworkState& state,
                             const std::vector<int>& observations, double limit) {
  std::vector<char> is_inlier;
  for (const int i : observations) {
    double r[2];
    is_inlier.push_back(residual_of(network, state, network.observations[i], r) &&
                        r[0] * r[0] + r[1] * r[1] < limit * limit);
  }
  return is_inlier;
}

std::vector<std::vector<int>> observations_of_bodies(const Network& network,
                                                     const NetworkLayout& layout) {
  std::vector<std::vector<int>> observations_of_body(network.bodies.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& observation = network.observations[i];
    if (observation.used && observation.target.body >= 0 &&
        layout.bodies[observation.target.body] != none)
      observations_of_body[observation.target.body].push_back(static_cast<int>(i));
  }
  return observations_of_body;
}

BodyConsensus body_consensus(const Network& network, const NetworkLayout& layout,
                             NetworkState& state, int body, const std::vector<int>& observations,
                             double limit) {
  constexpr int max_pairs = 40;
  BodyTrial trial(network, layout, state, body, observations, limit);
  const BodyPlacement start = trial.placement();
  BodyPlacement best_placement = start;
  std::vector<char> best = trial.inliers();
  const auto count = [](const std::vector<char>& is_inlier) {
    return std::count(is_inlier.begin(), is_inlier.end(), 1);
  };
  const std::ptrdiff_t total = static_cast<std::ptrdiff_t>(observations.size());
  const auto is_majority = [&] { return 4 * count(best) >= 3 * total; };
  if (!is_majority()) {
    std::vector<int> images;
    for (const int i : observations) images.push_back(network.observations[i].image);
    std::sort(images.begin(), images.end());
    images.erase(std::unique(images.begin(), images.end()), images.end());
    int pairs = 0;
    for (std::size_t gap = 1; gap < images.size(); ++gap)
      for (std::size_t a = 0; a + gap < images.size() && pairs < max_pairs; ++a, ++pairs) {
        const auto place = trial.hypothesis_from_pair(images[a], images[a + gap]);
        if (!place) continue;
        trial.place(*place);
        std::vector<char> is_inlier = trial.inliers();
        if (count(is_inlier) >= 3) trial.refine(is_inlier);
        if (count(is_inlier) > count(best)) {
          best = is_inlier;
          best_placement = trial.placement();
        }
        trial.place(start);
      }
  }
  BodyConsensus result;
  result.world_from_body = best_placement.pose;
  result.scale = best_placement.scale;
  for (std::size_t k = 0; k < best.size(); ++k)
    if (!best[k]) result.outliers.push_back(observations[k]);
  result.reliable = 2 * count(best) > total;
  return result;
}

}  // namespace occ::internal::network
