// SPDX-License-Identifier: Apache-2.0
// Maps of lamps from pictures without a map: exact and noisy blobs, rendered rooms, and data that
// must be held back or named.
#include "libocc/survey/survey.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/precision.hpp"
#include "tests/support/rendered_rooms.hpp"
#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

TEST(Survey, MapsAnIrregularRoomFromUnorderedPictures) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 12, 5);
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_EQ(truth.size(), scene.lamps.size());
  EXPECT_LT(worst_distance_m(*found, scene, truth), 2e-3);
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_NEAR(lamp.lamp.radius_m, 0.08, 4e-4);
    EXPECT_GT(-lamp.lamp.normal.z(), 0.999);
  }
}

TEST(Survey, NumbersLampsInTheOrderOfThePicturesAndStatesTheFrame) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 12, 5);
  const auto found = survey(pictures_of(made), scene.camera);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->scale, SurveyScale::free);
  double farthest = 0;
  Vector3d mean = Vector3d::Zero();
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_EQ(lamp.lamp.id, &lamp - found->lamps.data());
    mean += lamp.lamp.centre_m;
    farthest = std::max(farthest, (lamp.lamp.centre_m - found->lamps[0].lamp.centre_m).norm());
  }
  EXPECT_NEAR(farthest, 1, 1e-6);
  EXPECT_LT(mean.head<2>().norm(), 1e-3);
}

TEST(Survey, TakesTheScaleFromARadius) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 12, 5);
  SurveyOptions options;
  options.radius_m = 0.08;
  options.radius_sigma = 1e-3;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->scale, SurveyScale::radius);
  EXPECT_GE(found->scale_sigma, 1e-3);
  EXPECT_LT(worst_distance_m(*found, scene, truth_of(*found, made)), 3.5 * 4 * found->scale_sigma);
}

TEST(Survey, TakesTheScaleFromOdometry) {
  const Scene scene = uneven_room();
  std::vector<Rigid3> poses;
  auto made = video(scene, 40, 5, poses);
  const Eigen::Matrix3d other_frame = so3_exp({0.3, -0.2, 1});  // and a factor of 1 %
  for (std::size_t i = 0; i < made.size(); ++i)
    made[i].picture.odometry_m = 1.01 * (other_frame * poses[i].origin_in_source());
  SurveyOptions options;
  options.ordered = true;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->scale, SurveyScale::odometry);
  EXPECT_NEAR(found->scale_sigma, 0.01, 0.002);
  const std::vector<int> truth = truth_of(*found, made);
  const double length = (scene.lamps[truth[0]].centre_m - scene.lamps[truth[1]].centre_m).norm();
  EXPECT_NEAR((found->lamps[0].lamp.centre_m - found->lamps[1].lamp.centre_m).norm(), 1.01 * length,
              3e-3);
}

TEST(Survey, StatesTheErrorOfOverExposedRims) {
  const Scene scene = uneven_room();
  auto made = walk(scene, 12, 5);
  SurveyOptions options = with_distance(scene, made);
  for (MadePicture& one : made)
    for (Blob& blob : one.picture.blobs) {
      blob.saturated = true;
      for (RimPoint& point : blob.rim) point.px += 2.5 * point.normal;
      blob.ellipse.semi_major_px += 2.5;
      blob.ellipse.semi_minor_px += 2.5;
    }
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_GT(lamp.lamp.radius_m, 0.084);
    EXPECT_LT(std::abs(lamp.lamp.radius_m / 0.08 - 1), 3 * lamp.lamp.size_sigma);
  }
}

TEST(Survey, HoldsBackPicturesOfFourLampsInARectangle) {
  const Scene scene = room_of({{1, 1, 2.7}, {3, 1, 2.7}, {1, 2.5, 2.7}, {3, 2.5, 2.7}});
  const auto made = walk(scene, 10, 3);
  const auto found = survey(pictures_of(made), scene.camera);
  EXPECT_EQ(found.status, Status::ambiguous) << found.message;
}

TEST(Survey, MapsFourLampsInARectangleFromAVideoWithATag) {
  const Scene scene = room_of({{1, 1, 2.7}, {3, 1, 2.7}, {1, 2.5, 2.7}, {3, 2.5, 2.7}});
  std::vector<Rigid3> poses;
  auto made = video(scene, 60, 8, poses);
  add_tag(made, scene, {2, 1.9, 2.7}, 0.16);
  SurveyOptions options;
  options.ordered = true;
  options.tag_size_m = 0.16;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->scale, SurveyScale::tags);
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_EQ(truth.size(), 4u);
  EXPECT_LT(worst_distance_m(*found, scene, truth), 3e-3);
}

