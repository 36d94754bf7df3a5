// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/start_network.hpp"

#include <type_traits>
#include <utility>
#include <variant>

#include "fields.hpp"
#include "libocc/calibrate/board_network.hpp"
#include "libocc/calibrate/lamp_network.hpp"
#include "libocc/calibrate/point_starts.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/core/require.hpp"
#include "libocc/landmarks/chessboard.hpp"
#include "libocc/landmarks/circle_grid.hpp"
#include "libocc/pose/relative_orientation.hpp"
#include "module.hpp"
#include "progress.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using Started = Result<NetworkStart>;
using Resected = Result<Resection>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

/// Callback of a search, which also raises the signals of Python.
std::function<bool(int, int)> search_progress(const py::object& progress) {
  return [progress](int done, int searches) { return report_progress(progress, done, searches); };
}

/// Defines what chessboards and grids have in common. Results unpack to (px, covariance_px2).
template <class Points>
void define_board_points(ResultClass<Points>& points, const char* px_doc) {
  points
      .def_property_readonly(
          "px", [](const Points& p) { return Rows(p.px.transpose()); }, px_doc)
      .def_readonly("covariance_px2", &Points::covariance_px2, "Covariance (2, 2) of each point.")
      .def_readonly("scatter_sigma_px", &Points::scatter_sigma_px,
                    "Sigma per axis of the scatter about a smooth grid that the fits do not "
                    "explain; it is part of the covariances.")
      .def_readonly("unfitted", &Points::unfitted,
                    "Number of points whose fit failed, for example in glare. They are measured in "
                    "the reduced image, and their covariance is large.");
  points.def("__len__", [](const Points&) { return 2; })
      .def("__getitem__", [](const Points& p, int i) -> py::object {
        if (i == 0 || i == -2) return py::cast(Rows(p.px.transpose()));
        if (i == 1 || i == -1) return py::cast(p.covariance_px2);
        throw py::index_error("a board unpacks to (px, covariance_px2)");
      });
}

void define_chessboard(py::module_& m) {
  ResultClass<ChessboardCorners> corners(
      m, "ChessboardCorners", "Inner corners of a chessboard; unpacks to (px, covariance_px2).");
  define_board_points(corners, "(n, 2) corners, row by row.");
  m.def(
      "find_chessboard",
      [](const NumpyImage& image, int columns, int rows, const py::object& progress) {
        ChessboardOptions options;
        options.columns = columns;
        options.rows = rows;
        options.progress = search_progress(progress);
        py::gil_scoped_release unlocked;
        return find_chessboard(image.view, options);
      },
      py::arg("image"), py::arg("columns"), py::arg("rows"), py::kw_only(),
      py::arg("progress") = py::none(),
      R"(Detects the inner corners of a chessboard.

columns, rows: numbers of inner corners. progress(searches_done, searches): called before the search
in each reduced image; False stops the search. Returns: ChessboardCorners, or None if a part of the
board is not visible or the image has a board with more corners. The square before the first corner
is black, if an orientation of the board has a black square there.
Raises: ValueError for an invalid argument.)");
}

