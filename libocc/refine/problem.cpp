// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"
#include "libocc/refine/internal/prior_rows.hpp"

namespace occ::internal::refine {
namespace {

/// Prior of the growth: blooming and blur enlarge a saturated rim by one or two pixels.
constexpr double growth_sigma_px = 2;

/// If a larger share of its rim points is lost, the centroid of the lamp is used.
constexpr double max_lost_share = 0.25;

/// The scene's emission is rejected if a free order of emission reduces chi-square by this many
/// sigmas more than by chance. Free orders increase the pose's sigma by 10 % for discs with a
/// radius of 14 pixels. A PSF that is not Gaussian increases the reduction by up to 6 sigmas.
constexpr double emission_sigmas = 7;

using Jacobian16 = Eigen::Matrix<double, 1, 6>;

/// ln(measured / predicted electrons) over its sigma; empty if no light of the lamp is predicted.
std::optional<double> flux_residual(const LampObservation& lamp, const State& state,
                                    const Scene& scene, Jacobian16* log_jacobian = nullptr) {
  const double electrons =
      lamp_electrons(*lamp.lamp, state.cam_from_world, scene.camera, scene.sensor, log_jacobian);
  if (!(electrons > 0)) return std::nullopt;
  return (lamp.log_electrons - std::log(electrons) - state.log_factor) * lamp.flux_inverse_sigma;
}

}  // namespace

RefineProblem::RefineProblem(const Observations& observations, const Scene& scene,
                             const RefineOptions& options, Rung rung)
    : observations_(observations),
      scene_(scene),
      options_(options),
      rung_(rung),
      held_(observations.lamps.size()) {
  parts_.lamps.resize(observations.lamps.size());
  if (!uses_rims(rung)) return;
  rims_.reserve(observations.lamps.size());
  for (const LampObservation& lamp : observations.lamps)
    rims_.emplace_back(lamp, observations, scene, options.huber_sigma);
  pixels_.resize(observations.lamps.size());
  if (rung != Rung::direct || !observations.has_pixels()) return;
  noise_.emplace(scene.sensor);
  psf_.emplace(observations.psf_sigma_px);
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const LampObservation& lamp = observations.lamps[i];
    if (!lamp.has_pixels()) continue;
    pixels_[i] = std::make_unique<LampPixels>(lamp, scene, options, *noise_, *psf_, scratch_);
  }
}

bool RefineProblem::estimates_log_factor() const {
  return observations_.has_flux && options_.flux == FluxModel::common_factor;
}

Eigen::Vector3d RefineProblem::pivot(const State& state) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const LampObservation& lamp : observations_.lamps) sum += lamp.lamp->centre_m;
  const auto count = static_cast<double>(std::max<std::size_t>(1, observations_.lamps.size()));
  return state.cam_from_world * (sum / count);
}

bool RefineProblem::linearise(const State& state, const Eigen::Vector3d& pivot,
                              PoseNormalEquations& normal) {
  normal = PoseNormalEquations{};
  const Eigen::Index shared_errors = observations_.shared_errors.count();
  std::optional<SharedSums> shared;
  if (shared_errors > 0) shared.emplace(shared_errors);
  for (std::size_t i = 0; i < observations_.lamps.size(); ++i) {
    SharedSums* const sums = shared ? &*shared : nullptr;
    const PartRecorder before(normal, sums);
    if (!add_lamp(i, state, pivot, normal, sums)) return false;
    before.finish(normal, sums, parts_.lamps[i]);
  }
  parts_.prior = -normal.information;
  add_priors(state, pivot, normal);
  parts_.prior += normal.information;
  if (shared) eliminate_shared(*shared, normal);
  return true;
}

std::vector<RefineProblem::LampSums> RefineProblem::lamp_sums(const State& state,
                                                              const Eigen::Vector3d& pivot) {
  const Eigen::Index errors = observations_.shared_errors.count();
  std::vector<LampSums> out;
  for (std::size_t i = 0; i < observations_.lamps.size(); ++i) {
    LampSums lamp{Matrix8::Zero(), SharedSums(errors)};
    PoseNormalEquations normal;
    add_lamp(i, state, pivot, normal, errors > 0 ? &lamp.shared : nullptr);
    lamp.information = normal.information;
    out.push_back(std::move(lamp));
  }
  return out;
}

void RefineProblem::eliminate_shared(const SharedSums& shared, PoseNormalEquations& normal) {
  shared_gain_ = shared.gain();
  shared_estimate_ = -shared_gain_ * shared.gradient;
  shared_mixed_ = shared.mixed;
  const Eigen::MatrixXd half = core::product(shared.mixed, shared_gain_);
  normal.information -= core::product_transposed(half, shared.mixed);
  normal.gradient += shared.mixed * shared_estimate_;
  const double reduction = -shared.gradient.dot(shared_estimate_);
  normal.chi2 -= reduction;
  normal.robust_chi2 -= reduction;
}

