// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/view.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"

namespace occ::internal::smooth {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> numbers_in(const MatrixXd& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// Names a camera by its size, its parameters and their covariance.
std::vector<double> camera_key(const Camera& camera) {
  std::vector<double> key = numbers_in(camera.parameter_covariance());
  key.push_back(camera.width());
  key.push_back(camera.height());
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
        late_(view.errors.clock_sigma_s * view.velocity),
        late_uncertain_(view.errors.clock_sigma_s * view.velocity_root.transpose()),
        points_(view.root.size(), Eigen::Vector3d::Zero()) {}

  /// False if a sighting that is not aside is outside the domain.
  bool run() {
    constexpr int max_steps = 8;
    constexpr double negligible = 1e-8;  // sigmas; the cost is stationary
    for (int step = 0; step < max_steps; ++step) {
      if (!linearise()) return false;
      if (step + 1 == max_steps || !(improve() > negligible)) break;
    }
    return true;
  }

  ViewFit result() const {
    ViewFit out;
    out.residuals.resize(view_.root.size());
    out.cost = 0.5 * shared_.squaredNorm();
    for (const Row& row : rows_) {
      out.residuals[row.sighting] = row.residual;
      out.cost += core::huber_loss(row.residual.squaredNorm(), corner_) +
                  0.5 * points_[row.sighting].squaredNorm();
      out.gradient += row.huber * row.by_body.transpose() * row.residual;
      out.information += row.by_body.transpose() * row.weight * row.by_body;
    }
    const auto [mixed, solved] = shared_by_body();
    out.information -= core::product(mixed, solved);
    out.information = (0.5 * (out.information + out.information.transpose())).eval();
    return out;
  }

  CommonErrors<6> common() const {
    CommonErrors<6> out;
    const MatrixXd solved = shared_by_body().second;
    const std::vector<int>& shared = view_.errors.shared_numbers;
    out.add(shared, solved.topRows(static_cast<Eigen::Index>(shared.size())).transpose());
    if (view_.errors.point_numbers.empty()) return out;
    for (const Row& row : rows_) {
      const Eigen::Matrix<double, 2, 6> follows =
          row.by_body - core::product(row.by_shared, solved);
      const auto first =
          view_.errors.point_numbers.begin() + 3 * static_cast<std::ptrdiff_t>(row.sighting);
      out.add(std::vector<int>(first, first + 3), follows.transpose() * row.weight * row.by_point);
    }
    return out;
  }

 private:
  bool linearise() {
    const Rigid3 cam_from_body = displaced_mounting();
    const Matrix6 d_body = adjoint(cam_from_body);
    rows_.clear();
    for (std::size_t i = 0; i < view_.root.size(); ++i) {
      if (view_.aside[i]) continue;
      std::optional<Row> row = row_of(i, cam_from_body, d_body);
      if (!row) return false;
      rows_.push_back(std::move(*row));
    }
    return true;
  }

  /// cam_from_body with the errors of mounting and clock.
  Rigid3 displaced_mounting() const {
    const ViewErrors& errors = view_.errors;
    Eigen::Index column = errors.camera_root.cols();
    Vector6 of_mount = Vector6::Zero();
    for (int i = 0; i < 6; ++i)
      if (errors.mount_sigmas[i] > 0) of_mount[i] = errors.mount_sigmas[i] * shared_[column++];
    const Rigid3 mounting = perturb(view_.frame.cam_from_body, of_mount);
    if (!(errors.clock_sigma_s > 0)) return mounting;
    const Vector6 moved = late_ * shared_[column] + late_uncertain_ * shared_.tail<6>();
    return mounting * perturb(Rigid3{}, moved);
  }

  std::optional<Row> row_of(std::size_t i, const Rigid3& cam_from_body,
                            const Matrix6& d_body) const {
    const ViewErrors& errors = view_.errors;
    const bool exact_points = errors.point_roots.empty();
    const PointSighting& seen = view_.frame.sightings[i];
    Eigen::Vector3d point = seen.point_in_world;
    if (!exact_points) point += errors.point_roots[i].transpose() * points_[i];
    const Eigen::Vector3d in_cam = cam_from_body * (body_ * point);
    Eigen::Matrix<double, 2, 3> d_point;
    const auto px = view_.frame.camera.project(in_cam, &d_point);
    if (!px || !px->allFinite()) return std::nullopt;
    d_point = (view_.root[i] * d_point).eval();
    const Eigen::Matrix<double, 2, 6> d_cam = geometry::derivative_by_pose(d_point, in_cam);

    Row row;
    row.sighting = i;
    row.by_body = d_cam * d_body;
    row.by_point.setZero();
    if (!exact_points)
      row.by_point =
          d_point * cam_from_body.rotation * body_.rotation * errors.point_roots[i].transpose();
    row.by_shared.resize(Eigen::NoChange, shared_.size());
    Eigen::Index column = errors.camera_root.cols();
    row.by_shared.leftCols(column) = view_.by_camera[i];
    row.residual = view_.root[i] * view_.frame.camera.difference_px(*px, seen.px) +
                   view_.by_camera[i] * shared_.head(column);
    for (int k = 0; k < 6; ++k)
      if (errors.mount_sigmas[k] > 0)
        row.by_shared.col(column++) = errors.mount_sigmas[k] * d_cam.col(k);
    if (errors.clock_sigma_s > 0) {
      row.by_shared.col(column) = row.by_body * late_;
      row.by_shared.rightCols<6>() = row.by_body * late_uncertain_;
    }
    row.huber = core::huber_weight(row.residual.squaredNorm(), corner_);
    row.weight = (Eigen::Matrix2d::Identity() / row.huber + row.by_point * row.by_point.transpose())
                     .inverse();
    return row;
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

  /// A = sum by_body^T W by_shared, and N^-1 A^T: minus the change of the most likely shared errors
  /// with the pose.
  std::pair<MatrixXd, MatrixXd> shared_by_body() const {
    const Eigen::Index n = shared_.size();
    MatrixXd normal = MatrixXd::Identity(n, n), mixed = MatrixXd::Zero(6, n);
    for (const Row& row : rows_) {
      const Eigen::Matrix<double, 2, Eigen::Dynamic> weighted = row.weight * row.by_shared;
      mixed += core::transposed_product(row.by_body, weighted);
      normal += core::transposed_product(row.by_shared, weighted);
    }
    if (n == 0) return {mixed, MatrixXd::Zero(0, 6)};
    return {mixed, core::solve_llt<MatrixXd, MatrixXd>(normal, mixed.transpose())};
  }

  const View& view_;
  Rigid3 body_;
  double corner_;
  VectorXd shared_;  ///< camera, mounting, clock, and the velocity's own errors
  Vector6 late_;     ///< motion during the clock's sigma
  Matrix6 late_uncertain_;
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
  if (d_body != nullptr)
    *d_body = view.root[i] * geometry::derivative_by_pose(d_point, in_cam) * view.d_body;
  return Eigen::Vector2d(view.root[i] * view.frame.camera.difference_px(*px, sighting.px));
}

ViewFit fitted_errors(const View& view, const Rigid3& body_from_world, double corner) {
  ErrorFit fit(view, body_from_world, corner);
  if (fit.run()) return fit.result();
  ViewFit outside;
  outside.cost = std::numeric_limits<double>::infinity();
  outside.residuals.resize(view.root.size());
  return outside;
}

CommonErrors<6> common_errors_of(const View& view, const Rigid3& body_from_world, double corner) {
  ErrorFit fit(view, body_from_world, corner);
  return fit.run() ? fit.common() : CommonErrors<6>{};
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
