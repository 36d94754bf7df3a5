# SPDX-License-Identifier: Apache-2.0
"""Poses as files and command lines say them: where the camera stands and where it looks."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ._core import look_at

KEYS = ("position_m", "look_at_m", "up", "heading_deg", "tilt_deg", "tilt_towards_deg")


def upward_pose(position_m: Any, heading_deg: float, tilt_deg: float, towards_deg: float) -> Any:
    """cam_from_world of a camera that looks up, then leans by tilt towards an azimuth."""
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


def pose_from_file(path: str) -> Any:
    """cam_from_world of a JSON file: that key, or the 4x4 matrix itself."""
    data = json.loads(Path(path).read_text())
    matrix = data.get("cam_from_world") if isinstance(data, dict) else data
    pose = np.asarray(matrix, dtype=float)
    if pose.shape != (4, 4):
        raise ValueError(f"cam_from_world must be 4x4, got shape {pose.shape}")
    return pose


def pose_of(keys: Mapping[str, Any], where: str = "pose") -> Any:
    """cam_from_world of a mapping: position_m, and look_at_m with up, or angles of a camera that
    looks up. Raises: ValueError naming `where`, the key and its value."""
    from .suggest import refuse_unknown

    refuse_unknown(keys, KEYS, where)
    if "position_m" not in keys:
        raise ValueError(f"{where}.position_m is missing")
    position = _vector(keys, "position_m", where)
    if "look_at_m" in keys:
        for angle in KEYS[3:]:
            if angle in keys:
                raise ValueError(f"{where}.{angle} must be absent beside look_at_m")
        up = _vector(keys, "up", where) if "up" in keys else [0.0, 0.0, 1.0]
        return look_at(position, _vector(keys, "look_at_m", where), up)
    if "up" in keys:
        raise ValueError(f"{where}.up must be absent without look_at_m")
    return upward_pose(position, *(_number(keys.get(key, 0), f"{where}.{key}") for key in KEYS[3:]))


def _number(value: Any, name: str) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    raise ValueError(f"{name} must be a finite number, got {value!r}")


def _vector(keys: Mapping[str, Any], key: str, where: str) -> list[float]:
    value = keys[key]
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise ValueError(f"{where}.{key} must be 3 numbers, got {value!r}")
    return [_number(v, f"{where}.{key}[{i}]") for i, v in enumerate(value)]
