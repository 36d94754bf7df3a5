// SPDX-License-Identifier: Apache-2.0
// Names of lamps without any code: the right ones in irregular rooms, all of them in symmetric
// ones, and an honest refusal of what cannot be told. Frequencies: see identify_frequency_test.cpp.
#include "libocc/identify/identify.hpp"

#include "identify_support.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::View;

void expect_unique_and_right(const Result<Identification>& found, const View& view) {
  ASSERT_EQ(found.status, Status::ok) << found.message;
  ASSERT_EQ(found->hypotheses.size(), 1u);
  const Hypothesis& h = found->hypotheses.front();
  EXPECT_TRUE(test::names_are_right(h, view));
  EXPECT_TRUE(test::pose_is_near(h.cam_from_world, view.cam_from_world));
  EXPECT_TRUE(std::is_sorted(h.matches.begin(), h.matches.end(),
                             [](const Match& a, const Match& b) { return a.lamp < b.lamp; }));
}

Scene equilateral_room() {
  Scene scene = test::irregular_room();
  scene.lamps = {test::disc_lamp(0, {2.8, 2, 3}),
                 test::disc_lamp(1, {1.6, 2 + 0.8 * std::sqrt(0.75), 3}),
                 test::disc_lamp(2, {1.6, 2 - 0.8 * std::sqrt(0.75), 3})};
  return scene;
}

Scene grid_room() {
  Scene scene = test::irregular_room();
  scene.lamps.clear();
  for (int i = 0; i < 9; ++i)
    scene.lamps.push_back(test::disc_lamp(i, {1.4 + 0.6 * (i % 3), 1.4 + 0.6 * (i / 3), 3}));
  return scene;
}

Rigid3 upright(const Vector3d& position, double yaw_rad, double tilt_rad = 0) {
  const Matrix3d rotation = so3_exp(Vector3d(tilt_rad, 0, 0)) * so3_exp(Vector3d(0, 0, yaw_rad));
  return {rotation, -(rotation * position)};
}

TEST(Identify, NamesAnIrregularRoom) {
  const Scene scene = test::irregular_room();
  Random random(1);
  for (int i = 0; i < 150; ++i) {
    View view = test::random_view(scene, random, 5);
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, NamesRandomRooms) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Scene scene = test::random_room(random, 6, i % 2 == 0 ? 3 : 2.4);
    View view = test::random_view(scene, random, 5, 0.2);
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, NamesThroughADistortedLens) {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 380, 385, 322, 236, {-0.28, 0.09, 5e-4, -3e-4, -0.01});
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    const View view = test::random_view(scene, random, 5);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(Identify, DoesNotMindWhereTheWorldBegins) {
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
    EXPECT_TRUE(test::names_are_right(second->hypotheses[0], view));
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
    test::hide(view, static_cast<int>(inner - view.blobs.begin()));
    const Result<Identification> found = identify(view.blobs, scene);
    expect_unique_and_right(found, view);
    EXPECT_EQ(whole->hypotheses[0].missed, 0);
    EXPECT_EQ(found->hypotheses[0].missed, 1);
    EXPECT_NEAR(found->hypotheses[0].chi2, IdentifyOptions{}.miss_penalty, 1.5);
  }
}

