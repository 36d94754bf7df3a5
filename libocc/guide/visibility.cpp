// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/visibility.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/parallel.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/guide/internal/lamp_views.hpp"
#include "libocc/guide/mount.hpp"
#include "libocc/scene/view.hpp"
#include "libocc/simulate/received_power.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::guide;
namespace {

constexpr int rim_points = 12;

/// Circle about the centre that contains the lamp's face.
std::vector<Eigen::Vector3d> rim_of(const Lamp& lamp) {
  std::vector<Eigen::Vector3d> rim = {lamp.centre_m};
  if (lamp.reach_m() == 0) return rim;
  const Eigen::Vector3d u = lamp.normal.unitOrthogonal(), v = lamp.normal.cross(u);
  for (int i = 0; i < rim_points; ++i) {
    const double angle = 2 * pi * i / rim_points;
    rim.push_back(lamp.centre_m + lamp.reach_m() * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return rim;
}

bool inside_something(const Scene& scene, const Eigen::Vector3d& eye) {
  if (scene.room && (eye.minCoeff() <= 0 || (scene.room->size_m - eye).minCoeff() <= 0))
    return true;
  return inside_box(scene.boxes, eye);
}

Visibility seen_from(const Scene& scene, const LampViews& views, const Rigid3& cam_from_body,
                     const PlanarPose& pose) {
  Visibility seen;
  const Rigid3 cam_from_world = cam_from_body * body_from_world(pose);
  if (inside_something(scene, cam_from_world.origin_in_source())) return seen;
  seen.power_w = received_power(scene, cam_from_world).total_w();
  const std::vector<int> lamps = views.in_view(cam_from_world);
  for (const int lamp : lamps) seen.lamps.push_back(scene.lamps[lamp].id);
  views.bound(pose, cam_from_body, lamps, seen);
  return seen;
}

}  // namespace

void VisibilityOptions::validate() const {
  require(camera_place_m.allFinite(), "camera_place_m", camera_place_m.transpose(), "finite");
  require(std::isfinite(camera_pan_rad), "camera_pan_rad", camera_pan_rad, "finite");
  require(std::isfinite(camera_tilt_rad), "camera_tilt_rad", camera_tilt_rad, "finite");
  require(std::isfinite(margin_px), "margin_px", margin_px, "finite");
  require(std::isfinite(sigma_px) && sigma_px > 0, "sigma_px", sigma_px, "positive");
  require(heading_sigma_rad > 0, "heading_sigma_rad", heading_sigma_rad, "positive");
}

LampViews::LampViews(const Scene& scene, const VisibilityOptions& options)
    : scene_(scene), options_(options) {
  for (const Lamp& lamp : scene.lamps) rims_.push_back(rim_of(lamp));
}

bool LampViews::sees(std::size_t lamp, const Rigid3& cam_from_world,
                     const Eigen::Vector3d& eye) const {
  if (!scene_.lamps[lamp].shows_lit_side(eye)) return false;
  const Camera& camera = scene_.camera;
  const double margin = options_.margin_px;
  for (const Eigen::Vector3d& point : rims_[lamp]) {
    const auto px = camera.project(cam_from_world * point);
    if (!px || px->minCoeff() < margin - 0.5 || px->x() > camera.width() - 0.5 - margin ||
        px->y() > camera.height() - 0.5 - margin)
      return false;
    if (hidden_by_box(scene_.boxes, point, eye)) return false;
  }
  return true;
}

std::vector<int> LampViews::in_view(const Rigid3& cam_from_world) const {
  const Eigen::Vector3d eye = cam_from_world.origin_in_source();
  std::vector<int> lamps;
  for (std::size_t i = 0; i < rims_.size(); ++i)
    if (sees(i, cam_from_world, eye)) lamps.push_back(static_cast<int>(i));
  return lamps;
}

int LampViews::count_in_view(const Rigid3& cam_from_world) const {
  const Eigen::Vector3d eye = cam_from_world.origin_in_source();
  int count = 0;
  for (std::size_t i = 0; i < rims_.size(); ++i) count += sees(i, cam_from_world, eye) ? 1 : 0;
  return count;
}

void LampViews::bound(const PlanarPose& pose, const Rigid3& cam_from_body,
                      const std::vector<int>& lamps, Visibility& seen) const {
  const Rigid3 body = body_from_world(pose);
  const Eigen::Matrix<double, 6, 3> motion = planar_perturbation(pose).leftCols<3>();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  information(2, 2) = std::pow(options_.heading_sigma_rad, -2);
  for (const int lamp : lamps) {
    const Eigen::Vector3d in_body = body * scene_.lamps[lamp].centre_m;
    Eigen::Matrix<double, 2, 3> d_point;
    if (!scene_.camera.project(cam_from_body * in_body, &d_point)) continue;
    Eigen::Matrix<double, 3, 6> d_body;
    d_body << -skew(in_body), Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 2, 3> jacobian =
        d_point * cam_from_body.rotation * d_body * motion / options_.sigma_px;
    information += jacobian.transpose() * jacobian;
  }
  // Singular to 1e-12 of its scale, as in pose_bound().
  const auto parts = internal::core::symmetric_eigen<Eigen::Matrix3d>(information);
  if (!(parts.eigenvalues()[0] > 1e-12 * parts.eigenvalues()[2])) return;
  const Eigen::Matrix3d covariance = information.inverse();
  seen.position_sigma_m = std::sqrt(covariance(0, 0) + covariance(1, 1));
  seen.heading_sigma_rad = std::sqrt(covariance(2, 2));
}

std::vector<Visibility> visibility(const Scene& scene, const std::vector<PlanarPose>& poses,
                                   const VisibilityOptions& options) {
  options.validate();
  Scene checked = scene;
  checked.validate();
  for (std::size_t i = 0; i < poses.size(); ++i)
    require(poses[i].finite(), "poses[" + std::to_string(i) + "]",
            Eigen::RowVector3d(poses[i].x_m, poses[i].y_m, poses[i].heading_rad), "finite");
  const LampViews views(checked, options);
  const Rigid3 cam_from_body =
      camera_on_vehicle(options.camera_place_m, options.camera_pan_rad, options.camera_tilt_rad);
  std::vector<Visibility> seen(poses.size());
  for_each_index(poses.size(), [&](std::size_t i) {
    seen[i] = seen_from(checked, views, cam_from_body, poses[i]);
  });
  return seen;
}

Visibility visibility(const Scene& scene, const PlanarPose& pose,
                      const VisibilityOptions& options) {
  return visibility(scene, std::vector<PlanarPose>{pose}, options).front();
}

}  // namespace occ
