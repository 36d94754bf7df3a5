// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "libocc/core/internal/area_moments.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/formation/rim.hpp"

namespace occ::internal::refine {
namespace {

/// Tolerance as a fraction of the size: errors of lens or map shift a lamp's rim but hardly deform
/// it.
constexpr double rim_misfit = 0.05, rim_misfit_of_three = 0.02;
constexpr double rim_misfit_sigma = 5, max_growth_sigmas = 3;

/// Tolerance without a rim: the axes of the blob's second moments are less accurate.
constexpr double axis_misfit = 0.15, axis_misfit_px = 1.5;
constexpr double min_semi_minor_px = 3;  ///< a smaller disc has no measurable shape

bool rim_misses(const LampResidual& residual, const Blob& blob, bool only_three) {
  double variance = 0;
  for (const RimPoint& point : blob.rim) variance += point.sigma_px * point.sigma_px;
  const double noise_px = std::sqrt(variance / static_cast<double>(blob.rim.size()));
  const double size_px = std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px);
  const double part = only_three ? rim_misfit_of_three : rim_misfit;
  const double growth_px = std::sqrt(blob.rim_covariance_px2(0, 0));  // of a soft edge, for example
  return residual.rms_px >
         std::max({part * size_px, rim_misfit_sigma * noise_px, max_growth_sigmas * growth_px});
}

/// True if the blob of a disc that is large enough for a rim does not have the predicted axes: it
/// is partly hidden, or not a lamp.
bool axes_miss(const Lamp& lamp, const Blob& blob, const Refined& refined, const Camera& camera) {
  if (lamp.shape != LampShape::disc || blob.striped) return false;
  const auto predicted = predicted_axes_px(lamp, refined.cam_from_world, camera);
  if (!predicted) return true;
  const Eigen::Array2d seen(blob.ellipse.semi_minor_px, blob.ellipse.semi_major_px);
  if (!((*predicted)[0] > min_semi_minor_px)) return false;
  return ((seen - *predicted).abs() > axis_misfit * *predicted + axis_misfit_px).any();
}

std::string message(const Lamp& lamp, const Blob& blob, const LampResidual& residual) {
  std::ostringstream text;
  text.precision(4);
  text << "no pose fits both the positions and the sizes of the lamps: lamp " << lamp.id;
  if (blob.rim.empty())
    text << " has another size than the blob at " << blob.centroid_px.transpose() << " px";
  else
    text << "'s rim misses by " << residual.rms_px << " px";
  return text.str();
}

}  // namespace

std::optional<Eigen::Matrix2d> image_moments_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const Camera& camera) {
  constexpr int of_disc = 16, of_curve = 64;
  const auto rim =
      project_rim(lamp, cam_from_world, camera, lamp.shape == LampShape::disc ? of_disc : of_curve);
  if (!rim) return std::nullopt;
  if (lamp.shape != LampShape::disc) {
    std::vector<Eigen::Vector2d> outline;
    for (const Eigen::Vector2d& px : *rim)
      outline.push_back(camera.difference_px(px, rim->front()));
    return 4 * core::outline_moments(outline).second;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& px : *rim) {
    const Eigen::Vector2d off = camera.difference_px(px, rim->front());
    mean += off / static_cast<double>(rim->size());
    squares += off * off.transpose() / static_cast<double>(rim->size());
  }
  return 2 * (squares - mean * mean.transpose());
}

std::optional<Eigen::Array2d> predicted_axes_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Camera& camera) {
  const auto moments = image_moments_px2(lamp, cam_from_world, camera);
  if (!moments) return std::nullopt;
  return core::symmetric_eigenvalues(*moments).array().max(0).sqrt();
}

std::optional<Eigen::Array2d> predicted_light_axes_px(const Lamp& lamp,
                                                      const Rigid3& cam_from_world,
                                                      const Camera& camera) {
  if (lamp.shape == LampShape::polygon) return predicted_axes_px(lamp, cam_from_world, camera);
  if (lamp.shape != LampShape::rectangle && lamp.shape != LampShape::lame) return std::nullopt;
  // Variance of a coordinate over the area, of the squared side: 1/12 of a rectangle, 1/16 of an
  // ellipse; in between for other Lame curves.
  constexpr double rectangle = 1.0 / 12, ellipse = 1.0 / 16;
  const double roundness = lamp.shape == LampShape::lame ? std::min(1.0, 2 / lamp.exponent) : 0;
  const double variance = rectangle + roundness * (ellipse - rectangle);
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  const Eigen::Vector3d axes[] = {lamp.x_axis, lamp.normal.cross(lamp.x_axis)};
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d half = 0.5 * lamp.size_m[i] * axes[i];
    const auto from = camera.project(cam_from_world * (lamp.centre_m - half));
    const auto to = camera.project(cam_from_world * (lamp.centre_m + half));
    if (!from || !to) return std::nullopt;
    const Eigen::Vector2d side = camera.difference_px(*to, *from);
    moments += variance * side * side.transpose();
  }
  return 2 * core::symmetric_eigenvalues(moments).array().max(0).sqrt();
}

std::string size_contradiction(const Refined& refined, const std::vector<Blob>& blobs,
                               const Scene& scene) {
  const auto blob_of = [&](const LampResidual& residual) -> const Blob& {
    return blobs[residual.match.blob];
  };
  const auto whole =
      std::count_if(refined.lamps.begin(), refined.lamps.end(),
                    [&](const LampResidual& residual) { return is_whole(blob_of(residual)); });
  for (const LampResidual& residual : refined.lamps) {
    const Lamp& lamp = scene.lamps[residual.match.lamp];
    const Blob& blob = blob_of(residual);
    const bool coded = lamp.frequency_hz && blob.frequency_hz;
    if (coded || blob.saturated || residual.contradicts) continue;
    const bool three = whole <= 3;
    const bool misses =
        blob.rim.empty() ? three && is_whole(blob) && axes_miss(lamp, blob, refined, scene.camera)
                         : rim_misses(residual, blob, three);
    if (misses) return message(lamp, blob, residual);
  }
  return {};
}

}  // namespace occ::internal::refine
