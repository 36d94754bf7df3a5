// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/place_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::survey {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

/// Translations, rotations and scale about the middle of the places; a unit moves the farthest
/// place by their extent.
MatrixXd similarity_directions(const Matrix3Xd& places) {
  const Vector3d middle = places.rowwise().mean();
  const double extent = std::sqrt((places.colwise() - middle).colwise().squaredNorm().maxCoeff());
  MatrixXd directions(3 * places.cols(), 7);
  for (Index i = 0; i < places.cols(); ++i) {
    const Vector3d arm = places.col(i) - middle;
    directions.block<3, 3>(3 * i, 0) = extent * Matrix3d::Identity();
    directions.block<3, 3>(3 * i, 3) = skew(arm);
    directions.block<3, 1>(3 * i, 6) = arm;
  }
  return directions;
}

}  // namespace

void add_free_similarity(const Matrix3Xd& places, Eigen::Ref<MatrixXd> covariance) {
  const MatrixXd directions = similarity_directions(places);
  constexpr double part = 0.1;
  covariance += square(part) * core::product_transposed(directions, directions);
}

MatrixXd without_similarity(const Matrix3Xd& places, const MatrixXd& covariance) {
  const MatrixXd directions = similarity_directions(places);
  const auto remove = [&](const MatrixXd& a) {
    return MatrixXd(a - core::product(directions, core::minimum_norm_solution(directions, a)));
  };
  return remove(remove(covariance).transpose());
}

PlaceStatistics::PlaceStatistics(Matrix3Xd map, MatrixXd map_covariance, Matrix3Xd places,
                                 MatrixXd places_covariance)
    : map_(std::move(map)),
      places_(std::move(places)),
      s_(std::move(map_covariance)),
      w_(std::move(places_covariance)) {}

MatrixXd PlaceStatistics::covariance_of(const PlacePair& a, const PlacePair& b) const {
  return s_.block<3, 3>(3 * a.lamp, 3 * b.lamp) + w_.block<3, 3>(3 * a.place, 3 * b.place);
}

bool PlaceStatistics::set_unchanged(std::vector<PlacePair> pairs) {
  const Index count = static_cast<Index>(pairs.size());
  MatrixXd c(3 * count, 3 * count);
  Eigen::VectorXd d(3 * count);
  for (Index i = 0; i < count; ++i) {
    d.segment<3>(3 * i) = map_.col(pairs[i].lamp) - places_.col(pairs[i].place);
    for (Index j = 0; j < count; ++j)
      c.block<3, 3>(3 * i, 3 * j) = covariance_of(pairs[i], pairs[j]);
  }
  const core::Cholesky<MatrixXd> factors(c);
  if (!factors.exists()) return false;
  q_ = factors.solve(MatrixXd(MatrixXd::Identity(3 * count, 3 * count)));
  qd_ = factors.solve(d);
  unchanged_ = std::move(pairs);
  return true;
}

bool PlaceStatistics::is_unchanged(const PlacePair& pair) const {
  return std::any_of(unchanged_.begin(), unchanged_.end(), [&](const PlacePair& other) {
    return other.lamp == pair.lamp && other.place == pair.place;
  });
}

PlaceTest PlaceStatistics::test(const PlacePair& pair) const {
  PlaceTest result;
  Vector3d residual;
  const auto own = std::find_if(unchanged_.begin(), unchanged_.end(), [&](const PlacePair& other) {
    return other.lamp == pair.lamp && other.place == pair.place;
  });
  if (own != unchanged_.end()) {
    const Index i = 3 * (own - unchanged_.begin());
    result.covariance = core::inverse<Matrix3d>(q_.block<3, 3>(i, i));
    residual = result.covariance * qd_.segment<3>(i);
  } else {
    MatrixXd with(3, 3 * static_cast<Index>(unchanged_.size()));
    for (std::size_t j = 0; j < unchanged_.size(); ++j)
      with.middleCols<3>(3 * static_cast<Index>(j)) = covariance_of(pair, unchanged_[j]);
    result.covariance = covariance_of(pair, pair) - with * q_ * with.transpose();
    residual = map_.col(pair.lamp) - places_.col(pair.place) - with * qd_;
  }
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  result.moved = -residual;
  result.statistic = residual.dot(core::inverse<Matrix3d>(result.covariance) * residual);
  return result;
}

