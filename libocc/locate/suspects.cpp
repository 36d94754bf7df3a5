// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/suspects.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/scene/view.hpp"

namespace occ::internal::locate {
namespace {

/// Seen over predicted sizes of the discs that are seen whole; all, or only saturated ones.
std::vector<double> size_ratios(const Refined& pose, const std::vector<Blob>& blobs,
                                const Scene& scene, bool saturated) {
  std::vector<double> ratios;
  for (const LampResidual& residual : pose.lamps) {
    const Lamp& lamp = scene.lamps[residual.match.lamp];
    const Blob& blob = blobs[residual.match.blob];
    if (lamp.shape != LampShape::disc || blob.striped || blob.saturated != saturated ||
        !refine::is_whole(blob) || !(blob.ellipse.semi_minor_px > 0))
      continue;
    const auto axes_px = refine::predicted_axes_px(lamp, pose.cam_from_world, scene.camera);
    if (axes_px && axes_px->minCoeff() > 0)
      ratios.push_back(
          std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px / axes_px->prod()));
  }
  return ratios;
}

std::string over_exposure(const Refined& pose, const std::vector<Blob>& blobs, const Scene& scene) {
  constexpr double grown = 1.2;
  const std::vector<double> ratios = size_ratios(pose, blobs, scene, true);
  if (2 * ratios.size() < pose.lamps.size() || ratios.empty() || median(ratios) < grown) return {};
  std::ostringstream text;
  text.precision(2);
  text << "; the lamps are over-exposed (" << ratios.size() << " of " << pose.lamps.size()
       << " are saturated, " << median(ratios)
       << " times as large as predicted): try a shorter exposure";
  return text.str();
}

std::string common_size(const Refined& pose, const std::vector<Blob>& blobs, const Scene& scene) {
  constexpr double unusual = 0.15;  // of ln of the ratio
  const std::vector<double> ratios = size_ratios(pose, blobs, scene, false);
  if (ratios.size() < 3) return {};
  const double common = std::log(median(ratios));
  const bool agree = std::all_of(ratios.begin(), ratios.end(), [&](double ratio) {
    return std::abs(std::log(ratio) - common) < 0.5 * std::abs(common);
  });
  if (std::abs(common) < unusual || !agree) return {};
  std::ostringstream text;
  text.precision(2);
  text << "; all lamps appear " << std::exp(common)
       << " times as large as predicted: check radius_m, the focal length and the units of the map";
  return text.str();
}

/// Large residuals of the centres, or one lamp that was left out.
std::string misplaced(const Refined& pose, const std::vector<Blob>& blobs, const Scene& scene) {
  constexpr double large_px = 1, large_sigmas = 5;
  std::vector<double> sigmas_px;
  std::vector<int> left_out;
  for (const LampResidual& residual : pose.lamps) {
    sigmas_px.push_back(std::sqrt(0.5 * blobs[residual.match.blob].covariance_px2.trace()));
    if (residual.contradicts) left_out.push_back(scene.lamps[residual.match.lamp].id);
  }
  std::ostringstream text;
  text.precision(2);
  if (!sigmas_px.empty() &&
      pose.rms_px > std::max(large_px, large_sigmas * median(std::move(sigmas_px))))
    text << "; the centres are " << pose.rms_px
         << " px off: check the map, the lens and whether the image was turned or resized "
            "(gate_model_sigma_px allows for larger errors)";
  for (const int id : left_out)
    text << "; lamp " << id << " does not fit its blob and was left out";
  return text.str();
}

std::string missing(const Refined& pose, const Scene& scene) {
  constexpr std::size_t max_named = 5;
  const Eigen::Vector3d eye = pose.cam_from_world.origin_in_source();
  std::vector<int> ids;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const Lamp& lamp = scene.lamps[i];
    const bool seen = std::any_of(
        pose.lamps.begin(), pose.lamps.end(),
        [&](const LampResidual& residual) { return residual.match.lamp == static_cast<int>(i); });
    const auto px = scene.camera.project(pose.cam_from_world * lamp.centre_m);
    const auto axes_px = refine::predicted_axes_px(lamp, pose.cam_from_world, scene.camera);
    const double radius_px = axes_px ? axes_px->maxCoeff() : 0;
    if (!seen && px && border_distance_px(scene.camera, *px) > radius_px + 1 &&
        lamp.shows_lit_side(eye) && !hidden_by_box(scene.boxes, lamp.centre_m, eye))
      ids.push_back(lamp.id);
  }
  if (ids.empty()) return {};
  std::ostringstream text;
  text << "; " << (ids.size() == 1 ? "a lamp" : std::to_string(ids.size()) + " lamps")
       << " should be visible and have no blob (id";
  for (std::size_t i = 0; i < std::min(ids.size(), max_named); ++i) text << ' ' << ids[i];
  text << (ids.size() > max_named ? " ..." : "") << "): off, hidden, or the pose is wrong";
  return text.str();
}

}  // namespace

std::string suspects(const Refined& pose, const std::vector<Blob>& blobs, const Scene& scene) {
  return over_exposure(pose, blobs, scene) + common_size(pose, blobs, scene) +
         misplaced(pose, blobs, scene) + missing(pose, scene);
}

}  // namespace occ::internal::locate
