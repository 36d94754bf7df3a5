# SPDX-License-Identifier: Apache-2.0
"""Generators for any number of points: scales, offsets, rotations, depths, and invalid input."""

from typing import Any

import numpy as np

from . import exact as ex
from .triangles import SQUARE
from .views import Random, View, about, any_rotation, area_share, cone, looking_at, pick

HALF_TURNS = {"half_turn_x": [0, 1, 0, 0], "half_turn_y": [0, 0, 1, 0], "half_turn_z": [0, 0, 0, 1]}


def _rotation(rng: Random, kind: str) -> Any:
    if kind == "any":
        return any_rotation(rng)
    if kind == "identity":
        return ex.rotation([1, 0, 0, 0])
    if kind == "half_turn":
        return ex.rotation([0, *rng.normal(size=3)])
    if kind in HALF_TURNS:
        return ex.rotation(HALF_TURNS[kind])
    raise ValueError(f"rotation must be any, identity, half_turn or {', '.join(HALF_TURNS)}, got {kind}")


def cloud(
    rng: Random,
    points: int,
    half_angle_rad: float = 0.6,
    depth_m: Any = (2, 6),
    rotation: str = "any",
    offset_m: float = 0.0,
    scale: float = 1.0,
    behind: int = 0,
    duplicates: int = 0,
) -> View:
    """Random points in a cone about the optical axis.

    depth_m: range of the depths, uniform in the logarithm. rotation: of cam_from_world: any, identity, half_turn
    (180 degrees about any axis), half_turn_x, _y, _z. offset_m: of the world's origin. scale: of all lengths.
    behind: number of points behind the camera; their bearings have the opposite direction, as in a pinhole model
    without a check of the depth. duplicates: number of points that coincide with the first one.
    """
    low, high = np.log(depth_m[0]), np.log(depth_m[1])
    while True:
        depths = np.exp(rng.uniform(low, high, points))
        if high - low > 3:  # always includes both ends
            depths[:2] = depth_m
        in_cam = cone(rng, points, half_angle_rad) * depths[:, None]
        if points < 3 or area_share(in_cam[:3] / depths[:3, None]) > 0.2:
            break
    in_cam[:behind] *= -1
    for i in range(points - duplicates, points):
        in_cam[i] = in_cam[0]
    rotated = _rotation(rng, rotation)
    position = ex.exact(rng.normal(size=3))
    away = ex.exact(np.round(offset_m * rng.uniform(0.5, 1, 3) * rng.choice([-1, 1], 3)))
    size = ex.exact(scale)[()]
    world = (ex.exact(in_cam) @ rotated + position + away) * size
    return View(world, rotated, (position + away) * size, tuple(range(behind)))


def target(
    rng: Random,
    points: int,
    size_m: float = 0.1,
    distance_m: float = 10.0,
    tilt_deg: Any = (10, 60),
    thickness: float = 0.0,
) -> View:
    """Small planar target at a long distance: corners of a square, or points in that square.

    thickness: max distance of the points from the plane, in multiples of size_m.
    """
    while True:
        corners = SQUARE[:points] / 2 if points in (3, 4) else rng.uniform(-0.5, 0.5, (points, 2))
        if area_share(np.pad(corners[:3], ((0, 0), (0, 1)))) > 0.3:
            break
    bumps = rng.uniform(-1, 1, points) * thickness
    figure = ex.exact(np.column_stack([corners, bumps]) * size_m)
    rotated = any_rotation(rng)
    tilt, around = np.radians(pick(rng, tilt_deg)), rng.uniform(0, 2 * np.pi)
    away = [np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)]
    world = figure @ rotated.T
    position = rotated @ ex.exact(np.array(away) * distance_m)
    return View(world, looking_at(rng, world.sum(0) / points, position), position)


def grazing(rng: Random, points: int, angle_rad: float = 1e-3) -> View:
    """One point is seen at angle_rad from the plane through the camera centre that is perpendicular to the axis."""
    while True:
        in_cam = cone(rng, points, 0.7) * rng.uniform(2, 6, (points, 1))
        around = rng.uniform(0, 2 * np.pi)
        in_cam[0] = rng.uniform(2, 6) * np.array([np.cos(around), np.sin(around), np.tan(angle_rad)])
        if area_share(in_cam[:3]) > 0.3:
            break
    rotated, position = any_rotation(rng), ex.exact(rng.normal(size=3))
    return View(ex.exact(in_cam) @ rotated + position, rotated, position)


def cube(rng: Random, points: int) -> View:
    """Corners of a cube seen along the normal of a face; the camera axes are parallel to the cube."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])[:points]
    size, distance = rng.uniform(0.2, 1), rng.uniform(3, 8)
    position = ex.exact([0, 0, -distance])
    return View(ex.exact(corners * size), about([0, 0, 1], 0), position)


def mismatched(rng: Random, points: int) -> View:
    """Bearings of other points than the given ones; `instances` draws again if they fit a pose."""
    given = cloud(rng, points)
    given.other_bearings = cloud(rng, points, half_angle_rad=0.9).bearings()
    return given


def bad_input(rng: Random, points: int, kind: str = "nan_point") -> View:
    """Invalid input: nan_point, nan_bearing, infinite_point, infinite_bearing, long_bearing."""
    kinds = ("nan_point", "nan_bearing", "infinite_point", "infinite_bearing", "long_bearing")
    if kind not in kinds:
        raise ValueError(f"kind must be {', '.join(kinds)}, got {kind}")
    given = cloud(rng, points)
    given.invalid = kind
    return given
