// SPDX-License-Identifier: Apache-2.0
// Updates of many random rooms with 0 to 40 % changed lamps: rates of false and of missed changes,
// and the covariance of the updated places.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "tests/survey/update_support.hpp"

namespace occ::test {
namespace {

std::vector<Vector3d> random_places(int count, Random& random) {
  std::vector<Vector3d> at;
  while (static_cast<int>(at.size()) < count) {
    const Vector3d next(random.uniform(0, 5), random.uniform(0, 4), random.uniform(2.5, 2.7));
    const auto is_near = [&](const Vector3d& other) { return (other - next).norm() < 0.6; };
    if (std::none_of(at.begin(), at.end(), is_near)) at.push_back(next);
  }
  return at;
}

/// A room of 11 to 17 lamps in which a share of up to 40 % moved, is gone or was added.
ChangedRoom changed_room(double share, double sigma_m, Random& random) {
  const int count = 11 + random.below(7);
  std::vector<Vector3d> at = random_places(count + 4, random);
  std::vector<Vector3d> spare(at.begin() + count, at.end());
  at.resize(static_cast<std::size_t>(count));
  ChangedRoom room;
  room.now = room_of(at);
  room.map = map_of(room.now, sigma_m, random);
  std::vector<Lamp> lamps;
  int changes = static_cast<int>(std::floor(share * count));
  for (Lamp& lamp : room.now.lamps) {
    const bool is_changed = random.below(count - lamp.id) < changes;
    changes -= is_changed;
    if (!is_changed) {
      lamps.push_back(lamp);
    } else if (random.uniform() < 0.6) {  // from 5 sigmas to 0.3 m
      const Vector3d along = Vector3d(random.normal(), random.normal(), 0.3 * random.normal());
      const double distance = 5 * sigma_m * std::pow(0.3 / (5 * sigma_m), random.uniform());
      room.moved[lamp.id] = distance * along.normalized();
      lamp.centre_m += room.moved[lamp.id];
      lamps.push_back(lamp);
    } else {
      room.gone.insert(lamp.id);
      if (spare.empty() || random.uniform() < 0.5) continue;
      lamp.id = 100 + lamp.id;
      lamp.centre_m = spare.back();
      room.added.insert(lamp.id);
      spare.pop_back();
      lamps.push_back(lamp);
    }
  }
  room.now.lamps = lamps;
  return room;
}

struct Rates {
  int rooms = 0, refused = 0, unchanged = 0, false_changes = 0, false_gone = 0;
  int moved = 0, found = 0, gone = 0, found_gone = 0, added = 0, false_added = 0, not_seen = 0;
  double nees = 0;
  int places = 0;
};

void add(Rates& rates, const ChangedRoom& room, const Result<MapUpdate>& found) {
  ++rates.rooms;
  if (!found.ok()) {
    ++rates.refused;
    std::cout << "refused: " << found.message << std::endl;
    return;
  }
  std::map<int, Vector3d> truth;
  for (const Lamp& lamp : room.now.lamps) truth[lamp.id] = lamp.centre_m;
  for (const LampUpdate& lamp : found->lamps) {
    const int id = lamp.lamp.id;
    if (lamp.fate == LampFate::not_seen) {
      ++rates.not_seen;
      continue;
    }
    if (id >= static_cast<int>(room.map.lamps.size())) {  // new, or a far move
      const bool is_real = std::any_of(truth.begin(), truth.end(), [&](const auto& one) {
        return (one.second - lamp.lamp.centre_m).norm() < 0.03 &&
               (room.added.count(one.first) > 0 || room.moved.count(one.first) > 0);
      });
      ++rates.added;
      rates.false_added += !is_real;
      continue;
    }
    if (room.gone.count(id) > 0) {
      ++rates.gone;
      rates.found_gone += lamp.fate == LampFate::gone || lamp.fate == LampFate::moved;
      continue;
    }
    if (room.moved.count(id) > 0) {
      const Vector3d& by = room.moved.at(id);
      const Vector3d along = by.normalized();
      if (lamp.has_test &&
          by.norm() < 5 * std::sqrt(along.dot(lamp.displacement_covariance_m2 * along)))
        continue;
      ++rates.moved;
      rates.found += lamp.fate == LampFate::moved || lamp.fate == LampFate::gone;
    } else {
      ++rates.unchanged;
      rates.false_changes += lamp.fate == LampFate::moved;
      rates.false_gone += lamp.fate == LampFate::gone || lamp.fate == LampFate::changed;
    }
    if (lamp.fate == LampFate::gone) continue;
    const Vector3d error = lamp.lamp.centre_m - truth.at(id);
    rates.nees += error.dot(lamp.covariance_m2.inverse() * error);
    ++rates.places;
  }
}

/// Removes blobs at random, as of lamps that people or goods hide.
void hide(std::vector<MadePicture>& made, double share, Random& random) {
  for (MadePicture& one : made) {
    std::vector<Blob> blobs;
    for (const Blob& blob : one.picture.blobs)
      if (random.uniform() >= share) blobs.push_back(blob);
    one.picture.blobs = std::move(blobs);
  }
}

void campaign(int seeds, double hidden = 0) {
  for (const double share : {0.0, 0.1, 0.25, 0.4}) {
    if (hidden > 0 && share > 0.3) continue;
    Rates rates;
    for (int seed = 1; seed <= seeds; ++seed) {
      Random random(static_cast<std::uint64_t>(seed), 91);
      const double sigma_m = seed % 2 == 0 ? 0.002 : 0.005;
      const ChangedRoom room = changed_room(share, sigma_m, random);
      auto made = walk(room.now, 25, static_cast<std::uint64_t>(seed) + 500);
      hide(made, hidden, random);
      add(rates, room, update_map(pictures_of(made), room.map, exact_options()));
    }
    std::cout << "share " << share << ": rooms " << rates.rooms << ", refused " << rates.refused
              << "; unchanged " << rates.unchanged << ", called moved " << rates.false_changes
              << ", called gone or changed " << rates.false_gone << "; moved " << rates.moved
              << ", found " << rates.found << "; gone " << rates.gone << ", found "
              << rates.found_gone << "; added " << rates.added << ", false " << rates.false_added
              << "; not seen " << rates.not_seen << "; nees " << rates.nees / rates.places / 3
              << std::endl;
    EXPECT_LE(rates.refused, (hidden > 0 ? 0.05 : 0.02) * rates.rooms);
    EXPECT_LE(rates.false_changes, 0.01 * rates.unchanged);
    EXPECT_LE(rates.false_gone, 0.01 * rates.unchanged);
    EXPECT_GE(rates.found, 0.95 * rates.moved);
    EXPECT_GE(rates.found_gone, 0.95 * rates.gone);
    EXPECT_LE(rates.false_added, 0.01 * rates.unchanged);
    EXPECT_LT(rates.not_seen, 0.2 * rates.unchanged);
    EXPECT_NEAR(rates.nees / rates.places / 3, 1, seeds < 20 ? 0.6 : 0.2);
  }
}

/// Regular maps of which a share of the lamps is dark today: no link may be wrong.
void grid_campaign(int seeds, bool ordered = true) {
  for (const bool has_prior : {false, true}) {
    int ok = 0, ambiguous = 0, wrong = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      Random random(static_cast<std::uint64_t>(seed), 92);
      std::vector<Vector3d> at;
      const double gaps = seed % 3 == 0 ? 0.2 : 0;  // a third of the maps has gaps
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 4; ++j)
          if (random.uniform() >= gaps)
            at.push_back({1.2 * i + 0.003 * random.normal(), j + 0.003 * random.normal(), 2.7});
      Scene now = room_of(at);
      const Scene map = map_of(now, 0.003, random);
      const auto is_dark = [&](const Lamp&) { return random.uniform() < 0.1 * (seed % 3); };
      now.lamps.erase(std::remove_if(now.lamps.begin(), now.lamps.end(), is_dark), now.lamps.end());
      std::vector<Rigid3> poses;
      const auto made = video(now, 30, static_cast<std::uint64_t>(seed), poses);
      UpdateOptions options = exact_options();
      options.survey.ordered = ordered;
      if (has_prior) {
        options.prior.emplace();
        options.prior->position_m = poses[0].origin_in_source();
        options.prior->position_sigma_m = 0.1;
        options.prior->heading_rad = heading_rad(poses[0]);
      }
      const auto found = update_map(pictures_of(made), map, options);
      ok += found.ok();
      ambiguous += found.status == Status::ambiguous;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        const auto& pose = found->cam_from_world[i];
        if (!pose) continue;
        const double error_m = (pose->origin_in_source() - poses[i].origin_in_source()).norm();
        wrong += error_m > 0.05;
        if (error_m > 0.05) break;
      }
    }
    std::cout << "grids" << (has_prior ? " with a prior" : "") << ": " << seeds << ", ok " << ok
              << ", ambiguous " << ambiguous << ", wrong " << wrong << std::endl;
    EXPECT_EQ(wrong, 0);
    EXPECT_GE(ok, has_prior && ordered ? 0.8 * seeds : 0);
    EXPECT_GE(ok + ambiguous, 0.8 * seeds);
  }
}

