# SPDX-License-Identifier: Apache-2.0
"""Text of an annotated scene file of a room with ceiling lamps."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .exif import FILM_DIAGONAL_MM
from .picture_camera import lens_sigmas

# A phone's main camera: 26 mm in terms of 35 mm film, which is 3000 px on an image of 4000 x 3000 px.
PHONE_SIZE = (4000, 3000)
PHONE_FILM_MM = 26.0
GUESS_SIGMA = 0.2  # relative error of that focal length
MIDDLE = 0.6  # part of the ceiling, in each direction, with lamps
CANDIDATES = 10  # random positions per lamp, of which the one farthest from the other lamps is used
SEED = 1

# A line that begins with "#" directly before a key is an optional key with an example value.
HEAD = """\
# A room with ceiling lamps, and the camera that takes pictures of them (libocc scene file).
# `libocc new-scene` wrote it. Replace the values by those of your room; it can be used at any time:
#   libocc simulate {name} --position {x:g} {y:g} {z:g} --out view.png
#   libocc locate view.png {name}
# Lengths are in metres, angles in degrees, times in seconds. The unit is the last part of a key.
# World: the origin is a corner of the room, on the floor; x and y run along the two walls that meet
# there, z points up. When you stand in that corner and look along the x axis, the y axis is on your LEFT.
# In a scene with x and y exchanged, no pose fits.
# A key behind a `#` without a space is optional; remove the `#` to use it.
# An editor completes and checks the keys if the next line is the first one and begins with one `#`;
# `libocc schema scene --out scene.schema.json` writes the file that it names.
# # yaml-language-server: $schema=scene.schema.json

# Format of this file. Required.
schema: libocc-scene/1
"""

SENSOR = """
# The image sensor. Optional: without it, the sensor is linear, with 7.1 um pixels at f/2.
sensor:
  # Relation of light and stored values: srgb for JPEG pictures, linear for raw data. If omitted: srgb for
  # colour pictures of 8 bits, else linear, which makes the lamps of other pictures too large.
  response: srgb
  # Exposure time [s]. Take it from the picture's details. Used for rendering and for blinking lamps; a
  # still picture of steady lamps does not need it. If omitted: 2e-5.
  exposure_s: {exposure_s:.4g}
  # Focal length over the diameter of the lens opening [-]. From the picture's details. Used for
  # rendering. If omitted: 2.
  f_number: {f_number:g}
  # Distance of two pixels on the sensor [m]. From the phone's data sheet, often 0.8e-6 to 1.4e-6. Used
  # for rendering. If omitted: 7.1e-6.
  pixel_pitch_m: {pixel_pitch_m:.3g}
  # Time from one row of pixels to the next [s]; a phone has a rolling shutter. Measure it with
  # `libocc row-time`. Needed for a moving camera and for blinking lamps. If omitted: 0, all rows at once.
  #row_time_s: 1.0e-5
  # Direction of the rolling shutter: rows, columns (pixels were rotated after the exposure) or unknown.
  # If omitted: rows.
  #readout: rows
"""

ROOM = """
# The room. Optional: without it, rendered pictures have no walls. The pose does not depend on it.
room:
  # Size of the room along x, y and z [m]. Measure with the tape along the walls. If omitted: 4, 4, 3.
  size_m: {size_m}
  # Part of the light that walls, floor and ceiling reflect [0 to 1]. White paint has 0.7 to 0.9. Used
  # for rendering. If omitted: 0.
  #wall_reflectance: 0.7

# Opaque boxes that hide lamps, such as a beam. Optional: without it, nothing hides a lamp.
#boxes:
  # Two opposite corners: the smallest and the largest x, y and z [m]. Both required.
  #- {{min_m: [0, 0, {beam:g}], max_m: [0.1, 0.1, {height:g}]}}

# AprilTags on the walls, additional landmarks (`libocc targets` prints them). Optional.
#tags:
  # Number of the tag; side of its black square [m], measured on the print; its centre in the world [m]; the
  # direction that the printed side faces; the direction to the right on the print.
  #- {{id: 0, size_m: 0.16, centre_m: [{half_x:g}, 0, 1.5], normal: [0, 1, 0], x_axis: [-1, 0, 0]}}
"""

LAMPS = """
# Error of the positions of the lamps below, standard deviation [m]: one number, or three along x, y and z.
# With a tape measure 0.01 is typical. If omitted: exact, and the stated errors of poses are too small.
{map_sigma}
# The lamps. Required. Errors of their positions become errors of the camera's position, of about the
# same size: measure to a millimetre or two, or survey them with `libocc calibrate lamps`.
lamps:
  # Number of the lamp. Required; each lamp has its own.
