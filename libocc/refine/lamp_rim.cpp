// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_rim.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ::internal::refine {
namespace {

/// Chi-square of a rim point whose ray misses the lamp's plane or whose distance is undefined: that
/// of a residual of ten sigmas, so that a pose cannot gain by losing points.
constexpr double lost_chi2 = 100;

constexpr int residual_index = 7;  // in a column of rows_, after pose and growth

/// Inverse of an information matrix that may be singular, e.g. of a single straight side.
Eigen::Matrix3d inverse_of(Eigen::Matrix3d information) {
  information.diagonal().array() += 1e-9 * information.trace() + std::numeric_limits<double>::min();
  return information.inverse();
}

/// Standard deviation estimated from the median of absolute values.
double scatter(std::vector<double> sizes) {
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / 0.6745;
}

}  // namespace

LampRim::LampRim(const LampObservation& lamp, const std::vector<RimObservation>& rim,
                 const Scene& scene)
    : lamp_(lamp), points_(rim.data() + lamp.rim_begin), scene_(scene) {
  const auto count = static_cast<Eigen::Index>(lamp.rim_end - lamp.rim_begin);
  rows_.resize(11, count);
  weighted_.resize(11, count);
  weights_.setOnes(count);
}

int LampRim::linearise(const State& state, const Eigen::Vector3d& pivot) {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const Eigen::Vector2d shift =
      light_shift_px(*lamp_.lamp, *lamp_.blob, state.cam_from_world, scene_);
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
    const double off = *distance + growth_slope * state.growth_px - points_[i].normal.dot(shift);
    rows_.col(i) << d_lamp.transpose(), growth_slope, off, 1, points_[i].normal;
    rows_.col(i) *= points_[i].inverse_sigma;
  }
  return lost_;
}

void LampRim::weigh_points(double huber_sigma) {
  const auto residuals = rows_.row(residual_index);
  const auto commons = rows_.bottomRows<3>();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const Eigen::Vector3d weighted = weights_[i] * commons.col(i);
    spread += weighted * commons.col(i).transpose();
    pull += weighted * residuals[i];
  }
  const Eigen::Vector3d common = inverse_of(spread) * pull;
  std::vector<double> left(static_cast<std::size_t>(weights_.size()));
  for (std::size_t i = 0; i < left.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    left[i] = std::abs(residuals[k] - commons.col(k).dot(common));
  }
  threshold_ = huber_sigma * std::max(1.0, scatter(left));
  for (std::size_t i = 0; i < left.size(); ++i) {
    double& weight = weights_[static_cast<Eigen::Index>(i)];
    if (weight > 0) weight = core::huber_weight(left[i] * left[i], threshold_);
  }
}

void LampRim::add_to(PoseNormalEquations& normal, double huber_sigma) {
  if (weights_.size() == 0) return;
  weigh_points(huber_sigma);
  weighted_.noalias() = rows_ * weights_.asDiagonal();
  const Eigen::Matrix<double, 11, 11> products = weighted_ * rows_.transpose();
  Matrix8 sum = products.topLeftCorner<8, 8>();  // gradient and chi2 in the last column
  const Eigen::Matrix<double, 3, 8> along = products.bottomLeftCorner<3, 8>();
  const Eigen::Matrix3d spread = products.bottomRightCorner<3, 3>();

  const Eigen::Matrix3d& covariance = lamp_.common_covariance_px2;
  const Eigen::Matrix3d damped = Eigen::Matrix3d::Identity() + spread * covariance;
  common_gain_ = covariance * damped.inverse();
  sum.noalias() -= along.transpose() * common_gain_ * along;

  // A rotation w of the pose about the pivot rotates the lamp and moves its centre by w x arm.
  sum.leftCols<3>() -= sum.middleCols<3>(3) * skew(arm_);
  sum.topRows<3>() += skew(arm_) * sum.middleRows<3>(3);
  const double chi2 = sum(residual_index, residual_index) + lost_chi2 * lost_;
  normal.information.topLeftCorner<7, 7>() += sum.topLeftCorner<7, 7>();
  normal.gradient.head<7>() += sum.col(residual_index).head<7>();
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2 + robust_excess();
}

/// Sum of 2 rho(e) - w e^2 over the points, with Huber's loss rho and |e| = k / w where w < 1.
double LampRim::robust_excess() const {
  double sum = 0;
  for (const double weight : weights_) {
    if (weight > 0 && weight < 1) sum += threshold_ * threshold_ * (1 - weight) / weight;
  }
  return sum;
}

double LampRim::chi2(const State& state) const {
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const Eigen::Vector2d shift =
      light_shift_px(*lamp_.lamp, *lamp_.blob, state.cam_from_world, scene_);
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
    const double off = *distance - growth_px - points_[i].normal.dot(shift);
    const double residual = off * points_[i].inverse_sigma;
    sum += weights_[i] * residual * residual;
    pull += weights_[i] * residual * points_[i].inverse_sigma *
            Eigen::Vector3d(1, points_[i].normal.x(), points_[i].normal.y());
  }
  return sum - pull.dot(common_gain_ * pull) + lost;
}

}  // namespace occ::internal::refine
