// SPDX-License-Identifier: Apache-2.0
// Four over-exposed lamps almost in a rectangle, in maps with errors: turned by 180 degrees, a
// wrong map often fits as well as the right one. The answer is right, within its sigmas, or
// ambiguous.
#include <gtest/gtest.h>

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene room_of_four() {
  Scene scene;
  scene.camera = Camera::pinhole(1000, 750, 760, 760, 501, 373, {0.08, -0.2, 0, 0, 0.1});
  const Eigen::Vector3d centres_m[] = {
      {-0.79, -0.60, 2.6}, {0.79, -0.61, 2.6}, {-0.80, 0.59, 2.6}, {0.80, 0.61, 2.6}};
  for (const Eigen::Vector3d& centre_m : centres_m) {
    Lamp lamp;
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.centre_m = centre_m;
    lamp.radius_m = 0.11;
    lamp.power_w = 4;
    scene.lamps.push_back(lamp);
  }
  scene.sensor.exposure_s *= 4;
  scene.validate();
  return scene;
}

double sigmas_off(const Eigen::Vector3d& off, const Eigen::Matrix3d& covariance_m2) {
  return std::sqrt(off.dot(covariance_m2.inverse() * off) / 3);
}

struct Verdicts {
  int images = 0, ok = 0, lost = 0, wrong = 0;
  double worst = 0;  ///< largest error of a fix that is ok, in its sigmas per coordinate
  std::string what;  ///< the fix with the largest error
};

Verdicts verdicts(double map_sigma_m, bool stated, int maps) {
  const Scene truth = room_of_four();
  Verdicts found;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Random random(seed, 12);
    const Eigen::Vector3d at(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.3);
    const Rigid3 pose =
        look_at(at, {0, 0.05, 3}, {std::sin(1.0 * static_cast<double>(seed)), 1, 0});
    SimulateOptions options;
    options.seed = seed;
    const Image image = simulate(truth, pose, options).image;
    for (int i = 0; i < maps; ++i) {
      Scene map = truth;
      for (Lamp& lamp : map.lamps)
        for (int k = 0; k < 3; ++k) lamp.centre_m[k] += map_sigma_m * random.normal();
      if (stated) map.map_sigma_m = map_sigma_m;
      const Result<Fix> fix = locate(image.view(), map);
      ++found.images;
      if (!fix.ok()) {
        bool is_listed = fix.status != Status::ambiguous;
        for (const Candidate& candidate : fix->candidates)
          is_listed |=
              sigmas_off(candidate.position_m - at,
                         position_covariance(candidate.cam_from_world, candidate.covariance)) < 5;
        found.lost += !is_listed;
        continue;
      }
      ++found.ok;
      const double off = sigmas_off(fix->position_m - at, fix->position_covariance_m2);
      found.wrong += off > 5;
      if (off < found.worst) continue;
      found.worst = off;
      found.what = "image " + std::to_string(seed) + ", map " + std::to_string(i) + ", " +
                   std::to_string(1e3 * (fix->position_m - at).norm()) + " mm off: " + fix.message;
    }
  }
  return found;
}

void expect_honest(int maps) {
  for (const double map_sigma_m : {2e-3, 5e-3, 20e-3})
    for (const bool stated : {false, true}) {
      SCOPED_TRACE(std::to_string(1e3 * map_sigma_m) + " mm, " + (stated ? "stated" : "unstated"));
      const Verdicts found = verdicts(map_sigma_m, stated, maps);
      // Unstated errors of four lamps can agree by chance.
      EXPECT_LE(found.wrong, stated ? 0 : found.images / 100)
          << found.worst << " sigmas, " << found.what;
      EXPECT_EQ(found.lost, 0) << "ambiguous without the right pose";
      if (stated && map_sigma_m < 3e-3) {
        EXPECT_GE(found.ok, 9 * found.images / 10);
      }
    }
}

TEST(WrongMap, RivalsHaveTheOddsOfASearchThatStatesTheErrors) {
  const Scene truth = room_of_four();
  int compared = 0, agree = 0;
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    Random random(seed, 13);
    const Eigen::Vector3d at(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.3);
    const Image image = simulate(truth, look_at(at, {0, 0.05, 3}, {0, 1, 0})).image;
    for (int i = 0; i < 4; ++i) {
      Scene map = truth;
      for (Lamp& lamp : map.lamps)
        for (int k = 0; k < 3; ++k) lamp.centre_m[k] += 5e-3 * random.normal();
      const Result<Fix> fix = locate(image.view(), map);
      // A rival without an estimate of its own comes from the search with the errors of the best.
      if (fix->candidates.size() != 2 || !fix->candidates[0].estimated_map_sigma_m ||
          fix->candidates[1].estimated_map_sigma_m)
        continue;
      map.map_sigma_m = 1.5 * *fix->candidates[0].estimated_map_sigma_m;
      const Result<Fix> stated = locate(image.view(), map);
      if (stated->candidates.size() != 2) continue;
      const auto log_odds = [](const Fix& of) {
        return std::log(*of.candidates[0].probability / *of.candidates[1].probability);
      };
      ++compared;
      agree += std::abs(log_odds(fix.value) - log_odds(stated.value)) < std::log(3);
    }
  }
  // If the search with the errors does not find the best pose again, its rival is worth a doubt.
  EXPECT_GE(agree, 3);
  EXPECT_GE(agree, compared - 1);
}

TEST(WrongMap, OfFourLampsIsNotBelieved) { expect_honest(8); }

TEST(SlowWrongMap, OfFourLampsIsNotBelieved) { expect_honest(60); }

}  // namespace
}  // namespace occ
