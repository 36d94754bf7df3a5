// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/pixel_psf.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"

namespace occ {
namespace {

constexpr double reach_sigma = 5;      // the tail beyond holds 6e-7 of the light
constexpr double bins_per_sigma = 32;  // the error of cubic interpolation is below 1e-7

// Normal density of standard deviation sigma, and its first, second and third integrals, on a grid.
struct Integrals {
  std::vector<double> density, once, twice, thrice;
};

Integrals gaussian_integrals(double sigma, double first_u, double step_u, std::size_t size) {
  Integrals integrals;
  for (std::size_t i = 0; i < size; ++i) {
    const double u = first_u + static_cast<double>(i) * step_u;
    const double z = u / sigma;
    const double cumulative = normal_probability(z);
    const double density = sigma * std::exp(-0.5 * z * z) * 0.3989422804014327;
    integrals.density.push_back(density / (sigma * sigma));
    integrals.once.push_back(cumulative);
    integrals.twice.push_back(u * cumulative + density);
    integrals.thrice.push_back(0.5 * ((u * u + sigma * sigma) * cumulative + u * density));
  }
  return integrals;
}

void normalise(double* row, std::size_t columns) {
  double sum = 0;
  for (std::size_t k = 0; k < columns; ++k) sum += row[k];
  for (std::size_t k = 0; k < columns; ++k) row[k] /= sum;
}

}  // namespace

PixelPsf::PixelPsf(double psf_sigma_px) : sigma_(psf_sigma_px) {
  require(psf_sigma_px >= 0.01 && psf_sigma_px <= 100, "psf_sigma_px", psf_sigma_px,
          "in [0.01, 100]");
  reach_ = static_cast<int>(reach_sigma * sigma_ + 0.5);
  bins_ = 2 * std::max(4, static_cast<int>(std::ceil(0.5 * bins_per_sigma / sigma_)));

  tabulate();
  float_weights_.assign(weights_.values.begin(), weights_.values.end());
  float_steps_.assign(steps_.values.begin(), steps_.values.end());
}

void PixelPsf::tabulate() {
  // Pixel k (counted from -reach) of bin f is at the distance u = k - f/bins from the light.
  const std::size_t touched = static_cast<std::size_t>(count());
  const int half = bins_ / 2;
  const int first = -reach_ * bins_ - (bins_ + 1) - half;  // grid index of the smallest u needed
  const int last = (reach_ + 1) * bins_ + 1 + half;
  const Integrals at = gaussian_integrals(sigma_, static_cast<double>(first) / bins_, 1.0 / bins_,
                                          static_cast<std::size_t>(last - first + 1));
  const auto rows = static_cast<std::size_t>(bins_ + 3);
  columns_ = (touched + 1 + 7) / 8 * 8;
  for (Table* table : {&weights_, &moment_weights_, &slopes_}) table->used = touched;
  for (Table* table : {&steps_, &moment_steps_}) table->used = touched + 1;
  for (Table* table : {&weights_, &moment_weights_, &slopes_, &steps_, &moment_steps_})
    table->values.resize(rows * columns_);

  for (std::size_t row = 0; row < rows; ++row) {
    double* weight = &weights_.values[row * columns_];
    double* moment = &moment_weights_.values[row * columns_];
    double* slope = &slopes_.values[row * columns_];
    double* step = &steps_.values[row * columns_];
    double* moment_step = &moment_steps_.values[row * columns_];
    double g_before = 0, f_before = 0;
    for (std::size_t k = 0; k < touched; ++k) {
      const int grid = (static_cast<int>(k) - reach_) * bins_ - (static_cast<int>(row) - 1);
      const auto low = static_cast<std::size_t>(grid - half - first);
      const auto high = low + static_cast<std::size_t>(bins_);
      const double u = static_cast<double>(grid) / bins_;
      weight[k] = at.once[high] - at.once[low];
      moment[k] = -u * weight[k];
      slope[k] = at.density[high] - at.density[low];
      const double g = at.twice[high] - at.twice[low];
      const double f = at.thrice[high] - at.thrice[low] - u * g;  // integration by parts
      step[k] = g - g_before;
      moment_step[k] = f - f_before;
      g_before = g;
      f_before = f;
    }
    step[touched] = 1 - g_before;
    moment_step[touched] = -f_before;
    normalise(weight, touched);
  }
}

void PixelPsf::curvatures(double fraction, double* out) const {
  const auto d_density = [&](double u) {
    const double z = u / sigma_;
    return -z * std::exp(-0.5 * z * z) * 0.3989422804014327 / (sigma_ * sigma_);
  };
  double below = d_density(-reach_ - fraction - 0.5);
  for (int k = 0; k < count(); ++k) {
    const double above = d_density(k - reach_ - fraction + 0.5);
    out[k] = above - below;
    below = above;
  }
}

void PixelPsf::interpolate(const Table& table, double fraction, double* out) const {
  const PsfStencil at = psf_stencil(fraction, bins_);
  const double *w = at.weight, *row = &table.values[at.bin * columns_];
  for (std::size_t k = 0; k < table.used; ++k)
    out[k] = w[0] * row[k] + w[1] * row[k + columns_] + w[2] * row[k + 2 * columns_] +
             w[3] * row[k + 3 * columns_];
}

}  // namespace occ
