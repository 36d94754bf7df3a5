// SPDX-License-Identifier: Apache-2.0
// Evidence of fluxes: equal ones are no evidence, contradicting ones are evidence against a pose.
#include "libocc/refine/internal/light_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace occ::internal::refine {
namespace {

SeenLight light(double log_ratio, bool at_least = false) {
  return {0, FluxRatio{log_ratio, 0, 0.5, at_least}};
}

TEST(LightEvidence, EqualFluxesAreNoEvidence) {
  EXPECT_NEAR(log_light_ratio({light(3), light(3), light(3.1)}, {}), 0, 0.05);
  EXPECT_EQ(log_light_ratio({SeenLight{}, SeenLight{}}, {1, 2, 3}), 0);
}

TEST(LightEvidence, AFaintLampAmongBrightOnesCountsAgainstThePose) {
  const double one = log_light_ratio({light(3), light(3), light(3), light(-4)}, {});
  EXPECT_NEAR(one, std::log(0.02), 0.1);  // it may be dirty or half hidden
  EXPECT_NEAR(log_light_ratio({light(3), light(3), light(-4), light(-7)}, {}), 2 * one, 0.1);
}

TEST(LightEvidence, ASaturatedLampMayBeAnyBrighterThanMeasured) {
  EXPECT_NEAR(log_light_ratio({light(3), light(3), light(0, true)}, {}), 0, 1e-9);
  EXPECT_LT(log_light_ratio({light(3), light(3), light(6, true)}, {}), -3);
}

TEST(LightEvidence, BrighterBlobsThatAreNoLampsCountAgainstThePose) {
  const std::vector<SeenLight> lamps(5, light(0));
  EXPECT_EQ(log_light_ratio(lamps, {-1, 0, 0.5}), 0);  // no more than three times as bright
  const double one = log_light_ratio(lamps, {-1, 0, 5});
  const double three = log_light_ratio(lamps, {5, 6, 7});
  EXPECT_LT(one, -1);
  EXPECT_LT(three, one - 1);
  // The rate of bright false lights is open: twenty do not exclude a pose.
  EXPECT_GT(log_light_ratio(lamps, std::vector<double>(20, 5)), -15);
}

TEST(LightEvidence, ABlobWithoutFluxHasNone) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Blob blob;
  blob.centroid_px = {300, 200};
  EXPECT_FALSE(log_flux(blob, scene));
  blob.flux_dn = 100;  // without a sigma it is no measurement
  EXPECT_FALSE(log_flux(blob, scene));
  blob.flux_sigma_dn = 3;
  EXPECT_NEAR(*log_flux(blob, scene), std::log(100), 1e-12);
}

TEST(LightEvidence, FluxRatioFollowsTheLaw) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 500, 500, 319.5, 239.5);
  Lamp lamp;
  lamp.normal = {0, 0, -1};
  lamp.centre_m = {0, 0, 2};
  Blob blob;
  blob.centroid_px = {319.5, 239.5};
  blob.flux_dn = 100;
  blob.flux_sigma_dn = 1;
  const Rigid3 near, far{Eigen::Matrix3d::Identity(), {0, 0, 2}};
  const auto a = flux_ratio(lamp, blob, near, scene), b = flux_ratio(lamp, blob, far, scene);
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(b->log_ratio - a->log_ratio, std::log(4), 1e-12);  // inverse square of the distance
  lamp.normal = {0, 0, 1};
  EXPECT_FALSE(flux_ratio(lamp, blob, near, scene));  // it shines away from the camera
}

}  // namespace
}  // namespace occ::internal::refine
