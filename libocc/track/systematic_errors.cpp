// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/systematic_errors.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/track/internal/root_update.hpp"

namespace occ::internal::track {
namespace {

void append(int number, const Vector6& column, PoseObservation& seen) {
  seen.systematic.push_back(number);
  auto& columns = seen.gradient_by_systematic;
  columns.conservativeResize(6, static_cast<Eigen::Index>(seen.systematic.size()));
  columns.rightCols<1>() = column;
}

/// Replaces information and gradient, in which the errors are eliminated, by those of exact errors.
/// The whitened rows r + R d + b e have the noise 1 - b b^T.
void separate(const Eigen::Matrix<double, 6, Eigen::Dynamic>& by_errors, PoseObservation& seen) {
  // The errors' share of the variance is rounded below 1 if the noise is a thousandth of them.
  constexpr double max_share = 1 - 1e-6, rounding = 1e-13;
  const DataEquation<6> rows = data_equation(seen.information, seen.gradient, by_errors);
  const Eigen::Index rank = rows.rows.rows();
  Matrix6 shares = Matrix6::Zero();
  shares.topLeftCorner(rank, rank) = rows.systematic * rows.systematic.transpose();
  const auto eigen = core::symmetric_eigen<Matrix6>(shares);
  const Vector6 values = eigen.eigenvalues().cwiseMax(0);
  const Vector6 limited = values.cwiseMin(max_share);
  const Vector6 white = (1 - limited.array()).sqrt().inverse();
  const Vector6 scale =
      (values.array() > rounding).select((limited.array() / values.array()).sqrt(), 1);
  const Matrix6& axes = eigen.eigenvectors();
  Matrix6 information_rows = Matrix6::Zero();
  information_rows.topRows(rank) = rows.rows;
  Vector6 residuals = Vector6::Zero();
  residuals.head(rank) = rows.residuals;
  Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(6, by_errors.cols());
  errors.topRows(rank) = rows.systematic;
  const Matrix6 whitened = white.asDiagonal() * axes.transpose() * information_rows;
  seen.information = whitened.transpose() * whitened;
  seen.information = (0.5 * (seen.information + seen.information.transpose())).eval();
  seen.gradient = whitened.transpose() * (white.asDiagonal() * (axes.transpose() * residuals));
  seen.gradient_by_systematic =
      whitened.transpose() * (white.cwiseProduct(scale).asDiagonal() * (axes.transpose() * errors));
}

}  // namespace

SystematicErrors::SystematicErrors(const TrackerOptions& options)
    : clock_sigma_s_(options.clock_sigma_s) {
  mount_sigmas_ << Eigen::Vector3d::Constant(options.mount_sigma_rad),
      Eigen::Vector3d::Constant(options.mount_sigma_m);
}

int SystematicErrors::number(const Key& key) {
  return numbers_.emplace(key, static_cast<int>(numbers_.size())).first->second;
}

void SystematicErrors::add_scene(const refine::ErrorGradient& errors, const Scene& scene,
                                 int camera, PoseObservation& seen) {
  if (errors.sources.empty()) return;
  separate(errors.gradient_by_errors, seen);
  using Source = refine::ErrorGradient::Source;
  for (const Source& source : errors.sources) {
    Key key{map, 0, source.component};
    if (source.kind == Source::camera) key = {camera_parameter, camera, source.component};
    if (source.kind == Source::lamp)
      key = {lamp, scene.lamps[static_cast<std::size_t>(source.lamp_index)].id, source.component};
    seen.systematic.push_back(number(key));
  }
}

void SystematicErrors::add_own(int camera, const Vector6& velocity, PoseObservation& seen) {
  const Matrix6 information = seen.information;
  for (int i = 0; i < 6; ++i)
    if (mount_sigmas_[i] > 0)
      append(number({mount, camera, i}), information.col(i) * mount_sigmas_[i], seen);
  if (!(clock_sigma_s_ > 0)) return;
  append(number({clock, 0, 0}), information * velocity * clock_sigma_s_, seen);
  seen.uncertain_systematic = 1;
}

Matrix6 SystematicErrors::own_covariance(const Vector6& velocity) const {
  const Vector6 late = clock_sigma_s_ * velocity;
  Matrix6 covariance = mount_sigmas_.cwiseAbs2().asDiagonal();
  covariance += late * late.transpose();
  return covariance;
}

Matrix6 SystematicErrors::camera_covariance(const PosePrediction& predicted,
                                            const Rigid3& cam_from_body, int camera) const {
  const Matrix6 moves = adjoint(cam_from_body);
  const Matrix6 of_body = moves * predicted.covariance * moves.transpose();
  if (!has_own()) return of_body;
  const Eigen::Matrix<double, 6, Eigen::Dynamic> by_errors = moves * predicted.by_systematic;
  Matrix6 covariance = of_body;
  const auto add = [&](const Key& key, const Vector6& by_error) {
    const auto known = numbers_.find(key);
    covariance += by_error * by_error.transpose();
    if (known == numbers_.end()) return;
    for (std::size_t j = 0; j < predicted.systematic.size(); ++j) {
      if (predicted.systematic[j] != known->second) continue;
      const Vector6 common = by_errors.col(static_cast<Eigen::Index>(j));
      covariance += by_error * common.transpose() + common * by_error.transpose();
    }
  };
  for (int i = 0; i < 6; ++i) add({mount, camera, i}, Vector6::Unit(i) * mount_sigmas_[i]);
  add({clock, 0, 0}, moves * predicted.velocity * clock_sigma_s_);
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace occ::internal::track
