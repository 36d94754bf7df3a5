// SPDX-License-Identifier: Apache-2.0
// Boards with tags: errors of rendered points agree with the reported covariances, also of boards
// that are cut by the border or covered in part; other boards and layouts are refused.
#include "libocc/landmarks/marker_boards.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/landmarks/april_tags.hpp"
#include "libocc/simulate/targets.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

Camera lens() {
  return Camera::pinhole(800, 600, 640, 642, 403.3, 296.1, {-0.18, 0.06, 4e-4, -3e-4});
}

AprilGrid small_grid() {
  AprilGrid grid;
  grid.columns = 6;
  grid.rows = 5;
  grid.tag_size_m = 0.03;
  return grid;
}

CharucoBoard small_charuco() {
  CharucoBoard board;
  board.columns = 7;
  board.rows = 5;
  board.square_m = 0.04;
  board.marker_m = 0.03;
  return board;
}

// Pose of a board with its middle at `middle_m` (in its frame) in front of the camera.
// `towards`: its z axis points towards the viewer.
Rigid3 board_pose(const Eigen::Vector3d& middle_m, const Eigen::Vector3d& at_m,
                  const Eigen::Vector3d& turn, bool towards) {
  Rigid3 pose;
  Eigen::Matrix3d facing = Eigen::Matrix3d::Identity();
  if (towards) facing.diagonal() << 1, -1, -1;
  pose.rotation = so3_exp(turn) * facing;
  pose.translation = at_m - pose.rotation * middle_m;
  return pose;
}

Eigen::Vector3d middle(const Eigen::Matrix3Xd& points) { return points.rowwise().mean(); }

// Statistics of the found points of many images.
struct Found {
  int images = 0, points = 0, hidden = 0, in_view = 0;
  double squared = 0, normalised = 0, worst = 0;

  void add(const Result<BoardPoints>& found, const Eigen::Matrix2Xd& truth, int width, int height) {
    ++images;
    hidden += found->hidden;
    for (Eigen::Index i = 0; i < truth.cols(); ++i)
      in_view +=
          truth(0, i) > 6 && truth(1, i) > 6 && truth(0, i) < width - 7 && truth(1, i) < height - 7;
    for (std::size_t i = 0; i < found->indices.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const Eigen::Vector2d off = found->px.col(k) - truth.col(found->indices[i]);
      const double q = off.dot(found->covariance_px2[i].inverse() * off);
      squared += off.squaredNorm();
      normalised += q;
      worst = std::max(worst, q);
      ++points;
    }
  }
  double rms_px() const { return std::sqrt(squared / (2 * points)); }
  double nees() const { return normalised / (2 * points); }
};

// Covers a part of an image by a grey rectangle with noise.
void cover(Image& image, int x0, int y0, int width, int height) {
  Random random(7);
  for (int y = std::max(0, y0); y < std::min(image.height, y0 + height); ++y)
    for (int x = std::max(0, x0); x < std::min(image.width, x0 + width); ++x)
      image.u8[static_cast<std::size_t>(y * image.width + x)] =
          static_cast<std::uint8_t>(std::clamp(140 + 4 * random.normal(), 0.0, 255.0));
}

enum class View { whole, partial, covered };

