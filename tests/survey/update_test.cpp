// SPDX-License-Identifier: Apache-2.0
// Updates of maps: each verdict, links to symmetric maps, and data that must be refused.
#include "libocc/survey/update.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libocc/detect/detect.hpp"
#include "tests/support/rendered_rooms.hpp"
#include "tests/survey/update_support.hpp"

namespace occ::test {
namespace {

Result<MapUpdate> update_of(const Scene& map, const Scene& now, int pictures = 14,
                            std::uint64_t seed = 5,
                            const UpdateOptions& options = exact_options()) {
  return update_map(pictures_of(walk(now, pictures, seed)), map, options);
}

TEST(UpdateMap, KeepsAndRefinesLampsThatDidNotChange) {
  Random random(3);
  const Scene now = ten_lamps();
  const Scene map = map_of(now, 0.005, random);
  const auto found = update_of(map, now);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->lamps.size(), 10u);
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 10);
  double before = 0, after = 0;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(found->lamps[i].lamp.id, i);
    EXPECT_TRUE(found->lamps[i].changes.empty());
    EXPECT_LT(found->lamps[i].covariance_m2.trace(), 3 * square(0.005));
    before += (map.lamps[i].centre_m - now.lamps[i].centre_m).squaredNorm();
    after += (found->lamps[i].lamp.centre_m - now.lamps[i].centre_m).squaredNorm();
  }
  EXPECT_LT(after, 0.5 * before);
  EXPECT_EQ(found->covariance_m2.rows(), 30);
}

TEST(UpdateMap, FindsMovedGoneAndNewLamps) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  now.lamps[2].centre_m += Vector3d(0.05, 0, 0);  // overlaps its old place
  now.lamps[4].centre_m += Vector3d(0, 0.25, 0);  // beyond it, and within max_move_m
  now.lamps.erase(now.lamps.begin() + 6);         // gone
  Lamp added = now.lamps[0];
  added.centre_m = {1.3, 2.3, 2.7};
  added.id = 77;
  now.lamps.push_back(added);
  const auto found = update_of(map, now, 20);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->lamps.size(), 11u);
  EXPECT_EQ(found->lamps[2].fate, LampFate::moved) << found->lamps[2].reason;
  EXPECT_NEAR(found->lamps[2].displacement_m.x(), 0.05, 0.012);
  EXPECT_GT(found->lamps[2].statistic, found->max_statistic);
  EXPECT_EQ(found->lamps[4].fate, LampFate::moved) << found->lamps[4].reason;
  EXPECT_NEAR(found->lamps[4].displacement_m.y(), 0.25, 0.012);
  EXPECT_NE(found->lamps[4].reason.find("assumed"), std::string::npos);
  EXPECT_NEAR((found->lamps[4].lamp.centre_m - now.lamps[4].centre_m).norm(), 0, 0.01);
  EXPECT_EQ(found->lamps[6].fate, LampFate::gone) << found->lamps[6].reason;
  EXPECT_GE(found->lamps[6].missed.size(), 3u);
  EXPECT_TRUE(found->lamps[6].seen.empty());
  EXPECT_EQ(found->lamps[10].fate, LampFate::added);
  EXPECT_EQ(found->lamps[10].lamp.id, 10);
  EXPECT_LT((found->lamps[10].lamp.centre_m - added.centre_m).norm(), 0.01);
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 7);
}

TEST(UpdateMap, ReportsAFarMoveAsGoneAndNew) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  now.lamps[4].centre_m += Vector3d(0.1, 0.6, 0);
  const auto found = update_of(map, now, 20);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[4].fate, LampFate::gone);
  EXPECT_NE(found->lamps[4].reason.find("max_move_m"), std::string::npos);
  EXPECT_EQ(count_of(*found, LampFate::added), 1);
}

TEST(UpdateMap, DoesNotKeepAnIdBeyondTheLimit) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  now.lamps[4].centre_m += Vector3d(0.05, 0, 0);
  UpdateOptions options = exact_options();
  options.max_move_m = 0.01;
  const auto found = update_of(map, now, 20, 5, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[4].fate, LampFate::gone);
  EXPECT_NE(found->lamps[4].reason.find("overlaps its place"), std::string::npos);
  EXPECT_EQ(count_of(*found, LampFate::added), 1);
}

