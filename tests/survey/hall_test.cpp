// SPDX-License-Identifier: Apache-2.0
// A hall with lamps in a regular grid, from a recording of a vehicle on several loops: views of the
// grid look alike, so that neighbours must decide, and loops must close without a wrong join.
#include <gtest/gtest.h>

#include <iostream>

#include "libocc/network/network_statistics.hpp"
#include "libocc/network/precision.hpp"
#include "tests/survey/hall_support.hpp"
#include "tests/survey/update_support.hpp"

namespace occ::test {
namespace {

struct HallErrors {
  double rms_m = 0, nees = 0;
  int wrong = 0, twice = 0, lamps = 0;
};

HallErrors errors_of(const Survey& survey, const Scene& scene,
                     const std::vector<MadePicture>& made) {
  HallErrors errors;
  const std::vector<int> truth = truth_of(survey, made);
  std::vector<CheckPoint> points;
  std::vector<bool> found(scene.lamps.size(), false);
  const auto determined = precision(survey.adjustment.network);
  std::size_t left_out = 0;  // named lamps, such as by a rejected second image
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] < 0) {
      errors.wrong += truth[i] == -2;
      continue;
    }
    errors.twice += found[truth[i]];
    found[truth[i]] = true;
    if (determined.ok() && !determined->point(static_cast<int>(i)).allFinite()) {
      ++left_out;
      continue;
    }
    ++errors.lamps;
    points.push_back({Target::of_point(static_cast<int>(i)), scene.lamps[truth[i]].centre_m});
  }
  EXPECT_EQ(left_out, survey.adjustment.left_out.size());
  const Network network = aligned(survey.adjustment.network, points);
  const auto known = precision(network);
  if (!known.ok() || points.size() < 4) return errors;
  const auto checked = check_points(network, *known, points);
  errors.rms_m = checked->rmse_3d_m;
  // Each lamp alone, with the datum of all of them. The datum takes 7 of 3 n degrees of freedom.
  double chi2 = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Matrix3d covariance = known->point(points[i].target.point);
    chi2 += checked->errors_m[i].dot(covariance.inverse() * checked->errors_m[i]);
  }
  errors.nees = chi2 / (3 * static_cast<double>(points.size()));
  return errors;
}

void campaign(int seeds, int loops) {
  double nees = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const Scene scene = hall(random);
    const auto made = drive(scene, loops, 0.75, random);
    SurveyOptions options;
    options.ordered = true;
    options.model_sigma_px = 1e-3;  // the blobs have no such error
    options.threads = 1;
    const auto found = survey(pictures_of(made), scene.camera, options);
    ASSERT_TRUE(found.ok()) << "seed " << seed << ": " << found.message;
    const HallErrors errors = errors_of(*found, scene, made);
    EXPECT_EQ(errors.wrong, 0) << "seed " << seed;
    EXPECT_EQ(errors.twice, 0) << "seed " << seed;
    EXPECT_LT(errors.rms_m, 4 * 5e-3) << "seed " << seed;  // 5 mm per 10 m, over 40 m
    std::cout << "seed " << seed << ": " << errors.lamps << " lamps of " << scene.lamps.size()
              << ", rms " << 1e3 * errors.rms_m << " mm, nees " << errors.nees << ", sigma0 "
              << found->adjustment.sigma0 << std::endl;
    nees += errors.nees / seeds;
  }
  if (seeds >= 10) {
    EXPECT_NEAR(nees, 1, 0.1 + 1 / std::sqrt(seeds));
  }
}

TEST(Hall, ClosesTheLoopOfARegularGrid) { campaign(1, 1); }

TEST(SlowHall, NeverClosesALoopWrongly) { campaign(20, 3); }

// A recording of a part of the hall updates the map although the grid repeats: its gaps decide, or
// a prior. Nothing may be linked to a wrong place.
void update_hall(std::uint64_t seed, double share) {
  Random random(seed, 50);
  Scene now = hall(random);
  const Scene map = map_of(now, 0.005, random);
  std::set<int> moved, gone;
  std::vector<Lamp> lamps;
  for (Lamp& lamp : now.lamps) {
    const double draw = random.uniform();
    if (draw < 0.5 * share) {
      gone.insert(lamp.id);
      continue;
    }
    if (draw < share) {
      lamp.centre_m.x() += 0.15;
      moved.insert(lamp.id);
    }
    lamps.push_back(lamp);
  }
  now.lamps = lamps;
  const auto made = drive(now, 1, 0.6, random);
  UpdateOptions options = exact_options();
  options.survey.ordered = true;
  options.false_alarm = 1e-5;  // none is expected in 300 lamps
  options.prior.emplace();
  options.prior->position_m = Vector3d(35, 10, 0.3);
  const auto found = update_map(pictures_of(made), map, options);
  ASSERT_TRUE(found.ok()) << found.message;
  int right = 0, wrong = 0, unseen = 0;
  for (const LampUpdate& lamp : found->lamps) {
    if (lamp.lamp.id >= 60 || lamp.fate == LampFate::added) {
      ++wrong;
      std::cout << "lamp " << lamp.lamp.id << " at " << lamp.lamp.centre_m.transpose() << ": "
                << lamp.reason << std::endl;
      continue;
    }
    const LampFate expected = moved.count(lamp.lamp.id) > 0  ? LampFate::moved
                              : gone.count(lamp.lamp.id) > 0 ? LampFate::gone
                                                             : LampFate::unchanged;
    right += lamp.fate == expected;
    unseen += lamp.fate == LampFate::not_seen;
    if (lamp.fate != expected && lamp.fate != LampFate::not_seen) {
      ++wrong;
      std::cout << "lamp " << lamp.lamp.id << " " << to_string(lamp.fate) << ": " << lamp.reason
                << std::endl;
    }
  }
  std::cout << "seed " << seed << ": moved " << moved.size() << ", gone " << gone.size()
            << ", right " << right << ", not seen " << unseen << ", wrong " << wrong << std::endl;
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(right, 35);
}

TEST(SlowHall, IsUpdated) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    update_hall(seed, 0.1 * static_cast<double>(seed % 4));
}

}  // namespace
}  // namespace occ::test
