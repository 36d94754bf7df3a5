// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/track_blobs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;

Blob blob_at(double x, double y) {
  Blob blob;
  blob.centroid_px = {x, y};
  blob.covariance_px2 = 0.01 * Eigen::Matrix2d::Identity();
  return blob;
}

/// Lamps that move along straight lines; visible if is_lit(lamp, frame).
std::vector<FrameBlobs> ways(const std::vector<Eigen::Vector4d>& lamps, int frames, Random& random,
                             const std::function<bool(int, int)>& is_lit) {
  std::vector<FrameBlobs> made;
  for (int f = 0; f < frames; ++f) {
    FrameBlobs& frame = made.emplace_back();
    frame.time_s = f / 30.0;
    for (int lamp = 0; lamp < static_cast<int>(lamps.size()); ++lamp) {
      if (!is_lit(lamp, f)) continue;
      const Eigen::Vector4d& way = lamps[lamp];
      const Eigen::Vector2d at = way.head<2>() + frame.time_s * way.tail<2>();
      const Blob blob = blob_at(at.x() + 0.3 * random.normal(), at.y() + 0.3 * random.normal());
      const auto where = random.below(static_cast<int>(frame.blobs.size()) + 1);
      frame.blobs.insert(frame.blobs.begin() + where, blob);
    }
  }
  return made;
}

TEST(TrackBlobs, FollowsLampsThroughDarkAndMissingFrames) {
  Random random(5);
  const std::vector<Eigen::Vector4d> lamps{
      {100, 100, 60, 20}, {200, 120, 60, 20}, {150, 300, 60, -10}};
  std::vector<FrameBlobs> frames =
      ways(lamps, 60, random, [&](int lamp, int f) { return f < 4 || (f + 3 * lamp) % 7 < 3; });
  frames.erase(frames.begin() + 20, frames.begin() + 32);  // missing
  const std::vector<Track> tracks = track_blobs(frames);
  ASSERT_EQ(tracks.size(), lamps.size());
  for (const Track& track : tracks) {
    ASSERT_EQ(track.points.size(), frames.size());
    double nearest = 1e9;
    for (const Eigen::Vector4d& way : lamps) {
      double worst = 0;
      for (const TrackPoint& p : track.points) {
        const double t = frames[p.frame].time_s;
        worst = std::max(worst, (p.px - way.head<2>() - t * way.tail<2>()).norm());
      }
      nearest = std::min(nearest, worst);
    }
    EXPECT_LT(nearest, 4) << "one lamp in all frames, also in the dark ones";
  }
}

TEST(TrackBlobs, DoesNotSwapLampsThatPassEachOther) {
  Random random(6);
  const std::vector<Eigen::Vector4d> lamps{{100, 100, 120, 0}, {300, 106, -120, 0}};
  const auto frames = ways(lamps, 50, random, [](int, int) { return true; });
  const std::vector<Track> tracks = track_blobs(frames);
  ASSERT_EQ(tracks.size(), 2u);
  for (const Track& track : tracks)
    EXPECT_NEAR(std::abs(track.points.back().px.x() - track.points.front().px.x()), 196, 3);
}

TEST(TrackBlobs, DistantNewLampsStartNewTracks) {
  std::vector<FrameBlobs> frames(3);
  for (int f = 0; f < 3; ++f) frames[f].time_s = f / 30.0;
  frames[0].blobs = {blob_at(10, 10)};
  frames[2].blobs = {blob_at(10.5, 10), blob_at(200, 50)};
  const std::vector<Track> tracks = track_blobs(frames);
  ASSERT_EQ(tracks.size(), 2u);
  EXPECT_EQ(tracks[0].seen, 2);
  EXPECT_FALSE(tracks[0].points[1].blob);
  EXPECT_NEAR(tracks[0].points[1].px.x(), 10.25, 1e-9);
  EXPECT_EQ(tracks[1].seen, 1);
}

TEST(TrackBlobs, NoFramesAndInvalidTimes) {
  EXPECT_TRUE(track_blobs({}).empty());
  EXPECT_TRUE(track_blobs({{0, {}}, {1, {}}}).empty());
  EXPECT_NE(complaint([] {
              track_blobs({{0, {}}, {0.2, {}}, {0.1, {}}});
            }).find("times_s[2] must be after the frame before it, at 0.2, got 0.1"),
            std::string::npos);
  EXPECT_NE(complaint([] {
              track_blobs({{0, {}}, {0, {}}});
            }).find("times_s[1]"),
            std::string::npos);
  EXPECT_NE(complaint([] { track_blobs({{std::nan(""), {}}}); }).find("finite"), std::string::npos);
  TrackOptions options;
  options.gate_sigma = 0;
  EXPECT_NE(complaint([&] { track_blobs({}, options); }).find("gate_sigma"), std::string::npos);
}

}  // namespace
}  // namespace occ
