// SPDX-License-Identifier: Apache-2.0
// Rooms in which a beam that is not on the map hides parts of the lamps.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "libocc/detect/detect.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/locate/internal/detect_options.hpp"
#include "libocc/locate/internal/hidden_sides.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/internal/rectangle_corners.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene room_of_discs() {
  Lamp lamp;
  lamp.radius_m = 0.14;
  lamp.power_w = 3;
  return test::ceiling_of_six(lamp);
}

Scene room_of_panels() {
  Lamp lamp;
  lamp.shape = LampShape::rectangle;
  lamp.x_axis = Eigen::Vector3d::UnitX();
  lamp.size_m = {0.3, 0.25};
  lamp.power_w = 3;
  return test::ceiling_of_six(lamp);
}

/// The panels of room_of_panels() as polygons.
Scene room_of_polygons() {
  Scene scene = room_of_panels();
  for (Lamp& lamp : scene.lamps) {
    lamp.shape = LampShape::polygon;
    lamp.size_m.setZero();
    lamp.corners_m = {{-0.15, -0.12}, {0.15, -0.12}, {0.1, 0.14}, {-0.1, 0.14}};
  }
  scene.validate();
  return scene;
}

struct Beams {
  int ok = 0, used_in_part = 0, wrong = 0, named = 0, lost = 0;
};

/// Locates a camera below beams of random places and widths of 0.15 to 0.5 m.
Beams locate_below_beams(const Scene& map, int count, const DetectOptions& options) {
  constexpr double unlikely_chi2 = 21.1;  // 1e-4 at three degrees of freedom
  Random random(3);
  Beams beams;
  for (int i = 0; i < count; ++i) {
    const double middle_m = random.uniform(-1, 0.9), half_m = random.uniform(0.07, 0.25);
    Scene room = map;
    room.boxes.push_back({{-3, middle_m - half_m, 2.3}, {3, middle_m + half_m, 2.45}});
    const Rigid3 pose = test::upward_view(random, 0.3, 0.1);
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(i);
    const Image image = simulate(room, pose, simulation).image;
    const Result<Fix> fix = locate(detect(image.view(), options), map);
    const auto is_wrong = [&](const Candidate& candidate) {
      return test::nees(candidate.position_m - pose.origin_in_source(),
                        position_covariance(candidate.cam_from_world, candidate.covariance)) >
             unlikely_chi2;
    };
    if (fix.status == Status::ambiguous)
      beams.lost += std::all_of(fix->candidates.begin(), fix->candidates.end(), is_wrong);
    if (fix.status != Status::ok) continue;
    ++beams.ok;
    beams.wrong += is_wrong(fix->candidates.front());
    int in_part = 0;
    for (const auto& [id, blob] : fix->lamps) in_part += blob.hidden_in_part;
    beams.used_in_part += in_part;
    beams.named += in_part > 0 && fix.message.find("visible sides") != std::string::npos;
  }
  return beams;
}

TEST(HiddenLamps, VisibleRimsLocateMoreImages) {
  const Scene map = room_of_discs();
  DetectOptions options = internal::locate::detect_options_of(map, {});
  const Beams by_visible_rims = locate_below_beams(map, 120, options);
  options.discs = false;
  const Beams without = locate_below_beams(map, 120, options);
  EXPECT_GE(by_visible_rims.used_in_part, 12);
  EXPECT_EQ(without.used_in_part, 0);
  EXPECT_GT(by_visible_rims.ok, without.ok);
  EXPECT_EQ(by_visible_rims.wrong, 0);
}

// Without hidden sides, 28 of 100 views of the panels are located. Without another try that leaves
// out one outline, 69 of the polygons: their hypotheses have wrong names.
TEST(HiddenLamps, VisibleSidesLocateMoreImages) {
  struct Room {
    Scene map;
    int min_ok;
  };
  for (const auto& [map, min_ok] : {Room{room_of_panels(), 55}, Room{room_of_polygons(), 74}}) {
    const DetectOptions options = internal::locate::detect_options_of(map, {});
    const Beams beams = locate_below_beams(map, 100, options);
    EXPECT_GE(beams.ok, min_ok);
    EXPECT_GE(beams.named, 20);
    EXPECT_GE(beams.used_in_part, beams.named);
    EXPECT_EQ(beams.wrong, 0);
    EXPECT_LE(beams.lost, 1);  // a single lamp, with a side that the beam has moved, fits poorly
  }
}

/// Blobs of the panels in view, whose outlines are exact, with their hypothesis.
struct SeenPanels {
  Scene scene = room_of_panels();
  Rigid3 pose = look_at({0.1, 0.05, 0.4}, {0.1, 0, 2.6}, Eigen::Vector3d::UnitY());
  std::vector<Blob> blobs;
  Hypothesis hypothesis;