TEST(UpdateMap, KeepsTheIdOfAFarMoveByItsCode) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  now.lamps[4].centre_m += Vector3d(0.1, 0.6, 0);
  auto made = walk(now, 20, 5);
  for (MadePicture& one : made)
    for (std::size_t b = 0; b < one.lamps.size(); ++b)
      if (one.lamps[b] == 4) one.picture.blobs[b].lamp_id = 4;
  const auto found = update_map(pictures_of(made), map, exact_options());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[4].fate, LampFate::moved);
  EXPECT_NE(found->lamps[4].reason.find("code"), std::string::npos);
  EXPECT_EQ(count_of(*found, LampFate::added), 0);
}

TEST(UpdateMap, DoesNotChooseBetweenTwoCandidates) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  Lamp second = now.lamps[4];
  second.centre_m += Vector3d(0.22, 0, 0);
  second.id = 20;
  now.lamps[4].centre_m += Vector3d(-0.2, 0, 0);
  now.lamps.push_back(second);
  const auto found = update_of(map, now, 20);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[4].fate, LampFate::gone);
  EXPECT_NE(found->lamps[4].reason.find("nearly as near"), std::string::npos);
  EXPECT_EQ(count_of(*found, LampFate::added), 2);
}

TEST(UpdateMap, KeepsALampThatIsHiddenInHalfOfThePictures) {
  Random random(3);
  const Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  auto made = walk(now, 20, 5);
  for (std::size_t i = 0; i < made.size(); i += 2) {
    auto& [picture, lamps, pose] = made[i];
    for (std::size_t b = 0; b < lamps.size(); ++b)
      if (lamps[b] == 2) {
        picture.blobs.erase(picture.blobs.begin() + static_cast<std::ptrdiff_t>(b));
        lamps.erase(lamps.begin() + static_cast<std::ptrdiff_t>(b));
        break;
      }
  }
  const auto found = update_map(pictures_of(made), map, exact_options());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[2].fate, LampFate::unchanged) << found->lamps[2].reason;
  EXPECT_FALSE(found->lamps[2].missed.empty());
}

TEST(UpdateMap, KeepsLampsThatNoPictureShows) {
  Random random(3);
  Scene now = ten_lamps();
  Scene map = map_of(now, 0.003, random);
  Lamp far = map.lamps[0];
  far.id = 42;
  far.centre_m = {30, 30, 2.7};
  map.lamps.push_back(far);
  const auto found = update_of(map, now);
  ASSERT_TRUE(found.ok()) << found.message;
  const LampUpdate* kept = of_id(*found, 42);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->fate, LampFate::not_seen);
  EXPECT_EQ(kept->lamp.centre_m, far.centre_m);
  EXPECT_NEAR(kept->covariance_m2(0, 0), square(0.003), 1e-12);
}

TEST(UpdateMap, ReportsASwappedLampAsChanged) {
  Random random(3);
  Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  now.lamps[2].radius_m = 0.12;
  now.lamps[7].power_w = 4;
  const auto found = update_of(map, now, 20);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->lamps[2].fate, LampFate::changed) << found->lamps[2].reason;
  ASSERT_FALSE(found->lamps[2].changes.empty());
  EXPECT_EQ(found->lamps[2].changes[0].quantity, "size");
  EXPECT_NEAR(found->lamps[2].lamp.radius_m, 0.12, 0.003);
  EXPECT_EQ(found->lamps[7].fate, LampFate::changed) << found->lamps[7].reason;
  EXPECT_EQ(found->lamps[7].changes[0].quantity, "power");
}

TEST(UpdateMap, RefinesWithTheSharedErrorsOfTheMap) {
  Random random(3);
  const Scene now = ten_lamps();
  Scene map = now;
  for (Lamp& lamp : map.lamps) {  // the ceiling is 20 mm too low in the map, a third of its error
    lamp.position_sigma_m = PerAxis(0.001);
    lamp.shared_errors_m = {Vector3d(0, 0, 0.06)};
    lamp.centre_m.z() -= 0.02;
  }
  const auto found = update_of(map, now);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 10);
  // Pictures do not show a common shift, so that the frame of the map remains.
  EXPECT_NEAR(found->lamps[0].lamp.centre_m.z(), map.lamps[0].centre_m.z(), 0.004);
  EXPECT_GT(found->lamps[0].covariance_m2(2, 2), square(0.055));
}

