// SPDX-License-Identifier: Apache-2.0
// Surveys of lamps whose tracks or ids are known: small lamps without rims, regular arrangements,
// and links that contradict themselves.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <map>

#include "libocc/core/statistics.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/survey/survey.hpp"
#include "libocc/survey/update.hpp"
#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

void remove_rims(std::vector<MadePicture>& made) {
  for (MadePicture& one : made)
    for (Blob& blob : one.picture.blobs) {
      blob.rim.clear();
      blob.ellipse = {};
      blob.corners_px.clear();
    }
}

/// A track of each lamp that ends after `length` pictures; another one begins.
void add_tracks(std::vector<MadePicture>& made, int length = 1000) {
  for (std::size_t i = 0; i < made.size(); ++i)
    for (const int lamp : made[i].lamps)
      made[i].picture.tracks.push_back(100 * (static_cast<int>(i) / length) + lamp);
}

/// Ids of the lamps, other than their numbers, in each `every`-th picture.
void add_ids(std::vector<MadePicture>& made, int every = 1) {
  for (std::size_t i = 0; i < made.size(); i += static_cast<std::size_t>(every))
    for (std::size_t b = 0; b < made[i].lamps.size(); ++b)
      made[i].picture.blobs[b].lamp_id = 40 + made[i].lamps[b];
}

TEST(SurveyLinks, MapLampsWithoutRimsFromTracks) {
  const Scene scene = uneven_room();
  auto made = walk(scene, 14, 5);
  remove_rims(made);
  const auto alone = survey(pictures_of(made), scene.camera);
  EXPECT_EQ(alone.status, Status::too_few_lamps);
  add_tracks(made);
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  ASSERT_EQ(truth.size(), scene.lamps.size());
  EXPECT_LT(worst_distance_m(*found, scene, truth), 2e-3);
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_FALSE(lamp.has_shape);
    EXPECT_FALSE(lamp.code_id);
  }
  // The plane of the lamps is nearly level; the hanging one tilts it.
  for (const SurveyedLamp& a : found->lamps)
    for (const SurveyedLamp& b : found->lamps) {
      const double real =
          scene.lamps[truth[a.lamp.id]].centre_m.z() - scene.lamps[truth[b.lamp.id]].centre_m.z();
      EXPECT_NEAR(a.lamp.centre_m.z() - b.lamp.centre_m.z(), real, 0.25);
    }
}

TEST(SurveyLinks, JoinTracksThatWereInterrupted) {
  const Scene scene = uneven_room();
  std::vector<Rigid3> poses;
  auto made = video(scene, 48, 3, poses);
  remove_rims(made);
  add_tracks(made, 30);  // all tracks begin anew when the camera is back near its start
  const auto single = survey(pictures_of(made), scene.camera);
  ASSERT_TRUE(single.ok()) << single.message;
  EXPECT_GE(std::count_if(single->image_of_picture.begin(), single->image_of_picture.end(),
                          [](int image) { return image >= 0; }),
            28);
  add_ids(made, 12);  // read in both parts
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_EQ(truth.size(), scene.lamps.size());
  EXPECT_EQ(std::count(found->image_of_picture.begin(), found->image_of_picture.end(), -1), 0);
  EXPECT_LT(worst_distance_m(*found, scene, truth), 2e-3);
  for (const SurveyedLamp& lamp : found->lamps) EXPECT_EQ(lamp.code_id, 40 + truth[lamp.lamp.id]);
}

TEST(SurveyLinks, IdsDecideInARectangle) {
  const Scene scene = room_of({{1, 1, 2.7}, {3, 1, 2.7}, {1, 2.5, 2.7}, {3, 2.5, 2.7}});
  auto made = walk(scene, 30, 9);
  EXPECT_EQ(survey(pictures_of(made), scene.camera).status, Status::ambiguous);
  add_ids(made);
  const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_EQ(truth.size(), 4u);
  EXPECT_LT(worst_distance_m(*found, scene, truth), 3e-3);
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_EQ(lamp.code_id, 40 + truth[lamp.lamp.id]);
    EXPECT_TRUE(lamp.has_shape);
  }
}

