// SPDX-License-Identifier: Apache-2.0
#include "libocc/position/decode.hpp"

#include <gtest/gtest.h>

#include "libocc/geometry/motion.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "tests/support.hpp"

namespace occ {
namespace {

using test::complaint;

/// What a camera sees that moves steadily from a pose.
struct Sequence {
  std::vector<Image> images;
  std::vector<double> times_s;
  Rigid3 cam_from_world;  ///< of the last frame

  Sequence(const Scene& scene, const Rigid3& pose, int frames, const Vector6& velocity,
           double frame_rate_hz = 30) {
    Renderer renderer(scene);
    for (int f = 0; f < frames; ++f) {
      Rendered rendered;
      SimulateOptions options;
      options.frame = static_cast<std::uint32_t>(f);
      options.start_s = f / frame_rate_hz;
      options.velocity = velocity;
      cam_from_world = moved_pose(pose, velocity, options.start_s);
      renderer.render(cam_from_world, options, rendered);
      images.push_back(std::move(rendered.image));
      times_s.push_back(options.start_s);
    }
  }

  std::vector<SequenceFrame> frames() const {
    std::vector<SequenceFrame> frames;
    for (std::size_t f = 0; f < images.size(); ++f)
      frames.push_back({images[f].view(), times_s[f]});
    return frames;
  }
};

Rigid3 looking_up(const Eigen::Vector3d& position, double heading_rad) {
  const Eigen::Matrix3d rotation =
      so3_exp(Eigen::Vector3d(0.05, -0.08, 0)) * so3_exp(Eigen::Vector3d(0, 0, heading_rad));
  return {rotation, -(rotation * position)};
}

std::string described(const std::vector<DecodedLamp>& lamps) {
  std::string text;
  for (const DecodedLamp& lamp : lamps)
    text += std::string(to_string(lamp.code.status)) + " " + lamp.code.message + " id " +
            (lamp.code.id ? std::to_string(*lamp.code.id) : "none") + " at " +
            std::to_string(lamp.blob.centroid_px.x()) + ", " +
            std::to_string(lamp.blob.centroid_px.y()) + " seen " + std::to_string(lamp.track.seen) +
            "\n";
  return text;
}

/// All lamps of the scene named, and the pose that follows from the names near the truth.
void expect_located(const Scene& scene, const Sequence& seen, const DecodeOptions& options,
                    double within_m) {
  const auto decoded = decode_lamps(seen.frames(), scene.sensor, options);
  const auto blobs = named_blobs(*decoded, scene, options.code);
  std::vector<Match> matches;
  for (int lamp = 0; lamp < static_cast<int>(scene.lamps.size()); ++lamp)
    for (int blob = 0; blob < static_cast<int>(blobs->size()); ++blob)
      if ((*blobs)[static_cast<std::size_t>(blob)].lamp_id ==
          scene.lamps[static_cast<std::size_t>(lamp)].id)
        matches.push_back({lamp, blob});
  ASSERT_EQ(matches.size(), scene.lamps.size()) << described(*decoded) << blobs.message;
  const auto refined = refine(seen.cam_from_world, matches, *blobs, scene);
  const Eigen::Vector3d error =
      refined->cam_from_world.origin_in_source() - seen.cam_from_world.origin_in_source();
  EXPECT_LT(error.norm(), within_m);
}

TEST(DecodeLamps, FourLampsByUfsookAtThirtyFrames) {
  const Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/ufsook_four.yaml");
  DecodeOptions options;
  options.code.kind = CodeKind::ufsook;
  options.join_frames = 0;
  const Sequence seen(scene, looking_up({1.8, 2.1, 0.3}, 0.7), 40, Vector6::Zero());
  expect_located(scene, seen, options, 0.01);
}

}  // namespace
}  // namespace occ
