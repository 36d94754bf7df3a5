// SPDX-License-Identifier: Apache-2.0
// References of brightness and size of the lamps that a tracker expects.
#include "libocc/track/internal/expected_lamps.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/support.hpp"

namespace occ::internal::track {
namespace {

constexpr double gate_sigma = 4, contrast_dn = 100, area_px = 50;

struct View {
  Scene scene;
  std::vector<ExpectedLamp> expected;
  std::vector<Blob> blobs;
};

/// One blob at the expected place of each lamp, of the given ratio of contrast to its reference.
View view_of(const std::vector<double>& ratios) {
  View view;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    view.scene.lamps.push_back(
        test::disc_lamp(static_cast<int>(i), {static_cast<double>(i), 1, 3}));
    ExpectedLamp lamp;
    lamp.lamp = static_cast<int>(i);
    lamp.px = {100.0 * static_cast<double>(i + 1), 200};
    lamp.covariance_px2 = Eigen::Matrix2d::Identity();
    lamp.radius_px = 4;
    lamp.sure = true;
    lamp.before = LampLook{0, contrast_dn, area_px};
    view.expected.push_back(lamp);
    Blob blob;
    blob.centroid_px = lamp.px;
    blob.covariance_px2 = 1e-4 * Eigen::Matrix2d::Identity();
    blob.background_dn = 2;
    blob.peak_dn = 2 + ratios[i] * contrast_dn;
    blob.area_px = 50;
    view.blobs.push_back(blob);
  }
  return view;
}

TEST(AdaptLooks, ScalesByTheMedianRatio) {
  View view = view_of({0.5, 2, 2.1, 1.9, 0.4});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  for (const ExpectedLamp& lamp : view.expected) {
    EXPECT_DOUBLE_EQ(lamp.before->contrast_dn, 1.9 * contrast_dn);
    EXPECT_DOUBLE_EQ(lamp.before->area_px, 1.9 * area_px);
  }
}

TEST(AdaptLooks, AreasDoNotShrinkInADarkerImage) {
  View view = view_of({0.5, 0.5, 0.5});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, 0.5 * contrast_dn);
  EXPECT_DOUBLE_EQ(view.expected[0].before->area_px, area_px);
}

TEST(AdaptLooks, TwoLampsAreTooFew) {
  View view = view_of({0.5, 0.5});
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, contrast_dn);
}

TEST(AdaptLooks, BlinkingLampsHaveNoReference) {
  View view = view_of({0.5, 0.5, 0.5, 0.1});
  view.scene.lamps[3].frequency_hz = 1000;
  adapt_looks(view.expected, view.blobs, view.scene, gate_sigma);
  EXPECT_FALSE(view.expected[3].before.has_value());
  EXPECT_DOUBLE_EQ(view.expected[0].before->contrast_dn, 0.5 * contrast_dn);
}

}  // namespace
}  // namespace occ::internal::track
