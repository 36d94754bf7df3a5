// SPDX-License-Identifier: Apache-2.0
// The fields of Blob and Ellipse (fields.hpp). A blob is a measurement: it has no rules, and
// required is only the position that a caller cannot omit.
#pragma once

#include "libocc/core/blob.hpp"
#include "libocc/core/internal/fields.hpp"

namespace occ::internal::core {

inline constexpr auto ellipse_fields = fields_of<Ellipse>(
    field("centre_px", &Ellipse::centre_px, "px", Unrestricted{}, "centre"),
    field("semi_major_px", &Ellipse::semi_major_px, "px", Unrestricted{}, "semi-major axis"),
    field("semi_minor_px", &Ellipse::semi_minor_px, "px", Unrestricted{}, "semi-minor axis"),
    field("angle_rad", &Ellipse::angle_rad, "rad", Unrestricted{},
          "angle of the major axis from +x towards +y"));

inline constexpr auto blob_colour_fields = fields_of<BlobColour>(
    field("share", &BlobColour::share, "", Unrestricted{},
          "shares of red, green and blue in the linear light above the background; their sum is 1"),
    field("sigma", &BlobColour::sigma, "", Unrestricted{}, "standard deviation of each share"),
    field(
        "clipped", &BlobColour::clipped, "", Unrestricted{},
        "for each channel, True if it is at full scale: its ratio to the others is a lower bound"));

inline constexpr auto blob_fields = fields_of<Blob>(
    required_field("centroid_px", &Blob::centroid_px, "px", Unrestricted{},
                   "best centre: from the rim fit, the PSF fit or the moments"),
    field("covariance_px2", &Blob::covariance_px2, "px^2", Unrestricted{},
          "covariance of the centroid"),
    field("light_response_px2", &Blob::light_response_px2, "px per 1/px", Unrestricted{},
          "shift of centroid and rim per relative gradient of the lamp's brightness"),
    field("rim_light_response_px", &Blob::rim_light_response_px, "px", Unrestricted{},
          "outward displacement of the points of an over-exposed rim per ln of the lamp's "
          "brightness at a depth of rim_light_depth_px"),
    field("rim_light_depth_px", &Blob::rim_light_depth_px, "px", Unrestricted{},
          "depth inside an over-exposed rim of the light that determines its place"),
    field("flux_dn", &Blob::flux_dn, "grey levels", Unrestricted{}, "sum above the background"),
    field("flux_sigma_dn", &Blob::flux_sigma_dn, "grey levels", Unrestricted{},
          "standard deviation of the flux"),
    field("peak_dn", &Blob::peak_dn, "grey levels", Unrestricted{},
          "brightest pixel, background included"),
    field("background_dn", &Blob::background_dn, "grey levels", Unrestricted{}, "local background"),
    field("noise_dn", &Blob::noise_dn, "grey levels", Unrestricted{},
          "standard deviation of a background pixel"),
    field("area_px", &Blob::area_px, "px", Unrestricted{}, "number of pixels above the threshold"),
    field("x0", &Blob::x0, "px", Unrestricted{}, "first column of the bounding box"),
    field("y0", &Blob::y0, "px", Unrestricted{}, "first row of the bounding box"),
    field("x1", &Blob::x1, "px", Unrestricted{}, "last column of the bounding box"),
    field("y1", &Blob::y1, "px", Unrestricted{}, "last row of the bounding box"),
    field("saturated", &Blob::saturated, "", Unrestricted{},
          "has pixels at full scale: the rim has grown, the flux is a lower bound"),
    field("merged", &Blob::merged, "", Unrestricted{}, "has the shape of several lamps"),
    field("cut_by_border", &Blob::cut_by_border, "", Unrestricted{},
          "touches the image border: centroid and flux are those of the visible part"),
    field(
        "hidden_in_part", &Blob::hidden_in_part, "", Unrestricted{},
        "something in front hides a part: the rim is the visible part, the flux is a lower bound; "
        "the centroid of a disc is that of the ellipse through the rim, of another lamp that of "
        "the visible part, which the covariance allows for"),
    field("patterned", &Blob::patterned, "", Unrestricted{},
          "has bright parts with gaps: only the centre of their common outline is known"),
    field("striped", &Blob::striped, "", Unrestricted{},
          "rolling-shutter stripes were joined into this blob"),
    field("frequency_hz", &Blob::frequency_hz, "Hz", Unrestricted{},
          "blink frequency measured from the stripes, or None"),
    field("frequency_sigma_hz", &Blob::frequency_sigma_hz, "Hz", Unrestricted{},
          "standard deviation of the frequency"),
    field("lamp_id", &Blob::lamp_id, "", Unrestricted{},
          "id of the lamp, decoded from its code, or None"),
    field("colour", &Blob::colour, "", Unrestricted{},
          "BlobColour in an image of three or four channels, or None"),
    field("ellipse", &Blob::ellipse, "", Unrestricted{},
          "ellipse of the rim, or else of the second moments"),
    field("rim", &Blob::rim, nullptr, Unrestricted{},
          "(n, 5) sub-pixel rim: x, y, outward unit normal x, y, standard deviation along it [px]"),
    field("rim_covariance_px2", &Blob::rim_covariance_px2, "px^2", Unrestricted{},
          "(5, 5) covariance of the errors common to all rim points: growth along the normals, "
          "shift in x and in y, stretch along x and along the diagonal"),
    field("corners_px", &Blob::corners_px, "px", Unrestricted{},
          "corners of a lamp with straight sides, clockwise in the image; empty for other shapes"),
    field("free_form", &Blob::free_form, "", Unrestricted{},
          "the rim is that of another shape than an ellipse or a convex polygon"));

}  // namespace occ::internal::core
