// SPDX-License-Identifier: Apache-2.0
// The fields of the parts of a scene and of Prior, and the names of their enumerators
// (core/internal/fields.hpp). Rules on several fields together are in the validate() of each part.
#pragma once

#include <array>

#include "libocc/codes/internal/code_fields.hpp"
#include "libocc/core/internal/fields.hpp"
#include "libocc/radiometry/internal/sensor_fields.hpp"
#include "libocc/scene/detectable_points.hpp"
#include "libocc/scene/object.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::scene {

inline constexpr std::array<core::Word<LampShape>, 5> shape_words{
    {{"disc", LampShape::disc},
     {"rectangle", LampShape::rectangle},
     {"point", LampShape::point},
     {"lame", LampShape::lame},
     {"polygon", LampShape::polygon}}};

/// YAML 1.1 tools write `on` and `off` as the last two.
inline constexpr std::array<core::Word<Use>, 5> use_words{{{"on", Use::on},
                                                           {"off", Use::off},
                                                           {"auto", Use::automatic},
                                                           {"true", Use::on},
                                                           {"false", Use::off}}};

inline bool is_disc(const Lamp& lamp) { return lamp.shape == LampShape::disc; }
inline bool is_lame(const Lamp& lamp) { return lamp.shape == LampShape::lame; }
inline bool is_polygon(const Lamp& lamp) { return lamp.shape == LampShape::polygon; }
inline bool has_sides(const Lamp& lamp) {
  return lamp.shape == LampShape::rectangle || lamp.shape == LampShape::lame;
}

/// True if the lamp's image may have corners.
inline bool may_have_corners(const Lamp& lamp) { return has_sides(lamp) || is_polygon(lamp); }

inline bool uses_x_axis(const Lamp& lamp) { return lamp.uses_x_axis(); }
inline bool is_lambertian(const Lamp& lamp) { return !lamp.photometry; }

// `code` is a nested mapping that sets frequency_hz and waveform, and `photometry` names a file
// that may set the shape: both are read and written by hand.
inline constexpr auto lamp_fields = core::fields_of<Lamp>(
    core::required_field("id", &Lamp::id, "", core::Unrestricted{},
                         "whole number, unique in the scene"),
    core::field("name", &Lamp::name, "", core::Unrestricted{}, "label for people"),
    core::field("shape", &Lamp::shape, "", core::one_of(shape_words),
                "`disc`, `rectangle`, `point`, `polygon` or `lame`: the inside of the Lame curve "
                "(superellipse) abs(2x/a)^n + abs(2y/b)^n = 1"),
    core::required_field("centre_m", &Lamp::centre_m, "m", core::Finite{},
                         "centre of the lit face in the world"),
    core::field("normal", &Lamp::normal, "", core::Direction{},
                "direction towards the lit side, of any length but zero"),
    core::field("radius_m", &Lamp::radius_m, "m", core::Positive{}, "radius; only of a disc")
        .needed()
        .when(&is_disc),
    core::field("size_m", &Lamp::size_m, "m", core::PositiveLengths{},
                "(a, b) along `x_axis` and across it; only of a rectangle or Lame curve")
        .needed()
        .when(&has_sides),
    core::field("x_axis", &Lamp::x_axis, "", core::Direction{},
                "direction of the first side, and C = 0 of `photometry`; its part along the normal "
                "is removed; only of a rectangle, a Lame curve, a polygon, or `photometry` that "
                "depends on C")
        .when(&uses_x_axis),
    core::field("exponent", &Lamp::exponent, "", core::Interval{'[', 1, 100, ']'},
                "n of a Lame curve, and only there; 2 is an ellipse")
        .needed()
        .when(&is_lame),
    core::field("corners_m", &Lamp::corners_m, "m", core::Unrestricted{},
                "corners (x, y) of a polygon in order, and only there, from `centre_m`: as its lit "
                "side is seen, x along `x_axis` to the right and y up. `centre_m` becomes the "
                "centroid of its area")
        .needed()
        .when(&is_polygon),
    core::field("position_sigma_m", &Lamp::position_sigma_m, "m", core::NotNegative{},
                "standard deviation of `centre_m`: one number, or three along the axes of the "
                "world; without it `map_sigma_m` of the scene"),
    core::field("shared_errors_m", &Lamp::shared_errors_m, "m", core::Unrestricted{},
                "displacements (x, y, z) of `centre_m` by one standard deviation of each error "
                "that lamps share, in the same order for all lamps; `position_sigma_m` is of this "
                "lamp alone"),
    core::field("size_sigma", &Lamp::size_sigma, "", core::NotNegative{},
                "relative standard deviation of `radius_m`, `size_m` or `corners_m`"),
    core::field("tilt_sigma_rad", &Lamp::tilt_sigma_rad, "rad", core::Angle{90, ')'},
                "standard deviation of the directions of `normal` and `x_axis`; without it they "
                "are exact"),
    core::field("power_w", &Lamp::power_w, "W", core::Positive{}, "radiant power while lit"),
    core::field("power_sigma", &Lamp::power_sigma, "", core::NotNegative{},
                "relative standard deviation of `power_w`"),
    core::field("half_power_rad", &Lamp::half_power_rad, "rad", core::Angle{90, ')'},
                "half-power semi-angle; only without `photometry`")
        .when(&is_lambertian),
    core::field("photometry", &Lamp::photometry, "", core::ByHand{},
                "measured emission instead of `half_power_rad`: a file of IES LM-63 or EULUMDAT; "
                "the radius "
                "or size may be left out where the file states it"),
    core::field("code", &Lamp::code, "", core::ByHand{},
                "transmitted code; sets `frequency_hz` and `waveform`"),
    core::field("frequency_hz", &Lamp::frequency_hz, "Hz", core::Positive{},
                "frequency of blinking; without it the lamp is always lit"),
    core::field("waveform", &Lamp::waveform, "", core::Unrestricted{},
                "instead of `duty`: light over `power_w`, in [0, 1], in equal parts of a period, "
                "such as the chips of a code"),
    core::field("duty", &Lamp::duty, "", core::Interval{'(', 0, 1, ']'},
                "lit fraction of a period"),
    core::field("phase", &Lamp::phase, "periods", core::Finite{}, "periods passed at time 0"),
    core::field("colour", &Lamp::colour, "", core::Unrestricted{},
                "light on red, green and blue pixels over that of white light of the same power; "
                "compared with the image if the channels of any lamp differ"),
    core::field("colour_sigma", &Lamp::colour_sigma, "", core::Positive{},
                "relative standard deviation of the ratio of two channels of `colour`; the default "
                "covers an unknown white balance"));

