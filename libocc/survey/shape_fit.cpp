// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/shape_fit.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double min_growth_px = 0.02;  // error of a rim that its noise does not contain
// Likewise of an over-exposed rim, which stays in all pictures: 2.5 widths of a point's image for
// twenty times full scale.
constexpr double saturated_growth_px = 1.5;
constexpr double huber_sigma = 3;  // residuals beyond it have a lower weight

/// Unknowns: two tilts of a disc, or three rotations; then one or two logarithms of sizes.
struct ShapeUnknowns {
  Eigen::Matrix3Xd axes;  // rotations in the world
  int sizes = 1;
  Eigen::Index count() const { return axes.cols() + sizes; }
};

ShapeUnknowns unknowns_of(const Lamp& lamp) {
  ShapeUnknowns unknowns;
  if (lamp.shape == LampShape::disc) {
    unknowns.axes.resize(3, 2);
    unknowns.axes.col(0) = lamp.normal.unitOrthogonal();
    unknowns.axes.col(1) = lamp.normal.cross(unknowns.axes.col(0));
    return unknowns;
  }
  unknowns.axes = Eigen::Matrix3d::Identity();
  unknowns.sizes = 2;
  return unknowns;
}

Lamp resized(Lamp lamp, int size, double factor) {
  if (lamp.shape == LampShape::disc) {
    lamp.radius_m *= factor;
  } else {
    lamp.size_m[size] *= factor;
  }
  return lamp;
}

struct ShapeSums {
  MatrixXd information;
  VectorXd gradient;
  double chi2 = 0;
  int points = 0;
};

ShapeSums sums_of(const Lamp& lamp, const ShapeUnknowns& unknowns,
                  const std::vector<RimInPicture>& rims, const Camera& camera) {
  constexpr double step = 1e-5;  // of a logarithm of size, for the numerical derivative
  ShapeSums sums{MatrixXd::Zero(unknowns.count(), unknowns.count()),
                 VectorXd::Zero(unknowns.count())};
  for (const RimInPicture& rim : rims) {
    const LampInCam in_cam = lamp_in_cam(lamp, rim.cam_from_world);
    std::vector<LampInCam> larger;
    for (int s = 0; s < unknowns.sizes; ++s)
      larger.push_back(lamp_in_cam(resized(lamp, s, 1 + step), rim.cam_from_world));
    const double count = static_cast<double>(rim.blob->rim.size());
    const double growth = square(min_growth_px) + rim.blob->rim_covariance_px2(0, 0);
    for (const RimPoint& point : rim.blob->rim) {
      const auto ray = rim_ray(point, camera);
      if (!ray) continue;
      Eigen::Matrix<double, 1, 6> jacobian;
      const auto residual = rim_distance_px(in_cam, *ray, &jacobian);
      if (!residual) continue;
      VectorXd row(unknowns.count());
      row.head(unknowns.axes.cols()) =
          (jacobian.head<3>() * rim.cam_from_world.rotation * unknowns.axes).transpose();
      bool defined = true;
      for (int s = 0; s < unknowns.sizes; ++s) {
        const auto moved = rim_distance_px(larger[s], *ray);
        defined = defined && moved;
        if (moved) row[unknowns.axes.cols() + s] = (*moved - *residual) / step;
      }
      if (!defined) continue;
      const double sigma = std::sqrt(square(point.sigma_px) + count * growth);
      const double excess = std::abs(*residual) / (huber_sigma * point.sigma_px + min_growth_px);
      const double weight = 1 / (square(sigma) * std::max(1.0, excess));
      sums.information += weight * row * row.transpose();
      sums.gradient += weight * *residual * row;
      sums.chi2 += weight * square(*residual);
      ++sums.points;
    }
  }
  return sums;
}

}  // namespace

