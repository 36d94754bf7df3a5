// SPDX-License-Identifier: Apache-2.0
// Chessboards: errors of rendered inner corners agree with the reported covariances.
#include "libocc/landmarks/chessboard.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "libocc/simulate/targets.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

Image grey(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  image.u8.assign(static_cast<std::size_t>(width * height), 128);
  return image;
}

struct Seen {
  int boards = 0, corners = 0;
  double rms_px = 0, normalised = 0;
};

Seen errors_of(double noise_dn, int trials) {
  const Camera camera = Camera::pinhole(640, 480, 520, 523, 322.3, 236.1, {-0.22, 0.08, 0, 0});
  Random random(6);
  Seen seen;
  for (int t = 0; t < trials; ++t) {
    ChessboardTarget board;
    board.square_m = 0.03;
    board.world_from_board.rotation =
        so3_exp({random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3)});
    board.world_from_board.translation =
        Eigen::Vector3d(random.uniform(-0.05, 0.05), random.uniform(-0.03, 0.03), 0.5) -
        board.world_from_board.rotation * Eigen::Vector3d(0.12, 0.075, 0);
    TargetField field;
    field.boards = {board};
    TargetImageOptions options;
    options.noise_dn = noise_dn;
    options.seed = static_cast<std::uint64_t>(t);
    const TargetRenderer renderer(field, camera, {}, options);
    if (!renderer.truth().boards[0].whole) continue;
    const Eigen::Matrix2Xd& truth = renderer.truth().boards[0].corners_px;
    const auto found = find_chessboard(renderer.window({0, 0, 640, 480}).view());
    EXPECT_TRUE(found) << t;
    if (!found) continue;
    ++seen.boards;
    for (Eigen::Index i = 0; i < truth.cols(); ++i) {
      const Eigen::Vector2d off = found->px.col(i) - truth.col(i);
      seen.rms_px += off.squaredNorm();
      seen.normalised += off.dot(found->covariance_px2[i].inverse() * off);
      ++seen.corners;
    }
  }
  seen.rms_px = std::sqrt(seen.rms_px / (2 * seen.corners));
  seen.normalised /= 2 * seen.corners;
  return seen;
}

TEST(Chessboard, CornersAgreeWithTheRenderedOnes) {
  const Seen seen = errors_of(0, 8);
  EXPECT_GE(seen.boards, 6);
  EXPECT_LT(seen.rms_px, 0.02);
}

TEST(Chessboard, CovarianceAgreesWithTheScatter) {
  const Seen seen = errors_of(6, 10);
  EXPECT_GE(seen.boards, 7);
  EXPECT_GT(seen.rms_px, 0.01);
  EXPECT_GT(seen.normalised, 0.5);
  EXPECT_LT(seen.normalised, 1.6);
}

// The edges of the squares are curves near a fisheye lens.
TEST(Chessboard, BentEdgesHaveNoBias) {
  const Camera camera = Camera::fisheye(1000, 1000, 320, 321, 500.4, 497.9, {0.03, -0.005});
  for (int t = 0; t < 3; ++t) {
    ChessboardTarget board;
    board.square_m = 0.03;
    board.world_from_board.rotation = so3_exp({0.2 - 0.1 * t, 0.1, 0.3 * t});
    board.world_from_board.translation =
        Eigen::Vector3d(0.01, 0, 0.16) -
        board.world_from_board.rotation * Eigen::Vector3d(0.12, 0.075, 0);
    TargetField field;
    field.boards = {board};
    const TargetRenderer renderer(field, camera, {});
    const auto found = find_chessboard(renderer.window({0, 0, 1000, 1000}).view());
    ASSERT_TRUE(found) << t;
    const Eigen::Matrix2Xd off = found->px - renderer.truth().boards[0].corners_px;
    EXPECT_LT(std::sqrt(off.squaredNorm() / static_cast<double>(off.size())), 0.003) << t;
  }
}

TEST(Chessboard, EmptyWithoutABoard) {
  const Image image = grey(120, 90);
  EXPECT_FALSE(find_chessboard(image.view()));
  EXPECT_FALSE(find_chessboard(grey(4, 4).view()));
  ChessboardOptions options;
  options.columns = 2;
  EXPECT_NE(complaint([&] { find_chessboard(image.view(), options); }).find("columns"),
            std::string::npos);
}

