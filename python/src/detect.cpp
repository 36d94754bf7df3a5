// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/detect.hpp"

#include <sstream>

#include "fields.hpp"
#include "module.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

auto ellipse_fields() {
  using E = Ellipse;
  return std::make_tuple(
      field("centre_px", &E::centre_px, "(2,) [px]"),
      field("semi_major_px", &E::semi_major_px, "[px]"),
      field("semi_minor_px", &E::semi_minor_px, "[px]"),
      field("angle_rad", &E::angle_rad, "angle of the major axis from +x towards +y [rad]"));
}

auto blob_fields() {
  using B = Blob;
  return std::make_tuple(
      required_field("centroid_px", &B::centroid_px, "(2,) best centre: rim fit, PSF or moments"),
      field("covariance_px2", &B::covariance_px2, "(2, 2) covariance of the centroid [px^2]"),
      field("flux_dn", &B::flux_dn, "sum of grey levels above the background"),
      field("flux_sigma_dn", &B::flux_sigma_dn, "standard deviation of flux_dn"),
      field("peak_dn", &B::peak_dn, "brightest pixel, background included"),
      field("background_dn", &B::background_dn, "local background [grey levels]"),
      field("noise_dn", &B::noise_dn, "standard deviation of a background pixel"),
      field("area_px", &B::area_px, "pixels above the threshold"),
      field("x0", &B::x0, "bounding box, both ends included"),
      field("y0", &B::y0, "bounding box, both ends included"),
      field("x1", &B::x1, "bounding box, both ends included"),
      field("y1", &B::y1, "bounding box, both ends included"),
      field("saturated", &B::saturated,
            "contains pixels at full scale: the rim is too large, the flux too low"),
      field("merged", &B::merged, "shape of more than one lamp"),
      field("cut_by_border", &B::cut_by_border, "touches the image's border"),
      field("striped", &B::striped, "rolling-shutter stripes joined into one blob"),
      field("frequency_hz", &B::frequency_hz, "blink frequency from the stripes, or None"),
      field("frequency_sigma_hz", &B::frequency_sigma_hz, "standard deviation of frequency_hz"),
      field("lamp_id", &B::lamp_id, "id of the lamp according to its decoded code, or None"),
      field("ellipse", &B::ellipse, "ellipse of the rim, else of the second moments"),
      field("rim", &B::rim,
            "(n, 5) sub-pixel rim: x, y, outward unit normal x, y, sigma along it [px]"));
}

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
  if (blob.cut_by_border) text << ", cut by border";
  text << ">";
  return text.str();
}

}  // namespace

void define_detect(py::module_& m) {
  py::class_<Ellipse> ellipse(m, "Ellipse", "Ellipse of a disc's image.");
  define_value(ellipse, ellipse_fields());
  define_repr(ellipse, "Ellipse", ellipse_fields());
  py::class_<Blob> blob(m, "Blob",
                        ("One bright region of an image, measured." +
                         fields_doc(blob_fields(), "Keywords (and properties)"))
                            .c_str());
  define_value(blob, blob_fields());
  blob.def("__repr__", &blob_repr);

  const auto fields = detect_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "detect",
            [fields](const NumpyImage& image,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              const auto options = from_values<DetectOptions>(fields, values...);
              py::gil_scoped_release unlocked;
              return detect(image.view, options);
            },
            py::arg("image"), py::kw_only(), argument(f, texts)...,
            (R"(Detects the lamps in an image: a list of Blobs by decreasing flux, which may be empty.

image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16; not copied when the
pixels of a row are adjacent.
Raises: TypeError or ValueError for another array or an invalid option, naming it.

>>> import libocc as occ, numpy as np
>>> image = np.full((40, 60), 10, np.uint8)
>>> image[10:13, 20:23] = 200
>>> [blob.centroid_px.round(2).tolist() for blob in occ.detect(image)]
[[21.0, 11.0]])" +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

}  // namespace occ::python