TEST(SurveyLinks, IdsDecideInAGrid) {
  std::vector<Vector3d> grid;
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) grid.emplace_back(1.2 * i, 1.2 * k, 2.7);
  const Scene scene = room_of(grid);
  auto made = walk(scene, 24, 2);
  add_ids(made);
  for (const bool with_rims : {true, false}) {
    if (!with_rims) remove_rims(made);
    const auto found = survey(pictures_of(made), scene.camera, with_distance(scene, made));
    ASSERT_TRUE(found.ok()) << found.message;
    const std::vector<int> truth = truth_of(*found, made);
    EXPECT_GE(truth.size(), 14u);
    EXPECT_LT(worst_distance_m(*found, scene, truth), 5e-3) << with_rims;
  }
}

TEST(SurveyLinks, PredictTheirErrors) {
  // Distances between lamps, from noise alone: NEES over the surveys of several noises.
  const Scene scene = uneven_room();
  double nees = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    auto made = walk(scene, 12, 30 + seed, 0.05);
    for (MadePicture& one : made)
      for (Blob& blob : one.picture.blobs)
        blob.covariance_px2 = square(0.05) * Eigen::Matrix2d::Identity();
    remove_rims(made);
    add_tracks(made);
    SurveyOptions options = with_distance(scene, made);
    options.model_sigma_px = 1e-3;
    options.distances[0].sigma_m = 1e-6;  // the distance is exact
    SCOPED_TRACE(seed);
    const auto found = survey(pictures_of(made), scene.camera, options);
    ASSERT_TRUE(found.ok()) << found.message;
    const std::vector<int> truth = truth_of(*found, made);
    const auto known = precision(found->adjustment.network);
    ASSERT_TRUE(known.ok());
    for (std::size_t i = 1; i + 1 < truth.size(); ++i) {
      const Vector3d between = found->lamps[i].lamp.centre_m - found->lamps[0].lamp.centre_m;
      const double real = (scene.lamps[truth[i]].centre_m - scene.lamps[truth[0]].centre_m).norm();
      const Matrix6 joint =
          known->positions(Target::of_point(static_cast<int>(i)), Target::of_point(0));
      Eigen::Matrix<double, 6, 1> along;
      along << between.normalized(), -between.normalized();
      nees += square(between.norm() - real) / along.dot(joint * along);
      ++count;
    }
  }
  EXPECT_GT(nees / count, 0.6);
  EXPECT_LT(nees / count, 1.6);
}

TEST(SurveyLinks, NameWhatContradictsItself) {
  const Scene scene = uneven_room();
  auto made = walk(scene, 14, 5);
  add_tracks(made);
  add_ids(made, 3);
  auto pictures = pictures_of(made);
  // Two tracks are exchanged in one picture that reads ids; another picture reads an id twice.
  const int twice = made[6].lamps[1];
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < made[3].lamps.size(); ++k)
    if (made[3].lamps[k] != twice) others.push_back(k);
  std::swap(pictures[3].tracks[others[0]], pictures[3].tracks[others[1]]);
  pictures[6].blobs[0].lamp_id = pictures[6].blobs[1].lamp_id;
  const auto found = survey(pictures, scene.camera);
  ASSERT_TRUE(found.ok()) << found.message;
  const auto named = [&](const std::string& text) {
    return std::any_of(found->warnings.begin(), found->warnings.end(),
                       [&](const std::string& w) { return w.find(text) != std::string::npos; });
  };
  const int a = made[3].lamps[others[0]], b = made[3].lamps[others[1]];
  EXPECT_TRUE(named("track " + std::to_string(a) + " shows lamps with the ids " +
                    std::to_string(40 + std::min(a, b)) + " and " +
                    std::to_string(40 + std::max(a, b)) + "; neither is used there"));
  EXPECT_TRUE(named("picture 6: several blobs have the id " + std::to_string(40 + twice) +
                    ", which is therefore not used"));
}

TEST(SurveyLinks, TurningAloneDeterminesNoMap) {
  const Scene scene = uneven_room();
  Random random(4);
  std::vector<MadePicture> made;
  for (int i = 0; i < 10; ++i) {
    const double turn = 0.3 * i;
    made.push_back(make_picture(
        scene, look_at({1.8, 2, 0.3}, {1.9, 2.1, 2.7}, {std::cos(turn), std::sin(turn), 0}),
        "picture " + std::to_string(i), 0.03, random));
  }
  remove_rims(made);
  add_tracks(made);
  const auto found = survey(pictures_of(made), scene.camera);
  EXPECT_FALSE(found.ok());
  EXPECT_NE(found.message.find("from different places"), std::string::npos) << found.message;
}