void RefineProblem::report_own_chi2(const State& state, std::vector<LampObservation>& lamps) const {
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    LampObservation& lamp = lamps[i];
    lamp.own_chi2 = lamp.own_coordinates = 0;
    if (lamp.contradicts) continue;
    if (held_[i].by_rim) {
      lamp.own_chi2 = rims_[i].own_chi2();
      lamp.own_coordinates = 3;
    } else if (lamp.has_centroid) {
      const auto centroid = centroid_residual(lamp, state, pivot(state));
      if (!centroid) continue;
      Eigen::Vector2d off_px = centroid->residual_px;
      if (centroid->by_shared.cols() > 0)
        off_px += centroid->by_shared * observations_.shared_shift;
      lamp.own_chi2 = off_px.dot(centroid->information * off_px);
      lamp.own_coordinates = 2;
    }
  }
}

Eigen::VectorXd RefineProblem::shared_estimate(const Vector8& step) const {
  if (shared_gain_.size() == 0) return {};
  return shared_estimate_ - shared_gain_ * (shared_mixed_.transpose() * step);
}

bool RefineProblem::add_lamp(std::size_t index, const State& state, const Eigen::Vector3d& pivot,
                             PoseNormalEquations& normal, SharedSums* shared) {
  const LampObservation& lamp = observations_.lamps[index];
  Held& held = held_[index];
  held.by_rim = false;
  if (lamp.contradicts) return true;
  if (rung_ == Rung::direct && lamp.has_pixels()) {
    if (!pixels_[index]->linearise(state, pivot)) return false;
    pixels_[index]->add_to(normal);
    return true;
  }
  if (uses_rims(rung_) && lamp.has_rim()) {
    const auto count = static_cast<double>(lamp.rim_end - lamp.rim_begin);
    const int lost = rims_[index].linearise(state, pivot);
    held.by_rim = !lamp.has_centroid || lost <= max_lost_share * count;
  }
  if (held.by_rim) {
    rims_[index].add_to(normal, shared);
  } else if (lamp.has_centroid && !add_centroid(lamp, state, pivot, normal, shared, held)) {
    return false;
  }
  return !lamp.has_flux || add_flux(lamp, state, pivot, held.flux_weight, normal);
}

std::optional<RefineProblem::CentroidResidual> RefineProblem::centroid_residual(
    const LampObservation& lamp, const State& state, const Eigen::Vector3d& pivot) const {
  Eigen::Matrix<double, 2, 6> d_pose;
  const std::optional<Eigen::Vector2d> centre =
      predicted_centroid_px(*lamp.lamp, *lamp.blob, state.cam_from_world, scene_, rung_, &d_pose);
  if (!centre) return std::nullopt;
  CentroidResidual centroid{scene_.camera.difference_px(lamp.blob->centroid_px, *centre),
                            Eigen::Matrix<double, 2, 8>::Zero(), lamp.centroid_information};
  if (lamp.errors) {
    const Eigen::Vector2d by_size =
        2 * perspective_shift_px(*lamp.lamp, state.cam_from_world, scene_.camera, *centre)
                .value_or(Eigen::Vector2d::Zero());
    const Eigen::Matrix2d covariance =
        lamp.centroid_information.inverse() +
        image_covariance_px2(*lamp.lamp, state.cam_from_world, scene_.camera, lamp.errors) +
        square(lamp.errors->size) * by_size * by_size.transpose();
    centroid.information = covariance.inverse();
  }
  if (observations_.shared_errors.count() > 0) {
    centroid.by_shared = -observations_.shared_errors.by_errors(
        scene_.camera, *lamp.lamp, state.cam_from_world, d_pose.rightCols<3>());
    centroid.residual_px -= centroid.by_shared * observations_.shared_shift;
  }
  for (int i = 0; i < 2; ++i) {
    Vector8 row = Vector8::Zero();
    row.head<6>() = -d_pose.row(i).transpose();
    centre_row(row, pivot);
    centroid.jacobian.row(i) = row.transpose();
  }
  return centroid;
}

Eigen::Matrix2d RefineProblem::CentroidResidual::covariance_px2() const {
  Eigen::Matrix2d covariance = information.inverse();
  if (by_shared.cols() > 0) covariance += core::product_transposed(by_shared, by_shared);
  return covariance;
}

bool RefineProblem::add_centroid(const LampObservation& lamp, const State& state,
                                 const Eigen::Vector3d& pivot, PoseNormalEquations& normal,
                                 SharedSums* shared, Held& held) const {
  const std::optional<CentroidResidual> p = centroid_residual(lamp, state, pivot);
  if (!p) return false;
  held.centroid_information = p->information;
  held.by_shared = p->by_shared;
  const Eigen::Matrix<double, 8, 2> informed = p->jacobian.transpose() * p->information;
  const double chi2 = p->residual_px.dot(p->information * p->residual_px);
  if (shared) {
    const Eigen::Matrix2Xd weighted = p->information * p->by_shared;
    shared->mixed += core::product(informed, p->by_shared);
    shared->information += core::transposed_product(p->by_shared, weighted);
    shared->gradient += weighted.transpose() * p->residual_px;
  }
  normal.information += informed.lazyProduct(p->jacobian);
  normal.gradient.noalias() += informed * p->residual_px;
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2;
  return true;
}

