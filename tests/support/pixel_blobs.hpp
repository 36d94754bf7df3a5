// SPDX-License-Identifier: Apache-2.0
// Simulated frames with their detected blobs and true assignment, for tests and benchmarks of the
// refinement.
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/detect/detect.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::test {

struct Frame {
  Image image;
  Rigid3 cam_from_world;
  std::vector<Blob> blobs;
  std::vector<Match> matches;  ///< lamps that are whole in the image
  bool cut = false;            ///< some lamp is in part outside
};

inline Frame make_frame(const Scene& scene, const Rigid3& cam_from_world, std::uint64_t seed,
                        bool noise = true) {
  SimulateOptions options;
  options.seed = seed;
  options.noise = noise;
  Rendered rendered = simulate(scene, cam_from_world, options);
  DetectOptions detect_options;
  detect_options.sensor = scene.sensor;
  Frame frame{std::move(rendered.image), cam_from_world, {}, {}};
  frame.blobs = detect(frame.image.view(), detect_options);
  for (std::size_t i = 0; i < rendered.lamps.size(); ++i) {
    const LampTruth& lamp = rendered.lamps[i];
    frame.cut = frame.cut || lamp.in_view != lamp.whole;
    if (!lamp.whole) continue;
    for (std::size_t b = 0; b < frame.blobs.size(); ++b)
      if (!frame.blobs[b].cut_by_border &&
          (frame.blobs[b].centroid_px - lamp.image_centre_px).norm() < 3)
        frame.matches.push_back({static_cast<int>(i), static_cast<int>(b)});
  }
  return frame;
}

}  // namespace occ::test
