# SPDX-License-Identifier: Apache-2.0
"""From a network with starts to a folder with the result, with progress."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .._core import (
    Camera,
    CameraFormat,
    CameraKind,
    Datum,
    Network,
    Selection,
    adjust,
    format_camera,
    projection_uncertainty,
    select_parameters,
)
from ..progress import QUIET_S
from ..result_folder import ResultFolder, json_bytes
from . import figures, report
from .export import points_csv, points_ply
from .network_file import image_table
from .summary import Calibration, calibration_of, summary

GRID = 24  # of the uncertainty map, along the longer side


class Spinner:
    """Tells what the adjustment is doing once it turns out to be long."""

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
) -> tuple[Calibration, Selection | None]:
    """Adjusts; with select only the parameters that the observations call for stay unknown."""
    begun = time.monotonic()
    chosen = None
    with Spinner() as spinner:
        if select:
            chosen = select_parameters(network, datum=datum, robust=robust)
            adjusted = chosen.adjustment
        else:
            adjusted = adjust(network, robust=robust, snooping=robust, datum=datum, progress=spinner)
    found = calibration_of(network, adjusted, datum, time.monotonic() - begun)
    found.notes.extend(notes)
    return found, chosen


def uncertainty(c: Calibration, camera: int) -> Figure | None:
    """Map of a central camera's; none when nothing of it is unknown or the camera has no centre."""
    free = c.network.free_parameters[camera]
    model = c.network.cameras[camera]
    if not free or not c.known.ok or not model.is_central:
        return None
    columns = GRID if model.width >= model.height else max(4, GRID * model.width // model.height)
    rows = GRID if model.height >= model.width else max(4, GRID * model.height // model.width)
    sigma, _, _ = projection_uncertainty(model, free, c.known.parameters(camera), columns=columns, rows=rows)
    return figures.uncertainty_map(np.asarray(sigma), model.width, model.height)


def camera_files(name: str, camera: Camera) -> dict[str, bytes]:
    """libocc's file, and where the model is known there those of OpenCV and ROS."""
    files = {f"{name}.yaml": format_camera(camera).encode()}
    if camera.kind in (CameraKind.pinhole, CameraKind.fisheye):
        files[f"{name}_opencv.yaml"] = format_camera(camera, CameraFormat.opencv).encode()
        if len(camera.distortion) <= 8:
            files[f"{name}_ros.yaml"] = format_camera(camera, CameraFormat.ros).encode()
    return files


def write(folder: ResultFolder, c: Calibration, title: str, extra: Sequence[str] = ()) -> dict[str, Any]:
    """Everything there is, whether the adjustment ended well or not; returns the summary."""
    data = summary(c)
    folder.write("result.json", json_bytes(data))
    for name, camera in zip(c.network.camera_names, c.network.cameras):
        for file, content in camera_files(name, camera).items():
            folder.write(file, content)
    folder.write("images.csv", image_table(c.network))
    if c.network.point_names:
        covariances = c.known.points() if c.known.ok else np.full((len(c.network.point_names), 3, 3), np.inf)
        folder.write("points.csv", points_csv(c.network.point_names, c.network.points_m, covariances))
        folder.write("points.ply", points_ply(c.network.points_m, covariances))
    maps = [uncertainty(c, k) for k in range(len(c.network.cameras))]
    folder.write("report.html", report.html(c, title, extra, maps))
    return data
