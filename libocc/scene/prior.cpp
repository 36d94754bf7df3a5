// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/prior.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/fields.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

void refuse_if_apart(double chi2, int dof, const char* a, const char* b) {
  constexpr double quantiles[] = {0, 23.93, 27.63, 30.66};  // chi-square, probability 1 - 1e-6
  if (chi2 <= quantiles[dof]) return;
  std::ostringstream text;
  text << "prior." << a << " and prior." << b << " contradict each other: they are "
       << std::round(10 * std::sqrt(chi2)) / 10 << " sigma apart";
  throw std::invalid_argument(text.str());
}

// Squared Mahalanobis distance between one part of a prior and the last pose; both are uncertain.
double chi2_apart(const Prior& part, const PriorPose& last) {
  const PriorRows rows = part.rows(last.cam_from_world);
  Eigen::MatrixXd covariance = rows.jacobian * last.covariance * rows.jacobian.transpose();
  covariance.diagonal().array() += 1;
  return rows.residuals.dot(internal::core::solve_llt(covariance, rows.residuals));
}

void compare_with_last_pose(const Prior& prior) {
  const auto compare = [&](const char* name, const auto& take) {
    Prior part;
    take(part);
    if (!part.empty())
      refuse_if_apart(chi2_apart(part, *prior.last_pose), part.dof(), name, "last_pose");
  };
  compare("height_m", [&](Prior& part) {
    part.height_m = prior.height_m;
    part.height_sigma_m = prior.height_sigma_m;
  });
  compare("position_m", [&](Prior& part) {
    part.position_m = prior.position_m;
    part.position_sigmas_m = prior.position_sigmas();
  });
  compare("heading_rad", [&](Prior& part) {
    part.heading_rad = prior.heading_rad;
    part.heading_sigma_rad = prior.heading_sigma_rad;
  });
  compare("gravity_in_cam", [&](Prior& part) {
    part.gravity_in_cam = prior.gravity_in_cam;
    part.gravity_sigma_rad = prior.gravity_sigma_rad;
  });
}

void compare_heights(const Prior& prior) {
  if (!prior.position_m || !prior.height_m) return;
  const double variance = square(prior.position_sigmas().z()) + square(prior.height_sigma_m);
  refuse_if_apart(square(prior.position_m->z() - *prior.height_m) / variance, 1, "position_m",
                  "height_m");
}

void validate_last_pose(const PriorPose& last) {
  require(last.cam_from_world.rotation.allFinite() && last.cam_from_world.translation.allFinite(),
          "prior.last_pose", last.cam_from_world.matrix(), "finite");
  internal::core::require_positive_definite(last.covariance, "prior.last_pose's covariance");
}

}  // namespace

int Prior::dof() const {
  return (position_m ? 3 : 0) + (height_m ? 1 : 0) + (heading_rad ? 1 : 0) +
         (gravity_in_cam ? 2 : 0) + (last_pose ? 6 : 0);
}

void Prior::validate() const {
  check_fields(*this, prior_fields, "prior.");
  compare_heights(*this);
  if (!last_pose) return;
  validate_last_pose(*last_pose);
  compare_with_last_pose(*this);
}

}  // namespace occ
