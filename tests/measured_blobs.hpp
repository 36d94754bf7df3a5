// SPDX-License-Identifier: Apache-2.0
// Blobs as an ideal detector would measure them, for tests and benchmarks.
#pragma once

#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/pose/match.hpp"
#include "tests/rim_support.hpp"

namespace occ::test {

struct Measurement {
  int rim_points = 0;          ///< per lamp; 0 for centroids only
  double rim_sigma_px = 0.05;  ///< of a rim point along its normal
  double centroid_sigma_px = 0.03;
  double offset_sigma_px = 0;  ///< common to all that is measured of one lamp
  double growth_px = 0;        ///< of the rims, which are then of saturated blobs
};

/// One blob for each lamp, in the scene's order; noise-free when random is null.
inline std::vector<Blob> measured_blobs(const Scene& scene, const Rigid3& cam_from_world,
                                        const Measurement& m, Random* random) {
  const auto noise = [&](double sigma) -> Eigen::Vector2d {
    if (!random) return Eigen::Vector2d::Zero();
    const double x = random->normal();
    return sigma * Eigen::Vector2d(x, random->normal());
  };
  std::vector<Blob> blobs;
  for (const Lamp& lamp : scene.lamps) {
    Blob blob;
    const Eigen::Vector2d offset = noise(m.offset_sigma_px);
    blob.centroid_px = project_lamp_centre(lamp, cam_from_world, scene.camera).value() + offset +
                       noise(m.centroid_sigma_px);
    blob.covariance_px2 = m.centroid_sigma_px * m.centroid_sigma_px * Eigen::Matrix2d::Identity();
    blob.saturated = m.growth_px != 0;
    if (m.rim_points > 0 && lamp.shape != LampShape::point) {
      blob.rim = measured_rim(lamp, cam_from_world, scene.camera, m.rim_points, m.rim_sigma_px,
                              random, m.growth_px);
      for (RimPoint& point : blob.rim) point.px += offset;
    }
    blobs.push_back(blob);
  }
  return blobs;
}

inline std::vector<Match> in_order(const Scene& scene) {
  std::vector<Match> matches;
  for (int i = 0; i < static_cast<int>(scene.lamps.size()); ++i) matches.push_back({i, i});
  return matches;
}

}  // namespace occ::test
