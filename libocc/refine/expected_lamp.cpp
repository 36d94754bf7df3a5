// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/expected_lamp.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ::internal::refine {

using namespace internal::formation;
namespace {

constexpr int rim_probes = 32;

bool whole_in_image(const Lamp& lamp, const Rigid3& pose, const Camera& camera) {
  const auto rim = project_rim(lamp, pose, camera, rim_probes);
  return rim && std::all_of(rim->begin(), rim->end(),
                            [&](const Eigen::Vector2d& px) { return camera.contains(px); });
}

}  // namespace

ExpectedLamps::ExpectedLamps(const Scene& scene, const Rigid3& cam_from_world,
                             const Eigen::Vector3d& pivot, Rung rung, FluxModel flux)
    : scene_(scene),
      pose_(cam_from_world),
      pivot_(pivot),
      noise_(scene.sensor),
      psf_(gaussian_blur_px(scene)),
      shared_errors_(scene) {
  options_.rung = rung;
  options_.flux = flux;
}

bool ExpectedLamps::add(const Lamp& lamp, PoseNormalEquations& normal, SharedSums* shared) const {
  if (!whole_in_image(lamp, pose_, scene_.camera)) return false;
  const Blob unseen;
  LampObservation observation{&lamp, &unseen};
  observation.errors = errors_of(lamp, scene_);
  const bool uses_flux = options_.flux != FluxModel::ignore && !lamp.frequency_hz;
  if (uses_flux) observation.light_sigma = lamp.power_sigma;
  PixelScratch scratch;
  LampPixels pixels(observation, scene_, options_, noise_, psf_, scratch);
  if (!pixels.linearise({pose_}, pivot_)) return false;
  const bool exact = !observation.errors && !shared;
  if (options_.rung == Rung::direct && exact) {
    pixels.add_to(normal);
    return true;
  }
  const auto contour = options_.rung == Rung::rims || options_.rung == Rung::direct
                           ? project_moving_contour(lamp, pose_, scene_.camera, 1)
                           : std::nullopt;
  if (contour && !contour->empty()) {
    add_rim(observation, *contour, normal, shared);
  } else {
    add_centroid(observation, pixels.centroid_information(), normal, shared);
  }
  if (uses_flux) add_flux(lamp, pixels.light_information(), normal);
  return true;
}

void ExpectedLamps::add_centroid(const LampObservation& lamp, Eigen::Matrix2d information,
                                 PoseNormalEquations& normal, SharedSums* shared) const {
  Eigen::Matrix<double, 2, 6> d_pose;
  if (!predicted_centroid_px(*lamp.lamp, pose_, scene_.camera, options_.rung, &d_pose)) return;
  if (lamp.errors)
    information = (information.inverse() +
                   image_covariance_px2(*lamp.lamp, pose_, scene_.camera, lamp.errors))
                      .inverse();
  d_pose.leftCols<3>() += d_pose.rightCols<3>() * skew(pivot_);
  normal.information.topLeftCorner<6, 6>() += d_pose.transpose() * information * d_pose;
  if (!shared) return;
  const Eigen::Matrix2Xd by_shared =
      shared_errors_.by_errors(scene_.camera, *lamp.lamp, pose_, d_pose.rightCols<3>());
  shared->mixed.topRows<6>() += d_pose.transpose() * information * by_shared;
  shared->information += by_shared.transpose() * information * by_shared;
}

/// Information about the position of a straight edge, per px along it [1/px^3].
double ExpectedLamps::edge_information(double background_e, double full_e) const {
  constexpr double reach = 6, step = 0.125;  // sigmas; the trapezoid rule is exact to 1e-9
  const double sigma = std::sqrt(psf_.sigma_px() * psf_.sigma_px() + 1.0 / 12);
  double sum = 0;
  for (double z = -reach; z <= reach; z += step) {
    const double covered = normal_probability(z);
    const double slope = full_e / sigma * 0.3989422804014327 * std::exp(-0.5 * z * z);
    const PixelMoments moments = noise_.at(background_e + full_e * covered);
    if (moments.informative)
      sum += slope * slope * moments.slope * moments.slope / moments.variance;
  }
  return sum * step * sigma;
}

void ExpectedLamps::add_rim(const LampObservation& lamp, const MovingContour& contour,
                            PoseNormalEquations& normal, SharedSums* shared) const {
  const Sensor& sensor = scene_.sensor;
  const Eigen::Index errors = shared_errors_.count();
  const double distance_m = (pose_ * lamp.lamp->centre_m).norm();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(6 + errors, 6 + errors);
  Eigen::VectorXd sweep(6 + errors);
  const Eigen::Matrix3Xd motion = shared_errors_.motion(*lamp.lamp, pose_);
  for (const MovingContourPoint& point : contour) {
    const double light = irradiance_at(*lamp.lamp, pose_, scene_.camera, sensor, point.px);
    const double full_e = (sensor.electrons(1) - sensor.electrons(0)) * light;
    const auto bearing = scene_.camera.unproject(point.px);
    sweep.head<6>() = point.sweep;
    if (shared && bearing) {
      const Eigen::Matrix2Xd by_camera =
          shared_errors_.by_camera(scene_.camera, distance_m * *bearing);
      sweep.segment(6, by_camera.cols()) =
          (by_camera.row(0) * point.step_px.y() - by_camera.row(1) * point.step_px.x()).transpose();
      sweep.tail(motion.cols()) = motion.transpose() * point.sweep.segment<3>(3);
    }
    information += edge_information(noise_.dark_e(), full_e) / point.step_px.norm() * sweep *
                   sweep.transpose();
  }
  if (lamp.errors) {
    const Eigen::MatrixXd root =
        unit_motion(*lamp.errors, lamp_in_cam(*lamp.lamp, pose_), 0, pose_);
    const Eigen::MatrixXd along = root.transpose() * information.topRows<6>();
    const Eigen::MatrixXd own = Eigen::MatrixXd::Identity(7, 7) + along.leftCols<6>() * root;
    information -= along.transpose() * core::solve_llt(own, along);
  }
  Matrix6 lamp_of_pose = Matrix6::Identity();  // a rotation about the pivot moves the lamp
  lamp_of_pose.bottomLeftCorner<3, 3>() = -skew(pose_ * lamp.lamp->centre_m - pivot_);
  normal.information.topLeftCorner<6, 6>() +=
      lamp_of_pose.transpose() * information.topLeftCorner<6, 6>() * lamp_of_pose;
  if (!shared) return;
  shared->mixed.topRows<6>() += lamp_of_pose.transpose() * information.topRightCorner(6, errors);
  shared->information += information.bottomRightCorner(errors, errors);
}

void ExpectedLamps::add_flux(const Lamp& lamp, double information,
                             PoseNormalEquations& normal) const {
  Eigen::Matrix<double, 1, 6> d_pose;
  if (!(lamp_electrons(lamp, pose_, scene_.camera, scene_.sensor, &d_pose) > 0)) return;
  const double variance = 1 / information + lamp.power_sigma * lamp.power_sigma;
  Vector8 row = Vector8::Zero();
  row.head<6>() = d_pose.transpose();
  centre_row(row, pivot_);
  row[log_factor_index] = options_.flux == FluxModel::common_factor ? 1 : 0;
  normal.add(row / std::sqrt(variance), 0);
}

}  // namespace occ::internal::refine