bool RefineProblem::add_flux(const LampObservation& lamp, const State& state,
                             const Eigen::Vector3d& pivot, double& weight,
                             PoseNormalEquations& normal) const {
  Jacobian16 d_pose;
  const std::optional<double> residual = flux_residual(lamp, state, scene_, &d_pose);
  if (!residual) return false;
  Vector8 row = Vector8::Zero();
  row.head<6>() = -d_pose.transpose();
  centre_row(row, pivot);
  row[log_factor_index] = estimates_log_factor() ? -1 : 0;
  row *= lamp.flux_inverse_sigma;
  weight = core::huber_weight(*residual * *residual, options_.huber_sigma);
  normal.add(std::sqrt(weight) * row, std::sqrt(weight) * *residual);
  normal.robust_chi2 += weight * (1 - weight) * *residual * *residual;
  return true;
}

bool RefineProblem::free_emission(const PoseNormalEquations& normal) {
  PoseNormalEquations free = normal;
  int lamps = 0;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    if (!pixels_[i] || observations_.lamps[i].contradicts) continue;
    pixels_[i]->exchange_emission_prior(free);
    ++lamps;
  }
  // For a correct scene, the reduction follows a chi-square distribution with `lamps` degrees.
  const double reached =
      free.chi2 - free.gradient.dot(core::solve_ldlt(free.information, free.gradient));
  if (!(normal.chi2 - reached > lamps + emission_sigmas * std::sqrt(2.0 * lamps))) return false;
  for (const auto& pixels : pixels_)
    if (pixels) pixels->free_emission();
  return true;
}

void RefineProblem::add_priors(const State& state, const Eigen::Vector3d& pivot,
                               PoseNormalEquations& normal) const {
  const double growth_sigma = observations_.rims_grow ? growth_sigma_px : 1;
  normal.add(Vector8::Unit(growth_index) / growth_sigma, state.growth_px / growth_sigma);
  if (!estimates_log_factor()) normal.add(Vector8::Unit(log_factor_index), state.log_factor);
  if (options_.prior) add_prior(*options_.prior, state.cam_from_world, pivot, normal);
}

double RefineProblem::chi2(const State& state) {
  PoseNormalEquations own;
  add_priors(state, Eigen::Vector3d::Zero(), own);
  double sum = own.chi2;
  const Eigen::Index shared_errors = observations_.shared_errors.count();
  Eigen::VectorXd by_shared = Eigen::VectorXd::Zero(shared_errors);
  for (std::size_t i = 0; i < observations_.lamps.size(); ++i) {
    const LampObservation& lamp = observations_.lamps[i];
    if (lamp.contradicts) continue;
    if (held_[i].by_rim) {
      sum += rims_[i].chi2(state, shared_errors > 0 ? &by_shared : nullptr);
    } else if (lamp.has_centroid) {
      const std::optional<Eigen::Vector2d> centre =
          predicted_centroid_px(*lamp.lamp, *lamp.blob, state.cam_from_world, scene_, rung_);
      if (!centre) return std::numeric_limits<double>::infinity();
      const Held& held = held_[i];
      Eigen::Vector2d residual = scene_.camera.difference_px(lamp.blob->centroid_px, *centre);
      if (shared_errors > 0) {
        residual -= held.by_shared * observations_.shared_shift;
        by_shared += held.by_shared.transpose() * held.centroid_information * residual;
      }
      sum += residual.dot(held.centroid_information * residual);
    }
    if (lamp.has_flux) {
      const std::optional<double> residual = flux_residual(lamp, state, scene_);
      if (!residual) return std::numeric_limits<double>::infinity();
      sum += held_[i].flux_weight * *residual * *residual;
    }
  }
  return shared_errors > 0 ? sum - by_shared.dot(shared_gain_ * by_shared) : sum;
}

double RefineProblem::max_motion_px(const State& state, const Eigen::Vector3d& pivot,
                                    const Vector8& step) const {
  double largest = 0;
  for (const LampObservation& lamp : observations_.lamps) {
    const Eigen::Vector3d point = state.cam_from_world * lamp.lamp->centre_m;
    Eigen::Matrix<double, 2, 3> d_point;
    if (!scene_.camera.project(point, &d_point)) continue;
    const Eigen::Vector3d motion = step.head<3>().cross(point - pivot) + step.segment<3>(3);
    largest = std::max(largest, (d_point * motion).norm());
  }
  return largest;
}

}  // namespace occ::internal::refine
