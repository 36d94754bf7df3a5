// SPDX-License-Identifier: Apache-2.0
// Results of identify() for unusual data: repeated blobs, too few lamps, many false lights, options
// out of range.
#include <algorithm>
#include <limits>

#include "libocc/identify/identify.hpp"
#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using test::upright;
using test::View;

TEST(IdentifyData, SameInputSameAnswer) {
  const Scene scene = test::square_room();
  Random random(30);
  const View view = test::random_view(scene, random, 4);
  const Result<Identification> a = identify(view.blobs, scene), b = identify(view.blobs, scene);
  ASSERT_EQ(a->hypotheses.size(), b->hypotheses.size());
  for (std::size_t i = 0; i < a->hypotheses.size(); ++i) {
    EXPECT_EQ(a->hypotheses[i].cam_from_world.matrix(), b->hypotheses[i].cam_from_world.matrix());
    EXPECT_EQ(a->hypotheses[i].chi2, b->hypotheses[i].chi2);
    EXPECT_GE(a->hypotheses[i].chi2, a->hypotheses[i > 0 ? i - 1 : 0].chi2);
  }
}

TEST(IdentifyData, ABlobGivenTwiceIsMatchedOnce) {
  const Scene scene = test::irregular_room();
  Random random(31);
  View view = test::random_view(scene, random, 6);
  view.blobs.push_back(view.blobs[2]);
  const Result<Identification> found = identify(view.blobs, scene);
  ASSERT_EQ(found.status, Status::ok) << found.message;
  EXPECT_EQ(found->hypotheses[0].matches.size(), 6u);
  EXPECT_TRUE(test::holds_truth(*found, view));
}

TEST(IdentifyData, TwoLampsInOnePlaceAreOnePose) {
  Scene scene = test::irregular_room();
  scene.lamps.push_back(test::disc_lamp(6, scene.lamps[1].centre_m));
  Random random(32);
  const View view = test::random_view(test::irregular_room(), random, 6);
  const Result<Identification> found = identify(view.blobs, scene);
  EXPECT_EQ(found.status, Status::ok) << found.message;
  EXPECT_TRUE(test::holds_truth(*found, view));
}

TEST(IdentifyData, TooFewLamps) {
  Scene scene = test::irregular_room();
  Random random(33);
  View view = test::random_view(scene, random, 5);
  const std::vector<Blob> none, two(view.blobs.begin(), view.blobs.begin() + 2);
  EXPECT_EQ(identify(none, scene).status, Status::too_few_lamps);
  EXPECT_EQ(identify(two, scene).status, Status::too_few_lamps);
  std::vector<Blob> cut(view.blobs.begin(), view.blobs.begin() + 3);
  EXPECT_NE(identify(cut, scene).status, Status::too_few_lamps);
  cut[1].cut_by_border = true;
  const Result<Identification> found = identify(cut, scene);
  EXPECT_EQ(found.status, Status::too_few_lamps);
  EXPECT_NE(found.message.find("2 blobs"), std::string::npos) << found.message;
  scene.lamps.resize(2);
  EXPECT_EQ(identify(view.blobs, scene).status, Status::too_few_lamps);
  scene.lamps.clear();
  EXPECT_EQ(identify(view.blobs, scene).status, Status::too_few_lamps);
}

TEST(IdentifyData, LampsOnALineAreDegenerate) {
  Scene scene = test::irregular_room();
  for (std::size_t i = 0; i < scene.lamps.size(); ++i)
    scene.lamps[i].centre_m = Vector3d(1.0 + 0.4 * static_cast<double>(i), 2, 3);
  Random random(34);
  const View view = test::see(scene, upright({2, 1.8, 0.3}, 0.2), random, 0.05);
  ASSERT_GE(view.blobs.size(), 4u);
  EXPECT_EQ(identify(view.blobs, scene).status, Status::degenerate);
}

/// A row of four lamps, the second and the fourth off its line, and others far away.
Scene row_among(std::size_t others, double off_m) {
  const double places[] = {1.0, 1.4, 2.2, 2.9};
  Scene scene = test::irregular_room();
  scene.lamps.resize(4 + others, scene.lamps[0]);
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const auto number = static_cast<double>(i);
    scene.lamps[i].id = static_cast<int>(i);
    scene.lamps[i].centre_m = i < 4 ? Vector3d(places[i], i % 2 ? 2 + off_m : 2, 3)
                                    : Vector3d(30 + 1.3 * number, 3 + number * number, 3);
  }
  return scene;
}

