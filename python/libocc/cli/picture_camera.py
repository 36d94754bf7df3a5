# SPDX-License-Identifier: Apache-2.0
"""Camera of a picture that was never calibrated: focal length from its EXIF data, with the errors of such a camera."""

import math
from typing import Any

import click
import numpy as np

from .. import samples
from .._core import Camera, Fix, Rung, Scene, read_camera
from ..bench import pose_bound
from . import error_context
from .exif import FocalLength, camera_tags, focal_length, stored_size, zoom

EXIF = "exif"  # value of --camera
# Errors of a lens that was not calibrated (standard deviations): the ratio of the focal lengths, since the rims of
# lamps show a tenth of a percent; the distance of the principal point from the middle, relative to the width; radial
# and tangential distortion. These are the sizes that calibrations of phones and web cameras have.
RATIO_SIGMA = 0.001
PRINCIPAL_SIGMA = 0.01
DISTORTION_SIGMAS = {"k1": 0.1, "k2": 0.2, "k3": 0.1, "p1": 0.001, "p2": 0.001}


def lens_sigmas(width: int, focal_px: float, focal_sigma_px: float) -> dict[str, float]:
    """Standard deviations of the parameters of a camera that was not calibrated, for Camera.pinhole."""
    principal = PRINCIPAL_SIGMA * width
    return {
        "f_px": focal_sigma_px,
        "fy_px": RATIO_SIGMA * focal_px,
        "cx_px": principal,
        "cy_px": principal,
        **DISTORTION_SIGMAS,
    }


def exif_camera(path: str) -> tuple[Camera, FocalLength]:
    """Camera of a picture by its EXIF data, with the errors of its parameters.

    Raises: OSError when it is not an image; ValueError without a focal length, or with a digital zoom.
    """
    width, height = stored_size(path)
    tags = camera_tags(path)
    found = focal_length(tags, width, height)
    if found is None:
        raise ValueError(
            f"{path}: has no focal length in its EXIF data (FocalLengthIn35mmFilm, or FocalLength with "
            "FocalPlaneXResolution); give the camera's file, see `libocc calibrate camera`"
        )
    if zoom(tags) > 1:
        raise ValueError(
            f"{path}: was taken with a digital zoom of {zoom(tags):g}, so the focal length of its EXIF data may not be "
            "that of the picture; take it without zoom, or give the camera's file"
        )
    camera = Camera.pinhole(
        width=width, height=height, fx_px=found.px, fy_px=found.px, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2,
        parameter_sigmas=lens_sigmas(width, found.px, found.sigma_px),
    )  # fmt: skip
    return camera, found


def scene_of_picture(scene: str, camera: str | None, image: str) -> tuple[Scene, FocalLength | None]:
    """Scene with the camera that `camera` names (a file, "exif" or None), and the focal length of the EXIF data.

    None: the scene's camera, or that of the EXIF data if the scene has none. Raises: click.ClickException.
    """
    with error_context(scene):
        path = samples.find_scene(scene)
        if camera is None:
            try:
                return Scene.load(path), None
            except ValueError as error:
                if "key `camera`: is missing" not in str(error):
                    raise
    if camera is not None and camera != EXIF:
        with error_context(camera):
            replaced = read_camera(camera)
        with error_context(scene):
            return Scene.load(path, camera=replaced), None
    with error_context(image):
        replaced, found = exif_camera(str(samples.find_image(image)))
    with error_context(scene):
        return Scene.load(path, camera=replaced), found


def growth_by_camera(fix: Fix, scene: Scene) -> float | None:
    """Position sigma over the one with an exact camera, by their bounds at the fix's pose; None without a bound."""
    calibrated = scene.replace(camera=scene.camera.with_parameter_covariance(0 * scene.camera.parameter_covariance))
    traces = [
        float(np.trace(pose_bound(each, fix.cam_from_world, Rung.rims).position_covariance_m2))
        for each in (scene, calibrated)
    ]
    return math.sqrt(traces[0] / traces[1]) if all(math.isfinite(t) and t > 0 for t in traces) else None


def camera_dict(found: FocalLength, scene: Scene, growth: float | None) -> dict[str, Any]:
    """Camera of the EXIF data as plain data."""
    return {
        "source": f"EXIF: {found.source}",
        "fx_px": found.px,
        "parameter_sigmas": lens_sigmas(scene.camera.width, found.px, found.sigma_px),
        "sigma_over_calibrated": growth,
    }


def camera_text(found: FocalLength, growth: float | None) -> str:
    """Line of the text output about the camera of the EXIF data."""
    text = f"camera    not calibrated: {found.px:.0f} px +- {100 * found.sigma_px / found.px:.0f} % by {found.source}"
    return text if growth is None else f"{text}; calibrated, the sigma would be about {growth:.1f} times smaller"


camera_option = click.option(
    "--camera",
    "camera_name",
    metavar="FILE.yaml|exif",
    help="Camera in place of the scene's: a camera file; exif: focal length from the picture's EXIF data, with the "
    "errors of a camera that was not calibrated. Default: the scene's camera; exif if the scene has none.",
)