TEST(UpdateRooms, AreNotLinkedWronglyToGrids) { grid_campaign(3); }

TEST(SlowUpdateRooms, AreNotLinkedWronglyToGrids) { grid_campaign(60); }

TEST(SlowUpdateRooms, OfUnorderedPicturesAreNotLinkedWronglyToGrids) { grid_campaign(60, false); }

TEST(UpdateRooms, OfPicturesThatOnlyTheMapJoins) {
  Random random(20, 91);
  const ChangedRoom room = changed_room(0, 0.002, random);
  auto made = walk(room.now, 25, 520);
  hide(made, 0.2, random);
  EXPECT_EQ(survey(pictures_of(made), room.map.camera).status, Status::no_pose);
  Rates rates;
  add(rates, room, update_map(pictures_of(made), room.map, exact_options()));
  EXPECT_EQ(rates.refused, 0);
  EXPECT_EQ(rates.false_changes + rates.false_gone + rates.false_added, 0);
  EXPECT_GT(rates.unchanged - rates.not_seen, 0.8 * static_cast<double>(room.map.lamps.size()));
}

TEST(UpdateRooms, FindChangesOnly) { campaign(4); }

TEST(SlowUpdateRooms, DoNotLoseHiddenLamps) { campaign(60, 0.2); }

TEST(SlowUpdateRooms, FindChangesOnly) { campaign(60); }

}  // namespace
}  // namespace occ::test
