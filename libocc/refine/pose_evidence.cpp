// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pose_evidence.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libocc/core/internal/blob_corners.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/light_evidence.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"
#include "libocc/refine/internal/scene_errors.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"
#include "libocc/scene/internal/rectangle_corners.hpp"

namespace occ::internal::refine {
namespace {

using pose::PoseEvidence;
using pose::SeenLamp;

/// Relative errors of a blob's size: seen smaller and larger than predicted.
struct SizeErrors {
  double smaller, larger;
};

/// ln of the density ratio of a blob's size. For a lamp, the size is normal about the predicted
/// one; the growth of a saturated lamp is exponential. For a false light it is uniform in ln over
/// two and a half decades.
double log_size_ratio(const Eigen::Array2d& axes_px, const Blob& blob, const SizeErrors& errors,
                      bool has_grown) {
  constexpr double log_range = 6, error_px = 0.7, blur_px = 0.7;
  constexpr double growth_px = 3, relative_growth = 0.3;
  const double expected_px = std::sqrt((axes_px.square() + square(blur_px)).sqrt().prod());
  const double seen_px = std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px);
  const double off_px = seen_px - expected_px;
  const auto sigma_px = [&](double relative) {
    return std::hypot(relative * expected_px, error_px);
  };
  const double grown_px = std::max(growth_px, relative_growth * expected_px);
  const double half_width_px = std::sqrt(pi / 2) * sigma_px(errors.smaller);
  const double width_px =
      half_width_px + (has_grown ? grown_px : std::sqrt(pi / 2) * sigma_px(errors.larger));
  const double log_shape =
      has_grown && off_px > 0
          ? -off_px / grown_px
          : -0.5 * square(off_px / sigma_px(off_px > 0 ? errors.larger : errors.smaller));
  return log_shape + std::log(seen_px * log_range / width_px);
}

/// True if a blob's rim may have grown because it is far above full scale. A channel that is not
/// clipped bounds the light of those that are, by the lamp's colour.
bool has_grown(const Lamp& lamp, const Blob& blob, bool colours_are_stated) {
  constexpr double max_excess = 2;  // moves the edge of a lamp by about half of its blur
  if (!blob.saturated || !colours_are_stated || !blob.colour) return blob.saturated;
  const BlobColour& seen = *blob.colour;
  for (int k = 0; k < 3; ++k) {
    if (seen.clipped[static_cast<std::size_t>(k)] || !(lamp.colour[k] > 0)) continue;
    double excess = 0;
    for (int j = 0; j < 3; ++j)
      excess = std::max(excess, lamp.colour[j] / lamp.colour[k] * seen.share[k] / seen.share[j]);
    if (excess < max_excess) return false;
  }
  return true;
}

/// True if a blob is clearly larger than predicted, which no hidden part explains.
bool is_larger(const Eigen::Array2d& axes_px, const Blob& blob) {
  constexpr double factor = 1.2, blur_px = 1.5;
  return std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px) >
         factor * std::sqrt(axes_px.prod()) + blur_px;
}

/// True if the ellipse of the blob was measured as one of the lamp's shape.
bool has_shape_of(const Lamp& lamp, const Blob& blob) {
  if (blob.rim.empty()) return false;
  if (lamp.shape == LampShape::lame)
    return lamp.exponent == 2 ? blob.has_elliptical_rim() : blob.free_form;
  if (lamp.shape == LampShape::polygon) return blob.free_form || !blob.corners_px.empty();
  return lamp.shape == LampShape::disc && !blob.free_form;
}

