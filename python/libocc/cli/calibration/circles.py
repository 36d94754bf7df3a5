# SPDX-License-Identifier: Apache-2.0
"""Detection of grids of discs in images, and initial networks from the detections."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import (
    Camera,
    Network,
    NetworkStart,
    adjust,
    board_network,
    circle_grid_positions,
    correct_disc_centres,
    find_circle_grid,
)
from ..progress import Advance
from .pictures import find_in_images, short_names


def grid_points(columns: int, rows: int, asymmetric: bool, spacing_m: float) -> NDArray[np.float64]:
    """Centres of the discs (n, 3), row by row, in the board's plane."""
    at = circle_grid_positions(columns, rows, asymmetric, spacing_m)
    return np.column_stack([at, np.zeros(len(at))])


def find_grids(
    images: Sequence[str], columns: int, rows: int, asymmetric: bool, advance: Advance
) -> tuple[list[Any], list[tuple[int, int]]]:
    """CircleGridPoints of each image, or None, and the size (width, height) of each image.

    Raises: OSError; ValueError naming the file.
    """
    return find_in_images(images, lambda pixels: find_circle_grid(
        pixels, columns, rows, asymmetric=asymmetric, progress=lambda *_: advance(0)
    ), advance)


def network_of_grids(
    camera: Camera, free: Sequence[str], images: Sequence[str], grids: Sequence[Any], points_m: NDArray[np.float64],
    radius_m: float,
) -> tuple[NetworkStart, Network, list[str]]:
    """Initial network from the images in which the grid was detected, its corrected copy, and warnings.

    The centre of a disc's image is not the image of its centre. The difference follows from the pose and the camera,
    so it is computed for the initial network, and again after its adjustment.
    """
    seen = [
        (name, 0, grid.px, grid.covariance_px2) for name, grid in zip(short_names(images), grids) if grid is not None
    ]
    started = board_network([("camera", camera, list(free))], points_m, seen)
    network = started.network
    notes: list[str] = []
    if not started.ok:
        return started, network, notes
    dropped = correct_disc_centres(network, seen, radius_m)
    adjusted = adjust(network)
    if adjusted.ok:
        network = adjusted.network
        dropped = correct_disc_centres(network, seen, radius_m)
    else:
        notes.append(f"the centres of the discs are corrected with the initial camera: {adjusted.message}")
    if dropped:
        notes.append(f"{dropped} discs are not used: the camera model does not project them whole")
    coarse = sum(grid.unfitted for grid in grids if grid is not None)
    if coarse:
        notes.append(f"{coarse} discs are measured coarsely: their outline could not be fitted, for example in glare")
    return started, network, notes