"""

CENTRE = """\
    # Centre of the lit face [m]. Required. Hold a plumb line below the centre, mark the floor, and measure
    # the mark's distances from the two walls through the origin, and the height of the lit face.
"""

DEFAULT_RADIUS_M = 0.085
SIZES = {
    "disc": """\
    # Radius of the lit disc [m]. Required for a disc. Measure the diameter of the part that shines, without
    # the frame, and halve it.
    radius_m: 0.085
""",
    "rectangle": """\
    # Sides of the lit rectangle [m], along x_axis and across it. Required for a rectangle. Measure the part
    # that shines, without the frame.
    size_m: [0.6, 0.3]
    # Direction of the first side in the world. If omitted: along x.
    #x_axis: [1, 0, 0]
""",
    "lame": """\
    # Sides of the lit shape [m], along x_axis and across it. Required for a superellipse. Measure the part
    # that shines, without the frame.
    size_m: [0.3, 0.3]
    # Exponent of the superellipse: 2 is an ellipse, 4 to 8 a rectangle with round corners. Required.
    exponent: 4
    # Direction of the first side in the world. If omitted: along x.
    #x_axis: [1, 0, 0]
""",
    "polygon": """\
    # Corners (x, y) of the lit face in order [m], as you see it from its lit side: x along x_axis to the
    # right, y up. Required for a polygon. centre_m becomes the centroid of its area.
    corners_m: [[0, 0], [0.3, 0], [0, 0.3]]
    # Direction of x in the world. If omitted: along x.
    #x_axis: [1, 0, 0]
""",
    "point": "",
}
SHORT = {
    "disc": ", radius_m: 0.085",
    "rectangle": ", size_m: [0.6, 0.3]",
    "point": "",
    "lame": ", size_m: [0.3, 0.3], exponent: 4",
    "polygon": ", corners_m: [[0, 0], [0.3, 0], [0, 0.3]]",
}
SHAPES = tuple(SIZES)

FIRST_LAMP = """\
    # Shape of the lit face: disc, rectangle, lame (superellipse), polygon or point. If omitted: disc.
    shape: {shape}
{size}\
    # Direction towards the lit side in the world. If omitted: down, as on a horizontal ceiling.
    #normal: [0, 0, -1]
    # Radiant power [W], a third of the electric power of an LED. Only ratios between lamps matter for
    # locating: equal lamps have equal values. If omitted: 1.
    power_w: 1.5
    # Relative standard deviation of power_w [-]. Use 1 if the powers are guesses. If omitted: 0.1.
    #power_sigma: 0.1
    # Angle from the normal at which the lamp has half its intensity [deg]. From the data sheet: half of
    # the beam angle. If omitted: 60, a matt surface.
    #half_power_deg: 60
    # Label. If omitted: none.
    #name: above the desk
    # Frequency of a blinking lamp [Hz]. If omitted: the lamp is steady.
    #frequency_hz: 2000
"""


@dataclass(frozen=True)
class CameraSection:
    """The section `camera`, and the image size that its camera has."""

    text: str
    width: int
    height: int


@dataclass(frozen=True)
class Exposure:
    """Exposure settings of a picture; the defaults render lamps of 1.5 W at half the full scale."""

    exposure_s: float = 1 / 4000
    f_number: float = 1.8


def quoted(text: str) -> str:
    """Text as a YAML scalar."""
    return json.dumps(text, ensure_ascii=False)


def camera_of_file(path: str, width: int, height: int) -> CameraSection:
    """Names a camera file; path: relative to the folder of the scene."""
    return CameraSection(
        f"""
# The camera. Required.
camera:
  # File with the camera's parameters ({width} x {height} px), relative to the folder of this file;
  # `libocc calibrate camera` writes it. All pictures must have this size.
  file: {quoted(path)}
""",
        width,
        height,
    )


def camera_of_values(width: int, height: int, focal_px: float, sigma_px: float, origin: str) -> CameraSection:
    """sigma_px: error of the focal length. origin: where it comes from and how accurate it is."""
    sigmas = ", ".join(f"{name}: {sigma:.3g}" for name, sigma in lens_sigmas(width, focal_px, sigma_px).items())
    return CameraSection(
        f"""
