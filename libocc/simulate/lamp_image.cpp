// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lamp_image.hpp"

#include <utility>

#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"
#include "libocc/simulate/internal/occlusion.hpp"

namespace occ {
namespace {

// The narrowest blur that the rim integral takes: none to be seen.
constexpr double no_blur_px = 0.02;

Camera camera_of(const Frame& frame) {
  const Camera& camera = frame.scene.camera;
  if (frame.plan.applies(Effect::distortion)) return camera;
  return Camera::pinhole(camera.width(), camera.height(), camera.fx_px(), camera.fy_px(),
                         camera.cx_px(), camera.cy_px(), {}, camera.skew_px());
}

double blur_px(const Frame& frame) {
  return frame.plan.applies(Effect::psf) ? frame.scene.sensor.psf_sigma_px : no_blur_px;
}

}  // namespace

LampRenderer::LampRenderer(const Frame& frame)
    : frame_(frame),
      camera_(camera_of(frame)),
      psf_(blur_px(frame)),
      spacing_px_(frame.options.spacing_sigma * psf_.sigma_px()) {}

void LampRenderer::apply_light(const Lamp& lamp, const CoverageMoments& cover, Patch& image) const {
  // One pixel more on every side, for the derivatives of E.
  const Sensor& sensor = frame_.scene.sensor;
  const Patch light =
      irradiance_field(lamp, frame_.cam_from_world, camera_, sensor, image.x0 - 1, image.y0 - 1,
                       image.x0 + image.width + 1, image.y0 + image.height + 1);
  const double electrons = sensor.electrons(1) - sensor.electrons(0);  // per W/m^2
  const double half_variance = 0.5 * (psf_.sigma_px() * psf_.sigma_px() + 1.0 / 12);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      const double* e = &light.values[static_cast<std::size_t>((y + 1) * light.width + x + 1)];
      const double left = e[-1], right = e[1], up = e[-light.width], down = e[light.width];
      const double blurred = *e + half_variance * (left + right + up + down - 4 * *e);
      image.values[i] =
          electrons * (blurred * image.values[i] + 0.5 * (right - left) * cover.m_x.values[i] +
                       0.5 * (down - up) * cover.m_y.values[i]);
    }
}

Patch LampRenderer::extended_image(const Contour& contour, const Lamp& lamp) const {
  const Sensor& sensor = frame_.scene.sensor;
  if (!frame_.plan.applies(Effect::light_gradient)) {
    Patch image = coverage(contour, psf_, camera_.width(), camera_.height());
    const auto centre = camera_.project(frame_.cam_from_world * lamp.centre_m);
    const double e =
        centre ? irradiance_at(lamp, frame_.cam_from_world, camera_, sensor, *centre) : 0;
    const double electrons = sensor.electrons(e) - sensor.electrons(0);
    for (double& value : image.values) value *= electrons;
    return image;
  }
  CoverageMoments cover = coverage_moments(contour, psf_, camera_.width(), camera_.height());
  Patch image = std::move(cover.c);
  if (image.width > 0) apply_light(lamp, cover, image);
  return image;
}

std::optional<Patch> LampRenderer::point_image(const Lamp& lamp, double share) const {
  const Rigid3& pose = frame_.cam_from_world;
  const auto px = camera_.project(pose * lamp.centre_m);
  const double lit_side = (pose.origin_in_source() - lamp.centre_m).dot(lamp.normal);
  if (!px || !(lit_side > 0)) return std::nullopt;
  Patch image = point_coverage(*px, psf_, camera_.width(), camera_.height());
  const double electrons = share * lamp_electrons(lamp, pose, camera_, frame_.scene.sensor);
  for (double& value : image.values) value *= electrons;
  return image;
}

std::optional<Patch> LampRenderer::render(const Lamp& lamp) const {
  Visible visible;
  if (frame_.plan.applies(Effect::occlusion))
    visible = visible_part(lamp, frame_.scene.boxes, frame_.cam_from_world.origin_in_source());
  if (visible.share == 0) return Patch();
  if (lamp.shape == LampShape::point || !frame_.plan.applies(Effect::extent))
    return point_image(lamp, visible.share);
  if (!visible.pieces.empty()) {
    const auto pieces =
        project_pieces(lamp, visible.pieces, frame_.cam_from_world, camera_, spacing_px_);
    if (!pieces) return std::nullopt;
    return extended_image(*pieces, lamp);
  }
  const auto contour = project_contour(lamp, frame_.cam_from_world, camera_, spacing_px_);
  if (!contour) return std::nullopt;
  return extended_image(*contour, lamp);
}

}  // namespace occ
