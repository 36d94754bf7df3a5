// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/target_figure.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"

namespace occ::internal::simulate {
namespace {

Rigid3 world_from_circle(const CircularTarget& circle) {
  Rigid3 pose;
  const Eigen::Vector3d x = circle.normal.unitOrthogonal();
  pose.rotation << x, circle.normal.cross(x), circle.normal;
  pose.translation = circle.centre_m;
  return pose;
}

/// Adds the black cells of a tag. `upper_left`: corner of its black square, y up.
void add_tag(const std::string& family, int id, int border_cells, bool upside_down, double side_m,
             const Eigen::Vector2d& upper_left, PlaneOutline& black) {
  const TagPattern pattern = tag_pattern(family, id, border_cells);
  const int n = static_cast<int>(pattern.black.rows()), ring = (n - pattern.square_cells) / 2;
  const double cell_m = side_m / pattern.square_cells;
  const auto is_black = [&](int x, int y) {
    const int row = upside_down ? n - 1 - (y + ring) : y + ring;
    const int column = upside_down ? n - 1 - (x + ring) : x + ring;
    return bool{pattern.black(row, column)};
  };
  for (const PrintEdge& edge : cell_outline(pattern.square_cells, pattern.square_cells, is_black))
    black.edges.push_back({upper_left + cell_m * edge.from, upper_left + cell_m * edge.to});
}

}  // namespace

TargetFigure tag_figure(const Tag& tag, const Rigid3& cam_from_world, const TargetImageOptions& o) {
  const TagPrint print = tag_print(tag.family, tag.id);
  const double half_m = 0.5 * tag.size_m;
  PlaneOutline black;
  for (const PrintEdge& edge : print.black)
    black.edges.push_back({half_m * edge.from, half_m * edge.to});
  return {cam_from_world * tag.world_from_tag(),
          {square_outline(half_m * (print.half_width + o.margin_cells * print.cell)), black},
          {o.white_dn, o.black_dn}};
}

TargetFigure circle_figure(const CircularTarget& circle, const Rigid3& cam_from_world,
                           const TargetImageOptions& o) {
  const double sheet_m = circle.sheet_m > 0 ? circle.sheet_m : 4 * circle.radius_m;
  PlaneOutline disc;
  disc.circle_radius_m = circle.radius_m;
  disc.circle_centres_m = {Eigen::Vector2d::Zero()};
  return {cam_from_world * world_from_circle(circle),
          {square_outline(0.5 * sheet_m), disc},
          {circle.dark ? o.white_dn : o.black_dn, circle.dark ? o.black_dn : o.white_dn}};
}

TargetFigure board_figure(const ChessboardTarget& board, const Rigid3& cam_from_world,
                          const TargetImageOptions& o) {
  Rigid3 board_from_plane;  // z axis towards the viewer instead of away
  board_from_plane.rotation.diagonal() << 1, -1, -1;
  const int columns = board.columns + 1, rows = board.rows + 1;
  board_from_plane.translation =
      board.square_m * Eigen::Vector3d(0.5 * columns - 1, 0.5 * rows - 1, 0);
  const Eigen::Vector2d middle(0.5 * columns, -0.5 * rows);
  PlaneOutline black;
  for (const PrintEdge& edge :
       cell_outline(columns, rows, [](int x, int y) { return (x + y) % 2 == 0; }))
    black.edges.push_back(
        {board.square_m * (edge.from - middle), board.square_m * (edge.to - middle)});
  const Eigen::Vector2d half =
      board.square_m * Eigen::Vector2d(0.5 * columns + o.margin_cells, 0.5 * rows + o.margin_cells);
  return {cam_from_world * board.world_from_board * board_from_plane,
          {rectangle_outline(half), black},
          {o.white_dn, o.black_dn}};
}

TargetFigure grid_figure(const CircleGridTarget& grid, const Rigid3& cam_from_world,
                         const TargetImageOptions& o) {
  const Eigen::Matrix3Xd centres = grid.centres_m();
  const Eigen::Vector2d low = centres.topRows<2>().rowwise().minCoeff();
  const Eigen::Vector2d high = centres.topRows<2>().rowwise().maxCoeff();
  const Eigen::Vector2d middle = 0.5 * (low + high);
  Rigid3 board_from_plane;  // z axis towards the viewer instead of away
  board_from_plane.rotation.diagonal() << 1, -1, -1;
  board_from_plane.translation << middle, 0;
  PlaneOutline discs;
  discs.circle_radius_m = grid.radius_m;
  for (Eigen::Index i = 0; i < centres.cols(); ++i) {
    const Eigen::Vector2d off = centres.col(i).head<2>() - middle;
    discs.circle_centres_m.emplace_back(off.x(), -off.y());
  }
  const Eigen::Vector2d half = 0.5 * (high - low) + Eigen::Vector2d::Constant(grid.radius_m) +
                               Eigen::Vector2d::Constant(o.margin_cells * grid.spacing_m);
  return {cam_from_world * grid.world_from_board * board_from_plane,
          {rectangle_outline(half), discs},
          {grid.dark ? o.white_dn : o.black_dn, grid.dark ? o.black_dn : o.white_dn}};
}

TargetFigure april_grid_figure(const AprilGridTarget& grid, const Rigid3& cam_from_world,
                               const TargetImageOptions& o) {
  const AprilGrid& board = grid.board;
  const double side_m = board.tag_size_m, gap_m = board.spacing * side_m;
  const double pitch_m = side_m + gap_m;
  const Eigen::Vector2d size_m =
      pitch_m * Eigen::Vector2d(board.columns, board.rows) + Eigen::Vector2d::Constant(gap_m);
  const Eigen::Vector2d middle = 0.5 * size_m - Eigen::Vector2d::Constant(gap_m);
  Rigid3 board_from_plane;
  board_from_plane.translation << middle, 0;
  PlaneOutline black;
  for (const BoardTag& tag : board.tags())
    add_tag(board.family, tag.id, board.border_cells, false, side_m, tag.corners_m[3] - middle,
            black);
  const PlaneOutline square = square_outline(0.5 * gap_m);
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column) {
      const Eigen::Vector2d at =
          pitch_m * Eigen::Vector2d(column, row) - Eigen::Vector2d::Constant(0.5 * gap_m) - middle;
      for (const PrintEdge& edge : square.edges)
        black.edges.push_back({at + edge.from, at + edge.to});
    }
  const Eigen::Vector2d half = 0.5 * size_m + Eigen::Vector2d::Constant(o.margin_cells * gap_m);
  return {cam_from_world * grid.world_from_board * board_from_plane,
          {rectangle_outline(half), black},
          {o.white_dn, o.black_dn}};
}

