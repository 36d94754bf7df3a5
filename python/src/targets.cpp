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
      m, "CircularTarget", "A disc on a square sheet of the other tone.",
      std::make_tuple(required_field("id", &C::id, "its number"),
                      required_field("radius_m", &C::radius_m, "[m]"),
                      required_field("centre_m", &C::centre_m, "(3,) [m, world]"),
                      field("sheet_m", &C::sheet_m, "side of the sheet [m]; 0: four radii"),
                      field("dark", &C::dark, "a black disc on white"),
                      field("normal", &C::normal, "(3,) towards the printed side")));
  using B = ChessboardTarget;
  define_documented<B>(
      m, "ChessboardTarget",
      "A chessboard of (columns + 1) x (rows + 1) squares, the first corner's black.",
      std::make_tuple(required_field("square_m", &B::square_m, "side of a square [m]"),
                      field("columns", &B::columns, "of inner corners"),
                      field("rows", &B::rows, "of inner corners"),
                      field("world_from_board", &B::world_from_board,
                            "4x4; its z axis points away from the viewer, y down")));
}

void define_truth(py::module_& m) {
  ResultClass<TagTruth>(m, "TagTruth", "Where a tag is in a rendered image.")
      .def_readonly("id", &TagTruth::id, "Of the tag.")
      .def_readonly("in_view", &TagTruth::in_view, "Drawn, and some of it lies on the image.")
      .def_readonly("whole", &TagTruth::whole, "All of its sheet lies on the image.")
      .def_property_readonly(
          "corners_px",
          [](const TagTruth& t) {
            Eigen::Matrix<double, 4, 2, Eigen::RowMajor> rows;
            for (int i = 0; i < 4; ++i) rows.row(i) = t.corners_px[i].transpose();
            return rows;
          },
          "(4, 2) as detect_april_tags() has them.");
  ResultClass<CircleTruth>(m, "CircleTruth", "Where a circular target is in a rendered image.")
      .def_readonly("id", &CircleTruth::id, "Of the target.")
      .def_readonly("in_view", &CircleTruth::in_view, "Drawn, and some of it on the image.")
      .def_readonly("whole", &CircleTruth::whole, "All of its sheet lies on the image.")
      .def_readonly("centre_px", &CircleTruth::centre_px, "The centre's projection.")
      .def_readonly("image_centre_px", &CircleTruth::image_centre_px, "The image's centroid.");
  ResultClass<ChessboardTruth>(m, "ChessboardTruth", "Where a board is in a rendered image.")
      .def_readonly("in_view", &ChessboardTruth::in_view, "Drawn, and some of it on the image.")
      .def_readonly("whole", &ChessboardTruth::whole, "All of it lies on the image.")
      .def_property_readonly(
          "corners_px", [](const ChessboardTruth& t) { return rows_of(t.corners_px); },
          "(n, 2) inner corners, row by row.");
}

auto option_fields() {
  using O = TargetImageOptions;
  return std::make_tuple(
      field("psf_sigma_px", &O::psf_sigma_px, "of the Gaussian lens blur"),
      field("black_dn", &O::black_dn, "grey level of black print"),
      field("white_dn", &O::white_dn, "of paper"), field("ground_dn", &O::ground_dn, "of the wall"),
      field("margin_cells", &O::margin_cells, "of white paper around a print, in its cells"),
      field("noise_dn", &O::noise_dn, "standard deviation of a pixel"),
      field("seed", &O::seed, "of the noise"),
      field("frame", &O::frame, "noise differs from frame to frame under one seed"));
}

}  // namespace

void define_targets(py::module_& m) {
  define_kinds(m);
  define_truth(m);
  py::class_<TargetRenderer> renderer(m, "TargetRenderer", R"(Pictures of calibration targets.

Windows of one renderer are parts of one image, to the bit: a panorama that memory does not hold can
be made piece by piece.)");
  DefaultTexts texts;
  const auto fields = option_fields();
  std::apply(
      [&](const auto&... f) {
        renderer.def(
            py::init([fields](const Camera& camera, const Rigid3& pose,
                              const std::vector<Tag>& tags,
                              const std::vector<CircularTarget>& circles,
                              const std::vector<ChessboardTarget>& boards,
                              const typename std::decay_t<decltype(f)>::value_type&... values) {
              return TargetRenderer({tags, circles, boards}, camera, pose,
                                    from_values<TargetImageOptions>(fields, values...));
            }),
            py::arg("camera"), py::arg("cam_from_world"), py::kw_only(),
            py::arg_v("tags", std::vector<Tag>{}, "[]"),
            py::arg_v("circles", std::vector<CircularTarget>{}, "[]"),
            py::arg_v("boards", std::vector<ChessboardTarget>{}, "[]"), argument(f, texts)...,
            ("Raises: ValueError naming what does not validate." + fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
  renderer
      .def_property_readonly(
          "tags", [](const TargetRenderer& r) { return r.truth().tags; }, "TagTruths.")
      .def_property_readonly(
          "circles", [](const TargetRenderer& r) { return r.truth().circles; }, "CircleTruths.")
      .def_property_readonly(
          "boards", [](const TargetRenderer& r) { return r.truth().boards; }, "ChessboardTruths.")
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
          "(height, width) uint8. Raises: ValueError for a window that leaves the image.");
}

}  // namespace occ::python
