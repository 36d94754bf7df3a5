// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/measure.hpp"

#include <cmath>

namespace occ::detecting {
namespace {

/// Ellipse of uniform brightness that has these second moments.
Ellipse ellipse_of(double x, double y, double xx, double xy, double yy) {
  const double middle = 0.5 * (xx + yy), half = std::hypot(0.5 * (xx - yy), xy);
  Ellipse ellipse;
  ellipse.centre_px = {x, y};
  ellipse.semi_major_px = 2 * std::sqrt(std::max(0.0, middle + half));
  ellipse.semi_minor_px = 2 * std::sqrt(std::max(0.0, middle - half));
  ellipse.angle_rad = half > 0 ? 0.5 * std::atan2(2 * xy, xx - yy) : 0;
  return ellipse;
}

}  // namespace

Blob moments_blob(const Component& component) {
  Blob blob;
  const Moments& grey = component.grey.sum > 0 ? component.grey : component.shape;
  blob.centroid_px = {grey.mean_x(), grey.mean_y()};
  blob.flux_dn = component.grey.sum;
  blob.peak_dn = component.peak_dn;
  blob.background_dn = component.background_dn;
  blob.noise_dn = component.noise_dn;
  blob.area_px = component.area_px;
  blob.x0 = component.x0;
  blob.y0 = component.y0;
  blob.x1 = component.x1;
  blob.y1 = component.y1;
  blob.ellipse = ellipse_of(grey.mean_x(), grey.mean_y(), grey.variance_x(), grey.covariance(),
                            grey.variance_y());
  blob.saturated = component.saturated_px > 0;
  blob.cut_by_border = component.touches_border;
  const double variance = component.noise_dn * component.noise_dn;
  blob.flux_sigma_dn = std::sqrt(variance * component.area_px);
  // Of a centroid of area A under white noise: sigma^2 * (second moment of the area) / flux^2.
  const double scale = variance * component.area_px / (grey.sum * grey.sum);
  const Moments& shape = component.shape;
  blob.covariance_px2 << scale * shape.variance_x(), scale * shape.covariance(),
      scale * shape.covariance(), scale * shape.variance_y();
  blob.covariance_px2.diagonal().array() += 1e-6;
  return blob;
}

Blob measure(const LinearImage&, const Component& component, const DetectOptions&) {
  return moments_blob(component);
}

}  // namespace occ::detecting