/// Light of a seen lamp, and ln of the density ratio of its visibility: nearly edge-on a disc is
/// too dark to be found, but for one in a hundred.
std::pair<SeenLight, double> appearance(const Lamp& lamp, const Blob& blob,
                                        const Rigid3& cam_from_world, const Scene& scene,
                                        bool colours_are_stated) {
  constexpr double edge_on = 0.1;
  constexpr SizeErrors of_disc{0.1, 0.1};
  constexpr SizeErrors of_moments{0.25, 0.1};  // uneven light and hidden parts make them smaller
  constexpr double open_if_larger = 0.001;     // only glare or another lamp beside it
  const double seen_edge_on = std::log(0.01);
  SeenLight light;
  light.flux = flux_ratio(lamp, blob, cam_from_world, scene);
  if (blob.striped || blob.has_hidden_sides() || !(blob.ellipse.semi_minor_px > 0))
    return {light, 0};
  if (lamp.shape != LampShape::disc && !has_shape_of(lamp, blob)) {
    const auto axes_px = predicted_light_axes_px(lamp, cam_from_world, scene.camera);
    if (axes_px) {
      const bool grown = has_grown(lamp, blob, colours_are_stated);
      light.log_size = log_size_ratio(*axes_px, blob, of_moments, grown);
      if (!grown && is_larger(*axes_px, blob)) light.open = open_if_larger;
    }
    return {light, 0};
  }
  const auto axes_px = predicted_axes_px(lamp, cam_from_world, scene.camera);
  if (!axes_px) return {light, seen_edge_on};
  light.log_size = log_size_ratio(*axes_px, blob, of_disc, blob.saturated);
  return {light, (*axes_px)[0] < edge_on * (*axes_px)[1] ? seen_edge_on : 0};
}

/// Fluxes of the blobs that are no lamps but may be by their colour, in ascending order.
std::vector<double> log_fluxes(const std::vector<Blob>& blobs, const std::vector<char>& is_lamp,
                               const scene::ColourTest& colours, const Scene& scene) {
  std::vector<double> fluxes;
  for (std::size_t i = 0; i < blobs.size(); ++i)
    if (colours.contradicts_all(blobs[i])) {
      continue;
    } else if (const auto flux = log_flux(blobs[i], scene); flux && !is_lamp[i])
      fluxes.push_back(*flux);
  std::sort(fluxes.begin(), fluxes.end());
  return fluxes;
}

/// Symmetric root of the second moments of an ellipse: xx, yy, sqrt(2) xy [px].
Eigen::Vector3d shape_of(const Eigen::Matrix2d& root) {
  return {root(0, 0), root(1, 1), std::sqrt(2.0) * root(0, 1)};
}

Eigen::Vector3d measured_shape(const Ellipse& ellipse) {
  const Eigen::Vector2d axis(std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad));
  const Eigen::Matrix2d along = axis * axis.transpose();
  return shape_of(ellipse.semi_minor_px * Eigen::Matrix2d::Identity() +
                  (ellipse.semi_major_px - ellipse.semi_minor_px) * along);
}

/// Shape of the image of a disc or a Lame curve; empty if the lamp is not visible. The root of M is
/// (M + sqrt(det M) I) / sqrt(trace M + 2 sqrt(det M)).
std::optional<Eigen::Vector3d> predicted_shape(const Lamp& lamp, const Rigid3& cam_from_world,
                                               const Camera& camera) {
  const auto moments = image_moments_px2(lamp, cam_from_world, camera);
  if (!moments) return std::nullopt;
  const double area = std::sqrt(std::max(0.0, moments->determinant()));
  const Eigen::Matrix2d root =
      (*moments + area * Eigen::Matrix2d::Identity()) / std::sqrt(moments->trace() + 2 * area);
  return shape_of(root);
}

/// Common growth of saturated rims: of the refinement by rims, else the median.
double common_growth_px(const Refined& refined, const std::vector<Blob>& blobs,
                        const Scene& scene) {
  if (refined.rim_growth_px) return *refined.rim_growth_px;
  std::vector<double> growths_px;
  for (const LampResidual& residual : refined.lamps) {
    const Lamp& lamp = scene.lamps[residual.match.lamp];
    const Blob& blob = blobs[residual.match.blob];
    if (!has_shape_of(lamp, blob) || !blob.saturated) continue;
    if (const auto shape = predicted_shape(lamp, refined.cam_from_world, scene.camera))
      growths_px.push_back((measured_shape(blob.ellipse) - *shape).head<2>().mean());
  }
  return growths_px.empty() ? 0 : median(std::move(growths_px));
}

