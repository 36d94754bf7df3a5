// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/error_gradient.hpp"

#include <algorithm>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/refine/internal/pose_covariance.hpp"
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

/// A^+ B of a semidefinite matrix A.
Eigen::Matrix<double, 6, Eigen::Dynamic> solved(const Matrix6& a,
                                                const Eigen::Matrix<double, 6, Eigen::Dynamic>& b) {
  constexpr double rounding = 1e-12;
  const Vector6 scale = a.diagonal().cwiseMax(0).cwiseSqrt();
  const Vector6 unit = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const auto eigen = core::symmetric_eigen<Matrix6>(unit.asDiagonal() * a * unit.asDiagonal());
  const Vector6 inverse = (eigen.eigenvalues().array() > rounding * eigen.eigenvalues()[5])
                              .select(eigen.eigenvalues().cwiseInverse(), 0);
  const Matrix6 directions = unit.asDiagonal() * eigen.eigenvectors();
  return directions * (inverse.asDiagonal() * (directions.transpose() * b));
}

}  // namespace

ErrorGradient error_gradient(const Refined& refined, const std::vector<Blob>& blobs,
                             const Scene& scene, RefineOptions options) {
  ErrorGradient out;
  out.gradient_by_errors.resize(6, 0);
  if (is_exact(scene)) return out;
  options.prior.reset();
  // Errors must not reduce weights here. Too large a part is systematic then, if any.
  options.huber_sigma = std::numeric_limits<double>::infinity();
  std::vector<Match> matches;
  for (const LampResidual& lamp : refined.lamps) matches.push_back(lamp.match);
  Observations observations = observe(matches, blobs, scene, options);
  observations.shared_shift = Eigen::VectorXd::Zero(observations.shared_errors.count());
  for (std::size_t i = 0; i < matches.size(); ++i)
    observations.lamps[i].contradicts = refined.lamps[i].contradicts;
  RefineProblem problem(observations, scene, options, std::min(options.rung, Rung::rims));
  const State state{refined.cam_from_world};
  const Eigen::Vector3d pivot = problem.pivot(state);
  PoseNormalEquations normal;
  if (!problem.linearise(state, pivot, normal)) return out;
  const std::vector<RefineProblem::LampSums> sums = problem.lamp_sums(state, pivot);
  const Eigen::Index shared_errors = observations.shared_errors.count();
  SharedSums shared(shared_errors);
  for (const auto& lamp : sums) {
    shared.mixed += lamp.shared.mixed;
    shared.information += lamp.shared.information;
  }
  shared.information -=
      static_cast<double>(sums.size()) * Eigen::MatrixXd::Identity(shared_errors, shared_errors);
  const Columns8 by_shared = shared.mixed * shared.gain();
  Columns8 columns(8, 7 * static_cast<Eigen::Index>(sums.size()) + shared_errors);
  const auto append = [&](const auto& column, const ErrorGradient::Source& source) {
    columns.col(static_cast<Eigen::Index>(out.sources.size())) = column;
    out.sources.push_back(source);
  };
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const LampObservation& lamp = observations.lamps[i];
    if (lamp.contradicts || !lamp.errors) continue;
    const Eigen::Matrix<double, 8, 7> motion = as_pose(lamp, state.cam_from_world, pivot);
    const Matrix8 information = sums[i].information - by_shared * sums[i].shared.mixed.transpose();
    for (int k = 0; k < 7; ++k)
      if (!motion.col(k).isZero(0))
        append(information * motion.col(k), {ErrorGradient::Source::lamp, k, matches[i].lamp});
  }
  const Eigen::Index of_camera = observations.shared_errors.camera_count();
  for (Eigen::Index k = 0; k < shared_errors; ++k)
    append(by_shared.col(k),
           k < of_camera ? ErrorGradient::Source{ErrorGradient::Source::camera, static_cast<int>(k)}
                         : ErrorGradient::Source{ErrorGradient::Source::map,
                                                 static_cast<int>(k - of_camera)});
  const Columns8 used = columns.leftCols(static_cast<Eigen::Index>(out.sources.size()));
  // A misfit of the image, by which the covariance is enlarged, is noise of this image: the errors
  // move the pose by as much as in other images.
  out.gradient_by_errors = refined.lamp_information *
                           solved(pose_information(normal, pivot), of_left(used, normal, pivot));
  return out;
}

}  // namespace occ::internal::refine
