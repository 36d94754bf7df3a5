// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lamp_image.hpp"

#include <utility>

#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"

namespace occ {
namespace {

Patch extended_image(const Contour& contour, const Lamp& lamp, const Rigid3& cam_from_world,
                     const Camera& camera, const Sensor& sensor, const PixelPsf& psf) {
  CoverageMoments cover = coverage_moments(contour, psf, camera.width(), camera.height());
  Patch image = std::move(cover.c);
  if (image.width == 0) return image;
  // One pixel more on every side, for the derivatives of E.
  const Patch light =
      irradiance_field(lamp, cam_from_world, camera, sensor, image.x0 - 1, image.y0 - 1,
                       image.x0 + image.width + 1, image.y0 + image.height + 1);
  const double electrons = sensor.electrons(1) - sensor.electrons(0);  // per W/m^2
  const double half_variance = 0.5 * (psf.sigma_px() * psf.sigma_px() + 1.0 / 12);
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
  return image;
}

Patch point_image(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  const Sensor& sensor, const Eigen::Vector2d& px, const PixelPsf& psf) {
  Patch image = point_coverage(px, psf, camera.width(), camera.height());
  const double electrons = lamp_electrons(lamp, cam_from_world, camera, sensor);
  for (double& value : image.values) value *= electrons;
  return image;
}

}  // namespace

std::optional<Patch> lamp_image(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, const Sensor& sensor, const PixelPsf& psf,
                                double spacing_px) {
  if (lamp.shape == LampShape::point) {
    const auto px = camera.project(cam_from_world * lamp.centre_m);
    const double lit_side = (cam_from_world.origin_in_source() - lamp.centre_m).dot(lamp.normal);
    if (!px || !(lit_side > 0)) return std::nullopt;
    return point_image(lamp, cam_from_world, camera, sensor, *px, psf);
  }
  const auto contour = project_contour(lamp, cam_from_world, camera, spacing_px);
  if (!contour) return std::nullopt;
  return extended_image(*contour, lamp, cam_from_world, camera, sensor, psf);
}

}  // namespace occ
