// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/blur.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/lens_blur.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {
constexpr double root_e = 1.6487212707001282;
}  // namespace

double blur_sigma_px(const SceneView& view) {
  return view.scene.effects.of(Effect::psf) == Use::off ? 0 : gaussian_blur_px(view.scene);
}

double blur_radius_px(const LampView& seen, const SceneView& view) {
  if (view.scene.effects.of(Effect::psf) == Use::off) return 0;
  return defocus_radius_px(view.scene,
                           view.scene.camera.depth_m(view.cam_from_world * seen.lamp->centre_m));
}

double blur_width_px(const LampView& seen, const SceneView& view) {
  return std::hypot(blur_sigma_px(view), 0.5 * blur_radius_px(seen, view));
}

bool is_point(const LampView& seen, const SceneView& view) {
  return seen.rim_px.empty() || view.scene.effects.of(Effect::extent) == Use::off;
}

double sampling_shift_px(const LampView& seen, double sigma_px, bool as_point) {
  if (as_point && !(sigma_px > 0)) return std::sqrt(0.5);  // the sum converges slowly
  constexpr int terms = 100;
  Eigen::Array2d low = Eigen::Array2d::Zero(), high = low;
  if (!as_point)
    for (const Eigen::Vector2d& px : seen.rim_px) {
      low = low.min((px - seen.rim_px.front()).array());
      high = high.max((px - seen.rim_px.front()).array());
    }
  double squares = 0;
  for (const double width : {high.x() - low.x(), high.y() - low.y()}) {
    double sum = 0;
    for (int k = 1; k <= terms; ++k) {
      const double spectrum = std::min(1.0, 2 / (pi * k * width));
      sum += spectrum * std::exp(-2 * std::pow(pi * k * sigma_px, 2)) / (pi * k);
    }
    squares += std::pow(std::min(0.5, sum), 2);
  }
  return std::sqrt(squares);
}

double sampling_shift_px(const LampView& seen, const SceneView& view) {
  return sampling_shift_px(seen, blur_sigma_px(view), is_point(seen, view));
}

double change_by_shift_e(const LampView& seen, const SceneView& view, double moved_px) {
  if (!(moved_px > 0)) return 0;
  const double sigma = blur_sigma_px(view);
  const double of_point =
      seen.electrons * std::min(1.0, moved_px / (2 * pi * root_e * std::pow(sigma, 3)));
  if (is_point(seen, view)) return of_point;
  const double slope = std::min(std::sqrt(2.0), 1 / (std::sqrt(2 * pi) * sigma));
  return std::min(of_point, seen.full_e * std::min(1.0, slope * moved_px));
}

double change_by_spread_e(const LampView& seen, const SceneView& view, double length_px) {
  if (!(length_px > 0)) return 0;
  const double sigma = blur_sigma_px(view);
  const double spread = length_px * length_px / 24;
  const double of_point = seen.electrons * std::min(1.0, spread / (2 * pi * std::pow(sigma, 4)));
  if (is_point(seen, view)) return of_point;
  const double bend = 2 / (std::sqrt(2 * pi) * root_e * sigma * sigma);
  const double swept = std::sqrt(2.0) * length_px / 4;
  return std::min(of_point, seen.full_e * std::min({1.0, swept, bend * spread}));
}

}  // namespace occ::internal::simulate
