// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/background.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

constexpr int samples = 16;     // samples per mesh
constexpr int mesh_across = 8;  // minimum number of meshes along the image's shorter side
// Expectations for 16 sorted normal samples, in sigmas: mean of ranks 3 to 9, and median minus rank
// 2. Both use mainly the lower half, because pixels that are not background are brighter.
constexpr float level_bias = -0.247f;
constexpr float lower_spread = 0.990f;
// Expectation of rank 11 of 16 sorted absolute differences between neighbours, in sigmas, for
// normal samples that are clipped at their mean.
constexpr float clipped_difference = 0.70f;

using Samples = std::array<std::vector<float>, samples>;  // one lane per mesh

/// Meshes are whole multiples of 64 pixels, the width in which thresholds are applied.
int mesh_size(int width, int height) {
  const int step = 64 * mesh_across;
  return 64 * std::max(1, (std::min(width, height) + step - 1) / step);
}

void order(float& a, float& b) {
  const float low = b < a ? b : a;
  b = b < a ? a : b;
  a = low;
}

/// Sorts all lanes at once by Batcher's odd-even merge sort, which has no branches and vectorises.
void sort_lanes(Samples& rows, std::size_t lanes) {
  for (int p = 1; p < samples; p *= 2) {
    for (int k = p; k >= 1; k /= 2) {
      for (int j = k % p; j + k < samples; j += 2 * k) {
        for (int i = j; i < std::min(j + k, samples - k); ++i) {
          if (i / (2 * p) != (i + k) / (2 * p)) continue;
          float* a = rows[i].data();
          float* b = rows[i + k].data();
          for (std::size_t lane = 0; lane < lanes; ++lane) order(a[lane], b[lane]);
        }
      }
    }
  }
}

float median_of_5(float a, float b, float c, float d, float e) {
  order(a, b);
  order(c, d);
  order(a, c);  // a is the smallest of four: not the median
  order(b, d);  // d is the largest of four: not the median
  order(b, c);
  return std::max(b, std::min(c, e));
}

/// Index into a mirrored sequence. The border element is not repeated, so a lamp there counts once.
int mirrored(int i, int count) {
  if (i >= 0 && i < count) return i;
  if (count == 1) return 0;
  const int period = 2 * count - 2;
  i = ((i % period) + period) % period;
  return i < count ? i : period - i;
}

/// Median of 5 along x, then along y.
void median_filter(std::vector<float>& mesh, int columns, int rows) {
  std::vector<float> once(mesh.size());
  const auto pass = [](const std::vector<float>& in, std::vector<float>& out, int lines, int length,
                       int line_step, int step) {
    for (int l = 0; l < lines; ++l) {
      for (int i = 0; i < length; ++i) {
        // In a sequence of three, mirroring would count the middle element three times.
        const bool middle = length == 3 && i == 1;
        const auto value = [&](int k) {
          const int from = middle ? std::clamp(i + k, 0, 2) : mirrored(i + k, length);
          return in[l * line_step + from * step];
        };
        out[l * line_step + i * step] =
            median_of_5(value(-2), value(-1), value(0), value(1), value(2));
      }
    }
  };
  pass(mesh, once, rows, columns, columns, 1);
  pass(once, mesh, columns, rows, 1, columns);
}

/// Reads the grey levels on a 4 x 4 grid in each mesh, sheared so that no two samples share a row
/// or a column, and the absolute difference of each to the pixel on its left. Samples beyond the
/// image's border are mirrored.
template <typename P>
void sample(const P& pixels, int mesh_px, int columns, int rows, Samples& out,
            Samples& differences) {
  for (int s = 0; s < samples; ++s) {
    const int dy = mesh_px * (4 * (s / 4) + s % 4) / samples + mesh_px / 32;
    const int dx = mesh_px * (4 * (s % 4) + s / 4) / samples + mesh_px / 32;
    float* lane = out[s].data();
    float* difference = differences[s].data();
    for (int row = 0; row < rows; ++row) {
      const typename P::Value* line = pixels.row(mirrored(row * mesh_px + dy, pixels.height()));
      for (int column = 0; column < columns; ++column) {
        const int x = mirrored(column * mesh_px + dx, pixels.width());
        const int left = mirrored(x - 1, pixels.width());
        const auto level = static_cast<float>(P::level(line, x));
        *lane++ = level / static_cast<float>(P::scale);
        *difference++ = std::abs(level - static_cast<float>(P::level(line, left))) /
                        static_cast<float>(P::scale);
      }
    }
  }
}

