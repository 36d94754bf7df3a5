# SPDX-License-Identifier: Apache-2.0
"""Masks of lamps: the pixels whose centres lie inside the lamp's rim."""

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._core import Camera, Lamp, Scene

Mask = npt.NDArray[np.bool_]
Points = npt.NDArray[np.float64]


def fill(rim_px: Points, x0: int, y0: int, width: int, height: int) -> Mask:
    """Mask of the pixels of a window whose centres lie inside a closed polygon (even-odd rule)."""
    a, b = rim_px - (x0, y0), np.roll(rim_px, -1, axis=0) - (x0, y0)
    rows = np.arange(height)
    # Each edge includes its upper end and excludes its lower end, so that a vertex is counted once.
    edge, row = np.nonzero((a[:, 1, None] <= rows) != (b[:, 1, None] <= rows))
    slope = (b[edge, 0] - a[edge, 0]) / (b[edge, 1] - a[edge, 1])
    column = np.ceil(a[edge, 0] + (row - a[edge, 1]) * slope).astype(int)
    crossed = np.zeros((height, width + 1), int)
    np.add.at(crossed, (row, np.clip(column, 0, width)), 1)
    inside: Mask = np.cumsum(crossed[:, :width], axis=1) % 2 == 1
    return inside


class Silhouette:
    """Pixels covered by a lamp, also outside the image.

    A lamp that covers no pixel centre, such as a point source, has the pixel nearest to its centre.
    """

    def __init__(self, rim_px: Points, centre_px: Points):
        low = np.floor(rim_px.min(axis=0)).astype(int)
        size = np.ceil(rim_px.max(axis=0)).astype(int) - low + 1
        self.x0, self.y0 = int(low[0]), int(low[1])
        self.pixels = fill(rim_px, self.x0, self.y0, int(size[0]), int(size[1]))
        if not self.pixels.any():
            self.x0, self.y0 = (int(v) for v in np.floor(centre_px + 0.5))
            self.pixels = np.ones((1, 1), bool)

    def within(self, width: int, height: int) -> Mask:
        """Mask of the part inside an image of the given size."""
        mask = np.zeros((height, width), bool)
        rows, columns = self.pixels.shape
        top, left = max(0, -self.y0), max(0, -self.x0)
        bottom, right = min(rows, height - self.y0), min(columns, width - self.x0)
        if top < bottom and left < right:
            mask[self.y0 + top : self.y0 + bottom, self.x0 + left : self.x0 + right] = self.pixels[
                top:bottom, left:right
            ]
        return mask

    def box(self) -> list[int]:
        """x, y of the first and x, y of the last pixel."""
        x0, y0, x1, y1 = box_of(self.pixels)
        return [self.x0 + x0, self.y0 + y0, self.x0 + x1, self.y0 + y1]


def box_of(mask: Mask) -> list[int]:
    """x, y of the first and x, y of the last pixel of a mask that is not empty."""
    ys, xs = np.nonzero(mask)
    return [int(xs.min()), int(ys.min()), int(xs.max()), int(ys.max())]


def hidden_pixels(mask: Mask, lamp: Lamp, scene: Scene, cam_from_world: Any) -> Mask:
    """Pixels of a mask whose ray to the lamp's plane intersects a box."""
    ys, xs = np.nonzero(mask)
    rays = _rays(scene.camera, xs, ys) @ cam_from_world[:3, :3]
    eye = -cam_from_world[:3, :3].T @ cam_from_world[:3, 3]
    normal = np.asarray(lamp.normal)
    steps = ((np.asarray(lamp.centre_m) - eye) @ normal) / (rays @ normal)
    segments = rays * steps[:, None]
    hidden = np.zeros(mask.shape, bool)
    for box in scene.boxes:
        hidden[ys, xs] |= _intersects(eye, segments, np.asarray(box.min_m), np.asarray(box.max_m))
    return hidden


def _rays(camera: Camera, xs: npt.NDArray[np.int64], ys: npt.NDArray[np.int64]) -> Points:
    rays = [camera.unproject((float(x), float(y))) for x, y in zip(xs, ys, strict=True)]
    return np.array([np.full(3, np.nan) if ray is None else np.ravel(ray) for ray in rays])


def _intersects(eye: Points, segments: Points, low: Points, high: Points) -> Mask:
    """True for the segments from the eye that intersect a box (slab method)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - eye) / segments, (high - eye) / segments
    enter, leave = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
    hit: Mask = (enter <= leave) & (leave > 0) & (enter < 1)
    return hit


def run_lengths(mask: Mask) -> dict[str, list[int]]:
    """COCO's uncompressed run lengths, column by column, starting with a run of background."""
    columns = np.flatnonzero(mask.any(axis=0))
    first, last = (columns[0], columns[-1]) if len(columns) else (0, -1)
    part = np.pad(mask[:, first : last + 1].ravel(order="F"), 1)
    changes = np.flatnonzero(part[1:] != part[:-1]) + first * mask.shape[0]
    ends = [0, *changes.tolist(), mask.size]
    counts = [b - a for a, b in pairwise(ends)]
    return {"size": list(mask.shape), "counts": counts if counts[-1] else counts[:-1]}


def from_run_lengths(runs: dict[str, Any]) -> Mask:
    """Inverse of run_lengths()."""
    counts = runs["counts"]
    flat = np.repeat(np.arange(len(counts)) % 2 == 1, counts)
    mask: Mask = flat.reshape(runs["size"], order="F")
    return mask
