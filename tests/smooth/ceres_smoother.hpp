// SPDX-License-Identifier: Apache-2.0
// The oracle of the smoothers: the same chi2 written again for Ceres, with its automatic
// derivatives and dense algebra. Parameters of each pose are left perturbations of a given one, or
// [x, y, heading].
#pragma once

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "libocc/smooth/smoother.hpp"

namespace occ::test {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

template <class T>
struct PoseOf {
  Matrix3<T> rotation;
  Vector3<T> translation;
};

template <class T>
Matrix3<T> exponential(const T* rotation) {
  Matrix3<T> out;
  ceres::AngleAxisToRotationMatrix(rotation, out.data());
  return out;
}

template <class T>
Vector3<T> logarithm(const Matrix3<T>& rotation) {
  Vector3<T> out;
  ceres::RotationMatrixToAngleAxis(rotation.data(), out.data());
  return out;
}

template <class T>
PoseOf<T> perturbed(const Rigid3& about, const T* delta) {
  const Matrix3<T> turn = exponential(delta);
  return {turn * about.rotation.cast<T>(),
          turn * about.translation.cast<T>() + Vector3<T>(delta[3], delta[4], delta[5])};
}

template <class T>
PoseOf<T> upright(const T* p, double height_m) {
  const T c = cos(p[2]), s = sin(p[2]), zero(0), one(1);
  Matrix3<T> rotation;
  rotation << c, s, zero, -s, c, zero, zero, zero, one;
  return {rotation, -(rotation * Vector3<T>(p[0], p[1], T(height_m)))};
}

/// Pinhole without distortion.
template <class T>
Eigen::Matrix<T, 2, 1> sighting_residual(const PoseOf<T>& body, const SmootherFrame& frame,
                                         const PointSighting& seen) {
  const Vector3<T> in_body = body.rotation * seen.point_in_world.cast<T>() + body.translation;
  const Vector3<T> q =
      frame.cam_from_body.rotation.cast<T>() * in_body + frame.cam_from_body.translation.cast<T>();
  const Eigen::Matrix2d root =
      Eigen::LLT<Eigen::Matrix2d>(seen.covariance_px2).matrixL().solve(Eigen::Matrix2d::Identity());
  const Eigen::Matrix<T, 2, 1> off(
      frame.camera.fx_px() * q[0] / q[2] + frame.camera.cx_px() - seen.px[0],
      frame.camera.fy_px() * q[1] / q[2] + frame.camera.cy_px() - seen.px[1]);
  return root.cast<T>() * off;
}

template <class T, int size>
void whiten(const Eigen::Matrix<double, size, size>& covariance, T* residual) {
  const Eigen::Matrix<double, size, size> root =
      covariance.llt().matrixL().solve(Eigen::Matrix<double, size, size>::Identity());
  Eigen::Map<Eigen::Matrix<T, size, 1>> mapped(residual);
  mapped = (root.template cast<T>() * mapped).eval();
}

struct SpatialSighting {
  Rigid3 about;
  SmootherFrame frame;
  PointSighting seen;
  template <class T>
  bool operator()(const T* delta, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 2, 1>>(residual, 2) =
        sighting_residual(perturbed(about, delta), frame, seen);
    return true;
  }
};

struct SpatialStep {
  Rigid3 from, to;
  Odometry odometry;
  template <class T>
  bool operator()(const T* d_from, const T* d_to, T* residual) const {
    const PoseOf<T> a = perturbed(from, d_from), b = perturbed(to, d_to);
    const Matrix3<T> rotation = b.rotation * a.rotation.transpose();
    const Vector3<T> translation = b.translation - rotation * a.translation;
    const Matrix3<T> turn = rotation * odometry.to_from_from.rotation.transpose().cast<T>();
    Eigen::Map<Vector3<T>> turned(residual), moved(residual + 3);
    turned = logarithm<T>(turn);
    moved = translation - turn * odometry.to_from_from.translation.cast<T>();
    whiten<T, 6>(odometry.covariance, residual);
    return true;
  }
};

/// A pose observation of the body, without gradient.
struct SpatialObservation {
  Rigid3 about;
  PoseObservation seen;
  template <class T>
  bool operator()(const T* delta, T* residual) const {
    const PoseOf<T> body = perturbed(about, delta);
    const Matrix3<T> turn = body.rotation * seen.cam_from_world.rotation.transpose().cast<T>();
    Eigen::Map<Vector3<T>> turned(residual), moved(residual + 3);
    turned = logarithm<T>(turn);
    moved = body.translation - turn * seen.cam_from_world.translation.cast<T>();
    whiten<T, 6>(seen.information.inverse(), residual);
    return true;
  }
};

struct PlanarSighting {
  double height_m;
  SmootherFrame frame;
  PointSighting seen;
  template <class T>
  bool operator()(const T* pose, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 2, 1>>(residual, 2) =
        sighting_residual(upright(pose, height_m), frame, seen);
    return true;
  }
};

struct PlanarStep {
  PlanarOdometry odometry;
  template <class T>
  bool operator()(const T* from, const T* to, T* residual) const {
    const T c = cos(from[2]), s = sin(from[2]);
    const T dx = to[0] - from[0], dy = to[1] - from[1];
    residual[0] = c * dx + s * dy - odometry.increment.x_m;
    residual[1] = -s * dx + c * dy - odometry.increment.y_m;
    residual[2] = to[2] - from[2] - odometry.increment.heading_rad;
    whiten<T, 3>(odometry.covariance, residual);
    return true;
  }
};

struct PlanarPriorCost {
  PlanarPrior prior;
  template <class T>
  bool operator()(const T* pose, T* residual) const {
    residual[0] = pose[0] - prior.pose.x_m;
    residual[1] = pose[1] - prior.pose.y_m;
    residual[2] = pose[2] - prior.pose.heading_rad;
    whiten<T, 3>(prior.covariance, residual);
    return true;
  }
};

/// Frame k belongs to pose k; odometry k leads from pose k to k + 1.
struct CeresAnswer {
  Eigen::MatrixXd poses;  ///< columns
  double cost = 0;
  Eigen::MatrixXd covariance;  ///< covariance of all parameters, from the dense Jacobian
};

inline CeresAnswer minimised(ceres::Problem& problem, Eigen::MatrixXd& parameters) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-16;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  CeresAnswer answer;
  answer.poses = parameters;
  ceres::Problem::EvaluateOptions evaluate;
  for (Eigen::Index k = 0; k < parameters.cols(); ++k)
    evaluate.parameter_blocks.push_back(parameters.col(k).data());
  ceres::CRSMatrix sparse;
  problem.Evaluate(evaluate, &answer.cost, nullptr, nullptr, &sparse);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int row = 0; row < sparse.num_rows; ++row)
    for (int i = sparse.rows[row]; i < sparse.rows[static_cast<std::size_t>(row) + 1]; ++i)
      jacobian(row, sparse.cols[i]) = sparse.values[i];
  answer.covariance = (jacobian.transpose() * jacobian).inverse();
  return answer;
}