/// Estimates the noise of meshes whose darker half is clipped at black, where order statistics of
/// the levels fail. The noise is at least that which the differences of neighbouring pixels imply,
/// with their lower quartile over such meshes, because the others contain lamps. Noise of about one
/// grey step is hardly clipped and needs no correction.
void measure_clipped_noise(const Samples& sorted, const Samples& sorted_differences, double step,
                           std::vector<float>& noise) {
  const float black = *std::min_element(sorted[0].begin(), sorted[0].end());
  const auto is_clipped = [&](std::size_t i) { return sorted[2][i] == black; };
  std::vector<float> spreads;
  for (std::size_t i = 0; i < noise.size(); ++i)
    if (is_clipped(i)) spreads.push_back(sorted_differences[11][i]);
  if (spreads.empty() || 2 * spreads.size() < noise.size()) return;  // black is not the background
  const auto quartile = spreads.begin() + static_cast<std::ptrdiff_t>(spreads.size() / 4);
  std::nth_element(spreads.begin(), quartile, spreads.end());
  if (*quartile < 2 * step) return;
  for (std::size_t i = 0; i < noise.size(); ++i)
    if (is_clipped(i)) noise[i] = std::max(noise[i], *quartile / clipped_difference);
}

/// Step between the grey levels that occur in a 16-bit image. It exceeds 1 if pixels of fewer bits
/// were shifted up (12 bits: 16) or 8-bit pixels were scaled to 16 bits (257).
double quantisation_step(const Samples& lanes) {
  constexpr int max_shift = 256, stretched = 257;
  int common = 0;
  for (const std::vector<float>& lane : lanes)
    for (const float level : lane) common = std::gcd(common, static_cast<int>(level - lanes[0][0]));
  if (common == 0) return 1;
  return common % stretched == 0 ? stretched : std::gcd(common, max_shift);
}

/// Number of samples of a mesh that a bright object does not cover, if it covers about half of the
/// mesh or more, so that the order statistics would contain it; 0 otherwise. Its edge is sharp: the
/// gap between two samples is more than half of their range.
int dark_samples(const Samples& sorted, std::size_t mesh, double min_noise_dn) {
  constexpr int min_dark = 3, max_dark = 9;
  constexpr float share = 0.5f, sigmas = 8;
  const float range = sorted[samples - 1][mesh] - sorted[0][mesh];
  for (int dark = min_dark; dark <= max_dark; ++dark) {
    const float gap = sorted[static_cast<std::size_t>(dark)][mesh] -
                      sorted[static_cast<std::size_t>(dark) - 1][mesh];
    if (gap > share * range && gap > sigmas * static_cast<float>(min_noise_dn)) return dark;
  }
  return 0;
}

/// Level and noise of a mesh by its first `dark` samples: their mean, and their range over its
/// expectation for normal samples (Tippett, Biometrika 17, 1925).
void measure_dark_part(const Samples& sorted, std::size_t mesh, int dark, Meshes& meshes) {
  constexpr std::array<float, 10> expected_range = {0,      0,      1.128f, 1.693f, 2.059f,
                                                    2.326f, 2.534f, 2.704f, 2.847f, 2.970f};
  float sum = 0;
  for (int rank = 0; rank < dark; ++rank) sum += sorted[static_cast<std::size_t>(rank)][mesh];
  const auto last = static_cast<std::size_t>(dark) - 1;
  meshes.level[mesh] = sum / static_cast<float>(dark);
  meshes.noise[mesh] = (sorted[last][mesh] - sorted[0][mesh]) / expected_range[last + 1];
}

}  // namespace

