// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/marker_boards.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Points = Result<BoardPoints>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Rows3D = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Adds the layout of a board to its class.
template <class Board>
void define_layout(py::module_& m, const char* name, const char* points_doc, const char* tags_doc) {
  auto cls = py::reinterpret_borrow<py::class_<Board>>(m.attr(name));
  cls.def_property_readonly(
      "points_m", [](const Board& board) { return Rows3D(board.points_m().transpose()); },
      points_doc);
  cls.def(
      "tags",
      [](const Board& board) {
        std::map<int, Eigen::Matrix<double, 4, 2, Eigen::RowMajor>> tags;
        for (const BoardTag& tag : board.tags())
          for (int k = 0; k < 4; ++k)
            tags[tag.id].row(k) = tag.corners_m[static_cast<std::size_t>(k)].transpose();
        return tags;
      },
      tags_doc);
}

void define_boards(py::module_& m) {
  using G = AprilGrid;
  define_documented<G>(
      m, "AprilGrid",
      "Grid of AprilTags as Kalibr prints it. Frame: origin at the lower left corner of tag 0, x "
      "to "
      "the right, y up, z towards the viewer.",
      std::make_tuple(
          required_field("tag_size_m", &G::tag_size_m, "side of a tag's black square [m]"),
          field("columns", &G::columns, "number of tags of a row"),
          field("rows", &G::rows, "number of rows"),
          field("spacing", &G::spacing, "gap between tags, relative to tag_size_m"),
          field("family", &G::family, "tag36h11, tag36h10, tag25h9 or tag16h5"),
          field("border_cells", &G::border_cells,
                "width of the tags' black border [cells]; Kalibr prints 2")));
  using B = CharucoBoard;
  define_documented<B>(
      m, "CharucoBoard",
      "Chessboard with AprilTags in its white squares, as OpenCV prints it with a dictionary "
      "DICT_APRILTAG_*. Frame: origin at the upper left corner of the board, x to the right, y "
      "down, z away from the viewer.",
      std::make_tuple(
          required_field("square_m", &B::square_m, "side of a square [m]"),
          required_field("marker_m", &B::marker_m, "side of a marker's black square [m]"),
          field("columns", &B::columns, "number of squares of a row"),
          field("rows", &B::rows, "number of rows of squares"),
          field("family", &B::family, "tag36h11, tag36h10, tag25h9 or tag16h5"),
          field("legacy", &B::legacy,
                "layout of OpenCV before 4.6 (setLegacyPattern): with an even number of rows, the "
                "upper left square is white")));
  define_layout<G>(m, "AprilGrid",
                   "(4 n, 3) points of the board [m]: lower left, lower right, upper right and "
                   "upper left corner of each tag. Those of tag `id` have the indices 4 id to "
                   "4 id + 3.",
                   "Returns the corners (4, 2) [m] of each tag by id, as in AprilTag.corners_px.");
  define_layout<B>(
      m, "CharucoBoard",
      "(n, 3) points of the board [m]: the inner corners in the order of OpenCV, row "
      "by row from the upper left.",
      R"(Returns the corners (4, 2) [m] of each marker by id, as in AprilTag.corners_px.

OpenCV prints the tags upside down: the first corner, the lower left one of the upright tag, is the
upper right one on the board.)");
}

auto board_option_fields() {
  using O = MarkerBoardOptions;
  return std::make_tuple(
      field("decimate", &O::decimate,
            "factor by which the image is reduced for the search of tags"),
      field("threads", &O::threads, "number of threads of the search of tags"),
      field("max_hamming", &O::max_hamming, "max number of corrected bits of a tag, 0 to 2"),
      field("max_window_px", &O::max_window_px, "max radius of the window around a point"),
      field("model_sigma_px", &O::model_sigma_px,
            "sigma per axis of errors that points of the image share"),
      field("tile_px", &O::tile_px, "side of the tiles for a very large image; 0: no tiles"),
      field("overlap_px", &O::overlap_px, "overlap of the tiles, larger than any tag"));
}

template <class Board, class Find>
void define_search(py::module_& m, const char* name, const char* doc, const Find& find) {
  const auto fields = board_option_fields();
  define_function(
      m, name, fields,
      [find](MarkerBoardOptions options, const NumpyImage& image, const Board& board) {
        py::gil_scoped_release unlocked;
        return find(image.view, board, options);
      },
      py::arg("image"), py::arg("board"), py::kw_only(),
      (doc + fields_doc(fields, "Options")).c_str());
}

}  // namespace

void define_marker_boards(py::module_& m) {
  define_boards(m);
  ResultClass<Points> points(m, "BoardPoints", "Points of a board with tags in an image.");
  define_result(points);
  points
      .def_property_readonly("indices", value_of(&BoardPoints::indices),
                             "Indices of the points among those of the board, increasing.")
      .def_property_readonly(
          "px", [](const Points& p) { return Rows(p->px.transpose()); }, "(n, 2) points.")
      .def_property_readonly("covariance_px2", value_of(&BoardPoints::covariance_px2),
                             "Covariance (2, 2) of each point.")
      .def_property_readonly("scatter_sigma_px", value_of(&BoardPoints::scatter_sigma_px),
                             "Sigma per axis of the scatter about a smooth grid that the fits do "
                             "not explain; it is part of the covariances.")
      .def_property_readonly("tags", value_of(&BoardPoints::tags),
                             "Number of tags of the board that were detected.")
      .def_property_readonly("hidden", value_of(&BoardPoints::hidden),
                             "Number of predicted points inside the image that were not measured: "
                             "something covers them, or glare.")
      .def_property_readonly("foreign_ids", value_of(&BoardPoints::foreign_ids),
                             "Ids of detected tags that the board does not have; ignored.")
      .def_property_readonly("misplaced_ids", value_of(&BoardPoints::misplaced_ids),
                             "Ids of detected tags at another place than the board's; ignored.");
  define_search<AprilGrid>(
      m, "find_april_grid",
      R"(Detects the corners of the tags of an AprilGrid; a part of it suffices.

board: AprilGrid. Returns: BoardPoints with the indices of AprilGrid.points_m; status too_few_lamps
if no tag of the board was detected, ambiguous if several boards are in the image, degenerate if the
tags are arranged in another way. Raises: ValueError for an invalid image, board or option.)",
      [](const ImageView& image, const AprilGrid& board, const MarkerBoardOptions& options) {
        return find_april_grid(image, board, options);
      });
  define_search<CharucoBoard>(
      m, "find_charuco",
      R"(Detects the inner corners of a ChArUco board; a part of it suffices.

board: CharucoBoard. Returns: BoardPoints with the indices of CharucoBoard.points_m, which are OpenCV's;
status as find_april_grid(). Raises: ValueError for an invalid image, board or option.)",
      [](const ImageView& image, const CharucoBoard& board, const MarkerBoardOptions& options) {
        return find_charuco(image, board, options);
      });
}

}  // namespace occ::python
