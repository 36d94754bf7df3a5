// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/view.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::smooth {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> numbers_in(const MatrixXd& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// Names a camera by its parameters and their covariance.
std::vector<double> camera_key(const Camera& camera) {
  std::vector<double> key = numbers_in(camera.parameter_covariance());
  for (const CameraParameter& parameter : camera.parameters()) key.push_back(parameter.value);
  return key;
}

ViewErrors errors_of(const SmootherFrame& frame, const SmootherOptions& options,
                     ErrorNumbers& numbers) {
  ViewErrors out;
  out.camera_root = frame.camera.root_of_covariance();
  if (out.camera_root.cols() > 0) {
    const std::vector<double> key = camera_key(frame.camera);
    for (int i = 0; i < static_cast<int>(out.camera_root.cols()); ++i)
      out.shared_numbers.push_back(numbers.of(ErrorNumbers::camera, key, i));
  }
  out.mount_sigmas << Eigen::Vector3d::Constant(options.mount_sigma_rad),
      Eigen::Vector3d::Constant(options.mount_sigma_m);
  out.clock_sigma_s = options.clock_sigma_s;
  for (int i = 0; i < 6; ++i)
    if (out.mount_sigmas[i] > 0)
      out.shared_numbers.push_back(
          numbers.of(ErrorNumbers::mount, numbers_in(frame.cam_from_body.matrix()), i));
  if (out.clock_sigma_s > 0) out.shared_numbers.push_back(numbers.of(ErrorNumbers::clock, {}, 0));
  bool exact = true;
  for (const PointSighting& seen : frame.sightings)
    exact = exact && seen.point_covariance_m2.isZero(0);
  if (exact) return out;
  for (const PointSighting& seen : frame.sightings) {
    out.point_roots.push_back(core::semidefinite_root(seen.point_covariance_m2));
    for (int i = 0; i < 3; ++i)
      out.point_numbers.push_back(
          numbers.of(ErrorNumbers::point, numbers_in(seen.point_in_world), i));
  }
  return out;
}

/// Linearised residual of one sighting.
struct Row {
  std::size_t sighting;
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_body;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_shared;
  double huber = 1;
  Eigen::Matrix2d weight;  ///< (I / huber + by_point by_point^T)^-1: the point's errors eliminated
};

/// Minimises a view's cost over its errors, by Gauss-Newton with Huber's weights.
class ErrorFit {
 public:
  ErrorFit(const View& view, const Rigid3& body_from_world, double corner)
      : view_(view),
        body_(body_from_world),
        corner_(corner),
        shared_(VectorXd::Zero(static_cast<Eigen::Index>(view.errors.shared_numbers.size()) +
                               (view.errors.clock_sigma_s > 0 ? 6 : 0))),
        points_(view.root.size(), Eigen::Vector3d::Zero()) {}

  ViewFit run() {
    constexpr int max_steps = 8;
    constexpr double negligible = 1e-8;  // sigmas; the cost is stationary
    for (int step = 0; step < max_steps; ++step) {
      if (!linearise()) {
        ViewFit outside;
        outside.cost = std::numeric_limits<double>::infinity();
        outside.residuals.resize(view_.root.size());
        return outside;
      }
      if (step + 1 == max_steps || !(improve() > negligible)) break;
    }
    return result();
  }