TEST(Identify, FalseLightsStayUnnamed) {
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
    // A merged blob: its box covers the lamp, its centroid is far off.
    const std::size_t k = static_cast<std::size_t>(random.below(6));
    Blob& blob = view.blobs[k];
    blob.merged = true;
    blob.centroid_px += Vector2d(9, -7);
    blob.x0 -= 20;
    blob.x1 += 20;
    const Result<Identification> found = identify(view.blobs, scene);
    expect_unique_and_right(found, view);
    EXPECT_EQ(found->hypotheses[0].missed, 0);
    // Not flagged, it is a light in the wrong place.
    blob.merged = false;
    const Result<Identification> unflagged = identify(view.blobs, scene);
    ASSERT_FALSE(unflagged->hypotheses.empty());
    EXPECT_EQ(unflagged->hypotheses[0].matches.size(), 5u);
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

// The ellipse through most of a rim is as good as a whole lamp.
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

// Sizes of discs rule out most of what places alone allow.
TEST(Identify, ApparentSizesNarrowTheChoice) {
  const Scene scene = test::irregular_room();
  Random random(15);
  IdentifyOptions options;
  options.miss_penalty = 0;  // three of the lamps are lit
  std::size_t without = 0, with = 0;
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 4, 0.1);
    view.blobs.resize(3);
    without += identify(view.blobs, scene, options)->hypotheses.size();
    for (std::size_t k = 0; k < 3; ++k) {
      const Lamp& lamp = scene.lamps[static_cast<std::size_t>(view.lamp[k])];
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

TEST(IdentifySymmetry, SquareHasFourPoses) {
  const Scene scene = test::square_room();
  Random random(20);
  for (int i = 0; i < 50; ++i) {
    const View view = test::random_view(scene, random, 4);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_EQ(found.status, Status::ambiguous);
    EXPECT_FALSE(found.message.empty());
    ASSERT_EQ(found->hypotheses.size(), 4u);
    // The truth, and the truth turned about the square's axis.
    for (int quarter = 0; quarter < 4; ++quarter) {
      const Matrix3d turn = so3_exp(Vector3d(0, 0, quarter * 1.5707963267948966));
      const Vector3d axis(2, 2, 0);
      View turned = view;
      turned.cam_from_world = view.cam_from_world * Rigid3{turn, axis - turn * axis};
      EXPECT_TRUE(test::holds_truth(*found, turned)) << quarter;
    }
  }
}

TEST(IdentifySymmetry, ExactlySymmetricViewsLoseNothing) {
  const Scene scene = test::square_room();
  for (const double x : {2.0, 1.0, 1.5})
    for (const double y : {2.0, 1.0})
      for (const double yaw : {0.0, 0.7853981633974483, 1.5707963267948966, 0.3})
        for (const double tilt : {0.0, 0.1}) {
          Random random(21);
          const View view = test::see(scene, upright({x, y, 0}, yaw, tilt), random, 0);
          if (view.blobs.size() < 4) continue;
          const Result<Identification> found = identify(view.blobs, scene);
          EXPECT_EQ(found->hypotheses.size(), 4u) << x << ' ' << y << ' ' << yaw << ' ' << tilt;
          EXPECT_TRUE(test::holds_truth(*found, view));
        }
}

TEST(IdentifySymmetry, AHeadingPriorBreaksIt) {
  const Scene scene = test::square_room();
  Random random(22);
  for (int i = 0; i < 50; ++i) {
    const View view = test::random_view(scene, random, 4);
    IdentifyOptions options;
    options.prior = Prior{};
    options.prior->heading_rad = heading_rad(view.cam_from_world) + 0.1 * random.normal();
    options.prior->heading_sigma_rad = 20 * 3.14159265 / 180;
    expect_unique_and_right(identify(view.blobs, scene, options), view);
  }
}

TEST(IdentifySymmetry, APositionPriorBreaksItAwayFromTheAxis) {
  const Scene scene = test::square_room();
  Random random(23);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->position_sigma_m = 0.1;
  const View off_axis = test::see(scene, upright({2.35, 1.7, 0.1}, 0.4), random, 0.05);
  options.prior->position_m = Vector3d(2.4, 1.7, 0.1);
  expect_unique_and_right(identify(off_axis.blobs, scene, options), off_axis);
  const View on_axis = test::see(scene, upright({2, 2, 0.1}, 0.4), random, 0.05);
  options.prior->position_m = Vector3d(2, 2, 0.1);
  EXPECT_EQ(identify(on_axis.blobs, scene, options)->hypotheses.size(), 4u);
}

TEST(IdentifySymmetry, GravityDoesNotBreakATurnAboutIt) {
  const Scene scene = test::square_room();
  Random random(24);
  const View view = test::random_view(scene, random, 4);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->gravity_in_cam = view.cam_from_world.rotation * Vector3d(0, 0, -1);
  EXPECT_EQ(identify(view.blobs, scene, options)->hypotheses.size(), 4u);
}

TEST(IdentifySymmetry, APriorThatContradictsTheImageLeavesNoPose) {
  const Scene scene = test::square_room();
  Random random(25);
  const View view = test::random_view(scene, random, 4);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->position_m = Vector3d(40, 2, 0.5);
  options.prior->position_sigma_m = 0.1;
  const Result<Identification> found = identify(view.blobs, scene, options);
  EXPECT_EQ(found.status, Status::no_pose);
  EXPECT_FALSE(found.message.empty());
}

TEST(IdentifySymmetry, ThreeEqualLampsCannotBeTold) {
  const Scene scene = equilateral_room();
  Random random(26);
  for (int i = 0; i < 20; ++i) {
    const View view = test::random_view(scene, random, 3);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_EQ(found.status, Status::ambiguous);
    EXPECT_GE(found->hypotheses.size(), 3u);
    EXPECT_TRUE(test::holds_truth(*found, view));
  }
}

TEST(IdentifySymmetry, ARegularGridHasFourPosesWhenAllIsSeen) {
  const Scene scene = grid_room();
  Random random(27);
  const View view = test::see(scene, upright({2.1, 1.9, 0.2}, 0.3, 0.05), random, 0.05);
  ASSERT_EQ(view.blobs.size(), 9u);
  const Result<Identification> found = identify(view.blobs, scene);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_EQ(found->hypotheses.size(), 4u);
  EXPECT_TRUE(test::holds_truth(*found, view));
}

TEST(IdentifySymmetry, PartOfAGridFitsInMorePlaces) {
  const Scene scene = grid_room();
  Random random(28);
  View view = test::see(scene, upright({2.1, 1.9, 0.2}, 0.3, 0.05), random, 0.05);
  for (int lamp = 8; lamp >= 6; --lamp) test::hide(view, lamp);  // two rows are left
  IdentifyOptions options;
  options.miss_penalty = 0;
  const Result<Identification> found = identify(view.blobs, scene, options);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_GE(found->hypotheses.size(), 8u);
  EXPECT_TRUE(test::holds_truth(*found, view));
}

}  // namespace
}  // namespace occ
