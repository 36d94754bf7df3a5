// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/detect.hpp"

#include <sstream>

#include "fields.hpp"
#include "libocc/core/internal/blob_fields.hpp"
#include "module.hpp"
#include "tables.hpp"

namespace occ::python {

using internal::core::blob_colour_fields;
using internal::core::blob_fields;
using internal::core::ellipse_fields;
namespace {

std::string blob_repr(const Blob& blob) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(2);
  text << "<Blob: centroid [" << blob.centroid_px.x() << ", " << blob.centroid_px.y()
       << "] px, flux " << blob.flux_dn << " dn, " << blob.area_px << " px";
  if (blob.frequency_hz) text << ", " << *blob.frequency_hz << " Hz";
  if (blob.lamp_id) text << ", lamp " << *blob.lamp_id;
  if (blob.saturated) text << ", saturated";
  if (blob.merged) text << ", merged";
  if (blob.patterned) text << ", patterned";
  if (blob.cut_by_border) text << ", cut by border";
  if (blob.hidden_in_part) text << ", hidden in part";
  text << ">";
  return text.str();
}

}  // namespace

void define_detect(py::module_& m) {
  py::class_<Ellipse> ellipse(m, "Ellipse", "Ellipse of a disc's image.");
  define_value(ellipse, ellipse_fields);
  define_repr(ellipse, "Ellipse", ellipse_fields);
  py::class_<BlobColour> colour(
      m, "BlobColour",
      ("Colour of a blob's light." + fields_doc(blob_colour_fields, "Keywords (and properties)"))
          .c_str());
  define_value(colour, blob_colour_fields);
  define_repr(colour, "BlobColour", blob_colour_fields);
  py::class_<Blob> blob(m, "Blob",
                        ("One bright region of an image, measured." +
                         fields_doc(blob_fields, "Keywords (and properties)"))
                            .c_str());
  define_value(blob, blob_fields);
  blob.def("__repr__", &blob_repr);

  const auto fields = detect_fields();
  define_function(
      m, "detect", fields,
      [](DetectOptions options, const NumpyImage& image) {
        py::gil_scoped_release unlocked;
        return detect(image.view, options);
      },
      py::arg("image"), py::kw_only(),
      (R"(Detects the lamps in an image: a list of Blobs by decreasing flux, which may be empty.

image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16; not copied when the
pixels of a row are adjacent. The channels are red, green and blue, in this order: reverse those of
OpenCV (image[..., ::-1]).
Raises: TypeError or ValueError for another array or an invalid option, naming it.

>>> import libocc as occ, numpy as np
>>> image = np.full((40, 60), 10, np.uint8)
>>> image[10:13, 20:23] = 200
>>> [blob.centroid_px.round(2).tolist() for blob in occ.detect(image)]
[[21.0, 11.0]])" +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
