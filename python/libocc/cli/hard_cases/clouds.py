# SPDX-License-Identifier: Apache-2.0
"""Generators of any number of points: scales, offsets, rotations, depths, and input that is wrong."""

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
    """Points anywhere in a cone about the optical axis.

    depth_m: a range, on a logarithmic scale. rotation: of cam_from_world: any, identity, half_turn
    (about any axis), half_turn_x, _y, _z. offset_m: of the world's origin. scale: of everything.
    behind: so many points are behind the camera; where lines through a pinhole would image them,
    their bearings point away from them. duplicates: so many points lie on the first one.
    """
    low, high = np.log(depth_m[0]), np.log(depth_m[1])
    while True:
        depths = np.exp(rng.uniform(low, high, points))
        if high - low > 3:  # both ends, every time
            depths[:2] = depth_m
        in_cam = cone(rng, points, half_angle_rad) * depths[:, None]
        if points < 3 or area_share(in_cam[:3] / depths[:3, None]) > 0.2:
            break
    in_cam[:behind] *= -1
    for i in range(points - duplicates, points):
        in_cam[i] = in_cam[0]
    turned = _rotation(rng, rotation)
    position = ex.exact(rng.normal(size=3))
    away = ex.exact(np.round(offset_m * rng.uniform(0.5, 1, 3) * rng.choice([-1, 1], 3)))
    size = ex.exact(scale)[()]
    world = (ex.exact(in_cam) @ turned + position + away) * size
    return View(world, turned, (position + away) * size, tuple(range(behind)))


def target(
    rng: Random,
    points: int,
    size_m: float = 0.1,
    distance_m: float = 10.0,
    tilt_deg: Any = (10, 60),
    thickness: float = 0.0,
) -> View:
    """A small plane figure far away: a square's corners, or points in that square.

    thickness: points leave the plane by up to so many times its size.
    """
    while True:
        corners = SQUARE[:points] / 2 if points in (3, 4) else rng.uniform(-0.5, 0.5, (points, 2))
        if area_share(np.pad(corners[:3], ((0, 0), (0, 1)))) > 0.3:
            break
    bumps = rng.uniform(-1, 1, points) * thickness
    figure = ex.exact(np.column_stack([corners, bumps]) * size_m)
    turned = any_rotation(rng)
    tilt, around = np.radians(pick(rng, tilt_deg)), rng.uniform(0, 2 * np.pi)
    away = [np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)]
    world = figure @ turned.T
    position = turned @ ex.exact(np.array(away) * distance_m)
    return View(world, looking_at(rng, world.sum(0) / points, position), position)


def grazing(rng: Random, points: int, angle_rad: float = 1e-3) -> View:
    """One point by angle_rad above the plane through the camera across its axis."""
    while True:
        in_cam = cone(rng, points, 0.7) * rng.uniform(2, 6, (points, 1))
        around = rng.uniform(0, 2 * np.pi)
        in_cam[0] = rng.uniform(2, 6) * np.array([np.cos(around), np.sin(around), np.tan(angle_rad)])
        if area_share(in_cam[:3]) > 0.3:
            break
    turned, position = any_rotation(rng), ex.exact(rng.normal(size=3))
    return View(ex.exact(in_cam) @ turned + position, turned, position)


def cube(rng: Random, points: int) -> View:
    """Corners of a cube seen along the normal of a face; the camera's axes are the cube's."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])[:points]
    size, distance = rng.uniform(0.2, 1), rng.uniform(3, 8)
    position = ex.exact([0, 0, -distance])
    return View(ex.exact(corners * size), about([0, 0, 1], 0), position)


def mismatched(rng: Random, points: int) -> View:
    """Bearings of other points than those given: they fit nothing, or `instances` draws again."""
    given = cloud(rng, points)
    given.of_others = cloud(rng, points, half_angle_rad=0.9).bearings()
    return given


def bad_input(rng: Random, points: int, kind: str = "nan_point") -> View:
    """A caller's mistake: nan_point, nan_bearing, infinite_point, infinite_bearing, long_bearing."""
    kinds = ("nan_point", "nan_bearing", "infinite_point", "infinite_bearing", "long_bearing")
    if kind not in kinds:
        raise ValueError(f"kind must be {', '.join(kinds)}, got {kind}")
    given = cloud(rng, points)
    given.spoilt = kind
    return given