void PlaceStatistics::separate(const std::vector<PlacePair>& all, double max_statistic,
                               int min_unchanged) {
  const std::size_t max_changes = 4 * all.size();  // a lamp may be moved out and back; no cycles
  for (std::size_t change = 0; change < max_changes; ++change) {
    std::vector<PlacePair> next = unchanged_;
    double worst = max_statistic;
    std::size_t removed = next.size();
    if (static_cast<int>(next.size()) > min_unchanged)
      for (std::size_t i = 0; i < next.size(); ++i) {
        const double statistic = test(next[i]).statistic;
        if (!(statistic > worst)) continue;
        worst = statistic;
        removed = i;
      }
    if (removed < next.size()) {
      next.erase(next.begin() + static_cast<std::ptrdiff_t>(removed));
    } else {
      const PlacePair* best = nullptr;
      double smallest = max_statistic;
      for (const PlacePair& pair : all) {
        if (is_unchanged(pair)) continue;
        const double statistic = test(pair).statistic;
        if (!(statistic < smallest)) continue;
        smallest = statistic;
        best = &pair;
      }
      if (best == nullptr) return;
      next.push_back(*best);
    }
    if (!set_unchanged(std::move(next))) return;
  }
}

MatrixXd PlaceStatistics::covariance_with_differences(const PlaceItem& item) const {
  MatrixXd with(3, 3 * static_cast<Index>(unchanged_.size()));
  for (std::size_t j = 0; j < unchanged_.size(); ++j) {
    const Index column = 3 * static_cast<Index>(j);
    if (item.kind == PlaceItem::Kind::placed)
      with.middleCols<3>(column) = -w_.block<3, 3>(3 * item.index, 3 * unchanged_[j].place);
    else
      with.middleCols<3>(column) = s_.block<3, 3>(3 * item.index, 3 * unchanged_[j].lamp);
  }
  return with;
}

PlaceEstimate PlaceStatistics::estimate(const std::vector<PlaceItem>& items) const {
  const Index count = static_cast<Index>(items.size());
  PlaceEstimate found;
  found.places.resize(3, count);
  found.covariance.setZero(3 * count, 3 * count);
  MatrixXd h(3 * count, 3 * static_cast<Index>(unchanged_.size()));
  for (Index i = 0; i < count; ++i) h.middleRows<3>(3 * i) = covariance_with_differences(items[i]);
  const MatrixXd hq = core::product(h, q_);
  const MatrixXd reduction = core::product_transposed(hq, h);
  for (Index i = 0; i < count; ++i) {
    const PlaceItem& a = items[i];
    const bool is_placed = a.kind == PlaceItem::Kind::placed;
    found.places.col(i) = is_placed ? places_.col(a.index) : map_.col(a.index);
    if (a.kind != PlaceItem::Kind::kept) found.places.col(i) -= h.middleRows<3>(3 * i) * qd_;
    for (Index j = 0; j < count; ++j) {
      const PlaceItem& b = items[j];
      Matrix3d block = Matrix3d::Zero();
      if (is_placed == (b.kind == PlaceItem::Kind::placed))
        block = (is_placed ? w_ : s_).block<3, 3>(3 * a.index, 3 * b.index);
      if (a.kind != PlaceItem::Kind::kept || b.kind != PlaceItem::Kind::kept)
        block -= reduction.block<3, 3>(3 * i, 3 * j);
      found.covariance.block<3, 3>(3 * i, 3 * j) = block;
    }
  }
  found.covariance = (0.5 * (found.covariance + found.covariance.transpose())).eval();
  return found;
}

}  // namespace occ::internal::survey
