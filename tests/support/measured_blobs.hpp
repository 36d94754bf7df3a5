// SPDX-License-Identifier: Apache-2.0
// Blobs as an ideal detector would measure them, for tests and benchmarks.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/pose/match.hpp"
#include "tests/support/rim_support.hpp"

namespace occ::test {

struct Measurement {
  int rim_points = 0;          ///< per lamp; 0 for centroids only
  double rim_sigma_px = 0.05;  ///< standard deviation of a rim point along its normal
  double centroid_sigma_px = 0.03;
  double offset_sigma_px = 0;        ///< common to all that is measured of one lamp
  double growth_px = 0;              ///< growth of the rims; blobs are saturated if not zero
  double flux_sigma = 0;             ///< relative; of the measurement alone
  double own_growth_sigma_px = 0.3;  ///< variation of the growth from lamp to lamp
  double uneven_sigma_px = 0.05;     ///< error of the centroid of a saturated blob
};

/// Returns one blob without noise for each lamp, in the order of the scene.
inline std::vector<Blob> exact_blobs(const Scene& scene, const Rigid3& cam_from_world,
                                     const Measurement& m) {
  std::vector<Blob> blobs;
  for (const Lamp& lamp : scene.lamps) {
    Blob blob;
    blob.centroid_px = project_lamp_centre(lamp, cam_from_world, scene.camera).value();
    blob.covariance_px2 = m.centroid_sigma_px * m.centroid_sigma_px * Eigen::Matrix2d::Identity();
    blob.flux_dn = scene.sensor.gain_dn_per_e *
                   lamp_electrons(lamp, cam_from_world, scene.camera, scene.sensor);
    blob.flux_sigma_dn = m.flux_sigma * blob.flux_dn;
    blob.saturated = m.growth_px != 0;
    if (m.rim_points > 0 && lamp.shape != LampShape::point) {
      blob.rim =
          exact_rim(lamp, cam_from_world, scene.camera, m.rim_points, m.rim_sigma_px, m.growth_px);
    }
    blobs.push_back(blob);
  }
  return blobs;
}

inline Eigen::Vector2d noise_2d(Random& random, double sigma) {
  const double x = random.normal();
  return sigma * Eigen::Vector2d(x, random.normal());
}

/// Draws the blobs of one image. Powers and offsets are drawn as well; they are common to all
/// images of a room and unknown to the estimator.
inline std::vector<Blob> noisy(std::vector<Blob> blobs, const Scene& scene, const Measurement& m,
                               Random& random) {
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const Eigen::Vector2d offset = noise_2d(random, m.offset_sigma_px);
    const double growth = blobs[i].saturated ? m.own_growth_sigma_px * random.normal() : 0;
    const double uneven = blobs[i].saturated ? m.uneven_sigma_px : 0;
    blobs[i].centroid_px += offset + noise_2d(random, std::hypot(m.centroid_sigma_px, uneven));
    for (RimPoint& point : blobs[i].rim) {
      point.px += offset + (growth + m.rim_sigma_px * random.normal()) * point.normal;
    }
    const double sigma = std::hypot(m.flux_sigma, scene.lamps[i].power_sigma);
    blobs[i].flux_dn *= std::exp(sigma * random.normal());
  }
  return blobs;
}

inline std::vector<Match> in_order(const Scene& scene) {
  std::vector<Match> matches;
  for (int i = 0; i < static_cast<int>(scene.lamps.size()); ++i) matches.push_back({i, i});
  return matches;
}

}  // namespace occ::test
