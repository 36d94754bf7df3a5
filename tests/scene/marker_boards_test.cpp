// SPDX-License-Identifier: Apache-2.0
// Layout of boards with tags: ids, corners and points where Kalibr and OpenCV have them.
#include "libocc/scene/marker_boards.hpp"

#include <gtest/gtest.h>

#include "tests/support/support.hpp"

namespace occ::test {
namespace {

TEST(MarkerBoardLayout, AnAprilGridStartsAtTheLowerLeft) {
  AprilGrid grid;
  grid.columns = 3;
  grid.rows = 2;
  grid.tag_size_m = 0.1;
  grid.spacing = 0.25;
  const std::vector<BoardTag> tags = grid.tags();
  ASSERT_EQ(tags.size(), 6u);
  EXPECT_EQ(tags[4].id, 4);  // second row, second column
  EXPECT_LT((tags[4].corners_m[0] - Eigen::Vector2d(0.125, 0.125)).norm(), 1e-12);
  EXPECT_LT((tags[4].corners_m[2] - Eigen::Vector2d(0.225, 0.225)).norm(), 1e-12);
  const Eigen::Matrix3Xd points = grid.points_m();
  ASSERT_EQ(points.cols(), 24);
  EXPECT_LT((points.col(4 * 4 + 1) - Eigen::Vector3d(0.225, 0.125, 0)).norm(), 1e-12);
  EXPECT_LT((points.col(4 * 4 + 3) - Eigen::Vector3d(0.125, 0.225, 0)).norm(), 1e-12);
}

TEST(MarkerBoardLayout, ACharucoBoardStartsAtTheUpperLeft) {
  CharucoBoard board;
  board.columns = 5;
  board.rows = 6;
  board.square_m = 0.04;
  board.marker_m = 0.03;
  for (const bool legacy : {false, true}) {
    board.legacy = legacy;
    const std::vector<BoardTag> tags = board.tags();
    ASSERT_EQ(tags.size(), 15u);
    // The upper right corner on the board is the tag's lower left one.
    const double column = legacy ? 0 : 1;
    EXPECT_LT((tags[0].corners_m[0] - Eigen::Vector2d(0.04 * column + 0.035, 0.005)).norm(), 1e-12);
    EXPECT_LT((tags[0].corners_m[1] - Eigen::Vector2d(0.04 * column + 0.005, 0.005)).norm(), 1e-12);
    EXPECT_EQ(board.is_white(0, 0), legacy);
  }
  const Eigen::Matrix3Xd points = board.points_m();
  ASSERT_EQ(points.cols(), 20);
  EXPECT_LT((points.col(6) - Eigen::Vector3d(0.12, 0.08, 0)).norm(), 1e-12);
  board.rows = 7;  // odd: one layout
  EXPECT_FALSE(board.is_white(0, 0));
  EXPECT_EQ(board.tags().size(), 17u);
}

TEST(MarkerBoardLayout, FieldsAreChecked) {
  AprilGrid grid;
  EXPECT_NE(complaint([&] { grid.validate(); }).find("tag_size_m"), std::string::npos);
  grid.tag_size_m = 0.1;
  grid.columns = 60;
  grid.rows = 10;
  EXPECT_NE(complaint([&] { grid.validate(); }).find("at most 587 tags"), std::string::npos);
  CharucoBoard board;
  board.square_m = 0.04;
  board.marker_m = 0.04;
  EXPECT_NE(complaint([&] { board.validate(); }).find("marker_m"), std::string::npos);
}

}  // namespace
}  // namespace occ::test
