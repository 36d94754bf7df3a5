// SPDX-License-Identifier: Apache-2.0
// locate_by_tags with lamps: the centroid of a lamp is the centre of its image, which is not the
// projection of its centre.
#include "libocc/locate/tags.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>

#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

std::map<int, Blob> by_id(const Scene& scene, const std::vector<Blob>& blobs) {
  std::map<int, Blob> lamps;
  for (std::size_t i = 0; i < blobs.size(); ++i) lamps[scene.lamps[i].id] = blobs[i];
  return lamps;
}

double nees(const Fix& fix, const Rigid3& truth) {
  const Vector6 off = difference(truth, fix.cam_from_world);
  return test::nees(off, fix.covariance);
}

double mean_nees(const Scene& scene, int count) {
  test::Measurement measurement;
  Random random(3);
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const Rigid3 pose = test::random_room_pose(random);
    const std::vector<Blob> blobs =
        test::noisy(test::exact_blobs(scene, pose, measurement), scene, measurement, random);
    const Result<Fix> fix = locate_by_tags({}, scene, by_id(scene, blobs));
    EXPECT_TRUE(fix.ok()) << i << ' ' << fix.message;
    sum += nees(*fix, pose);
  }
  return sum / count;
}

Scene with_radius(double radius_m) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.radius_m = radius_m;
  return scene;
}

TEST(LocateByTags, CentroidsOfLampsAreTheCentresOfTheirImages) {
  constexpr int count = 200;
  const auto [low, high] = test::chi2_interval(6 * count, 3.3);
  for (const double radius_m : {0.02, 0.085, 0.2}) {
    const double mean = mean_nees(with_radius(radius_m), count);
    EXPECT_GT(mean, low / count) << radius_m;
    EXPECT_LT(mean, high / count) << radius_m;
  }
}

TEST(LocateByTags, LargeLampsWithoutNoiseGiveTheExactPose) {
  Scene scene = with_radius(0.2);
  scene.lamps[4].shape = LampShape::rectangle;
  scene.lamps[4].size_m = {0.5, 0.3};
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 pose = test::random_room_pose(random);
    const Result<Fix> fix =
        locate_by_tags({}, scene, by_id(scene, test::exact_blobs(scene, pose, {})));
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_LT(difference(pose, fix->cam_from_world).norm(), 1e-5);
    EXPECT_LT(fix->rms_px, 1e-3);
  }
}

// Three lamps have up to four poses; each is exact for its own offsets.
TEST(LocateByTags, EachOfSeveralPosesHasItsOwnOffsets) {
  Scene scene = with_radius(0.2);
  scene.lamps.resize(3);
  Random random(5);
  int several = 0;
  for (int i = 0; i < 30; ++i) {
    const Rigid3 pose = test::random_room_pose(random);
    const Result<Fix> fix =
        locate_by_tags({}, scene, by_id(scene, test::exact_blobs(scene, pose, {})));
    ASSERT_FALSE(fix->candidates.empty());
    several += fix->candidates.size() > 1;
    EXPECT_EQ(fix.status == Status::ambiguous, fix->candidates.size() > 1) << fix.message;
    double nearest = 1e9;
    for (const Candidate& candidate : fix->candidates) {
      EXPECT_LT(candidate.rms_px, 0.01);
      nearest = std::min(nearest, difference(pose, candidate.cam_from_world).norm());
    }
    EXPECT_LT(nearest, 1e-3) << i;
  }
  EXPECT_GT(several, 5);
}

TEST(LocateByTags, LampsThatTheBorderCutsAreIgnored) {
  const Scene scene = test::irregular_room();
  Random random(6);
  const Rigid3 pose = test::random_room_pose(random);
  std::map<int, Blob> lamps = by_id(scene, test::exact_blobs(scene, pose, {}));
  lamps.at(0).cut_by_border = true;
  lamps.at(0).centroid_px.x() += 5;
  const Result<Fix> fix = locate_by_tags({}, scene, lamps);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(difference(pose, fix->cam_from_world).norm(), 1e-5);
}

}  // namespace
}  // namespace occ
