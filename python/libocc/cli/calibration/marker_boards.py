# SPDX-License-Identifier: Apache-2.0
"""Detection of boards with tags in images, and initial networks from parts of the boards."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..._core import BoardPoints, Camera, NetworkStart, board_network
from ..board_options import MarkerBoard, ids_text
from ..progress import Advance
from .pictures import find_in_images, short_names

MAX_SCATTER_PX = 0.1  # the errors of a sharp picture of a flat print are a tenth of it
MIN_VIEW = 4  # points of a view that determine its homography


def find_marker_boards(
    images: Sequence[str], board: MarkerBoard, advance: Advance
) -> tuple[list[BoardPoints], list[tuple[int, int]]]:
    """Points of the board in each image, with the status, and the size (width, height) of each image.

    Raises: OSError; ValueError naming the file.
    """
    return find_in_images(images, board.find, advance)


def views_of(board: MarkerBoard, found: Sequence[BoardPoints]) -> list[tuple[Any, Any]]:
    """Positions in the plane and pixels of each image, for occ.network.start_pinhole()."""
    plane = board.points_m[:, :2]
    return [(plane[points.indices], points.px) for points in found if points.ok and len(points.indices) >= MIN_VIEW]


def notes_of(images: Sequence[str], board: MarkerBoard, found: Sequence[BoardPoints]) -> list[str]:
    """Returns a warning for everything that is not used of an image."""
    notes = []
    for image, points in zip(images, found):
        if not points.ok:
            notes.append(f"{image}: no {board.name} was detected; the image is not used: {points.message}")
        if points.foreign_ids and points.ok:
            notes.append(f"{image}: tags that are not on the board are ignored: {ids_text(points.foreign_ids)}")
        if points.misplaced_ids and points.ok:
            notes.append(
                f"{image}: tags that are not at their place on the board are ignored: {ids_text(points.misplaced_ids)}"
            )
        if points.hidden:
            notes.append(f"{image}: {points.hidden} points of the board are covered or in glare")
    scatters = [points.scatter_sigma_px for points in found if points.ok]
    if scatters and float(np.median(scatters)) > MAX_SCATTER_PX:
        notes.append(
            f"the points scatter by {float(np.median(scatters)):.2f} px about a smooth grid, which noise does not "
            "explain: the board is bent or badly printed, or its sizes have another ratio than the options state"
        )
    return notes


def network_of_marker_boards(
    camera: Camera, free: Sequence[str], images: Sequence[str], board: MarkerBoard, found: Sequence[BoardPoints],
) -> NetworkStart:
    """Initial network from the images in which the board was detected. Its warnings name those that are left out."""
    seen = [
        (name, 0, points.px, points.covariance_px2, points.indices)
        for name, points in zip(short_names(images), found) if points.ok
    ]
    return board_network([("camera", camera, list(free))], board.points_m, seen)