TEST(SurveyLinks, LampsThatTheBorderCutsAreNotUsed) {
  const Scene scene = uneven_room();
  auto made = walk(scene, 30, 5);
  remove_rims(made);
  add_tracks(made);
  auto pictures = pictures_of(made);
  for (std::size_t i = 0; i < pictures.size(); i += 3)
    pictures[i].blobs.back().cut_by_border = true;
  const auto found = survey(pictures, scene.camera);
  ASSERT_TRUE(found.ok()) << found.message;
  for (std::size_t i = 0; i < pictures.size(); i += 3) EXPECT_EQ(found->lamp_of_blob[i].back(), -1);
}

TEST(SurveyLinks, UpdateAMapByLampsWithoutRims) {
  Scene scene = uneven_room();
  Scene moved = scene;
  moved.lamps[4].centre_m.x() += 0.05;
  auto made = walk(moved, 14, 5);
  remove_rims(made);
  add_tracks(made);
  const auto found = update_map(pictures_of(made), scene);
  ASSERT_TRUE(found.ok()) << found.message;
  for (const LampUpdate& update : found->lamps)
    EXPECT_EQ(update.fate == LampFate::moved, update.lamp.id == 4) << update.reason;
}

TEST(SurveyLinks, RefuseTracksOfAnotherCount) {
  const Scene scene = uneven_room();
  auto pictures = pictures_of(walk(scene, 4, 5));
  pictures[1].tracks = {1};
  EXPECT_THROW(survey(pictures, scene.camera), std::invalid_argument);
}

/// A random room of `count` lamps at least 0.5 m apart, at one height or within 0.8 m.
Scene random_room(Random& random, int count, bool flat) {
  std::vector<Vector3d> lamps;
  while (static_cast<int>(lamps.size()) < count) {
    const Vector3d at(random.uniform(0, 4), random.uniform(0, 4),
                      2.7 + (flat ? 0 : random.uniform(-0.4, 0.4)));
    if (std::all_of(lamps.begin(), lamps.end(),
                    [&](const Vector3d& other) { return (at - other).head<2>().norm() > 0.5; }))
      lamps.push_back(at);
  }
  return room_of(lamps);
}

/// Lamp of the scene that most blobs of each lamp of the survey show.
std::vector<int> truth_by_majority(const Survey& survey, const std::vector<MadePicture>& made) {
  std::vector<std::map<int, int>> counts(survey.lamps.size());
  for (std::size_t i = 0; i < made.size(); ++i)
    for (std::size_t b = 0; b < made[i].lamps.size(); ++b)
      if (const int id = survey.lamp_of_blob[i][b]; id >= 0)
        ++counts[static_cast<std::size_t>(id)][made[i].lamps[b]];
  std::vector<int> truth;
  for (const auto& of_lamp : counts)
    truth.push_back(std::max_element(of_lamp.begin(), of_lamp.end(), [](auto& a, auto& b) {
                      return a.second < b.second;
                    })->first);
  return truth;
}

TEST(SlowSurveyLinks, NeverAWrongMap) {
  MapSums sums;
  int ambiguous = 0;
  const int surveys = 300;
  for (std::uint64_t seed = 0; seed < surveys; ++seed) {
    Random random(900, seed);
    const int count = 4 + static_cast<int>(random.uniform(0, 9));
    const Scene scene = random_room(random, count, random.uniform() < 0.5);
    const double noise_px = random.uniform() < 0.5 ? 0.05 : 0.3;
    auto made = walk(scene, 4 + static_cast<int>(random.uniform(0, 20)), 1000 + seed, noise_px);
    remove_rims(made);
    add_tracks(made);
    if (random.uniform() < 0.5)  // tracks that jump to another lamp
      for (MadePicture& one : made)
        if (one.picture.tracks.size() > 1 && random.uniform() < 0.2)
          std::swap(one.picture.tracks[0], one.picture.tracks[1]);
    const auto found = survey(pictures_of(made), scene.camera);
    ambiguous += found.status == Status::ambiguous ? 1 : 0;
    if (found.ok()) add(sums, *found, scene, truth_by_majority(*found, made), seed);
  }
  std::cout << surveys << " surveys: " << sums << ", ambiguous " << ambiguous << std::endl;
  EXPECT_EQ(sums.wrong, 0);
  EXPECT_GT(sums.ok, 180);
  EXPECT_GT(sums.chi2 / sums.dof, 0.6);
  EXPECT_LT(sums.chi2 / sums.dof, 1.3);
}

}  // namespace
}  // namespace occ::test
