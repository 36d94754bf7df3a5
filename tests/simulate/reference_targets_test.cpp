// SPDX-License-Identifier: Apache-2.0
// Images of random calibration targets and of sensor noise, compared with those of an earlier
// version.
#include <gtest/gtest.h>

#include "libocc/landmarks/april_tags.hpp"
#include "libocc/simulate/renderer.hpp"
#include "tests/simulate/reference_scenes.hpp"

namespace occ::test {
namespace {

Eigen::Vector3d random_place(Random& random) {
  return {random.uniform(-1, 1), random.uniform(-0.3, 0.3), random.uniform(-0.7, 0.7)};
}

// A board near the wall y = 0 that faces negative y. `up`: its y axis is up, not down.
Rigid3 random_board(Random& random, bool up) {
  Rigid3 pose;
  pose.rotation << 1, 0, 0, 0, 0, up ? -1 : 1, 0, up ? 1 : -1, 0;
  pose.rotation = so3_exp(0.3 * random_vector(random)) * pose.rotation;
  pose.translation = random_place(random) - pose.rotation * Eigen::Vector3d(0.2, 0.2, 0);
  return pose;
}

void add_tags(TargetField& field, Random& random) {
  const char* families[] = {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12", "tag36h10"};
  for (int i = 0; i < 3; ++i) {
    Tag tag = field_tag(random.below(25), random_place(random),
                        Eigen::Vector3d(0, -1, 0) + 0.4 * random_vector(random),
                        random.uniform(0.1, 0.5));
    tag.family = families[random.below(5)];
    field.tags.push_back(tag);
  }
}

void add_discs(TargetField& field, Random& random) {
  for (int i = 0; i < 3; ++i) {
    CircularTarget disc;
    disc.id = i;
    disc.radius_m = random.uniform(0.03, 0.15);
    disc.sheet_m = happens(random, 0.5) ? 0 : 2.3 * disc.radius_m;
    disc.dark = happens(random, 0.5);
    disc.centre_m = random_place(random);
    disc.normal = Eigen::Vector3d(0, -1, 0) + 0.4 * random_vector(random);
    field.circles.push_back(disc);
  }
}

TargetField random_field(Random& random) {
  TargetField field;
  if (happens(random, 0.5)) add_tags(field, random);
  if (happens(random, 0.5)) add_discs(field, random);
  if (happens(random, 0.3))
    field.boards.push_back({2 + random.below(5), 2 + random.below(5), random.uniform(0.04, 0.1),
                            random_board(random, false)});
  if (happens(random, 0.3)) {
    CircleGridTarget grid;
    grid.columns = 2 + random.below(3);
    grid.rows = 2 + random.below(4);
    grid.asymmetric = happens(random, 0.5);
    grid.spacing_m = random.uniform(0.06, 0.12);
    grid.radius_m = random.uniform(0.2, 0.45) * grid.spacing_m;
    grid.dark = happens(random, 0.5);
    grid.world_from_board = random_board(random, false);
    field.grids.push_back(grid);
  }
  if (happens(random, 0.3)) {
    AprilGridTarget grid;
    grid.board.columns = 2 + random.below(2);
    grid.board.rows = 2 + random.below(2);
    grid.board.tag_size_m = random.uniform(0.1, 0.2);
    grid.board.spacing = random.uniform(0.2, 0.4);
    grid.board.border_cells = 1 + random.below(3);
    grid.board.family = happens(random, 0.5) ? "tag36h11" : "tag25h9";
    grid.world_from_board = random_board(random, true);
    field.april_grids.push_back(grid);
  }
  if (field.tags.empty() || happens(random, 0.3)) {
    CharucoTarget target;
    target.board.columns = 3 + random.below(3);
    target.board.rows = 3 + random.below(3);
    target.board.square_m = random.uniform(0.08, 0.15);
    target.board.marker_m = 0.75 * target.board.square_m;
    target.board.legacy = happens(random, 0.5);
    target.board.family = "tag16h5";
    target.world_from_board = random_board(random, false);
    field.charucos.push_back(target);
  }
  return field;
}

TargetImageOptions random_image_options(Random& random) {
  TargetImageOptions options;
  options.psf_sigma_px = random.uniform(0.3, 1.5);
  options.black_dn = random.uniform(0, 20);
  options.white_dn = random.uniform(200, 255);
  options.ground_dn = random.uniform(60, 150);
  options.margin_cells = random.uniform(0, 1);
  options.noise_dn = happens(random, 0.4) ? random.uniform(1, 9) : 0;
  options.seed = static_cast<std::uint64_t>(random.below(99));
  options.frame = static_cast<std::uint32_t>(random.below(99));
  return options;
}

void add_points(CaseResults& results, bool in_view, bool whole, const Eigen::Matrix2Xd& px) {
  const Eigen::VectorXd all = px.reshaped();
  std::vector<double> numbers{static_cast<double>(in_view), static_cast<double>(whole)};
  numbers.insert(numbers.end(), all.begin(), all.end());
  results.summarise("target", numbers);
}

void add_target_truth(CaseResults& results, const TargetTruth& truth) {
  for (const TagTruth& tag : truth.tags) {
    Eigen::Matrix2Xd px(2, 4);
    for (Eigen::Index k = 0; k < 4; ++k) px.col(k) = tag.corners_px[static_cast<std::size_t>(k)];
    add_points(results, tag.in_view, tag.whole, px);
  }
  for (const CircleTruth& disc : truth.circles) {
    Eigen::Matrix2Xd px(2, 2);
    px << disc.centre_px, disc.image_centre_px;
    add_points(results, disc.in_view, disc.whole, px);
  }
  for (const ChessboardTruth& board : truth.boards)
    add_points(results, board.in_view, board.whole, board.corners_px);
  for (const CircleGridTruth& grid : truth.grids)
    add_points(results, grid.in_view, grid.whole, grid.centres_px);
  for (const MarkerBoardTruth& board : truth.april_grids)
    add_points(results, board.in_view, board.whole, board.points_px);
  for (const MarkerBoardTruth& board : truth.charucos)
    add_points(results, board.in_view, board.whole, board.points_px);
}

Camera target_camera(int kind) {
  if (kind == 0) return Camera::pinhole(160, 120, 110, 111, 80, 59, {-0.2, 0.06, 8e-4, -5e-4});
  if (kind == 1) return Camera::fisheye(160, 120, 80, 80, 79, 61, {0.03, -0.005});
  if (kind == 2) return Camera::rotating_line(small_line(500, 160));
  return Camera::equirectangular(400, 150, 2 * pi / 400, 70, 199.5, 70);
}

TEST(References, ImagesOfTargets) {
  References references("simulate/targets");
  for (int i = 0; i < 160; ++i) {
    Random random(8, static_cast<std::uint64_t>(i));
    const TargetField field = random_field(random);
    const Camera camera = target_camera(i % 4);
    const Eigen::Vector3d eye(random.uniform(-0.5, 0.5), random.uniform(-2, -1), 0.1);
    // The wall is ahead of a panorama, or across its seam.
    const Rigid3 pose = i % 4 < 2 ? towards_wall(eye, random.uniform(-3, 3))
                                  : upright_line(eye, i % 8 < 4 ? pi / 2 : -pi / 2);
    const TargetRenderer renderer(field, camera, pose, random_image_options(random));
    CaseResults results;
    add_image(results, renderer.window({0, 0, camera.width(), camera.height()}));
    add_image(results, renderer.window({37, 21, 60, 50}));
    add_target_truth(results, renderer.truth());
    references.add("field " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PatternsOfTags) {
  References references("simulate/tag_patterns");
  for (const std::string& family : april_tag_families())
    for (const int id : {0, 3, 17, 28}) {
      const bool is_classic = family[3] <= '9';
      CaseResults results;
      for (int border = 1; border <= (is_classic ? 4 : 1); ++border) {
        const TagPattern pattern = tag_pattern(family, id, border);
        std::vector<double> cells{static_cast<double>(pattern.square_cells)};
        for (const bool black : pattern.black.reshaped()) cells.push_back(black);
        results.summarise("cells", cells);
      }
      references.add(family + "-" + std::to_string(id), results);
    }
  EXPECT_EQ(references.differences(), "");
}

// Images large enough for rare random numbers; each with its own sensor.
TEST(References, NoisyImages) {
  References references("simulate/noise");
  for (int i = 0; i < 60; ++i) {
    Random random(9, static_cast<std::uint64_t>(i));
    Scene scene;
    scene.camera = Camera::pinhole(150 + random.below(40), 100 + random.below(9), 150, 150, 75, 50);
    scene.lamps = {disc_lamp(3, {0, 0, 1.5}, 0.2), disc_lamp(4, {0.4, 0.2, 1.5}, 0.08)};
    scene.lamps[1].power_w = 0.1;
    randomise_sensor(scene, random);
    Sensor& sensor = scene.sensor;
    sensor.bit_depth = i % 3 == 0 ? 8 : i % 3 == 1 ? 12 : 16;
    sensor.read_noise_e = i % 5 == 0 ? 0 : log_uniform(random, 0.3, 40);
    sensor.full_well_e = log_uniform(random, 30, i % 10 == 0 ? 1e10 : 1e5);
    // Electrons of the dark from 0 to the full well.
    sensor.dark_current_e_per_s =
        i % 4 == 0 ? 0 : sensor.full_well_e * log_uniform(random, 1e-4, 1.2) / sensor.exposure_s;
    sensor.gain_dn_per_e = 0.9 * sensor.full_scale_dn() / sensor.full_well_e;
    if (i % 2 == 0) sensor.gain_dn_per_e *= log_uniform(random, 0.01, 10);
    const double scale =
        log_uniform(random, 0.01, 2) * sensor.full_well_e / brightest_e(scene, Rigid3());
    for (Lamp& lamp : scene.lamps) lamp.power_w *= scale;
    if (i % 7 == 0) scene.ambient_w_m2 = 1e-4;
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(random.below(1 << 30)) << (i % 2 == 0 ? 0 : 20);
    options.frame = static_cast<std::uint32_t>(random.below(1000));
    options.noise_area = i % 6 == 1 ? NoiseArea::around_lamps : NoiseArea::everywhere;
    CaseResults results;
    add_image(results, simulate(scene, Rigid3(), options).image);
    references.add("sensor " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
