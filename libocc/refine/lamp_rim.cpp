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

/// Of an information that may lack rank, as that of a single straight side.
Eigen::Matrix3d inverse_of(Eigen::Matrix3d information) {
  information.diagonal().array() += 1e-9 * information.trace() + std::numeric_limits<double>::min();
  return information.inverse();
}

}  // namespace

LampRim::LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim)
    : lamp_(lamp), points_(rim.data() + lamp.rim_begin) {
  const auto count = static_cast<Eigen::Index>(lamp.rim_end - lamp.rim_begin);
  rows_.resize(11, count);
  weighted_.resize(11, count);
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
    rows_.col(i) << d_lamp.transpose(), growth_slope, *distance + growth_slope * state.growth_px, 1,
        points_[i].normal;
    rows_.col(i) *= points_[i].inverse_sigma;
  }
  return lost_;
}

void LampRim::weigh_points(double huber_sigma) {
  const auto residuals = rows_.row(residual_index);
  const auto directions = rows_.bottomRows<3>();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const Eigen::Vector3d weighted = weights_[i] * directions.col(i);
    spread += weighted * directions.col(i).transpose();
    pull += weighted * residuals[i];
  }
  const Eigen::Vector3d offset = inverse_of(spread) * pull;
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    if (weights_[i] == 0) continue;
    const double left = residuals[i] - directions.col(i).dot(offset);
    weights_[i] = huber_weight(std::abs(left), huber_sigma);
  }
}

void LampRim::add_to(Normal& normal, double huber_sigma) {
  weigh_points(huber_sigma);
  weighted_.noalias() = rows_ * weights_.asDiagonal();
  const Eigen::Matrix<double, 11, 11> products = weighted_ * rows_.transpose();
  Matrix8 sum = products.topLeftCorner<8, 8>();  // gradient and chi2 in the last column
  const Eigen::Matrix<double, 3, 8> along = products.bottomLeftCorner<3, 8>();
  const Eigen::Matrix3d spread = products.bottomRightCorner<3, 3>();

  const Eigen::Matrix3d& variance = lamp_.common_covariance_px2;
  const Eigen::Matrix3d damped = Eigen::Matrix3d::Identity() + spread * variance;
  offset_gain_ = variance * damped.inverse();
  sum.noalias() -= along.transpose() * offset_gain_ * along;

  const Eigen::Matrix3d uncertainty = inverse_of(spread);
  const Eigen::Vector3d offset = uncertainty * along.col(residual_index);
  const Eigen::Matrix3d allowed = uncertainty + variance;
  const double place_chi2 = offset.dot(allowed.inverse() * offset);
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
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const std::optional<double> distance =
        weights_[i] > 0 ? rim_distance_px(in_cam, points_[i].ray) : std::nullopt;
    if (!distance) {
      lost += lost_chi2;
      continue;
    }
    const double residual = (*distance - growth_px) * points_[i].inverse_sigma;
    sum += weights_[i] * residual * residual;
    pull += weights_[i] * residual * points_[i].inverse_sigma *
            Eigen::Vector3d(1, points_[i].normal.x(), points_[i].normal.y());
  }
  return lamp_weight_ * (sum - pull.dot(offset_gain_ * pull)) + lost;
}

}  // namespace occ
