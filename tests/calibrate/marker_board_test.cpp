// SPDX-License-Identifier: Apache-2.0
// Calibration from parts of boards: cameras are estimated within their sigmas from rendered boards
// with tags that fill the image and leave it, and images with too few points are left out by name.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/calibrate/board_network.hpp"
#include "libocc/core/math.hpp"
#include "libocc/landmarks/marker_boards.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/precision.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

Camera true_camera() {
  return Camera::pinhole(800, 600, 640, 642, 403.3, 296.1, {-0.18, 0.06, 4e-4, -3e-4});
}

// Poses of a board around its middle: tilted, turned, and moved so that a part leaves the image.
Rigid3 view_of(const Eigen::Vector3d& middle_m, int i, bool towards) {
  const double azimuth = 0.9 * i, tilt = 0.15 + 0.15 * (i % 4);
  Eigen::Matrix3d facing = Eigen::Matrix3d::Identity();
  if (towards) facing.diagonal() << 1, -1, -1;
  Rigid3 pose;
  pose.rotation =
      so3_exp({tilt * std::cos(azimuth), tilt * std::sin(azimuth), 0.5 * pi * (i % 2)}) * facing;
  const Eigen::Vector3d at(0.1 * std::cos(2.1 * i), 0.08 * std::sin(2.1 * i),
                           0.32 + 0.03 * (i % 3));
  pose.translation = at - pose.rotation * middle_m;
  return pose;
}

BoardImage board_image(int i, const BoardPoints& points) {
  BoardImage image;
  image.name = "picture " + std::to_string(i);
  image.px = points.px;
  image.covariance_px2 = points.covariance_px2;
  image.indices = points.indices;
  return image;
}

// Calibrates from images of parts of the board, and compares with the truth.
void expect_calibrated(const Eigen::Matrix3Xd& board_m, const std::vector<BoardImage>& images) {
  const Camera truth = true_camera();
  std::size_t parts = 0;
  for (const BoardImage& image : images) parts += image.px.cols() < board_m.cols();
  EXPECT_GT(parts, images.size() / 2);
  const Result<Camera> about = start_pinhole(board_m, images, 800, 600);
  ASSERT_TRUE(about.ok()) << about.message;
  const Camera start = Camera::pinhole(800, 600, about->fx_px(), about->fx_px(), about->cx_px(),
                                       about->cy_px(), {0, 0, 0, 0});
  const std::vector<std::string> free{"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"};
  const Result<NetworkStart> network = board_network({{"camera", start, free}}, board_m, images);
  ASSERT_TRUE(network.ok()) << network.message;
  EXPECT_TRUE(network->warnings.empty());
  const Result<Adjustment> adjusted = adjust(network->network);
  ASSERT_TRUE(adjusted.ok()) << adjusted.message;
  EXPECT_GT(adjusted->sigma0, 0.5);
  EXPECT_LT(adjusted->sigma0, 1.3);
  const Result<Precision> precise = precision(adjusted->network);
  ASSERT_TRUE(precise.ok()) << precise.message;
  const std::vector<CameraParameter> right = truth.parameters();
  const std::vector<CameraParameter> values = adjusted->network.cameras[0].camera.parameters();
  Eigen::VectorXd off = Eigen::VectorXd::Zero(8);
  for (std::size_t i = 0; i < free.size(); ++i)
    for (std::size_t k = 0; k < right.size(); ++k)
      if (right[k].name == free[i])
        off[static_cast<Eigen::Index>(i)] = values[k].value - right[k].value;
  EXPECT_LT(std::abs(off[0]), 0.5);
  EXPECT_LT(nees(off, precise->parameters(0)), 8 + 4 * std::sqrt(16.0));
}

TEST(CalibrateBoards, PartsOfAnAprilGridCalibrateTheCamera) {
  AprilGrid grid;
  grid.columns = 7;
  grid.rows = 6;
  grid.tag_size_m = 0.035;
  const Eigen::Matrix3Xd points = grid.points_m();
  std::vector<BoardImage> images;
  for (int i = 0; i < 8; ++i) {
    TargetField field;
    field.april_grids = {{grid, view_of(points.rowwise().mean(), i, true)}};
    TargetImageOptions options;
    options.noise_dn = 4;
    options.frame = static_cast<std::uint32_t>(i);
    const Image image = render_targets(field, true_camera(), {}, options);
    const Result<BoardPoints> found = find_april_grid(image.view(), grid);
    ASSERT_TRUE(found.ok()) << i << ": " << found.message;
    images.push_back(board_image(i, *found));
  }
  expect_calibrated(points, images);
}

