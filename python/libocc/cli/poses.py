# SPDX-License-Identifier: Apache-2.0
"""Camera poses in files and on command lines: position, and viewing direction or angles."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._core import Scene, look_at
from ..yaml_files import number, refuse_unknown

KEYS = ("position_m", "look_at_m", "up", "heading_deg", "tilt_deg", "tilt_towards_deg")


def upward_pose(position_m: Any, heading_deg: float, tilt_deg: float, towards_deg: float) -> Any:
    """cam_from_world of a camera that looks up and is then tilted towards an azimuth.

    heading_deg: azimuth of the image's +x axis before the tilt. towards_deg: azimuth of the tilt.
    """
    azimuth, tilt, towards = (math.radians(a) for a in (heading_deg, tilt_deg, towards_deg))
    right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    forward = np.array([0.0, 0.0, 1.0])
    level = np.stack([right, np.cross(forward, right), forward])
    k = np.array([-math.sin(towards), math.cos(towards), 0.0])
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    lean = np.eye(3) + math.sin(tilt) * cross + (1 - math.cos(tilt)) * cross @ cross
    rotation = level @ lean.T
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ np.asarray(position_m)
    return pose


def facing_pose(scene: Scene) -> Any:
    """cam_from_world of a camera that faces the lamps from a distance at which all are in view.

    The distance is limited to 0.9 times the distance to the wall of the room.
    Raises: ValueError when there are no lamps or their normals cancel.
    """
    if not scene.lamps:
        raise ValueError("lamps must not be empty without a given pose")
    centres = np.array([lamp.centre_m for lamp in scene.lamps])
    towards = -np.mean([lamp.normal for lamp in scene.lamps], axis=0)
    if np.linalg.norm(towards) < 1e-6:
        raise ValueError("the normals of the lamps cancel: give a pose")
    towards /= np.linalg.norm(towards)
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    spread = np.linalg.norm(centres - middle, axis=1).max()
    camera = scene.camera
    narrowest = min(camera.width, camera.height) / 2 / max(camera.fx_px, camera.fy_px)
    distance = max(0.5, 1.5 * spread / narrowest)
    if scene.room is not None:
        distance = min(distance, 0.9 * _distance_to_wall(middle, -towards, scene.room.size_m))
    position = middle - distance * towards
    up = np.eye(3)[np.argmin(np.abs(towards))]
    return look_at(position, middle, up)


def _distance_to_wall(start: Any, direction: Any, size_m: Any) -> float:
    distances = [
        ((size if part > 0 else 0.0) - at) / part
        for at, part, size in zip(start, direction, size_m, strict=True)
        if abs(part) > 1e-9
    ]
    return float(min(distances))


def pose_from_file(path: str) -> Any:
    """Reads cam_from_world from a JSON file: the value of that key, or the 4x4 matrix itself."""
    data = json.loads(Path(path).read_text())
    matrix = data.get("cam_from_world") if isinstance(data, dict) else data
    pose = np.asarray(matrix, dtype=float)
    if pose.shape != (4, 4):
        raise ValueError(f"cam_from_world must be 4x4, got shape {pose.shape}")
    return pose


def pose_of(keys: Mapping[str, Any], where: str = "pose") -> Any:
    """cam_from_world from a mapping with position_m and either look_at_m and up, or the angles of upward_pose().

    Raises: ValueError naming `where`, the key and its value.
    """
    refuse_unknown(keys, KEYS, where)
    if "position_m" not in keys:
        raise ValueError(f"{where}.position_m is missing")
    position = _vector(keys, "position_m", where)
    if "look_at_m" in keys:
        for angle in KEYS[3:]:
            if angle in keys:
                raise ValueError(f"{where}.{angle} must not be given together with look_at_m")
        up = _vector(keys, "up", where) if "up" in keys else [0.0, 0.0, 1.0]
        return look_at(position, _vector(keys, "look_at_m", where), up)
    if "up" in keys:
        raise ValueError(f"{where}.up must be absent without look_at_m")
    return upward_pose(position, *(number(keys.get(key, 0), f"{where}.{key}") for key in KEYS[3:]))


def _vector(keys: Mapping[str, Any], key: str, where: str) -> list[float]:
    value = keys[key]
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise ValueError(f"{where}.{key} must be 3 numbers, got {value!r}")
    return [number(v, f"{where}.{key}[{i}]") for i, v in enumerate(value)]
