// SPDX-License-Identifier: Apache-2.0
// Gain non-uniformity (PRNU): a pixel has 1 + p z times the photoelectrons, with a normal variable
// z that belongs to the pixel and is the same in every image of a sensor. Without the effect, a
// pixel changes by p |z|, where |z| < 6.4 (internal/normal_variate.hpp).
//
// A centroid moves by the sum of p z w (x - x_c), with w each pixel's fraction of the light. The
// standard deviation of this sum is p / (2 sqrt(pi)) for a disc of any size and p / sqrt(8 pi) for
// a Gaussian spot. The bound is five standard deviations of the disc.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/noise_key.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"

namespace occ::internal::simulate {
namespace gain_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.sensor.gain_sigma > 0; }

Bound bound(const SceneView& view) {
  constexpr double root_of_pi = 1.7724538509055159, deviations = 5;
  const double p = view.scene.sensor.gain_sigma;
  // As a fraction of the brightest pixel, whose factor LampView::peak_e already includes.
  const double fraction = max_normal_variate * p / (1 + max_normal_variate * p);
  double sum_e = fraction * background_electrons(view);
  double elongation = 0;
  for (const LampView& seen : view.lamps) {
    sum_e += fraction * seen.peak_e;
    // For an ellipse of area pi a b, the deviation along a is sqrt(a / b) times that of a disc.
    double shortest = seen.radius_px;
    for (const Eigen::Vector2d& px : seen.rim_px)
      shortest = std::min(shortest, (px - seen.image_centre_px).norm());
    const double blur = view.scene.sensor.psf_sigma_px + 0.3;
    elongation = std::max(elongation, std::sqrt((seen.radius_px + blur) / (shortest + blur)));
  }
  return {view.grey_levels(sum_e), deviations * elongation * p / (2 * root_of_pi)};
}

template <Simd>
LIBOCC_INLINE void multiply_body(double p, const std::uint32_t* words, int count, double* values) {
  for (int i = 0; i < count; ++i) {
    const double factor = 1 + p * static_cast<double>(normal_variate(words[i]));
    values[i] *= factor > 0 ? factor : 0;
  }
}
LIBOCC_MULTIVERSION(multiply, (double p, const std::uint32_t* words, int count, double* values),
                    (p, words, count, values))

void render(const Frame& frame, const ByPlace&, Signal& signal) {
  constexpr std::uint32_t pixels_per_block = 4;
  RowWords<pixels_per_block> words(gain_use);
  const Sensor& sensor = frame.scene.sensor;
  const Simd simd = frame.storage.simd();
  const NoiseKey key{static_cast<std::uint64_t>(sensor.gain_seed), 0};
  signal.move_everywhere_to_rows();
  signal.for_touched([&](int x0, int y, int count) {
    const auto width = static_cast<std::uint32_t>(signal.width());
    const std::uint32_t first =
        static_cast<std::uint32_t>(y) * width + static_cast<std::uint32_t>(x0);
    const auto rows = static_cast<std::uint32_t>(signal.height() - y);
    const RandomWords random =
        words.of(simd, key, {first, static_cast<std::uint32_t>(count), width, rows});
    multiply_for(simd)(sensor.gain_sigma, random.words + random.skip, count, signal.row(y) + x0);
  });
}

}  // namespace
}  // namespace gain_effect

const EffectModel gain_model = [] {
  EffectModel model{Effect::gain, Stage::charge, gain_effect::called_for, "sensor.gain_sigma is 0",
                    gain_effect::bound};
  model.render = gain_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
