# SPDX-License-Identifier: Apache-2.0
"""Trajectories from files in TUM format or from waypoints in YAML."""

import math
from pathlib import Path
from typing import Any

from ..._core import Trajectory
from ...yaml_files import read_yaml, refuse_unknown
from ..poses import KEYS, pose_of

SCHEMA = "libocc-trajectory/1"


def load_trajectory(path: str) -> Trajectory:
    """Reads a trajectory: YAML if the name ends with .yaml or .yml, else TUM format.

    Raises: OSError; ValueError naming the file and the line or waypoint.
    """
    if Path(path).suffix not in (".yaml", ".yml"):
        return Trajectory.load(path)
    data = read_yaml(path)
    try:
        return waypoints_of(data)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def waypoints_of(data: Any) -> Trajectory:
    """Trajectory from the content of a YAML file."""
    if not isinstance(data, dict):
        raise ValueError("must be a mapping with `schema` and `waypoints`")
    refuse_unknown(data, ("schema", "waypoints"), "trajectory")
    if data.get("schema") != SCHEMA:
        raise ValueError(f"schema must be {SCHEMA}, got {data.get('schema')!r}")
    waypoints = data.get("waypoints")
    if not isinstance(waypoints, list) or not waypoints:
        raise ValueError(f"waypoints must be a list of at least one, got {waypoints!r}")
    times, poses = [], []
    for i, waypoint in enumerate(waypoints):
        where = f"waypoints[{i}]"
        if not isinstance(waypoint, dict):
            raise ValueError(f"{where} must be a mapping, got {waypoint!r}")
        refuse_unknown(waypoint, ("time_s", *KEYS), where)
        time_s = waypoint.get("time_s")
        if isinstance(time_s, bool) or not isinstance(time_s, (int, float)) or not math.isfinite(time_s):
            raise ValueError(f"{where}.time_s must be a finite number, got {time_s!r}")
        times.append(float(time_s))
        poses.append(pose_of({k: v for k, v in waypoint.items() if k != "time_s"}, where))
    return Trajectory(times, poses)
