// SPDX-License-Identifier: Apache-2.0
// Rows of pixels from mean electrons to grey levels, with and without noise, by tables that depend
// on the sensor and on the light that all pixels get.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "libocc/simulate/internal/dark_noise.hpp"
#include "libocc/simulate/internal/digitiser.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/lit_noise.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// Some pixels of a row, and what they get beside the light of all.
struct RowPart {
  int x0, y, count;
  std::uint32_t rows;    ///< that are to come, this one included, with the same columns
  std::uint32_t first;   ///< index of the first pixel, counted row by row
  const double* signal;  ///< electrons of each
};

class SensorRows {
 public:
  /// What the tables depend on, of a given scene.
  struct Key {
    bool mosaic, response, saturation, noise;
    ByPlace everywhere;  ///< signal electrons of all pixels

    bool operator==(const Key& other) const;
  };
  static Key key_of(const Frame& frame, const Signal& signal);

  SensorRows(Simd simd, const Frame& frame, const Key& key);

  const Key& key() const { return key_; }

  /// Of a pixel without signal and noise, by its place in the mosaic.
  std::array<int, 4> background_dn() const;

  // Grey levels of a part of a row. Buffers are the object's: for one thread at a time.

  const std::vector<std::uint16_t>& without_noise(const RowPart& part);
  /// As if there were no signal.
  const std::vector<std::uint16_t>& dark(const NoiseKey& noise, const RowPart& part);
  const std::vector<std::uint16_t>& lit(const NoiseKey& noise, const RowPart& part);

 private:
  /// Pixels that are alike.
  struct Kind {
    std::size_t colour;  // whose curve they have
    double base_e;       // mean electrons without signal
    Digitiser digitiser;
    std::optional<DarkNoise> dark;
  };

  const Kind& kind(int x, int y) const { return *kinds_[place_of(x, y)]; }
  template <typename Levels>
  const std::vector<std::uint16_t>& of_kinds(const RowPart& part, Levels levels_of);

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
  RowWords<DarkNoise::pixels_a_block> dark_words_{dark_use};
  RowWords<LitNoise::pixels_a_block> lit_words_{lit_use};
  std::vector<float> mean_e_, drawn_e_;
  std::vector<std::uint16_t> levels_, others_;
};

}  // namespace occ::internal::simulate