TEST(CalibrateBoards, PartsOfACharucoBoardCalibrateTheCamera) {
  CharucoBoard board;
  board.columns = 10;
  board.rows = 8;
  board.square_m = 0.035;
  board.marker_m = 0.026;
  const Eigen::Matrix3Xd points = board.points_m();
  std::vector<BoardImage> images;
  for (int i = 0; i < 8; ++i) {
    TargetField field;
    field.charucos = {{board, view_of(points.rowwise().mean(), i, false)}};
    TargetImageOptions options;
    options.noise_dn = 4;
    options.frame = static_cast<std::uint32_t>(i);
    const Image image = render_targets(field, true_camera(), {}, options);
    const Result<BoardPoints> found = find_charuco(image.view(), board);
    ASSERT_TRUE(found.ok()) << i << ": " << found.message;
    images.push_back(board_image(i, *found));
  }
  expect_calibrated(points, images);
}

// Exact points of a part of a board of 5 x 4 points.
BoardImage part(const std::string& name, const std::vector<int>& indices) {
  const Eigen::Matrix3Xd board = chessboard_points(5, 4, 0.05);
  const Rigid3 pose{so3_exp({0.3, 0.2 + 0.1 * static_cast<double>(indices.size() % 5), 0.1}),
                    {-0.1, -0.08, 0.5}};
  BoardImage image;
  image.name = name;
  image.indices = indices;
  image.px.resize(2, static_cast<Eigen::Index>(indices.size()));
  for (std::size_t k = 0; k < indices.size(); ++k)
    image.px.col(static_cast<Eigen::Index>(k)) =
        true_camera().project(pose * Eigen::Vector3d(board.col(indices[k]))).value();
  return image;
}

TEST(CalibrateBoards, AnImageWithTooFewPointsIsLeftOutByName) {
  const Eigen::Matrix3Xd board = chessboard_points(5, 4, 0.05);
  const std::vector<BoardImage> images{part("first", {0, 1, 2, 5, 6, 7, 12, 13}),
                                       part("second", {7, 8, 9, 12, 13, 14, 19}),
                                       part("corner", {0, 1, 5, 6, 7}), part("none", {})};
  const Result<NetworkStart> start = board_network({{"camera", true_camera(), {}}}, board, images);
  ASSERT_TRUE(start.ok()) << start.message;
  ASSERT_EQ(start->warnings.size(), 2u);
  EXPECT_EQ(start->warnings[0], "corner left out: it has 5 points of the board; the minimum is 6");
  EXPECT_NE(start->warnings[1].find("none left out"), std::string::npos);
  ASSERT_EQ(start->network.observations.size(), 15u);
  EXPECT_EQ(start->network.observations[10].target.corner, 9);  // index 2 of the second image
  for (const Eigen::Vector2d& residual : image_residuals_px(start->network))
    EXPECT_LT(residual.norm(), 1e-6);
}

TEST(CalibrateBoards, WrongIndicesAreNamed) {
  const Eigen::Matrix3Xd board = chessboard_points(5, 4, 0.05);
  const auto refused = [&](const BoardImage& image) {
    return complaint([&] { board_network({{"camera", true_camera(), {}}}, board, {image}); });
  };
  BoardImage image = part("first", {0, 1, 2, 5, 6, 7, 12, 13});
  image.indices[3] = 20;
  EXPECT_NE(refused(image).find("image first: indices"), std::string::npos);
  image.indices[3] = 2;
  EXPECT_NE(refused(image).find("different"), std::string::npos);
  image.indices.pop_back();
  EXPECT_NE(refused(image).find("one for each of the 8 px"), std::string::npos);
  image.indices.clear();
  EXPECT_NE(refused(image).find("20 points"), std::string::npos);
}

}  // namespace
}  // namespace occ::test