TEST(UpdateMap, KeepsTheErrorOfTheScaleOfTheMap) {
  Random random(3);
  const Scene now = ten_lamps();
  Scene map = now;
  map.map_scale_sigma = 0.02;
  const Vector3d middle_m = map.mean_lamp_position_m();
  for (Lamp& lamp : map.lamps) {  // too large by half the error of the scale
    lamp.position_sigma_m = PerAxis(0.001);
    lamp.centre_m = middle_m + 1.01 * (lamp.centre_m - middle_m);
    lamp.radius_m *= 1.01;
  }
  const auto found = update_of(map, now);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 10);
  for (std::size_t i = 0; i < map.lamps.size(); ++i)
    EXPECT_LT((found->lamps[i].lamp.centre_m - map.lamps[i].centre_m).norm(), 0.005) << i;
  const Vector3d arm = map.lamps[0].centre_m - middle_m;
  const double along = arm.dot(found->lamps[0].covariance_m2 * arm) / arm.squaredNorm();
  EXPECT_NEAR(std::sqrt(along), 0.02 * arm.norm(), 0.004 * arm.norm());
}

Scene grid() {
  std::vector<Vector3d> at;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 3; ++j) at.push_back({1.2 * i, 1.0 * j, 2.7});
  return room_of(at);
}

TEST(UpdateMap, ReportsTheWaysOfARegularMap) {
  const Scene now = grid();
  std::vector<Rigid3> poses;
  const auto made = video(now, 20, 5, poses);
  UpdateOptions options = exact_options();
  options.survey.ordered = true;
  const auto found = update_map(pictures_of(made), now, options);
  ASSERT_EQ(found.status, Status::ambiguous) << found.message;
  ASSERT_GE(found->ways.size(), 2u);
  EXPECT_EQ(found->ways[0].picture, "frame 0");
  EXPECT_EQ(found->ways[0].matches, found->ways[1].matches);
  EXPECT_TRUE(found->lamps.empty());
  options.prior.emplace();
  options.prior->heading_rad = heading_rad(poses[0]);
  options.prior->position_m = poses[0].origin_in_source();
  options.prior->position_sigma_m = 0.2;  // a shift by one lamp is 1 m
  const auto decided = update_map(pictures_of(made), now, options);
  ASSERT_TRUE(decided.ok()) << decided.message;
  EXPECT_LT((decided->cam_from_world[0]->origin_in_source() - poses[0].origin_in_source()).norm(),
            0.01);
}

TEST(UpdateMap, ReportsTheWaysOfTheFirstPictureIfThePicturesMatchInSeveral) {
  const Scene now = room_of({{0, 0, 2.7}, {2, 0, 2.7}, {0, 2, 2.7}, {2, 2, 2.7}});
  std::vector<Rigid3> poses;
  const auto found = update_map(pictures_of(video(now, 8, 5, poses)), now, exact_options());
  ASSERT_EQ(found.status, Status::ambiguous) << found.message;
  EXPECT_EQ(found->ways.size(), 4u) << found.message;
  for (const MapWay& way : found->ways) {
    EXPECT_EQ(way.picture, "frame 0");
    EXPECT_EQ(way.matches, 4);
  }
}

TEST(UpdateMap, ComparesThePowerByTheEmissionOfTheLamp) {
  Random random(3);
  Scene now = ten_lamps();
  for (Lamp& lamp : now.lamps) lamp.half_power_rad = 0.35;  // narrow beams: order 11
  const Scene map = map_of(now, 0.003, random);
  now.lamps[4].power_w = 2;
  auto made = walk(now, 20, 5);
  std::vector<SurveyPicture> pictures = pictures_of(made);
  std::vector<Rigid3> poses;
  for (const MadePicture& one : made) poses.push_back(one.pose);
  for (std::size_t i = 0; i < made.size(); ++i)
    for (std::size_t b = 0; b < made[i].lamps.size(); ++b) {
      const Lamp& lamp = now.lamps[made[i].lamps[b]];
      const Vector3d to_eye = (poses[i].origin_in_source() - lamp.centre_m).normalized();
      const double cosine = lamp.normal.dot(to_eye);
      pictures[i].blobs[b].flux_dn *= std::pow(cosine, lamp.order() - 1);
    }
  const auto found = update_map(pictures, map, exact_options());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 9);
  EXPECT_EQ(found->lamps[4].fate, LampFate::changed);
  EXPECT_NEAR(found->lamps[4].lamp.power_w, 2, 0.05);
}