template <class Target, class Find>
Found statistics(const Target& board, bool towards, View view, double noise_dn, double psf_px,
                 int trials, const Find& find) {
  const Camera camera = lens();
  const Eigen::Matrix3Xd points = board.points_m();
  const Eigen::Vector3d extent = points.rowwise().maxCoeff() - points.rowwise().minCoeff();
  Random random(11);
  Found found;
  for (int t = 0; t < trials; ++t) {
    const double shift = view == View::partial ? 0.5 : 0.05;
    const double distance = view == View::partial ? 0.3 : 0.45;
    const Eigen::Vector3d at(random.uniform(-shift, shift) * extent.x(),
                             random.uniform(-shift, shift) * extent.y(), distance);
    const Eigen::Vector3d turn(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                               random.uniform(-0.5, 0.5));
    TargetField field;
    const Rigid3 pose = board_pose(middle(points), at, turn, towards);
    TargetImageOptions options;
    options.noise_dn = noise_dn;
    options.psf_sigma_px = psf_px;
    options.seed = static_cast<std::uint64_t>(t);
    Eigen::Matrix2Xd truth;
    Image image;
    if constexpr (std::is_same_v<Target, AprilGrid>) {
      field.april_grids = {{board, pose}};
      const TargetRenderer renderer(field, camera, {}, options);
      truth = renderer.truth().april_grids[0].points_px;
      image = renderer.window({0, 0, 800, 600});
    } else {
      field.charucos = {{board, pose}};
      const TargetRenderer renderer(field, camera, {}, options);
      truth = renderer.truth().charucos[0].points_px;
      image = renderer.window({0, 0, 800, 600});
    }
    if (truth.cols() == 0) continue;
    if (view == View::covered) {
      const Eigen::Vector2d low = truth.rowwise().minCoeff(), high = truth.rowwise().maxCoeff();
      const Eigen::Vector2d size = high - low;
      cover(image, static_cast<int>(low.x() + 0.3 * size.x()),
            static_cast<int>(low.y() + 0.2 * size.y()), static_cast<int>(0.5 * size.x()),
            static_cast<int>(0.6 * size.y()));
    }
    const Result<BoardPoints> seen = find(image);
    EXPECT_TRUE(seen.ok()) << t << ": " << seen.message;
    if (seen.ok()) found.add(seen, truth, 800, 600);
  }
  return found;
}

Found of_grid(View view, double noise_dn, double psf_px, int trials,
              const AprilGrid& grid = small_grid()) {
  return statistics(grid, true, view, noise_dn, psf_px, trials,
                    [&](const Image& image) { return find_april_grid(image.view(), grid); });
}

Found of_charuco(View view, double noise_dn, double psf_px, int trials,
                 const CharucoBoard& board = small_charuco()) {
  return statistics(board, false, view, noise_dn, psf_px, trials,
                    [&](const Image& image) { return find_charuco(image.view(), board); });
}

TEST(MarkerBoards, PointsAgreeWithTheRenderedOnes) {
  for (const Found& found : {of_grid(View::whole, 0, 0.6, 4), of_charuco(View::whole, 0, 0.6, 4)}) {
    EXPECT_EQ(found.images, 4);
    EXPECT_EQ(found.points, found.in_view);
    EXPECT_EQ(found.hidden, 0);
    EXPECT_LT(found.rms_px(), 0.005);
  }
}

TEST(MarkerBoards, CovariancesAgreeWithTheScatter) {
  for (const Found& found : {of_grid(View::whole, 8, 1, 6), of_charuco(View::whole, 8, 1, 20)}) {
    EXPECT_EQ(found.points, found.in_view);
    EXPECT_GT(found.rms_px(), 0.02);
    EXPECT_GT(found.nees(), 0.7);
    EXPECT_LT(found.nees(), 1.3);
  }
}

TEST(MarkerBoards, BoardsCutByTheBorderAreMeasured) {
  const Found grid = of_grid(View::partial, 4, 0.8, 8);
  const Found charuco = of_charuco(View::partial, 4, 0.8, 8);
  EXPECT_EQ(grid.images, 8);
  EXPECT_EQ(charuco.images, 8);
  EXPECT_LT(grid.in_view, 8 * 120 - 40);
  EXPECT_GT(grid.points, 0.97 * grid.in_view);
  EXPECT_GT(charuco.points, 0.97 * charuco.in_view);
  for (const Found& found : {grid, charuco}) {
    EXPECT_LT(found.nees(), 1.3);
    EXPECT_LT(found.worst, 30);
  }
}

// A third of the board is behind a grey sheet.
TEST(MarkerBoards, CoveredPointsAreNotMeasured) {
  const Found grid = of_grid(View::covered, 4, 0.8, 8);
  const Found charuco = of_charuco(View::covered, 4, 0.8, 8);
  EXPECT_EQ(grid.images, 8);
  EXPECT_EQ(charuco.images, 8);
  EXPECT_GT(grid.points, 0.4 * grid.in_view);
  EXPECT_GT(charuco.points, 0.5 * charuco.in_view);
  for (const Found& found : {grid, charuco}) {
    EXPECT_GT(found.hidden, 0.2 * found.in_view);
    EXPECT_LT(found.points, 0.75 * found.in_view);
    EXPECT_LT(found.rms_px(), 0.05);
    EXPECT_LT(found.nees(), 1.3);
  }
}

