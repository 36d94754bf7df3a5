// SPDX-License-Identifier: Apache-2.0
// Models the sensor: from the mean signal electrons of each pixel to the image. Tables depend on
// the sensor and on the light that all pixels receive; they are computed when first needed and kept
// from image to image.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "libocc/simulate/internal/digitiser.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/pixel_noise.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// A part of a row of pixels, with the signal in addition to the light of all pixels.
struct RowPart {
  int x0, y, count;
  std::uint32_t rows;    ///< rows with the same columns that follow, this one included
  std::uint32_t first;   ///< index of the first pixel, counted row by row
  const double* signal;  ///< electrons of each pixel
};

/// Converts rows of mean electrons to grey levels, with and without noise. For one thread at a
/// time.
class SensorRows {
 public:
  /// Properties of an image, beside its scene, that the tables depend on.
  struct Key {
    bool mosaic, response, saturation, noise;
    ByPlace everywhere;  ///< signal electrons that all pixels receive

    bool operator==(const Key& other) const;
  };
  static Key key_of(const Frame& frame, const Signal& signal);

  SensorRows(Simd simd, const Frame& frame, const Key& key);

  const Key& key() const { return key_; }

  /// Grey level of a pixel without signal and noise, by its place in the mosaic.
  std::array<int, 4> background_dn() const;

  // Grey levels of a part of a row. The reference is valid until the next call.

  const std::vector<std::uint16_t>& without_noise(const RowPart& part);
  /// With noise, for pixels without signal.
  const std::vector<std::uint16_t>& dark(const NoiseKey& noise, const RowPart& part);
  /// With noise, for pixels with signal.
  const std::vector<std::uint16_t>& lit(const NoiseKey& noise, const RowPart& part);

 private:
  /// Pixels with the same response and the same mean without signal.
  struct Kind {
    std::size_t colour;  // index of the response curve
    double base_e;       // mean electrons without signal
    Digitiser digitiser;
    std::optional<DarkNoise> dark;
  };

  const Kind& kind(int x, int y) const { return *kinds_[place_of(x, y)]; }
  template <typename Levels>
  const std::vector<std::uint16_t>& for_kinds(const RowPart& part, Levels levels_of);

  NoisyPixels pixels_of(const RowPart& part) const {
    return {part.first, static_cast<std::uint32_t>(part.count), width_, part.rows};
  }
  void draw_lit(const NoiseKey& noise, const RowPart& part);

  Simd simd_;
  Key key_;
  double full_well_e_;
  std::uint32_t width_;
  LitNoise lit_noise_;
  std::array<std::shared_ptr<const Kind>, 4> kinds_;  // by place in the mosaic
  RowWords<DarkNoise::pixels_per_block> dark_words_{dark_use};
  RowWords<LitNoise::pixels_per_block> lit_words_{lit_use};
  std::vector<float> mean_e_, drawn_e_;
  std::vector<std::uint16_t> levels_, others_;
};

class Exposure {
 public:
  explicit Exposure(Simd simd) : simd_(simd) {}

  /// Writes the image, its lit rectangles and its background into `out`. If `out` holds the image
  /// of an earlier call, only the pixels that may change are written.
  void expose(const Signal& signal, const Frame& frame, Rendered& out);

 private:
  Simd simd_;
  std::optional<SensorRows> rows_;
};

}  // namespace occ::internal::simulate
