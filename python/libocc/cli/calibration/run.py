# SPDX-License-Identifier: Apache-2.0
"""Adjustment of a network with initial values, and the files of its result."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..._core import (
    Camera,
    CameraFormat,
    CameraKind,
    Datum,
    Network,
    Selection,
    adjust,
    format_camera,
    free_parameter_directions,
    select_parameters,
)
from ...network.files import image_table
from ..progress import QUIET_S, progress
from ..result_folder import ResultFolder, json_bytes
from . import figures, report
from .covariance import bodies_csv, covariance_npz
from .export import points_csv, points_ply
from .summary import Calibration, calibration_of, summary


class Spinner:
    """Shows the progress of an adjustment that takes longer than QUIET_S."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.status import Status

        self.begun = time.monotonic()
        self.status = Status("", console=Console(stderr=True))
        self.shown = False

    def __call__(self, stage: str, iteration: int, cost: float, rejected: int) -> bool:
        self.status.update(f"{stage}: iteration {iteration}, cost {cost:.6g}, {rejected} rejected")
        if not self.shown and time.monotonic() - self.begun > QUIET_S:
            self.status.start()
            self.shown = True
        return True

    def __enter__(self) -> "Spinner":
        return self

    def __exit__(self, *ignored: object) -> None:
        self.status.stop()


def calibrate(
    network: Network, datum: Datum, *, robust: bool = True, select: bool = False, notes: Sequence[str] = (),
    checks: dict[str, Any] | None = None, before: Camera | None = None, keep: Sequence[str] = (),
) -> tuple[Calibration, Selection | None]:
    """Adjusts a network.

    select: estimates only the parameters that the observations determine. before: camera with which the report compares
    the first camera, and against which `select` tests its parameters; default: that of the network. keep: parameters
    that `select` never drops.
    """
    begun = time.monotonic()
    chosen = None
    with Spinner() as spinner:
        if select:
            nominal = network.cameras if before is None else [before, *network.cameras[1:]]
            chosen = select_parameters(network, datum=datum, robust=robust, keep=keep, nominal=nominal)
            adjusted = chosen.adjustment
        else:
            adjusted = adjust(network, robust=robust, snooping=robust, datum=datum, progress=spinner)
    if before is not None:
        network = network.copy()
        network.set_camera(0, before, network.free_parameters[0])
    found = calibration_of(network, adjusted, datum, time.monotonic() - begun, checks)
    found.notes.extend(note for note in notes if note not in adjusted.warnings)
    return found, chosen


# Groups of parameters in the order in which the ladder adds them.
GROUPS = (
    ("c_px", "cy_px"), ("f_px", "fx_px", "fy_px"), ("cx_px", "cy_px"), ("ex_m", "ey_m", "ez_m"),
    ("tilt_x_rad", "tilt_y_rad"), ("angle_per_px_rad",), ("k1", "k2"), ("p1", "p2"), ("k3", "k4", "k5", "k6"),
    ("s1", "s2", "s3", "s4"), ("tau_x", "tau_y"), ("a1", "a2", "a3"), ("b1", "b2"), ("c1", "c2"),
    ("xi", "alpha"), ("skew_px",), tuple(f"tumbling{i}_rad" for i in range(1, 7)),
)


def ladder(network: Network, datum: Datum, adjusted: Network) -> tuple[list[str], list[float]]:
    """Names and sigma0 of adjustments without camera parameters, then with one more group of parameters each.

    adjusted: the network adjusted with the complete model; what was rejected there is omitted in all adjustments.
    """
    free = network.free_parameters
    left = {name for names in free for name in names}
    wanted = []
    for group in GROUPS:  # a name that occurs in several groups belongs to the first one
        present = [name for name in group if name in left]
        left.difference_update(present)
        if present:
            wanted.append(present)
    rest = adjusted.copy()
    names, sigmas = [], []
    with progress("ladder", len(wanted) + 1) as advance:
        for k in range(len(wanted) + 1):
            kept = {name for group in wanted[:k] for name in group}
            for camera, all_names in enumerate(free):
                rest.set_camera(camera, network.cameras[camera], [name for name in all_names if name in kept])
            sigmas.append(adjust(rest, datum=datum, robust=False, snooping=False).sigma0)
            short = (name.removesuffix("_px").removesuffix("_rad").removesuffix("_m") for name in wanted[k - 1])
            names.append(" ".join(short) if k > 0 else "none")
            advance()
    return names, sigmas


def ladder_section(network: Network, datum: Datum, adjusted: Network) -> str:
    names, sigmas = ladder(network, datum, adjusted)
    shown = [names[0], *(f"+ {name}" for name in names[1:])]
    return "<h2>Influence of the parameter groups</h2>" + report.picture(figures.ladder(shown, sigmas), "ladder")


def uncertainty(c: Calibration, camera: int) -> Figure | None:
    """Map of the projection uncertainty; None when the camera has no free parameters."""
    sigma = c.projection_sigmas_px[camera]
    model = c.network.cameras[camera]
    return None if sigma is None else figures.uncertainty_map(sigma, model.width, model.height)


def stated_camera(c: Calibration, index: int) -> Camera:
    """An adjusted camera with the covariance of its free parameters."""
    camera = c.network.cameras[index]
    free = c.network.free_parameters[index]
    if not (c.known.ok and free):
        return camera
    directions = free_parameter_directions(camera, free)
    return camera.with_parameter_covariance(directions @ c.known.parameters(index) @ directions.T)


def camera_files(name: str, camera: Camera) -> dict[str, bytes]:
    """Camera files for libocc and, if they have the camera model, for OpenCV and ROS."""
    files = {f"{name}.yaml": format_camera(camera).encode()}
    if camera.kind in (CameraKind.pinhole, CameraKind.fisheye):
        files[f"{name}_opencv.yaml"] = format_camera(camera, CameraFormat.opencv).encode()
        if len(camera.distortion) <= 8:
            files[f"{name}_ros.yaml"] = format_camera(camera, CameraFormat.ros).encode()
    return files


def write(folder: ResultFolder, c: Calibration, title: str, extra: Sequence[str] = ()) -> dict[str, Any]:
    """Writes all files, also of a failed adjustment; returns the summary."""
    data = summary(c)
    folder.write("result.json", json_bytes(data))
    for k, name in enumerate(c.network.camera_names):
        for file, content in camera_files(name, stated_camera(c, k)).items():
            folder.write(file, content)
    folder.write("images.csv", image_table(c.network))
    if c.network.point_names:
        covariances = c.known.points() if c.known.ok else np.full((len(c.network.point_names), 3, 3), np.inf)
        folder.write("points.csv", points_csv(c.network.point_names, c.network.points_m, covariances))
        folder.write("points.ply", points_ply(c.network.points_m, covariances))
    if c.known.ok:
        if c.network.body_names:
            folder.write("bodies.csv", bodies_csv(c.network, c.known))
        joint = covariance_npz(c.network, c.known)
        if joint is not None:
            folder.write("covariance.npz", joint)
    maps = [uncertainty(c, k) for k in range(len(c.network.cameras))]
    folder.write("report.html", report.html(c, title, extra, maps))
    return data
