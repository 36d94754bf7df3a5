# SPDX-License-Identifier: Apache-2.0
"""Schemas of scenes, camera files and objects."""

from ..._core import (
    Box,
    CameraKind,
    Channel,
    Code,
    Effects,
    Ghost,
    Lamp,
    LampCode,
    Lens,
    ObjectPoint,
    Room,
    Sensor,
    Tag,
)
from .structs import (
    DRAFT,
    FLAG,
    NUMBER,
    NUMBERS,
    TEXT,
    WHOLE,
    Schema,
    described,
    document,
    listed,
    mapping,
    of_struct,
    vector,
    words,
)

ORIGIN = [0.0, 0.0, 0.0]
PER_AXIS: Schema = {"oneOf": [NUMBER, vector(3)]}
USE = {"enum": ["on", "off", "auto", True, False]}  # YAML 1.1 reads on and off as true and false
COEFFICIENTS = described(NUMBERS, "instead of response: coefficients of the basis of response curves")


def scene() -> Schema:
    properties = {
        "camera": camera(),
        "sensor": sensor(),
        "lamps": listed(lamp()),
        "lens": lens(),
        "map_sigma_m": described(PER_AXIS, "standard deviation of the positions of lamps without their own [m]"),
        "map_scale_sigma": described(NUMBER, "relative standard deviation of the scale of positions and sizes alike"),
        "ambient_w_m2": described(NUMBER, "irradiance of the sensor from other sources than the lamps [W/m^2]"),
        "room": mapping(of_struct(Room())),
        "boxes": listed(mapping(of_struct(Box(min_m=ORIGIN, max_m=[1, 1, 1]), defaults=False), ["min_m", "max_m"])),
        "tags": listed(tag()),
        "effects": effects(),
        "assumed": described(listed(TEXT), "notes on values that the source does not give"),
    }
    return document("libocc scene", "libocc-scene/1", properties, ["camera", "lamps"])


def camera_file() -> Schema:
    """Camera file of libocc. Files of OpenCV and ROS have other keys and need no schema."""
    return {
        "$schema": DRAFT,
        "title": "libocc camera",
        "type": "object",
        "properties": {"camera": camera(with_file=False)},
        "required": ["camera"],
    }


def object_file() -> Schema:
    point = of_struct(ObjectPoint(id=0, position_m=ORIGIN))
    for key in ("id", "position_m"):
        del point[key]["default"]
    properties = {"name": TEXT, "points": listed(mapping(point, ["id", "position_m"]), 1)}
    return document("libocc object", "libocc-object/1", properties, ["name", "points"])


def camera(with_file: bool = True) -> Schema:
    errors = {
        "parameter_sigmas": described(
            {"type": "object", "additionalProperties": NUMBER}, "standard deviations of errors of parameters by name"
        ),
        "parameter_covariance": described(NUMBERS, "instead: covariance of all parameters, row by row"),
    }
    size = {
        **errors,
        "model": {**words(*CameraKind.__members__), "default": "pinhole", "description": "model of the lens"},
        "width_px": described(WHOLE, "image width [px]"),
        "height_px": described(WHOLE, "image height [px]"),
    }
    plane = {
        "fx_px": described(NUMBER, "focal length along a row [px]"),
        "fy_px": described(NUMBER, "focal length along a column [px]; default: fx_px"),
        "focal_length_m": described(NUMBER, "instead of fx_px and fy_px [m]; needs sensor.pixel_pitch_m"),
        "cx_px": described(NUMBER, "principal point [px]; default: image centre"),
        "cy_px": described(NUMBER, "principal point [px]; default: image centre"),
    }
    flat = {
        "skew_px": described(NUMBER, "skew of the pixel axes [px]"),
        "distortion": described(NUMBERS, "0, 4, 5, 8, 12 or 14 coefficients in OpenCV's order"),
    }
    sphere = {
        "xi": described(NUMBER, "parameter of the double-sphere model"),
        "alpha": described(NUMBER, "parameter of the double-sphere model"),
    }
    brown = {
        "unit_px": described(NUMBER, "number of pixels in the unit of the coefficients [px]"),
        "r0": described(NUMBER, "radius without radial correction, in that unit"),
    }
    panorama = {
        "angle_per_px_rad": described(NUMBER, "angle between two columns [rad]"),
        "fy_px": described(NUMBER, "pixels per radian of latitude [px]"),
        "cx_px": described(NUMBER, "column of the z axis [px]"),
        "cy_px": described(NUMBER, "row of the horizon [px]"),
    }
    line = {
        "c_px": described(NUMBER, "camera constant over the pixel pitch of the line array [px]"),
        "angle_per_px_rad": described(NUMBER, "angle of the turntable between two columns [rad]"),
        "cy_px": described(NUMBER, "principal point: the row of the horizon [px]"),
        "tilt_x_rad": described(NUMBER, "tilt of the array about the direction of view [rad]"),
        "tilt_y_rad": described(NUMBER, "tilt of the array across the direction of view [rad]"),
        "eccentricity_m": described(vector(3), "offset of the projection centre from the turntable's axis [m]"),
        "k1": described(NUMBER, "radial distortion along the array"),
        "k2": described(NUMBER, "radial distortion along the array"),
        "tumbling_rad": described(vector(6), "Fourier terms of the axis's wobble [rad]"),
    }
    sizes = ["width_px", "height_px"]
    focal = [{"required": ["fx_px"]}, {"required": ["focal_length_m"]}]
    rotating = {"properties": {"model": {"pattern": "^rotating_line"}}, "required": ["model"]}
    spherical = {"properties": {"model": {"const": "double_sphere"}}, "required": ["model"]}
    backward = {"properties": {"model": {"pattern": "^brown_"}}, "required": ["model"]}
    around = {"properties": {"model": {"const": "equirectangular"}}, "required": ["model"]}
    inline: Schema = {
        "if": rotating,
        "then": mapping({**size, **line}, [*sizes, "c_px"]),
        "else": {
            "if": spherical,
            "then": {**mapping({**size, **plane, **sphere}, [*sizes, "xi", "alpha"]), "anyOf": focal},
            "else": {
                "if": backward,
                "then": {**mapping({**size, **plane, **flat, **brown}, [*sizes, "unit_px"]), "anyOf": focal},
                "else": {
                    "if": around,
                    "then": mapping({**size, **panorama}, sizes),
                    "else": {**mapping({**size, **plane, **flat}, sizes), "anyOf": focal},
                },
            },
        },
    }
    if not with_file:
        return {"type": "object", **inline}
    named = mapping({"file": described(TEXT, "camera file, relative to this file"), **errors}, ["file"])
    return {"type": "object", "if": {"required": ["file"]}, "then": named, "else": inline}


