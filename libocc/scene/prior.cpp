// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/scene/internal/vector_text.hpp"

namespace occ {
namespace {

double square(double value) { return value * value; }

// Angle between two directions, accurate near 0 and pi alike.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void require_positive(double value, const char* name) {
  require(value > 0 && std::isfinite(value), name, value, "positive");
}

double wrapped(double turn) { return std::atan2(std::sin(turn), std::cos(turn)); }

Eigen::Vector3d down(const Rigid3& cam_from_world) { return -cam_from_world.rotation.col(2); }

void refuse_if_apart(double chi2, int dof, const char* a, const char* b) {
  constexpr double once_in_a_million[] = {0, 23.93, 27.63, 30.66};  // chi-square's quantiles
  if (chi2 <= once_in_a_million[dof]) return;
  std::ostringstream text;
  text << "prior." << a << " and prior." << b << " contradict each other: they are "
       << std::round(10 * std::sqrt(chi2)) / 10 << " sigma apart";
  throw std::invalid_argument(text.str());
}

// An unknown axis is one known to a thousand kilometres.
Eigen::Vector3d finite_variances(const Eigen::Vector3d& sigmas_m) {
  return sigmas_m.cwiseMin(1e6).cwiseAbs2();
}

void compare_places(const Prior& prior) {
  const Eigen::Vector3d variances = finite_variances(prior.position_sigmas());
  const double height_variance = square(prior.height_sigma_m);
  if (prior.position_m && prior.height_m)
    refuse_if_apart(
        square(prior.position_m->z() - *prior.height_m) / (variances.z() + height_variance), 1,
        "position_m", "height_m");
  if (!prior.last_pose) return;
  const Eigen::Vector3d last = prior.last_pose->cam_from_world.origin_in_source();
  Eigen::Matrix3d covariance =
      position_covariance(prior.last_pose->cam_from_world, prior.last_pose->covariance);
  if (prior.height_m)
    refuse_if_apart(square(last.z() - *prior.height_m) / (covariance(2, 2) + height_variance), 1,
                    "height_m", "last_pose");
  if (!prior.position_m) return;
  covariance.diagonal() += variances;
  const Eigen::Vector3d off = last - *prior.position_m;
  refuse_if_apart(off.dot(covariance.llt().solve(off)), 3, "position_m", "last_pose");
}

// The camera's x axis in the world moves by R^T (e_x x w), its down axis in the camera by w x down.
void compare_turns(const Prior& prior) {
  if (!prior.last_pose) return;
  const Rigid3& last = prior.last_pose->cam_from_world;
  const Eigen::Matrix3d& r = last.rotation;
  const Eigen::Matrix3d turn = prior.last_pose->covariance.topLeftCorner<3, 3>();
  const double level2 = square(r(0, 0)) + square(r(0, 1));
  if (prior.heading_rad && level2 > 0) {
    const Eigen::Vector3d azimuth = (r(0, 0) * r.col(1) - r(0, 1) * r.col(0)) / level2;
    const Eigen::Vector3d by_turn = azimuth.cross(Eigen::Vector3d::UnitX());
    const double off = wrapped(heading_rad(last) - *prior.heading_rad);
    refuse_if_apart(square(off) / (square(prior.heading_sigma_rad) + by_turn.dot(turn * by_turn)),
                    1, "heading_rad", "last_pose");
  }
  if (!prior.gravity_in_cam) return;
  const Eigen::Vector3d axis =
      down(last).cross(prior.gravity_in_cam->normalized()).stableNormalized();
  refuse_if_apart(square(angle_between(down(last), *prior.gravity_in_cam)) /
                      (square(prior.gravity_sigma_rad) + axis.dot(turn * axis)),
                  2, "gravity_in_cam", "last_pose");
}

void validate_last_pose(const PriorPose& last) {
  const Matrix6& c = last.covariance;
  require(last.cam_from_world.rotation.allFinite() && last.cam_from_world.translation.allFinite(),
          "prior.last_pose", last.cam_from_world.matrix(), "finite");
  const bool symmetric = c.allFinite() && (c - c.transpose()).norm() <= 1e-6 * c.norm();
  require(symmetric && c.llt().info() == Eigen::Success, "prior.last_pose's covariance", c,
          "symmetric and positive definite");
}

}  // namespace

int Prior::dof() const {
  return (position_m ? 3 : 0) + (height_m ? 1 : 0) + (heading_rad ? 1 : 0) +
         (gravity_in_cam ? 2 : 0) + (last_pose ? 6 : 0);
}

void Prior::validate() const {
  if (position_m)
    require(position_m->allFinite(), "prior.position_m", vector_text(*position_m), "finite");
  require_positive(position_sigma_m, "prior.position_sigma_m");
  if (position_sigmas_m)
    require(position_sigmas_m->minCoeff() > 0, "prior.position_sigmas_m",
            vector_text(*position_sigmas_m), "positive");
  if (height_m) require(std::isfinite(*height_m), "prior.height_m", *height_m, "finite");
  require_positive(height_sigma_m, "prior.height_sigma_m");
  if (heading_rad)
    require(std::isfinite(*heading_rad), "prior.heading_rad", *heading_rad, "finite");
  require_positive(heading_sigma_rad, "prior.heading_sigma_rad");
  if (gravity_in_cam)
    require(std::abs(gravity_in_cam->norm() - 1) < 1e-3, "prior.gravity_in_cam",
            vector_text(*gravity_in_cam), "a unit vector");
  require_positive(gravity_sigma_rad, "prior.gravity_sigma_rad");
  if (last_pose) validate_last_pose(*last_pose);
  compare_places(*this);
  compare_turns(*this);
}

}  // namespace occ
