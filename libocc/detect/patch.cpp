// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/plane_sums.hpp"

namespace occ::internal::detect {
namespace {

constexpr int skirt_px = 2;                  // around the box, where light of the lamp still falls
constexpr double clip = 3;                   // sigmas, of the ring's pixels about the plane
constexpr double clipped_variance = 0.9733;  // of a unit normal cut at 3 sigmas

std::size_t whole_lanes(std::size_t columns) {
  return (columns + PlaneSums::lanes - 1) / PlaneSums::lanes * PlaneSums::lanes;
}

}  // namespace

void Patch::load(const LinearImage& image, const Component& component, double limit_dn,
                 const Sensor* sensor) {
  x0_ = std::max(0, component.x0 - margin_px);
  y0_ = std::max(0, component.y0 - margin_px);
  width_ = std::min(image.width() - 1, component.x1 + margin_px) - x0_ + 1;
  height_ = std::min(image.height() - 1, component.y1 + margin_px) - y0_ + 1;
  // PlaneSums reads the last row, too, in whole lanes.
  signal_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) +
                 PlaneSums::lanes);
  image.read(x0_, y0_, width_, height_, signal_.data());
  subtract_background(image, component, limit_dn);
  set_noise(image, component, sensor);
  full_scale_signal_ = image.linear_dn(image.full_scale_dn()) - background_dn_;
}

void Patch::subtract_background(const LinearImage& image, const Component& component,
                                double limit_dn) {
  const int left = component.x0 - skirt_px - x0_, right = component.x1 + skirt_px - x0_;
  const int top = component.y0 - skirt_px - y0_, bottom = component.y1 + skirt_px - y0_;
  const double middle_x = 0.5 * (component.x0 + component.x1) - x0_;
  const double middle_y = 0.5 * (component.y0 + component.y1) - y0_;
  // The ring beside the box, and above and below it: 1 in the columns that belong to it.
  const auto columns = static_cast<std::size_t>(width_);
  std::vector<float> everywhere(whole_lanes(columns), 0.0f);
  std::fill_n(everywhere.begin(), columns, 1.0f);
  std::vector<float> beside = everywhere;
  std::fill(beside.begin() + std::max(0, left), beside.begin() + std::min(width_, right + 1), 0.0f);
  // The plane through the ring's pixels that lie between two heights over another plane.
  const auto fit = [&](const Plane& plane, double low, double high, int row_step) {
    PlaneSums sums(plane, low, high);
    const auto add = [&](int y0, int y1, const std::vector<float>& counts) {
      if (y1 < y0) return;
      sums.add_rows(signal_.data() + static_cast<std::ptrdiff_t>(y0) * width_, row_step * width_,
                    (y1 - y0) / row_step + 1, -middle_x, y0 - middle_y, row_step, counts);
    };
    add(0, top - 1, everywhere);
    add(std::max(0, top), std::min(bottom, height_ - 1), beside);
    add(bottom + 1, height_ - 1, everywhere);
    return sums.fit();
  };
  Plane plane;
  plane.at = image.linear_dn(component.background_dn);
  plane.variance = plane.at_variance =
      square(component.noise_dn * image.slope(component.background_dn));
  const std::optional<Plane> dim = fit(plane, -std::numeric_limits<double>::infinity(),
                                       limit_dn - plane.at, height_ < 16 ? 1 : 3);
  if (dim) {
    plane = *dim;
    // A second look without what is not background: dim neighbours, hot pixels.
    const double reach = clip * std::sqrt(std::max(plane.variance, 1.0 / 12));
    if (const std::optional<Plane> clean = fit(plane, -reach, reach, 1)) {
      plane = *clean;
      plane.variance /= clipped_variance;
    }
  }
  background_dn_ = plane.at;
  background_sigma_dn_ = std::sqrt(plane.at_variance);
  ring_variance_ = plane.variance;
  const float slope = static_cast<float>(plane.right);
  for (int y = 0; y < height_; ++y) {
    float* row = signal_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float start = static_cast<float>(plane(-middle_x, y - middle_y));
    for (int x = 0; x < width_; ++x) row[x] -= start + slope * static_cast<float>(x);
  }
}

void Patch::set_noise(const LinearImage& image, const Component& component, const Sensor* sensor) {
  const auto quantisation = [&](double stored_dn) {
    const double slope = image.slope(stored_dn);
    return slope * slope / 12;
  };
  const double dark = quantisation(component.background_dn);
  noise_ = {std::max(ring_variance_, dark), 0, false};
  if (!sensor) return;
  const double gain = sensor->gain_dn_per_e;
  const double read = gain * sensor->read_noise_e;
  const double below = std::max(0.0, background_dn_) * gain;  // shot noise of the background
  noise_.floor = std::max(ring_variance_, read * read + below + dark);
  const double signal = image.linear_dn(component.peak_dn) - background_dn_;
  const double bright = quantisation(component.peak_dn);
  noise_.per_dn = gain + (signal > 0 ? std::max(0.0, bright - dark) / signal : 0);
  noise_.known = true;
}

}  // namespace occ::internal::detect
