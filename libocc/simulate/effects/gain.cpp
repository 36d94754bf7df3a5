// SPDX-License-Identifier: Apache-2.0
// Gain non-uniformity (PRNU): a pixel's photoelectrons times 1 + p z, z a normal variable of the
// pixel, the same in every image of a sensor. Left out, a pixel changes by p |z|, and |z| < 6.4
// (internal/normal_variate.hpp). A centroid moves by the sum of p z w (x - x_c), w the shares of
// light: a standard deviation of p / (2 sqrt(pi)) for a disc of any size, p / sqrt(8 pi) for a
// Gaussian spot. The bound is five of them, of the disc.
#include "libocc/simulate/internal/gain.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/noise_key.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.sensor.gain_sigma > 0; }

Bound bound(const SceneView& view) {
  constexpr double root_of_pi = 1.7724538509055159, deviations = 5;
  const double p = view.scene.sensor.gain_sigma;
  const double share = max_deviations * p / (1 + max_deviations * p);  // of the brightest
  double sum_e = share * background_electrons(view);
  double elongation = 0;
  for (const LampView& seen : view.lamps) {
    sum_e += share * seen.peak_e;
    // Of an ellipse of area pi a b the deviation along a is sqrt(a / b) times that of a disc.
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

}  // namespace

void apply_gain(const Frame& frame, Signal& signal) {
  constexpr std::uint32_t pixels_a_block = 4;
  RowWords<pixels_a_block> words(gain_use);
  const Sensor& sensor = frame.scene.sensor;
  const Simd simd = frame.storage.simd();
  const NoiseKey key{static_cast<std::uint64_t>(sensor.gain_seed), 0};
  signal.take_in_everywhere();
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

const EffectModel gain_model{"sensor.gain_sigma", called_for, bound};

}  // namespace occ::internal::simulate