void define_circle_grid(py::module_& m) {
  ResultClass<CircleGridPoints> points(
      m, "CircleGridPoints", "Images of the discs of a grid; unpacks to (px, covariance_px2).");
  define_board_points(points, "(n, 2) centres of the ellipses, row by row.");
  points.def_readonly("dark", &CircleGridPoints::dark,
                      "True if the discs are darker than their surroundings.");
  m.def(
      "find_circle_grid",
      [](const NumpyImage& image, int columns, int rows, bool asymmetric,
         const py::object& progress) {
        CircleGridOptions options;
        options.columns = columns;
        options.rows = rows;
        options.asymmetric = asymmetric;
        options.progress = search_progress(progress);
        py::gil_scoped_release unlocked;
        return find_circle_grid(image.view, options);
      },
      py::arg("image"), py::arg("columns"), py::arg("rows"), py::kw_only(),
      py::arg("asymmetric") = true, py::arg("progress") = py::none(),
      R"(Detects a grid of discs on a calibration board.

columns, rows: numbers of discs of a row, and of rows. asymmetric: odd rows are shifted by half the
distance of the discs of a row. progress(searches_done, searches): called before the search in each
reduced image; False stops the search. Returns: CircleGridPoints, or None if a part of the grid is not
visible or the image has a grid with more discs. The centre of a disc's ellipse is not the image of
the disc's centre; correct_disc_centres() corrects that.
Raises: ValueError for an invalid argument.)");
  m.def(
      "circle_grid_positions",
      [](int columns, int rows, bool asymmetric, double spacing) {
        return Rows(circle_grid_positions(columns, rows, asymmetric, spacing).transpose());
      },
      py::arg("columns"), py::arg("rows"), py::arg("asymmetric"), py::arg("spacing"),
      R"(Returns the centres (n, 2) of the discs of a grid, row by row.

They are (column, row) * spacing, or (2 column + row % 2, row) * spacing if asymmetric.
Raises: ValueError for an argument that is not positive.)");
}

using WholeBoard = std::tuple<std::string, int, Rows, std::vector<Eigen::Matrix2d>>;
using PartOfBoard =
    std::tuple<std::string, int, Rows, std::vector<Eigen::Matrix2d>, std::vector<int>>;
using BoardTuple = std::variant<WholeBoard, PartOfBoard>;

std::vector<BoardImage> board_images(const std::vector<BoardTuple>& images) {
  std::vector<BoardImage> all;
  for (const BoardTuple& image : images)
    std::visit(
        [&](const auto& fields) {
          BoardImage seen{std::get<0>(fields),
                          std::get<1>(fields),
                          std::get<2>(fields).transpose(),
                          std::get<3>(fields),
                          {}};
          if constexpr (std::is_same_v<std::decay_t<decltype(fields)>, PartOfBoard>)
            seen.indices = std::get<4>(fields);
          all.push_back(std::move(seen));
        },
        image);
  return all;
}

void define_disc_centres(py::module_& m) {
  m.def(
      "correct_disc_centres",
      [](Network& network, const std::vector<BoardTuple>& images, double radius_m) {
        const std::vector<BoardImage> seen = board_images(images);
        py::gil_scoped_release unlocked;
        return correct_disc_centres(network, seen, radius_m);
      },
      py::arg("network"), py::arg("images"), py::arg("radius_m"),
      R"(Moves image points of discs from the centres of their ellipses to the images of their centres.

The difference is computed by the exact projection of the discs, with the cameras and poses of the
network, which is changed. network: of one board, from board_network() or adjusted; images: as given
to board_network(). Returns: number of discs that are not used because they are not projected whole.
All others are used again. Raises: ValueError if network and images differ.)");
}

void define_resection(py::module_& m) {
  ResultClass<Resected> resection(m, "Resection", "Pose of an image from known points.");
  define_result(resection);
  resection
      .def_property_readonly("cam_from_world", value_of(&Resection::cam_from_world), "Pose, 4x4.")
      .def_property_readonly("sigma_px", value_of(&Resection::sigma_px),
                             "Robust standard deviation of the residuals, per axis.")
      .def_property_readonly("inliers", value_of(&Resection::inliers), "True for each inlier.")
      .def_property_readonly("alternatives", value_of(&Resection::alternatives),
                             "Poses with residuals up to three times larger, best first.");
  m.def(
      "resect",
      [](const Rows3& points_m, const Rows2& points_px, const Camera& camera) {
        return resect(points_m.transpose(), points_px.transpose(), camera);
      },
      py::arg("points_m"), py::arg("points_px"), py::arg("camera"),
      R"(Computes the pose of a camera of any model from known points, robustly.

points_m: (n, 3), points_px: (n, 2); up to a third may be gross errors. Returns: Resection.
Raises: ValueError for unequal counts.)");
  m.def(
      "start_pinhole",
      [](const std::vector<std::pair<Rows2, Rows2>>& views, int width, int height) {
        std::vector<PlaneView> all;
        for (const auto& [plane, px] : views) all.push_back({plane.transpose(), px.transpose()});
        const Result<Camera> found = start_pinhole(all, width, height);
        return std::make_tuple(found.value, found.status, found.message);
      },
      py::arg("views"), py::arg("width"), py::arg("height"),
      "Estimates an approximate pinhole camera from views of planes, each ((n, 2) in the plane, "
      "(n, 2) [px]). Returns: (Camera, Status, message).");
}