TargetFigure charuco_figure(const CharucoTarget& target, const Rigid3& cam_from_world,
                            const TargetImageOptions& o) {
  const CharucoBoard& board = target.board;
  const Eigen::Vector2d size_m = board.square_m * Eigen::Vector2d(board.columns, board.rows);
  Rigid3 board_from_plane;  // z axis towards the viewer instead of away
  board_from_plane.rotation.diagonal() << 1, -1, -1;
  board_from_plane.translation << 0.5 * size_m, 0;
  const Eigen::Vector2d upper_left(-0.5 * size_m.x(), 0.5 * size_m.y());
  PlaneOutline black;
  for (const PrintEdge& edge :
       cell_outline(board.columns, board.rows, [&](int x, int y) { return !board.is_white(x, y); }))
    black.edges.push_back(
        {upper_left + board.square_m * edge.from, upper_left + board.square_m * edge.to});
  for (const BoardTag& tag : board.tags()) {
    const Eigen::Vector2d at = tag.corners_m[1];  // the tag is upside down
    add_tag(board.family, tag.id, 1, true, board.marker_m,
            upper_left + Eigen::Vector2d(at.x(), -at.y()), black);
  }
  const Eigen::Vector2d half =
      0.5 * size_m + Eigen::Vector2d::Constant(o.margin_cells * board.square_m);
  return {cam_from_world * target.world_from_board * board_from_plane,
          {rectangle_outline(half), black},
          {o.white_dn, o.black_dn}};
}

}  // namespace occ::internal::simulate

namespace occ {

void CircularTarget::validate() {
  const std::string name = "circle " + std::to_string(id) + ": ";
  require(radius_m > 0 && std::isfinite(radius_m), name + "radius_m", radius_m, "positive");
  require(sheet_m == 0 || (sheet_m > 2 * radius_m && std::isfinite(sheet_m)), name + "sheet_m",
          sheet_m, "0 or more than the disc's diameter");
  require(centre_m.allFinite(), name + "centre_m", centre_m.transpose(), "finite");
  require(normal.allFinite() && normal.norm() > 0, name + "normal", normal.transpose(),
          "a direction");
  normal.normalize();
}

void ChessboardTarget::validate() const {
  require(columns >= 2 && columns <= 1000, "board: columns", columns, "between 2 and 1000");
  require(rows >= 2 && rows <= 1000, "board: rows", rows, "between 2 and 1000");
  require(square_m > 0 && std::isfinite(square_m), "board: square_m", square_m, "positive");
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

Eigen::Matrix3Xd ChessboardTarget::corners_m() const {
  Eigen::Matrix3Xd corners(3, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      corners.col(row * columns + column) = square_m * Eigen::Vector3d(column, row, 0);
  return corners;
}

void CircleGridTarget::validate() const {
  require(columns >= 2 && columns <= 1000, "grid: columns", columns, "between 2 and 1000");
  require(rows >= 2 && rows <= 1000, "grid: rows", rows, "between 2 and 1000");
  require(spacing_m > 0 && std::isfinite(spacing_m), "grid: spacing_m", spacing_m, "positive");
  const double nearest_m = asymmetric ? std::sqrt(2) * spacing_m : spacing_m;
  require(radius_m > 0 && 2 * radius_m < nearest_m, "grid: radius_m", radius_m,
          "positive, less than half the distance of neighbouring discs");
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

Eigen::Matrix3Xd CircleGridTarget::centres_m() const {
  Eigen::Matrix3Xd centres(3, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      centres.col(row * columns + column) =
          spacing_m * Eigen::Vector3d(asymmetric ? 2 * column + row % 2 : column, row, 0);
  return centres;
}

void AprilGridTarget::validate() const {
  board.validate();
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

void CharucoTarget::validate() const {
  board.validate();
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

}  // namespace occ