/// Variance of the size of a lamp's image by the stated errors of the scene: those of its size, its
/// distance and its tilt, those of the map that change its distance, and of the camera's scale,
/// which is that between two points of its rim.
double size_variance_px2(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                         const Scene& scene) {
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  double relative = 0;
  if (const auto errors = errors_of(lamp, scene)) {
    const Eigen::Vector3d sight = cam_from_world.rotation.transpose() * centre.normalized();
    relative = square(errors->size) + square(errors->tilt_rad) +
               errors->position_m.cwiseProduct(sight).squaredNorm() / centre.squaredNorm();
  }
  const SharedErrors shared(scene);
  relative +=
      (shared.motion(lamp, cam_from_world).transpose() * centre.normalized()).squaredNorm() /
      centre.squaredNorm();
  double variance_px2 = relative * square(blob.ellipse.semi_major_px);
  if (shared.camera_count() > 0) {
    const Eigen::Vector3d across = lamp.reach_m() * centre.unitOrthogonal();
    const Eigen::Vector3d up = centre.normalized().cross(across);
    for (const Eigen::Vector3d& reach : {across, up})
      variance_px2 += 0.5 *
                      (shared.by_camera(scene.camera, centre + reach) -
                       shared.by_camera(scene.camera, centre - reach))
                          .squaredNorm() /
                      4;
  }
  return variance_px2;
}

/// Adds the shape of a rim without the common growth of saturated rims. Its errors: those of its
/// points, each axis from half of them, and those that they share, as of a soft edge; the growth of
/// a saturated rim, which differs between lamps by as much as the common growth; and a relative
/// error of the model.
void add_shape(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world, const Scene& scene,
               double common_growth_px, SeenLamp& seen) {
  constexpr double min_growth_px = 2, relative = 0.003, step = 1e-6;
  const Camera& camera = scene.camera;
  if (!has_shape_of(lamp, blob) || blob.striped || blob.has_hidden_sides()) return;
  const auto shape = predicted_shape(lamp, cam_from_world, camera);
  if (!shape) return;
  for (int k = 0; k < 6; ++k) {
    const Rigid3 moved = perturb(cam_from_world, step * Vector6::Unit(k));
    const auto there = predicted_shape(lamp, moved, camera);
    if (!there) return;
    seen.shape_by_pose.col(k) = (*there - *shape) / step;
  }
  double variance_px2 = 0;
  for (const RimPoint& point : blob.rim) variance_px2 += square(point.sigma_px);
  const auto count = static_cast<double>(blob.rim.size());
  seen.shape_by_size = *shape;
  seen.shape_residual_px = *shape - measured_shape(blob.ellipse);
  if (blob.saturated) seen.shape_residual_px.head<2>().array() += common_growth_px;
  const double growth_px = blob.saturated ? std::max(min_growth_px, std::abs(common_growth_px)) : 0;
  seen.shape_sigma_px =
      std::sqrt(2 * variance_px2 / square(count) + square(relative * blob.ellipse.semi_major_px) +
                blob.rim_covariance_px2(0, 0) + square(growth_px) +
                size_variance_px2(lamp, blob, cam_from_world, scene));
}

