// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/tags.hpp"

#include "fields.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "module.hpp"
#include "progress.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

py::array_t<double> corners_of(const AprilTag& tag) {
  py::array_t<double> array({4, 2});
  for (py::ssize_t k = 0; k < 4; ++k)
    for (py::ssize_t i = 0; i < 2; ++i) array.mutable_at(k, i) = tag.corners_px[k][i];
  return array;
}

py::array_t<double> covariances_of(const AprilTag& tag) {
  py::array_t<double> array({4, 2, 2});
  for (py::ssize_t k = 0; k < 4; ++k)
    for (py::ssize_t i = 0; i < 2; ++i)
      for (py::ssize_t j = 0; j < 2; ++j) array.mutable_at(k, i, j) = tag.covariance_px2[k](i, j);
  return array;
}

void define_april_tag(py::module_& m) {
  ResultClass<AprilTag>(m, "AprilTag", "A tag detected in an image.")
      .def_readonly("id", &AprilTag::id, "Number of the tag in its family.")
      .def_readonly("family", &AprilTag::family, "Name of the family.")
      .def_readonly("hamming", &AprilTag::hamming, "Number of corrected bits.")
      .def_readonly("decision_margin", &AprilTag::decision_margin,
                    "Mean difference between bits and threshold [grey levels of 255].")
      .def_property_readonly(
          "corners_px", &corners_of,
          "(4, 2) lower left, lower right, upper right, upper left of the upright tag.")
      .def_property_readonly("covariance_px2", &covariances_of,
                             "(4, 2, 2) covariances of the corners.")
      .def_readonly("centre_px", &AprilTag::centre_px, "(2,) intersection of the diagonals.")
      .def_readonly("homography", &AprilTag::homography,
                    "(3, 3) maps the tag, with corners (-1, -1) to (1, 1), y up, to the image.")
      .def_readonly("refined", &AprilTag::refined,
                    "False: too small or cut; the corners are accurate to 0.1 px.")
      .def("__repr__", [](const AprilTag& tag) {
        return "<AprilTag: " + tag.family + " " + std::to_string(tag.id) + ", margin " +
               value_repr(tag.decision_margin) + ">";
      });
}

auto april_tag_fields() {
  using O = AprilTagOptions;
  return std::make_tuple(
      field("family", &O::family, "a name in april_tag_families()"),
      field("border_cells", &O::border_cells,
            "width of the tags' black border [cells]; 2 in grids of Kalibr"),
      field("decimate", &O::decimate, "factor by which the image is reduced for the search"),
      field("threads", &O::threads, "number of threads"),
      field("max_hamming", &O::max_hamming, "max number of corrected bits, 0 to 2"),
      field("min_decision_margin", &O::min_decision_margin,
            "min decision_margin of a tag [grey levels of 255]"),
      field("refine", &O::refine, "refine the corners to hundredths of a pixel"),
      field("tile_px", &O::tile_px, "side of the tiles for a very large image; 0: no tiles"),
      field("overlap_px", &O::overlap_px, "overlap of neighbouring tiles, larger than any tag"));
}

}  // namespace

void define_tag(py::module_& m) {
  define_documented<Tag>(m, "Tag", "An AprilTag as a landmark: its number, size and place.",
                         internal::scene::tag_fields);
}

void define_april_tags(py::module_& m) {
  define_april_tag(m);
  m.def("april_tag_families", &april_tag_families, "Returns the names of the supported families.");
  m.def(
      "tag_poses",
      [](const AprilTag& tag, double size_m, const Camera& camera) {
        return tag_poses(tag, size_m, camera);
      },
      py::arg("tag"), py::arg("size_m"), py::arg("camera"),
      R"(Computes all poses of the camera relative to a tag, best first: both minima of a plane.

tag: AprilTag. size_m: side of the square whose corners are detected [m].
Returns: Candidates whose world is the tag's frame: x right, y up, z towards the viewer.
Raises: ValueError for a size that is not positive.)");
  m.def(
      "locate_by_tags", &locate_by_tags, py::arg("tags"), py::arg("scene"),
      py::arg("lamps") = std::map<int, Blob>{},
      R"(Computes the camera's pose from the tags of the scene, and from its lamps if they are given.

tags: AprilTags. lamps: lamp id -> Blob, as in a Fix. Returns: Fix; status too_few_lamps when no tag
of the scene is visible. Raises: ValueError for a lamp that the scene does not have.)");
  const auto fields = april_tag_fields();
  define_function(
      m, "detect_april_tags", fields,
      [](AprilTagOptions options, const NumpyImage& image, const std::optional<Camera>& camera,
         const py::object& progress) {
        if (camera) options.bends_px = side_bends(*camera);
        if (!progress.is_none())
          options.progress = [&](int done, int tiles) {
            return report_progress(progress, done, tiles);
          };
        py::gil_scoped_release unlocked;
        return detect_april_tags(image.view, options);
      },
      py::arg("image"), py::kw_only(), py::arg("camera") = py::none(),
      py::arg("progress") = py::none(),
      ("Detects the AprilTags in an image; sorted by id, corners to hundredths of a "
       "pixel.\n\n"
       "image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16.\n"
       "camera: camera of the image, if known: the bends of the tags' sides are then "
       "computed\n"
       "from its distortion instead of being estimated.\n"
       "progress(tiles_done, tiles): called after each tile; False stops the search.\n"
       "Returns: list of AprilTag. Raises: ValueError for an invalid image or option." +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
