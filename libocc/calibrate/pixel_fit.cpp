// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/internal/pixel_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::calibrate {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Tukey's biweight of a distance.
double tukey_cost(double squared, double gate_px) {
  if (!std::isfinite(gate_px)) return 0.5 * squared;
  const double g2 = gate_px * gate_px, left = 1 - std::min(1.0, squared / g2);
  return g2 / 6 * (1 - left * left * left);
}
double tukey_weight(double squared, double gate_px) {
  if (!std::isfinite(gate_px)) return 1;
  const double left = 1 - std::min(1.0, squared / (gate_px * gate_px));
  return left * left;
}

// Levenberg-Marquardt on `evaluate(x, hessian, gradient) -> cost` over a chart at x; `move` applies
// a step.
template <int n, typename Value, typename Evaluate, typename Move>
bool minimise(Value& value, double& cost, int max_iterations, const Evaluate& evaluate,
              const Move& move) {
  using Matrix = Eigen::Matrix<double, n, n>;
  using Vector = Eigen::Matrix<double, n, 1>;
  Matrix hessian;
  Vector gradient;
  cost = evaluate(value, &hessian, &gradient);
  double damping = 1e-4;
  for (int i = 0; i < max_iterations && std::isfinite(cost); ++i) {
    Matrix damped = hessian;
    damped.diagonal() += damping * hessian.diagonal() +
                         Vector::Constant(1e-14 * hessian.diagonal().maxCoeff() + 1e-30);
    const Vector step = damped.ldlt().solve(gradient);
    if (!step.allFinite()) return false;
    const Value moved = move(value, step);
    const double moved_cost = evaluate(moved, nullptr, nullptr);
    if (moved_cost <= cost) {
      const bool done = cost - moved_cost <= 1e-12 * cost + 1e-20 && step.norm() < 1e-6;
      value = moved;
      cost = evaluate(value, &hessian, &gradient);
      if (done) return true;
      damping = std::max(1e-9, 0.2 * damping);
    } else {
      if (step.norm() < 1e-10) return true;
      damping = std::max(1e-6, 8 * damping);
      if (damping > 1e12) return false;
    }
  }
  return false;
}

}  // namespace

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return infinity;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = static_cast<std::ptrdiff_t>(std::ceil(std::clamp(part, 0.0, 1.0) * last));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

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
  const auto evaluate = [&](const Rigid3& pose, Matrix6* hessian, Vector6* gradient) {
    double cost = 0;
    if (hessian != nullptr) {
      hessian->setZero();
      gradient->setZero();
    }
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Vector3d in_cam = pose * Vector3d(points.col(i));
      Eigen::Matrix<double, 2, 3> by_point;
      const auto at = camera.project(in_cam, hessian != nullptr ? &by_point : nullptr);
      if (!at) {
        cost += tukey_cost(infinity, gate_px);
        continue;
      }
      const Vector2d off = camera.difference_px(px.col(i), *at);
      const double squared = off.squaredNorm();
      cost += tukey_cost(squared, gate_px);
      if (hessian == nullptr) continue;
      Eigen::Matrix<double, 2, 6> by_pose;
      by_pose << by_point * -skew(in_cam), by_point;
      const double weight = tukey_weight(squared, gate_px);
      *hessian += weight * by_pose.transpose() * by_pose;
      *gradient += weight * by_pose.transpose() * off;
    }
    return cost;
  };
  PixelFit fit;
  fit.pose = start;
  fit.converged =
      minimise<6>(fit.pose, fit.cost, max_iterations, evaluate,
                  [](const Rigid3& pose, const Vector6& step) { return perturb(pose, step); });
  return fit;
}

BodyFit fit_body(const Matrix3Xd& corners, const std::vector<BodyView>& views, const Rigid3& start,
                 bool scale_free, int max_iterations) {
  using Matrix7 = Eigen::Matrix<double, 7, 7>;
  using Vector7 = Eigen::Matrix<double, 7, 1>;
  struct Placed {
    Rigid3 world_from_body;
    double log_scale = 0;
  };
  Matrix7 last = Matrix7::Zero();
  const auto evaluate = [&](const Placed& body, Matrix7* hessian, Vector7* gradient) {
    double cost = 0;
    if (hessian != nullptr) {
      hessian->setZero();
      gradient->setZero();
    }
    const double scale = std::exp(body.log_scale);
    for (const BodyView& view : views)
      for (Eigen::Index i = 0; i < corners.cols(); ++i) {
        const Vector3d turned = body.world_from_body.rotation * Vector3d(scale * corners.col(i));
        const Vector3d in_cam =
            view.cam_from_world * Vector3d(turned + body.world_from_body.translation);
        Eigen::Matrix<double, 2, 3> by_point;
        const auto at = view.camera->project(in_cam, hessian != nullptr ? &by_point : nullptr);
        if (!at) return infinity;
        const Vector2d off = view.camera->difference_px(view.px.col(i), *at) / view.sigma_px;
        cost += 0.5 * off.squaredNorm();
        if (hessian == nullptr) continue;
        const Eigen::Matrix<double, 2, 3> by_world =
            by_point * view.cam_from_world.rotation / view.sigma_px;
        Eigen::Matrix<double, 2, 7> by_body;  // turned about its own origin
        by_body << by_world * -skew(turned), by_world, by_world * turned;
        if (!scale_free) by_body.col(6).setZero();
        *hessian += by_body.transpose() * by_body;
        *gradient += by_body.transpose() * off;
      }
    if (hessian != nullptr) {
      if (!scale_free) (*hessian)(6, 6) = 1;
      last = *hessian;
    }
    return cost;
  };
  Placed body{start, 0};
  double cost = infinity;
  minimise<7>(body, cost, max_iterations, evaluate, [](const Placed& from, const Vector7& step) {
    Placed to = from;
    to.world_from_body.rotation = so3_exp(step.head<3>()) * from.world_from_body.rotation;
    to.world_from_body.translation += step.segment<3>(3);
    to.log_scale += step[6];
    return to;
  });
  BodyFit fit;
  fit.world_from_body = body.world_from_body;
  fit.scale = std::exp(body.log_scale);
  fit.chi2 = 2 * cost;
  if (scale_free && std::isfinite(cost)) {
    const double variance = last.inverse()(6, 6);
    if (variance > 0 && std::isfinite(variance)) fit.scale_sigma = fit.scale * std::sqrt(variance);
  }
  return fit;
}

}  // namespace occ::internal::calibrate