TEST(UpdateMap, ReportsAnotherColour) {
  Random random(3);
  Scene now = ten_lamps();
  Scene map = map_of(now, 0.003, random);
  map.lamps[1].colour = {1.6, 0.7, 0.7};  // one red lamp, which is still there
  auto made = walk(now, 20, 5);
  for (MadePicture& one : made)
    for (std::size_t b = 0; b < one.lamps.size(); ++b) {
      BlobColour colour;
      const Vector3d lamp = one.lamps[b] == 1   ? Vector3d(1.6, 0.7, 0.7)
                            : one.lamps[b] == 2 ? Vector3d(0.7, 0.7, 1.6)
                                                : Vector3d(1, 1, 1);
      const Vector3d balance(1.5, 1, 0.6);  // unknown white balance of the camera
      colour.share = lamp.cwiseProduct(balance) / lamp.dot(balance);
      one.picture.blobs[b].colour = colour;
    }
  const auto found = update_map(pictures_of(made), map, exact_options());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 9);
  ASSERT_EQ(found->lamps[2].fate, LampFate::changed);
  EXPECT_EQ(found->lamps[2].changes[0].quantity, "colour");
  EXPECT_GT(found->lamps[2].lamp.colour.z(), 1.3);
}

TEST(UpdateMap, RefusesAPriorThatContradictsTheOnlyWay) {
  const Scene now = ten_lamps();
  UpdateOptions options = exact_options();
  options.prior.emplace();
  options.prior->position_m = Vector3d(-9, 4, 0);
  const auto found = update_of(now, now, 14, 5, options);
  EXPECT_EQ(found.status, Status::no_pose);
  EXPECT_NE(found.message.find("contradict the prior of picture 0"), std::string::npos);
}

TEST(UpdateMap, RefusesPicturesOfAnotherRoom) {
  const auto found = update_of(ten_lamps(), other_room());
  EXPECT_EQ(found.status, Status::no_pose) << found.message;
  EXPECT_NE(found.message.find("this room"), std::string::npos);
  EXPECT_EQ(found->omissions.size(), 14u);
}

TEST(UpdateMap, RefusesMapsAndPicturesThatAreTooSmall) {
  const Scene now = ten_lamps();
  Scene map = now;
  map.lamps.clear();
  auto found = update_of(map, now);
  EXPECT_EQ(found.status, Status::too_few_lamps);
  EXPECT_NE(found.message.find("the map has 0 lamps"), std::string::npos);
  found = update_of(now, now, 1);
  EXPECT_EQ(found.status, Status::too_few_lamps);
}

TEST(UpdateMap, LinksPicturesOfBothEndsOfAHall) {
  Random random(8);
  Scene now = ten_lamps();
  for (int i = 0; i < 10; ++i) {
    Lamp lamp = now.lamps[i];
    lamp.id = 10 + i;
    lamp.centre_m =
        Vector3d(16 - 0.9 * lamp.centre_m.y() + 0.2 * (i % 3), 0.8 * lamp.centre_m.x(), 2.7);
    now.lamps.push_back(lamp);
  }
  const Scene map = map_of(now, 0.003, random);
  Scene near = now, far = now;
  near.lamps.resize(10);
  far.lamps.erase(far.lamps.begin(), far.lamps.begin() + 10);
  far.lamps.erase(far.lamps.begin() + 4);
  auto made = walk(near, 12, 5);
  for (MadePicture& one : walk(far, 12, 6)) {
    one.picture.name = "far " + one.picture.name;
    made.push_back(one);
  }
  const auto found = update_map(pictures_of(made), map, exact_options());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 19);
  EXPECT_EQ(found->lamps[14].fate, LampFate::gone) << found->lamps[14].reason;
}

// Pictures by a path tracer; the map has one lamp 30 mm off its place.
TEST(UpdateMap, FindsTheMovedLampOfARoomRenderedByAnotherProgram) {
  std::vector<SurveyPicture> pictures;
  Scene now;
  for (const auto& file : rendered_rooms("irregular6")) {
    const RenderedRoom room = read_rendered_room(file);
    now = room.scene;
    DetectOptions options;
    options.sensor = now.sensor;
    pictures.push_back({room.name, detect(room.image.view(), options)});
  }
  if (pictures.empty()) GTEST_SKIP() << "no rendered rooms";
  Random random(3);
  Scene map = map_of(now, 0.001, random);
  map.lamps[2].centre_m.x() += 0.03;
  const auto found = update_map(pictures, map);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->lamps.size(), 6u);
  for (int i = 0; i < 6; ++i) {
    const LampUpdate& lamp = found->lamps[i];
    EXPECT_EQ(lamp.fate, i == 2 ? LampFate::moved : LampFate::unchanged) << lamp.reason;
    const Vector3d error = lamp.lamp.centre_m - now.lamps[i].centre_m;
    EXPECT_LT(error.dot(lamp.covariance_m2.inverse() * error), 21) << i;
  }
}