// A board of 9 x 6 corners with squares of side_px, in the middle of an image of width x height.
TargetRenderer board_in_front(int width, int height, double side_px, double turn_rad = 0,
                              const Eigen::Vector2d& shift_px = {0, 0}) {
  const Camera camera =
      Camera::pinhole(width, height, 1000, 1000, (width - 1) / 2.0 + 0.3, (height - 1) / 2.0 - 0.2);
  ChessboardTarget board;
  board.square_m = side_px / 1000;
  board.world_from_board.rotation = so3_exp({0, 0, turn_rad});
  board.world_from_board.translation =
      Eigen::Vector3d(shift_px.x() / 1000, shift_px.y() / 1000, 1) +
      board.world_from_board.rotation *
          Eigen::Vector3d(-4 * board.square_m, -2.5 * board.square_m, 0);
  TargetImageOptions options;
  options.noise_dn = 2;
  TargetField field;
  field.boards = {board};
  return TargetRenderer(field, camera, {}, options);
}

TEST(Chessboard, LargeImagesAreSearchedReducedAndMeasuredInFull) {
  // The squares of the second board are too small for the images that are searched first.
  for (const auto& [side_px, min_searches] : {std::pair(120.0, 1), std::pair(7.0, 3)}) {
    const TargetRenderer renderer = board_in_front(2600, 1900, side_px);
    std::vector<std::pair<int, int>> calls;
    ChessboardOptions options;
    options.progress = [&](int done, int searches) {
      calls.emplace_back(done, searches);
      return true;
    };
    const auto found = find_chessboard(renderer.window({0, 0, 2600, 1900}).view(), options);
    ASSERT_TRUE(found) << side_px;
    EXPECT_EQ(static_cast<int>(calls.size()), min_searches);
    EXPECT_EQ(calls.back(), std::pair(min_searches - 1, 4));
    const Eigen::Matrix2Xd& truth = renderer.truth().boards[0].corners_px;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      EXPECT_LT((found->px.col(k) - truth.col(k)).norm(), 0.1) << side_px << " " << k;
      EXPECT_LT(found->covariance_px2[k].trace(), 0.01);
    }
    EXPECT_EQ(found->unfitted, 0);
  }
}

TEST(Chessboard, TheFirstCornerIsBehindABlackSquareInAnyRotation) {
  for (const double turn : {0.0, 1.6, 3.1, 4.7}) {
    const TargetRenderer renderer = board_in_front(640, 480, 35, turn);
    const auto found = find_chessboard(renderer.window({0, 0, 640, 480}).view());
    ASSERT_TRUE(found) << turn;
    EXPECT_LT((found->px - renderer.truth().boards[0].corners_px).cwiseAbs().maxCoeff(), 0.5)
        << turn;
  }
}

TEST(Chessboard, ABoardWithMoreCornersIsRejected) {
  const Image image = board_in_front(640, 480, 40).window({0, 0, 640, 480});
  for (const auto& [columns, rows] : {std::pair(8, 6), {9, 5}, {5, 4}, {9, 7}, {10, 6}}) {
    ChessboardOptions options;
    options.columns = columns;
    options.rows = rows;
    EXPECT_FALSE(find_chessboard(image.view(), options)) << columns << "x" << rows;
  }
}

// Changes the grey levels of an image: change(x, y, grey).
Image changed(Image image, const std::function<double(int, int, double)>& change) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      std::uint8_t& grey = image.u8[static_cast<std::size_t>(y * image.width + x)];
      grey = static_cast<std::uint8_t>(std::lround(std::clamp(change(x, y, grey), 0.0, 255.0)));
    }
  return image;
}

TEST(Chessboard, APartOfACoveredBoardIsRejected) {
  // An L of 18 corners remains, which has only one place for a board of 4 x 3.
  const TargetRenderer renderer = board_in_front(640, 480, 40);
  const Eigen::Matrix2Xd& truth = renderer.truth().boards[0].corners_px;
  const Eigen::Vector2d inner = truth.col(2 * 9 + 1).array() + 20,
                        outer = truth.col(3).array() + 20;
  const Image image =
      changed(renderer.window({0, 0, 640, 480}), [&](int x, int y, double grey) -> double {
        return x > outer.x() || (x > inner.x() && y > inner.y()) ? 60 : grey;
      });
  ChessboardOptions options;
  options.columns = 4;
  options.rows = 3;
  EXPECT_FALSE(find_chessboard(image.view(), options));
}

