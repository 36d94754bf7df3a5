// SPDX-License-Identifier: Apache-2.0
// Grids of discs: centres of rendered ellipses agree with the reported covariances, and the centre
// of an ellipse is not the image of the disc's centre.
#include "libocc/landmarks/circle_grid.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "libocc/simulate/targets.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

const Camera& disc_camera() {
  static const Camera camera =
      Camera::pinhole(800, 600, 700, 703, 401.3, 297.6, {-0.2, 0.06, 1e-3, 0});
  return camera;
}

/// A grid in the middle of the image at 0.5 m, rotated about its middle.
CircleGridTarget grid_at(bool asymmetric, const Eigen::Vector3d& turn, double distance_m = 0.5) {
  CircleGridTarget grid;
  grid.asymmetric = asymmetric;
  grid.columns = asymmetric ? 4 : 7;
  grid.rows = asymmetric ? 11 : 5;
  grid.spacing_m = asymmetric ? 0.02 : 0.03;
  grid.radius_m = asymmetric ? 0.009 : 0.009;
  const Eigen::Vector3d middle =
      0.5 * (grid.centres_m().rowwise().minCoeff() + grid.centres_m().rowwise().maxCoeff());
  grid.world_from_board.rotation = so3_exp(turn);
  grid.world_from_board.translation =
      Eigen::Vector3d(0, 0, distance_m) - grid.world_from_board.rotation * middle;
  return grid;
}

TargetRenderer renderer_of(const CircleGridTarget& grid, double noise_dn = 2,
                           std::uint64_t seed = 0) {
  TargetField field;
  field.grids = {grid};
  TargetImageOptions options;
  options.noise_dn = noise_dn;
  options.seed = seed;
  return TargetRenderer(field, disc_camera(), {}, options);
}

std::optional<CircleGridPoints> found_in(const TargetRenderer& renderer,
                                         const CircleGridTarget& grid) {
  CircleGridOptions options;
  options.columns = grid.columns;
  options.rows = grid.rows;
  options.asymmetric = grid.asymmetric;
  return find_circle_grid(renderer.window({0, 0, 800, 600}).view(), options);
}

/// Centroids of the images of the discs, from renderings of each disc.
Eigen::Matrix2Xd image_centres(const CircleGridTarget& grid) {
  const Eigen::Matrix3Xd centres = grid.centres_m();
  TargetField field;
  for (Eigen::Index i = 0; i < centres.cols(); ++i) {
    CircularTarget disc;
    disc.radius_m = grid.radius_m;
    disc.centre_m = grid.world_from_board * Eigen::Vector3d(centres.col(i));
    disc.normal = -grid.world_from_board.rotation.col(2);
    field.circles.push_back(disc);
  }
  const TargetRenderer renderer(field, disc_camera(), {}, {});
  Eigen::Matrix2Xd px(2, centres.cols());
  for (Eigen::Index i = 0; i < centres.cols(); ++i)
    px.col(i) = renderer.truth().circles[static_cast<std::size_t>(i)].image_centre_px;
  return px;
}

TEST(CircleGrid, IsFoundInItsOrderInAnyRotation) {
  for (const bool asymmetric : {true, false})
    for (const double turn : {0.0, 0.7, 1.5, 2.6, 4.0, 5.5}) {
      const CircleGridTarget grid = grid_at(asymmetric, {0.3, 0.2, turn});
      const TargetRenderer renderer = renderer_of(grid);
      const auto found = found_in(renderer, grid);
      ASSERT_TRUE(found) << asymmetric << " " << turn;
      EXPECT_TRUE(found->dark);
      EXPECT_EQ(found->unfitted, 0);
      const Eigen::Matrix2Xd& truth = renderer.truth().grids[0].centres_px;
      const double same = (found->px - truth).cwiseAbs().maxCoeff();
      const double turned = (found->px.rowwise().reverse() - truth).cwiseAbs().maxCoeff();
      // Half a turn changes a symmetric grid to itself, and no asymmetric one with an odd number of
      // rows.
      EXPECT_LT(asymmetric ? same : std::min(same, turned), 1.0) << asymmetric << " " << turn;
    }
}

