// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/evidence.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::pose {
namespace {

/// Standard deviations of the errors of camera and map, and their probability.
struct ModelErrors {
  double over_typical;  ///< over PoseEvidence::model_sigma_px
  double size;          ///< relative, common to all lamps
  double share;         ///< probability
};

/// Calibrated, typical, uncalibrated, poor; and typical with wrong sizes.
constexpr std::array<ModelErrors, 5> model_errors = {
    {{0, 0, 0.3}, {0.3, 0, 0.3}, {1, 0, 0.28}, {4, 0, 0.1}, {0.3, 0.15, 0.02}}};

bool applies(const ModelErrors& errors, const PoseEvidence& pose) {
  constexpr std::size_t min_lamps_of_wrong_size = 4;
  return errors.size == 0 || pose.lamps.size() >= min_lamps_of_wrong_size;
}

/// Beta prior of the rate of dark lamps: low rates are more probable, but any is possible.
constexpr double dark = 1, lit = 2;

constexpr double min_variance_px2 = 1e-8;  ///< variance of a noise-free centroid

double log_beta(double a, double b) { return std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b); }

double log_sum(const std::vector<double>& terms) {
  if (terms.empty()) return -infinity;
  const double largest = *std::max_element(terms.begin(), terms.end());
  if (!std::isfinite(largest)) return largest;
  double sum = 0;
  for (const double term : terms) sum += std::exp(term - largest);
  return largest + std::log(sum);
}

/// ln P(n) n!, see the header.
double log_false_lights(double n) { return std::lgamma(n + 1) - std::log((n + 1) * (n + 2)); }

/// ln of the terms that do not depend on the pose's accuracy.
double log_counts(const PoseEvidence& pose) {
  const auto seen = static_cast<double>(pose.lamps.size()), blobs = static_cast<double>(pose.blobs);
  return log_false_lights(std::max(0.0, blobs - seen)) - log_false_lights(std::max(blobs, seen)) +
         seen * std::log(pose.image_px2) + log_beta(dark + pose.missed, lit + seen) -
         log_beta(dark, lit);
}

/// Errors of camera and map move a rim, but hardly deform it.
constexpr double share_of_shape = 0.3;

/// Sums of residuals that are linear in the pose and in the common relative error of the sizes.
struct PoseSums {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double chi2 = 0;
  double size_sigma = 0;  ///< standard deviation of that error; 0: there is none
  double size_information = 0, size_gradient = 0;
  Vector6 size_by_pose = Vector6::Zero();

  template <class Residual, class ByPose, class Weight>
  void add(const Residual& residual, const ByPose& by_pose, const Weight& weight) {
    information += by_pose.transpose() * weight * by_pose;
    gradient += by_pose.transpose() * (weight * residual);
    chi2 += residual.dot(weight * residual);
  }
  template <class Residual, class ByPose, class Weight>
  void add(const Residual& residual, const ByPose& by_pose, const Residual& by_size,
           const Weight& weight) {
    add(residual, by_pose, weight);
    if (size_sigma == 0) return;
    size_information += by_size.dot(weight * by_size);
    size_gradient += by_size.dot(weight * residual);
    size_by_pose += by_pose.transpose() * (weight * by_size);
  }
  /// ln of the integral of e^(-chi2/2) over the pose and over the normal density of the error of
  /// the sizes, without the factor (2 pi)^3: only quotients of two integrals are used.
  double log_integral() const {
    if (size_sigma == 0) return log_integral(information, gradient, chi2);
    const double variance = square(size_sigma), sum = size_information + 1 / variance;
    return log_integral(information - size_by_pose * size_by_pose.transpose() / sum,
                        gradient - size_by_pose * (size_gradient / sum),
                        chi2 - square(size_gradient) / sum) -
           0.5 * std::log(sum * variance);
  }

 private:
  static double log_integral(const Matrix6& information, const Vector6& gradient, double chi2) {
    const core::Cholesky<Matrix6> root(information);
    const double smallest = std::max(0.0, chi2 - gradient.dot(root.solve(gradient)));
    return -0.5 * (root.log_determinant() + smallest);
  }
};

/// Density of the poses before their places are compared: wide in all directions, times the prior
/// without the part `wrong` (-1: none) and the shapes.
PoseSums before_places(const PoseEvidence& pose, const ModelErrors& errors, int wrong) {
  const double length_m = std::cbrt(pose.volume_m3);
  const double information = 3 / (pi * pi) / square(std::cbrt(pose.rotations));
  PoseSums sums;
  sums.size_sigma = errors.size;
  sums.information.diagonal() << Eigen::Vector3d::Constant(information),
      Eigen::Vector3d::Constant(12 / (length_m * length_m));
  for (int i = 0; i < static_cast<int>(pose.prior.size()); ++i) {
    if (i == wrong) continue;
    sums.information += pose.prior[i].information;
    sums.gradient += pose.prior[i].gradient;
    sums.chi2 += pose.prior[i].chi2;
  }
  for (const SeenLamp& lamp : pose.lamps) {
    if (std::isinf(lamp.shape_sigma_px)) continue;
    const double model_px = share_of_shape * errors.over_typical * pose.model_sigma_px;
    const double variance_px2 = square(lamp.shape_sigma_px) + square(model_px) + min_variance_px2;
    const Eigen::Matrix3d weight = Eigen::Matrix3d::Identity() / variance_px2;
    sums.add(lamp.shape_residual_px, lamp.shape_by_pose, lamp.shape_by_size, weight);
  }
  return sums;
}

