// SPDX-License-Identifier: Apache-2.0
// An ambiguous result describes the symmetry of the map: the rotation, translation or flip from the
// best hypothesis to a rival.
#include <set>

#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using test::upright;
using test::View;

Scene room_of(const std::vector<Vector3d>& places) {
  Scene scene = test::irregular_room();
  scene.lamps.clear();
  for (const Vector3d& p : places)
    scene.lamps.push_back(test::disc_lamp(static_cast<int>(scene.lamps.size()), p));
  return scene;
}

/// Each rival's symmetry maps the lamps and camera of the best hypothesis to its own.
void expect_symmetries_hold(const Result<Identification>& found, const std::vector<Lamp>& lamps) {
  ASSERT_EQ(found.status, Status::ambiguous);
  ASSERT_GE(found->hypotheses.size(), 2u);
  const Hypothesis& best = found->hypotheses.front();
  EXPECT_FALSE(best.symmetry);
  for (std::size_t i = 1; i < found->hypotheses.size(); ++i) {
    const Hypothesis& rival = found->hypotheses[i];
    ASSERT_TRUE(rival.symmetry);
    const Rigid3& moved = rival.symmetry->world_from_world;
    EXPECT_TRUE(test::pose_is_near(best.cam_from_world * moved.inverse(), rival.cam_from_world));
    EXPECT_NE(found.message.find(found->hypotheses[1].symmetry->text), std::string::npos);
    if (rival.symmetry->kind == SymmetryKind::planar_flip) continue;
    for (const Match& a : best.matches)
      for (const Match& b : rival.matches) {
        const Vector3d misfit = moved * lamps[a.lamp].centre_m - lamps[b.lamp].centre_m;
        EXPECT_TRUE(a.blob != b.blob || misfit.norm() < 3 * rival.symmetry->misfit_m + 1e-9);
      }
  }
}

std::multiset<std::string> texts(const Identification& found) {
  std::multiset<std::string> texts;
  for (const Hypothesis& h : found.hypotheses)
    if (h.symmetry) texts.insert(h.symmetry->text);
  return texts;
}

TEST(IdentifySymmetryMotion, ASquareTurns) {
  Scene scene = test::square_room();
  Random random(1);
  const View view = test::random_view(scene, random, 4);
  const Result<Identification> found = identify(view.blobs, scene);
  expect_symmetries_hold(found, scene.lamps);
  EXPECT_EQ(texts(found.value), (std::multiset<std::string>{
                                    "rotation by 180 deg about the vertical axis through (2, 2)",
                                    "rotation by 90 deg about the vertical axis through (2, 2)",
                                    "rotation by -90 deg about the vertical axis through (2, 2)"}));
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_EQ(found->hypotheses[i].symmetry->kind, SymmetryKind::rotation);
  EXPECT_NE(found.message.find("rotation by 180 deg"), std::string::npos) << found.message;
}

TEST(IdentifySymmetryMotion, TheWorldMayBeFarAway) {
  Scene scene = test::square_room();
  for (Lamp& lamp : scene.lamps) lamp.centre_m += Vector3d(5000, -3000, 100);
  Random random(1);
  Rigid3 pose = upright({5002.2, -2998.1, 100.2}, 0.3);
  const View view = test::see(scene, pose, random, 0.05);
  const Result<Identification> found = identify(view.blobs, scene);
  expect_symmetries_hold(found, scene.lamps);
  EXPECT_EQ(
      texts(found.value).count("rotation by 180 deg about the vertical axis through (5002, -2998)"),
      1u)
      << found.message;
}

// Two identical groups 6 m apart; one of them is visible.
TEST(IdentifySymmetryMotion, LikeGroupsAreAShiftApart) {
  const std::vector<Vector3d> group{
      {1, 1, 3}, {1.5, 1.1, 3}, {1.2, 1.6, 2.8}, {1.7, 1.8, 3}, {0.9, 1.9, 3}};
  std::vector<Vector3d> places = group;
  for (const Vector3d& p : group) places.push_back(p + Vector3d(6, 0, 0));
  const Scene scene = room_of(places);
  Random random(2);
  const View view = test::see(scene, upright({1.3, 1.5, 0.3}, 0.3), random, 0.05);
  ASSERT_EQ(view.blobs.size(), 5u);
  const Result<Identification> found = identify(view.blobs, scene);
  expect_symmetries_hold(found, scene.lamps);
  ASSERT_EQ(found->hypotheses.size(), 2u);
  const Symmetry& s = *found->hypotheses[1].symmetry;
  EXPECT_EQ(s.kind, SymmetryKind::translation);
  EXPECT_TRUE(s.text == "translation by (6, 0, 0) m" || s.text == "translation by (-6, 0, 0) m")
      << s.text;
}

// An identical group one storey above, rotated: a screw.
TEST(IdentifySymmetryMotion, ATurnedGroupAboveIsAScrewApart) {
  const std::vector<Vector3d> group{
      {1, 1, 3}, {1.5, 1.1, 3}, {1.2, 1.6, 2.8}, {1.7, 1.8, 3}, {0.9, 1.9, 3}};
  const Rigid3 up{so3_exp({0, 0, 0.5}), {0, 0, 4}};
  std::vector<Vector3d> places = group;
  for (const Vector3d& p : group) places.push_back(up * p);
  const Scene scene = room_of(places);
  Random random(3);
  View view = test::see(scene, upright({1.3, 1.5, 0.3}, 0.3), random, 0.05);
  for (int i = static_cast<int>(view.blobs.size()) - 1; i >= 0; --i)
    if (view.lamp[i] >= 5) test::hide(view, i);  // hidden by a floor
  IdentifyOptions options;
  options.miss_penalty = 0;
  const Result<Identification> found = identify(view.blobs, scene, options);
  expect_symmetries_hold(found, scene.lamps);
  ASSERT_EQ(found->hypotheses.size(), 2u);
  EXPECT_EQ(found->hypotheses[1].symmetry->kind, SymmetryKind::screw);
  EXPECT_NE(found->hypotheses[1].symmetry->text.find("translation by"), std::string::npos);
}