using Cameras = std::vector<std::tuple<std::string, Camera, std::vector<std::string>>>;

std::vector<NetworkCamera> network_cameras(const Cameras& cameras) {
  std::vector<NetworkCamera> all;
  for (const auto& [name, camera, free] : cameras) all.push_back({name, camera, free});
  return all;
}

void define_boards_and_lamps(py::module_& m) {
  m.def(
      "board_network",
      [](const Cameras& cameras, const Rows3& board_m, const std::vector<BoardTuple>& images) {
        const std::vector<BoardImage> seen = board_images(images);
        const Eigen::Matrix3Xd board = board_m.transpose();
        py::gil_scoped_release unlocked;
        return board_network(network_cameras(cameras), board, seen);
      },
      py::arg("cameras"), py::arg("board_m"), py::arg("images"),
      R"(Builds a network from images of one board of known points, which define the world frame.

cameras: (name, Camera, free parameters); board_m: (n, 3); images: (name, camera index, (n, 2) [px],
covariances (2, 2)), or with a fifth element, the indices of the points, if a part of the board is
visible. Returns: NetworkStart; its warnings name the images that are left out: fewer than six points
of a larger board, or no pose. Raises: ValueError for counts or indices that do not match the board.)");
  m.def(
      "lamp_network",
      [](const Cameras& cameras, const Scene& scene,
         const std::vector<std::tuple<
             std::string, int, std::vector<std::tuple<int, Eigen::Vector2d, Eigen::Matrix2d>>>>&
             images) {
        std::vector<SurveyImage> seen;
        for (const auto& [name, camera, lamps] : images) {
          seen.push_back({name, camera, {}});
          for (const auto& [id, px, covariance] : lamps)
            seen.back().lamps.push_back({id, px, covariance});
        }
        py::gil_scoped_release unlocked;
        return lamp_network(network_cameras(cameras), scene, seen);
      },
      py::arg("cameras"), py::arg("scene"), py::arg("images"),
      R"(Builds a network from images of lamps with known ids, for surveying their positions.

scene: approximate positions; images: (name, camera index, [(lamp id, centroid (2,) [px], covariance
(2, 2))]). Returns: NetworkStart; points are named "lamp 7".)");
}

using Positions = std::map<int, Eigen::Vector3d>;
using Poses = std::map<int, Rigid3>;

