// SPDX-License-Identifier: Apache-2.0
// Adjustment of a network by ceres::Problem with analytic derivatives: an independent reference for
// tests and benchmarks. Supports points, bodies of known size, stations without mounts, distances
// and free camera parameters; used observations only, squared loss.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/network.hpp"

namespace occ::test {

struct CeresResult {
  Network network;
  double cost = 0;
  int iterations = 0;
  bool converged = false;
};

namespace ceres_reference {

/// Start values. Blocks of six are steps from them: rotation and translation of a pose.
struct Bases : ceres::EvaluationCallback {
  const Network& network;
  std::vector<std::vector<int>> free_columns;  // one list per camera
  std::vector<std::vector<double>> values;     // their values
  std::vector<Camera> cameras;                 // with these values; updated once per evaluation
  bool valid = true;

  void PrepareForEvaluation(bool, bool) override {
    valid = true;
    try {
      for (std::size_t i = 0; i < cameras.size(); ++i)
        cameras[i] = camera(static_cast<int>(i), values[i].data());
    } catch (const std::invalid_argument&) {
      valid = false;
    }
  }

  explicit Bases(const Network& from) : network(from) {
    for (const NetworkCamera& camera : from.cameras) {
      free_columns.emplace_back();
      const auto all = camera.camera.parameters();
      for (const std::string& name : camera.free_parameters)
        for (std::size_t k = 0; k < all.size(); ++k)
          if (all[k].name == name) free_columns.back().push_back(static_cast<int>(k));
      values.emplace_back();
      for (const int k : free_columns.back()) values.back().push_back(all[k].value);
      cameras.push_back(camera.camera);
    }
  }
  Camera camera(int index, const double* now) const {
    const Camera& base = network.cameras[index].camera;
    const auto all = base.parameters();
    Eigen::VectorXd v(static_cast<Eigen::Index>(all.size()));
    for (std::size_t k = 0; k < all.size(); ++k) v[static_cast<Eigen::Index>(k)] = all[k].value;
    const auto& columns = free_columns[index];
    for (std::size_t k = 0; k < columns.size(); ++k) v[columns[k]] = now[k];
    return base.with_parameters(v);
  }
};

/// Parameter blocks: free camera parameters (if any), station, point or body.
class ImageCost : public ceres::CostFunction {
 public:
  ImageCost(const Bases& bases, const ImageObservation& observation)
      : bases_(bases), observation_(observation) {
    const NetworkImage& image = bases.network.images[observation.image];
    camera_ = image.camera;
    station_ = bases.network.stations[image.station].station_from_world;
    free_ = static_cast<int>(bases.free_columns[camera_].size());
    if (free_ > 0) mutable_parameter_block_sizes()->push_back(free_);
    mutable_parameter_block_sizes()->push_back(6);
    mutable_parameter_block_sizes()->push_back(observation.target.body < 0 ? 3 : 6);
    set_num_residuals(2);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    using RowMajor6 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;
    const int first = free_ > 0 ? 1 : 0;
    if (!bases_.valid) return false;
    const Camera& camera = bases_.cameras[camera_];
    const Eigen::Map<const Vector6> step(blocks[first]);
    const double* target = blocks[first + 1];
    Eigen::Vector3d x(target[0], target[1], target[2]), arm = Eigen::Vector3d::Zero();
    if (observation_.target.body >= 0) {
      const NetworkBody& body = bases_.network.bodies[observation_.target.body];
      arm = so3_exp(x) * (body.world_from_body.rotation *
                          (body.scale * body.corners_m.col(observation_.target.corner)));
      x = arm + body.world_from_body.translation + Eigen::Vector3d(target[3], target[4], target[5]);
    }
    const Eigen::Matrix3d rotation = so3_exp(step.head<3>());
    const Eigen::Vector3d rotated = rotation * (station_ * x);
    const Eigen::Vector3d in_cam = rotated + step.tail<3>();
    Eigen::Matrix<double, 2, 3> d_point;
    Camera::ParameterJacobian d_parameters;
    const auto pixel = camera.project(in_cam, jacobians ? &d_point : nullptr,
                                      jacobians && free_ > 0 ? &d_parameters : nullptr);
    if (!pixel) return false;
    const Eigen::Vector2d inverse = observation_.sigma_px.cwiseInverse();
    const Eigen::Vector2d off =
        camera.difference_px(*pixel, observation_.pixel).cwiseProduct(inverse);
    residuals[0] = off[0];
    residuals[1] = off[1];
    if (!jacobians) return true;
    d_point = inverse.asDiagonal() * d_point;
    if (free_ > 0 && jacobians[0]) {
      const auto& columns = bases_.free_columns[camera_];
      for (int r = 0; r < 2; ++r)
        for (int k = 0; k < free_; ++k)
          jacobians[0][r * free_ + k] = inverse[r] * d_parameters(r, columns[k]);
    }
    if (jacobians[first]) {
      Eigen::Map<RowMajor6> j{jacobians[first]};
      j.leftCols<3>() = -d_point * skew(rotated) * so3_left_jacobian(step.head<3>());
      j.rightCols<3>() = d_point;
    }
    if (jacobians[first + 1]) {
      const Eigen::Matrix<double, 2, 3> d_world = d_point * rotation * station_.rotation;
      if (observation_.target.body < 0) {
        Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j{jacobians[first + 1]};
        j = d_world;
      } else {
        Eigen::Map<RowMajor6> j{jacobians[first + 1]};
        j.leftCols<3>() = -d_world * skew(arm) *
                          so3_left_jacobian(Eigen::Vector3d(target[0], target[1], target[2]));
        j.rightCols<3>() = d_world;
      }
    }
    return true;
  }