// Boards 15 cm from a fisheye lens, in several turns.
std::array<Found, 2> near_a_fisheye(double noise_dn) {
  const Camera camera = Camera::fisheye(1000, 1000, 320, 321, 500.4, 497.9, {0.03, -0.005});
  Found grids, boards;
  for (int t = 0; t < 6; ++t) {
    TargetImageOptions options;
    options.noise_dn = noise_dn;
    options.seed = static_cast<std::uint64_t>(t);
    const Eigen::Vector3d turn(0.1 * t - 0.2, 0.1, 0.3 * t);
    const Eigen::Matrix3Xd grid = small_grid().points_m(), board = small_charuco().points_m();
    TargetField field;
    field.april_grids = {{small_grid(), board_pose(middle(grid), {0.02, 0, 0.15}, turn, true)}};
    const TargetRenderer near_grid(field, camera, {}, options);
    grids.add(find_april_grid(near_grid.window({0, 0, 1000, 1000}).view(), small_grid()),
              near_grid.truth().april_grids[0].points_px, 1000, 1000);
    field = {};
    field.charucos = {{small_charuco(), board_pose(middle(board), {0.02, 0, 0.15}, turn, false)}};
    const TargetRenderer near_board(field, camera, {}, options);
    boards.add(find_charuco(near_board.window({0, 0, 1000, 1000}).view(), small_charuco()),
               near_board.truth().charucos[0].points_px, 1000, 1000);
  }
  return {grids, boards};
}

// A bent edge has no bias, and the bend is not taken for scatter of the print.
TEST(MarkerBoards, BoardsNearAFisheyeLensHaveTheirCovariances) {
  for (const Found& found : near_a_fisheye(0)) EXPECT_LT(found.rms_px(), 0.004);
  for (const Found& found : near_a_fisheye(12)) {
    EXPECT_GT(found.points, 0.95 * found.in_view);
    EXPECT_GT(found.nees(), 0.4);
    EXPECT_LT(found.nees(), 1.3);
  }
}

// A sheet of checks of the size of the gaps has corners of its own.
TEST(MarkerBoards, CornersOfAnotherPatternAreNotPoints) {
  const Camera camera = lens();
  const Eigen::Matrix3Xd points = small_grid().points_m();
  int covered = 0, taken = 0;
  for (int t = 0; t < 6; ++t) {
    TargetField field;
    field.april_grids = {{small_grid(), board_pose(middle(points), {0, 0, 0.42},
                                                   {0.1 * t, 0.3 - 0.1 * t, 0.2}, true)}};
    const TargetRenderer renderer(field, camera, {});
    Image image = renderer.window({0, 0, 800, 600});
    Random random(static_cast<std::uint64_t>(t));
    std::vector<std::uint8_t> checks(900);
    for (std::uint8_t& check : checks) check = random.uniform(0, 1) < 0.5 ? 30 : 200;
    const auto is_covered = [&](const Eigen::Vector2d& px) {
      return px.x() > 330 && px.x() < 520 && px.y() > 250 && px.y() < 420;
    };
    for (int y = 250; y < 420; ++y)
      for (int x = 330; x < 520; ++x)
        image.u8[static_cast<std::size_t>(y * 800 + x)] =
            checks[static_cast<std::size_t>((y - 250) / 10 * 30 + (x - 330) / 10)];
    const Result<BoardPoints> found = find_april_grid(image.view(), small_grid());
    ASSERT_TRUE(found.ok()) << found.message;
    const Eigen::Matrix2Xd& truth = renderer.truth().april_grids[0].points_px;
    for (Eigen::Index k = 0; k < truth.cols(); ++k) covered += is_covered(truth.col(k));
    EXPECT_GT(found->indices.size(), 60u);
    for (std::size_t k = 0; k < found->indices.size(); ++k) {
      const Eigen::Vector2d right = truth.col(found->indices[k]);
      taken += is_covered(right);
      EXPECT_LT((found->px.col(static_cast<Eigen::Index>(k)) - right).norm(), 1) << t;
    }
  }
  EXPECT_GT(covered, 60);
  EXPECT_LT(taken, 0.05 * covered);
}

