# SPDX-License-Identifier: Apache-2.0
"""Common interface to the solvers of libocc, OpenCV and PoseLib."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import libocc as occ

from .instances import Instance

OWN = ("auto", "p3p")  # must solve or refuse every problem


@dataclass(frozen=True)
class Answer:
    """Result of a solver: poses, none, or an exception."""

    poses: tuple[Any, ...] = ()  # (4, 4) each
    raised: str = ""  # type and text of an exception


@dataclass(frozen=True)
class Method:
    """A solver with its number of points."""

    name: str
    family: str  # "libocc", or package and version
    call: Callable[[Instance], Sequence[Any]]
    min_points: int = 0  # fewer points must not be passed
    max_points: int = 0  # 0: any number
    unit_bearings: bool = True  # False: the solver uses image points, whose bearings have no length

    def takes(self, instance: Instance) -> bool:
        if self.family != "libocc" and instance.size < self.min_points:
            return False
        if not self.unit_bearings and np.isfinite(instance.bearings).all():
            if np.abs(np.linalg.norm(instance.bearings, axis=1) - 1).max(initial=0) > 1e-6:
                return False
        return self.max_points == 0 or instance.size <= self.max_points

    def answer(self, instance: Instance) -> Answer:
        try:
            return Answer(tuple(np.asarray(pose) for pose in self.call(instance)))
        except Exception as error:  # an exception counts as a refusal
            return Answer(raised=f"{type(error).__name__}: {' '.join(str(error).split())}")


def _libocc(name: str, needs_up: bool) -> Callable[[Instance], list[Any]]:
    def call(instance: Instance) -> list[Any]:
        up = instance.up_in_cam if needs_up else None
        found = occ.pose_candidates(instance.bearings, instance.points, solver=name, up_in_cam=up)
        if found.status is not occ.Status.ok:
            return []
        return [candidate.cam_from_world for candidate in found.value]

    return call


def own_methods() -> list[Method]:
    """`auto` and every solver of `occ.solvers()`."""
    listed = [
        Method(s.name, "libocc", _libocc(s.name, s.needs_up), s.min_points, s.max_points)
        for s in occ.solvers()
    ]
    return [Method("auto", "libocc", _libocc("auto", False)), *listed]


def peer_methods() -> tuple[list[Method], list[str]]:
    """Methods of the installed peer packages, and the names of the missing packages."""
    methods: list[Method] = []
    missing = []
    for package, listed in (("cv2", _opencv), ("poselib", _poselib)):
        try:
            module = importlib.import_module(package)
        except ImportError:
            missing.append("opencv-python-headless" if package == "cv2" else package)
        else:
            methods += listed(module)
    return methods, missing


def _opencv(cv2: Any) -> list[Method]:
    family = f"OpenCV {cv2.__version__}"

    def caller(flag: int, three: bool) -> Callable[[Instance], list[Any]]:
        def call(instance: Instance) -> list[Any]:
            with np.errstate(all="ignore"):
                image = instance.bearings[:, :2] / instance.bearings[:, 2:]
            image, points = image.reshape(-1, 1, 2), instance.points.reshape(-1, 1, 3)
            if three and instance.size == 3:
                _, rotations, translations = cv2.solveP3P(points, image, np.eye(3), None, flags=flag)
                return [_pose(cv2.Rodrigues(r)[0], t) for r, t in zip(rotations, translations)]
            found, rotation, translation = cv2.solvePnP(points, image, np.eye(3), None, flags=flag)
            return [_pose(cv2.Rodrigues(rotation)[0], translation)] if found else []

        return call

    minimal, general = ("P3P", "AP3P"), (("EPNP", 4), ("IPPE", 4), ("SQPNP", 3), ("ITERATIVE", 4))
    flags = {name: getattr(cv2, f"SOLVEPNP_{name}") for name in (*minimal, *dict(general))}
    return [
        *(Method(name, family, caller(flags[name], True), 3, 4, False) for name in minimal),
        *(Method(name, family, caller(flags[name], False), low, 0, False) for name, low in general),
    ]


def _poselib(poselib: Any) -> list[Method]:
    def call(instance: Instance) -> list[Any]:
        found = poselib.p3p(instance.bearings, instance.points)
        return [_pose(pose.R, pose.t) for pose in found]

    version = getattr(poselib, "__version__", "")
    return [Method("p3p", f"PoseLib {version}".strip(), call, 3, 3)]


def _pose(rotation: Any, translation: Any) -> Any:
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = np.ravel(translation)
    return pose