void define_point_starts(py::module_& m) {
  m.def(
      "start_values",
      [](const std::vector<Camera>& cameras, const std::vector<PixelsOfPoints>& images,
         const Positions& points_m, const Poses& cam_from_world) {
        PointStarts found = start_values(cameras, images, {cam_from_world, points_m});
        return std::pair(std::move(found.cam_from_world), std::move(found.points_m));
      },
      py::arg("cameras"), py::arg("images"), py::arg("points_m"),
      py::arg_v("cam_from_world", Poses{}, "{}"),
      R"(Extends known poses and positions by resection and intersection in turn.

cameras: of each image; images: pixels of points by their number, for each image; points_m:
positions (3,) by number; cam_from_world: 4x4 by index of the image. An image needs four known
points, a point two images with poses. Returns: all poses and positions, in the same form. Raises:
ValueError unless there is one camera per image.)");
  m.def(
      "free_start",
      [](const std::vector<Camera>& cameras,
         const std::vector<PixelsOfPoints>& images) -> std::optional<std::pair<Poses, Positions>> {
        std::vector<PointStarts> found = free_starts(cameras, images);
        if (found.empty()) return std::nullopt;
        return std::pair(std::move(found[0].cam_from_world), std::move(found[0].points_m));
      },
      py::arg("cameras"), py::arg("images"),
      R"(Computes poses and positions from image points alone.

cameras: of each image; images: pixels of points by their number, for each image. Returns: poses
(4x4) by index of the image and positions (3,) by number, in the frame of one image and with the
distance of 1 between two; None if no two images have four common points, seen from different places.
Raises: ValueError unless there is one camera per image.)");
  ResultClass<RelativePose>(m, "RelativePose",
                            "Pose of the second image in the frame of the first.")
      .def_readonly("second_from_first", &RelativePose::second_from_first,
                    "4x4; the distance between both projection centres is 1.")
      .def_readonly("error_rad", &RelativePose::error_rad,
                    "Median angle between a bearing and its epipolar plane.")
      .def_readonly("intersected", &RelativePose::intersected,
                    "Points in front of both images whose rays meet at 2 degrees or more.");
  m.def(
      "relative_orientation",
      [](const Rows3& first, const Rows3& second, std::uint64_t seed) {
        return relative_orientation(first.transpose(), second.transpose(), seed);
      },
      py::arg("first"), py::arg("second"), py::arg("seed") = 0,
      R"(Computes the poses of two images from common points, best first.

first, second: unit bearings (n, 3); of six or more, up to a third may be gross errors. Returns:
list of RelativePose (two for points of a plane): four points are assumed to be in a plane, and five
have up to twelve poses, which further images must tell apart; empty with fewer points. Raises:
ValueError for unequal counts. Source: Stewenius, Engels, Nister, ISPRS Journal 60(4), 2006.)");
}

}  // namespace

void define_start_network(py::module_& m) {
  define_chessboard(m);
  define_circle_grid(m);
  define_resection(m);
  define_point_starts(m);
  ResultClass<Started> started(m, "NetworkStart", "Start values of a network.");
  define_result(started);
  started
      .def_property_readonly("network", value_of(&NetworkStart::network),
                             "Network with the images and targets of the largest block.")
      .def_property_readonly("blocks", value_of(&NetworkStart::blocks),
                             "Names of the images of each connected block, largest block first.")
      .def_property_readonly(
          "wrong_sizes",
          [](const Started& s) {
            std::map<int, double> sizes;
            for (const WrongSize& w : s->wrong_sizes) sizes[w.tag] = w.size_m;
            return sizes;
          },
          "Tag id -> estimated size [m], for tags whose size contradicts the others.")
      .def_property_readonly("warnings", value_of(&NetworkStart::warnings),
                             "Elements that were left out, with the reason.");
  define_boards_and_lamps(m);
  define_disc_centres(m);
  m.def(
      "start_network",
      [](const Cameras& cameras,
         const std::vector<std::tuple<std::string, int, std::vector<AprilTag>>>& images,
         double tag_size_m, const std::map<int, double>& other_sizes_m,
         const std::vector<int>& free_sizes) {
        std::vector<TagImage> seen;
        for (const auto& [name, camera, tags] : images) seen.push_back({name, camera, tags});
        StartOptions options;
        options.tag_size_m = tag_size_m;
        options.other_sizes_m = other_sizes_m;
        options.free_sizes = free_sizes;
        py::gil_scoped_release unlocked;
        return start_network(network_cameras(cameras), seen, options);
      },
      py::arg("cameras"), py::arg("images"), py::kw_only(), py::arg("tag_size_m"),
      py::arg_v("other_sizes_m", std::map<int, double>{}, "{}"),
      py::arg_v("free_sizes", std::vector<int>{}, "[]"),
      R"(Computes start values of a network from AprilTags in images.

cameras: (name, Camera, free parameters); images: (name, camera index, AprilTags).
other_sizes_m: sizes of tags that differ, by id. free_sizes: ids of tags of approximate size.
Returns: NetworkStart; status too_few_lamps or degenerate (blocks without common tags, by name).)");
}

}  // namespace occ::python