TEST(MarkerBoards, EveryFamilyAndSmallTagsAreFound) {
  for (const char* family : {"tag36h11", "tag36h10", "tag25h9", "tag16h5"}) {
    AprilGrid grid = small_grid();
    CharucoBoard board = small_charuco();
    grid.family = board.family = family;
    const Found grids = of_grid(View::whole, 2, 0.6, 1, grid);
    const Found boards = of_charuco(View::whole, 2, 0.6, 1, board);
    EXPECT_EQ(grids.points, 120) << family;
    EXPECT_EQ(boards.points, 24) << family;
  }
  CharucoBoard thin = small_charuco();
  thin.marker_m = 0.034;  // a white margin of 4 px
  EXPECT_EQ(of_charuco(View::whole, 2, 0.6, 1, thin).points, 24);
  AprilGrid narrow = small_grid();
  narrow.border_cells = 1;
  narrow.spacing = 0.2;
  EXPECT_EQ(of_grid(View::whole, 2, 0.6, 1, narrow).points, 120);
}

// Image of boards in front of the camera, 0.5 m away and beside each other.
Image boards_in_front(const std::vector<AprilGrid>& grids, const std::vector<CharucoBoard>& boards,
                      const std::vector<Tag>& tags = {}) {
  TargetField field;
  field.tags = tags;
  const auto count = static_cast<double>(grids.size() + boards.size());
  double at = 0.5 - 0.5 * count;
  constexpr double step_m = 0.31;
  for (const AprilGrid& grid : grids)
    field.april_grids.push_back(
        {grid, board_pose(middle(grid.points_m()), {step_m * at++, 0, 0.5}, {0, 0, 0.1}, true)});
  for (const CharucoBoard& board : boards)
    field.charucos.push_back(
        {board, board_pose(middle(board.points_m()), {step_m * at++, 0, 0.5}, {0, 0, 0.1}, false)});
  TargetImageOptions options;
  options.noise_dn = 2;
  return render_targets(field, lens(), {}, options);
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(MarkerBoards, TagsOfOtherBoardsAreIgnoredAndNamed) {
  Tag loose;
  loose.size_m = 0.03;
  loose.normal = -Eigen::Vector3d::UnitZ();
  loose.x_axis = Eigen::Vector3d::UnitX();
  std::vector<Tag> tags;
  for (const int id : {5, 400}) {
    loose.id = id;
    loose.centre_m = {0.22, id == 5 ? 0.1 : -0.1, 0.48};
    tags.push_back(loose);
  }
  const Result<BoardPoints> found =
      find_charuco(boards_in_front({}, {small_charuco()}, tags).view(), small_charuco());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->foreign_ids, std::vector<int>{400});
  EXPECT_EQ(found->misplaced_ids, std::vector<int>{5});
  EXPECT_EQ(found->indices.size(), 24u);
  EXPECT_EQ(found->tags, 17);

  AprilGrid lower = small_grid();
  lower.rows = 4;
  const Result<BoardPoints> part =
      find_april_grid(boards_in_front({small_grid()}, {}).view(), lower);
  ASSERT_TRUE(part.ok()) << part.message;
  EXPECT_EQ(part->foreign_ids, (std::vector<int>{24, 25, 26, 27, 28, 29}));
  EXPECT_EQ(part->indices.size(), 96u);
}

