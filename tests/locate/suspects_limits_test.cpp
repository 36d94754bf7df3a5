// SPDX-License-Identifier: Apache-2.0
// Limits of the reasons that the message of a doubtful fix names: what is usual is not named.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "libocc/locate/internal/suspects.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"

namespace occ::internal::locate {
namespace {

/// Discs before a camera, with blobs of the predicted sizes.
struct Doubtful {
  Scene scene;
  Refined pose;
  std::vector<Blob> blobs;

  explicit Doubtful(int lamps = 6) {
    scene.camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
    for (int i = 0; i < lamps; ++i) {
      Lamp lamp;
      lamp.id = 20 + i;
      lamp.radius_m = 0.1;
      lamp.shape = LampShape::disc;
      lamp.normal = -Eigen::Vector3d::UnitZ();
      lamp.centre_m = {-1.0 + 0.35 * i, i % 2 ? 0.6 : -0.5, 2.5};
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
  std::string text() const { return suspects(pose, blobs, scene); }
  bool mentions(const std::string& word) const { return text().find(word) != std::string::npos; }
  void grow(int lamp, double factor) {
    blobs[lamp].ellipse.semi_minor_px *= factor;
    blobs[lamp].ellipse.semi_major_px *= factor;
  }
};

TEST(SuspectsLimits, AFewSaturatedLampsOrALittleGrowthAreUsual) {
  for (const int saturated : {2, 3, 4}) {
    Doubtful view;
    for (int i = 0; i < saturated; ++i) {
      view.grow(i, 1.5);
      view.blobs[i].saturated = true;
    }
    EXPECT_EQ(view.mentions("over-exposed"), 2 * saturated >= 6) << saturated;
  }
  Doubtful view;
  for (int i = 0; i < 6; ++i) {
    view.grow(i, 1.05);
    view.blobs[i].saturated = true;
  }
  EXPECT_EQ(view.text(), "");
}

TEST(SuspectsLimits, PartsAndStripesHaveNoSize) {
  const auto named = [](auto&& change) {
    Doubtful view;
    for (int i = 0; i < 6; ++i) {
      view.grow(i, 1.5);
      view.blobs[i].saturated = true;
      change(view.scene.lamps[i], view.blobs[i]);
    }
    return view.mentions("over-exposed");
  };
  EXPECT_TRUE(named([](Lamp&, Blob&) {}));
  EXPECT_FALSE(named([](Lamp&, Blob& b) { b.cut_by_border = true; }));
  EXPECT_FALSE(named([](Lamp&, Blob& b) { b.merged = true; }));
  EXPECT_FALSE(named([](Lamp&, Blob& b) { b.striped = true; }));
  EXPECT_FALSE(named([](Lamp&, Blob& b) { b.ellipse.semi_minor_px = 0; }));
  EXPECT_FALSE(named([](Lamp& l, Blob&) { l.shape = LampShape::point; }));
}

TEST(SuspectsLimits, ACommonFactorNeedsThreeLampsThatAgree) {
  for (const int lamps : {2, 3, 6}) {
    Doubtful view(lamps);
    for (int i = 0; i < lamps; ++i) view.grow(i, 0.6);
    EXPECT_EQ(view.mentions("0.6 times as large"), lamps >= 3) << lamps;
  }
  Doubtful view;
  for (int i = 0; i < 6; ++i) view.grow(i, 1.05);
  EXPECT_EQ(view.text(), "");  // within the accuracy of sizes
  view.grow(3, 0.4);
  for (int i = 0; i < 6; ++i) view.grow(i, 1.6);
  EXPECT_FALSE(view.mentions("radius_m"));  // one lamp is smaller: no common factor
}

TEST(SuspectsLimits, SmallResidualsAreUsual) {
  Doubtful view;
  view.pose.rms_px = 0.4;
  EXPECT_EQ(view.text(), "");
  view.pose.rms_px = 3;
  EXPECT_TRUE(view.mentions("3 px off"));
  for (Blob& blob : view.blobs) blob.covariance_px2 = 0.09 * Eigen::Matrix2d::Identity();
  EXPECT_TRUE(view.mentions("3 px off"));  // ten sigmas
  for (Blob& blob : view.blobs) blob.covariance_px2 = Eigen::Matrix2d::Identity();
  EXPECT_EQ(view.text(), "");  // three
}

TEST(SuspectsLimits, LampsThatCannotBeSeenAreNotMissed) {
  const auto missed = [](auto&& change) {
    Doubtful view;
    view.pose.lamps.pop_back();
    change(view);
    return view.mentions("no blob");
  };
  EXPECT_TRUE(missed([](Doubtful&) {}));
  EXPECT_FALSE(missed([](Doubtful& v) { v.scene.lamps[5].normal = Eigen::Vector3d::UnitZ(); }));
  EXPECT_FALSE(missed([](Doubtful& v) { v.scene.lamps[5].centre_m.x() = 5; }));
  EXPECT_FALSE(missed([](Doubtful& v) { v.scene.lamps[5].centre_m.z() = -2.5; }));
  // Its rim is cut by the border, so its blob may have been left out.
  EXPECT_FALSE(missed([](Doubtful& v) { v.scene.lamps[5].centre_m.x() = 1.55; }));
  EXPECT_FALSE(missed([](Doubtful& v) { v.scene.boxes = {{{0.3, 0.2, 1}, {0.6, 0.5, 1.2}}}; }));
}

TEST(SuspectsLimits, CountsMissingLampsAndNamesTheFirst) {
  Doubtful view(6);
  view.pose.lamps.resize(4);
  EXPECT_TRUE(view.mentions("2 lamps should be visible and have no blob (id 24 25)"))
      << view.text();
  view.pose.lamps.clear();
  EXPECT_TRUE(view.mentions("6 lamps should be visible and have no blob (id 20 21 22 23 24 ...)"))
      << view.text();
}

}  // namespace
}  // namespace occ::internal::locate
