// SPDX-License-Identifier: Apache-2.0
// Assignment without codes in irregular rooms. Other files in this folder test symmetric rooms,
// frequencies, unusual data and chance.
#include "libocc/identify/identify.hpp"

#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::expect_unique_and_right;
using test::View;

TEST(Identify, AssignsAnIrregularRoom) {
  const Scene scene = test::irregular_room();
  Random random(1);
  for (int i = 0; i < 150; ++i) {
    View view = test::random_view(scene, random, 5);
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, AssignsRandomRooms) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Scene scene = test::random_room(random, 6, i % 2 == 0 ? 3 : 2.4);
    View view = test::random_view(scene, random, 5, 0.2);
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, AssignsThroughADistortedLens) {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 380, 385, 322, 236, {-0.28, 0.09, 5e-4, -3e-4, -0.01});
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    const View view = test::random_view(scene, random, 5);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, IsIndependentOfTheWorldOrigin) {
  Scene scene = test::irregular_room();
  Random random(4);
  const View view = test::random_view(scene, random, 5, 0);
  const Result<Identification> here = identify(view.blobs, scene);
  const Vector3d shift(4e5, -5e6, 120);
  for (Lamp& lamp : scene.lamps) lamp.centre_m += shift;
  const Result<Identification> there = identify(view.blobs, scene);
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_LT((there->hypotheses[0].cam_from_world.origin_in_source() - shift -
             here->hypotheses[0].cam_from_world.origin_in_source())
                .norm(),
            1e-6);
}

TEST(Identify, CoarsePoseIsGoodToTheNoise) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.shape = LampShape::point;
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const View view = test::random_view(scene, random, 5, 0);
    const Result<Identification> found = identify(view.blobs, scene);
    ASSERT_TRUE(found.ok());
    EXPECT_TRUE(
        test::pose_is_near(found->hypotheses[0].cam_from_world, view.cam_from_world, 1e-5, 1e-5));
    EXPECT_LT(found->hypotheses[0].chi2, 1e-6);
  }
}

TEST(Identify, AnswerDoesNotDependOnTheOrderOfBlobsAndLamps) {
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    Scene scene = test::random_room(random, 6);
    View view = test::random_view(scene, random, 5, 0.2);
    const Result<Identification> first = identify(view.blobs, scene);
    std::reverse(scene.lamps.begin(), scene.lamps.end());
    for (int& lamp : view.lamp) lamp = 5 - lamp;
    test::shuffle(view, random);
    const Result<Identification> second = identify(view.blobs, scene);
    ASSERT_EQ(first->hypotheses.size(), second->hypotheses.size());
    EXPECT_TRUE(test::assignment_is_right(second->hypotheses[0], view));
    EXPECT_TRUE(test::pose_is_near(first->hypotheses[0].cam_from_world,
                                   second->hypotheses[0].cam_from_world, 1e-5, 1e-5));
  }
}

TEST(Identify, LampsOnTheFloorSeenFromAbove) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) {
    lamp.centre_m.z() = 3 - lamp.centre_m.z();
    lamp.normal = Vector3d::UnitZ();
  }
  Random random(7);
  const Rigid3 pose = look_at({2, 2.1, 2.6}, {1.9, 2, 0}, {1, 1, 0});
  const View view = test::see(scene, pose, random, 0.1);
  ASSERT_GE(view.blobs.size(), 5u);
  expect_unique_and_right(identify(view.blobs, scene), view);
}

TEST(Identify, NoPoseThatSeesTheDarkSide) {
  Scene scene = test::irregular_room();
  Random random(8);
  const View view = test::random_view(scene, random, 5);
  for (Lamp& lamp : scene.lamps) lamp.normal = -lamp.normal;
  EXPECT_FALSE(test::holds_truth(*identify(view.blobs, scene), view));
}

TEST(Identify, AHiddenLampIsMissed) {
  const Scene scene = test::irregular_room();
  Random random(9);
  for (int i = 0; i < 40; ++i) {
    View view = test::random_view(scene, random, 6);
    const Result<Identification> whole = identify(view.blobs, scene);
    const auto inner = std::find_if(view.blobs.begin(), view.blobs.end(), [](const Blob& b) {
      return (b.centroid_px - Vector2d(320, 240)).cwiseAbs().maxCoeff() < 190;
    });
    ASSERT_NE(inner, view.blobs.end());
    const std::size_t blob = inner - view.blobs.begin();
    const std::size_t hidden = view.lamp[blob];
    test::hide(view, static_cast<int>(blob));
    const Result<Identification> found = identify(view.blobs, scene);
    expect_unique_and_right(found, view);
    EXPECT_EQ(whole->hypotheses[0].missed, 0);
    EXPECT_EQ(found->hypotheses[0].missed, 1);
    EXPECT_NEAR(found->hypotheses[0].chi2, IdentifyOptions{}.miss_penalty, 1.5);
    Scene with_box = scene;
    const Eigen::Vector3d lamp = scene.lamps[hidden].centre_m;
    with_box.boxes.push_back(
        {lamp - Eigen::Vector3d(0.3, 0.3, 0.3), lamp + Eigen::Vector3d(0.3, 0.3, -0.2)});
    EXPECT_EQ(identify(view.blobs, with_box)->hypotheses[0].missed, 0) << "it is behind a box";
  }
}