def sensor() -> Schema:
    channel = mapping({**of_struct(Channel()), "response_coefficients": COEFFICIENTS})
    colours = ("red", "green", "blue")
    channels = described(mapping(dict.fromkeys(colours, channel), colours), "for a mosaic")
    return mapping(
        {**of_struct(Sensor(), skip=["channels"]), "response_coefficients": COEFFICIENTS, "channels": channels}
    )


def lamp() -> Schema:
    fields = of_struct(
        Lamp(id=0, centre_m=ORIGIN, radius_m=1.0),
        skip=["code", "photometry"],
        replace={"size_m": vector(2), "x_axis": vector(3), "exponent": NUMBER, "position_sigma_m": PER_AXIS,
                 "shared_errors_m": listed(vector(3)), "corners_m": listed(vector(2))},
    )
    for key in ("id", "centre_m", "radius_m", "size_m", "x_axis", "exponent", "corners_m"):
        fields[key].pop("default", None)
    needed = {"disc": ["radius_m"], "rectangle": ["size_m"], "lame": ["size_m", "exponent"],
              "polygon": ["corners_m"]}
    rules: list[Schema] = []
    for shape, keys in needed.items():
        named: Schema = {"properties": {"shape": {"const": shape}}}
        if shape != "disc":  # the default
            named["required"] = ["shape"]
        given: Schema = {"required": keys}
        if shape != "polygon":  # no file of photometry has corners
            given = {"anyOf": [given, {"required": ["photometry"]}]}
        rules.append({"if": named, "then": given})
    rules.append({"not": {"required": ["photometry", "half_power_deg"]}})
    photometry = described(
        {"anyOf": [TEXT, mapping({"file": TEXT}, ["file"])]},
        "instead of half_power_deg: measured emission, a file of IES LM-63 or EULUMDAT relative to this file",
    )
    return {**mapping({**fields, "photometry": photometry, "code": code()}, ["id", "centre_m"]), "allOf": rules}


def code() -> Schema:
    replace = {"line": words("manchester", "4b6b")}
    fields = of_struct(Code(), replace=replace)
    del fields["kind"]["default"]
    of_lamp = of_struct(LampCode(code=Code(), id=0), skip=["code"])
    del of_lamp["id"]["default"]
    return described(
        mapping({**fields, **of_lamp}, ["kind"]),
        "instead of frequency_hz and waveform: the code that the lamp transmits",
    )


def lens() -> Schema:
    ghost = of_struct(Ghost())
    del ghost["strength"]["default"]
    ghosts = described(listed(mapping(ghost, ["strength"])), "second images inside the lens")
    return mapping({**of_struct(Lens(), skip=["ghosts"], replace={"diffraction": FLAG}), "ghosts": ghosts})


def tag() -> Schema:
    fields = of_struct(Tag(id=0, size_m=1, centre_m=ORIGIN))
    needed = ["id", "size_m", "centre_m"]
    for key in needed:
        del fields[key]["default"]
    return mapping(fields, needed)


def effects() -> Schema:
    default = Effects()
    use = {"default": described(USE, "use of the effects that are not listed"), **dict.fromkeys(default.use, USE)}
    return mapping({**of_struct(default, skip=["use"]), **use})