TEST(MarkerBoards, AnotherArrangementIsRefused) {
  AprilGrid turned = small_grid();
  std::swap(turned.columns, turned.rows);
  const Result<BoardPoints> grid =
      find_april_grid(boards_in_front({small_grid()}, {}).view(), turned);
  EXPECT_EQ(grid.status, Status::degenerate);
  EXPECT_TRUE(contains(grid.message, "columns and rows")) << grid.message;
  EXPECT_TRUE(grid->indices.empty());

  const Image image = boards_in_front({small_grid()}, {});
  for (const double spacing : {0.01, 0.25, 0.8}) {
    AprilGrid other = small_grid();
    other.spacing = spacing;
    const Result<BoardPoints> found = find_april_grid(image.view(), other);
    EXPECT_EQ(found.status, Status::degenerate) << spacing;
    EXPECT_TRUE(contains(found.message, "are 0.3 of their side")) << found.message;
    EXPECT_TRUE(found->indices.empty());
  }

  CharucoBoard board = small_charuco();
  board.columns = 5;
  board.rows = 6;
  for (const bool legacy : {false, true}) {
    board.legacy = legacy;
    const Image seen = boards_in_front({}, {board});
    const Result<BoardPoints> right = find_charuco(seen.view(), board);
    EXPECT_TRUE(right.ok()) << right.message;
    EXPECT_EQ(right->indices.size(), 20u);
    CharucoBoard other = board;
    other.legacy = !legacy;
    const Result<BoardPoints> wrong = find_charuco(seen.view(), other);
    EXPECT_EQ(wrong.status, Status::degenerate);
    EXPECT_TRUE(contains(wrong.message, "legacy")) << wrong.message;
  }
}

TEST(MarkerBoards, TwoBoardsAreAmbiguous) {
  CharucoBoard board = small_charuco();
  board.columns = board.rows = 5;
  const Result<BoardPoints> found = find_charuco(boards_in_front({}, {board, board}).view(), board);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_TRUE(contains(found.message, "two boards")) << found.message;
  EXPECT_TRUE(contains(found.message, "0, 1, 2")) << found.message;
}

TEST(MarkerBoards, ImagesWithoutTheBoardHaveAReason) {
  const Image charuco = boards_in_front({}, {small_charuco()});
  const Image grid = boards_in_front({small_grid()}, {});
  const Result<BoardPoints> none = find_april_grid(charuco.view(), small_grid());
  EXPECT_FALSE(none.ok());
  EXPECT_TRUE(contains(none.message, "border of one cell")) << none.message;
  EXPECT_FALSE(find_charuco(grid.view(), small_charuco()).ok());
  CharucoBoard other = small_charuco();
  other.family = "tag25h9";
  const Result<BoardPoints> family = find_charuco(charuco.view(), other);
  EXPECT_EQ(family.status, Status::too_few_lamps);
  EXPECT_TRUE(contains(family.message, "no tag was detected")) << family.message;
}

TEST(MarkerBoards, ImagesOf16BitsGiveTheSamePoints) {
  const Image image = boards_in_front({small_grid()}, {});
  Image deep = image;
  deep.type = PixelType::u16;
  deep.u8.clear();
  for (const std::uint8_t grey : image.u8)
    deep.u16.push_back(static_cast<std::uint16_t>(200 * grey));
  const Result<BoardPoints> found = find_april_grid(image.view(), small_grid());
  const Result<BoardPoints> same = find_april_grid(deep.view(), small_grid());
  ASSERT_TRUE(found.ok() && same.ok());
  ASSERT_EQ(found->indices, same->indices);
  EXPECT_LT((found->px - same->px).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(MarkerBoards, ImpossibleBoardsAreRefused) {
  const Image image = boards_in_front({}, {});
  CharucoBoard board = small_charuco();
  board.marker_m = 0.05;
  EXPECT_TRUE(contains(complaint([&] { find_charuco(image.view(), board); }), "marker_m"));
  board = small_charuco();
  board.family = "DICT_4X4_50";
  EXPECT_TRUE(contains(complaint([&] { find_charuco(image.view(), board); }), "tag36h11"));
  board.family = "tag16h5";
  board.columns = board.rows = 9;
  EXPECT_TRUE(contains(complaint([&] { find_charuco(image.view(), board); }), "at most 30 tags"));
  AprilGrid grid = small_grid();
  grid.family = "tagStandard41h12";
  EXPECT_TRUE(contains(complaint([&] { find_april_grid(image.view(), grid); }), "family"));
  grid = small_grid();
  grid.spacing = 0;
  EXPECT_TRUE(contains(complaint([&] { find_april_grid(image.view(), grid); }), "spacing"));
  grid = small_grid();
  grid.tag_size_m = 0;
  EXPECT_TRUE(contains(complaint([&] { find_april_grid(image.view(), grid); }), "tag_size_m"));
}

}  // namespace
}  // namespace occ::test
