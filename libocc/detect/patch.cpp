// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/patch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace occ::detecting {
namespace {

constexpr int skirt_px = 2;                  // around the box, where light of the lamp still falls
constexpr int enough_pixels = 24;            // to fit a plane to
constexpr double clip = 3;                   // sigmas, of the ring's pixels about the plane
constexpr double clipped_variance = 0.9733;  // of a unit normal cut at 3 sigmas

double square(double v) { return v * v; }

/// Sums over background pixels; x and y are about the patch's middle.
struct Ring {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, v = 0, xv = 0, yv = 0, vv = 0;

  void add(double px, double py, double value) {
    n += 1;
    x += px;
    y += py;
    xx += px * px;
    xy += px * py;
    yy += py * py;
    v += value;
    xv += px * value;
    yv += py * value;
    vv += value * value;
  }
};

/// value = at + x * right + y * down, with what the fit says of it.
struct Plane {
  double at = 0, right = 0, down = 0;
  double variance = 0;     ///< of the values about it
  double at_variance = 0;  ///< of `at`

  double operator()(double x, double y) const { return at + right * x + down * y; }
};

Plane fit_plane(const Ring& ring) {
  Eigen::Matrix3d normal;
  normal << ring.n, ring.x, ring.y, ring.x, ring.xx, ring.xy, ring.y, ring.xy, ring.yy;
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  const Eigen::Vector3d right(ring.v, ring.xv, ring.yv);
  if (!(solver.rcond() > 1e-9)) {  // all in one row or column
    const double mean = ring.v / ring.n;
    const double variance = std::max(0.0, ring.vv / ring.n - mean * mean);
    return {mean, 0, 0, variance, variance / ring.n};
  }
  const Eigen::Vector3d s = solver.solve(right);
  const double variance = std::max(0.0, ring.vv - s.dot(right)) / (ring.n - 3);
  const Eigen::Vector3d unit = solver.solve(Eigen::Vector3d::UnitX());
  return {s[0], s[1], s[2], variance, unit[0] * variance};
}

}  // namespace

void Patch::load(const LinearImage& image, const Component& component, double limit_dn,
                 const Sensor* sensor) {
  x0_ = std::max(0, component.x0 - margin_px);
  y0_ = std::max(0, component.y0 - margin_px);
  width_ = std::min(image.width() - 1, component.x1 + margin_px) - x0_ + 1;
  height_ = std::min(image.height() - 1, component.y1 + margin_px) - y0_ + 1;
  signal_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    image.read_row(y0_ + y, x0_, width_, signal_.data() + static_cast<std::ptrdiff_t>(y) * width_);
  }
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
  const auto collect = [&](const Plane& plane, double low, double high) {
    Ring ring;
    const auto add = [&](int x, int y) {
      const double value = signal_[static_cast<std::size_t>(y * width_ + x)];
      const double px = x - middle_x, py = y - middle_y;
      const double above = value - plane(px, py);
      if (above >= low && above <= high) ring.add(px, py, value);
    };
    for (int y = 0; y < height_; ++y) {
      const bool beside = y >= top && y <= bottom;
      const int first_end = beside ? std::max(0, left) : width_;
      for (int x = 0; x < first_end; ++x) add(x, y);
      if (!beside) continue;
      for (int x = right + 1; x < width_; ++x) add(x, y);
    }
    return ring;
  };
  Plane plane;
  plane.at = image.linear_dn(component.background_dn);
  plane.variance = plane.at_variance =
      square(component.noise_dn * image.slope(component.background_dn));
  const Ring dim = collect(Plane{}, -std::numeric_limits<double>::infinity(), limit_dn);
  if (dim.n >= enough_pixels) {
    // A second look without what is not background: dim neighbours, hot pixels.
    plane = fit_plane(dim);
    const double reach = clip * std::sqrt(std::max(plane.variance, 1.0 / 12));
    const Ring clean = collect(plane, -reach, reach);
    if (clean.n >= enough_pixels) {
      plane = fit_plane(clean);
      plane.variance /= clipped_variance;
    }
  }
  background_dn_ = plane.at;
  background_sigma_dn_ = std::sqrt(plane.at_variance);
  ring_variance_ = plane.variance;
  for (int y = 0; y < height_; ++y) {
    float* row = signal_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const double start = plane(-middle_x, y - middle_y);
    for (int x = 0; x < width_; ++x) row[x] -= static_cast<float>(start + plane.right * x);
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

}  // namespace occ::detecting