Background::Background(const ImageView& image, const Sensor* sensor, double min_noise_dn) {
  Meshes& m = meshes_;
  m.size_px = mesh_size(image.width, image.height);
  m.columns = (image.width + m.size_px - 1) / m.size_px;
  m.rows = (image.height + m.size_px - 1) / m.size_px;
  const std::size_t count = static_cast<std::size_t>(m.columns) * static_cast<std::size_t>(m.rows);
  m.level.resize(count);
  m.noise.resize(count);
  Samples sorted, differences;
  for (Samples* samples : {&sorted, &differences})
    for (auto& lanes : *samples) lanes.resize(count);
  visit_pixels(image, [&](const auto& pixels) {
    sample(pixels, m.size_px, m.columns, m.rows, sorted, differences);
  });
  const double step = image.type == PixelType::u16 ? quantisation_step(sorted) : 1;
  sort_lanes(sorted, count);
  sort_lanes(differences, count);
  for (std::size_t i = 0; i < count; ++i) {
    float sum = 0;
    for (std::size_t rank = 3; rank <= 9; ++rank) sum += sorted[rank][i];
    const float median = 0.5f * (sorted[7][i] + sorted[8][i]);
    m.noise[i] = (median - sorted[2][i]) / lower_spread;
    m.level[i] = sum / 7 - level_bias * m.noise[i];
  }
  measure_clipped_noise(sorted, differences, step, m.noise);
  const double min_noise = std::max(floor_dn * step, min_noise_dn);
  for (std::size_t i = 0; i < count; ++i)
    if (const int dark = dark_samples(sorted, i, min_noise)) measure_dark_part(sorted, i, dark, m);
  fill_bright_regions(image, min_noise, m);
  median_filter(m.level, m.columns, m.rows);
  median_filter(m.noise, m.columns, m.rows);
  for (std::size_t i = 0; i < count; ++i) {
    double floor = min_noise;
    if (sensor && sensor->is_linear()) {
      const double signal_e = (m.level[i] - sensor->black_level_dn) / sensor->gain_dn_per_e;
      floor = std::max(floor, sensor->noise_dn(std::max(0.0, signal_e)));
    }
    m.noise[i] = std::max(m.noise[i], static_cast<float>(floor));
  }
}

namespace {

/// Position of a pixel between the centres of two meshes.
struct Between {
  int low, high;
  double weight;  ///< weight of `high`
};

Between between(double pixel, double meshes_per_px, int count) {
  const double cell = std::clamp((pixel + 0.5) * meshes_per_px - 0.5, 0.0, count - 1.0);
  const int low = static_cast<int>(cell);
  return {low, std::min(low + 1, count - 1), cell - low};
}

}  // namespace

void Background::row(double y, double x, double step, std::vector<Local>& out) const {
  const double meshes_per_px = 1.0 / meshes_.size_px;
  const Between v = between(y, meshes_per_px, meshes_.rows);
  const auto upper = static_cast<std::size_t>(v.low * meshes_.columns);
  const auto lower = static_cast<std::size_t>(v.high * meshes_.columns);
  std::vector<Local> line(static_cast<std::size_t>(meshes_.columns));  // at the meshes' centres
  for (std::size_t c = 0; c < line.size(); ++c) {
    const auto blend = [&](const std::vector<float>& mesh) {
      return (1 - v.weight) * mesh[upper + c] + v.weight * mesh[lower + c];
    };
    line[c] = {blend(meshes_.level), blend(meshes_.noise)};
  }
  for (Local& local : out) {
    const Between u = between(x, meshes_per_px, meshes_.columns);
    const Local& left = line[u.low];
    const Local& right = line[u.high];
    local = {(1 - u.weight) * left.level_dn + u.weight * right.level_dn,
             (1 - u.weight) * left.noise_dn + u.weight * right.noise_dn};
    x += step;
  }
}

}  // namespace occ::internal::detect
