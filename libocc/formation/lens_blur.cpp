// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/lens_blur.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/quadrature.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::formation {

using namespace internal::core;
namespace {

void add_ring(double radius_px, double weight, double offset, int count,
              std::vector<BlurShift>& shifts) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * pi * (i + offset) / count;
    shifts.push_back(
        {radius_px * Eigen::Vector2d(std::cos(angle), std::sin(angle)), weight / count});
  }
}

}  // namespace

double gaussian_blur_px(const Scene& scene) {
  const Sensor& sensor = scene.sensor;
  if (!scene.lens.diffraction) return sensor.psf_sigma_px;
  return std::hypot(sensor.psf_sigma_px,
                    0.42 * sensor.wavelength_m * sensor.f_number / sensor.pixel_pitch_m);
}

double defocus_radius_px(const Scene& scene, double depth_m) {
  const auto& focus = scene.lens.focus_distance_m;
  if (!focus || !(depth_m > 0)) return 0;
  const double aperture_px_m = scene.camera.fx_px() * scene.camera.fy_px() *
                               scene.sensor.pixel_pitch_m / scene.sensor.f_number;
  return 0.5 * aperture_px_m * std::abs(1 / depth_m - 1 / *focus);
}

std::vector<BlurShift> disc_shifts(double radius_px, double sigma_px) {
  if (!(radius_px > 0)) return {{Eigen::Vector2d::Zero(), 1}};
  // The pixel's box smooths as well; 0.06 instead of its variance 1/12, because it is not a
  // Gaussian.
  const double sigmas = radius_px / std::sqrt(sigma_px * sigma_px + 0.06);
  std::vector<BlurShift> shifts;
  if (sigmas < 0.45) {  // one ring with the variance of the disc
    add_ring(radius_px * std::sqrt(0.5), 1, 0, 6, shifts);
    return shifts;
  }
  const int rings = static_cast<int>(std::ceil(1.2 + sigmas));
  double offset = 0;  // neighbouring rings are rotated by half a step
  for (const QuadratureNode& node : gauss_legendre(rings)) {
    const int count = static_cast<int>(std::ceil(4 + 5 * node.at * sigmas));
    add_ring(radius_px * node.at, 2 * node.at * node.weight, offset, count, shifts);
    offset = 0.5 - offset;
  }
  return shifts;
}

}  // namespace occ::internal::formation