# The camera. Required: either these keys or `file: camera.yaml`, a file of `libocc calibrate camera`.
camera:
  # Model of the lens: pinhole, fisheye or double_sphere. If omitted: pinhole.
  model: pinhole
  # Size of the pictures [px]. Required. From the picture's properties. The pixels are read as they are
  # stored: a phone that is held upright stores the same width and height, with a tag for the display.
  width_px: {width}
  height_px: {height}
  # Focal length in pixels [px]. Required. An error of 1 % moves the camera by 1 % of the distance of the
  # lamps: calibrate for accurate positions.
  # {origin}
  fx_px: {focal_px:.6g}
  # Focal length along a column [px]. If omitted: fx_px.
  #fy_px: {focal_px:.6g}
  # Principal point, where the optical axis meets the image [px]; pixel (0, 0) is the centre of the first
  # pixel. If omitted: the middle of the image, which is wrong by up to 2 % of the width.
  #cx_px: {(width - 1) / 2:g}
  #cy_px: {(height - 1) / 2:g}
  # Distortion of the lens, coefficients k1, k2, p1, p2, k3 of OpenCV [-]. From a calibration. If omitted:
  # none, which moves lamps near the border by up to 2 % of the width.
  #distortion: [0, 0, 0, 0, 0]
  # Errors of these values, standard deviations; f_px: of both focal lengths together [px], fy_px: of their
  # ratio. Typical of a camera that was not calibrated. Sigmas of poses contain them. If omitted: exact.
  parameter_sigmas:
    {{{sigmas}}}
""",
        width,
        height,
    )


def typical_camera(width: int = PHONE_SIZE[0], height: int = PHONE_SIZE[1]) -> CameraSection:
    """Camera of a typical phone, if nothing is known about its focal length."""
    focal_px = PHONE_FILM_MM * math.hypot(width, height) / FILM_DIAGONAL_MM
    origin = (
        f"This value is a GUESS: a phone's main camera ({PHONE_FILM_MM:g} mm on 35 mm film); wrong by 20 % or more."
    )
    return camera_of_values(width, height, float(round(focal_px)), GUESS_SIGMA * focal_px, origin)


def lamp_centres(count: int, size_m: Sequence[float]) -> list[list[float]]:
    """Positions on the ceiling, apart from each other and without symmetry (Mitchell's best candidates)."""
    random = np.random.default_rng(SEED)
    area = MIDDLE * np.array(size_m[:2])
    chosen = np.empty((0, 2))
    for _ in range(count):
        candidates = np.round((np.array(size_m[:2]) - area) / 2 + area * random.random((CANDIDATES, 2)), 2)
        apart = np.linalg.norm(candidates[:, None] - chosen[None], axis=2).min(axis=1, initial=np.inf)
        chosen = np.vstack([chosen, candidates[np.argmax(apart)]])
    return [[*map(float, centre), float(size_m[2])] for centre in chosen]


def listed(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def lamps_text(centres: Sequence[Sequence[float]], shape: str, radius_m: float, are_measured: bool) -> str:
    lines = [LAMPS.format(map_sigma=f"{'' if are_measured else '#'}map_sigma_m: 0.01")]
    size, short = (text.replace(f"{DEFAULT_RADIUS_M}", f"{radius_m:g}") for text in (SIZES[shape], SHORT[shape]))
    for id, centre in enumerate(centres):
        if id == 0:
            lines.append(f"  - id: 0\n{CENTRE}    centre_m: {listed(centre)}\n")
            lines.append(FIRST_LAMP.format(shape=shape, size=size))
            continue
        if id == 1:
            lines.append("  # The other lamps, with the same keys.\n")
        lines.append(f"  - {{id: {id}, centre_m: {listed(centre)}, shape: {shape}{short}, power_w: 1.5}}\n")
    return "".join(lines)


def room_text(
    name: str,
    size_m: Sequence[float],
    centres: Sequence[Sequence[float]],
    shape: str,
    camera: CameraSection,
    exposure: Exposure,
    radius_m: float = DEFAULT_RADIUS_M,
    are_measured: bool = False,
) -> str:
    """Text of the scene file.

    name: of the file, for the commands in its comments. radius_m: of discs. are_measured: the centres of the lamps are
    those of a room, with the errors of a tape measure, instead of examples.
    """
    x, y, height = size_m
    # The pixels of a sensor of 5.6 mm, the width of a phone's 1/2.5 inch sensor.
    pitch_m = 5.6e-3 / max(camera.width, camera.height)
    head = HEAD.format(name=name, x=x / 2, y=y / 2, z=min(0.5, height / 5))
    sensor = SENSOR.format(exposure_s=exposure.exposure_s, f_number=exposure.f_number, pixel_pitch_m=pitch_m)
    room = ROOM.format(size_m=listed(size_m), height=height, beam=0.9 * height, half_x=x / 2)
    return head + camera.text + sensor + lamps_text(centres, shape, radius_m, are_measured) + room