  SeenPanels() {
    for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
      std::vector<Eigen::Vector2d> corners;
      const Eigen::Matrix<double, 3, 4> offsets =
          internal::scene::rectangle_corners(scene.lamps[i]);
      for (const auto& offset : offsets.colwise()) {
        const auto px = scene.camera.project(pose * (scene.lamps[i].centre_m + offset));
        if (px && px->minCoeff() > 0 && px->x() < 639 && px->y() < 479) corners.push_back(*px);
      }
      if (corners.size() != 4) continue;
      hypothesis.matches.push_back({static_cast<int>(i), static_cast<int>(blobs.size())});
      blobs.push_back(blob_of(corners));
    }
    hypothesis.cam_from_world =
        perturb(pose, (Vector6() << 0.01, -0.01, 0.005, 0.02, -0.02, 0.01).finished());
  }

  /// With ten rim points on each side.
  static Blob blob_of(const std::vector<Eigen::Vector2d>& corners) {
    constexpr int points = 10;
    Blob blob;
    blob.corners_px = corners;
    blob.x1 = blob.y1 = 40;
    blob.covariance_px2 = 1e-4 * Eigen::Matrix2d::Identity();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector2d along = corners[(i + 1) % corners.size()] - corners[i];
      blob.centroid_px += corners[i] / static_cast<double>(corners.size());
      for (int k = 0; k < points; ++k)
        blob.rim.push_back({corners[i] + (k + 0.5) / points * along,
                            Eigen::Vector2d(along.y(), -along.x()).normalized(), 0.03});
    }
    return blob;
  }

  /// Moves a side of a blob inwards, as an edge in front of the lamp does.
  void move_side(std::size_t blob, std::size_t side, double inwards_px) {
    std::vector<Eigen::Vector2d> corners = blobs[blob].corners_px;
    Eigen::Vector2d &from = corners[side], &to = corners[(side + 1) % 4];
    const Eigen::Vector2d before = corners[(side + 3) % 4], after = corners[(side + 2) % 4];
    from += inwards_px * (before - from).normalized();
    to += inwards_px * (after - to).normalized();
    blobs[blob] = blob_of(corners);
  }

  std::optional<std::vector<Blob>> marked() const {
    return internal::locate::mark_hidden_sides(hypothesis, blobs, scene, std::nullopt);
  }
};

TEST(HiddenSides, AreFoundByTheMajority) {
  SeenPanels seen;
  ASSERT_GE(seen.blobs.size(), 4u);
  EXPECT_FALSE(seen.marked());
  seen.move_side(0, 1, 6);
  seen.move_side(1, 3, 20);
  const auto marked = seen.marked();
  ASSERT_TRUE(marked);
  for (std::size_t i = 0; i < seen.blobs.size(); ++i) {
    const Blob& blob = (*marked)[i];
    EXPECT_EQ(blob.hidden_in_part, i < 2);
    EXPECT_EQ(blob.has_hidden_sides(), i < 2);
    EXPECT_EQ(blob.rim.size(), i < 2 ? 30u : 40u);
    EXPECT_EQ(blob.covariance_px2.trace() > 100, i < 2);
    EXPECT_EQ(blob.corners_px, seen.blobs[i].corners_px);
  }
}

// Nothing that hides a part of a lamp makes it larger.
TEST(HiddenSides, ALargerBlobIsAnotherLight) {
  SeenPanels seen;
  seen.move_side(0, 1, -6);
  seen.move_side(1, 3, 20);
  EXPECT_FALSE(seen.marked());
}

TEST(HiddenSides, TooFewSidesExplainNothing) {
  SeenPanels seen;
  seen.hypothesis.matches.resize(1);
  for (const std::size_t side : {0, 1, 2}) seen.move_side(0, side, 8);
  EXPECT_FALSE(seen.marked());
  seen.scene.lamps[0].shape = LampShape::disc;  // without sides
  EXPECT_FALSE(seen.marked());
}

// The pose of a hypothesis with hidden sides is as accurate as its visible sides allow.
TEST(HiddenSides, VisibleSidesRefineThePose) {
  SeenPanels seen;
  seen.hypothesis.matches.resize(3);
  seen.move_side(0, 1, 6);
  seen.move_side(1, 3, 20);
  const auto marked = seen.marked();
  ASSERT_TRUE(marked);
  const auto error_m = [&](const std::vector<Blob>& blobs) {
    const auto refined =
        refine(seen.hypothesis.cam_from_world, seen.hypothesis.matches, blobs, seen.scene);
    return refined.ok()
               ? (refined->cam_from_world.origin_in_source() - seen.pose.origin_in_source()).norm()
               : 1;
  };
  EXPECT_LT(error_m(*marked), 1e-6);
  EXPECT_GT(error_m(seen.blobs), 1e-3);
}

}  // namespace
}  // namespace occ