// The square is regular except for 5 mm.
TEST(IdentifySymmetryMotion, ReportsHowNearlyTheMapRepeats) {
  Scene scene = test::square_room();
  scene.lamps[0].centre_m.x() += 0.005;
  Random random(4);
  const View view = test::random_view(scene, random, 4);
  const Result<Identification> found = identify(view.blobs, scene);
  expect_symmetries_hold(found, scene.lamps);
  const Symmetry& s = *found->hypotheses[1].symmetry;
  EXPECT_NE(s.text.find(", to within "), std::string::npos) << s.text;
  EXPECT_GT(s.misfit_m, 0.001);
  EXPECT_LT(s.misfit_m, 0.005);
}

/// The motion between five lamps and their moved copy elsewhere, of which one is in view. One lamp
/// of the copy is off by `off_m`.
struct MovedCopy {
  bool is_found = false;
  double spread_m = 0;
  Symmetry symmetry;

  MovedCopy(const Rigid3& moved, double off_m, double low_m = 0.3) {
    std::vector<Vector3d> group{
        {1, 1, 3}, {1.5, 1.1, 3}, {1.2, 1.6, 2.8}, {1.7, 1.8, 3}, {0.9, 1.9, 3}};
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& p : group) mean += p / 5;
    for (const Vector3d& p : group) spread_m += (p - mean).squaredNorm() / 5;
    spread_m = std::sqrt(spread_m);
    std::vector<Vector3d> places = group;
    for (const Vector3d& p : group) places.push_back(moved * (p - mean) + mean);
    places.back() += off_m * Vector3d(0.6, 0.8, 0);
    const Scene scene = room_of(places);
    Random random(6);
    const View view = test::see(scene, upright({1.3, 1.5, low_m}, 0.3), random, 0.01);
    IdentifyOptions options;
    options.model_sigma_px = 1.2;
    const Result<Identification> found = identify(view.blobs, scene, options);
    EXPECT_EQ(view.blobs.size(), 5u);
    is_found = found->hypotheses.size() == 2;
    if (is_found) symmetry = *found->hypotheses[1].symmetry;
  }
};

TEST(IdentifySymmetryMotion, SmallTurnsAndShiftsAreNone) {
  for (const double turn_rad : {0.008, 0.0095, 0.0105, 0.013}) {
    const MovedCopy copy({so3_exp({0, 0, turn_rad}), {8, 0, 0}}, 0);
    EXPECT_EQ(copy.symmetry.kind,
              turn_rad < 0.01 ? SymmetryKind::translation : SymmetryKind::rotation);
  }
  const double spread_m = MovedCopy({so3_exp({0, 0, 0.3}), {8, 0, 0}}, 0).spread_m;
  for (const double along : {0.015, 0.019, 0.021, 0.025}) {
    const MovedCopy copy({so3_exp({0, 0, 0.3}), {8, 0, along * spread_m}}, 0);
    EXPECT_EQ(copy.symmetry.kind, along < 0.02 ? SymmetryKind::rotation : SymmetryKind::screw);
  }
}

TEST(IdentifySymmetryMotion, AMisfitOfAThousandthOfItsSizeIsNamed) {
  int exact = 0, near = 0;
  for (int i = 0; i < 40; ++i) {
    const MovedCopy copy({Eigen::Matrix3d::Identity(), {8, 0, 0}}, 4e-4 * std::exp(0.14 * i), -3);
    if (!copy.is_found) continue;
    const double misfit = copy.symmetry.misfit_m / copy.spread_m;
    const bool repeats = copy.symmetry.kind != SymmetryKind::none;
    const bool is_named = copy.symmetry.text.find(", to within ") != std::string::npos;
    EXPECT_EQ(repeats, misfit < 0.05) << misfit;
    EXPECT_EQ(is_named, repeats && misfit > 1e-3) << misfit;
    exact += misfit > 0.7e-3 && misfit < 1e-3;
    near += misfit > 1e-3 && misfit < 1.4e-3;
  }
  EXPECT_GT(exact, 0);
  EXPECT_GT(near, 0);
}

// Three coded lamps: up to four poses fit them.
TEST(IdentifySymmetryMotion, OneAssignmentFromTwoPosesIsAFlip) {
  Scene scene = room_of({{1.6, 1.6, 3}, {2.4, 1.6, 3}, {2, 2.3, 3}});
  for (std::size_t i = 0; i < 3; ++i)
    scene.lamps[i].frequency_hz = 1000.0 * static_cast<double>(i + 1);
  Random random(5);
  int flips = 0;
  for (int trial = 0; trial < 200; ++trial) {
    View view = test::random_view(scene, random, 3);
    for (std::size_t i = 0; i < view.blobs.size(); ++i) {
      view.blobs[i].frequency_hz = *scene.lamps[view.lamp[i]].frequency_hz;
      view.blobs[i].frequency_sigma_hz = 1;
    }
    const Result<Identification> found = identify(view.blobs, scene);
    if (found->hypotheses.size() < 2) continue;
    expect_symmetries_hold(found, scene.lamps);
    for (std::size_t i = 1; i < found->hypotheses.size(); ++i) {
      EXPECT_EQ(found->hypotheses[i].symmetry->kind, SymmetryKind::planar_flip);
      ++flips;
    }
  }
  EXPECT_GT(flips, 10);
}

}  // namespace
}  // namespace occ