TEST(Survey, NamesFramesAfterAJumpOfTheCamera) {
  const Scene scene = room_of({{1, 1, 2.7}, {3, 1, 2.7}, {1, 2.5, 2.7}, {3, 2.5, 2.7}});
  std::vector<Rigid3> poses;
  auto made = video(scene, 60, 8, poses);
  made.erase(made.begin() + 20, made.begin() + 35);  // a quarter of a turn is missing
  for (std::size_t i = 20; i < made.size(); ++i) made[i].picture.name += " later";
  SurveyOptions options;
  options.ordered = true;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_EQ(std::count(truth.begin(), truth.end(), -2), 0);
  EXPECT_FALSE(found->omissions.empty());
}

TEST(Survey, NamesFramesOfAFastMotion) {
  const Scene scene = uneven_room();
  std::vector<Rigid3> poses;
  auto made = video(scene, 48, 8, poses);
  made.erase(made.begin() + 21, made.begin() + 25);  // half a radian of turn is missing
  SurveyOptions options;
  options.ordered = true;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_TRUE(std::any_of(found->omissions.begin(), found->omissions.end(),
                          [](const SurveyOmission& omission) {
                            return omission.reason.find("moved too fast") != std::string::npos;
                          }));
}

/// Frames of a camera with a rolling shutter that turns and moves below the lamps.
std::vector<MadePicture> rolling_video(const Scene& scene, double row_time_s, int count) {
  Random random(6);
  const double interval_s = 0.2;
  const auto pose_at = [](double time_s) {
    const double turn = 0.4 * time_s;
    const Vector3d at(2 + 0.5 * std::cos(turn), 1.75 + 0.3 * std::sin(turn), 0.3);
    return look_at(at, {2, 1.75, 2.7}, {std::cos(turn), std::sin(turn), 0});
  };
  std::vector<MadePicture> made;
  for (int i = 0; i < count; ++i) {
    const double time_s = interval_s * i;
    made.push_back(
        make_picture(scene, pose_at(time_s), "frame " + std::to_string(i), 0.03, random));
    made.back().picture.time_s = time_s;
    for (std::size_t b = 0; b < made.back().lamps.size(); ++b) {
      Blob& blob = made.back().picture.blobs[b];
      const Vector3d& lamp = scene.lamps[made.back().lamps[b]].centre_m;
      const Eigen::Vector2d still = scene.camera.project(pose_at(time_s) * lamp).value();
      Eigen::Vector2d moved = still;
      for (int round = 0; round < 4; ++round)
        moved =
            scene.camera.project(pose_at(time_s + row_time_s * (moved.y() - 479.5)) * lamp).value();
      blob.centroid_px += moved - still;
      blob.ellipse.centre_px += moved - still;
      for (RimPoint& point : blob.rim) point.px += moved - still;
    }
  }
  return made;
}

TEST(Survey, CorrectsTheRollingShutterOfAVideo) {
  const Scene scene = uneven_room();
  const auto made = rolling_video(scene, 2.3e-5, 60);
  SurveyOptions options;
  options.ordered = true;
  options.row_time_s = 2.3e-5;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  // The scale is free: it is that of the longest distance from lamp 0.
  Survey scaled = *found;
  double longest = 0;
  for (const int lamp : truth)
    longest =
        std::max(longest, (scene.lamps[lamp].centre_m - scene.lamps[truth[0]].centre_m).norm());
  for (SurveyedLamp& lamp : scaled.lamps) lamp.lamp.centre_m *= longest;
  EXPECT_LT(worst_distance_m(scaled, scene, truth), 4e-3);
  EXPECT_LT(found->adjustment.sigma0, 2);
}

TEST(Survey, MapsPanelsWithTheirSides) {
  Scene scene = uneven_room();
  for (Lamp& lamp : scene.lamps) {
    lamp.shape = LampShape::rectangle;
    lamp.size_m = {0.3, 0.2};
    lamp.validate();
  }
  const auto made = walk(scene, 12, 5);
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_distance_m(*found, scene, truth_of(*found, made)), 2e-3);
  for (const SurveyedLamp& lamp : found->lamps) {
    ASSERT_EQ(lamp.lamp.shape, LampShape::rectangle);
    EXPECT_NEAR(lamp.lamp.size_m.maxCoeff(), 0.3, 1e-3);
    EXPECT_NEAR(lamp.lamp.size_m.minCoeff(), 0.2, 1e-3);
  }
}

