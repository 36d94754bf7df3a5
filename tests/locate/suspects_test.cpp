// SPDX-License-Identifier: Apache-2.0
// Reasons that the message of a doubtful fix names.
#include "libocc/locate/internal/suspects.hpp"

#include <gtest/gtest.h>

#include "libocc/refine/internal/lamp_sizes.hpp"

namespace occ::internal::locate {
namespace {

struct View {
  Scene scene;
  Refined pose;
  std::vector<Blob> blobs;

  View() {
    scene.camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
    for (int i = 0; i < 5; ++i) {
      Lamp lamp;
      lamp.id = 10 + i;
      lamp.radius_m = 0.1;
      lamp.shape = LampShape::disc;
      lamp.normal = -Eigen::Vector3d::UnitZ();
      lamp.centre_m = {-0.8 + 0.4 * i, i % 2 ? 0.5 : -0.4, 2.5};
      scene.lamps.push_back(lamp);
      Blob blob;
      blob.centroid_px = *scene.camera.project(lamp.centre_m);
      blob.covariance_px2 = 1e-4 * Eigen::Matrix2d::Identity();
      const auto axes_px = *refine::predicted_axes_px(lamp, {}, scene.camera);
      blob.ellipse.semi_minor_px = axes_px[0];
      blob.ellipse.semi_major_px = axes_px[1];
      blobs.push_back(blob);
      LampResidual residual;
      residual.match = {i, i};
      pose.lamps.push_back(residual);
    }
  }
  std::string suspects() const { return locate::suspects(pose, blobs, scene); }
  void grow(double factor, bool saturated) {
    for (Blob& blob : blobs) {
      blob.ellipse.semi_minor_px *= factor;
      blob.ellipse.semi_major_px *= factor;
      blob.saturated = saturated;
    }
  }
};

bool names(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

TEST(Suspects, NothingUnusualIsNotNamed) { EXPECT_EQ(View().suspects(), ""); }

TEST(Suspects, OverExposure) {
  View view;
  view.grow(1.5, true);
  EXPECT_TRUE(names(view.suspects(), "5 of 5 are saturated, 1.5 times")) << view.suspects();
}

TEST(Suspects, ACommonFactorOfTheSizes) {
  View view;
  view.grow(1.4, false);
  EXPECT_TRUE(names(view.suspects(), "1.4 times as large")) << view.suspects();
  EXPECT_TRUE(names(view.suspects(), "radius_m"));
  view.blobs[0].ellipse.semi_major_px *= 3;  // one lamp of another size is no common factor
  EXPECT_FALSE(names(view.suspects(), "radius_m")) << view.suspects();
}

TEST(Suspects, LargeResiduals) {
  View view;
  view.pose.rms_px = 7;
  EXPECT_TRUE(names(view.suspects(), "7 px off: check the map")) << view.suspects();
  for (Blob& blob : view.blobs) blob.covariance_px2 = 4 * Eigen::Matrix2d::Identity();
  EXPECT_EQ(view.suspects(), "");  // as large as the blobs' own errors allow
}

TEST(Suspects, ALampThatWasLeftOutAndOneWithoutABlob) {
  View view;
  view.pose.lamps[1].contradicts = true;
  EXPECT_TRUE(names(view.suspects(), "lamp 11 does not fit")) << view.suspects();
  view.pose.lamps.pop_back();
  EXPECT_TRUE(names(view.suspects(), "no blob (id 14)")) << view.suspects();
  view.scene.lamps[4].normal = Eigen::Vector3d::UnitZ();  // shines upwards
  EXPECT_FALSE(names(view.suspects(), "no blob")) << view.suspects();
}

}  // namespace
}  // namespace occ::internal::locate
