# SPDX-License-Identifier: Apache-2.0
"""Generators for three points (or a few coplanar points) at singular or symmetric configurations of P3P."""

from decimal import Decimal
from typing import Any

import numpy as np

from . import exact as ex
from .views import Random, View, about, any_rotation, grid, looking_at, pick

SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def ceiling(
    rng: Random, points: int, where: str = "anywhere", tilt_deg: Any = (5, 40), heading: str = "any"
) -> View:
    """Corners of a square on a ceiling, seen from below.

    where: anywhere, on_axis (of the square), symmetry_plane, under_lamp. tilt_deg: angle of the optical axis from the
    vertical. heading: any, or zero (the camera axes are those of the world).
    """
    half = float(grid(rng, 0.5, 2))
    centre = np.append(grid(rng, 2, 6, 2), grid(rng, 2.5, 4))
    lamps = centre + np.hstack([half * SQUARE, np.zeros((4, 1))])
    height = float(grid(rng, 0.25, 1.25))
    if where == "on_axis":
        below = centre[:2]
    elif where == "under_lamp":
        below = lamps[0, :2]
    elif where == "symmetry_plane":  # also of the triangle: the diagonal through its middle corner
        below = centre[:2] + float(grid(rng, -1.5, 1.5)) * SQUARE[1]
    elif where == "anywhere":
        below = centre[:2] + half * rng.uniform(-1.2, 1.2, 2)
    else:
        raise ValueError(f"where must be anywhere, on_axis, symmetry_plane or under_lamp, got {where}")
    rotation = about([0, 0, 1], 0 if heading == "zero" else rng.uniform(-np.pi, np.pi))
    if tilt_deg != 0:
        direction = rng.uniform(0, 2 * np.pi)
        axis = [np.cos(direction), np.sin(direction), 0]
        rotation = about(axis, np.radians(pick(rng, tilt_deg))) @ rotation
    return View(ex.exact(lamps[:points]), rotation, ex.exact(np.append(below, height)))


def symmetric(rng: Random, points: int, kind: str = "equilateral", where: str = "on_axis") -> View:
    """An equilateral or isosceles triangle around the world's origin.

    where: on_axis (through its centroid), symmetry_plane (through its first point).
    """
    stretch = ex.ONE if kind == "equilateral" else Decimal(float(rng.uniform(0.4, 2)))
    apex, base = ex.TWO * stretch, Decimal(3).sqrt()
    flat = [[apex, ex.ZERO], [-stretch, base], [-stretch, -base]]
    triangle = np.array([[*p, ex.ZERO] for p in flat], dtype=object)
    aside = 0 if where == "on_axis" else float(rng.uniform(-3, 3))
    place = ex.exact([aside, 0, rng.uniform(1.5, 8)])
    rotated = any_rotation(rng)
    world, position = triangle @ rotated.T, rotated @ place
    straight = np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]], dtype=object) @ rotated.T
    tilted = about([np.cos(1.0), np.sin(1.0), 0], rng.uniform(0, 0.4))
    return View(world, tilted @ straight, position)


def danger_cylinder(rng: Random, points: int, aside: float = 0.0) -> View:
    """The camera is on the danger cylinder, or at a distance of `aside` radii from it."""
    while True:
        angles = np.sort(rng.uniform(0, 2 * np.pi, points))
        gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        own = rng.uniform(0, 2 * np.pi)
        if gaps.min() > 0.5 and np.abs(np.sin((angles - own) / 2)).min() > 0.1:
            break
    flat = np.array([[*_on_circle(a), ex.ZERO] for a in angles], dtype=object)
    x, y = _on_circle(own)
    beyond = ex.ONE + Decimal(float(aside))
    place = np.array([x * beyond, y * beyond, Decimal(float(rng.uniform(1, 4)))], dtype=object)
    rotated = any_rotation(rng)
    world, position = flat @ rotated.T, rotated @ place
    return View(world, looking_at(rng, world.sum(0) / points, position), position)


def _on_circle(angle_rad: float) -> tuple[Decimal, Decimal]:
    """A point on the unit circle, exact in all digits."""
    t = Decimal(float(np.tan(angle_rad / 2)))
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


def line(rng: Random, points: int, height: float = 0.0, exactly: bool = True) -> View:
    """Points on a line; the second point is `height` times the length of the line away from it.

    exactly: the coordinates are on a grid, so that rounding keeps the points on the line.
    """
    step = grid(rng, 0.125, 0.5, 3) * rng.choice([-1, 1], 3)
    start = grid(rng, -1, 1, 3)
    world = ex.exact(start + np.outer(np.arange(points), step))
    aside = np.cross(step, rng.normal(size=3))
    aside *= height * np.linalg.norm(step) * (points - 1) / np.linalg.norm(aside)
    world[1] = world[1] + ex.exact(aside)
    if not exactly:
        world = world @ any_rotation(rng).T
    position = ex.exact(rng.normal(size=3))
    position = world.sum(0) / points + ex.unit(position) * Decimal(float(rng.uniform(2, 6)))
    return View(world, looking_at(rng, world.sum(0) / points, position), position)


def in_plane(rng: Random, points: int, height: float = 0.0) -> View:
    """The camera is in the plane of the points, or `height` times its distance away from it."""
    distance = rng.uniform(3, 6)
    while True:
        flat = rng.uniform(-1, 1, (points, 2))
        corners = [np.linalg.det(np.hstack([flat[[i, j, k]], np.ones((3, 1))]))
                   for i in range(points) for j in range(i) for k in range(j)]
        if np.abs(corners).min() > 0.4:
            break
    world = ex.exact(np.hstack([flat, np.zeros((points, 1))]))
    place = ex.exact([distance, rng.uniform(-1, 1), height * distance])
    rotated = any_rotation(rng)
    world, position = world @ rotated.T, rotated @ place
    return View(world, looking_at(rng, world.sum(0) / points, position), position)
