// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/internal/pixel_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::calibrate {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

core::LeastSquaresOptions options_of(int max_iterations) {
  core::LeastSquaresOptions options;
  options.max_iterations = max_iterations;
  options.step_tolerance = 1e-5;  // px
  options.take_last_step = true;
  return options;
}

// A rotation about the camera's centre and a translation.
struct PixelFitProblem {
  static constexpr int unknowns = 6;
  const Matrix3Xd& points;
  const Matrix2Xd& px;
  const Camera& camera;
  const Rigid3 base;
  const double gate_px;

  double chi2(const Vector6& step) const { return sums_at(step, nullptr); }
  bool sums(const Vector6& step, core::NormalSums<6>& sums) const {
    sums.chi2 = sums_at(step, &sums);
    return true;
  }

  double sums_at(const Vector6& step, core::NormalSums<6>* sums) const {
    const Rigid3 pose = perturb(base, step);
    Eigen::Matrix3d rotation;
    if (sums != nullptr) {
      sums->set_zero(6);
      rotation = so3_left_jacobian(step.head<3>());
    }
    double cost = 0;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Vector3d in_cam = pose * Vector3d(points.col(i));
      Eigen::Matrix<double, 2, 3> by_point;
      const auto at = camera.project(in_cam, sums != nullptr ? &by_point : nullptr);
      if (!at) {
        cost += core::tukey_loss(infinity, gate_px);
        continue;
      }
      const Vector2d off = -camera.difference_px(px.col(i), *at);
      const double squared = off.squaredNorm();
      cost += core::tukey_loss(squared, gate_px);
      if (sums == nullptr) continue;
      Eigen::Matrix<double, 2, 6> by_pose;
      by_pose << by_point * -skew(in_cam - step.tail<3>()) * rotation, by_point;
      const double weight = core::tukey_weight(squared, gate_px);
      sums->information += weight * by_pose.transpose() * by_pose;
      sums->gradient += weight * by_pose.transpose() * off;
    }
    return 2 * cost;
  }
};

// A rotation about the body's origin, a translation, and the logarithm of the scale.
struct BodyProblem {
  static constexpr int unknowns = Eigen::Dynamic;  // seven; a fixed size compiles for seconds
  using Step = Eigen::VectorXd;
  using Sums = core::NormalSums<Eigen::Dynamic>;
  const Matrix3Xd& corners;
  const std::vector<BodyView>& views;
  const Rigid3 base;
  const bool scale_free;

  Rigid3 pose_at(const Step& step) const {
    return {so3_exp(step.head<3>()) * base.rotation, base.translation + step.segment<3>(3)};
  }

  double chi2(const Step& step) const { return sums_at(step, nullptr); }
  bool sums(const Step& step, Sums& sums) const {
    sums.chi2 = sums_at(step, &sums);
    return std::isfinite(sums.chi2);
  }

  double sums_at(const Step& step, Sums* sums) const {
    const Rigid3 world_from_body = pose_at(step);
    const double scale = std::exp(step[6]);
    Eigen::Matrix3d rotation;
    if (sums != nullptr) {
      sums->set_zero(7);
      rotation = so3_left_jacobian(step.head<3>());
    }
    double chi2 = 0;
    for (const BodyView& view : views)
      for (Eigen::Index i = 0; i < corners.cols(); ++i) {
        const Vector3d arm = world_from_body.rotation * Vector3d(scale * corners.col(i));
        const Vector3d in_cam = view.cam_from_world * Vector3d(arm + world_from_body.translation);
        Eigen::Matrix<double, 2, 3> by_point;
        const auto at = view.camera->project(in_cam, sums != nullptr ? &by_point : nullptr);
        if (!at) return infinity;
        const Vector2d off = -view.camera->difference_px(view.px.col(i), *at) / view.sigma_px;
        chi2 += off.squaredNorm();
        if (sums == nullptr) continue;
        const Eigen::Matrix<double, 2, 3> by_world =
            by_point * view.cam_from_world.rotation / view.sigma_px;
        Eigen::Matrix<double, 2, 7> by_body;
        by_body << by_world * -skew(arm) * rotation, by_world, by_world * arm;
        if (!scale_free) by_body.col(6).setZero();
        sums->information += by_body.transpose() * by_body;
        sums->gradient += by_body.transpose() * off;
      }
    if (sums != nullptr && !scale_free) sums->information(6, 6) = 1;
    return chi2;
  }
};

}  // namespace

Matrix2Xd pose_residuals(const Matrix3Xd& points, const Matrix2Xd& px, const Camera& camera,
                         const Rigid3& cam_from_world) {
  Matrix2Xd off(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto at = camera.project(cam_from_world * Vector3d(points.col(i)));
    off.col(i) = at ? camera.difference_px(px.col(i), *at) : Vector2d::Constant(infinity);
  }
  return off;
}

PixelFit fit_pose(const Matrix3Xd& points, const Matrix2Xd& px, const Camera& camera,
                  const Rigid3& start, double gate_px, int max_iterations) {
  PixelFitProblem problem{points, px, camera, start, gate_px};
  PixelFit fit;
  fit.pose = start;
  fit.cost = 0.5 * problem.chi2(Vector6::Zero());
  if (!std::isfinite(fit.cost)) return fit;
  Vector6 step = Vector6::Zero();
  fit.converged = core::minimise_sums(problem, step, options_of(max_iterations)).converged;
  fit.pose = perturb(start, step);
  fit.cost = 0.5 * problem.chi2(step);
  return fit;
}

BodyFit fit_body(const Matrix3Xd& corners, const std::vector<BodyView>& views, const Rigid3& start,
                 bool scale_free, int max_iterations) {
  BodyProblem problem{corners, views, start, scale_free};
  BodyFit fit;
  fit.world_from_body = start;
  if (!std::isfinite(problem.chi2(BodyProblem::Step::Zero(7)))) return fit;
  BodyProblem::Step step = BodyProblem::Step::Zero(7);
  core::minimise_sums(problem, step, options_of(max_iterations));
  fit.world_from_body = problem.pose_at(step);
  fit.scale = std::exp(step[6]);
  BodyProblem::Sums sums;
  problem.sums(step, sums);
  fit.chi2 = sums.chi2;
  if (scale_free) {
    const double variance = core::inverse<Eigen::MatrixXd>(sums.information)(6, 6);
    if (variance > 0 && std::isfinite(variance)) fit.scale_sigma = fit.scale * std::sqrt(variance);
  }
  return fit;
}

}  // namespace occ::internal::calibrate