TEST(Survey, NamesPicturesOfAnotherRoom) {
  const Scene scene = uneven_room();
  const Scene other = other_room();
  auto made = walk(scene, 12, 5);
  for (MadePicture& one : walk(other, 3, 9)) {
    one.picture.name = "other " + one.picture.name;
    made.push_back(one);
  }
  const auto found = survey(pictures_of(made), scene.camera);
  ASSERT_TRUE(found.ok()) << found.message;
  int named = 0;
  for (const SurveyOmission& omission : found->omissions)
    named += omission.blob < 0 && omission.picture.rfind("other", 0) == 0;
  EXPECT_EQ(named, 3);
  for (std::size_t i = 12; i < made.size(); ++i) EXPECT_EQ(found->image_of_picture[i], -1);
}

TEST(Survey, NamesADistanceThatContradictsTheOthers) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 12, 5);
  const auto free = survey(pictures_of(made), scene.camera);
  const std::vector<int> truth = truth_of(*free, made);
  SurveyOptions options;
  for (int to = 1; to < 5; ++to)
    options.distances.push_back(
        {0, to, (scene.lamps[truth[0]].centre_m - scene.lamps[truth[to]].centre_m).norm(), 1e-3});
  const std::vector<LampDistance> right = options.distances;
  for (const double wrong : {right[1].length_m + 0.1, 10 * right[1].length_m}) {
    options.distances[1].length_m = wrong;
    const auto found = survey(pictures_of(made), scene.camera, options);
    ASSERT_TRUE(found.ok()) << found.message;
    ASSERT_EQ(found->warnings.size(), 1u);
    EXPECT_EQ(found->warnings[0].rfind("distance 1 (lamp 0 to lamp 2, ", 0), 0u);
    EXPECT_NE(found->warnings[0].find("is rejected"), std::string::npos);
    EXPECT_LT(worst_distance_m(*found, scene, truth), 2e-3);
  }
  // Either of two distances may be wrong.
  options.distances.resize(2);
  for (const double wrong : {right[1].length_m + 0.1, 10 * right[1].length_m}) {
    options.distances[1].length_m = wrong;
    const auto undecided = survey(pictures_of(made), scene.camera, options);
    EXPECT_EQ(undecided.status, Status::ambiguous);
    EXPECT_EQ(undecided.message.rfind("distance ", 0), 0u);
    EXPECT_NE(undecided.message.find("either may be wrong; check both"), std::string::npos);
    EXPECT_TRUE(undecided->warnings.empty());
  }
}

TEST(Survey, WarnsOfPicturesFromNearlyOnePlace) {
  const Scene scene = uneven_room();
  const auto warns = [&](double step_m) {
    Random random(2);
    std::vector<MadePicture> made;
    for (int i = 0; i < 6; ++i)
      made.push_back(make_picture(scene,
                                  look_at({1.7 + step_m * i, 1.9, 0.3}, {1.75, 1.9, 2.7},
                                          {std::cos(0.5 * i), std::sin(0.5 * i), 0}),
                                  "picture " + std::to_string(i), 0.03, random));
    const auto found = survey(pictures_of(made), scene.camera);
    EXPECT_TRUE(found.ok()) << found.message;
    return std::any_of(found->warnings.begin(), found->warnings.end(), [](const std::string& text) {
      return text.find("take pictures from further places") != std::string::npos;
    });
  };
  EXPECT_TRUE(warns(0.01));
  EXPECT_FALSE(warns(0.15));
}

TEST(Survey, WarnsOfACameraThatIsNotThatOfThePictures) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 14, 5);
  const auto warns = [&](const Camera& camera) {
    const auto found = survey(pictures_of(made), camera);
    EXPECT_TRUE(found.ok()) << found.message;
    return std::any_of(found->warnings.begin(), found->warnings.end(), [](const std::string& text) {
      return text.find("contradict each other") != std::string::npos;
    });
  };
  EXPECT_FALSE(warns(scene.camera));
  EXPECT_TRUE(warns(Camera::pinhole(1280, 960, 800, 800, 654.5, 470.5)));
}

TEST(Survey, RefusesDistancesOfUnknownLamps) {
  const Scene scene = uneven_room();
  const auto made = walk(scene, 12, 5);
  SurveyOptions options;
  options.distances = {{0, 17, 1, 1e-3}};
  EXPECT_THROW(survey(pictures_of(made), scene.camera, options), std::invalid_argument);
}

