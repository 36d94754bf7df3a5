// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_rim.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace occ {
namespace {

/// What a lost point costs: ten sigma, squared.
constexpr double lost_chi2 = 100;

constexpr int residual_index = 7;  // in a column of rows_, after pose and growth

/// Of a 2x2 information that may have rank one, as that of a single straight side.
Eigen::Matrix2d inverse_of(Eigen::Matrix2d information) {
  information.diagonal().array() += 1e-9 * information.trace() + std::numeric_limits<double>::min();
  return information.inverse();
}

}  // namespace

LampRim::LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim)
    : lamp_(lamp), points_(rim.data() + lamp.rim_begin) {
  const auto count = static_cast<Eigen::Index>(lamp.rim_end - lamp.rim_begin);
  rows_.resize(10, count);
  weighted_.resize(10, count);
  weights_.setOnes(count);
}

int LampRim::linearise(const State& state, const Eigen::Vector3d& pivot) {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const double growth_slope = lamp_.blob->saturated ? -1 : 0;
  arm_ = in_cam.centre_m - pivot;
  lost_ = 0;
  Eigen::Matrix<double, 1, 6> d_lamp;
  for (Eigen::Index i = 0; i < rows_.cols(); ++i) {
    const std::optional<double> distance = rim_distance_px(in_cam, points_[i].ray, &d_lamp);
    if (!distance) {
      rows_.col(i).setZero();
      weights_[i] = 0;
      ++lost_;
      continue;
    }
    if (weights_[i] == 0) weights_[i] = 1;
    rows_.col(i) << d_lamp.transpose(), growth_slope, *distance + growth_slope * state.growth_px,
        points_[i].normal;
    rows_.col(i) *= points_[i].inverse_sigma;
  }
  return lost_;
}

void LampRim::weigh_points(double huber_sigma) {
  const auto residuals = rows_.row(residual_index);
  const auto directions = rows_.bottomRows<2>();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d pull = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const Eigen::Vector2d weighted = weights_[i] * directions.col(i);
    spread += weighted * directions.col(i).transpose();
    pull += weighted * residuals[i];
  }
  const Eigen::Vector2d offset = inverse_of(spread) * pull;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    if (weights_[i] == 0) continue;
    const double left = residuals[i] - directions.col(i).dot(offset);
    weights_[i] = huber_weight(std::abs(left), huber_sigma);
  }
}

void LampRim::add_to(Normal& normal, double model_sigma_px, double huber_sigma) {
  weigh_points(huber_sigma);
  weighted_.noalias() = rows_ * weights_.asDiagonal();
  const Eigen::Matrix<double, 10, 10> products = weighted_ * rows_.transpose();
  Matrix8 sum = products.topLeftCorner<8, 8>();  // gradient and chi2 in the last column
  const Eigen::Matrix<double, 2, 8> along = products.bottomLeftCorner<2, 8>();
  const Eigen::Matrix2d spread = products.bottomRightCorner<2, 2>();

  const double variance = model_sigma_px * model_sigma_px;
  const Eigen::Matrix2d shrink = Eigen::Matrix2d::Identity() + variance * spread;
  offset_gain_ = variance * shrink.inverse();
  sum.noalias() -= along.transpose() * offset_gain_ * along;

  const Eigen::Vector2d pull = along.col(residual_index);
  const double place_chi2 = pull.dot(inverse_of(spread * shrink) * pull);
  lamp_weight_ = huber_weight(std::sqrt(std::max(0.0, place_chi2)), huber_sigma);

  // a turn of the pose about the pivot turns the lamp and swings its centre: w x arm
  sum.leftCols<3>() -= sum.middleCols<3>(3) * skew(arm_);
  sum.topRows<3>() += skew(arm_) * sum.middleRows<3>(3);
  const double chi2 = lamp_weight_ * sum(residual_index, residual_index) + lost_chi2 * lost_;
  normal.information.topLeftCorner<7, 7>() += lamp_weight_ * sum.topLeftCorner<7, 7>();
  normal.gradient.head<7>() += lamp_weight_ * sum.col(residual_index).head<7>();
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2 + lamp_weight_ * (1 - lamp_weight_) * place_chi2 +
                        lamp_weight_ * robust_excess(huber_sigma);
}

/// Sum of rho(e) - w e^2 over the points, with |e| = k / w where w < 1.
double LampRim::robust_excess(double huber_sigma) const {
  double sum = 0;
  for (const double weight : weights_) {
    if (weight > 0 && weight < 1) sum += huber_sigma * huber_sigma * (1 - weight) / weight;
  }
  return sum;
}

double LampRim::chi2(const State& state) const {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const double growth_px = lamp_.blob->saturated ? state.growth_px : 0;
  double sum = 0, lost = 0;
  Eigen::Vector2d pull = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const std::optional<double> distance =
        weights_[i] > 0 ? rim_distance_px(in_cam, points_[i].ray) : std::nullopt;
    if (!distance) {
      lost += lost_chi2;
      continue;
    }
    const double residual = (*distance - growth_px) * points_[i].inverse_sigma;
    sum += weights_[i] * residual * residual;
    pull += weights_[i] * residual * points_[i].inverse_sigma * points_[i].normal;
  }
  return lamp_weight_ * (sum - pull.dot(offset_gain_ * pull)) + lost;
}

}  // namespace occ