// Gravity determines the rotation about the line of lamps.
TEST(IdentifyData, ARowOfLampsHasAPoseWithGravity) {
  for (const std::size_t others : {0, 2, 5})
    for (const double off_m : {0.0, 0.002}) {
      SCOPED_TRACE(others);
      SCOPED_TRACE(off_m);
      const Scene scene = row_among(others, off_m);
      Random random(39);
      int views = 0;
      for (int i = 0; i < 80; ++i) {
        const View view = test::see(scene, test::random_room_pose(random, 0.5), random, 0.02);
        if (view.blobs.size() < 4) continue;
        ++views;
        const Result<Identification> alone = identify(view.blobs, scene);
        EXPECT_EQ(alone.status, Status::degenerate) << alone.message;
        IdentifyOptions options;
        options.prior = Prior{};
        options.prior->gravity_in_cam = view.cam_from_world.rotation * -Vector3d::UnitZ();
        options.prior->gravity_sigma_rad = 0.005;
        const Result<Identification> found = identify(view.blobs, scene, options);
        EXPECT_TRUE(test::holds_truth(*found, view)) << found.message;
      }
      EXPECT_GT(views, 20);
    }
}

TEST(IdentifyData, ARowThatIsNotStraightHasAPose) {
  for (const std::size_t others : {0, 2, 5}) {
    SCOPED_TRACE(others);
    const Scene scene = row_among(others, 0.03);
    Random random(40);
    int views = 0;
    for (int i = 0; i < 80; ++i) {
      const View view = test::see(scene, test::random_room_pose(random, 0.5), random, 0.02);
      if (view.blobs.size() < 4) continue;
      ++views;
      const Result<Identification> found = identify(view.blobs, scene);
      // A deviation of 3 cm determines the rotation about the row by some degrees only.
      const bool is_there =
          std::any_of(found->hypotheses.begin(), found->hypotheses.end(), [&](const Hypothesis& h) {
            return test::pose_is_near(h.cam_from_world, view.cam_from_world, 0.7, 0.3);
          });
      EXPECT_TRUE(found.status == Status::degenerate || is_there) << found.message;
    }
    EXPECT_GT(views, 20);
  }
}

TEST(IdentifyData, NoPoseWhenOneOfFourLampsIsMisplacedInTheMap) {
  Scene scene = test::square_room();
  Random random(35);
  const View view = test::see(scene, upright({2.1, 1.9, 0.2}, 0.3, 0.05), random, 0.05);
  ASSERT_EQ(view.blobs.size(), 4u);
  scene.lamps[2].centre_m.x() += 0.5;
  const Result<Identification> found = identify(view.blobs, scene);
  EXPECT_EQ(found.status, Status::no_pose);
  EXPECT_TRUE(found->hypotheses.empty());
  EXPECT_NE(found.message.find("4 blobs"), std::string::npos) << found.message;
}

TEST(IdentifyData, ReportsWhenTheSearchWasCutShort) {
  const Scene scene = test::irregular_room();
  Random random(36);
  const View view = test::random_view(scene, random, 6);
  IdentifyOptions options;
  options.max_hypotheses = 10;
  const Result<Identification> found = identify(view.blobs, scene, options);
  EXPECT_EQ(found->tried, 10);
  EXPECT_NE(found.message.find("max_hypotheses = 10"), std::string::npos) << found.message;
  EXPECT_EQ(identify(view.blobs, scene).message, "");
}

TEST(IdentifyData, ManyFalseLightsEndInTime) {
  const Scene scene = test::irregular_room();
  Random random(37);
  View view = test::random_view(scene, random, 5);
  test::add_false_lights(view, scene, random, 500);
  IdentifyOptions options;
  options.max_hypotheses = 20000;
  EXPECT_LE(identify(view.blobs, scene, options)->tried, 20000);
}

TEST(IdentifyData, RefusesBadOptionsAndBlobs) {
  const Scene scene = test::irregular_room();
  Random random(38);
  const View view = test::random_view(scene, random, 5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](auto change) {
    IdentifyOptions options;
    change(options);
    EXPECT_THROW(identify(view.blobs, scene, options), std::invalid_argument);
  };
  refuses([&](IdentifyOptions& o) { o.gate_sigma = 0; });
  refuses([&](IdentifyOptions& o) { o.model_sigma_px = nan; });
  refuses([&](IdentifyOptions& o) { o.frequency_gate_sigma = -1; });
  refuses([&](IdentifyOptions& o) { o.frequency_tolerance = nan; });
  refuses([&](IdentifyOptions& o) { o.miss_penalty = -1; });
  refuses([&](IdentifyOptions& o) { o.max_hypotheses = 0; });
  refuses([&](IdentifyOptions& o) {
    o.prior = Prior{};
    o.prior->position_sigma_m = 0;
  });
  std::vector<Blob> blobs = view.blobs;
  blobs[3].centroid_px.x() = nan;
  EXPECT_THROW(identify(blobs, scene), std::invalid_argument);
  blobs = view.blobs;
  blobs[0].covariance_px2(1, 1) = -1;
  EXPECT_THROW(identify(blobs, scene), std::invalid_argument);
}

}  // namespace
}  // namespace occ