TEST(Survey, StopsWhenTheCallbackDemandsIt) {
  const Scene scene = uneven_room();
  int calls = 0;
  const auto found = survey(pictures_of(walk(scene, 12, 5)), scene.camera, {},
                            [&](const SurveyProgress&) { return ++calls < 10; });
  EXPECT_EQ(found.status, Status::not_converged);
  EXPECT_EQ(calls, 10);
}

TEST(Survey, StatesTooFewPictures) {
  const Scene scene = uneven_room();
  const auto found = survey(pictures_of(walk(scene, 1, 5)), scene.camera);
  EXPECT_EQ(found.status, Status::too_few_lamps);
  EXPECT_FALSE(found.message.empty());
}

// Squared errors of the lamps' distances over their predicted variances.
TEST(Survey, PredictsItsErrors) {
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Scene scene = uneven_room();
    const auto made = walk(scene, 10, seed);
    SurveyOptions options = with_distance(scene, made);
    options.model_sigma_px = 1e-3;  // the blobs have no such error
    if (options.distances.empty()) continue;
    options.distances[0].sigma_m = 1e-6;  // the distance is exact
    const auto found = survey(pictures_of(made), scene.camera, options);
    if (!found.ok()) continue;
    const std::vector<int> truth = truth_of(*found, made);
    const auto known = precision(found->adjustment.network);
    ASSERT_TRUE(known.ok());
    for (int i = 0; i < static_cast<int>(truth.size()); ++i)
      for (int j = 0; j < i; ++j) {
        const double found_m =
            (found->lamps[i].lamp.centre_m - found->lamps[j].lamp.centre_m).norm();
        const double real_m =
            (scene.lamps[truth[i]].centre_m - scene.lamps[truth[j]].centre_m).norm();
        const double sigma = known->distance_sigma_m(Target::of_point(i), Target::of_point(j));
        sum += square((found_m - real_m) / sigma);
        ++count;
      }
  }
  ASSERT_GT(count, 200);
  EXPECT_NEAR(sum / count, 1, 0.25);  // distances of one survey are correlated
}

TEST(Survey, CalibratesTheCameraAlong) {
  // The focal length of the pictures is known to 2 %. A camera that is taken as exact has points
  // rejected; one that is estimated is right within its sigma of about 0.05 %.
  const Scene scene = uneven_room();
  constexpr int surveys = 8;
  double nees = 0;
  for (std::uint64_t seed = 1; seed <= surveys; ++seed) {
    SCOPED_TRACE(seed);
    const auto made = walk(scene, 24, seed);
    Random random(seed, 8);
    const double focal_px = 800 * (1 + 0.02 * random.normal());
    const Camera given = Camera::pinhole(1280, 960, focal_px, focal_px, 639.5, 479.5)
                             .with_parameter_sigmas({{"f_px", 16}});
    SurveyOptions options;
    options.calibrate_camera = true;
    const auto found = survey(pictures_of(made), given, options);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_TRUE(found->adjustment.rejected.empty());
    const double sigma = std::sqrt(found->camera.parameter_covariance()(0, 0));
    EXPECT_LT(sigma, 1);
    nees += square((found->camera.fx_px() - 800) / sigma) / surveys;
    // The shape of the map is as good as with the true camera.
    const std::vector<int> truth = truth_of(*found, made);
    ASSERT_EQ(truth.size(), 6);
    const auto ratio = [&](int a, int b, int c, int d) {
      const auto at = [&](int i) { return found->lamps[i].lamp.centre_m; };
      const auto real = [&](int i) { return scene.lamps[truth[i]].centre_m; };
      return (at(a) - at(b)).norm() / (at(c) - at(d)).norm() /
             ((real(a) - real(b)).norm() / (real(c) - real(d)).norm());
    };
    EXPECT_NEAR(ratio(0, 1, 2, 3), 1, 2e-3);
    EXPECT_NEAR(ratio(1, 4, 0, 5), 1, 2e-3);
    double lowest_m = infinity;
    for (int i = 0; i < static_cast<int>(found->adjustment.network.images.size()); ++i)
      lowest_m =
          std::min(lowest_m, found->adjustment.network.cam_from_world(i).origin_in_source().z());
    EXPECT_NEAR(lowest_m, 0, 1e-9);
    options.calibrate_camera = false;
    const auto fixed = survey(pictures_of(made), given, options);
    const auto is_of_errors = [](const std::string& warning) {
      return warning.find("errors that the camera states") != std::string::npos;
    };
    EXPECT_EQ(std::count_if(fixed->warnings.begin(), fixed->warnings.end(), is_of_errors), 1);
    EXPECT_EQ(std::count_if(found->warnings.begin(), found->warnings.end(), is_of_errors), 0);
  }
  EXPECT_GT(nees, 0.1);
  EXPECT_LT(nees, 2.5);
  SurveyOptions options;
  options.calibrate_camera = true;
  const auto made = walk(scene, 6, 1);
  EXPECT_THROW(survey(pictures_of(made), scene.camera, options), std::invalid_argument);
}