inline ceres::LossFunction* huber(double corner) {
  return corner > 0 ? new ceres::HuberLoss(corner) : nullptr;
}

inline CeresAnswer ceres_smooth(const SmootherInput& input, const std::vector<Rigid3>& about,
                                double huber_sigmas, double link_sigmas) {
  Eigen::MatrixXd deltas = Eigen::MatrixXd::Zero(6, static_cast<Eigen::Index>(about.size()));
  const auto at = [&](std::size_t k) { return deltas.col(static_cast<Eigen::Index>(k)).data(); };
  ceres::Problem problem;
  for (std::size_t k = 0; k < about.size(); ++k)
    for (const PointSighting& seen : input.frames[k].sightings)
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SpatialSighting, 2, 6>(
                                   new SpatialSighting{about[k], input.frames[k], seen}),
                               huber(huber_sigmas), at(k));
  for (std::size_t k = 0; k < input.odometry.size(); ++k)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SpatialStep, 6, 6, 6>(
                                 new SpatialStep{about[k], about[k + 1], input.odometry[k]}),
                             huber(link_sigmas), at(k), at(k + 1));
  for (const PoseObservation& seen : input.observations)
    for (std::size_t k = 0; k < about.size(); ++k)
      if (input.frames[k].time_s == seen.time_s)
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SpatialObservation, 6, 6>(
                                     new SpatialObservation{about[k], seen.of_body()}),
                                 nullptr, at(k));
  return minimised(problem, deltas);
}

inline CeresAnswer ceres_smooth(const PlanarSmootherInput& input,
                                const std::vector<PlanarPose>& start, double huber_sigmas,
                                double link_sigmas) {
  Eigen::MatrixXd poses(3, static_cast<Eigen::Index>(start.size()));
  for (std::size_t k = 0; k < start.size(); ++k)
    poses.col(static_cast<Eigen::Index>(k)) << start[k].x_m, start[k].y_m, start[k].heading_rad;
  const auto at = [&](std::size_t k) { return poses.col(static_cast<Eigen::Index>(k)).data(); };
  ceres::Problem problem;
  for (std::size_t k = 0; k < start.size(); ++k)
    for (const PointSighting& seen : input.frames[k].sightings)
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlanarSighting, 2, 3>(
                                   new PlanarSighting{input.height_m, input.frames[k], seen}),
                               huber(huber_sigmas), at(k));
  for (std::size_t k = 0; k < input.odometry.size(); ++k)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlanarStep, 3, 3, 3>(new PlanarStep{input.odometry[k]}),
        huber(link_sigmas), at(k), at(k + 1));
  for (const PlanarPrior& prior : input.priors)
    for (std::size_t k = 0; k < start.size(); ++k)
      if (input.frames[k].time_s == prior.time_s)
        problem.AddResidualBlock(
            new ceres::AutoDiffCostFunction<PlanarPriorCost, 3, 3>(new PlanarPriorCost{prior}),
            nullptr, at(k));
  return minimised(problem, poses);
}

}  // namespace occ::test