// In files `id` defaults to the lamp's: the keys of `code` are read by hand.
inline constexpr auto lamp_code_fields = core::fields_of<LampCode>(
    core::required_field("code", &LampCode::code, "", core::ByHand{}, "the Code"),
    core::required_field("id", &LampCode::id, "", core::NotNegative{},
                         "transmitted id; unique among the lamps of a kind and channel"),
    core::field("channel", &LampCode::channel, "", core::Unrestricted{},
                "`s2psk`: 0 the lamp, 1 its reference; `csk`: 0 red, 1 green, 2 blue emitter, each "
                "a lamp of its own with its `colour`"));

inline constexpr auto ghost_fields = core::fields_of<Ghost>(
    core::field("strength", &Ghost::strength, "", core::Interval{'[', 0, 1, ')'},
                "part of the light that goes into the second image")
        .needed(),
    core::field("scale", &Ghost::scale, "", core::Unrestricted{},
                "magnification about the principal point; negative: rotated by 180 degrees"),
    core::field("blur_px", &Ghost::blur_px, "px", core::Interval{'[', 0, 50, ']'},
                "standard deviation of its own blur, in addition to the lens's"));

// `ghosts` is a list of mappings.
inline constexpr auto lens_fields = core::fields_of<Lens>(
    core::field("diffraction", &Lens::diffraction, "", core::Unrestricted{},
                "adds a Gaussian blur of standard deviation 0.42 `wavelength_m` `f_number`"),
    core::field("focus_distance_m", &Lens::focus_distance_m, "m", core::Positive{},
                "lamps nearer or farther are blurred by a disc; without it everything is in focus"),
    core::field("vignetting", &Lens::vignetting, "", core::WrittenWhenEmpty{},
                "a1, a2, ... of the transmission 1 + a1 q^2 + a2 q^4 + ..., q the distance from "
                "the principal point over that of the image's farthest corner; in (0, 1] over the "
                "image; cos^4 is modelled separately"),
    core::field("veiling_glare", &Lens::veiling_glare, "", core::Interval{'[', 0, 1, ')'},
                "part of the light on the sensor that spreads evenly over it"),
    core::field("ghosts", &Lens::ghosts, "", core::ByHand{}, "second images inside the lens"));

// `use` has one key per effect: read and written by hand.
inline constexpr auto effects_fields = core::fields_of<Effects>(
    core::field("use", &Effects::use, "", core::ByHand{}, "Use of each Effect"),
    core::field("tolerance_dn", &Effects::tolerance_dn, "grey levels", core::Positive{},
                "for `auto`: largest change of a pixel by an effect that is left out"),
    core::field("tolerance_px", &Effects::tolerance_px, "px", core::Positive{},
                "for `auto`: largest shift of a lamp's centroid by an effect that is left out"));

inline constexpr auto room_fields = core::fields_of<Room>(
    core::field("size_m", &Room::size_m, "m", core::PositiveLengths{},
                "sides of the room, along the axes of the world"),
    core::field("wall_reflectance", &Room::wall_reflectance, "", core::Interval{'[', 0, 1, ')'},
                "reflected part of the light, the same for walls, floor and ceiling"));

