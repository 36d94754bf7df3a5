// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/error_gradient.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ::internal::refine {
namespace {

using Columns8 = Eigen::Matrix<double, 8, Eigen::Dynamic>;

/// Perturbation of the pose, centred at the pivot, with the same effect on the lamp's image as its
/// errors.
Eigen::Matrix<double, 8, 7> as_pose(const LampObservation& lamp, const Rigid3& cam_from_world,
                                    const Eigen::Vector3d& pivot) {
  const LampInCam in_cam = lamp_in_cam(*lamp.lamp, cam_from_world);
  const Eigen::Matrix<double, 6, 7> motion = unit_motion(*lamp.errors, in_cam, 0, cam_from_world);
  Eigen::Matrix<double, 8, 7> out = Eigen::Matrix<double, 8, 7>::Zero();
  out.topRows<6>() = motion;
  // A rotation w about the centre c is one about the pivot p and the shift w x (p - c).
  out.middleRows<3>(3) += skew(in_cam.centre_m - pivot) * motion.topRows<3>();
  return out;
}

/// Marginalises growth and log_factor, and changes to left perturbations.
Eigen::Matrix<double, 6, Eigen::Dynamic> of_left(const Columns8& columns,
                                                 const PoseNormalEquations& normal,
                                                 const Eigen::Vector3d& pivot) {
  const Eigen::Matrix<double, 6, 2> mixed = normal.information.topRightCorner<6, 2>();
  const Eigen::Matrix2d nuisance = normal.information.bottomRightCorner<2, 2>();
  const Eigen::Matrix<double, 6, 2> shares = mixed * nuisance.inverse();
  Matrix6 centred_from_left = Matrix6::Identity();
  centred_from_left.bottomLeftCorner<3, 3>() = -skew(pivot);
  return centred_from_left.transpose() * (columns.topRows<6>() - shares * columns.bottomRows<2>());
}

}  // namespace

ErrorGradient error_gradient(const Refined& refined, const std::vector<Blob>& blobs,
                             const Scene& scene, RefineOptions options) {
  ErrorGradient out;
  out.gradient_by_errors.resize(6, 0);
  if (scene.camera.is_exact() && has_exact_map(scene)) return out;
  options.prior.reset();
  // Errors must not reduce weights here. Too large a part is systematic then, if any.
  options.huber_sigma = std::numeric_limits<double>::infinity();
  std::vector<Match> matches;
  for (const LampResidual& lamp : refined.lamps) matches.push_back(lamp.match);
  Observations observations = observe(matches, blobs, scene, options);
  observations.camera_shift = Eigen::VectorXd::Zero(observations.camera_errors.count());
  for (std::size_t i = 0; i < matches.size(); ++i)
    observations.lamps[i].contradicts = refined.lamps[i].contradicts;
  RefineProblem problem(observations, scene, options, std::min(options.rung, Rung::rims));
  const State state{refined.cam_from_world};
  const Eigen::Vector3d pivot = problem.pivot(state);
  PoseNormalEquations normal;
  if (!problem.linearise(state, pivot, normal)) return out;
  const std::vector<RefineProblem::LampSums> sums = problem.lamp_sums(state, pivot);
  const Eigen::Index camera_errors = observations.camera_errors.count();
  CameraSums camera(camera_errors);
  for (const auto& lamp : sums) {
    camera.mixed += lamp.camera.mixed;
    camera.information += lamp.camera.information;
  }
  camera.information -=
      static_cast<double>(sums.size()) * Eigen::MatrixXd::Identity(camera_errors, camera_errors);
  const Columns8 by_camera = camera.mixed * camera.gain();
  Columns8 columns(8, 7 * static_cast<Eigen::Index>(sums.size()) + camera_errors);
  const auto append = [&](const auto& column, int lamp, int component) {
    columns.col(static_cast<Eigen::Index>(out.sources.size())) = column;
    out.sources.push_back({lamp, component});
  };
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const LampObservation& lamp = observations.lamps[i];
    if (lamp.contradicts || !lamp.errors) continue;
    const Eigen::Matrix<double, 8, 7> motion = as_pose(lamp, state.cam_from_world, pivot);
    const Matrix8 information = sums[i].information - by_camera * sums[i].camera.mixed.transpose();
    for (int k = 0; k < 7; ++k)
      if (!motion.col(k).isZero(0)) append(information * motion.col(k), matches[i].lamp, k);
  }
  for (Eigen::Index k = 0; k < camera_errors; ++k)
    append(by_camera.col(k), -1, static_cast<int>(k));
  const Columns8 used = columns.leftCols(static_cast<Eigen::Index>(out.sources.size()));
  out.gradient_by_errors = of_left(used, normal, pivot) / std::sqrt(refined.variance_factor);
  return out;
}

}  // namespace occ::internal::refine
