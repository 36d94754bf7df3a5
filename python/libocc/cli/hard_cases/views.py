# SPDX-License-Identifier: Apache-2.0
"""Views of points from a pose with 100 digits, and random numbers for generators."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import exact as ex

Random = np.random.Generator


@dataclass
class View:
    """Points and a pose with 100 digits, and modifications of the input."""

    points: Any  # (n, 3), world
    rotation: Any  # (3, 3), of cam_from_world
    position: Any  # (3,), of the camera in the world
    behind: tuple[int, ...] = ()  # points whose bearings have the opposite direction
    other_bearings: Any = None  # replace the bearings of the points
    invalid: str = ""  # invalid value, see bad_input()

    def in_cam(self) -> Any:
        return (self.points - self.position) @ self.rotation.T

    def bearings(self) -> Any:
        """(n, 3) directions of the points, rounded to doubles."""
        if self.other_bearings is not None:
            return self.other_bearings
        out = [ex.rounded(ex.unit(x)) for x in self.in_cam()]
        out = [-f if i in self.behind else f for i, f in enumerate(out)]
        return np.array(out, dtype=float).reshape(-1, 3)

    def arrays(self) -> tuple[Any, Any]:
        """Bearings and points for a solver, (n, 3) doubles."""
        bearings, points = self.bearings(), ex.rounded(self.points)
        if self.invalid == "long_bearing":
            bearings[0] *= 1.5
        elif self.invalid:
            wrong, _, which = self.invalid.partition("_")
            chosen = bearings if which == "bearing" else points
            chosen[1, 2] = np.nan if wrong == "nan" else np.inf
        return bearings, points


def pick(rng: Random, value: Any) -> float:
    """The number itself, or a random number in a range of two."""
    if isinstance(value, (list, tuple)):
        return float(rng.uniform(value[0], value[1]))
    return float(value)


def grid(rng: Random, low: float, high: float, size: Any = None) -> Any:
    """Random numbers on a grid of 1/64, whose sums and differences are exact doubles."""
    return np.asarray(rng.integers(round(low * 64), round(high * 64) + 1, size)) / 64


def any_rotation(rng: Random) -> Any:
    return ex.rotation(rng.normal(size=4))


def about(axis: Any, angle_rad: float) -> Any:
    """Rotation about an axis; an angle of 0 gives the exact identity."""
    axis = np.asarray(axis, dtype=float)
    return ex.rotation(np.append(np.cos(angle_rad / 2), np.sin(angle_rad / 2) * axis))


def cone(rng: Random, count: int, half_angle_rad: float) -> Any:
    """(count, 3) directions about the optical axis, as (x/z, y/z, 1)."""
    radius = np.tan(half_angle_rad) * np.sqrt(rng.uniform(size=count))
    angle = rng.uniform(0, 2 * np.pi, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.ones(count)], axis=1)


def looking_at(rng: Random, target: Any, position: Any) -> Any:
    """Rotation of a camera with the target at most 0.2 rad from its axis and a random roll."""
    z = ex.unit(target - position)
    x = ex.unit(ex.cross(z, ex.exact(rng.normal(size=3))))
    towards = np.stack([x, ex.cross(z, x), z])
    return about([*_circle(rng), 0.0], float(rng.uniform(0, 0.2))) @ towards


def _circle(rng: Random) -> tuple[float, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return float(np.cos(angle)), float(np.sin(angle))


def area_share(points: Any) -> float:
    """Twice the area of a triangle over its longest side squared: 0 on a line, 0.87 equilateral."""
    a, b, c = np.asarray(points, dtype=float)
    longest = max(np.linalg.norm(a - b), np.linalg.norm(a - c), np.linalg.norm(b - c))
    return float(np.linalg.norm(np.cross(b - a, c - a)) / longest**2)