 private:
  const Bases& bases_;
  const ImageObservation& observation_;
  Rigid3 station_;
  int camera_ = 0, free_ = 0;
};

class DistanceCost : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  explicit DistanceCost(const DistanceObservation& distance) : distance_(distance) {}
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Eigen::Vector3d difference =
        Eigen::Map<const Eigen::Vector3d>(blocks[1]) - Eigen::Map<const Eigen::Vector3d>(blocks[0]);
    residuals[0] = (difference.norm() - distance_.length_m) / distance_.sigma_m;
    for (int k = 0; jacobians && k < 2; ++k) {
      const Eigen::Vector3d along = (k == 0 ? -1 : 1) / distance_.sigma_m * difference.normalized();
      for (int c = 0; jacobians[k] && c < 3; ++c) jacobians[k][c] = along[c];
    }
    return true;
  }

 private:
  const DistanceObservation& distance_;
};

}  // namespace ceres_reference

/// `tolerance` 0: iterates until the cost no longer decreases.
inline CeresResult ceres_adjust(const Network& network, int threads = 1, int max_iterations = 200,
                                double tolerance = 0) {
  using namespace ceres_reference;
  Bases bases(network);
  std::vector<std::vector<double>>& cameras = bases.values;
  std::vector<std::vector<double>> stations(network.stations.size(), std::vector<double>(6, 0.0)),
      targets;
  for (const NetworkPoint& point : network.points)
    targets.push_back({point.position_m.x(), point.position_m.y(), point.position_m.z()});
  const std::size_t bodies = targets.size();
  targets.resize(bodies + network.bodies.size(), std::vector<double>(6, 0.0));
  const auto block = [&](const Target& target) {
    return (target.body < 0 ? targets[target.point] : targets[bodies + target.body]).data();
  };

  ceres::Problem::Options owned;
  owned.evaluation_callback = &bases;
  ceres::Problem problem(owned);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const ImageObservation& observation : network.observations) {
    if (!observation.used) continue;
    const NetworkImage& image = network.images[observation.image];
    std::vector<double*> blocks;
    if (!cameras[image.camera].empty()) blocks.push_back(cameras[image.camera].data());
    blocks.push_back(stations[image.station].data());
    blocks.push_back(block(observation.target));
    problem.AddResidualBlock(new ImageCost(bases, observation), nullptr, blocks);
    for (double* own : blocks) ordering->AddElementToGroup(own, own == blocks.back() ? 0 : 1);
  }
  for (const DistanceObservation& distance : network.distances) {
    if (!distance.used) continue;
    problem.AddResidualBlock(new DistanceCost(distance), nullptr, block(distance.from),
                             block(distance.to));
    ordering->AddElementToGroup(block(distance.from), 1);
    ordering->AddElementToGroup(block(distance.to), 1);
  }
  for (std::size_t i = 0; i < stations.size(); ++i)
    if (network.stations[i].fixed && problem.HasParameterBlock(stations[i].data()))
      problem.SetParameterBlockConstant(stations[i].data());
  for (std::size_t i = 0; i < network.points.size(); ++i)
    if (network.points[i].fixed && problem.HasParameterBlock(targets[i].data()))
      problem.SetParameterBlockConstant(targets[i].data());
  for (std::size_t i = 0; i < network.bodies.size(); ++i)
    if (network.bodies[i].fixed && problem.HasParameterBlock(targets[bodies + i].data()))
      problem.SetParameterBlockConstant(targets[bodies + i].data());

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.num_threads = threads;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = tolerance > 0 ? tolerance : 1e-30;
  options.parameter_tolerance = tolerance > 0 ? tolerance : 1e-15;
  options.gradient_tolerance = 1e-30;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  CeresResult result;
  result.network = network;
  result.cost = summary.final_cost;
  result.iterations = static_cast<int>(summary.num_successful_steps);
  result.converged = summary.IsSolutionUsable();
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (!cameras[i].empty())
      result.network.cameras[i].camera = bases.camera(static_cast<int>(i), cameras[i].data());
  for (std::size_t i = 0; i < stations.size(); ++i)
    result.network.stations[i].station_from_world =
        perturb(network.stations[i].station_from_world, Eigen::Map<Vector6>(stations[i].data()));
  for (std::size_t i = 0; i < network.points.size(); ++i)
    result.network.points[i].position_m = Eigen::Map<Eigen::Vector3d>(targets[i].data());
  for (std::size_t i = 0; i < network.bodies.size(); ++i) {
    const Eigen::Map<Vector6> step(targets[bodies + i].data());
    Rigid3& pose = result.network.bodies[i].world_from_body;
    pose = {so3_exp(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()};
  }
  return result;
}

}  // namespace occ::test
