// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/targets.hpp"

#include "casters.hpp"
#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

py::array_t<double> rows_of(const Eigen::Matrix2Xd& columns) {
  return py::cast(Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>(columns.transpose()));
}

void define_kinds(py::module_& m) {
  using C = CircularTarget;
  define_documented<C>(
      m, "CircularTarget", "A disc on a square sheet of the opposite tone.",
      std::make_tuple(
          required_field("id", &C::id, "id of the target"),
          required_field("radius_m", &C::radius_m, "radius of the disc [m]"),
          required_field("centre_m", &C::centre_m, "(3,) centre [m, world]"),
          field("sheet_m", &C::sheet_m, "side of the sheet [m]; 0 selects four radii"),
          field("dark", &C::dark, "true: black disc on white; false: white disc on black"),
          field("normal", &C::normal, "(3,) direction that the printed side faces")));
  using B = ChessboardTarget;
  define_documented<B>(
      m, "ChessboardTarget",
      "A chessboard of (columns + 1) x (rows + 1) squares; the first, at the upper left, is black.",
      std::make_tuple(
          required_field("square_m", &B::square_m, "side of a square [m]"),
          field("columns", &B::columns, "number of columns of inner corners"),
          field("rows", &B::rows, "number of rows of inner corners"),
          field("world_from_board", &B::world_from_board,
                "4x4 pose of the board: x to the right, y down, z away from the viewer")));
  using G = CircleGridTarget;
  define_documented<G>(
      m, "CircleGridTarget",
      "A grid of discs on a sheet. Centres are at (column, row) spacing_m in the board's frame, or "
      "at (2 column + row % 2, row) spacing_m if asymmetric.",
      std::make_tuple(
          required_field("spacing_m", &G::spacing_m, "distance of the rows [m]"),
          required_field("radius_m", &G::radius_m, "radius of the discs [m]"),
          field("columns", &G::columns, "number of discs of a row"),
          field("rows", &G::rows, "number of rows"),
          field("asymmetric", &G::asymmetric, "true: odd rows are shifted by spacing_m"),
          field("dark", &G::dark, "true: black discs on white; false: white discs on black"),
          field("world_from_board", &G::world_from_board,
                "4x4 pose of the board: x to the right, y down, z away from the viewer")));
}

void define_board_kinds(py::module_& m) {
  using G = AprilGridTarget;
  define_documented<G>(
      m, "AprilGridTarget", "A grid of AprilTags in the world.",
      std::make_tuple(required_field("board", &G::board, "AprilGrid"),
                      field("world_from_board", &G::world_from_board,
                            "4x4 pose of the board: x to the right, y up, z towards the viewer")));
  using C = CharucoTarget;
  define_documented<C>(
      m, "CharucoTarget", "A ChArUco board in the world.",
      std::make_tuple(
          required_field("board", &C::board, "CharucoBoard"),
          field("world_from_board", &C::world_from_board,
                "4x4 pose of the board: x to the right, y down, z away from the viewer")));
}

void define_target_truth(py::module_& m) {
  ResultClass<TagTruth>(m, "TagTruth", "Ground truth of a tag in a rendered image.")
      .def_readonly("id", &TagTruth::id, "Id of the tag.")
      .def_readonly("in_view", &TagTruth::in_view, "It is drawn, and part of it lies on the image.")
      .def_readonly("whole", &TagTruth::whole, "Its whole sheet lies on the image.")
      .def_property_readonly(
          "corners_px",
          [](const TagTruth& t) {
            Eigen::Matrix<double, 4, 2, Eigen::RowMajor> rows;
            for (int i = 0; i < 4; ++i) rows.row(i) = t.corners_px[i].transpose();
            return rows;
          },
          "(4, 2) corners in the order of detect_april_tags().");
  ResultClass<CircleTruth>(m, "CircleTruth",
                           "Ground truth of a circular target in a rendered image.")
      .def_readonly("id", &CircleTruth::id, "Id of the target.")
      .def_readonly("in_view", &CircleTruth::in_view,
                    "It is drawn, and part of it lies on the image.")
      .def_readonly("whole", &CircleTruth::whole, "Its whole sheet lies on the image.")
      .def_readonly("centre_px", &CircleTruth::centre_px, "(2,) projection of the centre.")
      .def_readonly("image_centre_px", &CircleTruth::image_centre_px,
                    "(2,) centroid of the disc's image.");
  ResultClass<ChessboardTruth>(m, "ChessboardTruth", "Ground truth of a board in a rendered image.")
      .def_readonly("in_view", &ChessboardTruth::in_view,
                    "It is drawn, and part of it lies on the image.")
      .def_readonly("whole", &ChessboardTruth::whole, "The whole board lies on the image.")
      .def_property_readonly(
          "corners_px", [](const ChessboardTruth& t) { return rows_of(t.corners_px); },
          "(n, 2) inner corners, row by row.");
  ResultClass<MarkerBoardTruth>(m, "MarkerBoardTruth",
                                "Ground truth of a board with tags in a rendered image.")
      .def_readonly("in_view", &MarkerBoardTruth::in_view,
                    "It is drawn, and part of it lies on the image.")
      .def_readonly("whole", &MarkerBoardTruth::whole, "The whole board lies on the image.")
      .def_property_readonly(
          "points_px", [](const MarkerBoardTruth& t) { return rows_of(t.points_px); },
          "(n, 2) points of the board, in their order.");
  ResultClass<CircleGridTruth>(m, "CircleGridTruth",
                               "Ground truth of a grid of discs in a rendered image.")
      .def_readonly("in_view", &CircleGridTruth::in_view,
                    "It is drawn, and part of it lies on the image.")
      .def_readonly("whole", &CircleGridTruth::whole, "The whole sheet lies on the image.")
      .def_property_readonly(
          "centres_px", [](const CircleGridTruth& t) { return rows_of(t.centres_px); },
          "(n, 2) projections of the centres, row by row.");
}