/// ln of the integral of before_places() for each size of the errors of camera and map.
using Integrals = std::array<double, model_errors.size()>;

/// Poses of one assignment. The density of the pose before the places are compared is the same for
/// all of them, so it has one integral, which is taken where it is largest.
Integrals log_integrals_before(const std::vector<PoseEvidence>& group, int wrong) {
  Integrals largest;
  largest.fill(-infinity);
  for (const PoseEvidence& pose : group)
    for (std::size_t i = 0; i < largest.size(); ++i)
      if (applies(model_errors[i], pose))
        largest[i] =
            std::max(largest[i], before_places(pose, model_errors[i], wrong).log_integral());
  return largest;
}

/// ln of the evidence of the places, for one size of the errors of camera and map: the integral of
/// the density of the pose times that of the centroids, over the integral of the former.
double log_places(const PoseEvidence& pose, const ModelErrors& errors, int wrong,
                  double log_integral_before) {
  const double model_sigma_px = errors.over_typical * pose.model_sigma_px;
  PoseSums sums = before_places(pose, errors, wrong);
  double log = pose.log_appearance - log_integral_before;
  for (const SeenLamp& lamp : pose.lamps) {
    const Eigen::Matrix2d s = lamp.covariance_px2 + (square(model_sigma_px) + min_variance_px2) *
                                                        Eigen::Matrix2d::Identity();
    sums.add(lamp.residual_px, lamp.by_pose, Eigen::Matrix2d(s.inverse()));
    log -= std::log(2 * pi) + 0.5 * std::log(s.determinant());
  }
  for (const SeenLamp& corner : pose.corners) {
    const Eigen::Matrix2d s =
        corner.covariance_px2 +
        (square(share_of_shape * model_sigma_px) + min_variance_px2) * Eigen::Matrix2d::Identity();
    sums.add(corner.residual_px, corner.by_pose, corner.by_size, Eigen::Matrix2d(s.inverse()));
    log -= std::log(2 * pi) + 0.5 * std::log(s.determinant());
  }
  return log + sums.log_integral();
}

/// Mean of the evidence of the places over the sizes of the errors.
double log_places(const PoseEvidence& pose, int wrong, const Integrals& before) {
  std::vector<double> terms;
  for (std::size_t i = 0; i < model_errors.size(); ++i)
    if (const ModelErrors& errors = model_errors[i]; applies(errors, pose))
      terms.push_back(std::log(errors.share) + log_places(pose, errors, wrong, before[i]));
  return log_sum(terms);
}

/// `before`: log_integrals_before() without each part of the prior, and last with all of them.
LogEvidence log_evidence(const PoseEvidence& pose, const std::vector<Integrals>& before) {
  if (pose.lamps.empty()) return {};
  PoseEvidence elsewhere = pose;
  elsewhere.missed = 0;
  const double counts = log_counts(pose), counts_elsewhere = log_counts(elsewhere);
  std::vector<double> terms, excluded, places;
  double all_right = 0;
  for (std::size_t i = 0; i < pose.prior.size(); ++i) {
    const PriorPart& part = pose.prior[i];
    all_right += std::log1p(-part.wrong);
    const double log = std::log(part.wrong) + log_places(pose, static_cast<int>(i), before[i]);
    terms.push_back(counts + log);
    if (part.is_place)
      places.push_back(counts_elsewhere + log);
    else
      excluded.push_back(counts + log);
  }
  terms.push_back(counts + all_right + log_places(pose, -1, before.back()));
  return {log_sum(terms), log_sum(excluded), log_sum(places)};
}

}  // namespace

double log_determinant(const Matrix6& matrix) {
  return core::Cholesky<Matrix6>(matrix).log_determinant();
}

LogEvidence log_evidence(const PoseEvidence& pose) { return log_evidences({pose}).front(); }

std::vector<LogEvidence> log_evidences(const std::vector<PoseEvidence>& poses_of_one_assignment) {
  if (poses_of_one_assignment.empty()) return {};
  std::vector<Integrals> before;
  const auto parts = static_cast<int>(poses_of_one_assignment.front().prior.size());
  for (int wrong = 0; wrong < parts; ++wrong)
    before.push_back(log_integrals_before(poses_of_one_assignment, wrong));
  before.push_back(log_integrals_before(poses_of_one_assignment, -1));
  std::vector<LogEvidence> logs;
  for (const PoseEvidence& pose : poses_of_one_assignment)
    logs.push_back(log_evidence(pose, before));
  return logs;
}

std::vector<double> probabilities(const std::vector<double>& log_evidences, double log_none) {
  std::vector<double> terms = log_evidences;
  terms.push_back(log_none);
  const double largest = *std::max_element(terms.begin(), terms.end());
  double sum = 0;
  for (double& term : terms) sum += term = std::exp(term - largest);
  for (double& term : terms) term /= sum;
  return terms;
}

}  // namespace occ::internal::pose