// max_m must be greater than min_m in every coordinate: Scene::validate().
inline constexpr auto box_fields = core::fields_of<Box>(
    core::required_field("min_m", &Box::min_m, "m", core::Unrestricted{},
                         "corner with the smallest coordinates, in the world"),
    core::required_field("max_m", &Box::max_m, "m", core::Unrestricted{},
                         "corner with the greatest coordinates, in the world"));

inline constexpr auto tag_fields = core::fields_of<Tag>(
    core::required_field("id", &Tag::id, "", core::Unrestricted{},
                         "whole number from 0, unique in its family"),
    core::field("family", &Tag::family, "", core::Unrestricted{}, "family of AprilTags"),
    core::required_field("size_m", &Tag::size_m, "m", core::Positive{},
                         "side of the square whose corners are detected: for `tag36h11` the "
                         "outside of the black border"),
    core::required_field("centre_m", &Tag::centre_m, "m", core::Finite{}, "centre in the world"),
    core::field("normal", &Tag::normal, "", core::Unrestricted{},
                "direction towards the printed side"),
    core::field("x_axis", &Tag::x_axis, "", core::Unrestricted{},
                "direction to the right on the print, seen upright; its part along the normal is "
                "removed"));

inline constexpr auto object_point_fields = core::fields_of<ObjectPoint>(
    core::required_field("id", &ObjectPoint::id, "", core::Unrestricted{}, "unique in its object"),
    core::field("label", &ObjectPoint::label, "", core::Unrestricted{}, "label for people"),
    core::required_field("position_m", &ObjectPoint::position_m, "m", core::Finite{},
                         "position in the object's frame"),
    core::field("normal", &ObjectPoint::normal, "", core::Direction{}, "axis of the cone"),
    core::field(
        "cone_rad", &ObjectPoint::cone_rad, "rad", core::Angle{180, ']'},
        "half angle of the cone in which the point is visible; 90 degrees: a half space, 180: "
        "all directions"),
    core::field("radius_m", &ObjectPoint::radius_m, "m", core::NotNegative{},
                "radius of a disc across the normal; 0: a point"));

inline constexpr auto object_fields = core::fields_of<Object>(
    core::required_field("name", &Object::name, "", core::Unrestricted{}, "name of the object"),
    core::required_field("points", &Object::points, "", core::ByHand{}, "1 to 1000 ObjectPoints"));

inline constexpr auto detectable_fields = core::fields_of<DetectableOptions>(
    core::field("sharp_rad", &DetectableOptions::sharp_rad, "rad", core::Angle{180, ')'},
                "minimum angle between the normals of a sharp edge's faces"),
    core::field("straight_rad", &DetectableOptions::straight_rad, "rad", core::Angle{90, ')'},
                "two edges with a smaller angle between them count as one"),
    core::field("min_edge", &DetectableOptions::min_edge, "", core::Interval{'[', 0, 1, ')'},
                "minimum length of an edge over the diagonal of the bounding box"),
    core::field("max_points", &DetectableOptions::max_points, "", core::Positive{},
                "the points with the longest edges are kept"),
    core::field("directions", &DetectableOptions::directions, "", core::AtLeast{10},
                "number of viewing directions tested for each point"));

inline constexpr auto prior_fields = core::fields_of<Prior>(
    core::field("position_m", &Prior::position_m, "m", core::Finite{},
                "position of the camera in the world"),
    core::field("position_sigma_m", &Prior::position_sigma_m, "m", core::Positive{},
                "standard deviation of the position per axis"),
    core::field("position_sigmas_m", &Prior::position_sigmas_m, "m", core::PositiveOrInfinite{},
                "instead, standard deviations along x, y, z; infinite where nothing is known"),
    core::field("height_m", &Prior::height_m, "m", core::Finite{},
                "z coordinate of the camera, such as on a vehicle"),
    core::field("height_sigma_m", &Prior::height_sigma_m, "m", core::Positive{},
                "standard deviation of the height"),
    core::field("heading_rad", &Prior::heading_rad, "rad", core::Finite{},
                "heading as defined by heading_rad()"),
    core::field("heading_sigma_rad", &Prior::heading_sigma_rad, "rad", core::Positive{},
                "standard deviation of the heading"),
    core::field("gravity_in_cam", &Prior::gravity_in_cam, "", core::UnitVector{},
                "direction of gravity (down) in the camera frame, such as from an accelerometer"),
    core::field("gravity_sigma_rad", &Prior::gravity_sigma_rad, "rad", core::Positive{},
                "standard deviation of the direction of gravity"),
    core::field("last_pose", &Prior::last_pose, nullptr, core::ByHand{},
                "(cam_from_world, 6x6 covariance): pose predicted by a tracker"));

}  // namespace occ::internal::scene
