// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/body_agreement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <optional>

#include "libocc/geometry/so3.hpp"
#include "libocc/network/internal/point_agreement.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

struct Placed {
  Rigid3 pose;
  double scale = 1;
};

/// One body that may be put anywhere.
class Body {
 public:
  Body(const Network& network, const NetworkLayout& layout, NetworkState& state, int body,
       const std::vector<int>& observations, double limit)
      : network_(network),
        layout_(layout),
        state_(state),
        body_(at(body)),
        all_(observations),
        limit_squared_(limit * limit) {}

  Placed placed() const { return {state_.bodies[body_], state_.scales[body_]}; }
  void put(const Placed& where) {
    state_.bodies[body_] = where.pose;
    state_.scales[body_] = where.scale;
  }

  std::vector<char> agreeing() const {
    std::vector<char> agree;
    for (const int i : all_) {
      double r[2];
      agree.push_back(residual_of(network_, state_, network_.observations[i], r) &&
                      r[0] * r[0] + r[1] * r[1] < limit_squared_);
    }
    return agree;
  }

  /// Gauss and Newton's steps with the corners that agree, while they do not get fewer.
  void refine(std::vector<char>& agree) {
    const Index size = layout_.body_sizes[body_];
    for (int step = 0; step < 6; ++step) {
      Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
      for (std::size_t k = 0; k < all_.size(); ++k) {
        ObservationRows rows;
        if (!agree[k] || !rows_of(network_, layout_, state_, network_.observations[all_[k]], rows))
          continue;
        for (int axis = 0; axis < 2; ++axis) {
          const Eigen::Map<const Eigen::VectorXd> b(rows.b[axis], size);
          information += b * b.transpose();
          gradient -= rows.r[axis] * b;
        }
      }
      const Eigen::LLT<Eigen::MatrixXd> factor(information);
      if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-13)) return;
      const Eigen::VectorXd move = factor.solve(gradient);
      const Placed before = placed();
      Placed next = before;
      next.pose.rotation = so3_exp(move.head<3>()) * before.pose.rotation;
      next.pose.translation += move.segment<3>(3);
      if (size == 7) next.scale *= std::exp(move[6]);
      put(next);
      std::vector<char> now = agreeing();
      if (std::count(now.begin(), now.end(), 1) < std::count(agree.begin(), agree.end(), 1))
        return put(before);
      agree = std::move(now);
    }
  }

  /// From the corners that two images show both.
  std::optional<Placed> from_pair(int first, int second) const {
    Matrix3Xd in_body(3, 0), in_world(3, 0);
    for (const int i : all_)
      for (const int k : all_) {
        const ImageObservation &a = network_.observations[i], &b = network_.observations[k];
        if (a.image != first || b.image != second || !(a.target == b.target)) continue;
        const auto meeting = meeting_of(network_, state_, {i, k});
        if (!meeting) continue;
        in_body.conservativeResize(3, in_body.cols() + 1);
        in_world.conservativeResize(3, in_world.cols() + 1);
        in_body.rightCols<1>() = network_.bodies[body_].corners_m.col(a.target.corner);
        in_world.rightCols<1>() = *meeting;
      }
    if (in_body.cols() < 3) return std::nullopt;
    const bool scaled = layout_.body_sizes[body_] == 7;
    const double scale = state_.scales[body_];
    const Matrix3Xd shape = scaled ? in_body : Matrix3Xd(scale * in_body);
    const Eigen::Matrix4d fit = Eigen::umeyama(shape, in_world, scaled);
    if (!fit.allFinite()) return std::nullopt;
    const double found = scaled ? std::cbrt(fit.topLeftCorner<3, 3>().determinant()) : scale;
    if (!(found > 0)) return std::nullopt;
    return Placed{{nearest_rotation(fit.topLeftCorner<3, 3>()), fit.topRightCorner<3, 1>()}, found};
  }

 private:
  const Network& network_;
  const NetworkLayout& layout_;
  NetworkState& state_;
  std::size_t body_;
  const std::vector<int>& all_;
  double limit_squared_;
};

}  // namespace

std::vector<std::vector<int>> sightings_of_bodies(const Network& network,
                                                  const NetworkLayout& layout) {
  std::vector<std::vector<int>> seen_by(network.bodies.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& seen = network.observations[i];
    if (seen.used && seen.target.body >= 0 && layout.bodies[seen.target.body] != none)
      seen_by[seen.target.body].push_back(static_cast<int>(i));
  }
  return seen_by;
}

BodyAgreement agreement_about_body(const Network& network, const NetworkLayout& layout,
                                   NetworkState& state, int body,
                                   const std::vector<int>& observations, double limit) {
  constexpr int max_pairs = 40;
  Body alone(network, layout, state, body, observations, limit);
  const Placed start = alone.placed();
  Placed best_place = start;
  std::vector<char> best = alone.agreeing();
  const auto count = [](const std::vector<char>& agree) {
    return std::count(agree.begin(), agree.end(), 1);
  };
  const std::ptrdiff_t all = static_cast<std::ptrdiff_t>(observations.size());
  const auto is_most = [&] { return 4 * count(best) >= 3 * all; };
  if (!is_most()) {
    std::vector<int> images;
    for (const int i : observations) images.push_back(network.observations[i].image);
    std::sort(images.begin(), images.end());
    images.erase(std::unique(images.begin(), images.end()), images.end());
    int pairs = 0;
    for (std::size_t gap = 1; gap < images.size(); ++gap)
      for (std::size_t a = 0; a + gap < images.size() && pairs < max_pairs; ++a, ++pairs) {
        const auto place = alone.from_pair(images[a], images[a + gap]);
        if (!place) continue;
        alone.put(*place);
        std::vector<char> agree = alone.agreeing();
        if (count(agree) >= 3) alone.refine(agree);
        if (count(agree) > count(best)) {
          best = agree;
          best_place = alone.placed();
        }
        alone.put(start);
      }
  }
  BodyAgreement result;
  result.world_from_body = best_place.pose;
  result.scale = best_place.scale;
  for (std::size_t k = 0; k < best.size(); ++k)
    if (!best[k]) result.disagree.push_back(observations[k]);
  result.sound = 2 * count(best) > all;
  return result;
}

}  // namespace occ::internal::network