TEST(UpdateMap, LinksMapsOfPointsWithoutASize) {
  Random random(3);
  Scene now = ten_lamps();
  Scene map = map_of(now, 0.003, random);
  for (Lamp& lamp : map.lamps) {
    lamp.shape = LampShape::point;
    lamp.radius_m = 0;
  }
  now.lamps[4].centre_m += Vector3d(0.1, 0, 0);
  const auto found = update_of(map, now, 20);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 9);
  EXPECT_EQ(found->lamps[4].fate, LampFate::moved) << found->lamps[4].reason;
  EXPECT_EQ(found->lamps[4].lamp.shape, LampShape::point);
}

TEST(UpdateMap, HasNoWayToMapsThatAreDegenerate) {
  const Scene now = ten_lamps();
  Scene line = now, one_place = now, above = now;
  for (int i = 0; i < 10; ++i) {
    line.lamps[i].centre_m = {0.5 * i, 1, 2.7};
    one_place.lamps[i].centre_m = {1, 1, 2.7};
    above.lamps[i].normal = Vector3d::UnitZ();  // the lit sides are not seen
  }
  for (const Scene& map : {line, one_place, above}) {
    const auto found = update_of(map, now);
    EXPECT_EQ(found.status, Status::no_pose) << found.message;
    EXPECT_TRUE(found->lamps.empty());
  }
}

TEST(UpdateMap, HasTheSameBitsForAnyNumberOfThreads) {
  Random random(3);
  const Scene now = ten_lamps();
  const Scene map = map_of(now, 0.003, random);
  UpdateOptions one = exact_options(), four = one;
  one.survey.threads = 1;
  four.survey.threads = 4;
  const auto a = update_of(map, now, 14, 5, one), b = update_of(map, now, 14, 5, four);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->covariance_m2, b->covariance_m2);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_EQ(a->lamps[i].lamp.centre_m, b->lamps[i].lamp.centre_m);
}

TEST(UpdateMap, KeepsThePlacesOfAnExactMap) {
  Scene now = ten_lamps();
  Scene map = now;
  for (Lamp& lamp : map.lamps) lamp.position_sigma_m = PerAxis(lamp.id == 9 ? 1e-6 : 0);
  now.lamps[4].centre_m.x() += 0.05;
  const auto found = update_of(map, now);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(count_of(*found, LampFate::unchanged), 9);
  EXPECT_LT((found->lamps[0].lamp.centre_m - now.lamps[0].centre_m).norm(), 1e-9);
  EXPECT_EQ(found->lamps[4].fate, LampFate::moved);
  EXPECT_NEAR(found->lamps[4].displacement_m.x(), 0.05, 5 * found->lamps[4].displacement_sigma_m);
}

TEST(UpdateMap, IsNotMisledByMapsWithLargeErrors) {
  Random random(3);
  const Scene now = ten_lamps();
  for (const double sigma_m : {0.05, 0.2, 1.0}) {
    const Scene map = map_of(now, sigma_m, random);
    const auto found = update_of(map, now);
    EXPECT_TRUE(found.ok() || found.status == Status::no_pose || found.status == Status::ambiguous);
    if (!found.ok()) continue;
    EXPECT_EQ(count_of(*found, LampFate::unchanged), 10) << sigma_m;
  }
}

// Random blobs have no constellation, whatever the map is.
TEST(UpdateMap, RefusesRandomBlobs) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed, 17);
    const Scene map = ten_lamps();
    auto pictures = pictures_of(walk(map, 6, seed));
    for (SurveyPicture& picture : pictures)
      for (Blob& blob : picture.blobs) {
        const Eigen::Vector2d by = noise_2d(random, 150);
        blob.centroid_px += by;
        blob.ellipse.centre_px += by;
        for (RimPoint& point : blob.rim) point.px += by;
      }
    const auto found = update_map(pictures, map, exact_options());
    EXPECT_FALSE(found.ok()) << seed;
  }
}

TEST(UpdateMap, NamesInvalidOptions) {
  UpdateOptions options;
  options.survey.radius_m = 0.1;
  EXPECT_THROW(update_map({}, ten_lamps(), options), std::invalid_argument);
  options = {};
  options.false_alarm = 0;
  EXPECT_THROW(update_map({}, ten_lamps(), options), std::invalid_argument);
  options = {};
  options.survey.calibrate_camera = true;
  EXPECT_THROW(update_map({}, ten_lamps(), options), std::invalid_argument);
}

TEST(UpdateMap, StatesThatTheMapHasNoErrors) {
  const auto found = update_of(ten_lamps(), ten_lamps());
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_FALSE(found->warnings.empty());
  EXPECT_NE(found->warnings[0].find("10 lamps"), std::string::npos);
}

}  // namespace
}  // namespace occ::test