/// Adds three corners of a rectangle relative to its centroid; the fourth follows. A false light
/// has them anywhere in a square about the blob.
void add_corners(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                 const Camera& camera, bool has_grown, PoseEvidence& evidence) {
  constexpr std::size_t corners = 4;
  constexpr double step = 1e-6, square_over_axis = 3;
  if (lamp.shape != LampShape::rectangle || blob.corners_px.size() != corners || blob.striped ||
      blob.hidden_in_part)
    return;
  const Eigen::Matrix<double, 3, 4> offsets = scene::rectangle_corners(lamp);
  // Corners clockwise in the image, relative to the centroid.
  const auto predicted = [&](const Rigid3& pose) {
    std::vector<Eigen::Vector2d> px;
    const auto centre = project_lamp_centre(lamp, pose, camera);
    if (!centre) return px;
    for (const auto& corner : offsets.colwise()) {
      const auto at = camera.project(pose * (lamp.centre_m + corner));
      if (!at) return std::vector<Eigen::Vector2d>{};
      px.push_back(camera.difference_px(*at, *centre));
    }
    return px;
  };
  const std::vector<Eigen::Vector2d> here = predicted(cam_from_world);
  if (here.empty()) return;
  std::array<std::vector<Eigen::Vector2d>, 6> moved;
  for (int k = 0; k < 6; ++k) {
    moved[static_cast<std::size_t>(k)] =
        predicted(perturb(cam_from_world, step * Vector6::Unit(k)));
    if (moved[static_cast<std::size_t>(k)].empty()) return;
  }
  std::size_t turn = 0;
  double nearest = infinity;
  for (std::size_t t = 0; t < corners; ++t) {
    double squares = 0;
    for (std::size_t i = 0; i < corners; ++i)
      squares += (here[(i + t) % corners] - (blob.corners_px[i] - blob.centroid_px)).squaredNorm();
    if (squares < nearest) nearest = squares, turn = t;
  }
  const double growth_px = has_grown ? core::over_exposed_growth_px : 0;
  const double side_px = square_over_axis * blob.ellipse.semi_major_px;
  for (std::size_t i = 0; i + 1 < corners; ++i) {
    const std::size_t j = (i + turn) % corners;
    SeenLamp corner;
    corner.by_size = here[j];
    corner.residual_px = here[j] - (blob.corners_px[i] - blob.centroid_px);
    corner.covariance_px2 = core::corner_covariance_px2(blob, i, 0, growth_px);
    for (int k = 0; k < 6; ++k)
      corner.by_pose.col(k) = (moved[static_cast<std::size_t>(k)][j] - here[j]) / step;
    evidence.corners.push_back(corner);
    evidence.log_appearance += 2 * std::log(side_px);
  }
}

/// True if the visible sides of a lamp that the border cuts tell where it is.
bool is_place_if_cut(const Blob& blob) {
  return blob.cut_by_border && !blob.merged && !blob.striped && !blob.has_hidden_sides() &&
         !blob.rim.empty() && !blob.has_elliptical_rim();
}

/// Adds a lamp that the border cuts by the shift of its visible sides from the predicted ones. A
/// false light is anywhere along the border. False if the sides do not determine the shift.
bool add_cut(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world, const Scene& scene,
             PoseEvidence& evidence) {
  constexpr double max_variance_px2 = 4;  // sides of one direction do not tell the place
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 6> by_pose = Eigen::Matrix<double, 2, 6>::Zero();
  for (const RimPoint& point : blob.rim) {
    const auto ray = rim_ray(point, scene.camera);
    Eigen::Matrix<double, 1, 6> jacobian;
    const auto off = ray ? rim_distance_px(lamp, cam_from_world, *ray, &jacobian) : std::nullopt;
    if (!off) continue;
    const double weight = 1 / square(point.sigma_px);
    information += weight * point.normal * point.normal.transpose();
    gradient += weight * *off * point.normal;
    by_pose += weight * point.normal * jacobian;
  }
  const Eigen::Matrix2d covariance = information.inverse();
  if (!covariance.allFinite() || !(covariance.trace() < max_variance_px2)) return false;
  SeenLamp seen;
  seen.residual_px = covariance * gradient;
  seen.by_pose = covariance * by_pose;
  const double growth_px = blob.saturated ? core::over_exposed_growth_px : 0;
  const double common_px2 = blob.rim_covariance_px2(0, 0) + square(growth_px);
  seen.covariance_px2 = covariance + common_px2 * Eigen::Matrix2d::Identity() +
                        image_covariance_px2(lamp, cam_from_world, scene);
  const double border_px = 2.0 * (scene.camera.width() + scene.camera.height());
  evidence.log_appearance += std::log(border_px * blob.ellipse.semi_major_px / evidence.image_px2);
  evidence.lamps.push_back(seen);
  return true;
}

