# SPDX-License-Identifier: Apache-2.0
"""A view of points from a pose, exact, and random numbers to make it from."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import exact as ex

Random = np.random.Generator


@dataclass
class View:
    """Points and a pose, as 100-digit numbers, with what else the case does to them."""

    points: Any  # (n, 3), world
    rotation: Any  # (3, 3), of cam_from_world
    position: Any  # (3,), of the camera in the world
    behind: tuple[int, ...] = ()  # points whose bearings point away from them
    of_others: Any = None  # bearings instead of those of the points
    spoilt: str = ""  # one number, as `bad_input` says

    def in_cam(self) -> Any:
        return (self.points - self.position) @ self.rotation.T

    def bearings(self) -> Any:
        """(n, 3) doubles nearest to the directions of the points."""
        if self.of_others is not None:
            return self.of_others
        out = [ex.rounded(ex.unit(x)) for x in self.in_cam()]
        out = [-f if i in self.behind else f for i, f in enumerate(out)]
        return np.array(out, dtype=float).reshape(-1, 3)

    def arrays(self) -> tuple[Any, Any]:
        """Bearings and points as a solver is given them, (n, 3) doubles."""
        bearings, points = self.bearings(), ex.rounded(self.points)
        if self.spoilt == "long_bearing":
            bearings[0] *= 1.5
        elif self.spoilt:
            wrong, _, which = self.spoilt.partition("_")
            chosen = bearings if which == "bearing" else points
            chosen[1, 2] = np.nan if wrong == "nan" else np.inf
        return bearings, points


def pick(rng: Random, value: Any) -> float:
    """A number as it is, or one between the two of a range."""
    if isinstance(value, (list, tuple)):
        return float(rng.uniform(value[0], value[1]))
    return float(value)


def grid(rng: Random, low: float, high: float, size: Any = None) -> Any:
    """Numbers on a grid of 1/64, of which sums and differences are exact doubles."""
    return np.asarray(rng.integers(round(low * 64), round(high * 64) + 1, size)) / 64


def any_rotation(rng: Random) -> Any:
    return ex.rotation(rng.normal(size=4))


def about(axis: Any, angle_rad: float) -> Any:
    """Rotation about an axis; an angle of 0 gives exactly the identity."""
    axis = np.asarray(axis, dtype=float)
    return ex.rotation(np.append(np.cos(angle_rad / 2), np.sin(angle_rad / 2) * axis))


def cone(rng: Random, count: int, half_angle_rad: float) -> Any:
    """(count, 3) directions about the optical axis, as (x/z, y/z, 1)."""
    radius = np.tan(half_angle_rad) * np.sqrt(rng.uniform(size=count))
    angle = rng.uniform(0, 2 * np.pi, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.ones(count)], axis=1)


def looking_at(rng: Random, target: Any, position: Any) -> Any:
    """Rotation of a camera that has target about 0.2 rad from its axis, with any roll."""
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