TEST(Identify, FalseLightsStayUnmatched) {
  Random random(10);
  for (int i = 0; i < 30; ++i) {
    const Scene scene = i % 2 ? test::irregular_room() : test::random_room(random, 7);
    View view = test::random_view(scene, random, 5, 0.1);
    test::add_false_lights(view, scene, random, 1 + i % 2);
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, BlobsThatAreNotWholeAreAttachedNotUsed) {
  const Scene scene = test::irregular_room();
  Random random(11);
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 6);
    // A merged blob: its box contains the lamp, its centroid is far off.
    const std::size_t k = random.below(6);
    Blob& blob = view.blobs[k];
    blob.merged = true;
    blob.centroid_px += Vector2d(9, -7);
    blob.x0 -= 20;
    blob.x1 += 20;
    const Result<Identification> found = identify(view.blobs, scene);
    expect_unique_and_right(found, view);
    EXPECT_EQ(found->hypotheses[0].missed, 0);
    // Without the flag it counts as a false light.
    blob.merged = false;
    const Result<Identification> unflagged = identify(view.blobs, scene);
    ASSERT_FALSE(unflagged->hypotheses.empty());
    EXPECT_EQ(unflagged->hypotheses[0].matches.size(), 5u);
  }
}

TEST(Identify, ABlobMuchLargerThanALampCoversItAndIsNotTheLamp) {
  const Scene scene = test::irregular_room();
  Random random(13);
  for (int i = 0; i < 10; ++i) {
    View view = test::random_view(scene, random, 6);
    Blob& blob = view.blobs[random.below(6)];
    blob.merged = true;  // with a skylight
    blob.centroid_px += Vector2d(40, -60);
    blob.x0 -= 100;
    blob.x1 += 100;
    blob.y0 -= 100;
    blob.y1 += 100;
    blob.area_px = 200 * 200;
    const Result<Identification> found = identify(view.blobs, scene);
    ASSERT_FALSE(found->hypotheses.empty());
    EXPECT_EQ(found->hypotheses[0].matches.size(), 5u);
    EXPECT_EQ(found->hypotheses[0].missed, 0);
  }
}

TEST(Identify, ALampCutByTheBorderIsAttached) {
  Scene scene = test::irregular_room();
  Random random(12);
  int tried = 0;
  while (tried < 10) {
    View view = test::random_view(scene, random, 5, 0.05);
    const auto px = project_lamp_centre(scene.lamps[0], view.cam_from_world, scene.camera);
    if (std::count(view.lamp.begin(), view.lamp.end(), 0) || !px || px->x() < -8 || px->x() > 4 ||
        px->y() < 20 || px->y() > 460)
      continue;
    ++tried;
    Blob cut = test::spot({3, px->y()}, 0.1, 500);
    cut.cut_by_border = true;
    cut.x0 = 0;
    cut.x1 = 6;
    view.blobs.push_back(cut);
    view.lamp.push_back(0);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

// The ellipse through most of a rim is as accurate as that of a whole lamp.
TEST(Identify, ALampThatIsBarelyCutCounts) {
  const Scene scene = test::irregular_room();
  Random random(14);
  View view = test::random_view(scene, random, 5);
  Blob& blob = view.blobs[1];
  blob.cut_by_border = true;
  blob.ellipse = {blob.centroid_px, 15, 15, 0};
  blob.area_px = 650;
  blob.rim.resize(60);
  view.blobs.resize(3);
  EXPECT_NE(identify(view.blobs, scene).status, Status::too_few_lamps);
  view.blobs[1].area_px = 300;
  EXPECT_EQ(identify(view.blobs, scene).status, Status::too_few_lamps);
}

// Sizes of discs exclude most hypotheses that positions alone permit.
TEST(Identify, ApparentSizesNarrowTheChoice) {
  const Scene scene = test::irregular_room();
  Random random(15);
  IdentifyOptions options;
  options.miss_penalty = 0;  // only three of the lamps are lit
  std::size_t without = 0, with = 0;
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 4, 0.1);
    view.blobs.resize(3);
    without += identify(view.blobs, scene, options)->hypotheses.size();
    for (std::size_t k = 0; k < 3; ++k) {
      const Lamp& lamp = scene.lamps[view.lamp[k]];
      const double distance = (view.cam_from_world * lamp.centre_m).norm();
      const Vector3d ray = *scene.camera.unproject(view.blobs[k].centroid_px);
      const double radius_px = lamp.radius_m / distance * 422.5 / ray.z();
      view.blobs[k].ellipse = {view.blobs[k].centroid_px, radius_px / ray.z(), radius_px,
                               std::atan2(ray.y(), ray.x())};
      view.blobs[k].rim.resize(40);
    }
    const Result<Identification> found = identify(view.blobs, scene, options);
    EXPECT_TRUE(
        std::any_of(found->hypotheses.begin(), found->hypotheses.end(), [&](const Hypothesis& h) {
          return test::pose_is_near(h.cam_from_world, view.cam_from_world, 0.3, 0.2);
        }));
    with += found->hypotheses.size();
  }
  EXPECT_LT(2 * with, without);
}

TEST(Identify, ModelSigmaOpensTheGate) {
  const Scene scene = test::irregular_room();
  Random random(13);
  View view = test::random_view(scene, random, 6, 0);
  for (Blob& blob : view.blobs)
    blob.centroid_px += 6 * Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
  const Result<Identification> tight = identify(view.blobs, scene);
  EXPECT_FALSE(tight.ok() && tight->hypotheses[0].matches.size() == 6);
  IdentifyOptions options;
  options.model_sigma_px = 5;
  expect_unique_and_right(identify(view.blobs, scene, options), view);
}

}  // namespace
}  // namespace occ