/// Adds the lamps that the border cuts. A single one beside a single whole lamp does not count:
/// something may hide a part of it.
void add_cut_lamps(const Refined& refined, const std::vector<Blob>& blobs, const Scene& scene,
                   const scene::ColourTest& colours, PoseEvidence& evidence) {
  constexpr std::size_t min_lamps = 3;
  PoseEvidence with_cut = evidence;
  for (const Blob& blob : blobs)
    with_cut.blobs += is_place_if_cut(blob) && !colours.contradicts_all(blob);
  for (const LampResidual& residual : refined.lamps) {
    const Blob& blob = blobs[residual.match.blob];
    if (residual.contradicts || !is_place_if_cut(blob)) continue;
    if (add_cut(scene.lamps[residual.match.lamp], blob, refined.cam_from_world, scene, with_cut))
      with_cut.log_appearance += colours.log_ratio(residual.match.lamp, blob);
  }
  if (with_cut.lamps.size() >= min_lamps) evidence = std::move(with_cut);
}

/// ln of the density ratio of a code: one false light in a hundred has a code, which is then that
/// of any lamp.
double log_code_ratio(const Lamp& lamp, const Blob& blob, std::size_t lamps) {
  const bool coded = blob.lamp_id == lamp.id || (lamp.frequency_hz && blob.frequency_hz);
  return coded ? std::log(100.0 * static_cast<double>(lamps)) : 0;
}

double volume_m3(const std::vector<Lamp>& lamps, const Eigen::Vector3d& position_m) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) mean += lamp.centre_m / static_cast<double>(lamps.size());
  double radius_m = 0;
  for (const Lamp& lamp : lamps) radius_m = std::max(radius_m, (lamp.centre_m - mean).norm());
  return identify::volume_m3(radius_m, (position_m - mean).norm());
}

}  // namespace

PoseEvidence evidence_of(const Refined& refined, const Hypothesis& hypothesis,
                         const std::vector<Blob>& blobs, const Scene& scene,
                         const std::optional<Prior>& prior) {
  const Rigid3& cam_from_world = refined.cam_from_world;
  PoseEvidence evidence;
  evidence.image_px2 = static_cast<double>(scene.camera.width()) * scene.camera.height();
  const scene::ColourTest colours(scene.lamps);
  evidence.blobs =
      static_cast<int>(std::count_if(blobs.begin(), blobs.end(), [&](const Blob& blob) {
        return is_whole(blob) && !colours.contradicts_all(blob);
      }));
  evidence.missed = hypothesis.missed;
  evidence.volume_m3 = volume_m3(scene.lamps, cam_from_world.origin_in_source());
  const double growth_px = common_growth_px(refined, blobs, scene);
  std::vector<SeenLight> lights;
  std::vector<char> is_lamp(blobs.size());
  for (const LampResidual& residual : refined.lamps) {
    const Lamp& lamp = scene.lamps[residual.match.lamp];
    const Blob& blob = blobs[residual.match.blob];
    is_lamp[static_cast<std::size_t>(residual.match.blob)] = !residual.contradicts;
    if (!is_whole(blob)) continue;
    SeenLamp seen;
    const auto px =
        predicted_centroid_px(lamp, blob, cam_from_world, scene, Rung::centres, &seen.by_pose);
    if (!px || residual.contradicts) {
      ++evidence.missed;
      continue;
    }
    seen.residual_px = scene.camera.difference_px(*px, blob.centroid_px);
    seen.covariance_px2 = blob.covariance_px2 + image_covariance_px2(lamp, cam_from_world, scene);
    const auto [light, log_visible] =
        appearance(lamp, blob, cam_from_world, scene, colours.is_active());
    lights.push_back(light);
    evidence.log_appearance += log_visible + log_code_ratio(lamp, blob, scene.lamps.size()) +
                               colours.log_ratio(residual.match.lamp, blob);
    add_shape(lamp, blob, cam_from_world, scene, growth_px, seen);
    add_corners(lamp, blob, cam_from_world, scene.camera,
                has_grown(lamp, blob, colours.is_active()), evidence);
    evidence.lamps.push_back(seen);
  }
  add_cut_lamps(refined, blobs, scene, colours, evidence);
  evidence.log_appearance += log_light_ratio(lights, log_fluxes(blobs, is_lamp, colours, scene));
  if (prior) evidence.prior = identify::prior_parts(*prior, cam_from_world);
  return evidence;
}

}  // namespace occ::internal::refine
