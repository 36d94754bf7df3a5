# SPDX-License-Identifier: Apache-2.0
"""Classification of a solver's answer."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from .cases import Case
from .conditioning import EPSILON, Reference, long_norm
from .instances import Instance
from .methods import Answer

SOLVED_WITHIN = 1e-6  # tolerance of rotation [rad] and relative translation; larger for ill-conditioned problems
FITS_WITHIN_RAD = 1e-6  # max residual of the bearings of a solution


class Outcome(Enum):
    """Outcomes from best to worst; the worst applicable one is assigned."""

    solved = "the true pose and all other solutions are returned"
    refused = "no pose is returned"
    dropped = "existing solutions are missing"
    inexact = "fits the bearings, but its error exceeds the limit from the conditioning"
    wrong = "a pose that does not fit or has a point behind the camera, or a pose of an undetermined problem"
    nan = "values that are not finite"

    @property
    def severity(self) -> int:
        return list(Outcome).index(self)


@dataclass(frozen=True)
class Judgement:
    outcome: Outcome
    right: bool  # correct result; the refusal of a solvable problem is not correct
    over_allowed: float = np.nan  # error divided by the limit from rounding, if the pose was found


def misfit_rad(instance: Instance, cam_from_world: Any) -> float:
    """Max angle between a bearing and the direction of its point."""
    pose = np.asarray(cam_from_world, dtype=np.longdouble)
    in_cam = instance.points.astype(np.longdouble) @ pose[:3, :3].T + pose[:3, 3]
    seen = instance.bearings.astype(np.longdouble)
    apart = in_cam / long_norm(in_cam)[:, None] - seen / long_norm(seen)[:, None]
    return float(2 * np.arcsin(min(1.0, float(long_norm(apart).max()) / 2)))


def is_rotation(matrix: Any) -> bool:
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return bool(off < SOLVED_WITHIN and np.linalg.det(matrix) > 0)


def _fits(instance: Instance, cam_from_world: Any) -> bool:
    """True if a pose reproduces the bearings, with a tolerance for the rounding of the coordinates."""
    if not is_rotation(cam_from_world[:3, :3]):
        return False
    in_cam = instance.points @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    nearest = np.linalg.norm(in_cam, axis=1).min()
    tolerance = 8 * EPSILON * np.abs(instance.points).max() / max(nearest, 1e-300)
    return misfit_rad(instance, cam_from_world) <= FITS_WITHIN_RAD + float(tolerance)


def judge(case: Case, instance: Instance, answer: Answer) -> Judgement:
    """Classifies the answer to one problem."""
    refusal_is_right = case.verdict != "solved"
    if not all(np.isfinite(pose).all() for pose in answer.poses):
        return Judgement(Outcome.nan, False)
    if not answer.poses:
        if case.verdict == "either" and any(s.real for s in instance.solutions or ()):
            refusal_is_right = False
        return Judgement(Outcome.refused, refusal_is_right)
    if case.verdict in ("refused", "error"):
        return Judgement(Outcome.wrong, False)
    if not all(_fits(instance, pose) for pose in answer.poses):
        return Judgement(Outcome.wrong, False)
    return _of_fitting(case, instance, answer)


def _of_fitting(case: Case, instance: Instance, answer: Answer) -> Judgement:
    centroid = instance.points.astype(np.longdouble).mean(0)

    def nearest(pose: Reference) -> float:
        return min(pose.error(given, centroid) for given in answer.poses)

    def limit(pose: Reference) -> float:
        return max(SOLVED_WITHIN, pose.allowed(case.tolerance_factor))

    ratio = np.nan
    if instance.truth is not None:
        error = nearest(instance.truth)
        if error > limit(instance.truth):
            return Judgement(_missed(instance, answer, centroid, limit), False)
        ratio = error / instance.truth.allowed(case.tolerance_factor)
    for solution in instance.solutions or ():
        if solution.real and nearest(solution.pose) > limit(solution.pose):
            return Judgement(Outcome.dropped, False, ratio)
    return Judgement(Outcome.solved, True, ratio)


def _missed(instance: Instance, answer: Answer, centroid: Any, limit: Any) -> Outcome:
    """Outcome of poses that fit without the true pose among them."""
    if instance.size < 3:
        return Outcome.wrong  # one of infinitely many solutions
    known = [solution.pose for solution in instance.solutions or ()]
    if known and all(any(k.error(p, centroid) <= limit(k) for k in known) for p in answer.poses):
        return Outcome.dropped
    return Outcome.inexact
