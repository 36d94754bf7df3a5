// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/striped_blob.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/ellipse_fit.hpp"

namespace occ::internal::detect {
namespace {

/// From (line, pos) to (x, y).
Eigen::Vector2d to_xy(const Eigen::Vector2d& v, bool columns) {
  return columns ? v : Eigen::Vector2d(v[1], v[0]);
}
Eigen::Matrix2d to_xy(const Eigen::Matrix2d& m, bool columns) {
  Eigen::Matrix2d swapped;
  swapped << m(1, 1), m(1, 0), m(0, 1), m(0, 0);
  return columns ? m : swapped;
}

/// Ellipse, bounding box and whether the image's border cuts it; `spread`: semi-axes squared.
void set_outline(const LinearImage& image, const Eigen::Matrix2d& spread, Blob& blob) {
  blob.ellipse = FittedConic{blob.centroid_px, spread.inverse()}.ellipse();
  const Eigen::Vector2d half = spread.diagonal().cwiseSqrt();
  const Eigen::Vector2d low = blob.centroid_px - half, high = blob.centroid_px + half;
  const int right = image.width() - 1, bottom = image.height() - 1;
  blob.cut_by_border = low.minCoeff() < 0 || high.x() > right || high.y() > bottom;
  blob.x0 = std::clamp(static_cast<int>(std::floor(low.x())), 0, right);
  blob.y0 = std::clamp(static_cast<int>(std::floor(low.y())), 0, bottom);
  blob.x1 = std::clamp(static_cast<int>(std::ceil(high.x())), 0, right);
  blob.y1 = std::clamp(static_cast<int>(std::ceil(high.y())), 0, bottom);
}

}  // namespace

Blob striped_blob(const LinearImage& image, const DetectOptions& options, bool columns,
                  const StripedLamp& lamp, const Component& sum) {
  Blob blob;
  blob.striped = true;
  blob.centroid_px = to_xy(lamp.shape.centre, columns);
  blob.covariance_px2 = to_xy(lamp.shape.covariance, columns);
  if (lamp.blink.cycles_per_line > 0) {
    blob.frequency_hz = lamp.blink.cycles_per_line / options.sensor->row_time_s;
    blob.frequency_sigma_hz = lamp.blink.sigma / options.sensor->row_time_s;
  }
  blob.peak_dn = sum.peak_dn;
  blob.background_dn = sum.background_dn;
  blob.noise_dn = sum.noise_dn;
  blob.saturated = sum.saturated_px > 0;
  blob.flux_dn = lamp.signal;
  blob.area_px = static_cast<int>(std::lround(lamp.lit_px));
  blob.flux_sigma_dn = image.slope(sum.background_dn) * sum.noise_dn * std::sqrt(lamp.lit_px);
  const Eigen::Matrix2d metric = lamp.shape.shape.transpose() * lamp.shape.shape;
  set_outline(image, to_xy(Eigen::Matrix2d(metric.inverse()), columns), blob);
  if (!options.rims || lamp.shape.rim.empty()) return blob;
  for (const StripeRimPoint& p : lamp.shape.rim)
    blob.rim.push_back({to_xy(p.at, columns), to_xy(p.normal, columns), lamp.shape.rim_sigma_px});
  const double shift = lamp.shape.rim_shift_variance_px2;
  blob.rim_covariance_px2 =
      Eigen::Vector3d(lamp.shape.rim_growth_variance_px2, shift, shift).asDiagonal();
  return blob;
}

}  // namespace occ::internal::detect
