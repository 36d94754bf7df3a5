// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/light_errors.hpp"

#include <cstddef>

#include "libocc/refine/internal/predicted_centroid.hpp"
#include "libocc/refine/internal/rim_light.hpp"

namespace occ::internal::refine {
namespace {

/// Semi-minor axis from which on an evenly lit lamp has a rim or is measured as a spot.
constexpr double min_large_px = 5;

/// Share of the distance between the projected centre and the centre of the image, one sigma.
constexpr double unknown_centre = 0.5;

/// The centre of an outline does not depend on the light.
bool is_large_without_rim(const Lamp& lamp, const Blob& blob) {
  return blob.rim.empty() && !blob.patterned && blob.ellipse.semi_minor_px > min_large_px &&
         lamp.shape != LampShape::point && !blob.striped;
}

/// Calls f(lamp, index of the blob) for all valid matches; refine() refuses the others.
template <typename F>
void for_each_match(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                    const Scene& scene, F&& f) {
  for (const Match& match : matches) {
    const auto lamp = static_cast<std::size_t>(match.lamp);
    const auto blob = static_cast<std::size_t>(match.blob);
    if (lamp < scene.lamps.size() && blob < blobs.size()) f(scene.lamps[lamp], blob);
  }
}

}  // namespace

std::optional<std::vector<Blob>> with_errors_of_light(const Rigid3& cam_from_world,
                                                      const std::vector<Match>& matches,
                                                      const std::vector<Blob>& blobs,
                                                      const Scene& scene) {
  struct LightError {
    std::size_t blob;
    Eigen::Matrix2d covariance_px2;
  };
  std::vector<LightError> errors;
  for_each_match(matches, blobs, scene, [&](const Lamp& lamp, std::size_t i) {
    if (!is_large_without_rim(lamp, blobs[i])) return;
    const auto image_px = predicted_centroid_px(lamp, cam_from_world, scene.camera, Rung::centres);
    if (!image_px) return;
    const auto whole_px = perspective_shift_px(lamp, cam_from_world, scene.camera, *image_px);
    if (!whole_px) return;
    const Eigen::Vector2d shift_px = light_shift_px(lamp, blobs[i], cam_from_world, scene);
    const Eigen::Vector2d off_px = unknown_centre * *whole_px;
    errors.push_back({i, shift_px * shift_px.transpose() + off_px * off_px.transpose()});
  });
  if (errors.empty()) return std::nullopt;
  std::vector<Blob> out = blobs;
  for (const LightError& error : errors)
    out[error.blob].covariance_px2 += static_cast<double>(errors.size()) * error.covariance_px2;
  return out;
}

std::optional<std::vector<Blob>> without_light_gradient(const Rigid3& cam_from_world,
                                                        const std::vector<Match>& matches,
                                                        const std::vector<Blob>& blobs,
                                                        const Scene& scene) {
  std::optional<std::vector<Blob>> out;
  for_each_match(matches, blobs, scene, [&](const Lamp& lamp, std::size_t i) {
    const Blob& measured = blobs[i];
    if (!has_over_exposed_rim(measured)) return;
    if (!out) out = blobs;
    // Residuals are measured minus predicted positions, and these contain the shift.
    const Eigen::Vector2d shift_px = light_shift_px(lamp, measured, cam_from_world, scene);
    Blob& moved = (*out)[i];
    moved.centroid_px = measured.centroid_px + shift_px;
    const RimLight light(lamp, measured, cam_from_world, scene);
    for (RimPoint& point : moved.rim) point.px += light.displacement_px(point.px, point.normal);
  });
  return out;
}

void add_pose_error(const Vector6& error, Refined& refined) {
  refined.covariance += error * error.transpose();
  const Vector6 informed = refined.lamp_information * error;
  refined.lamp_information -= informed * informed.transpose() / (1 + error.dot(informed));
}

}  // namespace occ::internal::refine