TEST(CircleGrid, IsFoundWithWhiteDiscsAndSteepTilts) {
  CircleGridTarget grid = grid_at(true, {0.9, 0, 0.2});
  EXPECT_TRUE(found_in(renderer_of(grid), grid));
  grid.dark = false;
  const auto found = found_in(renderer_of(grid), grid);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->dark);
}

TEST(CircleGrid, CovariancesAgreeWithTheScatterAboutTheEllipses) {
  // The centre of the ellipse is biased as the centre of the disc: it is off by several sigmas.
  double normalised = 0, of_disc_centres = 0;
  int count = 0;
  Random random(4);
  for (int t = 0; t < 12; ++t) {
    const CircleGridTarget grid =
        grid_at(t % 2 == 0, {random.uniform(-0.7, 0.7), random.uniform(-0.7, 0.7), 0.3});
    const TargetRenderer renderer = renderer_of(grid, 4, static_cast<std::uint64_t>(t));
    const auto found = found_in(renderer, grid);
    ASSERT_TRUE(found) << t;
    const Eigen::Matrix2Xd ellipses = image_centres(grid);
    const Eigen::Matrix2Xd& discs = renderer.truth().grids[0].centres_px;
    for (Eigen::Index i = 0; i < ellipses.cols(); ++i) {
      const Eigen::Matrix2d information = found->covariance_px2[i].inverse();
      const Eigen::Vector2d off = found->px.col(i) - ellipses.col(i);
      const Eigen::Vector2d from_disc = found->px.col(i) - discs.col(i);
      normalised += off.dot(information * off);
      of_disc_centres += from_disc.dot(information * from_disc);
      ++count;
    }
  }
  EXPECT_GT(normalised / (2 * count), 0.4);
  EXPECT_LT(normalised / (2 * count), 1.6);
  EXPECT_GT(of_disc_centres / (2 * count), 4);
}

TEST(CircleGrid, OtherGridsAreRejected) {
  const CircleGridTarget grid = grid_at(true, {0.2, 0.1, 0});
  const Image image = renderer_of(grid).window({0, 0, 800, 600});
  for (const auto& [columns, rows, asymmetric] : {std::tuple(4, 9, true),
                                                  {3, 11, true},
                                                  {5, 11, true},
                                                  {4, 13, true},
                                                  {4, 11, false},
                                                  {3, 3, false}}) {
    CircleGridOptions options;
    options.columns = columns;
    options.rows = rows;
    options.asymmetric = asymmetric;
    EXPECT_FALSE(find_circle_grid(image.view(), options)) << columns << "x" << rows;
  }
  // Every second disc of a symmetric grid of 7 x 5 is a grid of 4 x 3.
  CircleGridOptions options;
  options.columns = 4;
  options.rows = 3;
  options.asymmetric = false;
  const Image symmetric = renderer_of(grid_at(false, {0.2, 0.1, 0})).window({0, 0, 800, 600});
  EXPECT_FALSE(find_circle_grid(symmetric.view(), options));
}

TEST(CircleGrid, BadOptionsAreNamed) {
  const Image image = renderer_of(grid_at(true, {0, 0, 0})).window({0, 0, 100, 100});
  CircleGridOptions options;
  options.rows = 2;
  EXPECT_NE(complaint([&] { find_circle_grid(image.view(), options); }).find("rows"),
            std::string::npos);
  EXPECT_NE(complaint([] { circle_grid_positions(4, 11, true, 0); }).find("spacing"),
            std::string::npos);
  CircleGridTarget grid = grid_at(true, {0, 0, 0});
  grid.radius_m = 0.02;
  EXPECT_NE(complaint([&] { renderer_of(grid); }).find("radius_m"), std::string::npos);
}

}  // namespace
}  // namespace occ::test
