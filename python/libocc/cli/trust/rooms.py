# SPDX-License-Identifier: Apache-2.0
"""Random rooms, camera poses and blobs whose truth is known."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libocc as occ

Array = NDArray[np.float64]
Random = np.random.Generator

CEILING_M = 3.0
LAMP_RADIUS_M = 0.05
WIDTH_PX, HEIGHT_PX = 1280, 960
CX_PX, CY_PX = (WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2


def pinhole(focal_px: float) -> occ.Camera:
    return occ.Camera.pinhole(
        width=WIDTH_PX, height=HEIGHT_PX, fx_px=focal_px, fy_px=focal_px, cx_px=CX_PX, cy_px=CY_PX
    )


def wide_camera(kind: int) -> occ.Camera:
    """Pinhole camera of 110 degrees, fisheye of 180 degrees, or double sphere camera, for kind 0, 1, 2."""
    if kind == 1:
        return occ.Camera.fisheye(
            width=WIDTH_PX, height=HEIGHT_PX, fx_px=330, fy_px=330, cx_px=CX_PX, cy_px=CY_PX,
            distortion=[0.02, -0.005, 0.001, 0],
        )
    if kind == 2:
        return occ.Camera.double_sphere(
            width=WIDTH_PX, height=HEIGHT_PX, fx_px=300, fy_px=300, cx_px=CX_PX, cy_px=CY_PX, xi=-0.2, alpha=0.6
        )
    return pinhole(450)


def grid_room(camera: occ.Camera, side: int, width_m: float, jitter_m: float, random: Random) -> occ.Scene:
    """Ceiling with side x side lamps on a grid; `jitter_m`: standard deviation of their displacements."""
    lamps = []
    for i in range(side * side):
        place = (np.array([i % side, i // side]) + 0.5) * width_m / side + jitter_m * random.normal(size=2)
        lamps.append(
            occ.Lamp(id=i, centre_m=[*place, CEILING_M], normal=[0, 0, -1], radius_m=LAMP_RADIUS_M)
        )
    return occ.Scene(camera=camera, lamps=lamps)


def upward_pose(width_m: float, random: Random) -> Array:
    """cam_from_world of a camera in the middle of a room that faces the ceiling, tilted by at most 0.4 rad."""
    position = np.array([*random.uniform(0.2, 0.8, 2) * width_m, random.uniform(0.3, 1.2)])
    tilt, azimuth, roll = random.uniform(0, 0.4), *random.uniform(0, 2 * np.pi, 2)
    ahead = [np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)]
    return occ.look_at(position, position + ahead, up=[np.cos(roll), np.sin(roll), 0])


def spot(px: Any, sigma_px: float) -> occ.Blob:
    """Blob of equal brightness and size as all others, so that only its position can identify it."""
    return occ.Blob(centroid_px=px, covariance_px2=sigma_px**2 * np.eye(2), flux_dn=1000, area_px=20)


def false_lights(count: int, camera: occ.Camera, sigma_px: float, random: Random) -> list[occ.Blob]:
    """Blobs at uniformly distributed pixels."""
    size = [camera.width - 1, camera.height - 1]
    return [spot(random.uniform([0, 0], size), sigma_px) for _ in range(count)]


def lamp_blobs(scene: occ.Scene, pose: Array, sigma_px: float, random: Random) -> list[occ.Blob]:
    """Blobs of the lamps in view, with noise."""
    blobs = []
    for lamp in scene.lamps:
        px = occ.rendering.project_lamp_centre(lamp, pose, scene.camera)
        if px is not None and scene.camera.contains(px):
            blobs.append(spot(px + sigma_px * random.normal(size=2), sigma_px))
    return blobs


def without_dark(blobs: Sequence[occ.Blob], share: float, random: Random) -> list[occ.Blob]:
    """Blobs of the lamps that are on; each lamp is off with the probability `share`."""
    return [blob for blob in blobs if random.uniform() >= share]


def noise_px(random: Random) -> float:
    """Standard deviation of a blob's position between 0.03 and 0.5 px."""
    return float(10 ** random.uniform(-1.5, -0.3))


def gravity_in_cam(pose: Array, sigma_rad: float, random: Random) -> Array:
    """Measured direction of gravity: the true one turned by normally distributed angles."""
    down: Array = -pose[:3, 2]
    measured = down + np.cross(sigma_rad * random.normal(size=3), down)
    return np.asarray(measured / np.linalg.norm(measured))


def heading_rad(pose: Array) -> float:
    """Azimuth of the camera's x axis."""
    return float(np.arctan2(pose[0, 1], pose[0, 0]))