TEST(Chessboard, IsFoundInShadeGlareAndTheDark) {
  const TargetRenderer renderer = board_in_front(640, 480, 42, 0.4);
  const Image image = renderer.window({0, 0, 640, 480});
  const Eigen::Matrix2Xd& truth = renderer.truth().boards[0].corners_px;
  const Eigen::Vector2d glare = truth.col(20);
  const std::vector<std::function<double(int, int, double)>> changes = {
      [](int x, int, double grey) { return x < 310 ? grey : 0.15 * grey; },
      [&](int x, int y, double grey) {
        return grey + 220 * std::exp(-(Eigen::Vector2d(x, y) - glare).squaredNorm() / (2 * 900));
      },
      [](int, int, double grey) { return 0.06 * grey; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto found = find_chessboard(changed(image, changes[i]).view());
    ASSERT_TRUE(found) << i;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      const Eigen::Vector2d off = found->px.col(k) - truth.col(k);
      EXPECT_LT(off.norm(), 0.8) << i << " " << k;
      EXPECT_LT(off.dot(found->covariance_px2[k].inverse() * off), 36) << i << " " << k;
    }
  }
}

TEST(Chessboard, ErrorsOfThePrintAreInTheCovariance) {
  // Each corner is copied from an image of a board with another shift, of 0.15 px per axis.
  const int side = 40;
  const TargetRenderer flat = board_in_front(640, 480, side);
  const Eigen::Matrix2Xd& truth = flat.truth().boards[0].corners_px;
  Image image = flat.window({0, 0, 640, 480});
  Random random(3);
  for (Eigen::Index k = 0; k < truth.cols(); ++k) {
    const int x = static_cast<int>(truth(0, k)), y = static_cast<int>(truth(1, k));
    const Eigen::Vector2d shift_px(0.15 * random.normal(), 0.15 * random.normal());
    const PixelRectangle part{x - side / 2, y - side / 2, side, side};
    const Image shifted = board_in_front(640, 480, side, 0, shift_px).window(part);
    for (int v = 0; v < side; ++v)
      std::copy_n(shifted.u8.begin() + v * side, side,
                  image.u8.begin() + (part.y0 + v) * 640 + part.x0);
  }
  const auto found = find_chessboard(image.view());
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scatter_sigma_px, 0.15, 0.05);
  double normalised = 0;
  for (Eigen::Index k = 0; k < truth.cols(); ++k) {
    const Eigen::Vector2d off = found->px.col(k) - truth.col(k);
    normalised += off.dot(found->covariance_px2[k].inverse() * off) / (2 * 54);
  }
  EXPECT_GT(normalised, 0.5);
  EXPECT_LT(normalised, 1.6);
}

TEST(Chessboard, NoBoardInNoiseAndTextures) {
  Random random(5);
  const auto noise = [&](int, int, double) { return 128 + 40 * random.normal(); };
  const auto bricks = [](int x, int y, double) {
    return (x + 20 * (y / 20 % 2)) % 40 < 3 || y % 20 < 3 ? 200 : 60;
  };
  const auto waves = [](int x, int y, double) {
    return 128 + 100 * std::sin(0.21 * x) * std::sin(0.17 * y + 0.003 * x * x);
  };
  ChessboardOptions options;
  options.columns = options.rows = 3;
  EXPECT_FALSE(find_chessboard(changed(grey(640, 480), noise).view(), options));
  EXPECT_FALSE(find_chessboard(changed(grey(640, 480), bricks).view(), options));
  EXPECT_FALSE(find_chessboard(changed(grey(640, 480), waves).view(), options));
}

TEST(Chessboard, ProgressStopsTheSearch) {
  const Image image = board_in_front(640, 480, 40).window({0, 0, 640, 480});
  EXPECT_TRUE(find_chessboard(image.view()));
  ChessboardOptions options;
  int calls = 0;
  options.progress = [&](int, int) {
    ++calls;
    return false;
  };
  EXPECT_FALSE(find_chessboard(image.view(), options));
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace occ::test