void define_pattern(py::module_& m) {
  ResultClass<TagPattern>(m, "TagPattern", "Cells of a printed AprilTag.")
      .def_readonly("black", &TagPattern::black,
                    "(n, n) bool: black cells, rows from the top, with the ring around the square.")
      .def_readonly("square_cells", &TagPattern::square_cells,
                    "Side of the square whose corners are detected, in the middle [cells].");
  m.def("tag_pattern", &tag_pattern, py::arg("family"), py::arg("id"), py::kw_only(),
        py::arg("border_cells") = 1,
        R"(Returns the TagPattern to print a tag.

family: a name in april_tag_families(). id: number of the tag. border_cells: width of the black
border, 1 to 4; above 1 for tag36h11, tag36h10, tag25h9 and tag16h5 only.
Raises: ValueError for an unknown family, an id that the family does not have, or such a border.)");
}

auto target_option_fields() {
  using O = TargetImageOptions;
  return std::make_tuple(
      field("psf_sigma_px", &O::psf_sigma_px, "standard deviation of the Gaussian lens blur"),
      field("black_dn", &O::black_dn, "grey level of black print"),
      field("white_dn", &O::white_dn, "grey level of paper"),
      field("ground_dn", &O::ground_dn, "grey level of the ground"),
      field("margin_cells", &O::margin_cells,
            "white paper around a print [cells; squares; spacings or gaps of a grid]"),
      field("noise_dn", &O::noise_dn, "standard deviation of the noise of a pixel"),
      field("seed", &O::seed, "seed of the noise"),
      field("frame", &O::frame, "index of the image; images of one seed differ in noise"));
}

}  // namespace

void define_targets(py::module_& m) {
  define_kinds(m);
  define_board_kinds(m);
  define_target_truth(m);
  define_pattern(m);
  py::class_<TargetRenderer> renderer(m, "TargetRenderer", R"(Renders images of calibration targets.

Windows are bit-identical to parts of one image, so a panorama that exceeds the memory can be
rendered piece by piece.)");
  const auto fields = target_option_fields();
  define_constructor(
      renderer, fields,
      [](TargetImageOptions options, const Camera& camera, const Rigid3& pose,
         const std::vector<Tag>& tags, const std::vector<CircularTarget>& circles,
         const std::vector<ChessboardTarget>& boards, const std::vector<CircleGridTarget>& grids,
         const std::vector<AprilGridTarget>& april_grids,
         const std::vector<CharucoTarget>& charucos) {
        return TargetRenderer({tags, circles, boards, grids, april_grids, charucos}, camera, pose,
                              options);
      },
      py::arg("camera"), py::arg("cam_from_world"), py::kw_only(),
      py::arg_v("tags", std::vector<Tag>{}, "[]"),
      py::arg_v("circles", std::vector<CircularTarget>{}, "[]"),
      py::arg_v("boards", std::vector<ChessboardTarget>{}, "[]"),
      py::arg_v("grids", std::vector<CircleGridTarget>{}, "[]"),
      py::arg_v("april_grids", std::vector<AprilGridTarget>{}, "[]"),
      py::arg_v("charucos", std::vector<CharucoTarget>{}, "[]"),
      ("Raises: ValueError naming the target or option that is not valid." +
       fields_doc(fields, "Options"))
          .c_str());
  renderer
      .def_property_readonly(
          "tags", [](const TargetRenderer& r) { return r.truth().tags; },
          "A TagTruth for each tag.")
      .def_property_readonly(
          "circles", [](const TargetRenderer& r) { return r.truth().circles; },
          "A CircleTruth for each circle.")
      .def_property_readonly(
          "boards", [](const TargetRenderer& r) { return r.truth().boards; },
          "A ChessboardTruth for each board.")
      .def_property_readonly(
          "grids", [](const TargetRenderer& r) { return r.truth().grids; },
          "A CircleGridTruth for each grid.")
      .def_property_readonly(
          "april_grids", [](const TargetRenderer& r) { return r.truth().april_grids; },
          "A MarkerBoardTruth for each grid of tags.")
      .def_property_readonly(
          "charucos", [](const TargetRenderer& r) { return r.truth().charucos; },
          "A MarkerBoardTruth for each ChArUco board.")
      .def(
          "window",
          [](const TargetRenderer& r, int x0, int y0, int width, int height) {
            Image image;
            {
              py::gil_scoped_release unlocked;
              image = r.window({x0, y0, width, height});
            }
            return to_numpy(std::move(image));
          },
          py::arg("x0"), py::arg("y0"), py::arg("width"), py::arg("height"),
          "Renders a window, (height, width) uint8. Raises: ValueError if it is not inside the "
          "image.");
}

}  // namespace occ::python
