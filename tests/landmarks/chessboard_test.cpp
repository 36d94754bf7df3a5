// SPDX-License-Identifier: Apache-2.0
// Chessboards: errors of rendered inner corners agree with the reported covariances.
#include "libocc/landmarks/chessboard.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

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

std::string message_for(const Image& image) {
  return complaint([&] { find_chessboard(image.view()); });
}

/// Skips all tests if the library is built without OpenCV.
struct Chessboard : ::testing::Test {
  void SetUp() override {
    if (!message_for(grey(120, 90)).empty()) GTEST_SKIP() << message_for(grey(120, 90));
  }
};

TEST(ChessboardWithoutOpencv, ErrorNamesTheCMakeOption) {
  const std::string message = message_for(grey(120, 90));
  if (message.empty()) GTEST_SKIP() << "this build has OpenCV";
  EXPECT_NE(message.find("-DLIBOCC_OPENCV=ON"), std::string::npos) << message;
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
    const bool turned = (found->px.col(0) - truth.col(0)).norm() > 5;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      const Eigen::Index i = turned ? truth.cols() - 1 - k : k;
      const Eigen::Vector2d off = found->px.col(i) - truth.col(k);
      seen.rms_px += off.squaredNorm();
      seen.normalised += off.dot(found->covariance_px2[i].inverse() * off);
      ++seen.corners;
    }
  }
  seen.rms_px = std::sqrt(seen.rms_px / (2 * seen.corners));
  seen.normalised /= 2 * seen.corners;
  return seen;
}

TEST_F(Chessboard, CornersAgreeWithTheRenderedOnes) {
  const Seen seen = errors_of(0, 8);
  EXPECT_GE(seen.boards, 6);
  EXPECT_LT(seen.rms_px, 0.02);
}

TEST_F(Chessboard, CovarianceAgreesWithTheScatter) {
  const Seen seen = errors_of(6, 10);
  EXPECT_GE(seen.boards, 7);
  EXPECT_GT(seen.rms_px, 0.02);
  EXPECT_GT(seen.normalised, 0.5);
  EXPECT_LT(seen.normalised, 1.6);
}

TEST_F(Chessboard, EmptyWithoutABoard) {
  const Image image = grey(120, 90);
  EXPECT_FALSE(find_chessboard(image.view()));
  EXPECT_FALSE(find_chessboard(grey(4, 4).view()));
  ChessboardOptions options;
  options.columns = 2;
  EXPECT_NE(complaint([&] { find_chessboard(image.view(), options); }).find("columns"),
            std::string::npos);
}

// A board of 9 x 6 corners with squares of side_px, in the middle of an image of width x height.
TargetRenderer board_in_front(int width, int height, double side_px) {
  const Camera camera =
      Camera::pinhole(width, height, 1000, 1000, (width - 1) / 2.0 + 0.3, (height - 1) / 2.0 - 0.2);
  ChessboardTarget board;
  board.square_m = side_px / 1000;
  board.world_from_board.translation =
      Eigen::Vector3d(-4 * board.square_m, -2.5 * board.square_m, 1);
  TargetImageOptions options;
  options.noise_dn = 2;
  return TargetRenderer({{}, {}, {board}}, camera, {}, options);
}

TEST_F(Chessboard, LargeImagesAreSearchedReducedAndRefinedInFull) {
  // The squares of the second board are too small for the quick search.
  for (const auto& [side_px, min_searches] : {std::pair(120.0, 1), std::pair(28.0, 2)}) {
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
    EXPECT_EQ(calls.back(), std::pair(min_searches - 1, 2));
    const Eigen::Matrix2Xd& truth = renderer.truth().boards[0].corners_px;
    const bool turned = (found->px.col(0) - truth.col(0)).norm() > 5;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) {
      const Eigen::Index i = turned ? truth.cols() - 1 - k : k;
      EXPECT_LT((found->px.col(i) - truth.col(k)).norm(), 0.1) << side_px << " " << k;
      EXPECT_LT(found->covariance_px2[i].trace(), 0.01);
    }
  }
}

TEST_F(Chessboard, ProgressStopsTheSearch) {
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
