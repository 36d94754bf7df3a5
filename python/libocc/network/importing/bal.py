# SPDX-License-Identifier: Apache-2.0
"""Problems of BAL, "Bundle Adjustment in the Large": text, or compressed with bzip2 or gzip.

A camera has a rotation vector, a translation, a focal length and two radial coefficients; p = -(x, y) / z is measured
at f p (1 + k1 |p|^2 + k2 |p|^4) from the image's centre, with y upwards. Source: Agarwal, Snavely, Seitz, Szeliski,
"Bundle adjustment in the large", ECCV 2010, and grail.cs.washington.edu/projects/bal.
"""

import bz2
import gzip
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..._core import Camera, Network, Target
from ..tables import decoded
from .fields import Fields, Imported

SIGMA_PX = 1.0  # BAL states none
SUFFIXES = (".txt", ".bal", ".bz2", ".gz")


def opened(path: Path) -> BinaryIO:
    openers: dict[str, Callable[..., Any]] = {".bz2": bz2.open, ".gz": gzip.open}
    file: BinaryIO = openers.get(path.suffix.lower(), open)(path, "rb")
    return file


def content_of(path: Path, limit: int = -1) -> bytes:
    try:
        with opened(path) as file:
            return file.read(limit)
    except (EOFError, gzip.BadGzipFile) as error:
        raise ValueError(f"{path}: is damaged: {error}") from None


def is_bal(path: Path) -> bool:
    if not path.is_file() or path.suffix.lower() not in SUFFIXES:
        return False
    head = content_of(path, 400).split(b"\n")
    return len(head) > 1 and bool(re.fullmatch(rb"\s*\d+\s+\d+\s+\d+\s*", head[0])) and len(head[1].split()) == 4


def rotation_matrix(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation by a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < 1e-8:  # the next term, angle^2 / 6, is below the rounding
        return np.asarray(np.eye(3) + skew + skew @ skew / 2)
    return np.asarray(np.eye(3) + np.sin(angle) / angle * skew + (1 - np.cos(angle)) / angle**2 * skew @ skew)


class Numbers:
    """Numbers of the file in their order, with the line of each."""

    def __init__(self, path: Path):
        self.path = path
        self.rows = [
            Fields(path, number, line.split())
            for number, line in enumerate(decoded(path, content_of(path)).splitlines(), 1) if line.strip()
        ]
        if not self.rows:
            raise ValueError(f"{path}:1: is empty")
        self.at = 1

    def block(self, count: int, names: tuple[str, ...]) -> tuple[NDArray[np.float64], list[int]]:
        """The next `count` groups of numbers, which may share lines or extend over several, and the line of each."""
        size = count * len(names)
        values: list[float] = []
        lines: list[int] = []
        while len(values) < size:
            if self.at >= len(self.rows):
                raise ValueError(
                    f"{self.path}:{self.rows[-1].line}: the file ends after {len(values) // len(names)} of {count} "
                    f"groups of {', '.join(names)}"
                )
            row = self.rows[self.at]
            if len(row) > size - len(values):
                raise ValueError(f"{row.where}: must have {size - len(values)} numbers or less, got {len(row)}")
            lines += [row.line] * len(row)
            values += [row.number(k, names[(len(values) + k) % len(names)]) for k in range(len(row))]
            self.at += 1
        return np.array(values).reshape(count, len(names)), lines[:: len(names)]


def read_bal(path: str | Path, *, sigma_px: float = SIGMA_PX) -> Imported:
    """Reads a problem of BAL. Every image has a camera of its own. sigma_px: of all image points.

    Raises: OSError; ValueError naming file, line, field and value.
    """
    numbers = Numbers(Path(path))
    head = numbers.rows[0]
    head.require(("cameras", "points", "observations"))
    cameras, points, observations = (head.integer(k, n, 1) for k, n in enumerate(("cameras", "points", "observations")))
    seen, lines = numbers.block(observations, ("camera", "point", "x", "y"))
    for column, (name, count) in enumerate((("camera", cameras), ("point", points))):
        bad = np.flatnonzero((seen[:, column] < 0) | (seen[:, column] >= count) | (seen[:, column] % 1 != 0))
        if len(bad):
            raise ValueError(
                f"{path}:{lines[bad[0]]}: field `{name}`: must be a whole number from 0 to {count - 1}, "
                f"got {seen[bad[0], column]:g}"
            )
    models, camera_lines = numbers.block(cameras, ("rx", "ry", "rz", "tx", "ty", "tz", "f", "k1", "k2"))
    positions, _ = numbers.block(points, ("x", "y", "z"))

    half = np.ceil(np.abs(seen[:, 2:]).max(axis=0)) + 1
    size = (2 * half).astype(int)
    centre = (size - 1) / 2
    network = Network()
    flip = np.diag([1.0, -1.0, -1.0])
    for k, model in enumerate(models):
        if not model[6] > 0:
            raise ValueError(f"{path}:{camera_lines[k]}: field `f` of camera {k}: must be positive, got {model[6]:g}")
        camera = Camera.pinhole(
            width=size[0], height=size[1], fx_px=model[6], fy_px=model[6], cx_px=centre[0], cy_px=centre[1],
            distortion=[model[7], model[8], 0, 0],
        )
        pose = np.eye(4)
        pose[:3, :3] = flip @ rotation_matrix(model[:3])
        pose[:3, 3] = flip @ model[3:6]
        network.add_image(f"image {k}", network.add_camera(f"camera {k}", camera, ["f_px", "k1", "k2"]), pose)
    for k, position in enumerate(positions):
        network.add_point(f"point {k}", position)
    order = np.argsort(seen[:, 0], kind="stable")
    keys = seen[:, 0] * points + seen[:, 1]
    first_of_key: dict[float, int] = {}
    for line, key in zip(lines, keys.tolist()):
        if key in first_of_key:
            raise ValueError(f"{path}:{line}: point {int(key % points)} occurs twice in image {int(key // points)}, "
                             f"first in line {first_of_key[key]}")
        first_of_key[key] = line
    for k, rows in enumerate(np.split(seen[order], np.searchsorted(seen[order, 0], np.arange(1, cameras)))):
        if len(rows):
            network.observe(k, [Target.point(int(p)) for p in rows[:, 1]], centre + rows[:, 2:] * [1, -1], sigma_px)
    notes = [
        f"BAL states no standard deviations: {sigma_px:g} px are assumed",
        "BAL states no image sizes: the images are as large as the observations need, with the principal point in the "
        "middle",
        "BAL has a camera for each image",
    ]
    return Imported(network, notes=notes)