bool fit_shape(Lamp& lamp, const std::vector<RimInPicture>& rims, const Camera& camera) {
  constexpr int steps = 8;  // Gauss-Newton converges in four from the starts of lamp_view.hpp
  Lamp fitted = lamp;
  MatrixXd covariance;
  ShapeUnknowns unknowns = unknowns_of(fitted);
  for (int step = 0; step < steps; ++step) {
    unknowns = unknowns_of(fitted);
    const ShapeSums sums = sums_of(fitted, unknowns, rims, camera);
    if (sums.points < 4 * unknowns.count()) return false;
    const core::Cholesky<MatrixXd> factors(sums.information);
    constexpr double singular = 1e-12;
    if (!factors.exists() || !(factors.rcond() > singular)) return false;
    VectorXd delta = factors.solve(VectorXd(-sums.gradient));
    if (!delta.allFinite()) return false;
    constexpr double max_step = 0.2;  // [rad] and of the logarithm of a size
    delta *= std::min(1.0, max_step / std::max(max_step, delta.cwiseAbs().maxCoeff()));
    const Eigen::Matrix3d turn = so3_exp(unknowns.axes * delta.head(unknowns.axes.cols()));
    fitted.normal = (turn * fitted.normal).normalized();
    fitted.x_axis = turn * fitted.x_axis;
    fitted.x_axis = (fitted.x_axis - fitted.normal * fitted.normal.dot(fitted.x_axis)).normalized();
    for (int s = 0; s < unknowns.sizes; ++s)
      fitted = resized(fitted, s, std::exp(delta[unknowns.axes.cols() + s]));
    covariance = core::inverse<MatrixXd>(sums.information);
  }
  if (!covariance.allFinite()) return false;
  const Eigen::Index turns = unknowns.axes.cols();
  fitted.size_sigma = std::sqrt(covariance.diagonal().tail(unknowns.sizes).maxCoeff());
  fitted.tilt_sigma_rad = std::sqrt(covariance.diagonal().head(turns).maxCoeff());
  lamp = fitted;
  return true;
}

ShapeOfViews shape_of_views(const Vector3d& centre, LampShape shape,
                            const std::vector<ViewInPicture>& views, const Camera& camera,
                            const Vector3d& normal_of_others) {
  ShapeOfViews found;
  Lamp& lamp = found.lamp;
  lamp.shape = shape;
  lamp.centre_m = centre;
  std::vector<Vector3d> normals;
  std::vector<RimInPicture> rims;
  std::vector<double> sizes;
  Eigen::Vector2d sides = Eigen::Vector2d::Ones();
  for (const auto& [view, blob, pose] : views) {
    const Eigen::Matrix3d to_world = pose.rotation.transpose();
    for (const Vector3d& normal : view->normals) normals.push_back(to_world * normal);
    sizes.push_back((pose * centre).norm() / view->range);
    rims.push_back({blob, pose});
    lamp.x_axis = to_world * view->x_axis;
    sides = view->sides;
  }
  // A saturated rim has grown by an unknown amount: used only if there is no other.
  const auto is_saturated = [](const RimInPicture& rim) { return rim.blob->saturated; };
  const bool all_saturated = std::all_of(rims.begin(), rims.end(), is_saturated);
  if (!all_saturated)
    rims.erase(std::remove_if(rims.begin(), rims.end(), is_saturated), rims.end());
  const bool is_disc = shape == LampShape::disc;
  lamp.normal = consensus_direction(normals, normal_of_others);
  found.size = median(sizes);
  lamp.radius_m = is_disc ? found.size : 0;
  lamp.size_m = is_disc ? Eigen::Vector2d::Zero() : Eigen::Vector2d(sides * found.size);
  lamp.x_axis =
      is_disc ? Vector3d(lamp.normal.unitOrthogonal())
              : Vector3d((lamp.x_axis - lamp.normal * lamp.normal.dot(lamp.x_axis)).normalized());
  found.is_fitted = fit_shape(lamp, rims, camera);
  if (found.is_fitted && all_saturated) {
    std::vector<double> radii_px;
    for (const RimInPicture& rim : rims)
      radii_px.push_back(
          std::sqrt(rim.blob->ellipse.semi_major_px * rim.blob->ellipse.semi_minor_px));
    lamp.size_sigma = std::hypot(lamp.size_sigma, saturated_growth_px / median(radii_px));
  }
  if (found.is_fitted) found.size = size_of(lamp);
  return found;
}

}  // namespace occ::internal::survey
