# SPDX-License-Identifier: Apache-2.0
"""PoseLib's solvers as rungs, if installed; their time is measured by calls from Python.

OpenCV's solvers are measured in C++, like those of libocc, because libocc links OpenCV.
"""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import libocc as occ

CALLS = 3  # the fastest call is used, because calls from Python are easily interrupted


@dataclass(frozen=True)
class Peer:
    """A rung called from Python. `prepare` is not timed; the function that it returns is timed."""

    name: str
    family: str
    description: str
    prepare: Callable[[Any, Any, occ.Camera], Callable[[], Any]]
    poses: Callable[[Any], list[Any]]  # poses (4, 4) from the returned value


@dataclass(frozen=True)
class Answer:
    cam_from_world: Any | None
    time_s: float


def answer(peer: Peer, points_m: Any, points_px: Any, camera: occ.Camera) -> Answer:
    """Calls a peer; of several poses the one with the smallest misfit is selected outside the measured time."""
    call = peer.prepare(points_m, points_px, camera)
    times = []
    for _ in range(CALLS):
        begun = time.thread_time()
        returned = call()
        times.append(time.thread_time() - begun)
    poses = [pose for pose in peer.poses(returned) if np.isfinite(pose).all()]
    best = min(poses, key=lambda pose: _misfit(pose, points_m, points_px, camera), default=None)
    return Answer(best, min(times))


def poselib_peers() -> list[Peer]:
    """Peers from PoseLib; empty if it is not installed."""
    try:
        poselib: Any = importlib.import_module("poselib")
    except ImportError:
        return []

    def p3p(points_m: Any, points_px: Any, camera: occ.Camera) -> Callable[[], Any]:
        wide = _wide_triple(points_m)
        bearings = np.array([camera.unproject(px) for px in points_px[wide]])
        points = points_m[wide]
        return lambda: poselib.p3p(bearings, points)

    def estimate(points_m: Any, points_px: Any, camera: occ.Camera) -> Callable[[], Any]:
        bearings = np.array([camera.unproject(px) for px in points_px])
        focal = camera.fx_px
        flat = bearings[:, :2] / bearings[:, 2:] * focal + [camera.cx_px, camera.cy_px]
        pinhole = {
            "model": "SIMPLE_PINHOLE", "width": camera.width, "height": camera.height,
            "params": [focal, camera.cx_px, camera.cy_px],
        }
        return lambda: poselib.estimate_absolute_pose(flat, points_m, pinhole)

    def pose_of(pose: Any) -> Any:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = pose.R, np.ravel(pose.t)
        return matrix

    return [
        Peer("p3p", "PoseLib", "three points; the others select the solution", p3p,
             lambda found: [pose_of(pose) for pose in found]),
        Peer("estimate", "PoseLib", "robust estimate from all points, refined", estimate,
             lambda found: [pose_of(found[0])] if found[1]["num_inliers"] >= 3 else []),
    ]


def _wide_triple(points: Any) -> list[int]:
    """Indices of three points with a large triangle."""
    a = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    b = int(np.argmax(np.linalg.norm(points - points[a], axis=1)))
    across = np.linalg.norm(np.cross(points - points[a], points[b] - points[a]), axis=1)
    return [a, b, int(np.argmax(across))]


def _misfit(pose: Any, points_m: Any, points_px: Any, camera: occ.Camera) -> float:
    total = 0.0
    for point, seen in zip(points_m, points_px):
        px = camera.project(pose[:3, :3] @ point + pose[:3, 3])
        if px is None:
            return float("inf")
        total += float(np.sum((px - seen) ** 2))
    return total
