// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/bound.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"
#include "libocc/refine/internal/expected_lamp.hpp"
#include "libocc/refine/internal/pose_covariance.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ {

using namespace internal::refine;
namespace {

void check_pose(const Rigid3& pose) {
  const bool finite = pose.rotation.allFinite() && pose.translation.allFinite();
  require(finite, "cam_from_world", pose.matrix(), "finite");
}

/// Adds information about unknowns without observations, which would make the matrix singular.
void pin_unused(PoseNormalEquations& normal) {
  for (const int i : {growth_index, log_factor_index}) {
    if (normal.information(i, i) == 0) normal.information(i, i) = 1;
  }
}

Result<PoseBound> bound_of(PoseNormalEquations normal, const Eigen::Vector3d& pivot,
                           const Rigid3& pose, int lamps) {
  pin_unused(normal);
  const PoseCovariance inverse = pose_covariance(normal, pivot);
  Result<PoseBound> result;
  result.value.rank = inverse.rank;
  result.value.lamps = lamps;
  if (inverse.rank == 6) {
    result.value.covariance = inverse.covariance;
    result.value.position_covariance_m2 = position_covariance(pose, inverse.covariance);
    return result;
  }
  result.status = lamps < 3 ? Status::too_few_lamps : Status::degenerate;
  result.message = std::to_string(lamps) + " lamps or points determine " +
                   std::to_string(inverse.rank) + " of the pose's 6 unknowns";
  return result;
}

Result<PoseBound> bound_of_observations(const std::vector<Match>& matches,
                                        const std::vector<Blob>& blobs, const Scene& stated,
                                        const Rigid3& cam_from_world, RefineOptions options,
                                        const ImageView* image) {
  options.validate();
  check_pose(cam_from_world);
  std::optional<Scene> widened;
  if (has_model_errors(options))
    widened = with_model_errors(stated, matches, cam_from_world, options);
  const Scene& scene = widened ? *widened : stated;
  options.huber_sigma = std::numeric_limits<double>::infinity();
  const Observations observations = observe(matches, blobs, scene, options, image);
  RefineProblem problem(observations, scene, options, options.rung);
  const State state{cam_from_world};
  const Eigen::Vector3d pivot = problem.pivot(state);
  PoseNormalEquations normal;
  // In the second pass light and background of the lamps are known from the pixels.
  if (!problem.linearise(state, pivot, normal) || !problem.linearise(state, pivot, normal)) {
    normal = PoseNormalEquations{};
  }
  return bound_of(normal, pivot, cam_from_world, static_cast<int>(matches.size()));
}

}  // namespace

Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                             const Camera& camera, const Rigid3& cam_from_world, double sigma_px) {
  return pose_bound(points_in_world, camera, cam_from_world,
                    std::vector<double>(points_in_world.size(), sigma_px));
}

Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                             const Camera& camera, const Rigid3& cam_from_world,
                             const std::vector<double>& sigmas_px) {
  check_pose(cam_from_world);
  require(sigmas_px.size() == points_in_world.size(), "sigmas_px", sigmas_px.size(),
          "as many as points_in_world: " + std::to_string(points_in_world.size()));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < sigmas_px.size(); ++i) {
    const Eigen::Vector3d& point = points_in_world[i];
    require(point.allFinite(), "points_in_world[" + std::to_string(i) + "]", point.transpose(),
            "finite");
    require(sigmas_px[i] > 0 && std::isfinite(sigmas_px[i]), "sigmas_px[" + std::to_string(i) + "]",
            sigmas_px[i], "positive");
    sum += cam_from_world * point;
  }
  const Eigen::Vector3d pivot = sum / std::max(1.0, static_cast<double>(sigmas_px.size()));
  PoseNormalEquations normal;
  int count = 0;
  for (std::size_t i = 0; i < sigmas_px.size(); ++i) {
    const Eigen::Vector3d point = cam_from_world * points_in_world[i];
    Eigen::Matrix<double, 2, 3> d_point;
    if (!camera.project(point, &d_point)) continue;
    const Eigen::Matrix<double, 2, 6> d_pose =
        internal::geometry::derivative_by_pose(d_point, point - pivot);
    normal.information.topLeftCorner<6, 6>() +=
        d_pose.transpose() * d_pose / (sigmas_px[i] * sigmas_px[i]);
    ++count;
  }
  return bound_of(normal, pivot, cam_from_world, count);
}

Result<PoseBound> pose_bound(const Scene& given, const Rigid3& cam_from_world, Rung rung,
                             FluxModel flux) {
  check_pose(cam_from_world);
  Scene scene = given;
  scene.validate();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : scene.lamps) sum += cam_from_world * lamp.centre_m;
  const Eigen::Vector3d pivot = sum / std::max(1.0, static_cast<double>(scene.lamps.size()));
  const ExpectedLamps expected(scene, cam_from_world, pivot, rung, flux);
  PoseNormalEquations normal;
  int lamps = 0;
  std::optional<SharedSums> shared;
  if (has_shared_errors(scene)) shared.emplace(SharedErrors(scene).count());
  for (const Lamp& lamp : scene.lamps)
    lamps += expected.add(lamp, normal, shared ? &*shared : nullptr) ? 1 : 0;
  if (shared) normal.information -= shared->mixed * shared->gain() * shared->mixed.transpose();
  return bound_of(normal, pivot, cam_from_world, lamps);
}

Result<PoseBound> pose_bound(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                             const Scene& scene, const Rigid3& cam_from_world,
                             const RefineOptions& options) {
  return bound_of_observations(matches, blobs, scene, cam_from_world, options, nullptr);
}

Result<PoseBound> pose_bound(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                             const Scene& scene, const Rigid3& cam_from_world,
                             const RefineOptions& options, const ImageView& image) {
  return bound_of_observations(matches, blobs, scene, cam_from_world, options, &image);
}

}  // namespace occ
