// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_rim.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace occ {
namespace {

/// What a lost point costs: ten sigma, squared.
constexpr double lost_chi2 = 100;

constexpr int residual_index = 7;  // in a row, after pose and growth

/// Of a 2x2 information that may have rank one, as that of a single straight side.
Eigen::Matrix2d inverse_of(Eigen::Matrix2d information) {
  information.diagonal().array() += 1e-9 * information.trace() + std::numeric_limits<double>::min();
  return information.inverse();
}

}  // namespace

LampRim::LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim)
    : lamp_(lamp), points_(rim.data() + lamp.rim_begin), end_(rim.data() + lamp.rim_end) {
  const std::size_t count = lamp.rim_end - lamp.rim_begin;
  weights_.assign(count, 1.0);
  rows_.reserve(count);
}

std::size_t LampRim::linearise(const State& state, const Eigen::Vector3d& pivot) {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const double growth_slope = lamp_.blob->saturated ? -1 : 0;
  rows_.clear();
  Eigen::Matrix<double, 1, 6> d_pose;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const std::optional<double> distance = rim_distance_px(in_cam, points_[i].ray, &d_pose);
    if (!distance) {
      weights_[i] = 0;
      continue;
    }
    Row& row = rows_.emplace_back();
    row.point = i;
    row.values.head<6>() = d_pose.transpose();
    centre_row(row.values, pivot);
    row.values[growth_index] = growth_slope;
    row.values[residual_index] = *distance + growth_slope * state.growth_px;
    row.values *= points_[i].inverse_sigma;
  }
  return weights_.size() - rows_.size();
}

void LampRim::weigh_points(double huber_sigma) {
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d pull = Eigen::Vector2d::Zero();
  for (const Row& row : rows_) {
    const RimObservation& point = points_[row.point];
    const double weight = weights_[row.point] > 0 ? weights_[row.point] : 1;
    const Eigen::Vector2d v = point.inverse_sigma * point.normal;
    spread += weight * v * v.transpose();
    pull += weight * row.values[residual_index] * v;
  }
  const Eigen::Vector2d offset = inverse_of(spread) * pull;
  for (const Row& row : rows_) {
    const RimObservation& point = points_[row.point];
    const double explained = point.inverse_sigma * point.normal.dot(offset);
    weights_[row.point] =
        huber_weight(std::abs(row.values[residual_index] - explained), huber_sigma);
  }
}

void LampRim::add_to(Normal& normal, double model_sigma_px, double huber_sigma) {
  weigh_points(huber_sigma);
  Matrix8 sum = Matrix8::Zero();  // over rows: information, gradient in the last column, chi2
  Eigen::Matrix<double, 2, 8> along = Eigen::Matrix<double, 2, 8>::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Row& row : rows_) {
    const RimObservation& point = points_[row.point];
    const Eigen::Vector2d v = point.inverse_sigma * point.normal;
    const Vector8 weighted = weights_[row.point] * row.values;
    sum.noalias() += weighted * row.values.transpose();
    along.noalias() += v * weighted.transpose();
    spread.noalias() += weights_[row.point] * v * v.transpose();
  }
  const double variance = model_sigma_px * model_sigma_px;
  const Eigen::Matrix2d shrink = Eigen::Matrix2d::Identity() + variance * spread;
  offset_gain_ = variance * shrink.inverse();
  sum.noalias() -= along.transpose() * offset_gain_ * along;

  const Eigen::Vector2d pull = along.col(residual_index);
  const double place_chi2 = pull.dot(inverse_of(spread * shrink) * pull);
  lamp_weight_ = huber_weight(std::sqrt(std::max(0.0, place_chi2)), huber_sigma);

  const double chi2 = lamp_weight_ * sum(residual_index, residual_index) +
                      lost_chi2 * static_cast<double>(weights_.size() - rows_.size());
  normal.information.topLeftCorner<7, 7>() += lamp_weight_ * sum.topLeftCorner<7, 7>();
  normal.gradient.head<7>() += lamp_weight_ * sum.col(residual_index).head<7>();
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2 + lamp_weight_ * (1 - lamp_weight_) * place_chi2 +
                        lamp_weight_ * robust_excess(huber_sigma);
}

/// Sum of rho(e) - w e^2 over the points, with e = k / w where w < 1.
double LampRim::robust_excess(double huber_sigma) const {
  double sum = 0;
  for (const Row& row : rows_) {
    const double weight = weights_[row.point];
    if (weight < 1) sum += huber_sigma * huber_sigma * (1 - weight) / weight;
  }
  return sum;
}

double LampRim::chi2(const State& state) const {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const double growth_px = lamp_.blob->saturated ? state.growth_px : 0;
  double sum = 0, lost = 0;
  Eigen::Vector2d pull = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const RimObservation& point = points_[i];
    const std::optional<double> distance =
        weights_[i] > 0 ? rim_distance_px(in_cam, point.ray) : std::nullopt;
    if (!distance) {
      lost += lost_chi2;
      continue;
    }
    const double residual = (*distance - growth_px) * point.inverse_sigma;
    sum += weights_[i] * residual * residual;
    pull += weights_[i] * residual * point.inverse_sigma * point.normal;
  }
  return lamp_weight_ * (sum - pull.dot(offset_gain_ * pull)) + lost;
}

}  // namespace occ