 private:
  bool linearise() {
    const ViewErrors& errors = view_.errors;
    const Eigen::Index camera = errors.camera_root.cols();
    Vector6 of_mount = Vector6::Zero();
    Eigen::Index column = camera;
    for (int i = 0; i < 6; ++i)
      if (errors.mount_sigmas[i] > 0) of_mount[i] = errors.mount_sigmas[i] * shared_[column++];
    const Vector6 late = errors.clock_sigma_s * view_.velocity;
    const Matrix6 uncertain = errors.clock_sigma_s * view_.velocity_root.transpose();
    Rigid3 cam_from_body = perturb(view_.frame.cam_from_body, of_mount);
    Rigid3 body = body_;
    if (errors.clock_sigma_s > 0) {
      const Vector6 shift = late * shared_[column] + uncertain * shared_.tail<6>();
      cam_from_body = cam_from_body * perturb(Rigid3{}, shift);
    }
    const Matrix6 d_body = adjoint(cam_from_body);
    rows_.clear();
    for (std::size_t i = 0; i < view_.root.size(); ++i) {
      if (view_.aside[i]) continue;
      const PointSighting& seen = view_.frame.sightings[i];
      Eigen::Vector3d point = seen.point_in_world;
      if (!errors.point_roots.empty()) point += errors.point_roots[i].transpose() * points_[i];
      const Eigen::Vector3d in_cam = cam_from_body * (body * point);
      Eigen::Matrix<double, 2, 3> d_point;
      const auto px = view_.frame.camera.project(in_cam, &d_point);
      if (!px || !px->allFinite()) return false;
      Row row;
      row.sighting = i;
      const Eigen::Matrix<double, 2, 3> whitened = view_.root[i] * d_point;
      Eigen::Matrix<double, 2, 6> d_cam;
      d_cam << -whitened * skew(in_cam), whitened;
      row.by_body = d_cam * d_body;
      row.by_point.setZero();
      if (!errors.point_roots.empty())
        row.by_point =
            whitened * cam_from_body.rotation * body.rotation * errors.point_roots[i].transpose();
      row.by_shared.resize(Eigen::NoChange, shared_.size());
      if (camera > 0) row.by_shared.leftCols(camera) = view_.by_camera[i];
      column = camera;
      for (int k = 0; k < 6; ++k)
        if (errors.mount_sigmas[k] > 0)
          row.by_shared.col(column++) = errors.mount_sigmas[k] * d_cam.col(k);
      if (errors.clock_sigma_s > 0) {
        row.by_shared.col(column) = row.by_body * late;
        row.by_shared.rightCols<6>() = row.by_body * uncertain;
      }
      row.residual = view_.root[i] * view_.frame.camera.difference_px(*px, seen.px);
      if (camera > 0) row.residual += view_.by_camera[i] * shared_.head(camera);
      row.huber = core::huber_weight(row.residual.squaredNorm(), corner_);
      row.weight =
          (Eigen::Matrix2d::Identity() / row.huber + row.by_point * row.by_point.transpose())
              .inverse();
      rows_.push_back(std::move(row));
    }
    return true;
  }

  /// Takes a step of the errors and returns its length.
  double improve() {
    const Eigen::Index n = shared_.size();
    MatrixXd normal = MatrixXd::Identity(n, n);
    VectorXd right = VectorXd::Zero(n);
    std::vector<Eigen::Vector2d> at_zero;  // residuals extrapolated to exact values
    for (const Row& row : rows_) {
      at_zero.push_back(row.residual - row.by_point * points_[row.sighting] -
                        row.by_shared * shared_);
      const Eigen::Matrix<double, 2, Eigen::Dynamic> weighted = row.weight * row.by_shared;
      normal += core::transposed_product(row.by_shared, weighted);
      right -= weighted.transpose() * at_zero.back();
    }
    const VectorXd shared = n > 0 ? core::solve_llt(normal, right) : right;
    double squared = (shared - shared_).squaredNorm();
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Row& row = rows_[k];
      const Eigen::Vector3d point =
          -row.by_point.transpose() * (row.weight * (at_zero[k] + row.by_shared * shared));
      squared += (point - points_[row.sighting]).squaredNorm();
      points_[row.sighting] = point;
    }
    shared_ = shared;
    return std::sqrt(squared);
  }

  ViewFit result() const {
    ViewFit out;
    out.residuals.resize(view_.root.size());
    out.cost = 0.5 * shared_.squaredNorm();
    const Eigen::Index n = shared_.size();
    MatrixXd normal = MatrixXd::Identity(n, n), mixed = MatrixXd::Zero(6, n);
    for (const Row& row : rows_) {
      out.residuals[row.sighting] = row.residual;
      out.cost += core::huber_loss(row.residual.squaredNorm(), corner_) +
                  0.5 * points_[row.sighting].squaredNorm();
      out.gradient += row.huber * row.by_body.transpose() * row.residual;
      const Eigen::Matrix<double, 2, 6> weighted = row.weight * row.by_body;
      out.information += row.by_body.transpose() * weighted;
      mixed += core::transposed_product(weighted, row.by_shared);
      normal += core::transposed_product(row.by_shared, row.weight * row.by_shared);
    }
    // Rows of J - G N^-1 A^T: what the pose changes if the shared errors follow it.
    const MatrixXd solved = n > 0 ? core::solve_llt<MatrixXd, MatrixXd>(normal, mixed.transpose())
                                  : MatrixXd::Zero(0, 6);
    out.information -= core::product(mixed, solved);
    out.information = (0.5 * (out.information + out.information.transpose())).eval();
    const auto common = static_cast<Eigen::Index>(view_.errors.shared_numbers.size());
    out.common.add(view_.errors.shared_numbers, solved.topRows(common).transpose());
    if (view_.errors.point_numbers.empty()) return out;
    for (const Row& row : rows_) {
      const Eigen::Matrix<double, 2, 6> follows =
          row.by_body - core::product(row.by_shared, solved);
      const auto first =
          view_.errors.point_numbers.begin() + 3 * static_cast<std::ptrdiff_t>(row.sighting);
      out.common.add(std::vector<int>(first, first + 3),
                     follows.transpose() * row.weight * row.by_point);
    }
    return out;
  }

  const View& view_;
  Rigid3 body_;
  double corner_;
  VectorXd shared_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Row> rows_;
};

}  // namespace