/// Rendered pictures with the lamp of the scene that each blob shows; -1: none.
std::vector<MadePicture> rendered_pictures(const std::string& prefix, Scene& scene) {
  std::vector<MadePicture> made;
  for (const auto& file : rendered_rooms(prefix)) {
    const RenderedRoom room = read_rendered_room(file);
    scene = room.scene;
    DetectOptions options;
    options.sensor = scene.sensor;
    MadePicture one;
    one.picture = {room.name, detect(room.image.view(), options)};
    one.lamps = lamps_of_blobs(one.picture.blobs, scene, room.cam_from_world);
    made.push_back(one);
  }
  return made;
}

// A camera moves along the danger cylinder of the three lamps that it sees. Their rims determine
// the poses, which the centres alone do not.
TEST(Survey, KeepsFramesOnADangerCylinder) {
  const Scene scene = uneven_room();
  Random random(7);
  std::vector<MadePicture> made;
  const int frames = 60, whole = 20;
  for (int k = 0; k < frames; ++k) {
    const double turn = 1.7 - 0.03 * std::max(0, k - whole);  // on the circle of lamps 0, 1 and 2
    const Vector3d on_circle(1.82273 + 1.09327 * std::cos(turn), 0.51364 + 1.09327 * std::sin(turn),
                             0.3);
    const Vector3d at = on_circle + Vector3d(0, 0.04, 0) * std::max(0, whole - k);
    const Rigid3 pose = look_at(at, {1.75, 1.2, 2.7}, {1, 0.01 * k, 0});
    made.push_back(make_picture(scene, pose, "frame " + std::to_string(k), 0.03, random));
    if (k < whole) continue;
    MadePicture& last = made.back();
    for (std::size_t b = last.lamps.size(); b-- > 0;)
      if (last.lamps[b] > 2) {
        last.lamps.erase(last.lamps.begin() + static_cast<std::ptrdiff_t>(b));
        last.picture.blobs.erase(last.picture.blobs.begin() + static_cast<std::ptrdiff_t>(b));
      }
  }
  SurveyOptions options = with_distance(scene, made);
  options.ordered = true;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_distance_m(*found, scene, truth_of(*found, made)), 3e-3);
  const Network& network = found->adjustment.network;
  const Rigid3 first = network.cam_from_world(found->image_of_picture[0]);
  for (int k = 1; k < frames; ++k) {
    ASSERT_GE(found->image_of_picture[k], 0) << k;
    const Rigid3 pose = network.cam_from_world(found->image_of_picture[k]);
    EXPECT_NEAR((pose.origin_in_source() - first.origin_in_source()).norm(),
                (made[k].pose.origin_in_source() - made[0].pose.origin_in_source()).norm(), 0.015)
        << k;
  }
}

TEST(Survey, MapsARoomRenderedByAnotherProgram) {
  Scene scene;
  const auto made = rendered_pictures("irregular6", scene);
  if (made.empty()) GTEST_SKIP() << "no rendered rooms";
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  ASSERT_EQ(truth.size(), 6u);
  const auto known = precision(found->adjustment.network);
  ASSERT_TRUE(known.ok());
  const double factor = std::max(1.0, found->adjustment.sigma0);
  for (int i = 0; i < 6; ++i) {
    ASSERT_GE(truth[i], 0);
    EXPECT_NEAR(found->lamps[i].lamp.radius_m, 0.085, 5e-4);
    for (int j = 0; j < i; ++j) {
      const double error_m =
          (found->lamps[i].lamp.centre_m - found->lamps[j].lamp.centre_m).norm() -
          (scene.lamps[truth[i]].centre_m - scene.lamps[truth[j]].centre_m).norm();
      const double sigma_m =
          factor * known->distance_sigma_m(Target::of_point(i), Target::of_point(j));
      EXPECT_LT(std::abs(error_m), 1e-3) << i << " " << j;
      EXPECT_LT(std::abs(error_m), 3.5 * sigma_m + 1e-5) << i << " " << j << " sigma " << sigma_m;
    }
  }
}

}  // namespace
}  // namespace occ::test