View::View(const SmootherFrame& seen, const SmootherOptions& options, ErrorNumbers& numbers)
    : frame(seen),
      aside(seen.sightings.size(), false),
      d_body(adjoint(seen.cam_from_body)),
      errors(errors_of(seen, options, numbers)) {
  for (const PointSighting& sighting : seen.sightings)
    root.push_back(core::Cholesky<Eigen::Matrix2d>(sighting.covariance_px2)
                       .solve_lower<Eigen::Matrix2d>(Eigen::Matrix2d::Identity()));
  by_camera.assign(seen.sightings.size(),
                   Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, errors.camera_root.cols()));
}

bool View::set_aside(const Rigid3& body_from_world) {
  bool changed = false;
  for (std::size_t i = 0; i < root.size(); ++i) {
    const bool now = !sighting_residual(*this, i, body_from_world);
    changed = changed || now != aside[i];
    aside[i] = now;
    if (now || errors.camera_root.cols() == 0) continue;
    Eigen::Matrix<double, 2, 3> d_point;
    Camera::ParameterJacobian d_parameters;
    frame.camera.project(
        frame.cam_from_body * (body_from_world * frame.sightings[i].point_in_world), &d_point,
        &d_parameters);
    by_camera[i] = root[i] * (d_parameters * errors.camera_root);
  }
  return changed;
}

std::optional<Eigen::Vector2d> sighting_residual(const View& view, std::size_t i,
                                                 const Rigid3& body_from_world,
                                                 Eigen::Matrix<double, 2, 6>* d_body) {
  const PointSighting& sighting = view.frame.sightings[i];
  const Eigen::Vector3d in_cam =
      view.frame.cam_from_body * (body_from_world * sighting.point_in_world);
  Eigen::Matrix<double, 2, 3> d_point;
  const auto px = view.frame.camera.project(in_cam, d_body != nullptr ? &d_point : nullptr);
  if (!px || !px->allFinite()) return std::nullopt;
  if (d_body != nullptr) {
    Eigen::Matrix<double, 2, 6> d_cam;
    d_cam << -d_point * skew(in_cam), d_point;
    *d_body = view.root[i] * d_cam * view.d_body;
  }
  return Eigen::Vector2d(view.root[i] * view.frame.camera.difference_px(*px, sighting.px));
}

ViewFit fitted_errors(const View& view, const Rigid3& body_from_world, double corner) {
  return ErrorFit(view, body_from_world, corner).run();
}

std::vector<std::optional<Eigen::Vector2d>> residuals_of(const View& view,
                                                         const Rigid3& body_from_world,
                                                         double corner) {
  if (!view.errors.empty()) return fitted_errors(view, body_from_world, corner).residuals;
  std::vector<std::optional<Eigen::Vector2d>> out;
  for (std::size_t i = 0; i < view.root.size(); ++i)
    out.push_back(view.aside[i] ? std::nullopt : sighting_residual(view, i, body_from_world));
  return out;
}

}  // namespace occ::internal::smooth
